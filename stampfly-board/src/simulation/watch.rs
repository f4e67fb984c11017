//! What is watched of a flight for its figures: the truth, and the newest of what it is compared with.

use super::home::Home;
use super::metrics::{Collector, Snapshot};
use super::outcome::PhaseChange;
use crate::topics::Id;
use stampfly_control::autotune::AutotuneStatus;
use stampfly_flight::newest::message;
use stampfly_sim::Truth;
use stampfly_types::messages::{FlightStatus, Setpoint, StateEstimate};
use stampfly_types::{Instant, Message, frame};
use std::vec::Vec;

/// The newest of what is compared with the truth, and what came of it.
pub(super) struct Watch {
    pub collector: Collector,
    setpoint: Setpoint,
    estimate: StateEstimate,
    pub mode: FlightStatus,
    pub phases: Vec<PhaseChange>,
    /// What was told of tuning, and when.
    pub tuned: Vec<(Instant, AutotuneStatus)>,
    pub worst_tilt: f32,
    pub battery: Option<[f32; 2]>,
    pub home: Home,
    truths: u32,
    /// The instant of a set-point that has not been compared with the truth yet.
    pub due: Option<Instant>,
}

impl Watch {
    pub fn new(home: Home) -> Self {
        Self {
            collector: Collector::default(),
            setpoint: Setpoint::default(),
            estimate: StateEstimate::default(),
            mode: FlightStatus::default(),
            phases: Vec::new(),
            tuned: Vec::new(),
            worst_tilt: 0.0,
            battery: None,
            home,
            truths: 0,
            due: None,
        }
    }

    /// Notes what a topic published. At the instant of a new set-point the truth is due.
    pub fn note(&mut self, id: Id, at: Instant, words: &[u32]) {
        match id {
            Id::setpoint => {
                if let Some(setpoint) = message(words) {
                    self.setpoint = setpoint;
                }
                self.due = Some(at);
            }
            Id::estimate_state => {
                if let Some(estimate) = message(words) {
                    self.estimate = estimate;
                }
            }
            Id::flight_status => {
                if let Some(mode) = message(words) {
                    self.mode = mode;
                }
                let (phase, mode) = (self.mode.phase, self.mode.mode);
                if self.phases.last().is_none_or(|last| (last.phase, last.mode) != (phase, mode)) {
                    self.phases.push(PhaseChange { since: at, phase, mode });
                }
            }
            Id::autotune => self.tuned.extend(message(words).map(|status| (at, status))),
            _ => {}
        }
    }

    /// Compares with the truth at the instant of a set-point, in the vehicle's world.
    pub fn compare(&mut self, at: Instant, truth: &mut Truth, record: &mut dyn FnMut(usize, Instant, u32, &[u32])) {
        self.home.bring(truth);
        self.truths += 1;
        record(0, at, self.truths, truth.to_words().as_ref());
        self.worst_tilt = self.worst_tilt.max(frame::tilt(&truth.attitude));
        let first = self.battery.map_or(truth.battery_voltage, |[first, _]| first);
        self.battery = Some([first, truth.battery_voltage]);
        let (setpoint, estimate, mode) = (self.setpoint, self.estimate, self.mode);
        self.collector.add(&Snapshot { at, truth, setpoint: &setpoint, estimate: &estimate, flight_status: &mode });
    }
}
