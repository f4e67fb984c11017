//! NanoBench: a Crazyflie under motion capture.
//!
//! Body FLU and a world with z up, x as the body's x at heading zero; acceleration in g, rates in rad/s (the
//! recordings say so, and the capture's own rates agree). Half a turn about x leads to FRD and NED, on both sides.
//!
//! The files were resampled to 100 Hz. Where the radio log ended before the motion capture did, its columns go on in
//! straight lines, up to accelerations of 9 g in a vehicle that lies on the floor: that end is cut off.

use super::csv;
use super::error::DatasetErrorKind;
use super::npz::{Arrays, Elements, broken, numbers};
use super::recording::{DevicePoint, Kind, Recording, TruthPoint, attitude};
use super::timing::{Clock, straight_end};
use stampfly_drivers::Sample;
use stampfly_types::messages::ImuData;
use stampfly_types::{GRAVITY, Instant, Vec3};
use std::borrow::Cow;

/// A clock that shows more, s, counts from 1970.
const SINCE_1970: f64 = 1e9;

pub(super) fn is(arrays: &Arrays) -> bool {
    ["t", "data", "cols"].iter().all(|name| arrays.contains_key(*name))
}

/// Is it the first line of a table as the authors publish it?
pub(super) fn is_text(header: &[&str]) -> bool {
    ["t", "px", "qw", "imu_acc_x", "imu_gyro_x"].iter().all(|name| header.contains(name))
}

/// Columns that are read, besides the time.
const COLUMNS: [&str; 26] = [
    "px",
    "py",
    "pz",
    "qx",
    "qy",
    "qz",
    "qw",
    "vx",
    "vy",
    "vz",
    "imu_acc_x",
    "imu_acc_y",
    "imu_acc_z",
    "imu_gyro_x",
    "imu_gyro_y",
    "imu_gyro_z",
    "est_stateEstimate_x",
    "est_stateEstimate_y",
    "est_stateEstimate_z",
    "est_stateEstimate_vx",
    "est_stateEstimate_vy",
    "est_stateEstimate_vz",
    "att_stateEstimate_qw",
    "att_stateEstimate_qx",
    "att_stateEstimate_qy",
    "att_stateEstimate_qz",
];

/// A table with named columns, and the time of each row, s.
struct Table<'a> {
    names: Vec<&'a str>,
    values: Cow<'a, [f64]>,
    time: Vec<f64>,
}

impl<'a> Table<'a> {
    fn of_arrays(arrays: &'a Arrays) -> Result<Self, DatasetErrorKind> {
        let (Some(cols), Some(data)) = (arrays.get("cols"), arrays.get("data")) else {
            return Err(broken("data", "missing"));
        };
        let Elements::Text(names) = &cols.elements else { return Err(broken("cols", "numbers, not names")) };
        let Elements::Numbers(values) = &data.elements else { return Err(broken("data", "text, not numbers")) };
        let time: Vec<f64> = numbers::<1>(arrays, "t")?.iter().map(|[seconds]| *seconds).collect();
        if time.len() != data.rows || data.columns == 0 {
            return Err(broken("data", format!("{} rows for {} times", data.rows, time.len())));
        }
        if names.len() < data.columns {
            return Err(broken("cols", format!("{} names for {} columns", names.len(), data.columns)));
        }
        let names = names.iter().take(data.columns).map(String::as_str).collect();
        Ok(Self { names, values: values.into(), time })
    }

    fn of_text(bytes: &'a [u8]) -> Result<Self, DatasetErrorKind> {
        let table = csv::Table::new(bytes)?;
        let (columns, clock) = (table.columns(COLUMNS)?, table.columns(["t"])?);
        let (mut values, mut time) = (Vec::new(), Vec::new());
        for row in table.rows() {
            let row = row?;
            values.extend(columns.read(&row)?);
            let [seconds] = clock.read(&row)?;
            time.push(seconds);
        }
        Ok(Self { names: COLUMNS.into(), values: values.into(), time })
    }

    /// The numbers of these columns, row by row.
    fn columns<const N: usize>(
        &self,
        names: [&str; N],
    ) -> Result<impl Iterator<Item = [f64; N]> + use<'_, 'a, N>, DatasetErrorKind> {
        let mut places = [0; N];
        for (place, name) in places.iter_mut().zip(names) {
            let found = self.names.iter().position(|known| *known == name);
            *place = found.ok_or_else(|| broken(name, "no such column"))?;
        }
        let rows = self.values.chunks_exact(self.names.len());
        Ok(rows.map(move |row| places.map(|place| row.get(place).copied().unwrap_or(f64::NAN))))
    }

