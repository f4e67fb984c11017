//! `features`: each feature of each library compiles alone, and all of them together; what has a test of its own is tested.
//!
//! Inside the workspace every crate is built with the features that the others ask for, and those that nobody asks for are not built
//! at all. Here a crate is checked by itself, without its default features, and with each of its features in turn.

use crate::arguments::Arguments;
use crate::repository::{Failure, Library, Repository, run as run_program};

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let libraries = repository.libraries()?;
    let with_features: Vec<&Library> = libraries.iter().filter(|library| !library.features.is_empty()).collect();
    if with_features.is_empty() {
        return Err("no library has a feature: are manifests read as they should be?".to_owned());
    }
    for library in with_features {
        check(repository, library, &["--no-default-features"])?;
        for feature in &library.features {
            check(repository, library, &["--no-default-features", "--features", feature])?;
        }
        check(repository, library, &["--all-features"])?;
    }
    for tested in TESTED {
        run_program(repository.cargo().args(["test", "--quiet"]).args(tested))?;
    }
    Ok(())
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
