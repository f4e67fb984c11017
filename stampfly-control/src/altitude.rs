//! Height to collective thrust: proportional on height, PID on climb, hover thrust and path as feed-forward.
//!
//! The loops ask for a vertical acceleration; thrust follows as hover thrust × (1 − a/g) / cos(tilt). Hover thrust is
//! what the vehicle needs to stay where it is: its weight, worn propellers and a sagging battery included. It is
//! learned: while the vehicle flies steadily, the integral flows slowly over into it, which changes nothing now and
//! lets the next take-off start with the right thrust.

use stampfly_types::GRAVITY;
use stampfly_types::math::larger;
use stampfly_types::messages::MotorOutput;

use crate::airframe::Airframe;
use crate::bound::{possible_thrust, symmetric, tan_lean_max, within};
use crate::pid::{Pid, PidGains};
use crate::rate::integration;

/// Gains and limits of the vertical loops.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AltitudeConfig {
    /// Velocity per height error, 1/s.
    pub height_gain: f32,
    /// Largest velocity correction for a height error, m/s.
    pub correction_max: f32,
    /// Acceleration per velocity error, 1/s.
    pub velocity: PidGains,
    /// Largest feedback acceleration, m/s².
    pub acceleration_max: f32,
    /// Thrust at hover to begin with, N.
    pub hover_thrust: f32,
    /// Time constant with which hover thrust is learned, s. Zero or infinite means never.
    pub learning_time: f32,
    /// Largest learned deviation from `hover_thrust`, as a share of it.
    pub learning_range: f32,
    /// Largest collective thrust, N. A little below what the motors can do leaves them room to steer.
    pub thrust_max: f32,
    /// Smallest collective thrust in the air under height control, as a share of hover thrust.
    pub thrust_min_share: f32,
    /// Share of hover thrust while the vertical state is unknown. Against the vertical drag of about 1.4 1/s, 0.96
    /// settles at 0.3 m/s downwards.
    pub descend_share: f32,
}

impl AltitudeConfig {
    /// Thrusts from the airframe; the gains are squared frequencies and dampings that hold for any weight.
    #[must_use]
    pub fn for_airframe(airframe: &Airframe) -> Self {
        Self {
            height_gain: 2.5,
            correction_max: 0.8,
            velocity: PidGains { kp: 7.0, ti: 0.8, td: 0.0, eta: 0.125 },
            acceleration_max: 5.0,
            hover_thrust: airframe.hover_thrust(),
            learning_time: 8.0,
            learning_range: 0.3,
            thrust_max: airframe.thrust_limit(),
            thrust_min_share: 0.2,
            descend_share: 0.96,
        }
    }
}

/// The vertical state and what it should be: z down, metres and seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Climb {
    /// Where to be minus where we are; zero when the height is unknown.
    pub error: f32,
    /// The path's velocity.
    pub target: f32,
    /// The path's acceleration.
    pub acceleration: f32,
    /// The measured velocity.
    pub velocity: f32,
    /// Cosine of the tilt.
    pub cos_tilt: f32,
}

/// Circumstances of one step that limit thrust or learning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThrustLimits {
    /// Upper limit as a share of hover thrust; `f32::MAX` while unlimited.
    pub ceiling: f32,
    /// Share of the last thrust that the mixer could not deliver.
    pub unmet: f32,
    /// May hover thrust be learned? Not on the ground and not in its cushion of air.
    pub learn: bool,
    /// Keep the integrator as it is.
    pub hold: bool,
}

/// The vertical loops.
///
/// ```
/// use stampfly_control::Airframe;
/// use stampfly_control::altitude::{AltitudeConfig, AltitudeController, Climb, ThrustLimits};
/// let config = AltitudeConfig::for_airframe(&Airframe::EXAMPLE);
/// let mut altitude = AltitudeController::new(&config);
/// let still = Climb { cos_tilt: 1.0, ..Climb::default() };
/// let limits = ThrustLimits { ceiling: f32::MAX, unmet: 0.0, learn: true, hold: false };
/// assert_eq!(altitude.step(&still, &limits, 0.0025), config.hover_thrust);
/// let too_low = Climb { error: -0.3, ..still };
/// assert!(altitude.step(&too_low, &limits, 0.0025) > config.hover_thrust);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AltitudeController {
    config: AltitudeConfig,
    climb: Pid,
    hover_thrust: f32,
    /// Upward thrust that the last step asked for, and the whole thrust that there is for it, N.
    needed: f32,
    available: f32,
    /// Mean share of the thrust that the motors made.
    met: f32,
    /// One over the learning time, 1/s.
    learning_rate: f32,
}

