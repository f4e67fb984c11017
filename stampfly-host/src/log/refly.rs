//! A simulated flight again, with other parameters from an instant on.
//!
//! The log of `stampfly fly` says what world it was flown in: options, seed, version. The simulator is deterministic, so the flight
//! up to that instant is the recorded one bit for bit, which is checked; from there on the flight stack has the new
//! parameters and its states of before ([`change`](stampfly_sim::vehicle::change)), and the simulated world answers.
//! The log of a board has no world that would answer; `stampfly replay` repeats what it computed.

use crate::flight::{Column, Flight, Series};
use crate::flight_log::{self, FlightLog};
use crate::flown::{Flown, fly};
use crate::report::{Metric, Report};
use serde_json::{Value, json};
use stampfly_bus::Schedule;
use stampfly_log::ulog::{End, ReadError};
use stampfly_sim::recorder::Recorder;
use stampfly_sim::vehicle::change::{Change, ChangeError};
use stampfly_sim::vehicle::{Motion, Observer, Options, Page, PanelSpec, SetupError, Vehicle, Verdict};
use stampfly_types::Instant;
use std::collections::BTreeMap;
use std::fmt;
use std::io;
use std::path::Path;

/// The fact of a log that has the options of its flight, as JSON. What is longer than a message of
/// a log goes on in `flight_options/1` and so on.
pub const OPTIONS: &str = "flight_options";
/// Most bytes of the options in one fact: a message of a log has 2048, and the fact's key is in it.
const PART: usize = 1_900;
/// Where the course of before is in a report.
const BEFORE: &str = "before";
/// Where the way from it to the new course is.
const DIFFERENCE: &str = "difference";

/// What the head of a flight's log says about the flight, so that it can be flown again.
///
/// # Errors
/// When there is no such flight.
pub fn facts<V: Vehicle>(options: &Options, seed: u64) -> Result<Vec<(String, String)>, SetupError> {
    let settled = serde_json::to_string(&V::settled(options, seed)?).map_err(|error| error.to_string())?;
    let mission = flown(options).unwrap_or_else(|| "default".into());
    let facts = [("ver_sw", env!("CARGO_PKG_VERSION").to_owned()), ("seed", seed.to_string()), ("mission", mission)];
    Ok(facts.map(|(name, value)| (name.to_owned(), value)).into_iter().chain(in_parts(&settled)).collect())
}

/// What is flown, for people: the mission, or the stick file, as it was typed.
#[must_use]
pub fn flown(options: &Options) -> Option<String> {
    // Not what is in a file.
    let clipped = |text: &str| text.lines().next().unwrap_or_default().chars().take(200).collect::<String>();
    let sticks = options.sticks.as_ref().map(|sticks| format!("sticks {}", clipped(&sticks.file)));
    sticks.or_else(|| options.mission.as_deref().map(clipped))
}

/// The options as facts.
fn in_parts(options: &str) -> Vec<(String, String)> {
    let (mut parts, mut rest) = (Vec::new(), options);
    while parts.is_empty() || !rest.is_empty() {
        let end = (0..=PART.min(rest.len())).rev().find(|end| rest.is_char_boundary(*end)).unwrap_or(rest.len());
        let (part, behind) = rest.split_at(end);
        parts.push((key_of_part(parts.len()), part.to_owned()));
        rest = behind;
    }
    parts
}

/// The options among a log's facts, put together, and the names of the facts that have them.
pub(crate) fn options_of(facts: &BTreeMap<String, String>) -> (String, Vec<String>) {
    let keys: Vec<_> = (0..).map(key_of_part).take_while(|key| facts.contains_key(key)).collect();
    (keys.iter().filter_map(|key| facts.get(key)).map(String::as_str).collect(), keys)
}

fn key_of_part(part: usize) -> String {
    if part == 0 { OPTIONS.to_owned() } else { format!("{OPTIONS}/{part}") }
}

