//! Three rate loops, mixer and motor stage, 80 steps at a time; prints the median of so many times, ns a step.
use std::hint::black_box;
use std::time::Instant as Watch;
use stampfly_control::rate::{RateConfig, RateController};
use stampfly_control::{Mixer, MotorConfig, MotorStage, MultirotorMixer};
use stampfly_types::{Vec3, messages::ControlOutput};

fn main() {
    let (rate, mixer, motors) = parts();
    let (mut rate, mut motors) = (RateController::new(&rate), MotorStage::new(&motors));
    let inputs: Vec<[Vec3; 2]> = (0..1_600).map(|k| [rates(k as f32), rates(k as f32 - 12.0)]).collect();
    let (mut unmet, mut k, mut times) = ([0.0; 4], 0usize, Vec::new());
    for _ in 0..4_000 {
        let begun = Watch::now();
        for _ in 0..80 {
            let [target, measured] = black_box(inputs[k % inputs.len()]);
            k += 1;
            let torque = rate.step(&target, &measured, 0.0025, unmet, HELD);
            let mixed = mixer.mix(&ControlOutput { thrust: HOVER, torque });
            unmet = mixed.unmet;
            black_box(motors.step(at(2_500 * k as u64), &mixed, Some(VOLTAGE), true));
        }
        times.push(begun.elapsed().as_nanos() as f64 / 80.0);
    }
    times.sort_by(f64::total_cmp);
    println!("{}", times[times.len() / 2]);
}

/// A vehicle that sways, rad/s.
fn rates(k: f32) -> Vec3 {
    let angle = k * std::f32::consts::TAU / 1_600.0;
    Vec3::new(0.3 * angle.sin(), 0.2 * (2.0 * angle).sin(), 0.1 * (3.0 * angle).cos())
}
