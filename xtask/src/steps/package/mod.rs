//! `package`: each library, as committed, builds from the archive that would be published, and a program that adds it alone runs the
//! first example of its README. So does the vehicle of `docs/guide/own-vehicle.md`, from the archives alone.
//!
//! Works on a fresh clone, so that a file that exists but was never committed is noticed. The texts of the licences have to be in
//! every archive, the same as in the top folder: both licences ask for it.

mod example;

use crate::arguments::Arguments;
use crate::cargo_tool::cargo_home;
use crate::repository::{Failure, Library, Repository, capture, run as run_program};
use std::fs;
use std::path::{Path, PathBuf};

/// Texts that go with every copy.
const LICENCES: [&str; 2] = ["LICENSE-APACHE", "LICENSE-MIT"];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let (uncommitted, _) = capture(repository.command("git").args(["status", "--porcelain"]))?;
    if !uncommitted.is_empty() {
        eprintln!("not committed and therefore not looked at:\n{uncommitted}");
    }
    let clone = repository.target("package-clone");
    let _ = fs::remove_dir_all(&clone);
    run_program(repository.command("git").args(["clone", "--quiet", "--local", "."]).arg(&clone))?;
    let folder = repository.target("archives");
    let mut libraries = repository.libraries()?;
    libraries.retain(|library| library.published);
    let inside = |arguments: &[&str]| {
        let mut cargo = repository.cargo();
        cargo.current_dir(&clone).args(arguments).arg("--target-dir").arg(&folder);
        // Whether it builds is all that is asked here.
        cargo.env("CARGO_PROFILE_DEV_DEBUG", "false");
        // Together, because they depend on each other and none is published yet.
        for library in &libraries {
            cargo.args(["-p", &library.name]);
        }
        cargo
    };
    // Cargo neither unpacks nor builds a version twice, and ours does not change with every commit.
    let _ = fs::remove_dir_all(folder.join("package"));
    forget_unpacked(&libraries);
    run_program(&mut inside(&["clean", "--quiet"]))?;
    run_program(&mut inside(&["package", "--locked", "--quiet"]))?;
    let without: Vec<String> = libraries
        .iter()
        .flat_map(|library| LICENCES.map(|licence| (library, licence)))
        .filter(|(library, licence)| !has_licence(repository, &folder.join("package"), library, licence))
        .map(|(library, licence)| format!("the archive of {} has no {licence} as in the top folder", library.name))
        .collect();
    if !without.is_empty() {
        return Err(without.join("\n  "));
    }
    example::run(repository, &folder.join("package"), &libraries)
}

/// Is this text in what cargo has unpacked of a library's archive, as it is in the top folder?
fn has_licence(repository: &Repository, archives: &Path, library: &Library, licence: &str) -> bool {
    let Ok(wanted) = fs::read(repository.root.join(licence)) else { return false };
    let entries = fs::read_dir(archives).into_iter().flatten().flatten();
    let mut unpacked = entries.filter(|entry| entry.file_name().to_str().is_some_and(|name| library.is_called(name)));
    unpacked.any(|entry| fs::read(entry.path().join(licence)).is_ok_and(|text| text == wanted))
}

/// Removes what cargo's home keeps unpacked of these libraries: it is of an older commit and has the same version.
fn forget_unpacked(libraries: &[Library]) {
    let Ok(home) = cargo_home() else { return };
    let entries = |folder: PathBuf| fs::read_dir(folder).into_iter().flatten().flatten();
    for unpacked in entries(home.join("registry/src")).flat_map(|registry| entries(registry.path())) {
        let name = unpacked.file_name();
        let is_ours = |library: &Library| name.to_str().is_some_and(|name| library.is_called(name));
        if libraries.iter().any(is_ours) {
            let _ = fs::remove_dir_all(unpacked.path());
        }
    }
}
