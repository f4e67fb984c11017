//! What StampFlys recorded themselves. Body FRD, world NED and SI units already; angles in degrees.

use super::csv::{Columns, Row, Table};
use super::error::DatasetErrorKind;
use super::recording::{DevicePoint, Kind, Recording};
use super::timing::{Clock, Held};
use stampfly_drivers::Sample;
use stampfly_types::messages::{BaroData, FlowData, ImuData, MagData, TofData};
use stampfly_types::{Duration, Instant, Quat, Vec3, math};

/// Radians per count of the flow sensor.
const RADIANS_PER_COUNT: f64 = 0.002_22;
/// What the camera's axes add to that, as calibrated by the recordings' author.
const FLOW_SCALE: [f64; 2] = [0.943, 1.015];
/// Counts were summed over this time.
const FLOW_INTERVAL: f32 = 0.01;
/// Below this quality the flow chip's data sheet calls a sample unusable.
const MIN_QUALITY: f64 = 25.0;
/// The range sensor is good for this much.
const TOF_RANGE: std::ops::RangeInclusive<f64> = 0.01..=4.0;
/// The die temperature was not recorded; this is a room.
const ROOM_TEMPERATURE: f32 = 25.0;

/// How often each sensor has something new.
const TOF_PERIOD: Duration = Duration::from_millis(33);
const FLOW_PERIOD: Duration = Duration::from_millis(10);
const MAG_PERIOD: Duration = Duration::from_millis(40);
const BARO_PERIOD: Duration = Duration::from_millis(70);

/// Is it the first line of a sensor log? The columns may be in any order, among others.
pub(super) fn is_log(header: &[&str]) -> bool {
    ["timestamp_ms", "raw_accel_x", "raw_gyro_x"].iter().all(|name| header.contains(name))
}

/// Is it the first line of a flight capture?
pub(super) fn is_flight(header: &[&str]) -> bool {
    ["timestamp_ms", "accel_x", "gyro_x"].iter().all(|name| header.contains(name))
}

fn stamp(row: &Row<'_>, clock: &Columns<1>) -> Result<Instant, DatasetErrorKind> {
    let [place] = clock.places;
    row.micros(place, "timestamp_ms", 1_000.0)
}

fn vector([x, y, z]: [f64; 3]) -> Vec3 {
    Vec3::new(x as f32, y as f32, z as f32)
}

/// One inertial row: acceleration, rate.
fn imu(at: Instant, [ax, ay, az, gx, gy, gz]: [f64; 6]) -> Sample<ImuData> {
    let data = ImuData {
        accel: vector([ax, ay, az]),
        gyro: vector([gx, gy, gz]),
        temperature: ROOM_TEMPERATURE,
        ..Default::default()
    };
    Sample { at, data }
}

fn range(distance: f64) -> TofData {
    TofData { distance: distance as f32, sigma: 0.0, status: 0, valid: TOF_RANGE.contains(&distance) }
}

/// The device's own estimate: position, velocity, roll, pitch, yaw.
fn device(at: Instant, values: [f64; 9]) -> DevicePoint {
    let [px, py, pz, vx, vy, vz, roll, pitch, yaw] = values;
    let [roll, pitch, yaw] = [roll, pitch, yaw].map(|degrees| degrees.to_radians() as f32);
    DevicePoint {
        at,
        attitude: Quat::from_euler_angles(roll, pitch, yaw),
        position: Some(vector([px, py, pz])),
        velocity: vector([vx, vy, vz]),
    }
}

/// Pressure at an altitude of the standard atmosphere, pascals.
pub(super) fn standard_pressure(altitude: f32) -> f32 {
    101_325.0 * math::pow(1.0 - altitude / 44_330.77, 5.255_88)
}

