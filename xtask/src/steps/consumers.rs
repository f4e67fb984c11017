//! `consumers`: each library in a crate of its own, outside the workspace.
//!
//! Inside the workspace every crate is built with the features the others ask for, which hides a feature that one
//! forgot to ask for itself. So a small program per crate (`xtask/consumers`) is built where the workspace cannot help
//! it, depending on that crate and on the vocabulary of `stampfly-types`, and run.

use crate::arguments::Arguments;
use crate::repository::{Failure, Library, Repository, run as run_program};
use std::fs;
use std::path::Path;

/// Libraries that nobody depends on by themselves: the macros come with the bus, the others belong to the program.
const NOT_ALONE: &[&str] = &["stampfly-bus-macros", "stampfly-host", "stampfly-lab"];
/// What a program needs beside a library that assembles others.
const BESIDE: &[(&str, &[&str])] =
    &[("stampfly-board", &["stampfly-bus", "stampfly-flight"]), ("stampfly-flight", &["stampfly-bus"])];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let place = std::env::temp_dir().join(format!("stampfly-consumers-{}", std::process::id()));
    let outcome = repository
        .libraries()?
        .iter()
        .filter(|library| library.published && !NOT_ALONE.contains(&library.name.as_str()))
        .try_for_each(|library| consume(repository, library, &place));
    // Nothing depends on its removal.
    let _ = fs::remove_dir_all(&place);
    outcome
}

fn consume(repository: &Repository, library: &Library, place: &Path) -> Result<(), Failure> {
    let name = library.name.as_str();
    let source = repository.root.join("xtask/consumers").join(format!("{name}.rs"));
    if !source.exists() {
        return Err(format!("`{name}` has no consumer: write {}", source.display()));
    }
    let folder = place.join(name);
    let dependency = |name: &str, folder: &Path| format!("{name} = {{ path = {:?} }}\n", repository.root.join(folder));
    let mut manifest = format!("[package]\nname = \"consumer-of-{name}\"\nedition = \"2024\"\n\n[workspace]\n\n");
    manifest += "[dependencies]\n";
    manifest += &dependency(name, &library.folder);
    if name != "stampfly-types" {
        manifest += &dependency("stampfly-types", Path::new("stampfly-types"));
    }
    let beside = BESIDE.iter().filter(|(library, _)| *library == name).flat_map(|(_, beside)| *beside);
    manifest.extend(beside.map(|name| dependency(name, Path::new(name))));
    let io = |e: std::io::Error| format!("{}: {e}", folder.display());
    fs::create_dir_all(folder.join("src")).map_err(io)?;
    fs::write(folder.join("Cargo.toml"), manifest).map_err(io)?;
    fs::copy(&source, folder.join("src/main.rs")).map_err(io)?;
    // The same versions as in the workspace; cargo strikes out what is not needed.
    fs::copy(repository.root.join("Cargo.lock"), folder.join("Cargo.lock")).map_err(io)?;
    eprintln!("consumer of {name}");
    run_program(
        repository
            .cargo()
            .current_dir(&folder)
            .env("CARGO_PROFILE_DEV_DEBUG", "false")
            .args(["run", "--quiet", "--target-dir"])
            .arg(repository.target("consumers")),
    )
}
