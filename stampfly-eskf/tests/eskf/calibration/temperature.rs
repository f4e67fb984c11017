//! The temperature table.

use super::{Errors, Random, still};
use stampfly_eskf::calibration::{Coverage, TemperatureRefusal, TemperatureTable};
use stampfly_types::messages::ImuData;
use stampfly_types::{Duration, GRAVITY, Instant, Vec3};

/// A bias with a curved dependence on temperature.
fn bias(curve: &[Vec3; 3], temperature: f32) -> Vec3 {
    let [constant, slope, bend] = curve;
    let off = (temperature - 30.0) / 20.0;
    constant + slope * off + bend * (off * off)
}

#[test]
fn a_bias_that_moves_with_temperature_is_tabulated() {
    let (mut inside, mut accels, mut beside) = (Errors::default(), Errors::default(), Errors::default());
    for seed in 0..20 {
        let random = &mut Random::new(seed);
        let gyro = [random.vector(0.01), random.vector(0.006), random.vector(0.002)];
        let accel = [Vec3::zeros(), random.vector(0.1), random.vector(0.03)];
        let mut table = TemperatureTable::default();
        let attitudes = [Vec3::new(0.0, 0.0, -GRAVITY), Vec3::new(0.5, -0.3, -9.78)];
        let mut now = Instant::ZERO;
        for (attitude, from) in attitudes.iter().zip([15.0, 30.0]) {
            table.begin();
            for step in 0..48_000u16 {
                now += Duration::from_micros(2_500);
                let temperature = from + f32::from(step) / 48_000.0 * 25.0;
                let felt = attitude + bias(&accel, temperature);
                table.step(now, &still(random, &bias(&gyro, temperature), &felt, temperature)).unwrap();
            }
        }
        let quality = table.quality().unwrap();
        assert!(quality.filled == 8 && (quality.span[1] - quality.span[0] - 40.0).abs() < 2.0, "{quality:?}");
        assert!(quality.gyro_scatter < 2e-3 && quality.samples > 90_000, "{quality:?}");
        let zero = bias(&accel, quality.span[0]);
        for temperature in 17..=53u8 {
            let temperature = f32::from(temperature);
            let found = table.bias(temperature).unwrap();
            assert!(found.coverage == Coverage::Inside && found.samples >= 400, "{found:?}");
            inside.0.push((found.gyro - bias(&gyro, temperature)).amax());
            accels.0.push((found.accel - bias(&accel, temperature) + zero).amax());
        }
        for temperature in [11.0, 59.0] {
            let found = table.bias(temperature).unwrap();
            assert_eq!(found.coverage, Coverage::Beside);
            beside.0.push((found.gyro - bias(&gyro, temperature)).amax());
        }
        for (far, edge) in [(-40.0, quality.span[0] - 5.0), (1e30, quality.span[1] + 5.0)] {
            let (far, edge) = (table.bias(far).unwrap(), table.bias(edge).unwrap());
            assert_eq!((far.coverage, far.gyro, far.accel), (Coverage::Clamped, edge.gyro, edge.accel));
        }
    }
    assert!(inside.report("temperature: gyro, inside", "rad/s").1 < 5e-4);
    assert!(accels.report("temperature: accelerometer, inside", "m/s²").1 < 1e-2);
    assert!(beside.report("temperature: gyro, one bin outside", "rad/s").1 < 2e-3);
}

#[test]
fn a_table_refuses_what_it_cannot_place() {
    let mut table = TemperatureTable::default();
    let mut now = Instant::ZERO;
    let mut lie = |table: &mut TemperatureTable, temperature: f32| {
        (0..900).find_map(|_| {
            now += Duration::from_micros(2_500);
            let imu = ImuData { accel: Vec3::new(0.0, 0.0, -9.8), temperature, ..Default::default() };
            table.step(now, &imu).map_or_else(|refusal| Some(Err(refusal)), |taken| taken.then_some(Ok(())))
        })
    };
    assert_eq!(table.bias(20.0), None);
    assert_eq!(table.quality(), None);
    assert_eq!(lie(&mut table, f32::NAN), Some(Err(TemperatureRefusal::NoTemperature)));
    assert_eq!(lie(&mut table, 120.0), Some(Err(TemperatureRefusal::OutOfRange { temperature: 120.0 })));
    assert_eq!(lie(&mut table, 20.0), Some(Ok(())));
    table.begin();
    assert_eq!(lie(&mut table, 40.0), Some(Err(TemperatureRefusal::Moved)));
    assert_eq!(lie(&mut table, 22.0), Some(Ok(())));
    assert_eq!(lie(&mut table, 40.0), Some(Ok(())), "now it lies as it lay at 22 °C");
    assert_eq!(table.bias(f32::NAN), None);
}