impl AltitudeController {
    /// Below this the tilt says nothing about how to rise: thrust no longer makes up for it.
    const COS_TILT_MIN: f32 = 0.5;
    /// Steady enough to learn from: speed error, m/s.
    const STEADY: f32 = 0.15;
    /// Time constant of the mean share of the thrust that is met, s: torques take some of it for moments.
    const MEETS: f32 = 0.2;
    /// Below this share something is missing.
    const ALL: f32 = 0.99;

    /// Loops at rest, hover thrust as configured.
    #[must_use]
    pub fn new(config: &AltitudeConfig) -> Self {
        Self {
            config: *config,
            climb: Pid::new(config.velocity, config.acceleration_max),
            hover_thrust: config.hover_thrust,
            needed: 0.0,
            available: config.thrust_max,
            met: 1.0,
            learning_rate: if config.learning_time > 0.0 { 1.0 / config.learning_time } else { 0.0 },
        }
    }

    /// Changes the gains in flight. The integral, the hover thrust as learned and the limits stay.
    pub fn set_gains(&mut self, config: &AltitudeConfig) {
        (self.config.height_gain, self.config.velocity) = (config.height_gain, config.velocity);
        self.climb.set_gains(config.velocity);
    }

    /// Collective thrust, N, that follows the path.
    #[inline]
    pub fn step(&mut self, climb: &Climb, limits: &ThrustLimits, dt: f32) -> f32 {
        let correction = symmetric(self.config.height_gain * climb.error, self.config.correction_max);
        // Down is positive, thrust is up: thrust that falls short means an acceleration below what was asked.
        let integration = integration(limits.unmet, -1.0, limits.hold);
        let target = climb.target + correction;
        let feedback = self.climb.step(target, climb.velocity, dt, integration);
        if limits.learn && (target - climb.velocity).abs() < Self::STEADY {
            self.learn(dt);
        }
        self.needed = self.hover_thrust * (1.0 - (climb.acceleration + feedback) * (1.0 / GRAVITY));
        let wanted = self.needed / larger(climb.cos_tilt, Self::COS_TILT_MIN);
        // Upside down, thrust only pushes into the ground.
        let wanted = if climb.cos_tilt > 0.0 { wanted } else { 0.0 };
        let thrust = self.limit(larger(wanted, self.config.thrust_min_share * self.hover_thrust), limits);
        self.met += (MotorOutput::met(limits.unmet) - self.met) * (dt / (Self::MEETS + dt));
        self.available = if self.met < Self::ALL { thrust * self.met } else { self.config.thrust_max };
        thrust
    }

    /// Tangent of the largest lean at which the thrust that there is makes what the last step asked for
    /// upwards: height comes before place. Not less than 15°, and no limit for a throttle stick.
    #[must_use]
    pub fn tan_lean_max(&self) -> f32 {
        tan_lean_max(self.available, self.needed)
    }

    /// Collective thrust, N, to come down slowly without knowing height or speed.
    #[must_use]
    pub fn descend(&mut self, limits: &ThrustLimits) -> f32 {
        self.needed = 0.0;
        self.limit(self.config.descend_share * self.hover_thrust, limits)
    }

    /// Collective thrust, N, for a throttle stick: 0 to 1.
    #[must_use]
    pub fn manual(&mut self, throttle: f32) -> f32 {
        self.needed = 0.0;
        within(throttle * self.config.thrust_max, 0.0, self.config.thrust_max)
    }

    /// Thrust at hover as learned so far, N.
    #[must_use]
    pub fn hover_thrust(&self) -> f32 {
        self.hover_thrust
    }

    /// Forgets the integral, not the hover thrust.
    pub fn reset(&mut self) {
        self.climb.reset();
    }

