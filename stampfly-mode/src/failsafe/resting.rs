//! Does something carry the vehicle that is not its feet?
//!
//! What rests on the ground feels gravity and does not turn. Which way gravity pulls is then the
//! way it lies, whatever an estimator makes of the tumble before. In the air the same force comes
//! from thrust and from nothing else: along −z of a multirotor, so one that leans far needs much of
//! it, and none makes a force towards its own belly; and from the wing of an aeroplane, which
//! pushes neither to the side nor down.
//!
//! Use it for a vehicle that has crashed without a blow: tipped over, slid off, let go of. It knows
//! nothing of one that stands upright.

use crate::lasting::lasts;
use stampfly_types::math::{sin, smaller};
use stampfly_types::{Duration, GRAVITY, Instant, Vec3};

/// Time constants of the mean force and the mean rate, s: some turns of a slow rotor.
const MEAN: f32 = 0.05;
/// A step that is longer counts as this long, s.
const LONGEST_STEP: f32 = 0.02;
/// The force of what rests, in units of gravity: an accelerometer's offset and scale, and a rotor
/// that still shakes.
const RESTS: core::ops::Range<f32> = 0.75..1.25;
/// What rests turns no faster, rad/s: offset and noise of a gyro that was calibrated, and what a
/// rotor shakes.
const STILL: f32 = 0.3;
/// Thrust that carries less than this share of the weight upwards lets the vehicle fall.
const CARRIES: f32 = 0.7;

/// What a vehicle stands on. Values of an airframe.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RestingConfig {
    /// Largest roll and pitch of a vehicle that stands on its feet or wheels, rad, with the
    /// steepest slope. Half of a circle and more: however it leans.
    pub lean: [f32; 2],
    /// For how long it lies.
    pub time: Duration,
}

/// What is remembered of force and rate.
///
/// ```
/// use stampfly_mode::failsafe::{Resting, RestingConfig};
/// use stampfly_types::{Duration, Instant, Vec3};
/// let config = RestingConfig { lean: [1.0, 1.0], time: Duration::from_millis(500) };
/// let (mut resting, on_its_back) = (Resting::default(), Vec3::new(0.0, 0.0, 9.8));
/// let lies = |step: &u64| resting.step(Instant::from_micros(2_500 * step), &config, &on_its_back, &Vec3::zeros(), 1.0);
/// assert!((1..400).find(lies).is_some_and(|step| step < 260));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Resting {
    last: Option<Instant>,
    /// Means of specific force and rate, body FRD.
    force: Vec3,
    rate: Vec3,
    since: Option<Instant>,
}

impl Resting {
    /// Takes specific force, m/s², and rate, rad/s, both body FRD, and the thrust along −z that the
    /// motors are told to make, in units of the weight: 0 of an aeroplane. Does it lie?
    pub fn step(&mut self, now: Instant, config: &RestingConfig, force: &Vec3, rate: &Vec3, thrust: f32) -> bool {
        let first = self.last.is_none();
        let dt = self.last.replace(now).map_or(0.0, |last| smaller(now.since(last).seconds(), LONGEST_STEP));
        let weight = if first { 1.0 } else { dt / (MEAN + dt) };
        if (force.norm_squared() + rate.norm_squared()).is_finite() {
            self.force += (*force - self.force) * weight;
            self.rate += (*rate - self.rate) * weight;
        }
        let size = self.force.norm();
        let rests = (RESTS.start * GRAVITY..RESTS.end * GRAVITY).contains(&size) && self.rate.norm() < STILL;
        lasts(&mut self.since, now, rests && leans(config, &(self.force / size.max(1e-3)), thrust), config.time)
    }
}

/// Is this direction of the force, a unit vector, none of a vehicle that stands, nor of one that
/// its thrust carries?
fn leans(config: &RestingConfig, up: &Vec3, thrust: f32) -> bool {
    let [roll, pitch] = config.lean.map(|lean| sin(smaller(lean, core::f32::consts::FRAC_PI_2)));
    let (side, ahead) = (up.y / roll, up.x / pitch);
    let upright = -up.z;
    upright < 0.0 || side * side + ahead * ahead > 1.0 && thrust * upright < CARRIES
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::math::cos;

    /// A quadrotor with two and a half times the thrust that it weighs, and an aeroplane with wing
    /// tips near the ground.
    const QUADROTOR: RestingConfig = RestingConfig { lean: [1.0; 2], time: Duration::from_millis(500) };
    const AEROPLANE: RestingConfig = RestingConfig { lean: [0.45, 0.8], time: Duration::from_millis(500) };

    /// After how many seconds does this force, in units of gravity, with this rate count as lying?
    fn lies(config: &RestingConfig, force: [f32; 3], rate: f32, thrust: f32) -> Option<f32> {
        let (mut resting, force) = (Resting::default(), Vec3::from(force) * GRAVITY);
        (0..800).map(|step| step as f32 * 0.0025).find(|time| {
            resting.step(Instant::from_micros((*time * 1e6) as u64), config, &force, &Vec3::new(0.0, rate, 0.0), thrust)
        })
    }

    /// Up, in the body of a vehicle that is rolled.
    fn rolled(angle: f32) -> [f32; 3] {
        [0.0, -sin(angle), -cos(angle)]
    }

    #[test]
    fn on_its_back_and_on_its_side_it_lies_and_on_a_slope_it_stands() {
        for config in [QUADROTOR, AEROPLANE] {
            for angle in [1.1, 1.57, 2.5, 3.1, -1.57] {
                let after = lies(&config, rolled(angle), 0.0, 0.3).expect("it lies");
                assert!((0.49..0.6).contains(&after), "{angle} rad: {after} s");
            }
            assert_eq!(lies(&config, rolled(0.3), 0.0, 0.3), None, "a slope");
            assert_eq!(lies(&config, rolled(3.1), 1.0, 0.3), None, "it still turns");
            assert_eq!(lies(&config, [0.0; 3], 0.0, 0.0), None, "it falls");
        }
        assert!(lies(&AEROPLANE, rolled(0.5), 0.0, 0.0).is_some(), "on a wing tip");
        assert_eq!(lies(&AEROPLANE, [0.6, 0.0, -0.8], 0.0, 0.0), None, "it accelerates");
    }

    #[test]
    fn a_quadrotor_at_full_speed_leans_as_far_as_its_thrust_carries_it() {
        assert_eq!(lies(&QUADROTOR, rolled(1.1), 0.0, 2.4), None);
        assert!(lies(&QUADROTOR, rolled(1.1), 0.0, 1.0).is_some());
        assert!(lies(&QUADROTOR, rolled(2.0), 0.0, 2.4).is_some(), "no thrust pushes down");
    }

    #[test]
    fn numbers_that_are_none_say_nothing() {
        let mut resting = Resting::default();
        for step in 0..400 {
            let none = Vec3::new(f32::NAN, 0.0, f32::INFINITY);
            assert!(!resting.step(Instant::from_micros(2_500 * step), &QUADROTOR, &none, &none, f32::NAN));
        }
    }
}
