//! `load`: a vehicle stands on the ground for half an hour, or for so many seconds (`-- 300`), while other programs load its ports.
//!
//! Slow readers, downloads of the log and meaningless datagrams, as fast as they can: a page and a station have to be served all the
//! time, and neither memory nor disk may grow (`xtask/ground/load.py`). The figures are in `target/load/figures.json`.

use super::program::released;
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, python_tool, run as run_program};

const PACKAGES: &str = "websockets==17.4 pymavlink==2.4.50";
const SCRIPT: &str = "xtask/ground/load.py";
const SECONDS: &str = "1800";

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let program = released(repository)?;
    let mut script = python_tool(repository, PACKAGES, "python3")?;
    script.arg("-B").arg(repository.root.join(SCRIPT));
    script.arg(arguments.rest.first().map_or(SECONDS, String::as_str));
    run_program(script.arg(program).arg(repository.target("load")))
}
