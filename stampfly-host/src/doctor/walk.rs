//! The examination: what is looked at in which order, and what is made of it.
//!
//! A fault is named once. What follows from a chip that does not answer, or from a bus that does not, is not examined.

mod motion;
mod people;
mod vehicle;

use super::chart::Chart;
use super::visit::{Act, Lost, Visit};
use stampfly_flight::doctor::Verdict;
use std::collections::BTreeMap;
use std::time::Duration;

/// From power-on to the first answer: the self test's silence, and a margin.
const STARTS: Duration = Duration::from_secs(4);
/// Tries to reach a vehicle that has just been switched on.
const TRIES: usize = 5;

/// What is known so far.
struct Examination<'v, V> {
    visit: &'v mut V,
    chart: Chart,
    /// Which sensors measure, by name.
    measures: BTreeMap<String, bool>,
}

/// Examines a vehicle from power-on. The chart has no transcript: `visit` keeps it.
pub fn examine(visit: &mut impl Visit) -> Chart {
    let mut examination = Examination { visit, chart: Chart::default(), measures: BTreeMap::new() };
    if let Err(Lost(why)) = examination.run() {
        let advice =
            "is the cable one for data, the battery plugged in, the port the vehicle's, and no other terminal open?";
        examination.chart.note("no-answer", Verdict::Fail, why, advice);
    }
    examination.chart
}

impl<V: Visit> Examination<'_, V> {
    fn run(&mut self) -> Result<(), Lost> {
        self.visit.please(Act::PowerOn);
        self.visit.wait(STARTS);
        self.reach()?;
        self.look_and_listen();
        self.what_it_says()?;
        self.battery()?;
        self.poses()?;
        self.turns()?;
        self.heights()?;
        self.slides()?;
        self.ahead()?;
        self.motors()?;
        self.button()?;
        self.transmitter()?;
        self.ready()
    }

    /// The first answer, from a vehicle that may still be starting.
    fn reach(&mut self) -> Result<(), Lost> {
        let mut outcome = Ok(());
        for _ in 0..TRIES {
            match self.visit.ask("version") {
                Ok(version) => {
                    self.chart.pass("version", version.trim());
                    return Ok(());
                }
                Err(lost) => outcome = Err(lost),
            }
        }
        outcome
    }

    /// Does this sensor measure?
    fn works(&self, sensor: &str) -> bool {
        self.measures.get(sensor) == Some(&true)
    }

    /// At the end: what still keeps it from arming, when nothing else was found.
    fn ready(&mut self) -> Result<(), Lost> {
        for line in ["status", "profile", "sensor", "param list"] {
            self.visit.ask(line)?;
        }
        let answer = self.visit.ask("doctor")?;
        let blocks = answer
            .lines()
            .filter_map(stampfly_flight::doctor::Finding::parse)
            .find(|finding| finding.name == "arming")
            .map_or("unknown", |finding| finding.value)
            .to_owned();
        if self.chart.findings().next().is_none() {
            let seen = format!("refused by: {blocks}");
            if blocks == "none" {
                self.chart.pass("ready to arm", seen);
            } else {
                self.chart.note("not-ready", Verdict::Look, seen, "the page about modes says what each means");
            }
        }
        Ok(())
    }
}
