//! `golden`: is the committed golden flight what this flight stack flies, and does it publish the same bits, optimised
//! and not?
//!
//! Recorded again by `--fix`, after a change that is meant to change flights.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture};
use std::fs;
use std::process::Command;

const RECORD: &str = "stampfly-board/golden/flight.bin";
const PROFILES: [&str; 2] = ["release", "dev"];
/// A flight that grows beyond this is no longer what a repository and a flash memory should hold.
const MOST_BYTES: usize = 150_000;

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let fix = arguments.fix;
    let committed = repository.root.join(RECORD);
    let folder = repository.target("golden");
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    for profile in PROFILES {
        let again = folder.join(profile).with_extension("bin");
        capture(stampfly(repository, profile).arg("--record").arg(&again))?;
        let read = |path: &std::path::Path| fs::read(path).map_err(|e| format!("{}: {e}", path.display()));
        let (before, now) = (read(&committed)?, read(&again)?);
        if now.len() > MOST_BYTES {
            return Err(format!("the golden flight has {} bytes; {MOST_BYTES} is the most", now.len()));
        }
        if before != now {
            // Only the first profile may change it, or the profiles would not be compared.
            if !fix || profile != PROFILES[0] {
                return Err(format!(
                    "{RECORD} is not what {profile} code records; `cargo xtask golden --fix` if flights were to change"
                ));
            }
            fs::write(&committed, now).map_err(|e| format!("{RECORD}: {e}"))?;
            println!("{RECORD}: recorded again");
        }
        let (report, _) = capture(&mut stampfly(repository, profile))?;
        print!("{profile}: {report}");
    }
    Ok(())
}

/// `stampfly golden`.
fn stampfly(repository: &Repository, profile: &str) -> Command {
    let mut command = repository.cargo();
    command.args(["run", "--quiet", "--profile", profile, "--bin", "stampfly", "--", "golden"]);
    command
}