    /// The instant of each row. The authors' clock counts from 1970, ours from the first row.
    fn stamps(&self) -> Result<Vec<Instant>, DatasetErrorKind> {
        let begins = self.time.first().copied().filter(|first| *first > SINCE_1970).unwrap_or(0.0);
        let stamp = |seconds: &f64| match seconds - begins {
            time @ 0.0..3.2e8 => Ok(Instant::from_micros((time * 1e6 + 0.5) as u64)),
            _ => Err(broken("t", format!("{seconds} is not a time"))),
        };
        self.time.iter().map(stamp).collect()
    }
}

/// What lies behind what came before.
#[derive(Default)]
struct Forward(Instant);

impl Forward {
    fn takes(&mut self, at: Instant) -> bool {
        let takes = at >= self.0;
        self.0 = self.0.max(at);
        takes
    }
}

/// Half a turn about x: FLU to FRD, and z-up to NED.
fn turned([x, y, z]: [f64; 3]) -> Vec3 {
    Vec3::new(x as f32, -y as f32, -z as f32)
}

/// The vector, if it was seen.
fn seen(vector: [f64; 3]) -> Option<Vec3> {
    vector.iter().all(|value| value.is_finite()).then(|| turned(vector))
}

/// Reads arrays: `t`, `data` and the names of its columns, `cols`.
pub(super) fn read(name: &str, arrays: &Arrays) -> Result<Recording, DatasetErrorKind> {
    recording(name, &Table::of_arrays(arrays)?)
}

/// Reads a table as the authors publish it, `datasets/dataset/NAME.csv`.
pub(super) fn read_text(name: &str, bytes: &[u8]) -> Result<Recording, DatasetErrorKind> {
    recording(name, &Table::of_text(bytes)?)
}

fn recording(name: &str, table: &Table<'_>) -> Result<Recording, DatasetErrorKind> {
    let stamps = table.stamps()?;
    let accel = table.columns(["imu_acc_x", "imu_acc_y", "imu_acc_z"])?;
    let gyro = table.columns(["imu_gyro_x", "imu_gyro_y", "imu_gyro_z"])?;
    let mut rows: Vec<_> = (stamps.iter())
        .zip(accel.zip(gyro))
        .map(|(at, (accel, gyro))| {
            let data =
                ImuData { accel: turned(accel) * GRAVITY, gyro: turned(gyro), temperature: 25.0, ..Default::default() };
            Sample { at: *at, data }
        })
        .collect();
    let (all, extrapolated) = (rows.len(), straight_end(&rows));
    rows.truncate(all - extrapolated);
    let mut recording = Recording::new(Kind::NanoBench, name, rows, Clock::Even);
    recording.timing.rows = all;
    recording.timing.extrapolated = extrapolated;

    let turn = table.columns(["qw", "qx", "qy", "qz"])?;
    let place = table.columns(["px", "py", "pz"])?.zip(table.columns(["vx", "vy", "vz"])?);
    // Where the clock goes back, the inertial samples are left out as well.
    let (mut forward, mut forward_too) = (Forward::default(), Forward::default());
    recording.truth = (stamps.iter().zip(turn.zip(place)))
        .filter(|(at, _)| forward.takes(**at))
        .map(|(at, ([w, x, y, z], (position, velocity)))| TruthPoint {
            at: *at,
            attitude: attitude(w, x, -y, -z),
            position: seen(position),
            velocity: seen(velocity),
            counts: true,
        })
        .collect();

    let turn = table.columns([
        "att_stateEstimate_qw",
        "att_stateEstimate_qx",
        "att_stateEstimate_qy",
        "att_stateEstimate_qz",
    ])?;
    let place = table.columns(["est_stateEstimate_x", "est_stateEstimate_y", "est_stateEstimate_z"])?;
    let speed = table.columns(["est_stateEstimate_vx", "est_stateEstimate_vy", "est_stateEstimate_vz"])?;
    let place = place.zip(speed);
    let own = stamps.iter().zip(turn.zip(place)).filter(|(at, _)| forward_too.takes(**at));
    let own = own.filter_map(|(at, ([w, x, y, z], (position, velocity)))| {
        let attitude = attitude(w, x, -y, -z)?;
        Some(DevicePoint { at: *at, attitude, position: Some(seen(position)?), velocity: seen(velocity)? })
    });
    recording.device = Some(own.collect());
    Ok(recording)
}
