//! What may never happen, whatever is wrong: checked at every step of every flight.
//!
//! | invariant | what is checked at every step |
//! |---|---|
//! | `I1` | every duty is a number from 0 to 1 |
//! | `I2` | not armed: every duty is 0, but for the motor of a motor test |
//! | `I3` | the vehicle is armed while nothing blocks arming |
//! | `I4` | the estimate's numbers are finite, and its quaternion is a rotation within 1e-4 |
//! | `I5` | phases change as [`transitions`] say |
//! | `I6` | armed, and no command of the commander for 520 ms: the alert `COMM_LOST` |
//! | `I7` | no inertial sample for 57.5 ms (50 ms, and three periods): the motors are off |
//! | `I9` | the instants of a topic never go back |
//! | `I10` | 3 s, and 1 s for each 0.3 m of height, after an alert that demands landing: the motors are off |
//!
//! `I12` is the judge's, who knows the faults.

use crate::messages::MotorTest;
use crate::topics::{COUNT, Id};
use stampfly_flight::newest::message;
use stampfly_mode::transitions;
use stampfly_types::messages::{Alerts, CommandSource, FlightStatus, MotorOutput, StateEstimate, SystemAlert};
use stampfly_types::{Duration, FieldKind, Instant, Message};
use std::collections::BTreeSet;

/// 500 ms, and 20 ms to notice.
const COMM_SILENCE: Duration = Duration::from_millis(520);
/// 50 ms, and three periods.
const IMU_SILENCE: Duration = Duration::from_micros(57_500);
/// Of I10.
const LAND_WITHIN: Duration = Duration::from_secs(3);
/// Of I10, m/s.
const LAND_RATE: f32 = 0.3;

/// The invariants of one flight, for whatever flies it.
pub struct Invariants {
    /// Names of those that did not hold.
    violations: BTreeSet<&'static str>,
    hover_without_link: Duration,
    last_at: [Option<Instant>; COUNT],
    status: FlightStatus,
    motors_on: bool,
    /// Above the floor below, m.
    clearance: f32,
    comm_lost_since: Option<Instant>,
    /// Until when the motors must be off, since an alert that demands landing.
    must_be_off: Option<Instant>,
    /// The motor test that was asked for last.
    test: Option<MotorTest>,
}

impl Invariants {
    /// Of a vehicle that hovers for this long when the link is lost.
    #[must_use]
    pub fn new(hover_without_link: Duration) -> Self {
        Self {
            violations: BTreeSet::new(),
            hover_without_link,
            last_at: [None; COUNT],
            status: FlightStatus::default(),
            motors_on: false,
            clearance: 0.0,
            comm_lost_since: None,
            must_be_off: None,
            test: None,
        }
    }

    #[inline]
    pub(super) fn require(&mut self, name: &'static str, holds: bool) {
        if !holds {
            self.violated(name);
        }
    }

    #[cold]
    fn violated(&mut self, name: &'static str) {
        self.violations.insert(name);
    }

