//! `features` and `each-feature`: a library compiles without its features, with each of them alone and with all of them.
//!
//! Inside the workspace every crate is built with the features that the others ask for, and those that no crate asks for are not
//! built at all. Here a crate is checked by itself.
//!
//! | step | features |
//! |---|---|
//! | `features` | none; all; what a feature adds that has a test of its own is tested |
//! | `each-feature` | one at a time |

use crate::arguments::Arguments;
use crate::repository::{Failure, Library, Repository, run as run_program};

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    for library in with_features(repository)? {
        check(repository, &library, &["--no-default-features"])?;
        check(repository, &library, &["--all-features"])?;
    }
    for tested in TESTED {
        run_program(repository.cargo().args(["test", "--quiet"]).args(tested))?;
    }
    Ok(())
}

/// `each-feature`: those that are one of several.
pub fn each(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    for library in with_features(repository)?.iter().filter(|library| library.features.len() > 1) {
        for feature in &library.features {
            check(repository, library, &["--no-default-features", "--features", feature])?;
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

/// What a feature adds that does something by itself.
const TESTED: [&[&str]; 2] = [
    // A clock that can be asked on this PC, too.
    &["-p", "stampfly-driver-core", "--features", "embassy-time", "--test", "driver-core", "embassy"],
    &["-p", "stampfly-bus", "--features", "async", "bell"],
];

fn check(repository: &Repository, library: &Library, arguments: &[&str]) -> Result<(), Failure> {
    // By clippy, for which all dependencies outside the workspace have been checked already.
    let mut clippy = repository.cargo();
    clippy.args(["clippy", "--quiet", "-p", &library.name]).args(arguments);
    run_program(clippy.args(["--", "-D", "warnings"]))
}
