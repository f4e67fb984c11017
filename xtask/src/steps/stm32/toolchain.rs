//! How packages for the chip are built: with rustup's target, or with a core library that Debian's compiler builds. A warning of the compiler or of Clippy fails.

use crate::repository::{Failure, Repository, capture, run as run_program};
use crate::steps::hals::of_debian;
use std::path::Path;

pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Builds a package that is outside the workspace, into this place.
pub fn build(repository: &Repository, package: &str, place: &Path, debian: bool) -> Result<(), Failure> {
    let folder = repository.root.join(package);
    run_program(repository.cargo().current_dir(&folder).args(["fmt", "--check"]))?;
    if !debian {
        let mut clippy = repository.cargo();
        clippy.current_dir(&folder).args(["clippy", "--quiet", "--release", "--locked", "--target-dir"]).arg(place);
        run_program(clippy.env_remove("RUSTFLAGS").args(["--", "-D", "warnings"]))?;
    }
    let mut build = if debian { of_debian(repository, TARGET) } else { repository.cargo() };
    build.current_dir(&folder).args(["build", "--release", "--locked", "--target-dir"]).arg(place);
    // Flags meant for the host would take the place of the package's own.
    build.env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
    let (_, said) = capture(&mut build)?;
    match said.lines().any(|line| line.starts_with("warning")) {
        true => Err(format!("a warning\n{said}")),
        false => Ok(()),
    }
}