/// Sensor log: 25 columns, 22 without the magnetometer.
pub(super) fn read_log(name: &str, bytes: &[u8]) -> Result<Recording, DatasetErrorKind> {
    let table = Table::new(bytes)?;
    let clock = table.columns(["timestamp_ms"])?;
    let inertial =
        table.columns(["raw_accel_x", "raw_accel_y", "raw_accel_z", "raw_gyro_x", "raw_gyro_y", "raw_gyro_z"])?;
    let field = table.maybe(["raw_mag_x", "raw_mag_y", "raw_mag_z"])?;
    let others = table.columns(["raw_baro_alt", "raw_tof", "raw_flow_squal", "raw_flow_dx", "raw_flow_dy"])?;
    let own = table.columns([
        "dev_pos_x",
        "dev_pos_y",
        "dev_pos_z",
        "dev_vel_x",
        "dev_vel_y",
        "dev_vel_z",
        "dev_roll_deg",
        "dev_pitch_deg",
        "dev_yaw_deg",
    ])?;

    let (mut rows, mut poses) = (Vec::new(), Vec::new());
    let (mut tof, mut flow, mut mag, mut baro) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut new_tof = Held::new(TOF_PERIOD);
    let mut new_flow = Held::new(FLOW_PERIOD);
    let mut new_mag = Held::new(MAG_PERIOD);
    let mut new_baro = Held::new(BARO_PERIOD);
    for row in table.rows() {
        let row = row?;
        let at = stamp(&row, &clock)?;
        rows.push(imu(at, inertial.read(&row)?));
        poses.push(device(at, own.read(&row)?));
        let [altitude, distance, quality, dx, dy] = others.read(&row)?;
        if new_tof.is_new(at, distance) {
            tof.push(Sample { at, data: range(distance) });
        }
        if new_flow.is_new(at, (quality, dx, dy)) {
            let data = FlowData {
                delta_x: (dx * RADIANS_PER_COUNT * FLOW_SCALE[0]) as f32,
                delta_y: (dy * RADIANS_PER_COUNT * FLOW_SCALE[1]) as f32,
                interval: FLOW_INTERVAL,
                quality: quality as u8,
                valid: quality >= MIN_QUALITY,
            };
            flow.push(Sample { at, data });
        }
        if new_baro.is_new(at, altitude) {
            let altitude = altitude as f32;
            let data = BaroData { pressure: standard_pressure(altitude), temperature: ROOM_TEMPERATURE, altitude };
            baro.push(Sample { at, data });
        }
        if let Some(field) = &field {
            let field = field.read(&row)?;
            if new_mag.is_new(at, field) {
                mag.push(Sample { at, data: MagData { field: vector(field) } });
            }
        }
    }
    let recording = Recording::new(Kind::StampFlyLog, name, rows, Clock::Raw);
    Ok(Recording { tof, flow, mag, baro, device: Some(poses), ..recording })
}

/// Flight capture: 29 columns, or 7 or 11 with inertial samples only.
pub(super) fn read_flight(name: &str, bytes: &[u8]) -> Result<Recording, DatasetErrorKind> {
    let table = Table::new(bytes)?;
    let clock = table.columns(["timestamp_ms"])?;
    let inertial = table.columns(["accel_x", "accel_y", "accel_z", "gyro_x", "gyro_y", "gyro_z"])?;
    let field = table.maybe(["mag_x", "mag_y", "mag_z"])?;
    let down = table.maybe(["tof_bottom"])?;
    let own =
        table.maybe(["pos_x", "pos_y", "pos_z", "vel_x", "vel_y", "vel_z", "roll_deg", "pitch_deg", "yaw_deg"])?;

    let (mut rows, mut poses, mut tof, mut mag) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut new_tof = Held::new(TOF_PERIOD);
    let mut new_mag = Held::new(MAG_PERIOD);
    for row in table.rows() {
        let row = row?;
        let at = stamp(&row, &clock)?;
        rows.push(imu(at, inertial.read(&row)?));
        if let Some(own) = &own {
            poses.push(device(at, own.read(&row)?));
        }
        if let Some(down) = &down {
            let [distance] = down.read(&row)?;
            if new_tof.is_new(at, distance) {
                tof.push(Sample { at, data: range(distance) });
            }
        }
        if let Some(field) = &field {
            let field = field.read(&row)?;
            if new_mag.is_new(at, field) {
                mag.push(Sample { at, data: MagData { field: vector(field) } });
            }
        }
    }
    let recording = Recording::new(Kind::StampFlyFlight, name, rows, Clock::Raw);
    Ok(Recording { tof, mag, device: own.map(|_| poses), ..recording })
}
