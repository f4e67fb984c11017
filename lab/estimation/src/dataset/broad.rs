//! BROAD: an IMU moved by hand under motion capture.
//!
//! World ENU, attitude from the sensor's frame into it, x and y in the plane and z up when lying flat. The sensor's
//! frame becomes FRD by half a turn about x; ENU becomes NED by swapping north and east and turning z over, which
//! is half a turn about the line between them.

use super::error::DatasetErrorKind;
use super::mat;
use super::npz::{Arrays, broken, numbers};
use super::recording::{Kind, Recording, TruthPoint, attitude};
use super::timing::Clock;
use stampfly_drivers::Sample;
use stampfly_types::messages::{ImuData, MagData};
use stampfly_types::{Instant, Vec3};

pub(super) fn is(arrays: &Arrays) -> bool {
    ["gyr", "acc", "mag", "quat", "movement"].iter().all(|name| arrays.contains_key(*name))
}

/// Names of the arrays as BROAD publishes them, and as they are here.
const PUBLISHED: [(&str, &str); 7] = [
    ("imu_gyr", "gyr"),
    ("imu_acc", "acc"),
    ("imu_mag", "mag"),
    ("opt_quat", "quat"),
    ("opt_pos", "pos"),
    ("sampling_rate", "fs"),
    ("movement", "movement"),
];

/// Reads a trial as BROAD publishes it, `data_mat/NAME.mat`.
pub(super) fn read_mat(name: &str, bytes: &[u8]) -> Result<Recording, DatasetErrorKind> {
    let mut published = mat::read(bytes)?;
    let arrays: Arrays =
        PUBLISHED.iter().filter_map(|(theirs, ours)| Some(((*ours).to_owned(), published.remove(*theirs)?))).collect();
    read(name, &arrays)
}

/// Sensor frame to FRD.
fn body([x, y, z]: [f64; 3]) -> Vec3 {
    Vec3::new(x as f32, -y as f32, -z as f32)
}

pub(super) fn read(name: &str, arrays: &Arrays) -> Result<Recording, DatasetErrorKind> {
    let rate = match numbers::<1>(arrays, "fs")? {
        [[rate]] if (1.0..1e5).contains(rate) => *rate,
        _ => return Err(broken("fs", "not a sampling rate")),
    };
    let gyro = numbers::<3>(arrays, "gyr")?;
    let accel = numbers::<3>(arrays, "acc")?;
    let field = numbers::<3>(arrays, "mag")?;
    let turn = numbers::<4>(arrays, "quat")?;
    let place = numbers::<3>(arrays, "pos")?;
    let moving = numbers::<1>(arrays, "movement")?;
    let others = [("acc", accel.len()), ("mag", field.len()), ("quat", turn.len()), ("pos", place.len())];
    for (name, length) in others.into_iter().chain([("movement", moving.len())]) {
        if length != gyro.len() {
            return Err(broken(name, format!("{length} rows where gyr has {}", gyro.len())));
        }
    }
    let stamp = |row: usize| Instant::from_micros((row as f64 * 1e6 / rate + 0.5) as u64);

    let rows = gyro.iter().zip(accel).enumerate().map(|(row, (gyro, accel))| {
        let data = ImuData { accel: body(*accel), gyro: body(*gyro), temperature: 25.0, ..Default::default() };
        Sample { at: stamp(row), data }
    });
    let mut recording = Recording::new(Kind::Broad, name, rows.collect(), Clock::Even);
    let field = field.iter().enumerate().filter(|(_, field)| field.iter().all(|value| value.is_finite()));
    recording.mag =
        field.map(|(row, field)| Sample { at: stamp(row), data: MagData { field: body(*field) } }).collect();

    let mut unseen = false;
    for (row, ((turn, place), moving)) in turn.iter().zip(place).zip(moving).enumerate() {
        let [w, x, y, z] = *turn;
        // −(0, 1, 1, 0)/√2 ⊗ (w, x, y, z) ⊗ (0, 1, 0, 0): ENU to NED in front, FRD to the sensor's frame behind; a
        // quaternion and its negative are the same attitude.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let attitude = attitude((w + z) * half, (x + y) * half, (x - y) * half, (w - z) * half);
        recording.truth_gaps += usize::from(attitude.is_none() && !unseen);
        unseen = attitude.is_none();
        let [east, north, up] = *place;
        let position = Vec3::new(north as f32, east as f32, -up as f32);
        recording.truth.push(TruthPoint {
            at: stamp(row),
            attitude,
            position: position.iter().all(|value| value.is_finite()).then_some(position),
            velocity: None,
            counts: moving[0] == 1.0 && attitude.is_some(),
        });
    }
    Ok(recording)
}