/// Why a flight was not flown again.
#[derive(Debug)]
#[non_exhaustive]
pub enum ReflyError {
    /// It is no log.
    Log(ReadError),
    /// The log does not say in which simulated world it was flown: it is a board's own, or programs flew it.
    NoWorld,
    /// The flight cannot be set up, with its own parameters or with the new ones.
    Setup(SetupError),
    /// The flight as it was is not the recorded one: another version of the program flew it.
    OtherFlight {
        /// Which version.
        version: String,
    },
    /// It was over before that instant.
    Over,
    /// The change cannot be made at that instant.
    Change(ChangeError),
}

impl fmt::Display for ReflyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Log(error) => error.fmt(f),
            Self::NoWorld => f.write_str(
                "the log names no simulated world: it is a board's own, or other programs flew it. Nothing would answer to another \
                 course; `stampfly replay` repeats what was computed",
            ),
            Self::Setup(error) => f.write_str(error),
            Self::OtherFlight { version } => write!(
                f,
                "without a change it is not the recorded flight: version {version} recorded it, this is {}",
                env!("CARGO_PKG_VERSION")
            ),
            Self::Over => f.write_str("the flight was over before that"),
            Self::Change(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for ReflyError {}

/// How a course differs from the one before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Apart {
    /// When they are first apart by more than a millimetre, s.
    pub since_s: Option<f64>,
    /// Farthest apart, m.
    pub farthest_m: f64,
    /// When, s.
    pub farthest_at_s: f64,
    /// At the end of the shorter one, m.
    pub at_end_m: f64,
}

/// Both courses.
#[derive(Clone, Debug)]
pub struct Reflown<O> {
    /// When the parameters were changed.
    pub changed_at: Instant,
    /// What was changed.
    pub parameters: Vec<String>,
    /// The log of the new course. Its head has the old parameters, so `stampfly replay` differs from the change on.
    pub log: Vec<u8>,
    /// How the flight went before, and how it went now.
    pub outcomes: [O; 2],
    /// How far apart the courses are.
    pub apart: Apart,
    /// How far the log of the flight was whole.
    pub end: End,
    flight: Flight,
}

/// Flies the flight of a log again, with these parameters (`NAME=VALUE`) from an instant on.
///
/// # Errors
/// When there is no world to fly it in, or the change cannot be made.
pub fn refly<V: Vehicle>(log: &[u8], from: Instant, parameters: &[String]) -> Result<Reflown<V::Outcome>, ReflyError> {
    let recorded = flight_log::parse(log).map_err(ReflyError::Log)?;
    let fact = |name: &str| recorded.flight.info.get(name);
    let (text, keys) = options_of(&recorded.flight.info);
    let options: Options = serde_json::from_str(&text).map_err(|_| ReflyError::NoWorld)?;
    let seed = fact("seed").and_then(|text| text.parse().ok()).ok_or(ReflyError::NoWorld)?;
    let setup = V::setup(&options, seed).map_err(ReflyError::Setup)?;
    let mut with_change = options.clone();
    with_change.param.extend_from_slice(parameters);
    let changed = V::setup(&with_change, seed).map_err(ReflyError::Setup)?;

    // What the log says of itself, once more: the mission may have been named.
    let named = ["ver_sw", "seed", "mission"].map(String::from).into_iter().chain(keys);
    let facts: Vec<_> = named.filter_map(|name| fact(&name).cloned().map(|value| (name, value))).collect();
    let mut before = Recorder::<V>::with_log(&setup, &facts);
    let flown_before = fly::<V>(&setup, &mut before, &mut |_, _| {});
    // As far as the log goes: it may have been cut off.
    let whole = match recorded.end {
        End::Cut { at, .. } => at,
        _ => log.len(),
    };
    if !log.get(..whole).is_some_and(|whole| before.log().starts_with(whole)) {
        return Err(ReflyError::OtherFlight { version: fact("ver_sw").cloned().unwrap_or_default() });
    }

    let start = V::options(&setup).start;
    let (flown, recorder, changed_at) = if from <= start {
        // From power-on there is no state to carry over, and any component may begin.
        let mut recorder = Recorder::<V>::with_log(&changed, &facts);
        (fly::<V>(&changed, &mut recorder, &mut |_, _| {}), recorder, start)
    } else {
        let (old, new) = (config::<V>(&setup), config::<V>(&changed));
        if !V::has_same_components(&old, &new) {
            return Err(ReflyError::Change(ChangeError::OtherComponents));
        }
        let change = Change::<V::Runnables>::new(from, old, new);
        let mut witness = (Recorder::<V>::with_log(&setup, &facts), change);
        let flown = fly::<V>(&setup, &mut witness, &mut |_, _| {});
        let (recorder, change) = witness;
        (flown, recorder, change.made().ok_or(ReflyError::Over)?.map_err(ReflyError::Change)?)
    };
    let log = recorder.log().to_vec();
    let FlightLog { mut flight, .. } = flight_log::parse(&log).map_err(ReflyError::Log)?;
    let apart = compare(&mut flight, &recorded.flight, V::PAGE.observers, changed_at);
    let outcomes = [flown_before, flown].map(|Flown { outcome, .. }| outcome);
    Ok(Reflown { changed_at, parameters: parameters.to_vec(), log, outcomes, apart, end: recorded.end, flight })
}

