//! Body rate to torque: the innermost loop, one [`Pid`] per axis.
//!
//! With the derivative time near the motor's time constant the zero of the loop cancels the motor's pole and what remains
//! is close to an integrator with 7 ms of delay (filter, sampling, computing). That sets the gain: Kp = I·ω, the moment of
//! inertia about the axis times the crossover ω. [`TILT_BANDWIDTH`] and [`YAW_BANDWIDTH`] are that ω, lowered for motors
//! slower than [`QUICK_MOTOR`](crate::airframe::QUICK_MOTOR); [`RateConfig::for_airframe`] applies the rule.

use stampfly_types::Vec3;

use crate::airframe::Airframe;
use crate::attitude::AttitudeConfig;
use crate::pid::{Integration, Pid, PidGains};

/// Crossover of the roll and pitch rate loops, rad/s: with 7 ms of delay in the loop it keeps 55° of phase when the motor
/// is half as slow again.
pub const TILT_BANDWIDTH: f32 = 43.6;
/// Crossover of the yaw rate loop, rad/s. Half of roll and pitch: the rotors' drag is weak, and more gain only drives the
/// motors into their limits.
pub const YAW_BANDWIDTH: f32 = 22.0;
/// Derivative time of roll and pitch over the motors' time constant: a little less than all of it, since a motor is
/// quicker above hover.
pub const TILT_LEAD: f32 = 8.0 / 9.0;
/// The same for yaw, where a rotor's own inertia already acts as a lead.
pub const YAW_LEAD: f32 = 5.0 / 9.0;

/// How far a full integral of roll or pitch leans a vehicle, rad: 8°.
pub(crate) const LEAN: f32 = 0.14;

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
    /// Largest integral per axis, N·m: what a propeller that is a third too weak needs, and no more. A vehicle that something
    /// holds fills its integrals; this is what is left in them when it is let go.
    pub integral_max: Vec3,
}

impl RateConfig {
    /// The gains of an airframe: Kp is bandwidth times moment of inertia, the derivative time a share of the motors' time
    /// constant, the torque limits are [`Airframe::torque_limit`].
    #[must_use]
    pub fn for_airframe(airframe: &Airframe) -> Self {
        let (inertia, lag) = (airframe.inertia, airframe.motor_lag);
        let (tilt, yaw) = (airframe.quickness() * TILT_BANDWIDTH, airframe.quickness() * YAW_BANDWIDTH);
        let tilt = |inertia| PidGains { kp: tilt * inertia, ti: 0.5, td: TILT_LEAD * lag, eta: 0.2 };
        let (roll, pitch) = (tilt(inertia.x), tilt(inertia.y));
        // The attitude loop holds a constant torque T off with a tilt of T / (Kp · its gain).
        let leaning = LEAN * AttitudeConfig::for_airframe(airframe).tilt_gain;
        Self {
            integral_max: Vec3::new(leaning * roll.kp, leaning * pitch.kp, airframe.torque_limit().z),
            roll,
            pitch,
            yaw: PidGains { kp: yaw * inertia.z, ti: 0.8, td: YAW_LEAD * lag, eta: 0.2 },
            torque_max: airframe.torque_limit(),
        }
    }
}

/// The innermost loop of a [cascade](crate::cascade): body rate to torque.
///
/// # Contract
/// * The torque is finite, whatever the target; the measured rate is finite, see [`Horizontal::Nothing`].
/// * What a loop remembers of a vehicle that something holds stays within a bound, and does not grow about an axis that is
///   `held`.
///
/// [`Horizontal::Nothing`]: crate::intent::Horizontal::Nothing
pub trait RateLaw {
    /// Torque for a rate, body axes, rad/s in and N·m out, `dt` seconds after the last one. `unmet` is the mixer's report of the
    /// last step; `held`: something else turns the vehicle about this axis or keeps it from turning, as the ground does.
    fn step(&mut self, target: &Vec3, measured: &Vec3, dt: f32, unmet: [f32; 4], held: [bool; 3]) -> Vec3;

    /// Forgets all that was measured.
    fn reset(&mut self);
}

