//! What the vehicle says of itself: chips, buses, battery, processor.

use super::Examination;
use crate::doctor::reading::{mean, several};
use crate::doctor::visit::{Lost, Visit};
use stampfly_drivers::SensorErrorKind;
use stampfly_flight::doctor::{Finding, Verdict};
use std::collections::BTreeMap;
use std::time::Duration;

/// How long the drivers are watched.
const WATCHED: Duration = Duration::from_secs(4);
/// Errors in that time which are a loose contact.
const LOOSE: u64 = 2;
/// On SPI; all others are on I2C.
const ON_SPI: [&str; 2] = ["imu", "flow"];

/// Below this there is no battery, V.
const ABSENT: f64 = 1.0;
/// What one lithium cell can have, V: no processor runs below, no charger goes above.
const CELL: std::ops::Range<f64> = 2.8..4.5;
/// To be charged before anything else, V.
const WEAK: f64 = 3.5;
/// The board and its radio, motors off, take less than this, A.
const AT_REST: f64 = 0.7;

/// A sensor in an answer to `doctor`.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Driver {
    samples: u64,
    errors: u64,
    last_error: String,
}

impl Driver {
    fn parse(value: &str) -> Option<Self> {
        let (counts, last_error) = value.split_once(" last_error ")?;
        let words: Vec<_> = counts.split(' ').collect();
        let ["samples", samples, "errors", errors, ..] = words[..] else { return None };
        Some(Self { samples: samples.parse().ok()?, errors: errors.parse().ok()?, last_error: last_error.to_owned() })
    }
}

fn drivers(answer: &str) -> BTreeMap<String, Driver> {
    let lines = answer.lines().filter_map(Finding::parse);
    lines.filter_map(|line| Some((line.name.to_owned(), Driver::parse(line.value)?))).collect()
}

