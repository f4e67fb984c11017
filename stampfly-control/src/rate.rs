//! Body rate to torque: the innermost loop, one [`Pid`] per axis.
//!
//! With the derivative time near the motor's time constant (about 18 ms) the zero of the loop cancels the motor's
//! pole and what remains is close to an integrator with 7 ms of delay (filter, sampling, computing). That sets the
//! gain: Kp = I·ω for a crossover ω of 40–45 rad/s keeps 55° of phase when the motor is half as slow again.

use stampfly_types::Vec3;

use crate::pid::{Integration, Pid, PidGains};

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

impl Default for RateConfig {
    /// The StampFly: inertia 9.16, 13.3 and 20.4 × 10⁻⁶ kg·m², motor lag 18 ms.
    fn default() -> Self {
        Self {
            roll: PidGains { kp: 4.0e-4, ti: 0.5, td: 0.016, eta: 0.2 },
            pitch: PidGains { kp: 5.8e-4, ti: 0.5, td: 0.016, eta: 0.2 },
            yaw: PidGains { kp: 4.5e-4, ti: 0.8, td: 0.010, eta: 0.2 },
            torque_max: Vec3::new(3.0e-3, 3.0e-3, 1.0e-3),
        }
    }
}

/// The body-rate loops.
///
/// ```
/// use stampfly_control::rate::{RateConfig, RateController};
/// use stampfly_types::Vec3;
/// let mut rate = RateController::new(&RateConfig::default());
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
        let config = RateConfig::default();
        let mut rate = RateController::new(&config);
        let torque = rate.step(&Vec3::new(1e6, -1e6, 1e6), &Vec3::zeros(), 0.0025, [0.0; 4], false);
        assert_eq!(torque, Vec3::new(config.torque_max.x, -config.torque_max.y, config.torque_max.z));
        let again = rate.step(&Vec3::repeat(f32::NAN), &Vec3::zeros(), 0.0025, [0.0; 4], false);
        assert_eq!(again, torque, "a broken target repeats the last torque");
    }
}
