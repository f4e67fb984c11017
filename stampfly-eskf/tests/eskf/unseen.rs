//! Motion that sensors do not see, or see late: cases from recorded data.

use stampfly_eskf::{Eskf, EskfConfig, Estimator, Fusion};
use stampfly_types::messages::{CalibrationResult, EstimatorCommand, FlowData, ImuData, MagData, TofData, Validity};
use stampfly_types::{Duration, GRAVITY, Instant, Quat, Vec3, math};

/// Time between inertial samples, and the same in seconds.
const STEP: Duration = Duration::from_micros(2_500);
const DT: f32 = 0.0025;

fn started(config: EskfConfig) -> Eskf {
    let mut eskf = Eskf::new(config);
    let specific_force = Vec3::new(0.0, 0.0, -GRAVITY);
    let field = Vec3::new(20.0, 0.0, 40.0);
    eskf.initialize(Instant::ZERO, &CalibrationResult { specific_force, field, complete: true, ..Default::default() });
    eskf
}

/// Specific force at rest in this attitude.
fn force(attitude: &Quat) -> Vec3 {
    attitude.inverse() * Vec3::new(0.0, 0.0, -GRAVITY)
}

/// A working sensor never repeats itself: ±1, by the instant.
fn dither(at: Instant) -> f32 {
    (at.as_micros() / 2_500 * 7_919 % 101) as f32 / 50.0 - 1.0
}

fn flow(at: Instant, delta_x: f32, delta_y: f32) -> FlowData {
    let noise = 2e-5 * dither(at);
    FlowData { delta_x: delta_x + noise, delta_y: delta_y - noise, interval: 0.01, quality: 100, valid: true }
}

fn range(at: Instant, distance: f32) -> TofData {
    TofData { distance: distance + 0.5e-3 * dither(at), valid: true, ..TofData::default() }
}

#[test]
fn without_any_aid_a_biased_accelerometer_is_not_integrated_for_ever() {
    let mut eskf = started(EskfConfig::default());
    for step in 1..=400 * 300 {
        // 0.15 m/s² of bias along two axes: 6 km in five minutes.
        let accel = Vec3::new(0.15, 0.0, 0.15 - GRAVITY);
        eskf.predict(Instant::ZERO + STEP * step, &ImuData { accel, ..Default::default() });
    }
    let estimate = eskf.estimate();
    assert!(estimate.velocity.amax() < 1.0, "{:?}", estimate.velocity);
    assert!(!eskf.status().diverged && estimate.attitude.angle() < 0.03);
}

#[test]
fn a_height_that_nothing_measures_is_no_divergence_and_one_that_something_measured_is() {
    // Motors shift the accelerometer's vertical zero.
    let run = |ranges: u64, flying: bool| {
        let mut eskf = started(EskfConfig::indoors());
        eskf.command(Instant::ZERO, &EstimatorCommand { flying, ..EstimatorCommand::default() });
        for step in 1..=400 * 30u64 {
            let at = Instant::ZERO + STEP * step;
            let shaken = if step > 400 { 3.0 } else { 0.0 };
            eskf.predict(at, &ImuData { accel: Vec3::new(0.0, 0.0, shaken - GRAVITY), ..Default::default() });
            if step <= ranges && step % 13 == 0 {
                _ = eskf.fuse_tof(at, &range(at, 0.5));
            }
        }
        eskf
    };
    let unmeasured = run(0, false);
    let height = unmeasured.estimate().position.z;
    assert!(!unmeasured.status().diverged && height > 100.0, "nobody claimed {height} m");
    assert!(!unmeasured.estimate().valid.contains(Validity::POSITION_Z));
    assert!(run(400, false).status().diverged && run(0, true).status().diverged);
}

