//! Boats, planes and rovers never turn as fast as a hand: a field that stays constant while they
//! turn slowly must become the reference, too.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use stampfly_eskf::attitude::{AttitudeConfig, AttitudeFilter};
use stampfly_types::{GRAVITY, Vec3, math};

const DT: f32 = 0.01;
const EARTH: Vec3 = Vec3::new(20.0, 0.0, 40.0);
const BIAS: f32 = 0.004;

fn heading_error(filter: &AttitudeFilter, heading: f32) -> f32 {
    let forward = filter.attitude() * Vec3::new(1.0, 0.0, 0.0);
    math::wrap_angle(math::atan2(forward.y, forward.x) - heading)
}

/// Ten minutes of turning left and right by at most `rate`, rad/s, with a biased gyro. Returns the
/// remaining vertical bias, rad/s, the heading's standard deviation and its error, rad.
fn sailed(rate: f32, field: impl Fn(f32) -> Vec3) -> [f32; 3] {
    let [bias, sigma, error, ..] = swung(rate, 0.3, 0.0, field);
    [bias, sigma, error]
}

/// The same at this frequency, rad/s, with `noise` times the noise of a small sensor. Returns also
/// the largest error in the last five minutes, rad, and in standard deviations.
fn swung(rate: f32, frequency: f32, noise: f32, field: impl Fn(f32) -> Vec3) -> [f32; 5] {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut noisy = |value: Vec3, sigma: f32| {
        value
            + Vec3::from_fn(|_| {
                let normal: f32 = StandardNormal.sample(&mut random);
                sigma * noise * normal
            })
    };
    let [mut worst, mut worst_deviations] = [0.0f32; 2];
    let mut filter = AttitudeFilter::new(AttitudeConfig::default());
    let mut heading = 0.0f32;
    for step in 0..60_000u32 {
        let time = DT * step as f32;
        let turning = rate * math::sin(time * frequency);
        heading += turning * DT;
        let (sin, cos) = math::sin_cos(heading);
        let earth = field(time);
        let seen = Vec3::new(cos * earth.x + sin * earth.y, cos * earth.y - sin * earth.x, earth.z);
        let (force, gyro) = (Vec3::new(0.0, 0.0, -GRAVITY), Vec3::new(0.0, 0.0, turning + BIAS));
        filter.step(&noisy(force, 0.03), &noisy(gyro, 0.003), DT);
        _ = filter.field(&noisy(seen, 0.5), 0.0, DT);
        if time > 300.0 {
            let error = heading_error(&filter, heading).abs();
            worst = worst.max(error);
            worst_deviations = worst_deviations.max(error / filter.heading_sigma());
        }
    }
    let error = heading_error(&filter, heading);
    [filter.gyro_bias().z - BIAS, filter.heading_sigma(), error, worst, worst_deviations]
}

#[test]
fn a_body_that_turns_slowly_finds_its_vertical_bias() {
    for degrees in [17.0f32, 12.0, 10.0] {
        let [bias, sigma, error] = sailed(degrees.to_radians(), |_| EARTH);
        println!("{degrees} degrees/s: bias {bias}, heading {} ± {} degrees", error.to_degrees(), sigma.to_degrees());
        assert!(bias.abs() < 0.1 * BIAS, "{degrees} degrees/s: {bias} of {BIAS} rad/s are left");
        assert!(error.abs() < 0.3f32.to_radians(), "{degrees} degrees/s: heading {} degrees", error.to_degrees());
    }
}

#[test]
fn a_field_that_changes_while_it_turns_slowly_is_no_reference() {
    // It passes another hull every three seconds.
    let bent = |time: f32| EARTH * (1.0 + 0.15 * math::sin(time * 2.1));
    let [_, sigma, _] = sailed(17f32.to_radians(), bent);
    assert!(sigma.to_degrees() > 2.0, "{} degrees", sigma.to_degrees());
}

#[test]
fn turning_points_are_no_rest() {
    // Slower than the largest bias, for a part of the time or all of it: to gyro and accelerometer
    // the body is at rest.
    for (frequency, noise) in [1.0f32, 0.3, 0.1, 0.03].into_iter().flat_map(|f| [(f, 0.0), (f, 1.0)]) {
        for degrees in [10.0f32, 7.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0, 0.5] {
            let [_, sigma, _, worst, deviations] = swung(degrees.to_radians(), frequency, noise, |_| EARTH);
            let [worst, sigma] = [worst, sigma].map(f32::to_degrees);
            println!(
                "{degrees} degrees/s, {frequency} rad/s: at most {worst} degrees, {deviations} deviations; {sigma}"
            );
            let bar = if degrees >= 3.0 { 3.0 } else { 25.0 };
            assert!(
                worst < bar && deviations < 3.0,
                "{degrees} degrees/s at {frequency}, noise {noise}: {worst}, {deviations}"
            );
        }
    }
}

#[test]
fn a_magnet_that_passes_a_body_at_rest_does_not_end_what_the_rest_has_shown() {
    let mut filter = AttitudeFilter::new(AttitudeConfig::default());
    let mut worst = 0.0f32;
    for step in 0..12_000u16 {
        let time = DT * f32::from(step);
        filter.step(&Vec3::new(0.0, 0.0, -GRAVITY), &Vec3::new(0.0, 0.0, 0.01), DT);
        // Rotated by 20 degrees at the same strength and dip, for five seconds.
        let (sin, cos) = if (60.0..65.0).contains(&time) { math::sin_cos(0.35) } else { (0.0, 1.0) };
        _ = filter.field(&Vec3::new(cos * EARTH.x, sin * EARTH.x, EARTH.z), 0.0, DT);
        if time > 30.0 {
            worst = worst.max(heading_error(&filter, 0.0).abs());
        }
    }
    assert!((filter.gyro_bias().z - 0.01).abs() < 5e-4, "{} rad/s", filter.gyro_bias().z);
    assert!(worst.to_degrees() < 10.0, "{} degrees", worst.to_degrees());
}
