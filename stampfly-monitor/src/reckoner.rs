//! Dead reckoning by gyro and accelerometer alone, from an estimate on.
//!
//! No camera and no range finder touches a [`Reckoner`] after it has begun, so that what they
//! measure can be compared with it. It is worth something for some seconds: half a degree of tilt
//! makes 0.09 m/s of velocity in each. Two of them run, and in turn begin anew from the estimate: one
//! is older than [`HALF`] from then on, and none older than twice that. A sensor that goes wrong is
//! therefore compared with a state from before, for [`HALF`] at least.
//!
//! On a vehicle that stands both begin anew all the time, and after a gap in the samples or a blow that
//! the accelerometer may not have measured whole.

use crate::config::MonitorConfig;
use stampfly_types::messages::{ImuData, StateEstimate};
use stampfly_types::{GRAVITY, Instant, Quat, Stamped, Vec3, math};

/// The younger of two reckoners becomes so old, s, before the older one begins anew.
pub const HALF: f32 = 1.5;
/// Samples are integrated in blocks of this length, s: four at 400 Hz.
const BLOCK: f32 = 9e-3;
/// After a longer gap in the samples nothing is reckoned on from before it, s.
const LONGEST_STEP: f32 = 0.05;

/// One standard deviation each of what a reckoner begins with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sigmas {
    /// Horizontal velocity, m/s.
    pub velocity: f32,
    /// Horizontal acceleration: of tilt, accelerometer and its vibration, m/s².
    pub acceleration: f32,
    /// Bias of the gyro about roll and pitch, rad/s.
    pub gyro_bias: f32,
    /// Bias about yaw, rad/s.
    pub yaw_bias: f32,
}

/// Attitude and velocity, reckoned from an estimate on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reckoner {
    /// Time since that estimate, s.
    pub age: f32,
    /// Body FRD → world NED.
    pub attitude: Quat,
    /// World NED, m/s.
    pub velocity: Vec3,
    /// The velocity it began with, m/s.
    pub began: Vec3,
    /// Biases of that estimate, body FRD, rad/s and m/s².
    pub gyro_bias: Vec3,
    /// See [`gyro_bias`](Self::gyro_bias).
    pub accel_bias: Vec3,
    /// How uncertain it was when it began.
    pub sigmas: Sigmas,
    /// It began on a vehicle that stood, whose tilt gravity shows.
    pub stood: bool,
    /// Variance of the velocity along both axes that noise of the accelerometer has added up to, (m/s)².
    pub walk: f32,
    /// How far it has turned, by axis, rad: what turns back and forth takes it back.
    pub swept: Vec3,
}

impl Reckoner {
    /// From this estimate on, which is so uncertain.
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

    /// Goes on by `dt` seconds, in which gyro and accelerometer read this much in the mean, rad/s and
    /// m/s². `noise`: square of the change of that force along body x and y since the last time,
    /// (m/s²)², of which half is the variance of each.
    pub fn advance(&mut self, rate: &Vec3, force: &Vec3, noise: f32, dt: f32) {
        // The mean force acts in the attitude of the middle.
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

    /// Standard deviation of the horizontal acceleration that the gyro's zero has made by now, m/s²: it
    /// turns the tilt, and gravity with it.
    #[must_use]
    pub fn drift(&self) -> f32 {
        GRAVITY * self.sigmas.gyro_bias * self.age
    }

    /// Variance of the horizontal acceleration that tilt and accelerometer had from the beginning, (m/s²)².
    #[must_use]
    pub fn tilted(&self) -> f32 {
        self.sigmas.acceleration * self.sigmas.acceleration
    }

    /// Variance of the velocity that the heading has turned aside by now, (m/s)²: the gyro's zero about
    /// yaw turns what has been gained since the beginning.
    #[must_use]
    pub fn aside(&self) -> f32 {
        let turned = self.sigmas.yaw_bias * self.age;
        turned * turned * (self.velocity - self.began).horizontal().norm_squared()
    }

    /// Variance of the difference between a sound camera's velocity and this one, along both axes
    /// together, (m/s)², but for what single readings are wrong by.
    #[must_use]
    pub fn variance(&self, config: &MonitorConfig, velocity: [f32; 2]) -> f32 {
        let square = |value: f32| value * value;
        let gained = square(velocity[0] - self.began.x) + square(velocity[1] - self.began.y);
        let turned = square(GRAVITY * config.gyro_scale) * self.swept.norm_squared();
        let drift = 0.5 * self.drift();
        square(math::larger(config.velocity_sigma_m_s, self.sigmas.velocity))
            + (self.tilted() + turned + square(drift)) * square(self.age)
            + self.walk
            + self.aside()
            + square(config.flow_scale / config.gate_sigmas) * gained
    }
}

/// The two of them, and the inertial samples that they have not used yet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reckoners {
    pair: [Reckoner; 2],
    /// Which of them is older.
    older: usize,
    /// The velocity of the estimate less theirs, at the end of the last block, m/s.
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

/// What has begun anew in a step.
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
    /// The one with this index, 0 or 1.
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

    /// The estimate's velocity less that of a reckoner, world NED, m/s.
    #[must_use]
    pub fn apart(&self, index: usize) -> Vec3 {
        let [first, second] = self.apart;
        if index == 0 { first } else { second }
    }

    /// Raw mean rate some 10 ms ago, which a picture that comes now shows, rad/s.
    #[must_use]
    pub fn turning(&self) -> Vec3 {
        (self.turns[0] + self.turns[1]) * 0.5
    }

    /// How fast that changes, rad/s².
    #[must_use]
    pub fn turning_change(&self) -> Vec3 {
        (self.turns[0] - self.turns[1]) / BLOCK
    }

    /// Has an estimate been seen?
    #[must_use]
    pub fn has_begun(&self) -> bool {
        self.has_begun
    }

    /// Both begin anew with this estimate. `stood`: of a vehicle that stands.
    pub fn begin(&mut self, estimate: &StateEstimate, sigmas: Sigmas, stood: bool) {
        self.pair = [Reckoner { stood, ..Reckoner::new(estimate, sigmas) }; 2];
        self.apart = [Vec3::zeros(); 2];
        (self.elapsed, self.rate, self.force) = Default::default();
        (self.older, self.has_begun) = (1, true);
    }

    /// Takes inertial samples and the estimate that followed from them, which is so uncertain. A force
    /// beyond `clips` along any axis, m/s², may have been larger than it reads.
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
            // A sample that is no number says nothing about its time.
            if !(data.accel.norm_squared() + data.gyro.norm_squared()).is_finite() {
                continue;
            }
            gap |= data.accel.iter().any(|force| force.abs() > clips);
            self.elapsed += dt;
            self.rate += data.gyro * dt;
            self.force += data.accel * dt;
        }
        if gap {
            // What the vehicle did meanwhile is not known.
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

    /// Steps through these seconds of samples that a function of time gives, with an estimate that is
    /// another one. How often did one begin anew?
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

    /// A vehicle that turns about x at this rate and pushes along its own axis with its weight.
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
            // Its thrust leans with it.
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
