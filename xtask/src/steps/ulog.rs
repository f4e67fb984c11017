//! `ulog`: the tools of the formats' own authors open the log of a flight, and find in it what ours say is in it.

use super::program::{example, stampfly};
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture, python_tool, run as run_program};
use std::fs;
use std::path::Path;

const PYULOG: &str = "pyulog==1.3.0";
const MCAP: &str = "mcap==1.6.0";

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let folder = repository.target("ulog");
    let io = |e: std::io::Error| format!("{}: {e}", folder.display());
    fs::create_dir_all(&folder).map_err(io)?;
    let log = match &arguments.file {
        None => {
            run_program(stampfly(repository)?.args(["fly", "--out"]).arg(&folder))?;
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
    mcap(repository, &log)?;
    two_instances(repository)
}

/// The same log as MCAP, read by the format's own library: every sample is there.
fn mcap(repository: &Repository, log: &Path) -> Result<(), Failure> {
    let file = repository.target("ulog").join("flight.mcap");
    run_program(stampfly(repository)?.args(["log", "mcap"]).arg(log).arg("--out").arg(&file))?;
    let (info, _) = capture(stampfly(repository)?.args(["log", "info"]).arg(log))?;
    let samples = |line: &str| line.split_whitespace().nth(1)?.parse::<usize>().ok();
    let table = info.lines().skip_while(|line| !line.starts_with("topic")).skip(1);
    let expected: usize = table.filter_map(samples).sum();
    let count = "import sys; from mcap.reader import make_reader; \
                 print(sum(1 for _ in make_reader(open(sys.argv[1], 'rb')).iter_messages()))";
    let (found, _) = capture(python_tool(repository, MCAP, "python3")?.args(["-c", count]).arg(&file))?;
    println!("{} messages in the MCAP, {expected} samples in the log", found.trim());
    if found.trim().parse() == Ok(expected) && expected > 0 { Ok(()) } else { Err("the MCAP is another flight".into()) }
}

/// The example's two batteries are two instances of one topic, to the authors' tools as well.
fn two_instances(repository: &Repository) -> Result<(), Failure> {
    let log = repository.target("ulog").join("example.ulg");
    run_program(repository.command(&example(repository, "write_log")?.to_string_lossy()).arg(&log))?;
    let (info, _) = capture(python_tool(repository, PYULOG, "ulog_info")?.arg(&log))?;
    let batteries = info.lines().filter(|line| line.trim_start().starts_with("sensor_power (")).count();
    println!("{batteries} instances of the example's sensor_power");
    if batteries == 2 { Ok(()) } else { Err(format!("the tools found {batteries} instances, not 2:\n{info}")) }
}
