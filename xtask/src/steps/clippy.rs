//! `clippy` and `alone`: no warning in any target, tests, examples and benchmarks included.
//!
//! | step | packages |
//! |---|---|
//! | `clippy` | the workspace |
//! | `alone` | examples and benchmarks, each with its own features only; two outside the workspace |

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, add_targets, run as run_program};

/// First the packages of `cargo test`, with the same features, so that build scripts and macros are
/// built once for both; then the one that it leaves out.
const PACKAGES: [&[&str]; 2] = [&[], &["-p", "xtask"]];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    for packages in PACKAGES {
        let mut clippy = repository.cargo();
        clippy.args(["clippy", "--all-targets", "--quiet"]).args(packages);
        run_program(clippy.args(["--", "-D", "warnings"]))?;
    }
    Ok(())
}

/// Members of the workspace, and their targets that users build with `-p`.
const MEMBERS: [(&str, &str); 2] = [("stampfly-benches", "--benches"), ("examples", "--examples")];
/// Packages that are no members: folder, options, folder of the build.
const OTHERS: [(&str, &[&str], &str); 2] = [
    ("stampfly-board/browser", &["--release", "--target", "wasm32-unknown-unknown"], "browser"),
    ("stampfly-board/panic-proof", &["--release"], "panic-proof"),
];

/// `alone`: packages with no features but their own.
pub fn alone(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    for (package, targets) in MEMBERS {
        run_program(repository.cargo().args(["check", "--quiet", "-p", package, targets]))?;
    }
    add_targets(repository, &["wasm32-unknown-unknown", "thumbv7em-none-eabihf"])?;
    for (folder, options, place) in OTHERS {
        let mut clippy = repository.cargo();
        // Flags that are meant for the host would replace those of the package.
        clippy.current_dir(repository.root.join(folder)).env_remove("RUSTFLAGS");
        clippy.args(["clippy", "--quiet", "--locked"]).args(options).arg("--target-dir").arg(repository.target(place));
        run_program(clippy.args(["--", "-D", "warnings"]))?;
    }
    Ok(())
}
