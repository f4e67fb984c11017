//! `ulog`: the tools of the format's own authors open the log of a flight and find samples in it.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture, python_tool, run as run_program};
use std::fs;

const PYULOG: &str = "pyulog==1.3.0";

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let folder = repository.target("ulog");
    let io = |e: std::io::Error| format!("{}: {e}", folder.display());
    fs::create_dir_all(&folder).map_err(io)?;
    let log = match &arguments.file {
        None => {
            let mut fly = repository.cargo();
            fly.args(["run", "--quiet", "--release", "--bin", "stampfly", "--", "fly", "--out"]).arg(&folder);
            run_program(&mut fly)?;
            folder.join("flight.ulg")
        }
        Some(path) => std::path::absolute(path).map_err(io)?,
    };

    let (info, _) = capture(python_tool(repository, PYULOG, "ulog_info")?.arg(&log))?;
    println!("{info}");
    let tables = folder.join("csv");
    let _ = fs::remove_dir_all(&tables);
    fs::create_dir_all(&tables).map_err(io)?;
    run_program(python_tool(repository, PYULOG, "ulog2csv")?.arg("-o").arg(&tables).arg(&log))?;

    let mut rows = 0;
    let mut topics = 0;
    for entry in fs::read_dir(&tables).map_err(io)? {
        let table = fs::read_to_string(entry.map_err(io)?.path()).map_err(io)?;
        topics += 1;
        rows += table.lines().count().saturating_sub(1);
    }
    println!("{rows} samples in {topics} tables");
    if rows == 0 {
        return Err("the tools found no sample".to_owned());
    }
    two_instances(repository)
}

/// The example's two batteries are two instances of one topic, to the authors' tools as well.
fn two_instances(repository: &Repository) -> Result<(), Failure> {
    let log = repository.target("ulog").join("example.ulg");
    let mut write = repository.cargo();
    run_program(write.args(["run", "--quiet", "-p", "stampfly-log", "--example", "write_log", "--"]).arg(&log))?;
    let (info, _) = capture(python_tool(repository, PYULOG, "ulog_info")?.arg(&log))?;
    let batteries = info.lines().filter(|line| line.trim_start().starts_with("sensor_power (")).count();
    println!("{batteries} instances of the example's sensor_power");
    if batteries == 2 { Ok(()) } else { Err(format!("the tools found {batteries} instances, not 2:\n{info}")) }
}
