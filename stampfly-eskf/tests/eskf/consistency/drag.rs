//! A multirotor whose velocity is not measured: information from drag.

use stampfly_eskf::{Eskf, EskfConfig, Estimator};
use stampfly_types::messages::{CalibrationResult, EstimatorCommand, ImuData, TofData, Validity};
use stampfly_types::{GRAVITY, Instant, Vec3};

const DT: u64 = 2_500;
/// Drag of the vehicle, 1/s.
const DRAG: f32 = 0.4;

/// Hovers level for ten seconds, with an initial velocity of 1.5 m/s north. Returns the true and
/// the estimated velocity, and the validity. The filter starts in the air with an unknown velocity.
fn hovers(believed: f32, flying: bool, tilt: f32) -> (f32, Vec3, Validity) {
    let mut eskf = Eskf::new(EskfConfig { drag: believed, ..EskfConfig::default() });
    let still = Vec3::new(0.0, 0.0, -GRAVITY);
    let calibration = CalibrationResult { specific_force: still, complete: true, ..Default::default() };
    eskf.initialize(Instant::ZERO, &calibration);
    eskf.command(Instant::ZERO, &EstimatorCommand { flying, full_resets: 1, ..Default::default() });
    let mut velocity = 1.5f32;
    for step in 1..=4_000u64 {
        let drag = -DRAG * velocity;
        // A tilt that the filter does not know accelerates the vehicle.
        velocity += (drag + GRAVITY * tilt) * 1e-6 * DT as f32;
        if step % 13 == 0 {
            _ = eskf.fuse_tof(
                Instant::from_micros(step * DT),
                &TofData { distance: 0.8, valid: true, ..Default::default() },
            );
        }
        eskf.predict(
            Instant::from_micros(step * DT),
            &ImuData { accel: still + Vec3::x() * drag, ..Default::default() },
        );
    }
    let estimate = eskf.estimate();
    (velocity, estimate.velocity, estimate.valid)
}

#[test]
fn drag_shows_the_velocity_of_a_vehicle_that_drifts() {
    let (truth, estimated, valid) = hovers(DRAG, true, 0.02);
    assert!(truth > 0.4, "it drifts at {truth} m/s");
    assert!((estimated.x - truth).abs() < 0.2 && estimated.y.abs() < 0.1, "{estimated:?}, truth {truth}");
    assert!(valid.contains(Validity::VELOCITY_XY) && !valid.contains(Validity::POSITION_XY), "good enough to brake");
}

#[test]
fn half_or_twice_the_drag_shows_the_direction() {
    for believed in [0.5 * DRAG, 2.0 * DRAG] {
        let (truth, estimated, _) = hovers(believed, true, 0.02);
        assert!((0.3..2.5).contains(&(estimated.x / truth)), "{believed}: {estimated:?}, truth {truth}");
    }
}

#[test]
fn without_drag_or_in_a_hand_no_velocity_is_claimed() {
    for (believed, flying) in [(0.0, true), (DRAG, false)] {
        let (_, _, valid) = hovers(believed, flying, 0.0);
        assert!(!valid.intersects(Validity::VELOCITY_XY | Validity::POSITION_XY), "{believed} {flying}");
    }
}
