//! Limits of an optical flow camera: a floor that is too near, and one that passes too fast.

use stampfly_eskf::{Eskf, EskfConfig, Estimator, Fusion, Refusal};
use stampfly_types::messages::{CalibrationResult, EstimateCorrection, EstimatorCommand, FlowData, ImuData, TofData};
use stampfly_types::{GRAVITY, Instant, Vec3};

/// A filter that has stood and was then raised to this height, m; `flying`, or carried by a hand.
fn aloft(height: f32, flying: bool) -> (Eskf, Instant) {
    let mut eskf = Eskf::new(EskfConfig::default());
    let specific_force = Vec3::new(0.0, 0.0, -GRAVITY);
    eskf.command(Instant::ZERO, &EstimatorCommand { on_ground: true, ..EstimatorCommand::default() });
    eskf.initialize(
        Instant::ZERO,
        &CalibrationResult { specific_force, complete: true, ..CalibrationResult::default() },
    );
    let mut at = Instant::ZERO;
    for step in 1..=2_000u64 {
        at = Instant::from_micros(2_500 * step);
        // A working sensor never repeats itself.
        let dither = 1e-3 * ((step * 7_919 % 101) as f32 / 50.0 - 1.0);
        eskf.predict(at, &ImuData { accel: specific_force, temperature: 25.0, ..ImuData::default() });
        if step == 800 {
            eskf.command(at, &EstimatorCommand { flying, ..EstimatorCommand::default() });
        }
        let risen = (step.saturating_sub(800) as f32 / 800.0).min(1.0);
        if step.is_multiple_of(13) {
            let distance = 0.03 + (height - 0.03) * risen + dither;
            _ = eskf.fuse_tof(at, &TofData { distance, valid: true, ..TofData::default() });
        }
    }
    (eskf, at)
}

/// An image that moves at this rate about body y, rad/s.
fn picture(rate: f32) -> FlowData {
    FlowData { delta_x: 0.01 * rate, delta_y: 1e-5, interval: 0.01, quality: 100, valid: true }
}

#[test]
fn a_floor_that_is_too_near_is_not_seen_at_a_take_off() {
    let fusion = |height: f32, flying: bool| {
        let (mut eskf, at) = aloft(height, flying);
        eskf.fuse_flow(at, &picture(0.01))
    };
    assert_eq!(fusion(0.05, true), Fusion::Refused(Refusal::Range));
    assert!(!matches!(fusion(0.05, false), Fusion::Refused(_)), "a hand moves it slowly");
    assert!(!matches!(fusion(0.3, true), Fusion::Refused(_)));
}

#[test]
fn a_floor_that_comes_near_in_flight_is_still_seen() {
    let (mut eskf, mut at) = aloft(0.3, true);
    assert!(!matches!(eskf.fuse_flow(at, &picture(0.01)), Fusion::Refused(_)));
    for step in 1..=1_000u32 {
        at = Instant::from_micros(at.as_micros() + 2_500);
        let accel = Vec3::new(0.0, 0.0, -GRAVITY);
        eskf.predict(at, &ImuData { accel, temperature: 25.0, ..ImuData::default() });
        if step.is_multiple_of(13) {
            // To 5 cm in two seconds.
            let distance = 0.3 - 0.25 * (step as f32 / 800.0).min(1.0) + 1e-4 * (step % 7) as f32;
            _ = eskf.fuse_tof(at, &TofData { distance, valid: true, ..TofData::default() });
        }
    }
    let height = eskf.estimate().height;
    assert!((0.03..0.08).contains(&height), "{height} m");
    assert!(!matches!(eskf.fuse_flow(at, &picture(0.01)), Fusion::Refused(_)));
}

#[test]
fn a_picture_that_is_faster_than_the_camera_follows_is_not_used() {
    let fusion = |speed: f32, rate: f32| {
        let (mut eskf, at) = aloft(0.3, true);
        let velocity = Vec3::new(speed, 0.0, 0.0);
        eskf.correct(at, &EstimateCorrection { velocity, velocity_sigma: 0.05, ..EstimateCorrection::default() });
        // A correction clears the history: a waiting reading is compared with later samples.
        let mut now = at;
        for step in 1..=20u64 {
            now = Instant::from_micros(at.as_micros() + 2_500 * step);
            let accel = Vec3::new(0.0, 0.0, -GRAVITY);
            eskf.predict(now, &ImuData { accel, temperature: 25.0, ..ImuData::default() });
        }
        eskf.fuse_flow(now, &picture(rate))
    };
    // 3 m/s at 0.3 m are 10 rad/s, which alias.
    assert_eq!(fusion(3.0, 6.9), Fusion::Refused(Refusal::Range));
    assert!(!matches!(fusion(1.5, 5.0), Fusion::Refused(_)), "5 rad/s are seen");
    assert!(!matches!(fusion(3.0, 0.5), Fusion::Refused(_)), "a contradiction is for the gate");
}
