//! Calibrations with impossible samples.

use proptest::prelude::*;
use stampfly_eskf::calibration::{EllipsoidFit, LevelTrim, SixPosition, StillCalibration, TemperatureTable};
use stampfly_types::messages::{BaroData, ImuData, MagData};
use stampfly_types::{Duration, Instant, Vec3};

/// Values of a broken sensor, mixed with those of a working one.
fn number(usual: f32) -> impl Strategy<Value = f32> {
    prop_oneof![8 => -usual..usual, 1 => any::<f32>(), 1 => Just(0.0f32), 1 => Just(1e19f32), 1 => Just(f32::NAN)]
}

fn vector(usual: f32) -> impl Strategy<Value = Vec3> {
    [number(usual), number(usual), number(usual)].prop_map(Vec3::from)
}

fn finite(vectors: &[Vec3]) -> bool {
    vectors.iter().all(|vector| vector.iter().all(|v| v.is_finite()))
}

/// Mostly gravity on one of the faces, so that stretches are completed.
fn force() -> impl Strategy<Value = Vec3> {
    let upright = (0usize..3, any::<bool>(), -0.3f32..0.3).prop_map(|(axis, up, off)| {
        let mut force = Vec3::repeat(off);
        force[axis] = if up { 9.8 + off } else { off - 9.8 };
        force
    });
    prop_oneof![5 => upright, 1 => vector(11.0)]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    /// Short stretches of arbitrary values, each repeated so that some of it counts as still.
    #[test]
    fn nothing_that_is_not_finite_comes_out_of_an_inertial_calibration(
        samples in prop::collection::vec((force(), vector(0.03), number(90.0), 1usize..2_000, any::<u16>()), 1..16)
    ) {
        let (mut calibration, mut six) = (StillCalibration::default(), SixPosition::default());
        let (mut level, mut table) = (LevelTrim::default(), TemperatureTable::default());
        let mut now = Instant::ZERO;
        for (accel, gyro, temperature, repeats, jump) in samples {
            now += Duration::from_micros(u64::from(jump));
            for _ in 0..repeats {
                now += Duration::from_micros(2_500);
                let imu = ImuData { accel, gyro, temperature, ..Default::default() };
                let _ = (calibration.step(now, &imu), six.step(now, &imu), table.step(now, &imu));
                calibration.add_mag(&MagData { field: accel });
                calibration.add_baro(&BaroData { altitude: temperature, ..Default::default() });
                if let Ok(Some((trim, quality))) = level.step(now, &imu) {
                    prop_assert!(finite(&[trim.correct(Vec3::x())]) && quality.noise.is_finite());
                }
            }
            let result = calibration.result();
            prop_assert!(finite(&[result.gyro_bias, result.specific_force, result.field]));
            prop_assert!(result.baro_altitude.is_finite() && (0.0..=1.0).contains(&result.progress));
            if let Ok((correction, quality)) = six.solve() {
                prop_assert!(finite(&[correction.bias, correction.scale]) && quality.residual.is_finite());
            }
            for temperature in [temperature, -300.0, 12.0, 1e30] {
                if let Some(bias) = table.bias(temperature) {
                    prop_assert!(finite(&[bias.gyro, bias.accel]), "{bias:?}");
                }
            }
            prop_assert!(table.quality().is_none_or(|quality| quality.gyro_scatter.is_finite()));
        }
    }

    #[test]
    fn nothing_that_is_not_finite_comes_out_of_an_ellipsoid(
        fields in prop::collection::vec(vector(60.0), 100..400), sphere in any::<bool>()
    ) {
        let mut fit = EllipsoidFit::default();
        for field in fields {
            let _ = fit.add(&if sphere && field.norm() > 1.0 { field / field.norm() * 50.0 } else { field });
            if let Ok((correction, quality)) = fit.solve() {
                let columns = correction.matrix.column_iter().map(|column| column.into_owned().into()).collect::<Vec<_>>();
                prop_assert!(finite(&columns) && finite(&[correction.offset]));
                prop_assert!(quality.residual.is_finite() && (15.0..=90.0).contains(&correction.strength));
            }
        }
    }
}
