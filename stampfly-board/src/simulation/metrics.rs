//! How good a flight was: figures from truth, set-point, estimate and mode, sampled at the same instants.
//!
//! | figure | what it is |
//! |---|---|
//! | `pos_rms_m` | distance of the truth from the set-point, root mean square, while flying in POS_HOLD |
//! | `est_pos_rms_m` | distance of the estimate from the truth, over the same time |
//! | `alt_rms_m` | height of the truth against the set-point, root mean square, over the same time |
//! | `takeoff_overshoot_m` | highest truth above the take-off height, from take-off to three seconds into flight |
//! | `touchdown_speed_mps` | true sink rate at the last instant before the first contact of the landing |
//! | `hover_tilt_max_deg` | largest true tilt while hovering: in POS_HOLD, the set-point at rest for a second or more |
//! | `hover_drift_m` | farthest the truth got, horizontally, from where the longest rest of the set-point began |
//! | `land_error_m` | horizontal distance of the truth from the take-off spot at the end |
//!
//! Positions count from the take-off spot and directions from the heading there, truth included.

use serde::Serialize;
use stampfly_sim::{Rms, Truth};
use stampfly_types::messages::{FlightPhase, FlightStatus, Setpoint, StateEstimate};
use stampfly_types::{Duration, Instant, Vec3, frame};

/// One instant of a flight.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<'a> {
    /// When.
    pub at: Instant,
    /// What is really the case, positions from the take-off spot.
    pub truth: &'a Truth,
    /// Where the vehicle should be.
    pub setpoint: &'a Setpoint,
    /// Where it believes to be.
    pub estimate: &'a StateEstimate,
    /// What it is doing.
    pub flight_status: &'a FlightStatus,
}

/// The figures. `None` where the flight had no such phase.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Metrics {
    /// Did it land?
    pub landed: bool,
    /// Are the motors off at the end?
    pub disarmed: bool,
    /// See the [module](self) documentation.
    pub pos_rms_m: Option<f64>,
    /// See the [module](self) documentation.
    pub est_pos_rms_m: Option<f64>,
    /// See the [module](self) documentation.
    pub alt_rms_m: Option<f64>,
    /// See the [module](self) documentation.
    pub takeoff_overshoot_m: Option<f64>,
    /// See the [module](self) documentation.
    pub touchdown_speed_mps: Option<f64>,
    /// See the [module](self) documentation.
    pub hover_tilt_max_deg: Option<f64>,
    /// See the [module](self) documentation.
    pub land_error_m: Option<f64>,
    /// See the [module](self) documentation.
    pub hover_drift_m: Option<f64>,
}

/// One figure: name, unit, and where it is.
pub type Figure = (&'static str, &'static str, fn(&Metrics) -> Option<f64>);

/// Figures in the order and with the names they are printed in.
pub const FIGURES: [Figure; 8] = [
    ("pos_rms_m", "m", |m| m.pos_rms_m),
    ("est_pos_rms_m", "m", |m| m.est_pos_rms_m),
    ("alt_rms_m", "m", |m| m.alt_rms_m),
    ("takeoff_overshoot_m", "m", |m| m.takeoff_overshoot_m),
    ("touchdown_speed_mps", "m/s", |m| m.touchdown_speed_mps),
    ("hover_tilt_max_deg", "deg", |m| m.hover_tilt_max_deg),
    ("land_error_m", "m", |m| m.land_error_m),
    ("hover_drift_m", "m", |m| m.hover_drift_m),
];

/// A stretch during which the set-point rested.
#[derive(Clone, Copy, Debug)]
struct Rest {
    since: Instant,
    from: Vec3,
    farthest: f32,
}

/// A vehicle that has just been stopped is not hovering yet.
const SETTLE: Duration = Duration::from_secs(1);
/// Time into FLYING that still counts as take-off.
const TAKEOFF_TAIL: Duration = Duration::from_secs(3);

/// Collects a flight's figures as it goes.
#[derive(Clone, Debug, Default)]
pub struct Collector {
    position: Rms,
    estimate: Rms,
    altitude: Rms,
    highest: Option<f32>,
    takeoff_goal: Option<f32>,
    flying_since: Option<Instant>,
    touchdown: Option<f32>,
    was_in_contact: bool,
    tilt: Option<f32>,
    rest: Option<Rest>,
    longest: Option<(Duration, f32)>,
    last: Option<Last>,
    flew: bool,
}

