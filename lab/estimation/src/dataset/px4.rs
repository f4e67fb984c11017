//! Input of PX4's EKF2 for its replay test: `time_us,sensor,values…`, body FRD, in the order it arrived.
//!
//! Used: `imu` (m/s², rad/s), `mag` (gauss), `baro` (altitude, m), `gps` (altitude in mm, longitude and latitude in 1e-7 degrees,
//! velocity NED in m/s). Other sensors are counted and left out, and so is what PX4's own code knew: `landed`.
//! Source: PX4-Autopilot, src/modules/ekf2/test/sensor_simulator.

use super::csv::{Row, rows};
use super::error::DatasetErrorKind;
use super::geodetic::{Local, Place};
use super::recording::{GnssFix, Kind, Recording};
use super::timing::Clock;
use stampfly_drivers::Sample;
use stampfly_types::Vec3;
use stampfly_types::messages::{BaroData, ImuData, MagData};
use std::collections::BTreeMap;

/// Microtesla per gauss.
const MICROTESLA: f32 = 100.0;

/// Sensors PX4 writes.
const SENSORS: [&str; 9] = ["imu", "mag", "baro", "gps", "airspeed", "range", "flow", "vio", "landed"];
/// Degrees in a unit of the receiver's latitude and longitude, metres in one of its altitude.
const ANGLE_UNIT: f64 = 1e-7;
const ALTITUDE_UNIT: f64 = 1e-3;

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

/// The place and velocity of a fix; `None` when it is none: not finite, or nowhere on earth.
fn fix(row: &Row<'_>) -> Result<Option<(Place, Vec3)>, DatasetErrorKind> {
    let mut place = [0.0; 3];
    for (place, (cell, name)) in place.iter_mut().zip([(4, "gps latitude"), (3, "gps longitude"), (2, "gps altitude")])
    {
        *place = row.number(cell, name)?;
    }
    let mut velocity = [0.0; 3];
    for (velocity, (cell, name)) in velocity.iter_mut().zip([(5, "gps north"), (6, "gps east"), (7, "gps down")]) {
        *velocity = row.number(cell, name)? as f32;
    }
    let [latitude, longitude, altitude] = place;
    let place = Place {
        latitude: latitude * ANGLE_UNIT,
        longitude: longitude * ANGLE_UNIT,
        altitude: altitude * ALTITUDE_UNIT,
    };
    let usable = place.is_on_earth() && velocity.iter().all(|axis: &f32| axis.is_finite());
    Ok(usable.then(|| (place, Vec3::from(velocity))))
}

pub(super) fn read(name: &str, bytes: &[u8]) -> Result<Recording, DatasetErrorKind> {
    let (mut imu, mut mag, mut baro, mut gnss) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut local = None;
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
            "gps" => match fix(&row)? {
                Some((place, velocity)) => {
                    let position = local.get_or_insert_with(|| Local::around(place)).of(&place);
                    gnss.push(Sample { at, data: GnssFix { position, velocity } });
                }
                None => *skipped.entry("gps without a fix".to_owned()).or_default() += 1,
            },
            other => *skipped.entry(other.to_owned()).or_default() += 1,
        }
    }
    let recording = Recording::new(Kind::Px4Replay, name, imu, Clock::Even);
    Ok(Recording { mag, baro, gnss, skipped, ..recording })
}
