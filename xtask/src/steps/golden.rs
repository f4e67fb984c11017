//! `golden`: is the committed golden flight what this flight stack flies?
//!
//! Recorded again by `--fix`, after a change that is meant to change flights. The step
//! [`determinism`](super::determinism) asks the same of other builds.

use super::program::built;
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture};
use std::fs;
use std::path::Path;

const RECORD: &str = "stampfly-board/golden/flight.bin";
/// A third more than the flight has today. The firmware's flash holds it, and the repository each of
/// its recordings.
const MOST_BYTES: usize = 200_000;

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let mut program = built(repository)?;
    if arguments.fix {
        let now = recorded(repository, &program)?;
        if now != committed(repository)? {
            fs::write(repository.root.join(RECORD), now).map_err(|e| format!("{RECORD}: {e}"))?;
            println!("{RECORD}: recorded again");
            // The program contains the flight that it plays.
            program = built(repository)?;
        }
    }
    compare(repository, &program)
}

/// Whether this program flies the committed flight and publishes its bits.
pub fn compare(repository: &Repository, program: &Path) -> Result<(), Failure> {
    if recorded(repository, program)? != committed(repository)? {
        return Err(format!(
            "{RECORD} is not what {} records; `cargo xtask golden --fix` if flights were to change",
            program.display()
        ));
    }
    let (report, _) = capture(repository.command(&program.to_string_lossy()).arg("golden"))?;
    print!("{}: {report}", program.display());
    Ok(())
}

/// The golden flight as this program flies it.
fn recorded(repository: &Repository, program: &Path) -> Result<Vec<u8>, Failure> {
    let folder = repository.target("golden");
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let file = folder.join("flight.bin");
    capture(repository.command(&program.to_string_lossy()).args(["golden", "--record"]).arg(&file))?;
    let record = fs::read(&file).map_err(|e| format!("{}: {e}", file.display()))?;
    if record.len() > MOST_BYTES {
        return Err(format!("the golden flight has {} bytes; {MOST_BYTES} is the most", record.len()));
    }
    Ok(record)
}

fn committed(repository: &Repository) -> Result<Vec<u8>, Failure> {
    fs::read(repository.root.join(RECORD)).map_err(|e| format!("{RECORD}: {e}"))
}
