//! What is in a log.

use super::refly::{OPTIONS, options_of};
use crate::flight_log::{FlightLog, Omission};
use serde::Serialize;
use stampfly_log::plain;
use stampfly_types::Instant;
use std::collections::BTreeMap;
use std::fmt;

/// Most characters of a fact on the screen.
const SHOWN: usize = 400;

/// What is in a log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Info {
    /// Facts that it states: vehicle, version, seed.
    pub facts: BTreeMap<String, String>,
    /// Number of parameters.
    pub parameters: usize,
    /// Instant of the first sample, s since power-on. Samples that have no time, with a stamp of
    /// zero, do not count.
    pub first_s: f64,
    /// Instant of the last sample, s since power-on.
    pub last_s: f64,
    /// Its topics, by name.
    pub topics: BTreeMap<String, TopicInfo>,
    /// Gaps that the writer has marked.
    pub gaps: usize,
    /// Was every byte of it read?
    pub whole: bool,
    /// How far it is whole, as a sentence.
    pub end: String,
    /// What of it cannot be read.
    pub omissions: Vec<String>,
}

/// One topic of a log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TopicInfo {
    /// Samples.
    pub samples: usize,
    /// Samples a second, between the first and the last; `None` with fewer than two.
    pub rate_hz: Option<f64>,
    /// Longest time between two samples, s.
    pub longest_gap_s: f64,
    /// Numbers in a sample.
    pub fields: usize,
}

impl Info {
    /// Looks into a log.
    ///
    /// ```
    /// use stampfly_host::log::info::Info;
    /// use stampfly_host::flight_log;
    /// use stampfly_log::ulog::{Definitions, Ram, Sample, Topic};
    /// use stampfly_types::{Instant, Message, messages::PowerData};
    ///
    /// let mut memory = [0; 4096];
    /// let topics = [Topic { name: "sensor_power", fields: PowerData::FIELDS }];
    /// let mut log = Definitions::start(Ram::new(&mut memory), Instant::ZERO)?.data(&topics[..])?;
    /// for ms in [0, 500, 1000] {
    ///     let words = PowerData::default().to_words();
    ///     log.sample(0, &Sample { at: Instant::from_millis(ms), generation: 1, words: &words })?;
    /// }
    /// let info = Info::of(&flight_log::parse(log.sink().written())?);
    /// assert_eq!((info.topics["sensor_power"].samples, info.topics["sensor_power"].rate_hz), (3, Some(2.0)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn of(log: &FlightLog) -> Self {
        let flight = &log.flight;
        let seconds = |at: Instant| at.as_micros() as f64 * 1e-6;
        let span = flight.span();
        let topics = flight.topics.iter().map(|(name, series)| {
            let times: Vec<f64> = series.at.iter().filter(|at| flight.is_time(**at)).map(|at| seconds(*at)).collect();
            let (first, last) = times.iter().fold((f64::MAX, f64::MIN), |(min, max), at| (min.min(*at), max.max(*at)));
            let gaps = times.windows(2).map(|pair| pair[1] - pair[0]);
            let info = TopicInfo {
                samples: series.at.len(),
                rate_hz: (last > first).then(|| (times.len() - 1) as f64 / (last - first)),
                longest_gap_s: gaps.fold(0.0, f64::max),
                fields: series.columns.len(),
            };
            (name.clone(), info)
        });
        // Options that are too long for one fact are one here.
        let (options, parts) = options_of(&flight.info);
        let whole = |name: &String, value: &String| if name == OPTIONS { options.clone() } else { value.clone() };
        let facts = flight.info.iter().filter(|(name, _)| *name == OPTIONS || !parts.contains(name));
        Self {
            facts: facts.map(|(name, value)| (name.clone(), whole(name, value))).collect(),
            parameters: flight.parameters.len(),
            first_s: span.map_or(0.0, |(first, _)| seconds(first)),
            last_s: span.map_or(0.0, |(_, last)| seconds(last)),
            topics: topics.collect(),
            gaps: log.dropouts.len(),
            whole: log.end.is_whole(),
            end: log.end.to_string(),
            omissions: omissions(log).map(ToString::to_string).collect(),
        }
    }
}

/// What is left out of a log and is not damage, of which its end tells.
pub(crate) fn omissions(log: &FlightLog) -> impl Iterator<Item = &Omission> {
    log.omissions.iter().filter(|omission| !matches!(omission, Omission::Damage(_)))
}

impl fmt::Display for Info {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, value) in &self.facts {
            // A stick file may be in there.
            let shown: String = value.chars().take(SHOWN).collect();
            let rest = if shown.len() < value.len() { "…" } else { "" };
            writeln!(f, "{:<24}{}{rest}", plain(name).to_string(), plain(&shown))?;
        }
        writeln!(f, "{:<24}{}", "parameters", self.parameters)?;
        writeln!(f, "{:<24}{:.3} s to {:.3} s", "samples", self.first_s, self.last_s)?;
        writeln!(f, "\n{:<24}{:>9} {:>10} {:>13} {:>7}", "topic", "samples", "rate, Hz", "longest gap, s", "fields")?;
        for (name, topic) in &self.topics {
            let rate = topic.rate_hz.map_or_else(|| "–".to_owned(), |rate| format!("{rate:.1}"));
            let TopicInfo { samples, longest_gap_s, fields, .. } = topic;
            let name = plain(name).to_string();
            writeln!(f, "{name:<24}{samples:>9} {rate:>10} {longest_gap_s:>14.3} {fields:>7}")?;
        }
        if self.gaps > 0 {
            writeln!(f, "\n{} gaps: the writer could not keep up, or a part was cut out", self.gaps)?;
        }
        if !self.whole {
            writeln!(f, "\nthe log is {}", self.end)?;
        }
        self.omissions.iter().try_for_each(|omission| writeln!(f, "\nnot read: {omission}"))
    }
}
