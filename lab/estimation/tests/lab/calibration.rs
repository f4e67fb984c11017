//! The calibrations on recorded data: what lies still is calibrated, what is held or flies is not, and a magnetometer that
//! was turned by hand draws a sphere.
//!
//! These need the recorded data; see `build.rs` for how they are found. `--nocapture` prints the figures.

use stampfly_eskf::calibration::{EllipsoidFailure, EllipsoidFit, StillCalibration};
use stampfly_lab::dataset::{self, Recording};
use stampfly_types::Vec3;

/// Set by the build script.
const FOLDER: &str = env!("STAMPFLY_DATA_FOLDER");

fn load(file: &str) -> Recording {
    dataset::load(format!("{FOLDER}/{file}")).unwrap()
}

fn still(recording: &Recording) -> StillCalibration {
    let mut calibration = StillCalibration::default();
    for sample in &recording.imu {
        // What is refused shows in the result.
        let _ = calibration.step(sample.at, &sample.data);
    }
    calibration
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn a_stampfly_on_the_floor_is_calibrated_at_the_first_attempt() {
    for name in [
        "stampfly_logs/static_test7",
        "stampfly_logs/static_low_ba",
        "stampfly_logs/static_comparison",
        "stampfly_logs/test_400hz_static",
        "stampfly_flights/stampfly_fft_20260113T215050",
        "stampfly_flights/stampfly_fft_20260114T115628",
    ] {
        let recording = load(&format!("{name}.csv"));
        let calibration = still(&recording);
        let (result, quality) = (calibration.result(), calibration.quality().unwrap());
        let all = recording.imu.iter().map(|sample| sample.data.gyro).sum::<Vec3>() / recording.imu.len() as f32;
        let off = (result.gyro_bias - all).amax();
        println!(
            "{name}: gyro noise {:.2e} rad/s, accelerometer noise {:.3} m/s², |a| − g {:+.3} m/s²; {off:.1e} rad/s from \
             the mean of the whole recording",
            quality.gyro_noise.amax(),
            quality.accel_noise.amax(),
            quality.force_error
        );
        assert!(result.complete && result.restarts == 0, "{name}: {result:?}");
        assert!(off < 2e-3, "{name}: {off} rad/s");
        assert!(quality.gyro_noise.amax() < 5e-3 && quality.accel_noise.amax() < 0.05, "{name}: {quality:?}");
        assert!(quality.force_error.abs() < 0.1, "{name}: {quality:?}");
    }
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn what_is_in_a_hand_or_in_the_air_is_not_calibrated() {
    for name in [
        "stampfly_logs/flow_sa",
        "stampfly_logs/flow_scale",
        "stampfly_logs/analysis_rot",
        "stampfly_logs/flow_test_square_01",
        "stampfly_flights/stampfly_fft_20260113T215417",
        "stampfly_flights/stampfly_fft_20260113T222402",
    ] {
        let calibration = still(&load(&format!("{name}.csv")));
        let result = calibration.result();
        assert!(!result.complete && result.progress < 0.1 && calibration.quality().is_none(), "{name}: {result:?}");
    }
}

/// Iron of our own in front of a recorded magnetometer.
fn with_iron(recording: &Recording, gain: Vec3, offset: Vec3) -> impl Iterator<Item = Vec3> {
    recording.mag.iter().map(move |sample| sample.data.field.component_mul(&gain) + offset)
}

fn fitted(fields: impl Iterator<Item = Vec3>) -> EllipsoidFit {
    let mut fit = EllipsoidFit::default();
    for field in fields {
        // Samples taken while it was hardly turned are refused.
        let _ = fit.add(&field);
    }
    fit
}

/// Standard deviation of the strength, µT.
fn spread(fields: impl Iterator<Item = Vec3>) -> f64 {
    let strengths: Vec<_> = fields.map(|field| f64::from(field.norm())).collect();
    let mean = strengths.iter().sum::<f64>() / strengths.len() as f64;
    let squares: f64 = strengths.iter().map(|strength| (strength - mean) * (strength - mean)).sum();
    (squares / strengths.len() as f64).sqrt()
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn a_magnetometer_turned_by_hand_draws_a_sphere() {
    let (none, gain, offset) = (Vec3::repeat(1.0), Vec3::new(1.15, 0.9, 1.0), Vec3::new(150.0, -300.0, 80.0));
    for name in ["02_undisturbed_slow_rotation_B", "21_undisturbed_fast_combined", "26_disturbed_phone_vibration_A"] {
        let recording = load(&format!("broad/{name}.npz"));
        for (gain, offset) in [(none, Vec3::zeros()), (gain, offset)] {
            let (correction, quality) = fitted(with_iron(&recording, gain, offset)).solve().unwrap();
            let before = spread(with_iron(&recording, gain, offset));
            let after = spread(with_iron(&recording, gain, offset).map(|field| correction.correct(field)));
            println!("{name}: strength varies by {before:.2} µT before and {after:.2} µT after; {quality:?}");
            // What is left is the sensor's noise and the room's field.
            assert!(after < 1.2 && after < before, "{name}: {before} before, {after} after");
            assert!(quality.residual < 0.025 * correction.strength && quality.coverage > 0.9, "{name}: {quality:?}");
            // The trials are calibrated, so what is found is our own iron and, in one of them, a phone.
            assert!((correction.offset - offset).amax() < 4.0, "{name}: {correction:?}");
            let straight = correction.matrix * nalgebra::Matrix3::from_diagonal(&gain.into());
            let gains = Vec3::from(straight.diagonal()) / straight.trace() * 3.0;
            assert!((gains - none).amax() < 0.04, "{name}: {gains}");
        }
    }
}

#[test]
#[cfg_attr(not(recorded_data), ignore = "set STAMPFLY_DATA to the recorded data")]
fn a_magnetometer_that_was_hardly_turned_gets_no_correction() {
    let recording = load("broad/11_undisturbed_slow_translation_B.npz");
    let failure = fitted(recording.mag.iter().map(|sample| sample.data.field)).solve().unwrap_err();
    assert!(matches!(failure, EllipsoidFailure::Flat { .. }), "{failure:?}");
    for name in ["analysis_rot", "angle_test2", "flow_sa", "square01"] {
        let recording = load(&format!("stampfly_logs/{name}.csv"));
        let failure = fitted(recording.mag.iter().map(|sample| sample.data.field)).solve().unwrap_err();
        let expected = matches!(failure, EllipsoidFailure::TooFew { .. } | EllipsoidFailure::Flat { .. });
        assert!(expected, "{name}: {failure:?}");
    }
}
