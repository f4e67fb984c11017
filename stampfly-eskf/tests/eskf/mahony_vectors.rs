//! Mahony's filter against vectors computed independently in double precision.

use serde_json::Value;
use stampfly_eskf::attitude::Mahony;
use stampfly_types::{Quat, Vec3, frame};
use std::f64::consts::PI;

/// Largest difference of a quaternion's components, and of an angle in radians. Single precision
/// alone accounts for 1e-5.
const CLOSE: f64 = 3e-5;

fn vectors() -> Value {
    serde_json::from_str(include_str!("../vectors/mahony.json")).expect("valid JSON")
}

fn array<const N: usize>(value: &Value) -> [f64; N] {
    let numbers: Vec<f64> = value.as_array().expect("array").iter().map(|v| v.as_f64().expect("number")).collect();
    numbers.try_into().expect("as long as it should be")
}

fn filter(vectors: &Value) -> Mahony {
    Mahony::new(vectors["kp"].as_f64().expect("gain") as f32)
}

fn vector([x, y, z]: [f64; 3]) -> Vec3 {
    Vec3::new(x as f32, y as f32, z as f32)
}

fn assert_close(attitude: &Quat, sample: &Value, what: &str) {
    let ours = attitude.wxyz().map(f64::from);
    let theirs = array::<4>(&sample["q"]);
    let sign = ours.iter().zip(&theirs).map(|(a, b)| a * b).sum::<f64>().signum();
    for (a, b) in ours.iter().zip(&theirs) {
        assert!((a - sign * b).abs() < CLOSE, "{what}: {ours:?} against {theirs:?}");
    }
    let angles = frame::roll_pitch_yaw(attitude).map(f64::from);
    for (a, b) in angles.iter().zip(array::<3>(&sample["euler"])) {
        let apart = (a - b).sin().atan2((a - b).cos()).abs();
        assert!(apart < 4.0 * CLOSE, "{what}: {angles:?} against {b}");
    }
}

/// Motion of a case at a time: rate and specific force, as defined in the file.
fn motion(case: &Value, time: f64) -> (Vec3, Vec3) {
    let gyro = match case["gyro_fn"].as_str() {
        Some("(0.5 sin(2pi 0.5 t), 0.3 cos(2pi 0.3 t), 0.2) rad/s") => {
            [0.5 * (PI * time).sin(), 0.3 * (0.6 * PI * time).cos(), 0.2]
        }
        Some(other) => panic!("unknown motion {other}"),
        None => array(&case["gyro"]),
    };
    let accel = match case["accel_fn"].as_str() {
        Some("(0.1 sin(2pi t), 0.05 cos(2pi 0.7 t), -1) g") => {
            [0.1 * (2.0 * PI * time).sin(), 0.05 * (1.4 * PI * time).cos(), -1.0]
        }
        Some("(0,-sin(pi t),-cos(pi t))") => [0.0, -(PI * time).sin(), -(PI * time).cos()],
        Some(other) => panic!("unknown motion {other}"),
        None => array(&case["accel"]),
    };
    (vector(gyro), vector(accel))
}

#[test]
fn every_case() {
    let vectors = vectors();
    let cases = vectors["cases"].as_array().expect("cases");
    assert_eq!(cases.len(), 8);
    for case in cases {
        let name = case["name"].as_str().expect("name");
        let rate = case["fs"].as_f64().expect("rate");
        let mut filter = filter(&vectors);
        let mut done = 0;
        for sample in case["samples"].as_array().expect("samples") {
            let until = sample["n"].as_u64().expect("count");
            for step in done..until {
                let (gyro, accel) = motion(case, step as f64 / rate);
                filter.step(&accel, &gyro, (1.0 / rate) as f32);
            }
            done = until;
            assert_close(&filter.attitude(), sample, &format!("{name} after {until} steps"));
            let time = (until as f64 / rate).to_string();
            if let Some(exact) = case["closed_form_values"].get(&time) {
                let [roll, pitch, _] = frame::roll_pitch_yaw(&filter.attitude()).map(f64::from);
                let off = (roll + pitch - exact.as_f64().expect("angle")).abs();
                assert!(off < 2.0 * CLOSE, "{name} at {time} s: {off} rad from the closed form");
            }
        }
    }
}

#[test]
fn every_single_step() {
    let vectors = vectors();
    let mut filter = filter(&vectors);
    for step in vectors["step_by_step_combined_4000Hz"].as_array().expect("steps") {
        filter.step(&vector(array(&step["accel"])), &vector(array(&step["gyro"])), 1.0 / 4_000.0);
        assert_close(&filter.attitude(), step, "single step");
    }
}

/// With the published signs of gravity the filter would settle upside down.
#[test]
fn not_as_it_was_printed() {
    let vectors = vectors();
    let printed = vectors["sign_warning"]["printed_formula_roll30"].as_array().expect("samples");
    let wrong = array::<3>(&printed.last().expect("a sample")["euler"])[0].to_degrees();
    assert!((wrong - vectors["sign_warning"]["limit_deg"].as_f64().expect("limit")).abs() < 0.1);
    let mut filter = filter(&vectors);
    for _ in 0..120_000 {
        filter.step(&Vec3::new(0.0, -0.5, -0.866_025_4), &Vec3::zeros(), 0.000_25);
    }
    let roll = frame::roll_pitch_yaw(&filter.attitude())[0].to_degrees();
    // Steps of 0.25 ms are too small for single precision to reach the last hundredth of a degree.
    assert!((roll - 30.0).abs() < 0.03, "{roll}°");
}
