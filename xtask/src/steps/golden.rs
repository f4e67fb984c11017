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
/// Its hash in hexadecimal, for the test of the board.
const HASH: &str = "stampfly-board/golden/hash";
/// Bytes that the emulated boards have in their flash for the flight, and the repository for each
/// time that it is recorded.
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
    if arguments.fix {
        let hash = flown(repository, &program)?.1;
        fs::write(repository.root.join(HASH), format!("{hash}\n")).map_err(|e| format!("{HASH}: {e}"))?;
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
    let (report, hash) = flown(repository, program)?;
    print!("{}: {report}", program.display());
    let expected = fs::read_to_string(repository.root.join(HASH)).map_err(|e| format!("{HASH}: {e}"))?;
    if hash == expected.trim() {
        Ok(())
    } else {
        Err(format!("{HASH} is not {hash}; `cargo xtask golden --fix` if flights were to change"))
    }
}

/// What this program says of the flight that it contains, and the hash of all that it published.
fn flown(repository: &Repository, program: &Path) -> Result<(String, String), Failure> {
    let (report, _) = capture(repository.command(&program.to_string_lossy()).arg("golden"))?;
    let hash = report.split_once("hash ").and_then(|(_, hash)| hash.split_whitespace().next());
    let hash = hash.ok_or("`stampfly golden` prints no hash")?.to_owned();
    Ok((report, hash))
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
