//! Is the vehicle sound: does it do what its motors are told, and does it know how it is tilted?
//!
//! | asked | bound |
//! |---|---|
//! | does the body turn as the torque says, about roll and pitch? | over 0.1 s the rates change by what the demanded torque makes, as far as it was met, and by no more beside that than half of what a rotor that is lost at hover would add |
//! | does the estimate know the vertical? | off by less than what the vehicle itself calls a mismatch of its tilt, [`FailsafeConfig::tilt_mismatch`](stampfly_mode::FailsafeConfig) |
//! | was it left alone? | it has not touched anything for 0.1 s |
//! | does the battery carry it? | its voltage is above the critical one, and motors that get all there is make it climb, in the mean over a second |
//! | does nothing act on it that a flight with a fault has? | no fault is active |
//!
//! All of it is the truth's: nothing here is a detector's opinion.

use super::sight::Sight;
use crate::VehicleConfig;
use crate::airframe::AIRFRAME;
use stampfly_mode::transitions::is_airborne;
use stampfly_sim::Truth;
use stampfly_types::messages::{ControlOutput, MotorOutput, StateEstimate};
use stampfly_types::{Duration, Instant, Quat, Vec3, frame, math};
use std::collections::VecDeque;

/// Over this time the rates are compared with the torque: five lags of the motors, so that a step
/// of the demand has arrived.
const WINDOW: Duration = Duration::from_millis(100);
/// Of the rate that a lost rotor makes in that time, which is told from a sound vehicle in the
/// middle.
const HALF: f32 = 0.5;
/// A battery is spent when it cannot make a share of [`MISSING`] of the thrust, and the vehicle climbs
/// slower than [`CLIMBS`], m/s, both in the mean over [`MEAN`], s.
const MISSING: f32 = 0.02;
const CLIMBS: f32 = 0.2;
const MEAN: f32 = 1.0;
/// A touch is over after this time.
const TOUCHED: Duration = Duration::from_millis(100);
/// Longest way to the floor along the body's axis that the range finder measures, m: the chip's.
const REACH: f32 = 4.0;
/// The fastest picture that the camera follows, rad/s, and how near to the floor it works, m: the
/// PMW3901's.
const FASTEST_PICTURE: f32 = 7.0;
const NEAREST_PICTURE: f32 = 0.08;
/// A sensor that sees nothing is lost after a second, and was not out of its reach if it saw the
/// floor for the last half of that.
const IN_REACH: Duration = Duration::from_millis(500);

/// How the vehicle is, at an instant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct State {
    /// By the table of the [module](self).
    pub sound: bool,
    /// Its battery carries it.
    pub carried: bool,
    /// The floor is in the reach of the sensors that look down, and has been for a while.
    pub sees_floor: bool,
    /// Above the floor, m.
    pub height: f32,
    /// m/s.
    pub speed: f32,
    /// Since when a mode that holds the height has flown it, left alone and carried by its battery.
    pub held_since: Option<Instant>,
    attitude: Quat,
    /// Cosine of the angle between the true vertical and the estimated one.
    cos_error: f32,
}

impl State {
    /// rad.
    pub fn tilt(&self) -> f32 {
        frame::tilt(&self.attitude)
    }

    /// Between the true vertical and the estimated one, rad.
    pub fn attitude_error(&self) -> f32 {
        math::acos(self.cos_error)
    }
}

/// A step of the comparison: rates, and what the torque has made of them since the beginning,
/// rad/s.
#[derive(Clone, Copy)]
struct Turned {
    at: Instant,
    rate: Vec3,
    by_torque: Vec3,
}

pub(super) struct Soundness {
    cos_mismatch: f32,
    battery_critical: f32,
    estimate: StateEstimate,
    torque: Vec3,
    /// Shares of it that the motors made.
    met: Vec3,
    /// What the motors have made of it, behind their lag.
    made: Vec3,
    steps: VecDeque<Turned>,
    strikes: u64,
    touched: Option<Instant>,
    touches: bool,
    /// Share of the thrust that the motors could not make, and the means of it and of the climb rate,
    /// m/s.
    unmet: f32,
    missing: f32,
    climb: f32,
    last: Option<Instant>,
    out_of_reach: Option<Instant>,
    state: State,
}

