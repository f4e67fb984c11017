//! Body rate to torque: the innermost loop, one [`Pid`] per axis.
//!
//! With the derivative time near the motor's time constant the zero of the loop cancels the motor's pole and what remains
//! is close to an integrator with 7 ms of delay (filter, sampling, computing). That sets the gain: Kp = I·ω, the moment of
//! inertia about the axis times the crossover ω. [`TILT_BANDWIDTH`] and [`YAW_BANDWIDTH`] are that ω, lowered for motors
//! slower than [`QUICK_MOTOR`]; [`RateConfig::for_airframe`] applies the rule.

use stampfly_types::Vec3;

use crate::airframe::Airframe;
use crate::pid::{Integration, Pid, PidGains};

/// Crossover of the roll and pitch rate loops, rad/s: with 7 ms of delay in the loop it keeps 55° of phase when the motor
/// is half as slow again.
pub const TILT_BANDWIDTH: f32 = 43.6;
/// Crossover of the yaw rate loop, rad/s. Half of roll and pitch: the rotors' drag is weak, and more gain only drives the
/// motors into their limits.
pub const YAW_BANDWIDTH: f32 = 22.0;
/// Time constant of the motors up to which these bandwidths hold, s. Slower motors lower them in proportion: what their pole
/// leaves after the lead grows with it, and a step of the lean would overshoot by more than 15 %.
pub const QUICK_MOTOR: f32 = 0.02;
/// Derivative time of roll and pitch over the motors' time constant: a little less than all of it, since a motor is
/// quicker above hover.
pub const TILT_LEAD: f32 = 8.0 / 9.0;
/// The same for yaw, where a rotor's own inertia already acts as a lead.
pub const YAW_LEAD: f32 = 5.0 / 9.0;

/// Gains and limits of the body-rate loops.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RateConfig {
    /// Roll, N·m per rad/s.
    pub roll: PidGains,
    /// Pitch, N·m per rad/s.
    pub pitch: PidGains,
    /// Yaw, N·m per rad/s.
    pub yaw: PidGains,
    /// Largest torque per axis, N·m.
    pub torque_max: Vec3,
}

impl RateConfig {
    /// The gains of an airframe: Kp is bandwidth times moment of inertia, the derivative time a share of the motors' time
    /// constant, the torque limits are [`Airframe::torque_limit`].
    #[must_use]
    pub fn for_airframe(airframe: &Airframe) -> Self {
        let (inertia, lag) = (airframe.inertia, airframe.motor_lag);
        let (tilt, yaw) = (quickness(airframe) * TILT_BANDWIDTH, quickness(airframe) * YAW_BANDWIDTH);
        let tilt = |inertia| PidGains { kp: tilt * inertia, ti: 0.5, td: TILT_LEAD * lag, eta: 0.2 };
        Self {
            roll: tilt(inertia.x),
            pitch: tilt(inertia.y),
            yaw: PidGains { kp: yaw * inertia.z, ti: 0.8, td: YAW_LEAD * lag, eta: 0.2 },
            torque_max: airframe.torque_limit(),
        }
    }
}

/// Share of the bandwidths that the airframe's motors allow: 1 up to [`QUICK_MOTOR`], less for slower ones.
pub(crate) fn quickness(airframe: &Airframe) -> f32 {
    (QUICK_MOTOR / airframe.motor_lag).min(1.0)
}

/// The body-rate loops.
///
/// ```
/// use stampfly_control::Airframe;
/// use stampfly_control::rate::{RateConfig, RateController};
/// use stampfly_types::Vec3;
/// let mut rate = RateController::new(&RateConfig::for_airframe(&Airframe::EXAMPLE));
/// let torque = rate.step(&Vec3::new(1.0, 0.0, 0.0), &Vec3::zeros(), 0.0025, [0.0; 4], false);
/// assert!(torque.x > 0.0 && torque.y == 0.0 && torque.z == 0.0);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RateController {
    axes: [Pid; 3],
    /// Last torque asked: tells in which direction an unmet share points.
    torque: Vec3,
}

impl RateController {
    /// Loops at rest.
    #[must_use]
    pub fn new(config: &RateConfig) -> Self {
        let limit = config.torque_max;
        Self {
            axes: [Pid::new(config.roll, limit.x), Pid::new(config.pitch, limit.y), Pid::new(config.yaw, limit.z)],
            torque: Vec3::zeros(),
        }
    }

    /// Torque for a rate, body axes, rad/s in and N·m out. `unmet` is the mixer's report of the last step;
    /// `grounded` keeps the integrators where they are.
    #[inline]
    pub fn step(&mut self, target: &Vec3, measured: &Vec3, dt: f32, unmet: [f32; 4], grounded: bool) -> Vec3 {
        let [roll, pitch, yaw] = &mut self.axes;
        let [unmet_roll, unmet_pitch, unmet_yaw, _] = unmet;
        let axis = |pid: &mut Pid, target, measured, unmet, last| {
            pid.step(target, measured, dt, integration(unmet, last, grounded))
        };
        self.torque = Vec3::new(
            axis(roll, target.x, measured.x, unmet_roll, self.torque.x),
            axis(pitch, target.y, measured.y, unmet_pitch, self.torque.y),
            axis(yaw, target.z, measured.z, unmet_yaw, self.torque.z),
        );
        self.torque
    }

    /// Forgets integrals and derivatives.
    pub fn reset(&mut self) {
        self.axes.iter_mut().for_each(Pid::reset);
        self.torque = Vec3::zeros();
    }
}

/// What an integrator may do when a share of its loop's last output could not be delivered.
pub(crate) fn integration(unmet: f32, last_output: f32, hold: bool) -> Integration {
    /// A share below this is rounding, not saturation.
    const NOTICEABLE: f32 = 0.01;
    if hold {
        Integration::Hold
    } else if unmet.abs() <= NOTICEABLE {
        Integration::Free
    } else if (unmet > 0.0) == (last_output > 0.0) {
        // Less than asked of something positive, or more than asked of something negative.
        Integration::NotUp
    } else {
        Integration::NotDown
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unmet_share_stops_the_integrator_in_the_direction_of_the_demand() {
        assert_eq!(integration(0.5, 1e-3, false), Integration::NotUp);
        assert_eq!(integration(0.5, -1e-3, false), Integration::NotDown);
        assert_eq!(integration(-0.5, 1e-3, false), Integration::NotDown, "delivered more than asked");
        assert_eq!(integration(0.001, 1e-3, false), Integration::Free);
        assert_eq!(integration(0.0, 1e-3, true), Integration::Hold);
    }

    #[test]
    fn torque_stays_within_its_limits() {
        let config = RateConfig::for_airframe(&Airframe::EXAMPLE);
        let mut rate = RateController::new(&config);
        let torque = rate.step(&Vec3::new(1e6, -1e6, 1e6), &Vec3::zeros(), 0.0025, [0.0; 4], false);
        assert_eq!(torque, Vec3::new(config.torque_max.x, -config.torque_max.y, config.torque_max.z));
        let again = rate.step(&Vec3::repeat(f32::NAN), &Vec3::zeros(), 0.0025, [0.0; 4], false);
        assert_eq!(again, torque, "a broken target repeats the last torque");
    }
}