fn config<V: Vehicle>(setup: &V::Setup) -> <V::Runnables as Schedule>::Config {
    let mut config = V::default_config();
    // By name, because a configuration cannot be copied. A value of its own is one that it takes.
    for setting in V::parameters(V::config(setup)) {
        let value = stampfly_log::ulog::ParameterValue::Float(setting.value as f32);
        let _ = V::set_parameter(&mut config, setting.name, value);
    }
    config
}

/// The topic that says best where a vehicle is: the truth where there is one.
fn course(observers: &[Observer]) -> Option<&Observer> {
    observers.iter().find(|observer| observer.role == "truth").or_else(|| observers.first())
}

/// Columns that are a place.
fn place(motion: Motion) -> &'static [&'static str] {
    match motion {
        Motion::Space => &["position[0]", "position[1]", "position[2]"],
        Motion::Plane => &["x", "y"],
    }
}

/// Adds the course of before to a flight, and the way from it.
fn compare(flight: &mut Flight, before: &Flight, observers: &[Observer], from: Instant) -> Apart {
    let mut apart = Apart::default();
    let Some(observer) = course(observers) else { return apart };
    let (Some(old), Some(new)) = (before.topics.get(observer.topic), flight.topics.get(observer.topic)) else {
        return apart;
    };
    let names = place(observer.motion);
    let mut difference = Series::default();
    let column = |name: &str| Column { name: name.into(), field: name.into(), values: Vec::new() };
    difference.columns = names.iter().copied().chain(["distance"]).map(column).collect();
    for (row, at) in new.at.iter().enumerate().filter(|(_, at)| **at >= from) {
        let Some(then) = old.index_at(*at).filter(|_| old.at.last().is_some_and(|last| at <= last)) else { continue };
        let way = names.iter().map(|name| Some(new.column(name)?.get(row)? - old.column(name)?.get(then)?));
        let Some(way) = way.collect::<Option<Vec<f64>>>() else { continue };
        let distance = way.iter().map(|part| part * part).sum::<f64>().sqrt();
        let seconds = at.as_micros() as f64 * 1e-6;
        if distance > 1e-3 && apart.since_s.is_none() {
            apart.since_s = Some(seconds);
        }
        if distance > apart.farthest_m {
            (apart.farthest_m, apart.farthest_at_s) = (distance, seconds);
        }
        apart.at_end_m = distance;
        difference.at.push(*at);
        for (column, value) in difference.columns.iter_mut().zip(way.into_iter().chain([distance])) {
            column.values.push(value);
        }
    }
    let old = old.clone();
    flight.topics.insert(BEFORE.into(), old);
    flight.topics.insert(DIFFERENCE.into(), difference);
    apart
}

