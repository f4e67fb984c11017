//! How a flight of the StampFly went, for people and for scripts.

use super::air::AirReport;
use super::judge::{Intervention, Judgement};
use super::metrics::{FIGURES, Metrics};
use crate::VehicleConfig;
use serde::Serialize;
use stampfly_control::autotune::AutotuneStatus;
use stampfly_sim::vehicle::{Figure, Verdict};
use stampfly_types::Instant;
use stampfly_types::messages::{FlightMode, FlightPhase};
use std::string::{String, ToString as _};
use std::vec::Vec;
use std::{format, vec};

/// A change of state or mode, for people.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseChange {
    /// When it began.
    pub since: Instant,
    /// State.
    pub phase: FlightPhase,
    /// Mode.
    pub mode: FlightMode,
}

/// How a flight went.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The figures.
    pub metrics: Metrics,
    /// States and modes, in order.
    pub phases: Vec<PhaseChange>,
    /// What was told of tuning, and when.
    pub tuned: Vec<(Instant, AutotuneStatus)>,
    /// Was the mission flown to its end?
    pub finished: bool,
    /// Largest true tilt, degrees.
    pub worst_tilt_deg: f64,
    /// Battery voltage at the start and at the end, V.
    pub battery: [f32; 2],
    /// What came of faults, and what never may happen.
    pub judgement: Judgement,
    /// What the secure session has done, if there was one.
    pub air: AirReport,
    /// The flight record that its station has received, as a file.
    pub record: Vec<u8>,
    /// Other programs flew it: it had nothing to finish.
    pub live: bool,
    /// A stick file flew it: it may end anywhere, and what the vehicle did by itself is judged.
    pub by_sticks: bool,
    /// Somebody has asked for a restart, with these parameters if any were kept.
    pub restart: Option<Option<VehicleConfig>>,
}

impl Verdict for Outcome {
    /// The end has to be acceptable, and every invariant to hold. Without faults the mission has to be
    /// flown to its end as well.
    fn succeeded(&self) -> bool {
        let flown = self.facts().iter().all(|(_, holds)| *holds);
        let Judgement { faults, as_expected, violations, .. } = &self.judgement;
        if self.live {
            // Other programs may do what no mission does: only the motors are judged.
            return flown;
        }
        *as_expected && violations.is_empty() && (flown || !faults.is_empty())
    }

    fn findings(&self) -> impl Serialize {
        &self.judgement
    }

    fn facts(&self) -> Vec<(&'static str, bool)> {
        let motors_sane = ("motors_sane", !self.judgement.violations.iter().any(|name| ["I1", "I2"].contains(name)));
        if self.live {
            return vec![motors_sane];
        }
        if self.by_sticks {
            let unhindered = !self.judgement.interventions.iter().any(|one| one.sound);
            return vec![
                ("disarmed", self.metrics.disarmed),
                ("finished", self.finished),
                ("unhindered", unhindered),
                motors_sane,
            ];
        }
        vec![
            ("landed", self.metrics.landed),
            ("disarmed", self.metrics.disarmed),
            ("finished", self.finished),
            motors_sane,
        ]
    }

    fn figures(&self) -> Vec<Figure> {
        let figures = FIGURES.iter().map(|(name, unit, value)| Figure { name, unit, value: value(&self.metrics) });
        figures.collect()
    }

    fn story(&self) -> Vec<String> {
        let mut told = self.events();
        told.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let mut told: Vec<_> = told.into_iter().map(|(at, what)| format!("{at:>9.3} s  {what}")).collect();
        told.extend(
            self.judgement
                .faults
                .iter()
                .filter(|span| span.since.is_none())
                .map(|span| format!("{:>11}  fault {} never began", "", span.fault)),
        );
        let [first, last] = self.battery;
        told.push(format!("largest tilt {:.3} deg", self.worst_tilt_deg));
        told.push(format!("battery {first:.2} V at the start, {last:.2} V at the end"));
        let Judgement { outcome, reason, expected, violations, .. } = &self.judgement;
        if !self.live {
            let colon = if reason.is_empty() { "" } else { ": " };
            told.push(format!("outcome {outcome}{colon}{reason}; acceptable up to {expected}"));
        }
        if !violations.is_empty() {
            told.push(format!("VIOLATED {}", violations.join(", ")));
        }
        told
    }

    fn sentence(&self) -> String {
        if !self.judgement.faults.is_empty() {
            let word = if self.succeeded() { "as expected" } else { "NOT ACCEPTABLE" };
            return format!("{}, {word}", self.judgement.outcome);
        }
        if self.live {
            let phase = self.phases.last().map_or(FlightPhase::Init, |change| change.phase);
            return format!("flown by other programs, ended as {}", phase.name());
        }
        let Judgement { outcome, reason, as_expected, violations, .. } = &self.judgement;
        if self.by_sticks && self.succeeded() {
            match reason.as_str() {
                "" => outcome.to_string(),
                reason => format!("{outcome}: {reason}"),
            }
        } else if self.succeeded() {
            "landed and disarmed".into()
        } else if !as_expected {
            format!("{}: {reason}", outcome.to_uppercase())
        } else if !violations.is_empty() {
            format!("VIOLATED {}", violations.join(", "))
        } else {
            let missed = self.facts().iter().filter(|(_, holds)| !holds).map(|(name, _)| *name).collect::<Vec<_>>();
            format!("NOT {}", missed.join(", NOT "))
        }
    }
}

impl Outcome {
    /// What happened when, s: phases, faults, and alerts of a vehicle that had been armed.
    fn events(&self) -> Vec<(f64, String)> {
        let mut phases: Vec<_> = self
            .phases
            .iter()
            .map(|change| {
                let mode =
                    if change.phase == FlightPhase::Flying { format!(" {:?}", change.mode) } else { String::new() };
                (change.since.seconds_f64(), format!("{}{mode}", change.phase.name()))
            })
            .collect();
        // On the ground the mode is no news.
        phases.dedup_by(|(_, next), (_, last)| next == last);
        let armed = self.phases.iter().find(|change| change.phase == FlightPhase::Armed);
        let armed = armed.map_or(f64::INFINITY, |change| change.since.seconds_f64());
        let Judgement { faults, alerts, interventions, .. } = &self.judgement;
        let interventions = interventions.iter().map(|one| {
            let Intervention { alert, height_m, speed_mps, tilt_deg, .. } = one;
            let sound = if one.sound { ", WHILE THE VEHICLE IS SOUND" } else { "" };
            let place = format!("at {height_m:.1} m, {speed_mps:.1} m/s, tilted by {tilt_deg:.0} deg");
            (one.t_s, format!("{alert} {} {place}{sound}", one.verb()))
        });
        let faults = faults
            .iter()
            .filter_map(|span| Some((span.since?, format!("fault {}, {} changes", span.fault, span.changes))));
        let alerts = alerts.iter().filter(|span| span.until.is_none_or(|until| until >= armed)).map(|span| {
            let until = span.until.map(|until| format!(" until {until:.3} s")).unwrap_or_default();
            (span.since, format!("alert {}{until}", span.name))
        });
        let tuned = self.tuned.iter().map(|(at, status)| (at.seconds_f64(), format!("autotune {status}")));
        phases.extend(faults.chain(alerts).chain(interventions).chain(tuned));
        phases
    }
}
