//! What an estimator is told before the first sample of a recording: gravity, biases, field, heading.
//!
//! A recording that begins at rest gives all of it, the gyro's bias included. One that begins in a moving hand gives
//! a direction of gravity and nothing else; its calibration says so by not being `complete`.

use crate::dataset::{Kind, Recording};
use stampfly_eskf::attitude_from_specific_force;
use stampfly_types::messages::CalibrationResult;
use stampfly_types::{Duration, Instant, Quat, Vec3, frame, math};

/// Rest as long as this is a still-calibration.
const STILL: Duration = Duration::from_millis(700);
/// The rest must begin this soon.
const SEARCH: Duration = Duration::from_millis(1_000);
/// A hand trembles by 20 mrad/s and more, the sensors' noise is below 2 mrad/s and 20 mm/s².
const STILL_RATE: f32 = 0.006;
const STILL_FORCE: f32 = 0.08;
/// A bias larger than this is a steady turn.
const LARGEST_BIAS: f32 = 0.1;
/// Without rest: the time over which gravity is averaged.
const GLANCE: Duration = Duration::from_millis(250);

/// Where and how an estimator starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// The instant before the first sample that is used.
    pub at: Instant,
    /// What is known by then. `complete` when the vehicle was at rest.
    pub calibration: CalibrationResult,
    /// Heading of the body at `at` in the recording's world. Estimators start at heading zero; their results are
    /// turned by this before anybody compares them.
    pub heading: f32,
}

/// Mean and standard deviation per axis.
fn moments(values: impl Iterator<Item = Vec3> + Clone) -> (Vec3, Vec3) {
    let count = values.clone().count().max(1) as f32;
    let mean = values.clone().sum::<Vec3>() / count;
    let variance = values.map(|value| (value - mean).component_mul(&(value - mean))).sum::<Vec3>() / count;
    (mean, variance.map(math::sqrt))
}

impl Start {
    /// The start of a recording, from its first second and a half.
    #[must_use]
    pub fn of(recording: &Recording) -> Self {
        let first = recording.imu.first().map_or(Instant::ZERO, |sample| sample.at);
        let candidates =
            (0..).map(|step| first + Duration::from_micros(step * 100_000)).take_while(|at| at.since(first) <= SEARCH);
        let rest = candidates.into_iter().find_map(|from| Some((from, rest_from(recording, from)?)));
        let (at, mut calibration) = rest.unwrap_or_else(|| (first, glance(recording, first)));
        let span = if calibration.complete { STILL } else { GLANCE };
        let within = |stamp: Instant| (at..at + span).contains(&stamp);
        let fields = recording.mag.iter().filter(|sample| within(sample.at)).map(|sample| sample.data.field);
        calibration.field = moments(fields).0;
        let ground = recording.baro.iter().find(|sample| sample.at >= at);
        calibration.baro_altitude = ground.map_or(0.0, |sample| sample.data.altitude);
        Self { at, calibration, heading: heading(recording, at, &calibration) }
    }
}

/// The calibration from a rest that begins at `from`; `None` when there is none.
fn rest_from(recording: &Recording, from: Instant) -> Option<CalibrationResult> {
    let end = from + STILL;
    let samples = || recording.imu.iter().filter(move |sample| (from..end).contains(&sample.at));
    if recording.imu.last()?.at < end || samples().count() < 20 {
        return None;
    }
    let (gyro_bias, rate_noise) = moments(samples().map(|sample| sample.data.gyro));
    let (specific_force, force_noise) = moments(samples().map(|sample| sample.data.accel));
    let still = rate_noise.amax() < STILL_RATE && force_noise.amax() < STILL_FORCE && gyro_bias.amax() < LARGEST_BIAS;
    still.then(|| CalibrationResult {
        gyro_bias,
        specific_force,
        progress: 1.0,
        complete: true,
        ..CalibrationResult::default()
    })
}

/// What the first moment of a moving recording tells.
fn glance(recording: &Recording, first: Instant) -> CalibrationResult {
    let samples = recording.imu.iter().take_while(|sample| sample.at.since(first) < GLANCE);
    let (specific_force, _) = moments(samples.map(|sample| sample.data.accel));
    CalibrationResult { specific_force, ..CalibrationResult::default() }
}

/// Heading in the recording's world: from magnetic north where the world is defined by it, otherwise as it was seen.
fn heading(recording: &Recording, at: Instant, calibration: &CalibrationResult) -> f32 {
    let [w, x, y, z] = attitude_from_specific_force(&calibration.specific_force);
    let level = Quat::new_unchecked(w, x, y, z);
    if recording.kind == Kind::Broad && calibration.field.horizontal().norm() > 1.0 {
        let field = level * calibration.field;
        return -math::atan2(field.y, field.x);
    }
    let seen = recording.truth.iter().filter(|point| point.at >= at).find_map(|point| point.attitude);
    // Not the difference of two headings: the body may start on its side.
    seen.map_or(0.0, |attitude| frame::yaw(&(attitude * level.inverse())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset;

    fn capture(rows: impl Iterator<Item = (f32, f32)>) -> Recording {
        let mut text = "timestamp_ms,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n".to_owned();
        for (n, (rate, force)) in rows.enumerate() {
            text += &format!("{},{rate},0.002,-0.003,{force},0,-9.8\n", n * 10);
        }
        dataset::parse("made up", text.as_bytes()).expect("a capture")
    }

    fn noise(n: usize) -> f32 {
        ((n * 7) % 13) as f32 * 1e-4
    }

    #[test]
    fn rest_gives_the_bias_of_the_gyro() {
        let start = Start::of(&capture((0..200).map(|n| (0.01 + noise(n), noise(n)))));
        assert!(start.calibration.complete);
        assert!((start.calibration.gyro_bias - Vec3::new(0.0106, 0.002, -0.003)).amax() < 1e-4);
        assert_eq!((start.at, start.heading), (Instant::ZERO, 0.0));
    }

    #[test]
    fn a_hand_gives_gravity_only() {
        let moving = (0..200).map(|n| (if n % 40 < 20 { 0.2 } else { -0.2 }, 0.5));
        let start = Start::of(&capture(moving));
        assert!(!start.calibration.complete && start.calibration.gyro_bias == Vec3::zeros());
        assert!((start.calibration.specific_force - Vec3::new(0.5, 0.0, -9.8)).amax() < 1e-4);
    }

    #[test]
    fn a_rest_that_begins_late_is_found() {
        let moving = (0..200).map(|n| if n < 55 { (0.3 - noise(n), 1.0) } else { (noise(n), noise(n)) });
        let start = Start::of(&capture(moving));
        assert!(start.calibration.complete && start.at == Instant::from_millis(600), "{start:?}");
    }

    #[test]
    fn three_samples_are_enough_to_start() {
        let start = Start::of(&capture((0..3).map(|n| (noise(n), 0.0))));
        assert!(!start.calibration.complete && start.calibration.specific_force.z < -9.0);
    }
}
