//! Dead reckoning by gyro and accelerometer, started from an estimate.
//!
//! Camera and range finder do not affect a [`Reckoner`] after its start, so their data can be
//! compared with it. Its useful life is some seconds: half a degree of tilt error adds 0.09 m/s per
//! second. Two of them run and restart from the estimate in turn: after the first [`HALF`], one is
//! always older than that, and none older than twice that. A sensor that fails is therefore
//! compared with a state from before the failure for at least [`HALF`].
//!
//! Both restart continuously while the vehicle stands, and after a gap in the samples or a blow
//! that may have clipped the accelerometer.

use crate::config::MonitorConfig;
use stampfly_types::messages::{ImuData, StateEstimate};
use stampfly_types::{GRAVITY, Instant, Quat, Stamped, Vec3, math};

/// Age of the younger reckoner at which the older one restarts, s.
pub const HALF: f32 = 1.5;
/// Length of an integration block, s: four samples at 400 Hz.
const BLOCK: f32 = 9e-3;
/// Longest interval between samples that is integrated, s. A longer one restarts both reckoners.
const LONGEST_STEP: f32 = 0.05;

/// Initial standard deviations of a reckoner.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sigmas {
    /// Horizontal velocity, m/s.
    pub velocity: f32,
    /// Horizontal acceleration, m/s²: tilt, accelerometer bias and vibration.
    pub acceleration: f32,
    /// Gyro bias about roll and pitch, rad/s.
    pub gyro_bias: f32,
    /// Gyro bias about yaw, rad/s.
    pub yaw_bias: f32,
}

/// Attitude and velocity by dead reckoning.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reckoner {
    /// Time since the start, s.
    pub age: f32,
    /// Body FRD → world NED.
    pub attitude: Quat,
    /// World NED, m/s.
    pub velocity: Vec3,
    /// Initial velocity, m/s.
    pub began: Vec3,
    /// Gyro bias of the initial estimate, body FRD, rad/s.
    pub gyro_bias: Vec3,
    /// Accelerometer bias of the initial estimate, body FRD, m/s².
    pub accel_bias: Vec3,
    /// Initial uncertainty.
    pub sigmas: Sigmas,
    /// It started on a standing vehicle, whose tilt is known from gravity.
    pub stood: bool,
    /// Velocity variance of both axes accumulated from accelerometer noise, (m/s)².
    pub walk: f32,
    /// Net rotation per axis, rad; a turn and its return cancel, as their scale errors do.
    pub swept: Vec3,
}

impl Reckoner {
    /// Starts from an estimate with this uncertainty.
    #[must_use]
    pub fn new(estimate: &StateEstimate, sigmas: Sigmas) -> Self {
        let StateEstimate { attitude, velocity, gyro_bias, accel_bias, .. } = *estimate;
        Self {
            age: 0.0,
            attitude,
            velocity,
            began: velocity,
            gyro_bias,
            accel_bias,
            sigmas,
            stood: false,
            walk: 0.0,
            swept: Vec3::zeros(),
        }
    }

    /// Integrates `dt` seconds with mean rate, rad/s, and mean specific force, m/s². `noise`:
    /// squared change of that force along body x and y since the last block, (m/s²)²; half of it is
    /// the variance of each.
    pub fn advance(&mut self, rate: &Vec3, force: &Vec3, noise: f32, dt: f32) {
        // The mean force acts in the attitude at the middle of the block.
        let turn = (rate - self.gyro_bias) * dt;
        let half = turn * 0.25;
        let half = Quat::new_unchecked(1.0, half.x, half.y, half.z).normalize();
        let middle = self.attitude * half;
        let acceleration = middle.transform_vector(&(force - self.accel_bias)) + Vec3::new(0.0, 0.0, GRAVITY);
        self.velocity += acceleration * dt;
        self.attitude = (middle * half).normalize();
        self.walk += 0.5 * noise * dt * dt;
        self.swept += turn;
        self.age += dt;
    }

