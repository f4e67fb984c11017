//! `semver`: does the public interface of each library still fit its version?
//!
//! What was released last is named in `xtask/release.toml`, as a commit: nothing has to be published for that, and no file has to be
//! kept beside the sources. Interfaces are compared by `cargo-semver-checks`, with all features. What is removed or changed wants the next
//! version (`docs/reference/versions.md`); what is added does not. A library whose sources are those of the release is not looked at. It cannot see whether something of the same signature behaves differently.

use crate::arguments::Arguments;
use crate::cargo_tool::cargo_tool;
use crate::commit::sources;
use crate::repository::{Failure, Library, Repository, run as run_program};
use std::fs;
use toml_edit::{DocumentMut, Item};

const RELEASE: &str = "xtask/release.toml";
const TOOL: (&str, &str) = ("cargo-semver-checks", "0.51.0");
/// Its interface is a macro, of which the tool knows nothing: what may be written in a table is tested by `stampfly-bus/tests/ui`.
const MACROS: &str = "stampfly-bus-macros";

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let text = fs::read_to_string(repository.root.join(RELEASE)).map_err(|e| format!("{RELEASE}: {e}"))?;
    let commit = released(&text).map_err(|e| format!("{RELEASE}: {e}"))?;
    let mut check = cargo_tool(repository, TOOL.0, TOOL.1)?;
    let baseline = sources(repository, &commit)?;
    let mut libraries = repository.libraries()?;
    libraries.retain(|library| library.published && library.name != MACROS);
    let (known, new): (Vec<&Library>, Vec<&Library>) =
        libraries.iter().partition(|library| baseline.join(&library.folder).join("Cargo.toml").exists());
    for library in &new {
        println!("{} is new since {commit}", library.name);
    }
    // Nothing to compare would look just like nothing to object to.
    if known.is_empty() {
        return Err(format!("no library of today is in {commit}"));
    }
    let mut changed = Vec::new();
    for library in known {
        let sources = ["src", "Cargo.toml"].map(|name| library.folder.join(name));
        let mut diff = repository.command("git");
        let same = diff.args(["diff", "--quiet", &commit, "--"]).args(sources).status().map_err(|e| e.to_string())?;
        if !same.success() {
            changed.push(library);
        }
    }
    if changed.is_empty() {
        println!("no library has changed since {commit}");
        return Ok(());
    }
    check
        .args(["semver-checks", "check-release", "--all-features", "--color", "never", "--baseline-root"])
        .arg(&baseline);
    check.args(changed.iter().flat_map(|library| ["-p", &library.name]));
    check.env("CARGO_TARGET_DIR", repository.target("semver"));
    run_program(&mut check).map_err(|e| {
        format!("{e}: an interface has changed more than its version; docs/reference/versions.md says what to do")
    })
}

/// The commit of the last release.
fn released(text: &str) -> Result<String, Failure> {
    let document: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| e.to_string())?;
    let commit = document.get("commit").and_then(Item::as_str).ok_or("no `commit`")?;
    let is_whole = commit.len() == 40 && commit.chars().all(|digit| digit.is_ascii_hexdigit());
    if is_whole { Ok(commit.to_owned()) } else { Err(format!("`{commit}` is no commit's 40 digits")) }
}

#[cfg(test)]
mod tests {
    use super::released;

    #[test]
    fn a_release_is_a_whole_commit() {
        let commit = "0123456789abcdef0123456789abcdef01234567";
        assert_eq!(released(&format!("commit = \"{commit}\"\n")), Ok(commit.to_owned()));
        assert!(released("commit = \"main\"\n").is_err());
        assert!(released("version = \"0.2.0\"\n").is_err());
    }
}