#[test]
fn tilted_out_of_sight_the_velocity_fades() {
    let mut eskf = started(EskfConfig::default());
    let mut at = Instant::ZERO;
    let mut fly = |eskf: &mut Eskf, seconds: f32, attitude: Quat, rate: Vec3| {
        for step in 0..(seconds / DT) as u32 {
            at += STEP;
            eskf.predict(at, &ImuData { accel: force(&attitude), gyro: rate, temperature: 25.0, ..Default::default() });
            if step % 4 == 0 {
                let distance = 0.5 / math::cos(stampfly_types::frame::tilt(&attitude));
                _ = eskf.fuse_tof(at, &range(at, distance));
                _ = eskf.fuse_flow(at, &flow(at, 0.01 * 0.3 / distance, -0.01 * rate.x));
            }
        }
    };
    fly(&mut eskf, 2.0, Quat::identity(), Vec3::zeros());
    assert!((eskf.estimate().velocity.x - 0.3).abs() < 0.02, "{:?}", eskf.estimate().velocity);
    // Rolled by 60° within a fifth of a second; gravity rotates with it.
    for tenth in 1..=10u8 {
        let roll = f32::from(tenth) * 0.1 * 1.05;
        fly(&mut eskf, 0.02, Quat::from_euler_angles(roll, 0.0, 0.0), Vec3::new(5.25, 0.0, 0.0));
    }
    let before = eskf.estimate().velocity.x;
    fly(&mut eskf, 0.8, Quat::from_euler_angles(1.05, 0.0, 0.0), Vec3::zeros());
    let after = eskf.estimate().velocity.x;
    assert!(before > 0.25 && after.abs() < 0.6 * before, "{before} m/s, then {after} m/s");
}

#[test]
fn rotation_is_taken_out_of_late_flow_at_the_time_it_was_seen() {
    // Rolling back and forth on the spot, ±3 rad/s twice a second, with flow that is 15 ms late.
    let speed_of = |delay: f32| {
        let mut eskf = started(EskfConfig { flow_delay: delay, ..EskfConfig::default() });
        let rate = |time: f32| if time > 0.5 { 3.0 * math::sin(4.0 * math::PI * (time - 0.5)) } else { 0.0 };
        let roll = |time: f32| (1.0 - math::cos(4.0 * math::PI * (time - 0.5).max(0.0))) * 3.0 / (4.0 * math::PI);
        let mut worst = 0.0f32;
        for step in 1..=800u64 {
            let (at, time) = (Instant::ZERO + STEP * step, step as f32 * DT);
            let attitude = Quat::from_euler_angles(roll(time), 0.0, 0.0);
            let gyro = Vec3::new(rate(time - 0.5 * DT), 0.0, 0.0);
            eskf.predict(at, &ImuData { accel: force(&attitude), gyro, temperature: 25.0, ..Default::default() });
            if step % 4 == 0 {
                _ = eskf.fuse_tof(at, &range(at, 0.5 / math::cos(roll(time))));
                _ = eskf.fuse_flow(at, &flow(at, 0.0, -0.01 * rate(time - 0.015 - 0.005)));
            }
            worst = worst.max(eskf.estimate().velocity.y.abs());
        }
        worst
    };
    let (known, ignored) = (speed_of(0.015), speed_of(0.0));
    assert!(known < 0.02 && ignored > 10.0 * known, "{known} m/s with the delay known, {ignored} m/s without");
}

#[test]
fn a_field_that_turned_for_good_does_not_cost_the_tilt() {
    let mut eskf = started(EskfConfig { mag_enable: true, ..EskfConfig::default() });
    let field = Quat::from_euler_angles(0.0, 0.0, 2.0) * Vec3::new(20.0, 0.0, 40.0);
    let mut gated = 0;
    for step in 1..=400 * 10u64 {
        let at = Instant::ZERO + STEP * step;
        eskf.predict(at, &ImuData { accel: Vec3::new(0.0, 0.0, -GRAVITY), ..Default::default() });
        if step % 4 == 0 {
            gated += u32::from(matches!(eskf.fuse_mag(at, &MagData { field }), Fusion::Gated { .. }));
        }
        let tilt = stampfly_types::frame::tilt(&eskf.estimate().attitude);
        assert!(tilt < 0.02, "{tilt} rad after {step} steps");
    }
    assert!(gated > 20, "first it is kept out");
    assert!((stampfly_types::frame::yaw(&eskf.estimate().attitude) + 2.0).abs() < 0.1, "then it is believed");
}