impl Soundness {
    pub fn new(config: &VehicleConfig) -> Self {
        Self {
            cos_mismatch: math::cos(config.failsafe.tilt_mismatch),
            battery_critical: config.failsafe.battery_critical,
            estimate: StateEstimate::default(),
            torque: Vec3::zeros(),
            met: Vec3::repeat(1.0),
            made: Vec3::zeros(),
            steps: VecDeque::new(),
            strikes: 0,
            touched: None,
            touches: false,
            unmet: 0.0,
            missing: 0.0,
            climb: 0.0,
            last: None,
            out_of_reach: None,
            state: State::default(),
        }
    }

    pub fn estimated(&mut self, estimate: StateEstimate) {
        self.estimate = estimate;
    }

    pub fn demanded(&mut self, output: &ControlOutput) {
        self.torque = output.torque;
    }

    pub fn driven(&mut self, output: &MotorOutput) {
        let [roll, pitch, yaw, _] = output.unmet.map(MotorOutput::met);
        self.unmet = 1.0 - MotorOutput::met(output.unmet[3]);
        self.met = if output.armed { Vec3::new(roll, pitch, yaw) } else { Vec3::zeros() };
    }

    /// Looks at the truth. `faulty`: a fault is active.
    pub fn see(&mut self, sight: &Sight<'_>, faulty: bool) {
        let Sight { now, truth, clearance, strikes, status, .. } = *sight;
        let follows = self.follows(now, truth);
        let meets = truth.contact || strikes > self.strikes;
        if meets {
            (self.touched, self.strikes) = (Some(now), strikes);
        }
        let up = |attitude: &Quat| attitude.inverse() * Vec3::new(0.0, 0.0, -1.0);
        let cos_error = up(&truth.attitude).dot(&up(&self.estimate.attitude)).clamp(-1.0, 1.0);
        let cos_tilt = frame::cos_tilt(&truth.attitude);
        // Nor does the camera follow a faster picture, or a nearer one.
        let nearest = math::larger(truth.velocity.horizontal().norm() / FASTEST_PICTURE, NEAREST_PICTURE);
        if clearance > REACH * cos_tilt || !truth.contact && clearance < nearest {
            self.out_of_reach = Some(now);
        }
        let touched = self.touched.is_some_and(|touched| now.since(touched) <= TOUCHED);
        self.touches = touched;
        let dt = self.last.replace(now).map_or(0.0, |last| now.since(last).seconds());
        self.missing += (self.unmet - self.missing) * (dt / (MEAN + dt));
        self.climb += (-truth.velocity.z - self.climb) * (dt / (MEAN + dt));
        let lifts = self.missing < MISSING || self.climb > CLIMBS;
        let carried = truth.battery_voltage > self.battery_critical && lifts;
        let is_held = is_airborne(status.phase) && !status.mode.is_manual() && carried && !meets && !faulty;
        self.state = State {
            carried,
            sound: follows && cos_error > self.cos_mismatch && !touched && carried && !faulty,
            sees_floor: self.out_of_reach.is_none_or(|out| now.since(out) > IN_REACH),
            height: clearance,
            speed: truth.velocity.norm(),
            held_since: is_held.then_some(self.state.held_since.unwrap_or(now)),
            attitude: truth.attitude,
            cos_error,
        };
    }

    /// Had it touched something in the last tenth of a second, when it was last looked at?
    pub const fn touches(&self) -> bool {
        self.touches
    }

    /// How it was when it was last looked at.
    pub const fn state(&self) -> State {
        self.state
    }

    /// Have the rates of the last tenth of a second changed as the torque says?
    fn follows(&mut self, now: Instant, truth: &Truth) -> bool {
        let inertia = AIRFRAME.inertia;
        let met = self.torque.component_mul(&self.met);
        let (rate, last) = (truth.angular_rate, self.steps.back().copied());
        let by_torque = last.map_or_else(Vec3::zeros, |last| {
            let dt = now.since(last.at).seconds();
            self.made += (met - self.made) * (dt / AIRFRAME.motor_lag).min(1.0);
            let gyroscopic = rate.cross(&inertia.component_mul(&rate));
            last.by_torque + (self.made - gyroscopic).component_div(&inertia) * dt
        });
        self.steps.push_back(Turned { at: now, rate, by_torque });
        while self.steps.len() > 2 && self.steps.get(1).is_some_and(|step| now.since(step.at) >= WINDOW) {
            self.steps.pop_front();
        }
        let Some(first) = self.steps.front() else { return true };
        let beside = (rate - first.rate) - (by_torque - first.by_torque);
        let lost = AIRFRAME.rotor_torque().component_div(&inertia) * (HALF * WINDOW.seconds());
        beside.x.abs() < lost.x && beside.y.abs() < lost.y
    }
}
