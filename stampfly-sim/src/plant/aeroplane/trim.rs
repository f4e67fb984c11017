//! Steady straight flight: angle of attack, elevator and throttle that hold an airspeed on a path.
//!
//! For tests, for starts in the air, and for the design of autopilot gains. Wings level, without
//! sideslip; ailerons and rudder balance the propeller's torque. Not for turns.

use super::aerodynamics::{lift_and_drag, pitching};
use super::{AeroplaneParameters, Propeller, SURFACES, Surface};
use crate::plant::Pose;
use core::fmt;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Why no steady flight exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TrimError {
    /// The wing cannot carry the aeroplane at this airspeed.
    TooSlow,
    /// The control surfaces do not reach far enough.
    OutOfReach,
    /// The thrust is outside the propeller's range.
    Thrust,
}

impl fmt::Display for TrimError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TooSlow => "the wing cannot carry the aeroplane at this airspeed",
            Self::OutOfReach => "the control surfaces do not reach far enough",
            Self::Thrust => "the propeller cannot give this thrust",
        })
    }
}

impl core::error::Error for TrimError {}

/// Steady straight flight in still air, far from the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trim {
    /// Airspeed, m/s.
    pub airspeed: f64,
    /// Angle of the path above the horizon, rad.
    pub path: f64,
    /// Angle of attack, rad.
    pub alpha: f64,
    /// Deflections as shares of the largest, in the order of [`Surface`].
    pub surfaces: [f64; SURFACES],
    /// Thrust, N.
    pub thrust: f64,
    /// Propeller speed, rad/s.
    pub rotor_speed: f64,
    /// Motor voltage, V. Divided by the battery voltage it is the duty cycle.
    pub voltage: f64,
    /// Propeller speed relative to the nominal speed, as for [`Pose::rotors`].
    pub rotors: f64,
}

impl Trim {
    /// Finds the trim by bisection.
    pub(super) fn find(p: &AeroplaneParameters, airspeed: f64, path: f64) -> Result<Self, TrimError> {
        let pressure = 0.5 * p.air_density * airspeed * airspeed * p.wing_area;
        let weight = p.mass * p.gravity;
        let (sin_path, cos_path) = libm::sincos(path);
        // Residual lift, deflections and thrust at an angle of attack; the thrust follows from the
        // balance along the path.
        let balance = |alpha: f64| {
            let mut angles = [0.0; SURFACES];
            let (sin, cos) = libm::sincos(alpha);
            let mut thrust = 0.0;
            let mut lift = 0.0;
            // Thrust and elevator depend weakly on each other, through drag and pitching moment:
            // fixed-point iteration converges.
            for _ in 0..8 {
                let nose_up = thrust * p.propeller_below / (pressure * p.wing_chord);
                let elevator = -(pitching(p, alpha, 0.0, &[0.0; SURFACES]) + nose_up) / p.pitch_elevator;
                angles[Surface::Elevator as usize] = elevator;
                let [lift_now, drag] = lift_and_drag(p, alpha, 0.0, &angles, 1e3);
                lift = lift_now * pressure;
                thrust = (drag * pressure + weight * sin_path) / cos;
            }
            (lift + thrust * sin - weight * cos_path, angles, thrust)
        };
        // Lift grows monotonically from below the negative stall up to the angle of largest lift.
        let (mut low, mut high) = (-0.6 * p.stall_alpha, 0.0);
        while balance(high + 1e-3).0 > balance(high).0 && high < 1.0 {
            high += 1e-3;
        }
        if balance(high).0 < 0.0 {
            return Err(TrimError::TooSlow);
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if balance(middle).0 < 0.0 { low = middle } else { high = middle }
        }
        let alpha = 0.5 * (low + high);
        let (_, angles, thrust) = balance(alpha);

        let propeller = Propeller::new(p, 0.0);
        // The propeller sees the component along its axis.
        let air = airspeed * libm::cos(alpha);
        let (mut slow, mut fast) = (0.1, 4.0 * p.propeller_nominal_speed);
        // Thrust is not monotonic at low speed: a windmill brakes more the faster it turns. Its
        // minimum is at the limit of the advance ratio.
        slow += core::f64::consts::TAU * air / (p.advance_limit * p.propeller_diameter);
        if propeller.at(slow, air)[0] > 0.0 {
            slow = 0.1;
        }
        if !(propeller.at(slow, air)[0]..=propeller.at(fast, air)[0]).contains(&thrust) {
            return Err(TrimError::Thrust);
        }
        for _ in 0..60 {
            let middle = 0.5 * (slow + fast);
            if propeller.at(middle, air)[0] < thrust { slow = middle } else { fast = middle }
        }
        let rotor_speed = 0.5 * (slow + fast);
        let torque = propeller.at(rotor_speed, air)[1] * p.propeller_spin;

        // Ailerons balance the torque, and the rudder the yawing moment of the ailerons.
        let rolling = torque / (pressure * p.wing_span);
        let determinant = p.roll_aileron * p.yaw_rudder - p.roll_rudder * p.yaw_aileron;
        // The coefficient is per right aileron and the left one acts equally, so each gets half of
        // the difference.
        let difference = rolling * p.yaw_rudder / determinant;
        let rudder = -rolling * p.yaw_aileron / determinant;
        let mut surfaces = [0.0; SURFACES];
        surfaces[Surface::RightAileron as usize] = 0.5 * difference / p.reach_aileron;
        surfaces[Surface::LeftAileron as usize] = -0.5 * difference / p.reach_aileron;
        surfaces[Surface::Elevator as usize] = angles[Surface::Elevator as usize] / p.reach_elevator;
        surfaces[Surface::Rudder as usize] = rudder / p.reach_rudder;
        if surfaces.iter().any(|share| share.abs() > 1.0) {
            return Err(TrimError::OutOfReach);
        }
        Ok(Self {
            airspeed,
            path,
            alpha,
            surfaces,
            thrust,
            rotor_speed,
            voltage: propeller.voltage(rotor_speed, air),
            rotors: rotor_speed / p.propeller_nominal_speed,
        })
    }

    /// Pitch angle of the body, rad.
    #[must_use]
    pub fn pitch(&self) -> f64 {
        self.alpha + self.path
    }

    /// Pose of this flight above the origin at this height above the ground, m, in still air, with
    /// this heading, rad.
    #[must_use]
    pub fn pose(&self, height: f64, heading: f64) -> Pose {
        let (sin_yaw, cos_yaw) = libm::sincos(0.5 * heading);
        let (sin_pitch, cos_pitch) = libm::sincos(0.5 * self.pitch());
        let yaw = UnitQuaternion::new_normalize(Quaternion::new(cos_yaw, 0.0, 0.0, sin_yaw));
        let pitch = UnitQuaternion::new_normalize(Quaternion::new(cos_pitch, 0.0, sin_pitch, 0.0));
        let (sin, cos) = libm::sincos(self.path);
        Pose {
            position: Vector3::new(0.0, 0.0, -height),
            velocity: yaw * Vector3::new(self.airspeed * cos, 0.0, -self.airspeed * sin),
            attitude: yaw * pitch,
            rate: Vector3::zeros(),
            rotors: self.rotors,
        }
    }
}
