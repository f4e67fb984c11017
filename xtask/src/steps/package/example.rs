//! The first example of each README, in a program that added that crate alone.
//!
//! The program is made as its reader makes it: `cargo new`, `cargo add`, paste, `cargo run`. What it gets is the archive that would be
//! published, from a folder that stands for the registry. So it shows an example that does not compile, a crate whose signatures need
//! a second one, a feature that one forgot to ask for because a neighbour does, and a file that is in no archive.

use crate::repository::{Failure, Library, Repository, run as run_program};
use std::fs;
use std::path::{Path, PathBuf};

/// Libraries that nobody adds by themselves: the macros come with the bus, the others belong to the program.
const NOT_ALONE: &[&str] = &["stampfly-bus-macros", "stampfly-host", "stampfly-lab"];

/// Runs them all, from the archives in this folder.
pub fn run(repository: &Repository, archives: &Path, libraries: &[Library]) -> Result<(), Failure> {
    let place = std::env::temp_dir().join(format!("stampfly-first-examples-{}", std::process::id()));
    let outcome = registry(repository, archives, &place, libraries).and_then(|registry| {
        let mut alone = libraries.iter().filter(|library| !NOT_ALONE.contains(&library.name.as_str()));
        alone.try_for_each(|library| program(repository, library, &registry, &place))
    });
    // Nothing depends on its removal.
    let _ = fs::remove_dir_all(&place);
    outcome
}

/// A folder that stands for the registry: our archives, unpacked, and what they depend on, from cargo's own cache.
fn registry(repository: &Repository, archives: &Path, place: &Path, libraries: &[Library]) -> Result<PathBuf, Failure> {
    let folder = place.join("registry");
    let everything = place.join("everything");
    write(&everything.join("src/lib.rs"), "")?;
    let mut manifest = String::from("[package]\nname = \"everything\"\nedition = \"2024\"\n\n[workspace]\n\n");
    let (mut dependencies, mut patches) = (String::from("[dependencies]\n"), String::from("\n[patch.crates-io]\n"));
    for library in libraries {
        let (name, archive) = (&library.name, archive(archives, library)?);
        fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        run_program(repository.command("tar").arg("-xzf").arg(&archive.path).arg("-C").arg(&folder))?;
        let unpacked = folder.join(&archive.name);
        // Nothing to compare with: the archive is the only copy there is.
        write(&unpacked.join(".cargo-checksum.json"), r#"{"files":{}}"#)?;
        dependencies += &format!("{name} = \"*\"\n");
        patches += &format!("{name} = {{ path = {unpacked:?} }}\n");
    }
    manifest += &dependencies;
    manifest += &patches;
    write(&everything.join("Cargo.toml"), &manifest)?;
    // The same versions as in the workspace; cargo strikes out what is not needed.
    fs::copy(repository.root.join("Cargo.lock"), everything.join("Cargo.lock"))
        .map_err(|e| format!("Cargo.lock: {e}"))?;
    let mut vendor = repository.cargo();
    vendor.current_dir(&everything).args(["vendor", "--quiet", "--versioned-dirs", "--no-delete"]).arg(&folder);
    run_program(vendor.stdout(std::process::Stdio::null()))?;
    Ok(folder)
}

struct Archive {
    path: PathBuf,
    /// With its version, as the folder inside is called.
    name: String,
}

fn archive(archives: &Path, library: &Library) -> Result<Archive, Failure> {
    let entries = fs::read_dir(archives).map_err(|e| format!("{}: {e}", archives.display()))?;
    let mut archives = entries.flatten().filter_map(|entry| {
        let path = entry.path();
        let name = path.file_name()?.to_str()?.strip_suffix(".crate")?.to_owned();
        library.is_called(&name).then_some(Archive { path, name })
    });
    archives.next().ok_or_else(|| format!("`{}` has no archive", library.name))
}

fn program(repository: &Repository, library: &Library, registry: &Path, place: &Path) -> Result<(), Failure> {
    let name = library.name.as_str();
    let readme = repository.root.join(&library.folder).join("README.md");
    let text = fs::read_to_string(&readme).map_err(|e| format!("{}: {e}", readme.display()))?;
    let example =
        first_example(&text).ok_or_else(|| format!("{} has no example with a `fn main`", readme.display()))?;
    let folder = place.join(name);
    let source = "[source.crates-io]\nreplace-with = \"here\"\n\n[source.here]\n";
    write(&folder.join(".cargo/config.toml"), &format!("{source}directory = {registry:?}\n"))?;
    write(&folder.join("Cargo.toml"), "[package]\nname = \"first-example\"\nedition = \"2024\"\n\n[workspace]\n")?;
    write(&folder.join("src/main.rs"), &example)?;
    eprintln!("first example of {name}");
    let cargo = |arguments: &[&str]| {
        let mut cargo = repository.cargo();
        cargo.current_dir(&folder).env("CARGO_PROFILE_DEV_DEBUG", "false").arg("--quiet").args(arguments);
        cargo
    };
    run_program(&mut cargo(&["add", name]))?;
    run_program(cargo(&["run", "--target-dir"]).arg(repository.target("first-examples")))
}

/// The first Rust block of a page, if it is a program.
fn first_example(page: &str) -> Option<String> {
    let (_, rest) = page.split_once("\n```rust\n")?;
    let (code, _) = rest.split_once("\n```")?;
    code.contains("fn main()").then(|| format!("{code}\n"))
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    let io = |e: std::io::Error| format!("{}: {e}", path.display());
    fs::create_dir_all(path.parent().unwrap_or(path)).map_err(io)?;
    fs::write(path, text).map_err(io)
}

#[cfg(test)]
mod tests {
    use super::first_example;

    #[test]
    fn only_a_whole_program_is_an_example() {
        let page = "# A\n\n```toml\nx = 1\n```\n\n```rust\nfn main() {}\n```\n\n```rust\nfn main() { panic!() }\n```\n";
        assert_eq!(first_example(page).as_deref(), Some("fn main() {}\n"));
        assert_eq!(first_example("# A\n\n```rust\nassert!(true);\n```\n"), None);
        assert_eq!(first_example("# A\n"), None);
    }
}
