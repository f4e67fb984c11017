//! Engines that fly a campaign's shards: HyperQueue and Slurm.
//!
//! A task of either runs `stampfly campaign ... --shard I/N`. Results are files in a folder that all machines share.

use crate::campaign::case::shell_line;
use crate::campaign::shard::Shard;
use crate::command_line::failure::{Failure, Unfinished};
use serde_json::json;
use std::ffi::OsStr;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Most tasks of an array as Slurm is delivered (MaxArraySize 1001).
pub const SLURM_ARRAY: u64 = 1_000;

/// Submits tasks by HyperQueue's Python package and waits for them: see there.
const SUBMIT: &str = include_str!("hyperqueue.py");

/// What tasks run.
pub struct Job {
    /// The arguments, but for the shard.
    pub arguments: Vec<String>,
    /// Where results go.
    pub out: PathBuf,
}

impl Job {
    /// Program and arguments, and these.
    pub fn with(&self, more: &[&str]) -> Result<Vec<String>, Failure> {
        let program = std::env::current_exe().map_err(|error| format!("this program: {error}"))?;
        let words = [program.display().to_string()].into_iter().chain(self.arguments.iter().cloned());
        Ok(words.chain(more.iter().map(|word| (*word).to_owned())).collect())
    }
}

/// Lets HyperQueue fly these shards, and waits. `done` is told which files are there.
pub fn hq(job: &Job, shards: &[Shard], done: &dyn Fn(&[Shard])) -> Result<(), Failure> {
    let mut child = match (in_path("hq"), in_path("python3").filter(|python| has_package(python))) {
        (Some(hq), _) => by_program(&hq, job, shards)?,
        (None, Some(python)) => by_package(&python, job, shards)?,
        (None, None) => {
            return Err("--engine hq needs HyperQueue in PATH: its program hq, or a python3 with its package \
                        (pip install hyperqueue)"
                .into());
        }
    };
    let mut standard_error = child.stderr.take();
    let reader = std::thread::spawn(move || {
        let mut text = String::new();
        if let Some(stream) = &mut standard_error {
            let _ = stream.read_to_string(&mut text);
        }
        text
    });
    let there =
        || -> Vec<Shard> { shards.iter().copied().filter(|shard| job.out.join(shard.file_name()).exists()).collect() };
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        done(&there());
        std::thread::sleep(Duration::from_millis(100));
    };
    let said = reader.join().unwrap_or_default();
    let there = there();
    match shards.iter().find(|shard| !there.contains(shard)) {
        None => Ok(()),
        Some(first) => {
            let (missing, all) = (shards.len() - there.len(), shards.len());
            let said = said.trim();
            let error = std::fs::read_to_string(error_file(job, *first)).unwrap_or_default();
            let why = [said, error.trim()].into_iter().filter(|text| !text.is_empty()).collect::<Vec<_>>().join("\n");
            let text =
                format!("HyperQueue ended ({status}) with {missing} of {all} shards missing, the first {first}\n{why}");
            Err(Unfinished(text).into())
        }
    }
}

/// `hq submit`, one array job.
fn by_program(hq: &Path, job: &Job, shards: &[Shard]) -> Result<Child, Failure> {
    let count = shards.first().map_or(1, |shard| shard.count());
    let mut submit = Command::new(hq);
    submit.args(["submit", "--wait", "--name", "stampfly", "--cpus", "1", "--array", &ranges(shards)]);
    submit
        .arg("--stdout=none")
        .arg(format!("--stderr={}:rm-if-finished", job.out.join("task-%{TASK_ID}.stderr").display()));
    submit.arg("--").args(job.with(&["--threads", "1", "--shard", &format!("auto/{count}")])?);
    start(submit.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()), hq)
}

/// Numbers of shards as `hq submit --array` takes them: a list of all of them may be too long for a command line.
fn ranges(shards: &[Shard]) -> String {
    let runs = shards.chunk_by(|one, next| one.index() + 1 == next.index());
    let texts = runs.filter_map(|run| match run {
        [one] => Some(one.index().to_string()),
        [first, .., last] => Some(format!("{}-{}", first.index(), last.index())),
        [] => None,
    });
    texts.collect::<Vec<_>>().join(",")
}

/// The Python package, one task a shard.
fn by_package(python: &Path, job: &Job, shards: &[Shard]) -> Result<Child, Failure> {
    let tasks: Vec<_> = shards
        .iter()
        .map(|shard| {
            let arguments = job.with(&["--threads", "1", "--shard", &shard.to_string()])?;
            Ok(json!({ "arguments": arguments, "stderr": error_file(job, *shard) }))
        })
        .collect::<Result<_, Failure>>()?;
    let mut submit = Command::new(python);
    submit.args(["-c", SUBMIT]).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = start(&mut submit, python)?;
    if let Some(mut input) = child.stdin.take() {
        // When it does not read, it has ended and says why.
        let _ = input.write_all(json!({ "name": "stampfly", "tasks": tasks }).to_string().as_bytes());
    }
    Ok(child)
}

fn start(command: &mut Command, program: &Path) -> Result<Child, Failure> {
    command.spawn().map_err(|error| format!("{}: {error}", program.display()).into())
}

/// What a task that failed has said.
fn error_file(job: &Job, shard: Shard) -> PathBuf {
    job.out.join(format!("task-{}.stderr", shard.index()))
}

/// A program of this name in PATH.
fn in_path(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let file = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    std::env::split_paths(&path).map(|folder| folder.join(&file)).find(|program| program.is_file())
}

fn has_package(python: impl AsRef<OsStr>) -> bool {
    let mut look = Command::new(python);
    look.args(["-c", "import hyperqueue"]).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    look.status().is_ok_and(|status| status.success())
}

/// The script of a Slurm array with one task a shard.
pub fn slurm_script(job: &Job, count: u64) -> Result<String, Failure> {
    let task = shell_line(&job.with(&["--threads", "1", "--shard", &format!("auto/{count}")])?);
    let last = count.saturating_sub(1);
    let out = job.out.display();
    Ok(format!(
        "#!/bin/bash\n\
         # One task a shard. A shard whose file is there is not flown again: submit it again when tasks were lost.\n\
         #SBATCH --job-name=stampfly\n\
         #SBATCH --array=0-{last}\n\
         #SBATCH --ntasks=1\n\
         #SBATCH --cpus-per-task=1\n\
         #SBATCH --output={out}/task-%a.out\n\
         exec {task}\n"
    ))
}
