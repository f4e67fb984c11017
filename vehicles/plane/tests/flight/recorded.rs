//! A flight with everything that its topics have said, for tests that ask what happened when.

use stampfly_bus::{Activation, Band};
use stampfly_fixed_wing::messages::{AirState, Demand, Home, PathStatus, Place, Safety, Troubles};
use stampfly_flight::Observer;
use stampfly_flight::newest::message;
use stampfly_plane::Runnables;
use stampfly_plane::simulation::{Outcome, Plane};
use stampfly_plane::topics::Id;
use stampfly_sim::Truth;
use stampfly_sim::vehicle::{Options, Vehicle, Witness};
use stampfly_types::messages::{Alerts, FlightStatus, MotorOutput, PowerData, StateEstimate, SystemAlert};
use stampfly_types::{Duration, Instant, Message};

/// What was the newest on each topic at one cycle of the path manager.
#[derive(Clone, Copy, Debug, Default)]
pub struct Row {
    pub at: Instant,
    pub estimate: StateEstimate,
    pub air: AirState,
    pub home: Home,
    pub safety: Safety,
    pub demand: Demand,
    pub path: PathStatus,
    pub status: FlightStatus,
    /// V
    pub voltage: f32,
    pub truth: Truth,
}

impl Row {
    pub fn place(&self) -> Place {
        self.path.place
    }

    /// From home, over ground, m.
    pub fn away(&self) -> f32 {
        self.truth.position.horizontal().norm()
    }

    /// Above home, m.
    pub fn height(&self) -> f32 {
        -self.truth.position.z
    }

    pub fn troubled(&self, trouble: Troubles) -> bool {
        self.safety.troubles.contains(trouble)
    }
}

/// What was seen of a flight.
#[derive(Default)]
pub struct Flown {
    pub rows: Vec<Row>,
    /// Every output to the motor.
    pub motor: Vec<(Instant, MotorOutput)>,
    /// Every inertial sample.
    pub imu: Vec<Instant>,
    /// Every alert since it was armed for the first time.
    pub alerts: Alerts,
    pub outcome: Outcome,
    now: Row,
}

fn keep<M: Message>(place: &mut M, words: &[u32]) {
    *place = message(words).unwrap_or(*place);
}

impl Observer for Flown {
    fn pass_begins(&mut self, _: Band, _: Instant) {}
    fn has_read(&mut self, _: &Activation) {}
}

impl Witness<Runnables> for Flown {
    fn published(&mut self, topic: usize, at: Instant, _: u32, words: &[u32]) {
        let now = &mut self.now;
        match Id::ALL.get(topic) {
            Some(Id::sensor_imu) => self.imu.push(at),
            Some(Id::estimate_state) => keep(&mut now.estimate, words),
            Some(Id::air) => keep(&mut now.air, words),
            Some(Id::home) => keep(&mut now.home, words),
            Some(Id::sensor_power) => {
                let mut power = PowerData::default();
                keep(&mut power, words);
                now.voltage = power.voltage;
            }
            Some(Id::system_alert) if now.status.armed => {
                let mut alert = SystemAlert::default();
                keep(&mut alert, words);
                self.alerts |= alert.active;
            }
            Some(Id::safety) => keep(&mut now.safety, words),
            Some(Id::demand) => keep(&mut now.demand, words),
            Some(Id::path_status) => keep(&mut now.path, words),
            Some(Id::flight_status) => {
                keep(&mut now.status, words);
                now.at = at;
                self.rows.push(*now);
            }
            Some(Id::actuator_motor) => {
                let mut output = MotorOutput::default();
                keep(&mut output, words);
                self.motor.push((at, output));
            }
            _ => {}
        }
    }

    fn beside(&mut self, _: usize, _: Instant, _: u32, words: &[u32]) {
        keep(&mut self.now.truth, words);
    }
}

impl Flown {
    /// Flies.
    pub fn with(options: &Options, seed: u64) -> Self {
        let setup = Plane::setup(options, seed).expect("options");
        let mut flown = Self::default();
        flown.outcome = Plane::fly(&setup, &mut flown, &mut |_, _| {}).outcome;
        flown
    }

    /// When something was so for the first time.
    pub fn first(&self, holds: impl Fn(&Row) -> bool) -> Option<Instant> {
        self.rows.iter().find(|row| holds(row)).map(|row| row.at)
    }

    /// The cycles from one time to another, s later.
    pub fn between(&self, from: Instant, begin: f32, end: f32) -> impl Iterator<Item = &Row> + Clone {
        let [begin, end] = [begin, end].map(|seconds| from + Duration::from_seconds(seconds));
        self.rows.iter().filter(move |row| (begin..end).contains(&row.at))
    }

    /// The places where it was, one after the other.
    pub fn places(&self) -> Vec<Place> {
        let mut places: Vec<_> = self.rows.iter().map(Row::place).collect();
        places.dedup();
        places
    }
}
