//! From any error within a box the filter recovers, or reports divergence, within a stated time.
//!
//! The box, at one instant of a flight with the modelled sensor noise:
//!
//! | error | up to |
//! |---|---|
//! | tilt | 60°, about any horizontal axis |
//! | velocity | 3 m/s along each axis |
//! | height | 1 m |
//! | gyro bias | 0.05 rad/s about each axis |
//! | accelerometer bias | 0.5 m/s² along each axis |
//!
//! The errors enter through the interface: a false still calibration, and a range from before a
//! jump. Recovered means permanently within [`LIMITS`].

use super::flight::{Flight, is_sound};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use stampfly_eskf::{Eskf, EskfConfig, Estimator};
use stampfly_types::messages::{EstimatorCommand, TofData};
use stampfly_types::{Instant, Quat, Vec3, math};

/// Tilt, velocity, height: rad, m/s, m. 0.07 rad of tilt correspond to the accelerometer bias of
/// the box.
const LIMITS: [f64; 3] = [0.1, 0.3, 0.1];
/// Time until recovery or report, s: always, in 95 of 100 cases, in every second case.
const WITHIN: f64 = 12.0;
const MOST_WITHIN: f64 = 6.0;
const HALF_WITHIN: f64 = 3.0;
/// Duration of the observation, s.
const WATCHED: f64 = 15.0;

#[derive(Clone, Copy, Debug)]
struct Wrong {
    tilt: f32,
    direction: f32,
    velocity: [f64; 3],
    height: f32,
    gyro_bias: [f32; 3],
    accel_bias: [f32; 3],
}

/// Time until the estimate was permanently right, and time until it reported divergence, s.
fn recovery(wrong: &Wrong, seed: u64) -> (f64, Option<f64>) {
    let mut flight = Flight::new(Instant::from_secs(100), seed);
    flight.extra = wrong.velocity.into();
    let mut calibration = flight.calibration();
    let (sin, cos) = math::sin_cos(wrong.direction);
    let axis = Vec3::new(cos, sin, 0.0);
    calibration.specific_force = Quat::from_scaled_axis(axis * wrong.tilt) * calibration.specific_force;
    flight.gyro_bias = Vec3::from(wrong.gyro_bias);
    flight.accel_bias = Vec3::from(wrong.accel_bias);
    let mut eskf = Eskf::new(EskfConfig::default());
    eskf.initialize(flight.start, &calibration);
    eskf.command(flight.start, &EstimatorCommand { flying: true, ..EstimatorCommand::default() });
    // The wrong tilt would make the filter refuse a range: feed one that fits it.
    let cos_tilt = eskf.nominal().cos_tilt();
    let range = flight.tof(flight.start);
    let distance = (range.distance + wrong.height) / cos_tilt.max(0.8);
    _ = eskf.fuse_tof(flight.start, &TofData { distance, ..range });

    let (mut wrong_at, mut lost_at) = (0.0, None);
    for step in 1..=(WATCHED * 400.0) as u64 {
        flight.feed(&mut eskf, step);
        let time = step as f64 / 400.0;
        if flight.errors(&eskf, flight.at(step)).iter().zip(LIMITS).any(|(error, limit)| *error > limit) {
            wrong_at = time;
        }
        if eskf.status().diverged {
            lost_at.get_or_insert(time);
        }
    }
    assert!(is_sound(&eskf), "{wrong:?}");
    (wrong_at, lost_at)
}

fn box_of_errors() -> impl Strategy<Value = Wrong> {
    let each = |bound: f32| prop::array::uniform3(-bound..bound);
    let fast = prop::array::uniform3(-3.0..3.0);
    (0.0f32..1.047, 0.0..2.0 * math::PI, fast, -1.0f32..1.0, each(0.05), each(0.5)).prop_map(
        |(tilt, direction, velocity, height, gyro_bias, accel_bias)| Wrong {
            tilt,
            direction,
            velocity,
            height,
            gyro_bias,
            accel_bias,
        },
    )
}

#[test]
fn any_error_of_the_box_is_corrected_or_reported_as_divergence() {
    let mut runner = TestRunner::deterministic();
    let mut times: Vec<f64> = (0..500)
        .map(|seed| {
            let wrong = box_of_errors().new_tree(&mut runner).expect("a draw").current();
            let (wrong_until, lost_at) = recovery(&wrong, seed);
            // After a report of divergence, recovery is not required.
            let told = lost_at.map_or(wrong_until, |at| wrong_until.min(at));
            assert!(told <= WITHIN, "wrong until {wrong_until} s, reported lost at {lost_at:?}: {wrong:?}");
            told
        })
        .collect();
    times.sort_by(f64::total_cmp);
    let share = |of: f64| times[(of * times.len() as f64) as usize];
    println!("median {} s, 75 % {} s, 95 % {} s, worst {} s", share(0.5), share(0.75), share(0.95), times[499]);
    assert!(share(0.5) <= HALF_WITHIN, "half within {} s", share(0.5));
    assert!(share(0.95) <= MOST_WITHIN, "95 % within {} s", share(0.95));
}