    /// Names of the invariants that did not hold.
    pub fn violations(&self) -> impl Iterator<Item = &'static str> {
        self.violations.iter().copied()
    }

    /// A sample was published.
    pub fn published(&mut self, id: Id, at: Instant, words: &[u32]) {
        let last = self.last_at.get_mut(id as usize).and_then(|last| last.replace(at));
        self.require("I9", last.is_none_or(|last| last <= at));
        match id {
            Id::actuator_motor => {
                if let Some(output) = message::<MotorOutput>(words) {
                    self.require("I1", output.duty.iter().all(|duty| (0.0..=1.0).contains(duty)));
                    let tested = self.test.filter(|test| at <= test.end()).map(|test| test.motor as usize);
                    let is_off = |(place, duty): (usize, &f32)| *duty == 0.0 || tested == Some(place + 1);
                    self.require("I2", self.status.armed || output.duty.iter().enumerate().all(is_off));
                } else {
                    self.require("I1", false);
                }
            }
            Id::motor_test => self.test = message(words),
            Id::estimate_state => {
                let estimate = message::<StateEstimate>(words);
                self.require("I4", estimate.is_some_and(|estimate| is_sound(&estimate, words)));
            }
            Id::flight_status => {
                if let Some(status) = message::<FlightStatus>(words) {
                    self.status_changes(&status);
                }
            }
            Id::system_alert => {
                if let Some(alert) = message::<SystemAlert>(words) {
                    self.alerts(at, alert.active);
                }
            }
            _ => {}
        }
    }

    fn status_changes(&mut self, status: &FlightStatus) {
        let (from, to) = (self.status.phase, status.phase);
        let exists = || transitions::TABLE.iter().any(|row| row.from == from && row.to == to);
        self.require("I5", from == to || exists());
        self.require("I3", self.status.armed || !status.armed || status.blocks.is_empty());
        self.status = *status;
    }

    fn alerts(&mut self, at: Instant, active: Alerts) {
        let last = |id: Id| self.last_at.get(id as usize).copied().flatten();
        let (pilot, guided) = (last(Id::command_pilot), last(Id::command_guided));
        let heard = match self.status.commander {
            CommandSource::Pilot => pilot,
            CommandSource::Guided => guided,
            CommandSource::None | CommandSource::Failsafe => pilot.max(guided),
        };
        let silent = heard.is_some_and(|heard| at.since(heard) > COMM_SILENCE);
        self.require("I6", !(self.status.armed && silent) || active.contains(Alerts::COMM_LOST));
        self.comm_lost_since =
            active.contains(Alerts::COMM_LOST).then(|| self.comm_lost_since.unwrap_or(at)).filter(|_| self.motors_on);
        let abandoned = self.comm_lost_since.is_some_and(|since| at.since(since) >= self.hover_without_link);
        let lands = abandoned
            || active.intersects(
                Alerts::CRITICAL_BATTERY
                    | Alerts::ESTIMATE_DIVERGED
                    | Alerts::MOTOR_WEAK
                    | Alerts::IMU_NOISY
                    | Alerts::FORCE_IMPLAUSIBLE,
            );
        self.must_be_off = (lands && self.motors_on).then(|| {
            self.must_be_off.unwrap_or(at + LAND_WITHIN + Duration::from_seconds(self.clearance.max(0.0) / LAND_RATE))
        });
    }

    /// What the motors are given, whatever decides it.
    pub fn motors(&mut self, on: bool) {
        self.motors_on = on;
    }

    /// Time goes on, at this height above the floor, m.
    pub fn see(&mut self, now: Instant, clearance: f32) {
        self.clearance = clearance;
        let imu = self.last_at.get(Id::sensor_imu as usize).copied().flatten();
        self.require("I7", !self.motors_on || imu.is_none_or(|imu| now.since(imu) <= IMU_SILENCE));
        self.require("I10", !self.motors_on || self.must_be_off.is_none_or(|until| now <= until));
    }
}

/// Finite numbers, and a rotation.
fn is_sound(estimate: &StateEstimate, words: &[u32]) -> bool {
    let finite = words
        .iter()
        .zip(&NUMBERS)
        .fold(true, |finite, (word, is_number)| finite & (!is_number | f32::from_bits(*word).is_finite()));
    finite && (estimate.attitude.norm_squared() - 1.0).abs() <= 2e-4
}

/// Which words of an estimate are numbers.
const NUMBERS: [bool; StateEstimate::WORDS] = {
    let (mut numbers, mut start, mut place) = ([false; StateEstimate::WORDS], 0, 0);
    while place < StateEstimate::FIELDS.len() {
        let field = &StateEstimate::FIELDS[place];
        let mut word = 0;
        while word < field.words {
            numbers[start + word] = matches!(field.kind, FieldKind::F32);
            word += 1;
        }
        (start, place) = (start + field.words, place + 1);
    }
    numbers
};

#[cfg(test)]
mod tests;
