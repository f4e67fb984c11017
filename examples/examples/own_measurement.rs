//! A sensor that the estimator does not know: distances to two radio beacons, a fifth of a second late. For `docs/guide/estimator.md`.
//!
//! The vehicle stands three metres from where its estimator believes it to be. The distances put it right.

use stampfly_eskf::filter::{NominalState, POSITION};
use stampfly_eskf::{Eskf, EskfConfig, Estimator, Fusion, StartHeading, aid::Row};
use stampfly_types::messages::{CalibrationResult, ImuData};
use stampfly_types::{Duration, GRAVITY, Instant, Vec3};

/// Where the beacons stand, m.
const BEACONS: [Vec3; 2] = [Vec3::new(40.0, 0.0, -2.0), Vec3::new(0.0, 30.0, -2.0)];
/// Where the vehicle stands, m. It believes to be at the origin.
const TRUTH: Vec3 = Vec3::new(1.5, -2.6, 0.0);
/// How exact a distance is, m.
const SIGMA: f32 = 0.3;
const LATE: Duration = Duration::from_millis(200);

// ANCHOR: model
/// Predicted reading in this state, and its derivatives by position.
fn distance(state: &NominalState, beacon: Vec3) -> [Row; 1] {
    let away = state.position - beacon;
    let distance = away.norm().max(0.1);
    let [north, east, down] = [away.x / distance, away.y / distance, away.z / distance];
    [Row::new(distance, [(POSITION, north), (POSITION + 1, east), (POSITION + 2, down)])]
}
// ANCHOR_END: model

fn main() {
    let start_heading = StartHeading::Given { heading: 0.0, sigma: 0.02 };
    let mut eskf = Eskf::new(EskfConfig { start_heading, initial_position: 3.0, ..EskfConfig::outdoors() });
    let still = Vec3::new(0.0, 0.0, -GRAVITY);
    eskf.initialize(Instant::ZERO, &CalibrationResult { specific_force: still, complete: true, ..Default::default() });

    let (mut used, mut left_out) = (0, 0);
    for step in 1..=2_000u64 {
        let now = Instant::from_micros(step * 5_000);
        eskf.predict(now, &ImuData { accel: still, ..Default::default() });
        if step % 20 == 0 && step > 60 {
            let beacon = BEACONS[usize::from(step % 40 == 0)];
            let reading = (TRUTH - beacon).norm();
            // ANCHOR: fuse
            // The time at which the distance was measured.
            let at = Instant::from_micros(now.as_micros() - LATE.as_micros());
            match eskf.fuse(at, |state| distance(state, beacon), [reading], [SIGMA * SIGMA], 5.0) {
                Fusion::Refused(reason) => println!("refused: {reason:?}"),
                answer if answer.is_fused() => used += 1,
                _ => left_out += 1,
            }
            // ANCHOR_END: fuse
        }
        if step % 400 == 0 {
            let away = eskf.estimate().position - TRUTH;
            println!(
                "{:2.0} s: {:.2} m off, {used} distances used, {left_out} left out",
                now.seconds_f64(),
                away.horizontal().norm()
            );
        }
    }
    assert!(used > 80, "the beacons were heard");
    assert!((eskf.estimate().position - TRUTH).horizontal().norm() < 0.3, "it knows where it stands");
}
