//! `clippy` and `alone`: no warning in any target, tests, examples and benchmarks included.
//!
//! | step | what |
//! |---|---|
//! | `clippy` | the workspace |
//! | `alone` | packages that are built by themselves: examples and benchmarks with no feature but those they ask for, and three that are no members of the workspace |

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, add_targets, run as run_program};

/// What `cargo test` builds, with the features it has there, so that build scripts and macros are built once; then what it leaves out.
const PACKAGES: [&[&str]; 2] = [&[], &["-p", "xtask"]];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    for packages in PACKAGES {
        let mut clippy = repository.cargo();
        clippy.args(["clippy", "--all-targets", "--quiet"]).args(packages);
        run_program(clippy.args(["--", "-D", "warnings"]))?;
    }
    Ok(())
}

/// What a member of the workspace has that people build by itself.
const MEMBERS: [(&str, &str); 2] = [("stampfly-benches", "--benches"), ("examples", "--examples")];
/// Packages that are no members: folder, options, folder of the build.
const OTHERS: [(&str, &[&str], &str); 3] = [
    ("fuzz", &["--lib", "--tests"], ""),
    ("stampfly-board/browser", &["--release", "--target", "wasm32-unknown-unknown"], "browser"),
    ("stampfly-board/panic-proof", &["--release"], "panic-proof"),
];

/// `alone`: what is built by itself.
pub fn alone(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    for (package, targets) in MEMBERS {
        run_program(repository.cargo().args(["check", "--quiet", "-p", package, targets]))?;
    }
    add_targets(repository, &["wasm32-unknown-unknown"])?;
    for (folder, options, place) in OTHERS {
        let mut clippy = repository.cargo();
        // Flags that are meant for the host would replace those of the package.
        clippy.current_dir(repository.root.join(folder)).env_remove("RUSTFLAGS");
        clippy.args(["clippy", "--quiet", "--locked"]).args(options).arg("--target-dir").arg(repository.target(place));
        run_program(clippy.args(["--", "-D", "warnings"]))?;
    }
    Ok(())
}
