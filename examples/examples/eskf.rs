//! Height and climb rate from a noisy accelerometer and a noisy range finder.

use stampfly_eskf::{Eskf, EskfConfig, Estimator};
use stampfly_types::messages::{CalibrationResult, ImuData, TofData};
use stampfly_types::{GRAVITY, Instant, Vec3, math};

/// A vehicle that goes up and down: height and climb rate, and upward acceleration.
fn truth(seconds: f32) -> (f32, f32, f32) {
    const RATE: f32 = 1.5;
    let (sin, cos) = math::sin_cos(RATE * seconds);
    (0.8 - 0.4 * cos, 0.4 * RATE * sin, 0.4 * RATE * RATE * cos)
}

/// Noise that is the same on every machine: a linear congruential generator, −1 to 1.
fn noise(state: &mut u32) -> f32 {
    *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    (*state >> 8) as f32 / 8_388_608.0 - 1.0
}

fn main() {
    let mut random = 1;
    let mut eskf = Eskf::new(EskfConfig::default());
    let still = Vec3::new(0.0, 0.0, -GRAVITY);
    eskf.initialize(Instant::ZERO, &CalibrationResult { specific_force: still, complete: true, ..Default::default() });

    println!("  time    height  estimate     error     climb  estimate");
    let (mut squares, mut count) = (0.0, 0.0);
    for step in 1..=20 * 400u64 {
        let at = Instant::from_micros(step * 2_500);
        let (height, climb, acceleration) = truth(at.since(Instant::ZERO).seconds());
        // Specific force is what is felt: thrust up is negative z in the body frame.
        let felt = -GRAVITY - acceleration + 0.3 * noise(&mut random);
        eskf.predict(at, &ImuData { accel: Vec3::new(0.0, 0.0, felt), ..Default::default() });
        if step % 13 == 0 {
            let distance = height + 0.02 * noise(&mut random);
            _ = eskf.fuse_tof(at, &TofData { distance, valid: true, ..Default::default() });
        }
        let estimate = eskf.estimate();
        if step > 2_000 {
            squares += (estimate.height - height) * (estimate.height - height);
            count += 1.0;
        }
        if step % 800 == 0 {
            println!(
                "{:5.1} s {height:8.3} m {:7.3} m {:8.1} mm {climb:6.2} m/s {:6.2} m/s",
                at.seconds_f64(),
                estimate.height,
                (estimate.height - height) * 1e3,
                -estimate.velocity.z,
            );
        }
    }
    println!("root of the mean squared error after 5 s: {:.1} mm", 1e3 * math::sqrt(squares / count));
}