    /// Moves a little of the integral into the hover thrust. Both together ask for the same thrust as before:
    /// h(1 − i/g) stays what it is when h grows by the share s·(−i/g) and i shrinks by s·i·(1 − i/g), up to s².
    fn learn(&mut self, dt: f32) {
        let integral = self.climb.integral();
        let relative = integral * (1.0 / GRAVITY);
        let share = dt * self.learning_rate;
        let hover = self.hover_thrust * (1.0 - share * relative);
        if (hover - self.config.hover_thrust).abs() <= self.config.learning_range * self.config.hover_thrust {
            self.hover_thrust = hover;
            self.climb.set_integral(integral - share * integral * (1.0 - relative));
        }
    }

    fn limit(&self, thrust: f32, limits: &ThrustLimits) -> f32 {
        possible_thrust(thrust, self.config.thrust_max, limits.ceiling, self.hover_thrust)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const FREE: ThrustLimits = ThrustLimits { ceiling: f32::MAX, unmet: 0.0, learn: true, hold: false };
    const DT: f32 = 0.0025;

    fn config() -> AltitudeConfig {
        AltitudeConfig::for_airframe(&Airframe::EXAMPLE)
    }

    /// A vehicle that is only a mass; gives the height error at the end and the controller.
    fn fly(weight: f32, seconds: f32, mut altitude: AltitudeController) -> (f32, AltitudeController) {
        let (mut z, mut v) = (0.0, 0.0);
        for _ in 0..(seconds / DT) as u32 {
            let climb = Climb { error: -z, velocity: v, cos_tilt: 1.0, ..Climb::default() };
            let thrust = altitude.step(&climb, &FREE, DT);
            v += GRAVITY * (1.0 - thrust / weight) * DT;
            z += v * DT;
        }
        (z, altitude)
    }

    #[test]
    fn learns_the_weight_and_keeps_it_over_a_reset() {
        let config = config();
        for factor in [0.8, 1.0, 1.2] {
            let weight = config.hover_thrust * factor;
            let (z, mut altitude) = fly(weight, 60.0, AltitudeController::new(&config));
            assert!(z.abs() < 0.01, "height kept, {z}");
            assert!((altitude.hover_thrust() / weight - 1.0).abs() < 0.01, "learned {}", altitude.hover_thrust());
            altitude.reset();
            let climb = Climb { cos_tilt: 1.0, ..Climb::default() };
            assert!((altitude.step(&climb, &FREE, DT) / weight - 1.0).abs() < 0.01);
        }
    }

    #[test]
    fn learning_does_not_move_the_vehicle() {
        let config = config();
        let mut altitude = AltitudeController::new(&config);
        altitude.climb.set_integral(-1.5);
        let before = altitude.hover_thrust * (1.0 - altitude.climb.integral() / GRAVITY);
        for _ in 0..400 {
            altitude.learn(DT);
        }
        let after = altitude.hover_thrust * (1.0 - altitude.climb.integral() / GRAVITY);
        assert!((after / before - 1.0).abs() < 1e-4, "{before} became {after}");
        assert!(altitude.hover_thrust > config.hover_thrust * 1.01, "and something was learned");
    }

    #[test]
    fn the_ceiling_limits_thrust() {
        let altitude = AltitudeController::new(&config());
        for ceiling in [0.7, 1.2] {
            let limited = altitude.limit(2.0 * config().thrust_max, &ThrustLimits { ceiling, ..FREE });
            assert!((limited / altitude.hover_thrust() - ceiling).abs() < 1e-6);
        }
        assert_eq!(altitude.limit(2.0 * config().thrust_max, &FREE), config().thrust_max);
    }

    proptest! {
        #[test]
        fn thrust_is_always_possible(values in prop::array::uniform5(any::<f32>()), ceiling: f32, unmet: f32) {
            let [error, target, acceleration, velocity, cos_tilt] = values;
            let mut altitude = AltitudeController::new(&config());
            for _ in 0..3 {
                let climb = Climb { error, target, acceleration, velocity, cos_tilt };
                let thrust = altitude.step(&climb, &ThrustLimits { ceiling, unmet, ..FREE }, DT);
                prop_assert!((0.0..=config().thrust_max).contains(&thrust));
            }
        }
    }
}
