//! The copy of the sources that has the bugs, in cargo's folder for generated files.
//!
//! Files that have not changed keep their time, so that cargo builds again only what has.

use super::guard::{MODULE, with_bugs, with_module};
use super::list::Bug;
use crate::repository::{Failure, Repository, capture, run as run_program};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

const TREE: &str = "bugs/tree";
/// Its own, for packages of the same names in another folder would be built in turns.
const BUILD: &str = "bugs/build";

/// Makes the copy, builds it, and returns the program.
pub fn built(repository: &Repository, bugs: &[Bug]) -> Result<PathBuf, Failure> {
    let [tree, build] = [TREE, BUILD].map(|name| repository.target(name));
    let files = files(repository, bugs)?;
    copy(&repository.root, &tree, &files)?;
    let mut cargo = repository.cargo();
    cargo.current_dir(&tree).args(["build", "--quiet", "--release", "--locked", "--bin", "stampfly", "--target-dir"]);
    // Guards have parentheses where none are needed, and every bug would be told.
    cargo.arg(&build).env("RUSTFLAGS", "-Awarnings");
    run_program(&mut cargo)?;
    Ok(build.join("release/stampfly"))
}

/// Every file of the repository, and what its copy holds where that is something else.
fn files(repository: &Repository, bugs: &[Bug]) -> Result<BTreeMap<PathBuf, Option<String>>, Failure> {
    let mut list = repository.command("git");
    let (list, _) = capture(list.args(["ls-files", "--cached", "--others", "--exclude-standard"]))?;
    let there = list.lines().filter(|name| repository.root.join(name).is_file());
    let mut files: BTreeMap<PathBuf, Option<String>> = there.map(|name| (name.into(), None)).collect();
    for file in bugs.iter().map(|bug| &bug.file).collect::<BTreeSet<_>>() {
        let here: Vec<_> = bugs.iter().filter(|bug| bug.file == *file).collect();
        let source = read(&repository.root, Path::new(file))?;
        files.insert(file.into(), Some(with_bugs(&source, &here)?));
        let folder = source_folder(Path::new(file)).ok_or_else(|| format!("{file} is in no `src`"))?;
        let root = folder.join("lib.rs");
        // A bug may be in the root file itself.
        let text = files.get(&root).cloned().flatten().map_or_else(|| read(&repository.root, &root), Ok)?;
        if files.insert(folder.join("reinserted.rs"), Some(MODULE.to_owned())).is_none() {
            files.insert(root, Some(with_module(&text)));
        }
    }
    Ok(files)
}

/// The folder of the crate's root file.
fn source_folder(file: &Path) -> Option<PathBuf> {
    file.ancestors().find(|folder| folder.ends_with("src")).map(Path::to_owned)
}

fn read(root: &Path, name: &Path) -> Result<String, Failure> {
    fs::read_to_string(root.join(name)).map_err(|e| format!("{}: {e}", name.display()))
}

/// Makes the folder `to` hold these files and no others.
fn copy(from: &Path, to: &Path, files: &BTreeMap<PathBuf, Option<String>>) -> Result<(), Failure> {
    for (name, text) in files {
        let (source, copy) = (from.join(name), to.join(name));
        let io = |e: std::io::Error| format!("{}: {e}", name.display());
        let bytes =
            text.as_ref().map_or_else(|| fs::read(&source), |text| Ok(text.clone().into_bytes())).map_err(io)?;
        if fs::read(&copy).is_ok_and(|there| there == bytes) {
            continue;
        }
        fs::create_dir_all(copy.parent().unwrap_or(to)).map_err(io)?;
        fs::write(&copy, bytes).map_err(io)?;
    }
    remove_others(to, to, files).map_err(|e| format!("{}: {e}", to.display()))
}

fn remove_others(top: &Path, folder: &Path, files: &BTreeMap<PathBuf, Option<String>>) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            remove_others(top, &path, files)?;
        } else if path.strip_prefix(top).is_ok_and(|name| !files.contains_key(name)) {
            fs::remove_file(path)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_has_the_changed_text_and_no_old_files() {
        let top = std::env::temp_dir().join(format!("stampfly-bugs-{}", std::process::id()));
        let (from, to) = (top.join("from"), top.join("to"));
        fs::create_dir_all(from.join("src")).expect("a folder");
        fs::write(from.join("src/a.rs"), "right").expect("a file");
        fs::write(from.join("b"), "same").expect("a file");
        let files = |names: &[(&str, Option<&str>)]| {
            names.iter().map(|(name, text)| (name.into(), text.map(str::to_owned))).collect::<BTreeMap<_, _>>()
        };
        copy(&from, &to, &files(&[("src/a.rs", Some("wrong")), ("b", None)])).expect("a copy");
        let time = || fs::metadata(to.join("b")).and_then(|data| data.modified()).expect("a file");
        let before = time();
        assert_eq!(fs::read_to_string(to.join("src/a.rs")).ok().as_deref(), Some("wrong"));
        copy(&from, &to, &files(&[("b", None)])).expect("a copy");
        assert!(!to.join("src/a.rs").exists() && time() == before);
        fs::remove_dir_all(top).expect("the folder");
    }

    #[test]
    fn the_crate_of_a_file_is_found() {
        let folder = |file: &str| source_folder(Path::new(file));
        assert_eq!(folder("stampfly-mode/src/failsafe/imu.rs"), Some("stampfly-mode/src".into()));
        assert_eq!(folder("vehicles/rover/src/lib.rs"), Some("vehicles/rover/src".into()));
        assert_eq!(folder("docs/safety.md"), None);
    }
}
