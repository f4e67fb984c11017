//! Does the picture of the floor share a jump of the gyro's?
//!
//! A gyro whose zero jumps turns the estimated attitude, and whoever controls the estimated rate turns the body the other way: at
//! 1 rad/s it lies on its side after a second. Flow notices, but only as a velocity that the accelerometer did not feel, and it
//! can as well be flow that is wrong.
//!
//! At the jump itself it is clear whose it is. What a blow or a manoeuvre turns shows in the picture, too, and a velocity that
//! comes with it is felt; what only the gyro tells is its own. So the rate of the picture that neither rotation nor velocity
//! explains is compared: before the jump, and over [`READINGS`] readings from then on, with a velocity in which flow had no
//! part since.
//!
//! | where | a jump is the gyro's when |
//! |---|---|
//! | above 0.15 m | the picture does not share it, [`ALONG`] and [`ACROSS`] |
//! | standing, or leaving the floor | the picture does not share it, or no blow is felt with it ([`FELT`]): a tilt about a leg leaves the picture where it is |
//! | elsewhere below 0.15 m | never: landing makes jumps, and an error of the velocity looks like a rate |
//!
//! Not for a zero that drifts, which the filter estimates, nor for the yaw rate, which a picture in its middle does not show.

use stampfly_types::math::larger;
use stampfly_types::messages::{CalibrationResult, ImuData};
use stampfly_types::{Duration, Instant, Vec3};

/// A change of the rate from two samples to the next two is a jump when it is larger than this, rad/s, and
const JUMP: f32 = 0.35;
/// than so many root mean squares of its change from sample to sample.
const NOISE: f32 = 4.0;
/// Readings on which a verdict rests: 50 ms, in which a jump of 1 rad/s makes a tilt of 3°, and twice as many for a jump that is smaller
/// than this, rad/s.
const READINGS: u32 = 5;
const SMALL: f32 = 0.6;
/// If there are not as many after this time, there is no verdict.
const PATIENCE: Duration = Duration::from_millis(170);
/// Time constant of the mean before a jump, s.
const BEFORE: f32 = 0.2;
/// Share of the jump that the picture has to lack along the jump's direction, and may lack across: a reading of 10 ms is
/// uncertain by 0.2 rad/s, and one that holds a frame too much by 65 % of its rate.
const ALONG: core::ops::Range<f32> = 0.6..1.5;
const ACROSS: f32 = 0.6;
/// A jump happens within a sample: the changes before and after it are smaller than this share of it.
const FLAT: f32 = 0.5;
/// Nor do they make as much of it together, along it: a ramp with one sample that is noisy does.
const RAMP: f32 = 0.4;
/// A blow that turns a vehicle on a leg changes the specific force by more than this for each rad/s, m/s²: the leg is 3 cm
/// away, and 3 cm/s in 2.5 ms are 12 m/s².
const FELT: f32 = 6.0;
/// Readings keep telling that it stands or leaves the floor, one in this time.
const LOW: Duration = Duration::from_millis(100);
/// Its square fades by this with each sample.
const BLOW_FADES: f32 = 0.6;

/// A jump that is the gyro's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GyroJump {
    /// About body x and y, rad/s.
    pub rate: [f32; 2],
    /// How long ago, s.
    pub age: f32,
    /// The velocity without flow's part since, world, m/s.
    pub velocity: Vec3,
}

/// How near the floor is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Near {
    /// The vehicle stands on it.
    Standing,
    /// So near that an error of the velocity looks like a rate.
    Above,
    /// Neither.
    Far,
}

/// A jump that is being examined.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Examination {
    since: Instant,
    jump: [f32; 2],
    /// Velocity at the jump and the integral of the acceleration since, world.
    velocity: Vec3,
    sum: [f32; 2],
    readings: u32,
}

/// The last samples, and the jump that is being examined.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct GyroMonitor {
    /// About body x and y, newest first.
    rates: [[f32; 2]; 4],
    accel: Vec3,
    /// Largest square of a change of the specific force between samples, over the last four or so.
    blow: f32,
    /// Mean of what the gyro's rate is larger by than the picture makes it.
    before: [f32; 2],
    /// When it last stood, or was leaving the floor.
    low: Instant,
    examination: Option<Examination>,
}

impl GyroMonitor {
    /// Of a vehicle that stood still.
    pub(super) fn new(at: Instant, calibration: &CalibrationResult) -> Self {
        let bias = [calibration.gyro_bias.x, calibration.gyro_bias.y];
        Self { rates: [bias; 4], accel: calibration.specific_force, before: bias, low: at, ..Self::default() }
    }