impl<O: Verdict> Reflown<O> {
    /// A page with both courses and the way from one to the other.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write_report<V: Vehicle<Outcome = O>>(&self, file: &Path) -> io::Result<()> {
        let page = page(V::PAGE);
        let page: &'static Page = Box::leak(Box::new(page));
        let mut metrics = vec![Metric::new("changed", self.parameters.join(", "), "")];
        metrics.push(Metric::new("from", format!("{:.3}", self.changed_at.as_micros() as f64 * 1e-6), "s"));
        metrics.push(Metric::new("farthest apart", format!("{:.3}", self.apart.farthest_m), "m"));
        for (what, outcome) in ["as it flew", "now"].into_iter().zip(&self.outcomes) {
            metrics.push(Metric::new(what, outcome.sentence(), "").judged(outcome.succeeded()));
        }
        for (before, now) in self.outcomes[0].figures().iter().zip(self.outcomes[1].figures()) {
            let both = [before.value, now.value].map(|value| value.map_or("–".into(), |value| format!("{value:.3}")));
            metrics.push(Metric::new(now.title(), both.join(" → "), now.unit));
        }
        let report = Report {
            title: format!("Flight of {}, flown again", V::NAME),
            subtitle: format!(
                "{} from {:.1} s on",
                self.parameters.join(", "),
                self.changed_at.as_micros() as f64 * 1e-6
            ),
            metrics,
            page,
            flight: &self.flight,
        };
        report.write(file)
    }

    /// For scripts.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let [before, now] = [0, 1].map(|index| {
            let outcome = &self.outcomes[index];
            let mut object = json!({ "succeeded": outcome.succeeded() });
            for figure in outcome.figures() {
                object[figure.name] = json!(figure.value);
            }
            object
        });
        json!({
            "changed": self.parameters, "changed_at_s": self.changed_at.as_micros() as f64 * 1e-6,
            "apart_since_s": self.apart.since_s, "farthest_m": self.apart.farthest_m,
            "farthest_at_s": self.apart.farthest_at_s, "at_end_m": self.apart.at_end_m,
            "whole": self.end.is_whole(), "end": self.end.to_string(),
            "before": before, "now": now,
        })
    }
}

/// The vehicle's page, with the course of before and the difference. Kept for as long as the program runs, as the pages of vehicles are.
fn page(of: Page) -> Page {
    let Some(main) = course(of.observers) else { return of };
    let before = Observer { topic: BEFORE, role: "device", name: "as it flew", motion: main.motion };
    let observers: Vec<Observer> = of.observers.iter().copied().chain([before]).collect();
    let lines: Vec<(&str, &str)> =
        place(main.motion).iter().map(|name| (*name, *name)).chain([("distance", "distance")]).collect();
    let panel = PanelSpec::new("Courses", "From the flight as it was", "m", DIFFERENCE, lines.leak());
    let panels: Vec<PanelSpec> = [panel].into_iter().chain(of.panels.iter().copied()).collect();
    Page { observers: observers.leak(), panels: panels.leak(), ..of }
}

/// The screen.
impl<O: Verdict> fmt::Display for Reflown<O> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = self.changed_at.as_micros() as f64 * 1e-6;
        writeln!(f, "{} from {seconds:.3} s on\n", self.parameters.join(", "))?;
        writeln!(f, "  {:<22} {:>10} {:>10}", "", "as it flew", "now")?;
        for (before, now) in self.outcomes[0].figures().iter().zip(self.outcomes[1].figures()) {
            let [was, is] =
                [before.value, now.value].map(|value| value.map_or("–".into(), |value| format!("{value:.3}")));
            writeln!(f, "  {:<22} {was:>10} {is:>10} {}", now.name, now.unit)?;
        }
        let Apart { since_s, farthest_m, farthest_at_s, at_end_m } = self.apart;
        match since_s {
            None => writeln!(f, "\nthe same course to a millimetre")?,
            Some(since) => writeln!(
                f,
                "\napart from {since:.3} s on, farthest {farthest_m:.3} m at {farthest_at_s:.3} s, {at_end_m:.3} m at the end"
            )?,
        }
        for (what, outcome) in ["as it flew", "now"].into_iter().zip(&self.outcomes) {
            writeln!(f, "{what:<12}{}", outcome.sentence())?;
        }
        if !self.end.is_whole() {
            writeln!(f, "the log is {}", self.end)?;
        }
        Ok(())
    }
}
