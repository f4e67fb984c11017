//! `stampfly log`: what is in a log, a part of it, other formats of it.

use crate::arguments::LogCommand;
use crate::failure::Failure;
use serde_json::json;
use stampfly_host::log::{csv, cut, info::Info, mcap};
use stampfly_lab::flight_log;
use stampfly_types::Instant;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::ExitCode;

pub fn run(command: &LogCommand) -> Result<ExitCode, Failure> {
    match command {
        LogCommand::Info { file, json } => {
            let info = Info::of(&flight_log::load(file)?);
            if *json {
                outln!("{}", json!(info));
            } else {
                outln!("{}", info.to_string().trim_end());
            }
        }
        LogCommand::Csv { file, topic, out } => {
            let log = flight_log::load(file)?;
            std::fs::create_dir_all(out).map_err(|error| format!("{}: {error}", out.display()))?;
            let stem = file.file_stem().unwrap_or_default().to_string_lossy();
            for (name, series) in log.flight.topics.iter().filter(|(name, _)| wanted(topic, name)) {
                // As pyulog names them: topic, then the instance.
                let (name, instance) = name.trim_end_matches(']').split_once('[').unwrap_or((name, "0"));
                let path = out.join(format!("{stem}_{name}_{instance}.csv"));
                let mut table = create(&path)?;
                csv::write(series, &mut table).and_then(|()| table.flush()).map_err(|error| say(&path, &error))?;
                outln!("{}   {} rows", path.display(), series.at.len());
            }
        }
        LogCommand::Mcap { file, topic, out } => {
            let log = flight_log::load(file)?;
            let path = out.clone().unwrap_or_else(|| file.with_extension("mcap"));
            mcap::write(&log.flight, |name| wanted(topic, name), create(&path)?).map_err(|error| say(&path, &error))?;
            outln!("{}", path.display());
        }
        LogCommand::Cut { file, from, to, out } => {
            let bytes = std::fs::read(file).map_err(|error| say(file, &error))?;
            let instant = |seconds: f64| Instant::from_micros((seconds.max(0.0) * 1e6) as u64);
            let part = cut::cut(&bytes, instant(*from), instant(*to)).map_err(|error| say(file, &error))?;
            std::fs::write(out, &part).map_err(|error| say(out, &error))?;
            outln!("{}   {} of {} bytes", out.display(), part.len(), bytes.len());
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Without names, all topics are.
fn wanted(topics: &[String], name: &str) -> bool {
    topics.is_empty() || topics.iter().any(|topic| topic == name)
}

fn create(path: &Path) -> Result<BufWriter<File>, Failure> {
    Ok(BufWriter::new(File::create(path).map_err(|error| say(path, &error))?))
}

fn say(path: &Path, error: &dyn std::fmt::Display) -> String {
    format!("{}: {error}", path.display())
}
