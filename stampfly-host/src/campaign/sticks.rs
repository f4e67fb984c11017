//! A campaign of stick files: every file in every mode that makes sense, with some seeds each.
//!
//! A file is flown as it is. One that has a single mode in all its rows is flown in every other
//! mode of the vehicle's pilot, too; one that changes the mode is not, because that is what it is
//! about.

use super::case::Case;
use super::row::{PANICKED, UNJUDGED};
use crate::flown::{Flown, fly};
use crate::recorder::Recorder;
use serde::{Deserialize, Serialize};
use stampfly_sim::sticks::{StickOptions, mode_named};
use stampfly_sim::vehicle::{Options, SetupError, Vehicle, Verdict};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// What names files of a folder.
const EXTENSION: &str = "csv";

/// These files, and the stick files in these folders by their names.
///
/// # Errors
/// When a folder cannot be read, or has none.
pub fn files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, String> {
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() {
            let unreadable = |error: std::io::Error| format!("--sticks {}: {error}", path.display());
            let entries = std::fs::read_dir(path).map_err(unreadable)?;
            let entries = entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<Vec<_>, _>>();
            let mut found = entries.map_err(unreadable)?;
            found.retain(|file| file.extension().is_some_and(|extension| extension == EXTENSION));
            found.sort();
            if found.is_empty() {
                return Err(format!("--sticks {}: no file *.{EXTENSION} in this folder", path.display()));
            }
            files.extend(found);
        } else {
            files.push(path.clone());
        }
    }
    Ok(files)
}

/// A file in a mode: what is flown with several seeds.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The file.
    pub file: PathBuf,
    /// The mode in place of the file's.
    pub mode: Option<String>,
    /// All that decides a flight but its seed.
    pub options: Options,
}

/// The cells of a file. `flown` has everything that is the same in all flights.
///
/// # Errors
/// When the vehicle does not fly it.
pub fn cells<V: Vehicle>(file: &Path, sticks: &StickOptions, flown: &Options) -> Result<Vec<Cell>, SetupError> {
    let modes = sticks.file()?.modes();
    let others = V::VARIETY.modes.iter().filter(|name| mode_named(name).is_none_or(|mode| modes != [mode]));
    let others = others.filter(|_| modes.len() == 1 && sticks.mode.is_none()).map(|name| Some((*name).to_owned()));
    let cells = [sticks.mode.clone()].into_iter().chain(others).map(|mode| {
        let sticks = StickOptions { mode: mode.clone(), ..sticks.clone() };
        let options = Options { sticks: Some(sticks), ..flown.clone() };
        // What is wrong with one flight is wrong before all of them.
        V::setup(&options, 1)?;
        Ok(Cell { file: file.to_owned(), mode, options })
    });
    cells.collect()
}

/// Something that a vehicle did by itself: the fields of [`Verdict::findings`] that this campaign
/// knows.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Intervention {
    /// When, s since power-on.
    pub t_s: f64,
    /// The alerts.
    pub alert: String,
    /// What it did.
    pub action: String,
    /// Was it sound?
    pub sound: bool,
    /// Height, m.
    pub height_m: f64,
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Tilt, degrees.
    pub tilt_deg: f64,
    /// Of the estimate, degrees.
    pub attitude_error_deg: f64,
}

/// What a vehicle says of a flight.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
struct Findings {
    outcome: String,
    reason: String,
    violations: Vec<String>,
    interventions: Vec<Intervention>,
}

/// A flight of the campaign.
#[derive(Clone, Debug, Serialize)]
pub struct Flight {
    /// The file.
    pub file: String,
    /// The mode in place of the file's.
    pub mode: Option<String>,
    /// The seed.
    pub seed: u64,
    /// Did it end well, and without anything that a sound vehicle did by itself?
    pub ended_well: bool,
    /// How it ended.
    pub outcome: String,
    /// Why.
    pub reason: String,
    /// Invariants that did not hold.
    pub violations: Vec<String>,
    /// What the vehicle did by itself.
    pub interventions: Vec<Intervention>,
    /// Simulated time, s.
    pub duration_s: f64,
    /// Hash over everything that was published.
    pub log_hash: String,
    /// The line that repeats it.
    pub line: String,
}

/// Flies it. A flight that panics is one that ended badly.
///
/// # Errors
/// When the vehicle has no such flight.
pub fn fly_one<V: Vehicle>(cell: &Cell, seed: u64) -> Result<Flight, SetupError> {
    let setup = V::setup(&cell.options, seed)?;
    let case = Case { vehicle: V::NAME.into(), index: 0, seed, options: cell.options.clone() };
    let flown = catch_unwind(AssertUnwindSafe(|| {
        let mut recorder = Recorder::<V>::hash_only();
        let flown = fly::<V>(&setup, &mut recorder, &mut |_, _| {});
        (flown, recorder.hash())
    }));
    let flight = Flight {
        file: cell.file.display().to_string(),
        mode: cell.mode.clone(),
        seed,
        ended_well: false,
        outcome: PANICKED.into(),
        reason: String::new(),
        violations: Vec::new(),
        interventions: Vec::new(),
        duration_s: 0.0,
        log_hash: String::new(),
        line: case.line(),
    };
    Ok(match flown {
        Ok((flown, hash)) => finished(flight, &flown, hash),
        Err(_) => flight,
    })
}

fn finished<O: Verdict>(flight: Flight, flown: &Flown<O>, hash: u64) -> Flight {
    // Numbers and texts always have a JSON form.
    let findings = serde_json::to_value(flown.outcome.findings()).unwrap_or_default();
    let unjudged = Findings { outcome: UNJUDGED.into(), ..Findings::default() };
    let Findings { outcome, reason, violations, interventions } = serde_json::from_value(findings).unwrap_or(unjudged);
    let unhindered = !interventions.iter().any(|one| one.sound);
    let (ended_well, duration_s) = (flown.outcome.succeeded() && unhindered, flown.duration.seconds_f64());
    let log_hash = format!("{hash:016x}");
    Flight { ended_well, outcome, reason, violations, interventions, duration_s, log_hash, ..flight }
}

/// What the flights of a file in a mode say together.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Sum {
    /// The file.
    pub file: String,
    /// The mode in place of the file's.
    pub mode: Option<String>,
    /// How many.
    pub flights: usize,
    /// How many ended well.
    pub ended_well: usize,
    /// How many ended how.
    pub outcomes: BTreeMap<String, usize>,
    /// What sound vehicles did by themselves: the alert, what they did, and how often.
    pub while_sound: BTreeMap<String, usize>,
    /// The same of vehicles that were not sound.
    pub while_not_sound: BTreeMap<String, usize>,
}

/// One sum for each cell, in the order of the flights.
#[must_use]
pub fn sums(flights: &[Flight]) -> Vec<Sum> {
    let mut sums: Vec<Sum> = Vec::new();
    for flight in flights {
        let is_of = |sum: &Sum| sum.file == flight.file && sum.mode == flight.mode;
        if !sums.last().is_some_and(is_of) {
            sums.push(Sum { file: flight.file.clone(), mode: flight.mode.clone(), ..Sum::default() });
        }
        let Some(sum) = sums.last_mut() else { continue };
        sum.flights += 1;
        sum.ended_well += usize::from(flight.ended_well);
        *sum.outcomes.entry(flight.outcome.clone()).or_default() += 1;
        for Intervention { alert, action, sound, .. } in &flight.interventions {
            let counts = if *sound { &mut sum.while_sound } else { &mut sum.while_not_sound };
            *counts.entry(format!("{alert} {action}")).or_default() += 1;
        }
    }
    sums
}
