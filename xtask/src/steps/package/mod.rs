//! `package`: each library, as committed, builds from the archive that would be published, and a program that adds it alone runs the
//! first example of its README.
//!
//! Works on a fresh clone, so that a file that exists but was never committed is noticed.

mod example;

use crate::arguments::Arguments;
use crate::repository::{Failure, Library, Repository, capture, run as run_program};
use std::path::PathBuf;
use std::{env, fs};

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let (uncommitted, _) = capture(repository.command("git").args(["status", "--porcelain"]))?;
    if !uncommitted.is_empty() {
        eprintln!("not committed and therefore not looked at:\n{uncommitted}");
    }
    let clone = repository.target("package-clone");
    let _ = fs::remove_dir_all(&clone);
    run_program(repository.command("git").args(["clone", "--quiet", "--local", "."]).arg(&clone))?;
    let folder = repository.target("archives");
    let libraries = repository.libraries()?;
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
    example::run(repository, &folder.join("package"), &libraries)
}

/// Removes what cargo's home keeps unpacked of these libraries: it is of an older commit and has the same version.
fn forget_unpacked(libraries: &[Library]) {
    let default = || env::var_os("HOME").map(|home| PathBuf::from(home).join(".cargo"));
    let Some(home) = env::var_os("CARGO_HOME").map(PathBuf::from).or_else(default) else { return };
    let entries = |folder: PathBuf| fs::read_dir(folder).into_iter().flatten().flatten();
    for unpacked in entries(home.join("registry/src")).flat_map(|registry| entries(registry.path())) {
        let name = unpacked.file_name();
        let is_ours = |library: &Library| {
            let version = name.to_str().and_then(|name| name.strip_prefix(&library.name)?.strip_prefix('-'));
            version.is_some_and(|version| version.starts_with(|first: char| first.is_ascii_digit()))
        };
        if libraries.iter().any(is_ours) {
            let _ = fs::remove_dir_all(unpacked.path());
        }
    }
}
