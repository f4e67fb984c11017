//! The estimator under any stream of samples, in any order, at any times.

use crate::Input;
use stampfly_eskf::aid::{Row, airspeed::Wind};
use stampfly_eskf::{Eskf, EskfConfig, Estimator};
use stampfly_types::messages::{BaroData, CalibrationResult, EstimatorCommand, FlowData, ImuData, MagData, TofData};
use stampfly_types::{Duration, Instant, Quat, Vec3};

/// Samples, each with a kind and a time step. The first byte says whether the estimator is initialised.
pub fn estimator_stream(data: &[u8]) {
    let mut input = Input(data);
    let mut eskf = Eskf::new(EskfConfig::default());
    let calibration =
        CalibrationResult { specific_force: Vec3::new(0.0, 0.0, -9.81), complete: true, ..Default::default() };
    if input.byte() & 1 == 1 {
        eskf.initialize(Instant::ZERO, &calibration);
    }
    let (mut now, mut wind) = (Instant::ZERO, Wind::default());
    while !input.is_empty() {
        let (kind, step) = (input.byte(), input.byte());
        now = match step {
            // Minutes later, back, and before everything.
            255 => now + Duration::from_secs(600),
            254 => Instant::from_micros(now.as_micros().saturating_sub(40_000)),
            253 => Instant::ZERO,
            _ => now + Duration::from_micros(100 * u64::from(step)),
        };
        // The rarer ones have numbers of their own, so that older inputs mean what they did.
        match if kind >= 248 { kind } else { kind % 8 } {
            0 => eskf
                .predict(now, &ImuData { gyro: input.vector(35.0), accel: input.vector(80.0), ..Default::default() }),
            1 => {
                let [distance, sigma] = [input.number(3.0), input.number(0.1)];
                _ = eskf
                    .fuse_tof(now, &TofData { distance, sigma, valid: input.byte() & 1 == 1, ..Default::default() });
            }
            2 => {
                let [delta_x, delta_y, interval] = [input.number(1.0), input.number(1.0), input.number(0.05)];
                let (quality, valid) = (input.byte(), input.byte() & 1 == 1);
                _ = eskf.fuse_flow(now, &FlowData { delta_x, delta_y, interval, quality, valid });
            }
            3 => _ = eskf.fuse_baro(now, &BaroData { altitude: input.number(10.0), ..Default::default() }),
            4 => _ = eskf.fuse_mag(now, &MagData { field: input.vector(100.0) }),
            5 => {
                let flags = input.byte();
                let [origin_resets, full_resets] = [u32::from(flags >> 2 & 1), u32::from(flags >> 3 & 1)];
                let (on_ground, flying, accel_faulty) = (flags & 1 != 0, flags & 2 != 0, flags & 16 != 0);
                let command = EstimatorCommand { on_ground, flying, accel_faulty, origin_resets, full_resets };
                eskf.command(now, &command);
            }
            6 => eskf.initialize(now, &calibration),
            248 => _ = eskf.fuse_position(now, &input.vector(20.0), &input.vector(1.0)),
            249 => {
                let ([w, x, y, z], sigma) = ([(); 4].map(|()| input.number(1.0)), input.number(0.1));
                _ = eskf.fuse_attitude(now, &Quat::new_unchecked(w, x, y, z), sigma);
            }
            250 => {
                let [speed, sigma] = [input.number(20.0), input.number(1.0)];
                _ = eskf.fuse_airspeed(now, speed, sigma, &mut wind);
            }
            251 => {
                // A model of one's own that sees two errors of the state, whatever they are.
                let places = input.byte();
                let [predicted, measured] = [input.number(100.0), input.number(100.0)];
                let entries =
                    [(usize::from(places & 15), input.number(1.0)), (usize::from(places >> 4), input.number(1.0))];
                let [variance, gate] = [input.number(1.0), input.number(5.0)];
                _ = eskf.fuse(now, |_| [Row::new(predicted, entries)], [measured], [variance], gate);
            }
            _ => {
                let velocity = input.vector(5.0);
                _ = eskf.fuse_velocity(now, &velocity, &input.vector(1.0));
            }
        }
        check(&eskf);
    }
}

/// Whatever came: numbers, a rotation, and a covariance.
fn check(eskf: &Eskf) {
    let estimate = eskf.estimate();
    let vectors = [
        estimate.position,
        estimate.velocity,
        estimate.angular_rate,
        estimate.specific_force,
        estimate.gyro_bias,
        estimate.accel_bias,
    ];
    let finite = vectors.iter().all(|vector| vector.iter().all(|number| number.is_finite()));
    assert!(finite && estimate.height.is_finite(), "{estimate:?}");
    let length = stampfly_types::math::sqrt(estimate.attitude.norm_squared());
    assert!((length - 1.0).abs() < 1e-3, "a quaternion of length {length}");
    let covariance = eskf.covariance();
    for i in 0..15 {
        let variance = covariance.get(i, i);
        assert!(variance.is_finite() && variance >= 0.0, "variance {i} is {variance}");
        for j in 0..i {
            assert!(covariance.get(i, j) == covariance.get(j, i), "{i}, {j}: not symmetric");
        }
    }
}