    /// Takes a sample with its biases, `dt` seconds after the last: the mean square of the rate's change from sample to sample,
    /// the velocity and its change by what the accelerometer felt, world. Gives a jump that was the gyro's own.
    #[inline]
    pub(super) fn predict(
        &mut self,
        at: Instant,
        dt: f32,
        imu: &ImuData,
        noise: f32,
        velocity: &Vec3,
        change: &Vec3,
    ) -> Option<GyroJump> {
        self.rates = [[imu.gyro.x, imu.gyro.y], self.rates[0], self.rates[1], self.rates[2]];
        let blow = (imu.accel - self.accel).norm_squared();
        self.accel = imu.accel;
        self.blow = larger(blow, self.blow * BLOW_FADES);
        let [a, b, c, d] = self.rates;
        // Of the last two to the two before.
        let jump = [0.5 * (a[0] + b[0] - c[0] - d[0]), 0.5 * (a[1] + b[1] - c[1] - d[1])];
        let size = squared(jump);
        if let Some(examination) = &mut self.examination {
            examination.velocity += change;
            if at.since(examination.since) > PATIENCE {
                self.examination = None;
            }
            return None;
        }
        if size < JUMP * JUMP + NOISE * NOISE * noise {
            return None;
        }
        // Torque takes a motor's time to come, so that it makes a ramp.
        let [before, after] = [[c[0] - d[0], c[1] - d[1]], [a[0] - b[0], a[1] - b[1]]];
        let ramp = (before[0] + after[0]) * jump[0] + (before[1] + after[1]) * jump[1];
        if squared(before) + squared(after) > FLAT * FLAT * size || ramp > RAMP * size {
            return None;
        }
        let age = 1.5 * dt;
        if at.since(self.low) < LOW && self.blow < FELT * FELT * size {
            return Some(self.own(jump, age, *velocity));
        }
        let since = at - Duration::from_micros((age * 1e6) as u64);
        self.examination = Some(Examination { since, jump, velocity: *velocity, sum: [0.0; 2], readings: 0 });
        None
    }

    fn own(&mut self, jump: [f32; 2], age: f32, velocity: Vec3) -> GyroJump {
        self.before = [self.before[0] + jump[0], self.before[1] + jump[1]];
        // It is not found again.
        let [a, b, ..] = self.rates;
        self.rates = [a, b, b, b];
        GyroJump { rate: jump, age, velocity }
    }

    /// The velocity that a reading is to be compared with, for a filter that believes in this one.
    pub(super) fn velocity(&self, believed: Vec3) -> Vec3 {
        self.examination.map_or(believed, |examination| examination.velocity)
    }

    /// Takes a reading that began at `from`: by how much, rad/s, the gyro's rate about body x and y is larger than the picture
    /// and [`velocity`](Self::velocity) make it. `near` is `None` where the
    /// picture says nothing. Gives a jump that was the gyro's own.
    pub(super) fn flow(
        &mut self,
        now: Instant,
        from: Instant,
        interval: f32,
        excess: [f32; 2],
        near: Option<Near>,
    ) -> Option<GyroJump> {
        let leaves = now.since(self.low) < LOW;
        match near {
            Some(Near::Standing) => self.low = now,
            Some(Near::Above) if leaves => self.low = now,
            _ => {}
        }
        if !matches!(near, Some(Near::Standing | Near::Far)) {
            self.examination = None;
            return None;
        }
        let Some(examination) = &mut self.examination else {
            let share = interval / (BEFORE + interval);
            self.before[0] += (excess[0] - self.before[0]) * share;
            self.before[1] += (excess[1] - self.before[1]) * share;
            return None;
        };
        if from < examination.since {
            return None;
        }
        examination.sum[0] += excess[0];
        examination.sum[1] += excess[1];
        examination.readings += 1;
        let needed = if squared(examination.jump) < SMALL * SMALL { 2 * READINGS } else { READINGS };
        if examination.readings < needed {
            return None;
        }
        let Examination { since, jump, velocity, sum, readings } = *examination;
        self.examination = None;
        let lacks = [sum[0] / readings as f32 - self.before[0], sum[1] / readings as f32 - self.before[1]];
        let scale = 1.0 / squared(jump);
        let along = (lacks[0] * jump[0] + lacks[1] * jump[1]) * scale;
        let across = (lacks[0] * jump[1] - lacks[1] * jump[0]) * scale;
        let own = ALONG.contains(&along) && across.abs() < ACROSS;
        own.then(|| self.own(jump, now.since(since).seconds(), velocity))
    }
}