    /// Standard deviation of the horizontal acceleration due to the gyro bias, m/s²: the bias tilts
    /// the attitude, and gravity with it.
    #[must_use]
    pub fn drift(&self) -> f32 {
        GRAVITY * self.sigmas.gyro_bias * self.age
    }

    /// Variance of the horizontal acceleration due to the initial tilt and the accelerometer,
    /// (m/s²)².
    #[must_use]
    pub fn tilted(&self) -> f32 {
        self.sigmas.acceleration * self.sigmas.acceleration
    }

    /// Velocity variance due to the yaw bias, (m/s)²: it rotates the velocity gained since the
    /// start.
    #[must_use]
    pub fn aside(&self) -> f32 {
        let turned = self.sigmas.yaw_bias * self.age;
        turned * turned * (self.velocity - self.began).horizontal().norm_squared()
    }

    /// Variance of the difference between a healthy camera's velocity and this one, sum of both
    /// axes, (m/s)², without the error of single readings.
    #[must_use]
    pub fn variance(&self, config: &MonitorConfig, velocity: [f32; 2]) -> f32 {
        let square = |value: f32| value * value;
        let gained = square(velocity[0] - self.began.x) + square(velocity[1] - self.began.y);
        let turned = square(GRAVITY * config.gyro_scale) * self.swept.norm_squared();
        let drift = 0.5 * self.drift();
        // Initial velocity; accelerations from tilt, gyro scale and gyro bias, integrated; noise;
        // heading; scale of the camera.
        square(math::larger(config.velocity_sigma_m_s, self.sigmas.velocity))
            + (self.tilted() + turned + square(drift)) * square(self.age)
            + self.walk
            + self.aside()
            + square(config.flow_scale / config.gate_sigmas) * gained
    }
}

/// The two reckoners and the inertial samples of the unfinished block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reckoners {
    pair: [Reckoner; 2],
    /// Index of the older one.
    older: usize,
    /// Velocity of the estimate minus theirs at the end of the last block, m/s.
    apart: [Vec3; 2],
    last: Option<Instant>,
    elapsed: f32,
    rate: Vec3,
    force: Vec3,
    /// Mean force of the last block, m/s².
    before: Vec3,
    /// Raw mean rates of the last two blocks, newest first, rad/s.
    turns: [Vec3; 2],
    has_begun: bool,
}

/// Restarts in a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Restart {
    /// Neither.
    Neither,
    /// The one with this index.
    One(usize),
    /// Both.
    Both,
}

impl Reckoners {
    /// Reckoner 0 or 1.
    #[must_use]
    pub fn get(&self, index: usize) -> &Reckoner {
        let [first, second] = &self.pair;
        if index == 0 { first } else { second }
    }

    /// Index of the older one.
    #[must_use]
    pub fn older(&self) -> usize {
        self.older
    }

    /// Velocity of the estimate minus that of a reckoner, world NED, m/s.
    #[must_use]
    pub fn apart(&self, index: usize) -> Vec3 {
        let [first, second] = self.apart;
        if index == 0 { first } else { second }
    }

    /// Raw mean rate some 10 ms ago, the time of the frame that arrives now, rad/s.
    #[must_use]
    pub fn turning(&self) -> Vec3 {
        (self.turns[0] + self.turns[1]) * 0.5
    }

    /// Rate of change of [`turning`](Self::turning), rad/s².
    #[must_use]
    pub fn turning_change(&self) -> Vec3 {
        (self.turns[0] - self.turns[1]) / BLOCK
    }

    /// Whether an estimate has been received.
    #[must_use]
    pub fn has_begun(&self) -> bool {
        self.has_begun
    }

