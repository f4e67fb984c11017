//! `stampfly log`: what is in a log, a part of it, other formats of it.

use crate::command_line::arguments::LogCommand;
use crate::command_line::failure::Failure;
use crate::flight::Series;
use crate::flight_log::{self, FlightLog, Omission};
use crate::log::csv::{self, FileNames};
use crate::log::info::{Info, omissions};
use crate::log::{cut, mcap, record, refly};
use crate::serve::receive;
use crate::vehicles::{self, ForVehicle};
use serde_json::json;
use stampfly_flight::compact::{Contents, Samples};
use stampfly_flight::replay;
use stampfly_sim::vehicle::Vehicle;
use stampfly_types::Instant;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::net::UdpSocket;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

pub fn run(command: &LogCommand) -> Result<ExitCode, Failure> {
    match command {
        LogCommand::Info { file, json } => {
            let info = Info::of(&load(file)?);
            if *json {
                outln!("{}", json!(info));
            } else {
                outln!("{}", info.to_string().trim_end());
            }
        }
        LogCommand::Csv { file, topic, out } => {
            let log = load(file)?;
            std::fs::create_dir_all(out).map_err(|error| format!("{}: {error}", out.display()))?;
            let mut names = FileNames::new(&file.file_stem().unwrap_or_default().to_string_lossy());
            let mut failure = missing(&log, topic).map(|error| say(file, &error));
            for (name, series) in log.flight.topics.iter().filter(|(name, _)| wanted(topic, name)) {
                let path = out.join(names.next(name));
                match table(series, &path) {
                    Ok(()) => outln!("{}   {} rows", path.display(), series.at.len()),
                    // The others are worth having all the same.
                    Err(error) => failure = Some(say(&path, &error)),
                }
            }
            tell_end(&log);
            failure.map_or(Ok(()), Err)?;
        }
        LogCommand::Mcap { file, topic, out } => {
            let log = load(file)?;
            missing(&log, topic).map_or(Ok(()), |error| Err(say(file, &error)))?;
            let path = out.clone().unwrap_or_else(|| file.with_extension("mcap"));
            mcap::write(&log.flight, |name| wanted(topic, name), create(&path)?).map_err(|error| say(&path, &error))?;
            outln!("{}", path.display());
            tell_end(&log);
        }
        LogCommand::Cut { file, from, to, out } => {
            let bytes = std::fs::read(file).map_err(|error| say(file, &error))?;
            let instant = |seconds: f64| Instant::from_micros((seconds.max(0.0) * 1e6) as u64);
            let (log, _) = record::as_log(&bytes).map_err(|error| say(file, &error))?;
            let (part, end) = cut::cut(&log, instant(*from), instant(*to)).map_err(|error| say(file, &error))?;
            std::fs::write(out, &part).map_err(|error| say(out, &error))?;
            outln!("{}   {} of {} bytes", out.display(), part.len(), bytes.len());
            if !end.is_whole() {
                outln!("the log is {end}");
            }
        }
        LogCommand::Receive { address, out, seconds } => {
            let socket = UdpSocket::bind(address).map_err(|error| format!("{address}: {error}"))?;
            let mut file = create(out)?;
            let limit = Duration::from_secs(u64::from(*seconds));
            let received = receive(&socket, &mut file, limit).map_err(|error| say(out, &error))?;
            outln!("{}   {} chunks, {} missing", out.display(), received.chunks(), received.missing());
        }
        LogCommand::Ulog { file, out } => {
            let bytes = std::fs::read(file).map_err(|error| say(file, &error))?;
            if !record::is_record(&bytes) {
                return Err(format!("{}: no compact flight record", file.display()).into());
            }
            let (log, contents) = record::run_again(&bytes, None, Samples::Again).map_err(|error| say(file, &error))?;
            std::fs::write(out, &log).map_err(|error| say(out, &error))?;
            outln!("{}   {} bytes of {}", out.display(), log.len(), bytes.len());
            outln!("{}", told(&contents));
        }
        LogCommand::Refly { file, from, param, out, json } => {
            let bytes = std::fs::read(file).map_err(|error| say(file, &error))?;
            let page = out.clone().unwrap_or_else(|| file.with_extension("refly.html"));
            let from = Instant::from_micros((from.max(0.0) * 1e6) as u64);
            let task = Refly { log: &bytes, from, parameters: param, page: &page, json: *json };
            vehicles::with(replay::vehicle_name(&bytes).unwrap_or(vehicles::DEFAULT), task)?
                .map_err(|error| say(file, &error))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// A log, or a compact record as a log.
fn load(path: &Path) -> Result<FlightLog, Failure> {
    let bytes = std::fs::read(path).map_err(|error| say(path, &error))?;
    let (log, contents) = record::as_log(&bytes).map_err(|error| say(path, &error))?;
    if let Some(contents) = contents {
        errln!("a compact record, run again: {}", told(&contents));
    }
    Ok(flight_log::parse(&log).map_err(|error| say(path, &error))?)
}

/// What was in a compact record.
pub fn told(contents: &Contents) -> String {
    let Contents { activations, samples, key_frames, gaps, lost, .. } = contents;
    let seconds = contents.duration().seconds_f64();
    format!(
        "{seconds:.3} s, {activations} activations, {samples} samples from outside, {key_frames} key frames, {gaps} gaps, \
         {lost} passes lost in flight"
    )
}

struct Refly<'r> {
    log: &'r [u8],
    from: Instant,
    parameters: &'r [String],
    page: &'r Path,
    json: bool,
}

impl ForVehicle for Refly<'_> {
    type Output = Result<(), String>;

    fn run<V: Vehicle>(self) -> Self::Output {
        let said = |path: &Path, error: std::io::Error| say(path, &error);
        let reflown = refly::refly::<V>(self.log, self.from, self.parameters).map_err(|error| error.to_string())?;
        let log = self.page.with_extension("ulg");
        std::fs::write(&log, &reflown.log).map_err(|error| said(&log, error))?;
        reflown.write_report::<V>(self.page).map_err(|error| said(self.page, error))?;
        if self.json {
            outln!("{}", reflown.to_json());
        } else {
            outln!("{reflown}\nlog     {}\nreport  {}   (open it in a browser)", log.display(), self.page.display());
        }
        Ok(())
    }
}

/// Without names, all topics are. A name without an instance is of all of them.
fn wanted(topics: &[String], name: &str) -> bool {
    let without = name.split_once(['[', '#']).map_or(name, |(without, _)| without);
    topics.is_empty() || topics.iter().any(|topic| topic == name || topic == without)
}

/// The first of these topics that the log does not have, and why, if that is known.
fn missing(log: &FlightLog, topics: &[String]) -> Option<String> {
    let has = |wants: &String| log.flight.topics.keys().any(|name| wanted(std::slice::from_ref(wants), name));
    let name = topics.iter().find(|topic| !has(topic))?;
    let reason =
        log.omissions.iter().find(|omission| matches!(omission, Omission::Topic { topic, .. } if topic == name));
    Some(reason.map_or_else(|| format!("no topic `{name}`; `stampfly log info` lists them"), ToString::to_string))
}

/// How far the log is whole, and what is left out of it.
fn tell_end(log: &FlightLog) {
    if !log.end.is_whole() {
        outln!("the log is {}", log.end);
    }
    omissions(log).for_each(|omission| outln!("not read: {omission}"));
}

fn table(series: &Series, path: &Path) -> std::io::Result<()> {
    let mut table = BufWriter::new(File::create(path)?);
    csv::write(series, &mut table)?;
    table.flush()
}

fn create(path: &Path) -> Result<BufWriter<File>, Failure> {
    Ok(BufWriter::new(File::create(path).map_err(|error| say(path, &error))?))
}

fn say(path: &Path, error: &dyn std::fmt::Display) -> String {
    format!("{}: {error}", path.display())
}
