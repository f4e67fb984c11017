//! `python`: the tests of the Python example, and its types.
//!
//! They need no rover but their own. That the package drives the real one is asked by `stampfly-host/tests/host/rover.rs`.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, python_tool, run as run_program};

const PACKAGE: &str = "examples/python";
const MYPY: &str = "mypy==1.18.2";

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let folder = repository.root.join(PACKAGE);
    let cache = repository.target("python/mypy-cache");
    let mut types = python_tool(repository, MYPY, "mypy")?;
    types.args(["--strict", "--no-error-summary", "--cache-dir"]).arg(cache).args(["stampfly_rover", "tests"]);
    run_program(types.current_dir(&folder))?;
    run_program(repository.command("python3").args(["-B", "-m", "unittest", "--quiet"]).current_dir(&folder))
}
