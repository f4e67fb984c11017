//! `features` and `each-feature`: each library compiles by itself with each choice of its features.
//!
//! In a build of the workspace, a library has the features that other crates depend on and no
//! others. These steps check it alone.
//!
//! | step | features |
//! |---|---|
//! | `features` | none, all; also runs the tests that a feature adds |
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

/// `each-feature`: with its only feature, `features` has checked a library already.
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
    // Clippy, because the step `clippy` has checked all dependencies outside the workspace.
    let mut clippy = repository.cargo();
    clippy.args(["clippy", "--quiet", "-p", &library.name]).args(arguments);
    run_program(clippy.args(["--", "-D", "warnings"]))
}
