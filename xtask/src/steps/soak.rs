//! `soak`: ten vehicles in one world at real time, watched for half an hour, or for so many seconds: `-- 300`.
//!
//! No state may be missing at twenty texts a second, every vehicle has to keep up with the wall's time, and memory must not grow
//! (`xtask/ground/soak.py`). Not in `ci`, because it takes its time and wants the machine for itself.

use super::program::released;
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, python_tool, run as run_program};

const WEBSOCKETS: &str = "websockets==17.4";
const SCRIPT: &str = "xtask/ground/soak.py";
const SECONDS: &str = "1800";

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let program = released(repository)?;
    let mut script = python_tool(repository, WEBSOCKETS, "python3")?;
    script.arg("-B").arg(repository.root.join(SCRIPT));
    script.arg(arguments.rest.first().map_or(SECONDS, String::as_str));
    script.arg(program);
    // Only the page is watched.
    script.args(["serve", "--count", "10", "--port", "http=0", "--port", "others=off"]);
    run_program(script.arg("--out").arg(repository.target("soak")))
}
