//! `shards`: a campaign on a real HyperQueue server with two workers, one of which is killed in the middle, gives the same
//! rows as one process.
//!
//! Server and workers come from HyperQueue's Python package, each in a process of its own (`xtask/campaign/cluster.py`).
//! The rows are compared by DuckDB, which then runs every query of `docs/guide/campaigns.md`; three flights are flown again from
//! their rows.

use super::program::released;
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, announced, capture, json, python_tool};
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const HYPERQUEUE: &str = "hyperqueue==0.27.0";
const DUCKDB: &str = "duckdb==2.0.0";
const CLUSTER: &str = "xtask/campaign/cluster.py";
const DOCUMENT: &str = "docs/guide/campaigns.md";
/// Queries that the document has to have at least.
const QUERIES: usize = 5;

/// What is flown: a short mission, because it is not the flights that are tested here.
const FLIGHTS: &str = "128";
const SHARDS: &str = "16";
const MISSION: &str = "arm; takeoff 0.4; goto 0.6 0 0.4; land";
/// So many shards are there when a worker is killed.
const KILL_AFTER: usize = 4;
/// The whole campaign takes some seconds; a cluster that hangs does not end.
const PATIENCE: Duration = Duration::from_secs(300);
/// Rows that are flown again.
const AGAIN: [&str; 3] = ["0", "4", "7"];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    released(repository)?;
    let folder = repository.target("shards");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;

    let [one, many] = ["one", "many"].map(|name| folder.join(name));
    // A shard of one is all of it, without a search for the smallest failures.
    finish(campaign(repository, &one).args(["--shard", "0/1"]))?;
    let killed_after = on_cluster(repository, &folder, &many)?;
    println!("a worker was killed when {killed_after} of {SHARDS} shards were there");

    let duckdb = |script: &Path, arguments: &[&Path]| -> Result<String, Failure> {
        let mut command = python_tool(repository, DUCKDB, "python3")?;
        capture(command.arg(repository.root.join(script)).args(arguments).current_dir(&folder)).map(|(said, _)| said)
    };
    print!("{}", duckdb(Path::new("xtask/campaign/compare.py"), &[&one, &many])?);
    let document = fs::read_to_string(repository.root.join(DOCUMENT)).map_err(|e| format!("{DOCUMENT}: {e}"))?;
    let queries = queries(&document);
    if queries.len() < QUERIES {
        return Err(format!("{DOCUMENT} has {} queries, not {QUERIES}", queries.len()));
    }
    for (place, query) in queries.iter().enumerate() {
        let file = folder.join(format!("{place}.sql"));
        let query = query.replace("'campaign/", "'many/");
        fs::write(&file, query).map_err(|e| format!("{}: {e}", file.display()))?;
        print!("{}", duckdb(Path::new("xtask/campaign/query.py"), &[&file])?);
    }

    let file = many.join(format!("shard-07-of-{SHARDS}.parquet"));
    for row in AGAIN {
        let mut fly = stampfly(repository);
        let (report, _) =
            capture(fly.args(["fly", "--json", "--row", row, "--from"]).arg(&file).arg("--out").arg(&folder))?;
        if json(&report)?["same"] != Value::Bool(true) {
            return Err(format!("row {row} of {} is another flight now", file.display()));
        }
    }
    println!("rows {} flown again: the same hashes", AGAIN.join(", "));
    Ok(())
}

fn stampfly(repository: &Repository) -> Command {
    repository.command(&repository.target("release/stampfly").display().to_string())
}

fn campaign(repository: &Repository, out: &Path) -> Command {
    let mut command = stampfly(repository);
    command.args(["campaign", "--faults", "--json", "--flights", FLIGHTS, "--mission", MISSION]);
    command.arg("--out").arg(out);
    command
}

/// Runs a campaign to its end. Flights may fail, which is exit code 1; the report says how many were flown.
fn finish(command: &mut Command) -> Result<(), Failure> {
    let shown = announced(command);
    let output = command.stdin(Stdio::null()).output().map_err(|e| format!("`{shown}` could not be started: {e}"))?;
    complete(&output.stdout).map_err(|e| format!("`{shown}`: {e}\n{}", String::from_utf8_lossy(&output.stderr)))
}