/// What there is to know about the instant before.
#[derive(Clone, Copy, Debug)]
struct Last {
    at: Instant,
    place: Vec3,
    sink: f32,
    phase: FlightPhase,
    armed: bool,
}

impl Collector {
    /// Takes one instant. Call at the control rate.
    pub fn add(&mut self, now: &Snapshot<'_>) {
        let Snapshot { at, truth, setpoint, estimate, flight_status } = *now;
        let holding = flight_status.phase == FlightPhase::Flying && flight_status.mode.holds_place();
        match flight_status.phase {
            FlightPhase::TakeOff => {
                self.flew = true;
                self.takeoff_goal = Some(setpoint.position.z);
                self.raise(truth);
            }
            FlightPhase::Flying => {
                let since = *self.flying_since.get_or_insert(at);
                if at.since(since) < TAKEOFF_TAIL {
                    self.takeoff_goal = self.takeoff_goal.map(|goal| goal.min(setpoint.position.z));
                    self.raise(truth);
                }
            }
            FlightPhase::Landing if truth.contact && !self.was_in_contact && self.touchdown.is_none() => {
                // The feet have begun to brake it by the time it is seen to touch.
                self.touchdown = Some(self.last.map_or(0.0, |last| last.sink).max(0.0));
            }
            _ => {}
        }
        self.was_in_contact = truth.contact;
        if holding {
            self.position.add_square((truth.position - setpoint.position).norm_squared().into());
            self.estimate.add_square((truth.position - estimate.position).norm_squared().into());
            let height = truth.position.z - setpoint.position.z;
            self.altitude.add_square((height * height).into());
        }
        let resting = holding && setpoint.velocity.norm() < 1e-3 && setpoint.yaw_rate.abs() < 1e-3;
        if resting {
            let rest = self.rest.get_or_insert(Rest { since: at, from: truth.position, farthest: 0.0 });
            if at.since(rest.since) >= SETTLE {
                let tilt = frame::tilt(&truth.attitude).to_degrees();
                self.tilt = Some(self.tilt.map_or(tilt, |t| t.max(tilt)));
            }
            let away = truth.position - rest.from;
            rest.farthest = rest.farthest.max(away.horizontal().norm());
        } else {
            self.end_rest(at);
        }
        let (place, sink) = (truth.position, truth.velocity.z);
        self.last = Some(Last { at, place, sink, phase: flight_status.phase, armed: flight_status.armed });
    }

    fn raise(&mut self, truth: &Truth) {
        let height = -truth.position.z;
        self.highest = Some(self.highest.map_or(height, |h| h.max(height)));
    }

    fn end_rest(&mut self, at: Instant) {
        if let Some(rest) = self.rest.take() {
            let length = at.since(rest.since);
            if self.longest.is_none_or(|(longest, _)| length > longest) {
                self.longest = Some((length, rest.farthest));
            }
        }
    }

    /// The figures of the flight so far.
    #[must_use]
    pub fn finish(mut self) -> Metrics {
        if let Some(last) = self.last {
            self.end_rest(last.at);
        }
        let landed = self.flew && self.was_in_contact && self.last.is_some_and(|l| l.phase == FlightPhase::IdleGround);
        let overshoot = |highest: f32| Some(f64::from(highest + self.takeoff_goal?));
        Metrics {
            landed,
            disarmed: self.last.is_none_or(|last| !last.armed),
            pos_rms_m: self.position.value(),
            est_pos_rms_m: self.estimate.value(),
            alt_rms_m: self.altitude.value(),
            takeoff_overshoot_m: self.highest.and_then(overshoot).map(|o| o.max(0.0)),
            touchdown_speed_mps: self.touchdown.map(f64::from),
            hover_tilt_max_deg: self.tilt.map(f64::from),
            land_error_m: self.last.filter(|_| landed).map(|last| f64::from(last.place.horizontal().norm())),
            hover_drift_m: self.longest.map(|(_, farthest)| f64::from(farthest)),
        }
    }
}
