//! `fmt`: is everything formatted? Packages that only one other step builds are looked at there.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, run as run_program};

/// No members of the workspace.
const OTHERS: [&str; 4] = ["fuzz", "lab", "stampfly-board/browser", "stampfly-board/panic-proof"];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let all = run_program(repository.cargo().args(["fmt", "--all", "--check"]));
    all.map_err(|e| format!("{e}; run `cargo fmt --all`"))?;
    for folder in OTHERS {
        let mut cargo = repository.cargo();
        run_program(cargo.current_dir(repository.root.join(folder)).args(["fmt", "--check"]))?;
    }
    Ok(())
}
