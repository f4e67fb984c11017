//! A stranger's program: an estimator standing on a table.

use stampfly_eskf::{Eskf, EskfConfig, Estimator};
use stampfly_types::messages::{CalibrationResult, ImuData, Validity};
use stampfly_types::{GRAVITY, Instant, Vec3};

fn main() {
    let accel = Vec3::new(0.0, 0.0, -GRAVITY);
    let mut eskf = Eskf::new(EskfConfig::default());
    eskf.initialize(Instant::ZERO, &CalibrationResult { specific_force: accel, complete: true, ..Default::default() });
    for step in 1..=400 {
        eskf.predict(Instant::from_micros(step * 2_500), &ImuData { accel, ..Default::default() });
    }
    let estimate = eskf.estimate();
    assert!(estimate.valid.contains(Validity::TILT) && estimate.velocity.norm() < 0.01, "{estimate:?}");
}
