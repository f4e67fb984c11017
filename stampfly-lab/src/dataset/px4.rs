//! Input of PX4's EKF2 for its replay test: `time_us,sensor,values…`, body FRD, in the order it arrived.

use super::csv::{Row, rows};
use super::error::DatasetErrorKind;
use super::recording::{Kind, Recording};
use super::timing::Clock;
use stampfly_drivers::Sample;
use stampfly_types::Vec3;
use stampfly_types::messages::{BaroData, ImuData, MagData};
use std::collections::BTreeMap;

/// Microtesla per gauss.
const MICROTESLA: f32 = 100.0;

/// Sensors PX4 writes.
const SENSORS: [&str; 8] = ["imu", "mag", "baro", "gps", "airspeed", "range", "flow", "vio"];

pub(super) fn is(first_line: &[u8]) -> bool {
    let Ok(line) = std::str::from_utf8(first_line) else { return false };
    let mut cells = line.split(',');
    let time = cells.next().is_some_and(|cell| cell.trim().parse::<u64>().is_ok());
    time && cells.next().is_some_and(|cell| SENSORS.contains(&cell.trim()))
}

/// The numbers behind time and sensor.
fn values<const N: usize>(row: &Row<'_>, names: [&str; N]) -> Result<[f32; N], DatasetErrorKind> {
    let mut values = [0.0; N];
    for (place, (value, name)) in values.iter_mut().zip(names).enumerate() {
        *value = row.number(place + 2, name)? as f32;
    }
    Ok(values)
}

pub(super) fn read(name: &str, bytes: &[u8]) -> Result<Recording, DatasetErrorKind> {
    let (mut imu, mut mag, mut baro) = (Vec::new(), Vec::new(), Vec::new());
    let mut skipped: BTreeMap<String, usize> = BTreeMap::new();
    for row in rows(bytes) {
        let row = row?;
        let at = row.micros(0, "time_us", 1.0)?;
        match row.cells.get(1).copied().unwrap_or_default() {
            "imu" => {
                let [ax, ay, az, gx, gy, gz] =
                    values(&row, ["accel x", "accel y", "accel z", "gyro x", "gyro y", "gyro z"])?;
                let (accel, gyro) = (Vec3::new(ax, ay, az), Vec3::new(gx, gy, gz));
                imu.push(Sample { at, data: ImuData { accel, gyro, temperature: 25.0, ..Default::default() } });
            }
            "mag" => {
                let field = Vec3::from(values(&row, ["mag x", "mag y", "mag z"])?) * MICROTESLA;
                mag.push(Sample { at, data: MagData { field } });
            }
            "baro" => {
                let [altitude] = values(&row, ["baro altitude"])?;
                let pressure = super::stampfly::standard_pressure(altitude);
                baro.push(Sample { at, data: BaroData { pressure, temperature: 25.0, altitude } });
            }
            other => *skipped.entry(other.to_owned()).or_default() += 1,
        }
    }
    let recording = Recording::new(Kind::Px4Replay, name, imu, Clock::Even);
    Ok(Recording { mag, baro, skipped, ..recording })
}
