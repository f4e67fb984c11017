//! Samples that are finite but physically impossible.

use stampfly_eskf::{Eskf, EskfConfig, Estimator};
use stampfly_types::messages::{CalibrationResult, ImuData};
use stampfly_types::{Instant, Vec3};

/// Specific force of a level vehicle at rest, m/s².
const LEVEL: Vec3 = Vec3::new(0.0, 0.0, -9.81);

/// An estimator that starts level.
fn standing() -> Eskf {
    let mut eskf = Eskf::new(EskfConfig::default());
    eskf.initialize(Instant::ZERO, &CalibrationResult { specific_force: LEVEL, ..Default::default() });
    eskf
}

#[test]
fn an_inertial_sample_that_no_sensor_measures_is_refused() {
    for size in [2.0e4, 1e20, 1e37, f32::INFINITY, f32::NAN] {
        let mut eskf = standing();
        for step in 1..=20 {
            let huge = Vec3::new(size, -size, 0.0);
            let [accel, gyro] = if step % 2 == 0 { [huge, Vec3::zeros()] } else { [LEVEL, huge] };
            eskf.predict(Instant::from_micros(2_500 * step), &ImuData { accel, gyro, ..Default::default() });
        }
        assert_eq!(eskf.status().imu_refused, 20, "{size}");
        assert!(eskf.estimate().velocity.norm() < 0.1, "{size}: {:?}", eskf.estimate());
    }
}

/// The longest step of the filter is half a second.
#[test]
fn a_turn_of_many_revolutions_in_one_step_leaves_an_attitude() {
    let mut eskf = standing();
    for step in 1..=5 {
        let gyro = Vec3::new(-490.0, -35.0, -35.0);
        eskf.predict(Instant::from_millis(500 * step), &ImuData { accel: LEVEL, gyro, ..Default::default() });
        let length = eskf.nominal().attitude.iter().map(|part| part * part).sum::<f32>();
        assert!((length - 1.0).abs() < 1e-3, "step {step}: length {length}");
        assert!((0..15).all(|n| eskf.covariance().get(n, n).is_finite()), "step {step}");
    }
}

/// A user's model with a gate that accepts everything.
#[test]
fn a_measurement_that_would_leave_no_attitude_is_refused() {
    use stampfly_eskf::aid::Row;
    use stampfly_eskf::{Fusion, Refusal};
    for (measured, slope) in [(1e16, 1.0), (1e12, 1e-3), (1e9, 1.0), (0.01, 1.0)] {
        let mut eskf = standing();
        let at = Instant::from_millis(10);
        eskf.predict(at, &ImuData { accel: LEVEL, ..Default::default() });
        let model = |_: &_| [Row { predicted: 0.0, jacobian: [slope; 15] }];
        let fusion = eskf.fuse(at, model, [measured], [1e-3], f32::INFINITY);
        let estimate = eskf.estimate();
        let numbers = [estimate.attitude.norm_squared(), estimate.velocity.norm(), estimate.position.norm()];
        assert!(numbers.iter().all(|number| number.is_finite()), "{measured}: {fusion:?} {estimate:?}");
        assert_eq!(fusion == Fusion::Refused(Refusal::Implausible), measured > 1e6, "{measured}: {fusion:?}");
    }
}

/// Its square is infinite.
#[test]
fn a_standard_deviation_beyond_any_says_nothing() {
    use stampfly_types::Quat;
    let (far, nothing) = (Vec3::new(50.0, -50.0, 20.0), Vec3::new(3e19, 3e19, 3e19));
    let mut eskf = standing();
    for step in 1..=1_000 {
        let at = Instant::from_millis(5 * step);
        eskf.predict(at, &ImuData { accel: LEVEL, ..Default::default() });
        let fusions = [
            eskf.fuse_velocity(at, &far, &nothing),
            eskf.fuse_position(at, &far, &nothing),
            eskf.fuse_attitude(at, &Quat::new_unchecked(0.0, 1.0, 0.0, 0.0), 3e19),
        ];
        assert!((0..15).all(|n| eskf.covariance().get(n, n).is_finite()), "step {step}: {fusions:?}");
    }
    assert!(eskf.estimate().position.norm() < 1.0, "{:?}", eskf.estimate());
}

/// From an otherwise trusted source: after the lock-out the filter would be reset to it.
#[test]
fn a_place_or_speed_of_no_vehicle_is_refused_however_often_it_is_told() {
    use stampfly_eskf::{Fusion, Refusal};
    use stampfly_types::messages::FlowData;
    let mut eskf = standing();
    let sigma = Vec3::new(0.1, 0.1, f32::INFINITY);
    for step in 1..=1_000 {
        let at = Instant::from_millis(5 * step);
        eskf.predict(at, &ImuData { accel: LEVEL, ..Default::default() });
        if step < 100 {
            continue;
        }
        let far = Vec3::new(0.0, -1e28, 1e30);
        assert_eq!(eskf.fuse_velocity(at, &far, &sigma), Fusion::Refused(Refusal::Implausible));
        assert_eq!(eskf.fuse_position(at, &far, &sigma), Fusion::Refused(Refusal::Implausible));
        let flow = FlowData { delta_x: 1e38, delta_y: 0.0, interval: 0.01, quality: 200, valid: true };
        assert_eq!(eskf.fuse_flow(at, &flow), Fusion::Refused(Refusal::Range));
    }
    // An axis that is not measured may have any value.
    let down = Vec3::new(0.1, -0.1, 1e30);
    let at = Instant::from_millis(5_005);
    eskf.predict(at, &ImuData { accel: LEVEL, ..Default::default() });
    assert!(eskf.fuse_velocity(at, &down, &sigma).is_fused());
    assert!(eskf.estimate().position.norm() < 1.0, "{:?}", eskf.estimate());
}