impl<V: Visit> Examination<'_, V> {
    /// The vehicle's own checks, twice: what counts has to grow, and errors have not.
    pub(super) fn what_it_says(&mut self) -> Result<(), Lost> {
        let before = drivers(&self.visit.ask("doctor")?);
        self.visit.wait(WATCHED);
        let answer = self.visit.ask("doctor")?;
        let after = drivers(&answer);
        self.sensors(&before, &after);
        let facts: Vec<_> = answer.lines().filter_map(Finding::parse).collect();
        for fact in &facts {
            let slow_flash = || facts.iter().any(|fact| fact.name == "flash" && fact.verdict != Verdict::Pass);
            let name = match (fact.name, fact.verdict) {
                ("version" | "awake" | "arming", _) => continue,
                (name, _) if after.contains_key(name) => continue,
                (name, Verdict::Pass) => name.to_owned(),
                ("restart", _) => format!("restart-{}", fact.value),
                ("flash", _) => "flash-slow".into(),
                // They are late because of it.
                ("passes", _) if slow_flash() => continue,
                ("passes", _) => "passes-late".into(),
                ("self_test", Verdict::Look) => "self-test-differs".into(),
                ("self_test", _) => "self-test-failed".into(),
                (name, _) => name.replace('_', "-"),
            };
            self.chart.note(&name, fact.verdict, fact.value, fact.advice);
        }
        Ok(())
    }

    fn sensors(&mut self, before: &BTreeMap<String, Driver>, after: &BTreeMap<String, Driver>) {
        let grown = |name: &str, count: fn(&Driver) -> u64| {
            let earlier = before.get(name).map_or(0, count);
            after.get(name).map_or(0, count).saturating_sub(earlier)
        };
        for name in after.keys() {
            self.measures.insert(name.clone(), grown(name, |driver| driver.samples) > 0);
        }
        let other = SensorErrorKind::Identification.to_string();
        let silent = |name: &&String| !self.measures[*name] && after[*name].last_error != other;
        let (spi, i2c): (Vec<_>, Vec<_>) = after.keys().partition(|name| ON_SPI.contains(&name.as_str()));
        let mut buses = Vec::new();
        for (bus, on_it) in [("spi-stuck", spi), ("i2c-shorted", i2c)] {
            if on_it.len() > 1 && on_it.iter().all(silent) {
                let seen = format!("{} of {} chips are silent", on_it.len(), on_it.len());
                self.chart.note(bus, Verdict::Fail, seen, "a line of this bus is interrupted or shorted");
                buses.extend(on_it);
            }
        }
        let mut loose = Vec::new();
        for (name, driver) in after.iter().filter(|(name, _)| !buses.contains(name)) {
            let dashed = name.replace('_', "-");
            let Driver { samples, errors, last_error } = driver;
            let new = grown(name, |driver| driver.errors);
            let seen = format!("{samples} samples, {errors} errors, last: {last_error}");
            let numb = [SensorErrorKind::SelfTest, SensorErrorKind::Data].map(|kind| kind.to_string());
            match () {
                () if self.works(name) && new < LOOSE && *last_error == SensorErrorKind::Implausible.to_string() => {
                    let advice = "it works, but not the way it does elsewhere: please report it";
                    self.chart.note(&format!("{dashed}-light-mode"), Verdict::Look, seen, advice);
                }
                () if self.works(name) && new < LOOSE => self.chart.pass(name, seen),
                () if self.works(name) => {
                    let advice = "its transfers fail now and then: a bad joint, or a chip that restarts";
                    self.chart.note(&format!("{dashed}-loose"), Verdict::Fail, seen, advice);
                    loose.push(name);
                }
                () if *last_error == other => {
                    let advice = "another part is soldered, or this is another board";
                    self.chart.note(&format!("{dashed}-wrong-chip"), Verdict::Fail, seen, advice);
                }
                () if numb.contains(last_error) => {
                    let advice = "the chip answers and does not measure";
                    self.chart.note(&format!("{dashed}-numb"), Verdict::Fail, seen, advice);
                }
                () => {
                    let advice = "the chip does not answer: its supply, its wires, or it is dead";
                    self.chart.note(&format!("{dashed}-dead"), Verdict::Fail, seen, advice);
                }
            }
        }
        // What they measure is not looked at: it may be that of a chip which has just restarted.
        loose.into_iter().for_each(|name| _ = self.measures.insert(name.clone(), false));
    }

    pub(super) fn battery(&mut self) -> Result<(), Lost> {
        if !self.works("power") {
            return Ok(());
        }
        let readings = several(self.visit, "sensor_power", 8)?;
        let Some([[volts], [amperes]]) = mean(&readings, "voltage").zip(mean(&readings, "current")).map(<[_; 2]>::from)
        else {
            return Ok(());
        };
        let seen = format!("{volts:.2} V, {amperes:.2} A");
        match () {
            () if volts < ABSENT => {
                let advice = "plug the battery in: USB alone does not count";
                self.chart.note("battery-absent", Verdict::Look, &seen, advice);
            }
            () if !CELL.contains(&volts) => {
                let advice = "no single cell has this voltage: the monitor's channel or divider is another one";
                self.chart.note("power-voltage-scale", Verdict::Fail, &seen, advice);
            }
            () if volts < WEAK => self.chart.note("battery-weak", Verdict::Fail, &seen, "charge it"),
            () => self.chart.pass("battery", &seen),
        }
        if amperes.abs() > AT_REST {
            let advice = "too much with motors off: the monitor's shunt is not 10 mΩ, or something is shorted";
            self.chart.note("power-current-scale", Verdict::Fail, &seen, advice);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_driver_is_read_from_the_vehicle_s_line() {
        let answer = "check imu pass samples 400 errors 1 age_ms 2 last_error no chip answered -- look\r\ncheck flash pass QIO\r\n";
        let read = drivers(answer);
        let imu = Driver { samples: 400, errors: 1, last_error: "no chip answered".into() };
        assert_eq!(read.into_iter().collect::<Vec<_>>(), [("imu".to_owned(), imu)]);
    }
}
