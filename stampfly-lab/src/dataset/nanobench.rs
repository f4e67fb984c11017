//! NanoBench: a Crazyflie under motion capture.
//!
//! Body FLU and a world with z up, x as the body's x at heading zero; acceleration in g, rates in rad/s (the
//! recordings say so, and the capture's own rates agree). Half a turn about x leads to FRD and NED, on both sides.
//!
//! The files were resampled to 100 Hz. Where the radio log ended before the motion capture did, its columns go on in
//! straight lines, up to accelerations of 9 g in a vehicle that lies on the floor: that end is cut off.

use super::error::DatasetErrorKind;
use super::npz::{Array, Arrays, Elements, broken, numbers};
use super::recording::{DevicePoint, Kind, Recording, TruthPoint, attitude};
use super::timing::{Clock, straight_end};
use stampfly_drivers::Sample;
use stampfly_types::messages::ImuData;
use stampfly_types::{GRAVITY, Instant, Vec3};

pub(super) fn is(arrays: &Arrays) -> bool {
    ["t", "data", "cols"].iter().all(|name| arrays.contains_key(*name))
}

/// A table with named columns.
struct Table<'a> {
    names: &'a [String],
    data: &'a Array,
}

impl<'a> Table<'a> {
    /// The numbers of these columns, row by row.
    fn columns<const N: usize>(
        &self,
        names: [&str; N],
    ) -> Result<impl Iterator<Item = [f64; N]> + use<'a, N>, DatasetErrorKind> {
        let Elements::Numbers(values) = &self.data.elements else { return Err(broken("data", "text, not numbers")) };
        let mut places = [0; N];
        for (place, name) in places.iter_mut().zip(names) {
            let found = self.names.iter().position(|known| known == name).filter(|place| *place < self.data.columns);
            *place = found.ok_or_else(|| broken(name, "no such column"))?;
        }
        let rows = values.chunks_exact(self.data.columns);
        Ok(rows.map(move |row| places.map(|place| row.get(place).copied().unwrap_or(f64::NAN))))
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

pub(super) fn read(name: &str, arrays: &Arrays) -> Result<Recording, DatasetErrorKind> {
    let (Some(cols), Some(data)) = (arrays.get("cols"), arrays.get("data")) else {
        return Err(broken("data", "missing"));
    };
    let Elements::Text(names) = &cols.elements else { return Err(broken("cols", "numbers, not names")) };
    let time = numbers::<1>(arrays, "t")?;
    if time.len() != data.rows || data.columns == 0 {
        return Err(broken("data", format!("{} rows for {} times", data.rows, time.len())));
    }
    let stamps = time.iter().map(|[seconds]| match (0.0..3.2e8).contains(seconds) {
        true => Ok(Instant::from_micros((seconds * 1e6 + 0.5) as u64)),
        false => Err(broken("t", format!("{seconds} is not a time"))),
    });
    let stamps: Vec<Instant> = stamps.collect::<Result<_, _>>()?;
    let table = Table { names, data };

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
    recording.truth = (stamps.iter().zip(turn.zip(place)))
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
    let own = stamps.iter().zip(turn.zip(place)).filter_map(|(at, ([w, x, y, z], (position, velocity)))| {
        let attitude = attitude(w, x, -y, -z)?;
        Some(DevicePoint { at: *at, attitude, position: Some(seen(position)?), velocity: seen(velocity)? })
    });
    recording.device = Some(own.collect());
    Ok(recording)
}
