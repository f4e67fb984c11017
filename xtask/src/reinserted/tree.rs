//! The copy of the sources that has the bugs, in cargo's folder for generated files.

use super::guard::{MODULE, with_bugs, with_module};
use super::list::Bug;
use crate::copy::{Files, copy, sources};
use crate::repository::{Failure, Repository, run as run_program};
use std::collections::BTreeSet;
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
fn files(repository: &Repository, bugs: &[Bug]) -> Result<Files, Failure> {
    let mut files = sources(repository)?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_crate_of_a_file_is_found() {
        let folder = |file: &str| source_folder(Path::new(file));
        assert_eq!(folder("stampfly-mode/src/failsafe/imu.rs"), Some("stampfly-mode/src".into()));
        assert_eq!(folder("vehicles/rover/src/lib.rs"), Some("vehicles/rover/src".into()));
        assert_eq!(folder("docs/explain/safety.md"), None);
    }
}