fn squared([x, y]: [f32; 2]) -> f32 {
    x * x + y * y
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::math;

    const DT: f32 = 0.0025;
    const GRAVITY: Vec3 = Vec3::new(0.0, 0.0, -9.81);

    /// A tenth of a second of samples and readings. `rate` and `turning` say what the gyro and the body do after so many
    /// samples, rad/s about x; `blow` is a specific force beside gravity.
    fn seen(near: Near, rate: fn(u64) -> f32, turning: fn(u64) -> f32, blow: fn(u64) -> f32) -> Option<GyroJump> {
        let calibration = CalibrationResult { specific_force: GRAVITY, ..Default::default() };
        let mut monitor = GyroMonitor::new(Instant::ZERO, &calibration);
        // Long enough above the floor to have left it.
        for n in 1..400u64 {
            let at = Instant::from_micros(n * 2_500);
            let late = n.saturating_sub(200);
            let imu = ImuData {
                accel: GRAVITY + Vec3::new(blow(late), 0.0, 0.0),
                gyro: Vec3::new(rate(late), 0.0, 0.0),
                ..Default::default()
            };
            let jump = monitor.predict(at, DT, &imu, 0.0, &Vec3::zeros(), &Vec3::zeros());
            let jump = jump.or_else(|| {
                let from = at - Duration::from_millis(14);
                // Within a count of what it is.
                let count = if n % 8 == 0 { 0.1 } else { -0.1 };
                let picture = (3..7).map(|k| turning(late.saturating_sub(k))).sum::<f32>() / 4.0;
                let gyro = (3..7).map(|k| rate(late.saturating_sub(k))).sum::<f32>() / 4.0;
                n.is_multiple_of(4)
                    .then(|| monitor.flow(at, from, 0.01, [gyro - picture + count, -count], Some(near)))
                    .flatten()
            });
            if jump.is_some() {
                return jump;
            }
        }
        None
    }

    const STEP: fn(u64) -> f32 = |n| if n > 0 { 1.0 } else { 0.0 };
    const NOTHING: fn(u64) -> f32 = |_| 0.0;

    #[test]
    fn a_jump_that_the_picture_does_not_share_is_the_gyros() {
        let jump = seen(Near::Far, STEP, NOTHING, NOTHING).expect("found");
        assert!((jump.rate[0] - 1.0).abs() < 0.05 && jump.rate[1].abs() < 0.05, "{jump:?}");
        assert!(jump.age < 0.08, "{jump:?}");
        // The body is turned the other way meanwhile.
        let reacts = |n: u64| -1.0 + math::exp(-0.05 * n as f32);
        assert!(seen(Near::Far, |n| if n > 0 { math::exp(-0.05 * n as f32) } else { 0.0 }, reacts, NOTHING).is_some());
    }

    #[test]
    fn a_blow_turns_the_picture_too() {
        assert_eq!(seen(Near::Far, STEP, STEP, NOTHING), None);
    }

    #[test]
    fn torque_makes_a_ramp_whatever_the_picture_says() {
        let ramp = |n: u64| (n as f32 * 0.2).min(3.0);
        assert_eq!(seen(Near::Far, ramp, NOTHING, NOTHING), None);
        // Two noisy samples are twice as far apart, as in a stick's step at twice the recorded vibration.
        let noisy = |n: u64| (n as f32 * 0.14).min(2.6) + if n > 4 { 0.16 } else { 0.0 };
        assert_eq!(seen(Near::Far, noisy, NOTHING, NOTHING), None);
    }

    #[test]
    fn above_the_floor_nothing_is_known_but_on_it_and_leaving_it_a_blow_is_felt() {
        // It was in the air before it came near.
        let mut monitor = GyroMonitor::default();
        monitor.flow(Instant::from_secs(1), Instant::ZERO, 0.01, [0.0; 2], Some(Near::Above));
        let imu = |rate: f32| ImuData { accel: GRAVITY, gyro: Vec3::new(rate, 0.0, 0.0), ..Default::default() };
        let found = (0..40u64).find_map(|n| {
            let at = Instant::from_micros(1_000_000 + n * 2_500);
            monitor.predict(at, DT, &imu(if n < 20 { 0.0 } else { 1.0 }), 0.0, &Vec3::zeros(), &Vec3::zeros())
        });
        assert_eq!(found, None);
        let jump = seen(Near::Standing, STEP, NOTHING, NOTHING).expect("found");
        assert!(jump.age < 0.01, "at once: {jump:?}");
        let kicked: fn(u64) -> f32 = |n| if (1..3).contains(&n) { 12.0 } else { 0.0 };
        assert_eq!(seen(Near::Standing, STEP, STEP, kicked), None);
    }
}