/// The body-rate loops.
///
/// ```
/// use stampfly_control::Airframe;
/// use stampfly_control::rate::{RateConfig, RateController};
/// use stampfly_types::Vec3;
/// let mut rate = RateController::new(&RateConfig::for_airframe(&Airframe::EXAMPLE));
/// let torque = rate.step(&Vec3::new(1.0, 0.0, 0.0), &Vec3::zeros(), 0.0025, [0.0; 4], [false; 3]);
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
        let (limit, integral) = (config.torque_max, config.integral_max);
        let axis = |gains, limit, integral| Pid::new(gains, limit).with_integral_limit(integral);
        Self {
            axes: [
                axis(config.roll, limit.x, integral.x),
                axis(config.pitch, limit.y, integral.y),
                axis(config.yaw, limit.z, integral.z),
            ],
            torque: Vec3::zeros(),
        }
    }

    /// Changes the gains in flight. Integrals, derivatives and limits stay.
    pub fn set_gains(&mut self, config: &RateConfig) {
        let gains = [config.roll, config.pitch, config.yaw];
        self.axes.iter_mut().zip(gains).for_each(|(axis, gains)| axis.set_gains(gains));
    }

    /// Torque for a rate, body axes, rad/s in and N·m out. `unmet` is the mixer's report of the last step;
    /// `held` keeps the integrators of these axes where they are.
    #[inline]
    pub fn step(&mut self, target: &Vec3, measured: &Vec3, dt: f32, unmet: [f32; 4], held: [bool; 3]) -> Vec3 {
        let [roll, pitch, yaw] = &mut self.axes;
        let [unmet_roll, unmet_pitch, unmet_yaw, _] = unmet;
        let [held_roll, held_pitch, held_yaw] = held;
        let axis = |pid: &mut Pid, target, measured, unmet, last, held| {
            pid.step(target, measured, dt, integration(unmet, last, held))
        };
        self.torque = Vec3::new(
            axis(roll, target.x, measured.x, unmet_roll, self.torque.x, held_roll),
            axis(pitch, target.y, measured.y, unmet_pitch, self.torque.y, held_pitch),
            axis(yaw, target.z, measured.z, unmet_yaw, self.torque.z, held_yaw),
        );
        self.torque
    }

    /// Forgets integrals and derivatives.
    pub fn reset(&mut self) {
        self.axes.iter_mut().for_each(Pid::reset);
        self.torque = Vec3::zeros();
    }
}

impl RateLaw for RateController {
    #[inline]
    fn step(&mut self, target: &Vec3, measured: &Vec3, dt: f32, unmet: [f32; 4], held: [bool; 3]) -> Vec3 {
        self.step(target, measured, dt, unmet, held)
    }

    fn reset(&mut self) {
        self.reset();
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

    /// D15: a minute in a hand, and the integral alone would have turned it over.
    #[test]
    fn an_integral_that_something_held_leans_the_vehicle_by_eight_degrees() {
        let config = RateConfig::for_airframe(&Airframe::EXAMPLE);
        let mut rate = RateController::new(&config);
        for _ in 0..24_000 {
            rate.step(&Vec3::new(1.0, -1.0, 0.0), &Vec3::zeros(), 0.0025, [0.0; 4], [false; 3]);
        }
        let left = rate.step(&Vec3::zeros(), &Vec3::zeros(), 0.0025, [0.0; 4], [false; 3]);
        let gain = AttitudeConfig::for_airframe(&Airframe::EXAMPLE).tilt_gain;
        for (torque, kp) in [(left.x, config.roll.kp), (-left.y, config.pitch.kp)] {
            let lean = (torque / (kp * gain)).to_degrees();
            assert!((7.0..9.0).contains(&lean), "{lean}");
        }
    }

    #[test]
    fn torque_stays_within_its_limits() {
        let config = RateConfig::for_airframe(&Airframe::EXAMPLE);
        let mut rate = RateController::new(&config);
        let torque = rate.step(&Vec3::new(1e6, -1e6, 1e6), &Vec3::zeros(), 0.0025, [0.0; 4], [false; 3]);
        assert_eq!(torque, Vec3::new(config.torque_max.x, -config.torque_max.y, config.torque_max.z));
        let again = rate.step(&Vec3::repeat(f32::NAN), &Vec3::zeros(), 0.0025, [0.0; 4], [false; 3]);
        assert_eq!(again, torque, "a broken target repeats the last torque");
    }
}