fn complete(report: &[u8]) -> Result<(), Failure> {
    let report = json(&String::from_utf8_lossy(report))?;
    let flown = report["flights"].as_u64();
    if flown.is_some_and(|flown| flown.to_string() == FLIGHTS) { Ok(()) } else { Err(format!("{flown:?} flights")) }
}

/// A child that does not outlive this step.
struct Guard(Child);

impl Drop for Guard {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Flies the campaign by HyperQueue, and kills a worker in the middle. Returns how many shards were there then.
fn on_cluster(repository: &Repository, folder: &Path, out: &Path) -> Result<usize, Failure> {
    let server_folder = folder.join("server");
    let _server = start(repository, &["server".into(), server_folder.clone()])?;
    let mut first = start(repository, &["worker".into(), server_folder.clone(), folder.join("worker-1")])?;
    let _second = start(repository, &["worker".into(), server_folder.clone(), folder.join("worker-2")])?;

    // The program finds the package by the python3 in PATH.
    let python = PathBuf::from(python_tool(repository, HYPERQUEUE, "python3")?.get_program());
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = python.parent().map(Path::to_owned).into_iter().chain(std::env::split_paths(&path));
    let path = std::env::join_paths(folders).map_err(|e| e.to_string())?;
    let mut hq = campaign(repository, out);
    hq.args(["--engine", "hq", "--shards", SHARDS]).env("PATH", path).env("HQ_SERVER_DIR", &server_folder);
    let shown = announced(&hq);
    let report = folder.join("report.json");
    let to = fs::File::create(&report).map_err(|e| format!("{}: {e}", report.display()))?;
    let child =
        hq.stdin(Stdio::null()).stdout(to).spawn().map_err(|e| format!("`{shown}` could not be started: {e}"))?;
    let mut child = Guard(child);

    let started = Instant::now();
    let mut killed_after = None;
    while child.0.try_wait().map_err(|e| e.to_string())?.is_none() {
        let shards = there(out);
        if killed_after.is_none() && shards >= KILL_AFTER {
            first.0.kill().map_err(|e| format!("the first worker cannot be killed: {e}"))?;
            killed_after = Some(shards);
        }
        if started.elapsed() > PATIENCE {
            return Err(format!("{} shards after {PATIENCE:?}", there(out)));
        }
        sleep(Duration::from_millis(20));
    }
    let said = fs::read(&report).map_err(|e| format!("{}: {e}", report.display()))?;
    complete(&said).map_err(|e| format!("`{shown}`: {e}"))?;
    let all = SHARDS.parse().unwrap_or(0);
    killed_after.filter(|shards| *shards < all).ok_or_else(|| "the campaign was over before a worker was killed".into())
}

/// How many shards there are.
fn there(out: &Path) -> usize {
    let entries = fs::read_dir(out).into_iter().flatten().filter_map(Result::ok);
    entries.filter(|entry| entry.file_name().to_string_lossy().starts_with("shard-")).count()
}

/// Starts a part of the cluster and waits until it is ready.
fn start(repository: &Repository, arguments: &[PathBuf]) -> Result<Guard, Failure> {
    let mut command = python_tool(repository, HYPERQUEUE, "python3")?;
    command.arg("-B").arg(repository.root.join(CLUSTER)).args(arguments);
    let shown = announced(&command);
    let child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
    let mut guard = Guard(child.map_err(|e| format!("`{shown}` could not be started: {e}"))?);
    let output = guard.0.stdout.take().ok_or("no output")?;
    // It prints a table of its own, too.
    let ready = BufReader::new(output).lines().map_while(Result::ok).any(|line| line == "ready");
    if ready { Ok(guard) } else { Err(format!("`{shown}` ended")) }
}

/// The SQL blocks of a document.
fn queries(document: &str) -> Vec<&str> {
    document.split("```sql\n").skip(1).filter_map(|part| part.split("```").next()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn queries_are_the_blocks() {
        let document = "# A\n\n```sql\nSELECT 1;\n```\n\n```console\n$ x\n```\n\n```sql\nSELECT 2;\n```\n";
        assert_eq!(queries(document), ["SELECT 1;\n", "SELECT 2;\n"]);
        assert!(queries("none").is_empty());
    }

    #[test]
    fn a_campaign_is_complete_or_not() {
        assert_eq!(complete(b"{\"flights\":128,\"failed\":3}"), Ok(()));
        for report in [&b"{\"flights\":150}"[..], b"{}", b""] {
            assert!(complete(report).is_err());
        }
    }
}
