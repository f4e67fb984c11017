//! `features` and `each-feature`: each library compiles by itself with each choice of its features.
//!
//! In a build of the workspace, a library has the features that other crates depend on and no
//! others. These steps check it alone.
//!
//! | step | features |
//! |---|---|
//! | `features` | none |
//! | `each-feature` | one at a time, all |
//!
//! The step `doc` compiles all libraries with all features, together.

use crate::arguments::Arguments;
use crate::repository::{Failure, Library, Repository, run as run_program};

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    for library in with_features(repository)? {
        check(repository, &library, &["--no-default-features"])?;
    }
    Ok(())
}

/// `each-feature`.
pub fn each(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    for library in with_features(repository)? {
        for feature in &library.features {
            check(repository, &library, &["--no-default-features", "--features", feature])?;
        }
        // Its only feature has been checked.
        if library.features.len() > 1 {
            check(repository, &library, &["--all-features"])?;
        }
    }
    Ok(())
}

fn with_features(repository: &Repository) -> Result<Vec<Library>, Failure> {
    let mut libraries = repository.libraries()?;
    libraries.retain(|library| !library.features.is_empty());
    if libraries.is_empty() {
        return Err("no library has a feature: are manifests read as they should be?".to_owned());
    }
    Ok(libraries)
}

fn check(repository: &Repository, library: &Library, arguments: &[&str]) -> Result<(), Failure> {
    // Clippy, because the step `clippy` has checked all dependencies outside the workspace.
    let mut clippy = repository.cargo();
    clippy.args(["clippy", "--quiet", "-p", &library.name]).args(arguments);
    run_program(clippy.args(["--", "-D", "warnings"]))
}