    /// Restarts both from this estimate. `stood`: the vehicle stands.
    pub fn begin(&mut self, estimate: &StateEstimate, sigmas: Sigmas, stood: bool) {
        self.pair = [Reckoner { stood, ..Reckoner::new(estimate, sigmas) }; 2];
        self.apart = [Vec3::zeros(); 2];
        (self.elapsed, self.rate, self.force) = Default::default();
        (self.older, self.has_begun) = (1, true);
    }

    /// Processes inertial samples and the estimate after them, with its uncertainty. A force above
    /// `clips`, m/s², along any axis may have been clipped.
    pub fn step(
        &mut self,
        samples: &[Stamped<ImuData>],
        clips: f32,
        estimate: &StateEstimate,
        sigmas: impl Fn() -> Sigmas,
        stands: bool,
    ) -> Restart {
        let mut gap = false;
        for Stamped { at, data, .. } in samples {
            let last = self.last.replace(*at).unwrap_or(*at);
            let dt = at.since(last).seconds();
            gap |= dt > LONGEST_STEP;
            // A sample that is not finite has no usable time either.
            if !(data.accel.norm_squared() + data.gyro.norm_squared()).is_finite() {
                continue;
            }
            // A clipped reading hides a part of the blow: the velocity after it is unknown.
            gap |= data.accel.iter().any(|force| force.abs() > clips);
            self.elapsed += dt;
            self.rate += data.gyro * dt;
            self.force += data.accel * dt;
        }
        if gap {
            // The motion during the gap is unknown.
            self.begin(estimate, sigmas(), stands);
            return Restart::Both;
        }
        if self.elapsed < BLOCK {
            return Restart::Neither;
        }
        let dt = core::mem::take(&mut self.elapsed);
        let rate = core::mem::take(&mut self.rate) / dt;
        let force = core::mem::take(&mut self.force) / dt;
        self.turns = [rate, self.turns[0]];
        let change = force - core::mem::replace(&mut self.before, force);
        // The change between two blocks measures the noise of their mean force.
        let noise = change.x * change.x + change.y * change.y;
        if stands || !self.has_begun {
            self.begin(estimate, sigmas(), stands);
            return Restart::Both;
        }
        for (reckoner, apart) in self.pair.iter_mut().zip(&mut self.apart) {
            reckoner.advance(&rate, &force, noise, dt);
            *apart = estimate.velocity - reckoner.velocity;
        }
        let younger = 1 - self.older.min(1);
        if self.get(younger).age < HALF {
            return Restart::Neither;
        }
        let fresh = Reckoner::new(estimate, sigmas());
        let older = core::mem::replace(&mut self.older, younger);
        if let (Some(reckoner), Some(apart)) = (self.pair.get_mut(older), self.apart.get_mut(older)) {
            (*reckoner, *apart) = (fresh, Vec3::zeros());
        }
        Restart::One(older)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::frame;

    const DT: f32 = 0.0025;
    const SIGMAS: Sigmas = Sigmas { velocity: 0.03, acceleration: 0.1, gyro_bias: 0.002, yaw_bias: 0.002 };

    /// Feeds `seconds` of samples given as a function of time, with an independent estimate.
    /// Returns the number of restarts.
    fn fly(
        reckoners: &mut Reckoners,
        seconds: f32,
        sample: impl Fn(f32) -> ImuData,
        estimate: impl Fn(f32) -> StateEstimate,
    ) -> u32 {
        let mut restarts = 0;
        for n in 1..=(seconds / DT) as u64 {
            let time = n as f32 * DT;
            let imu = Stamped { at: Instant::from_micros(n * 2_500), generation: 1, data: sample(time) };
            let restart = reckoners.step(&[imu], f32::MAX, &estimate(time), || SIGMAS, false);
            restarts += u32::from(matches!(restart, Restart::One(_)));
        }
        restarts
    }

    /// A vehicle that turns about x at this rate, with a thrust of one g.
    fn turns(rate: f32) -> impl Fn(f32) -> ImuData {
        move |_| ImuData { accel: Vec3::new(0.0, 0.0, -GRAVITY), gyro: Vec3::new(rate, 0.0, 0.0), ..ImuData::default() }
    }

    #[test]
    fn a_turn_is_followed_however_fast() {
        for rate in [0.2, 3.0, 12.0] {
            let mut reckoners = Reckoners::default();
            reckoners.begin(&StateEstimate::default(), SIGMAS, true);
            fly(&mut reckoners, 0.5, turns(rate), |_| StateEstimate::default());
            let reckoner = reckoners.get(0);
            let angle = rate * reckoner.age;
            let off = reckoner.attitude.angle_to(&Quat::from_scaled_axis(Vec3::new(angle, 0.0, 0.0)));
            assert!(off < 2e-3, "{rate} rad/s: {off} rad");
            // The thrust tilts with the body.
            let east = GRAVITY * (1.0 - math::cos(angle)) / rate;
            assert!((reckoner.velocity.y - east).abs() < 0.02, "{rate} rad/s: {:?}", reckoner.velocity);
        }
    }

    #[test]
    fn one_is_always_older_than_half_and_none_older_than_twice_that() {
        let mut reckoners = Reckoners::default();
        reckoners.begin(&StateEstimate::default(), SIGMAS, true);
        for n in 0..40 {
            fly(&mut reckoners, 0.2, turns(0.0), |_| StateEstimate::default());
            let [first, second] = [0, 1].map(|index| reckoners.get(index).age);
            let (younger, older) = (first.min(second), first.max(second));
            assert!(older < 2.0 * HALF + 0.03 && younger < HALF + 0.02, "{n}: {first} s, {second} s");
            assert!(n < 8 || older >= HALF, "{n}: {first} s, {second} s");
            assert_eq!(reckoners.get(reckoners.older()).age, older);
        }
    }

    #[test]
    fn an_estimate_that_is_misled_shows_as_a_difference() {
        let mut reckoners = Reckoners::default();
        reckoners.begin(&StateEstimate::default(), SIGMAS, true);
        let misled = |time: f32| StateEstimate { velocity: Vec3::new(0.5 * time, 0.0, 0.0), ..Default::default() };
        assert_eq!(fly(&mut reckoners, 1.0, turns(0.0), misled), 0);
        assert!((reckoners.apart(0).x - 0.5).abs() < 0.02, "{:?}", reckoners.apart(0));
        assert!(frame::tilt(&reckoners.get(0).attitude) < 1e-3);
    }

    #[test]
    fn a_blow_that_clips_is_not_reckoned_with() {
        let mut reckoners = Reckoners::default();
        reckoners.begin(&StateEstimate::default(), SIGMAS, true);
        let blow = |force: f32| ImuData { accel: Vec3::new(force, 0.0, -GRAVITY), ..ImuData::default() };
        for n in 1..=200u64 {
            let imu = blow(if (100..104).contains(&n) { 77.0 } else { 0.0 });
            let imu = Stamped { at: Instant::from_micros(n * 2_500), generation: 1, data: imu };
            reckoners.step(&[imu], 70.0, &StateEstimate::default(), || SIGMAS, false);
        }
        assert!(reckoners.get(0).velocity.norm() < 0.01 && reckoners.get(0).age < 0.3, "{:?}", reckoners.get(0));
    }

    #[test]
    fn samples_that_are_no_numbers_and_gaps_do_no_harm() {
        let mut reckoners = Reckoners::default();
        reckoners.begin(&StateEstimate::default(), SIGMAS, true);
        let broken = |time: f32| {
            let accel = if time > 0.1 && time < 0.2 { f32::NAN } else { -GRAVITY };
            ImuData { accel: Vec3::new(0.0, 0.0, accel), ..ImuData::default() }
        };
        fly(&mut reckoners, 0.5, broken, |_| StateEstimate::default());
        assert!(reckoners.get(0).velocity.norm() < 1e-3);
    }
}
