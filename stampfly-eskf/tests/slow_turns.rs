//! Boats, planes and rovers may never turn as fast as a hand does: a field that stays the same while they turn slowly is the
//! reference all the same.

use stampfly_eskf::attitude::{AttitudeConfig, AttitudeFilter};
use stampfly_types::{GRAVITY, Vec3, math};

const DT: f32 = 0.01;
const EARTH: Vec3 = Vec3::new(20.0, 0.0, 40.0);
const BIAS: f32 = 0.004;

/// Ten minutes of turning left and right by at most `rate`, rad/s, with a biased gyro: what is left of the bias about the
/// vertical, rad/s, the heading's deviation and its error, rad.
fn sailed(rate: f32, field: impl Fn(f32) -> Vec3) -> [f32; 3] {
    let mut filter = AttitudeFilter::new(AttitudeConfig::default());
    let mut heading = 0.0f32;
    for step in 0..60_000u32 {
        let time = DT * step as f32;
        let turning = rate * math::sin(time * 0.3);
        heading += turning * DT;
        let (sin, cos) = math::sin_cos(heading);
        let earth = field(time);
        let seen = Vec3::new(cos * earth.x + sin * earth.y, cos * earth.y - sin * earth.x, earth.z);
        filter.step(&Vec3::new(0.0, 0.0, -GRAVITY), &Vec3::new(0.0, 0.0, turning + BIAS), DT);
        _ = filter.field(&seen, 0.0, DT);
    }
    let forward = filter.attitude() * Vec3::new(1.0, 0.0, 0.0);
    let error = math::wrap_angle(math::atan2(forward.y, forward.x) - heading);
    [filter.gyro_bias().z - BIAS, filter.heading_sigma(), error]
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
    // Every three seconds it passes another hull.
    let bent = |time: f32| EARTH * (1.0 + 0.15 * math::sin(time * 2.1));
    let [_, sigma, _] = sailed(17f32.to_radians(), bent);
    assert!(sigma.to_degrees() > 2.0, "{} degrees", sigma.to_degrees());
}
