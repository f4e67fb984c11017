//! Recorded sensor data, with a reference where there is one, from five public formats, in our conventions.
//!
//! | kind | file | reference |
//! |---|---|---|
//! | [`Kind::StampFlyLog`] | CSV with columns `timestamp_ms`, `raw_accel_x` … `dev_yaw_deg` | the flying device's own estimate |
//! | [`Kind::StampFlyFlight`] | CSV with columns `timestamp_ms`, `gyro_x`, `accel_x` … | where it has `pos_x` …: the device's own estimate |
//! | [`Kind::NanoBench`] | CSV as published, `t,px,py,pz,qx,…`; or NPZ with `t`, `data`, `cols` | motion capture, 100 Hz |
//! | [`Kind::Broad`] | MATLAB 5 as published, `data_mat/*.mat`; or NPZ with `gyr`, `acc`, `mag`, `quat`, `pos`, `movement`, `fs` | motion capture, with gaps |
//! | [`Kind::Px4Replay`] | CSV lines `time_us,sensor,values…` | EKF2's own states, when their file lies beside it ([`load`]) |
//!
//! Which one a file is is found out from its content, never from its name; columns are found by
//! name, in any order. The arrays of an NPZ are those of the published file: `cols` has the names
//! of the columns of `data`; `gyr` to `fs` are BROAD's `imu_gyr`, `imu_acc`, `imu_mag`, `opt_quat`,
//! `opt_pos`, `movement` and `sampling_rate`. HDF5 is not read. Everything comes out in SI units,
//! body FRD, world NED, accelerometer as specific force, whatever the file has. Time stamps are put
//! in order (see [`Timing`]); what had to be dropped or moved for that is counted, never hidden.
//! What a file may unpack to is bounded.

mod broad;
mod csv;
mod ekf2;
mod error;
mod geodetic;
mod mat;
mod nanobench;
mod npz;
mod px4;
mod recording;
mod stampfly;
mod timing;

pub use error::{DatasetError, DatasetErrorKind};
pub use recording::{DevicePoint, GnssFix, Kind, Recording, TruthPoint};
pub use timing::Timing;

use std::path::Path;

/// Reads a recording of any known kind.
///
/// PX4's replay test keeps EKF2's own states in a second file. When it lies beside this one, under PX4's name
/// (`../change_indication/NAME.csv`) or under `change_indication__NAME.csv` for `replay_data__NAME.csv`, its states become the
/// recording's [`device`](Recording::device).
///
/// # Errors
/// When the file cannot be read, is of no known kind, or is broken; the error says where.
pub fn load(path: impl AsRef<Path>) -> Result<Recording, DatasetError> {
    let path = path.as_ref();
    let failed = |kind| DatasetError { file: path.to_owned(), kind };
    let bytes = std::fs::read(path).map_err(DatasetErrorKind::Io).map_err(failed)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut recording = parse(&name, &bytes).map_err(failed)?;
    if recording.kind == Kind::Px4Replay
        && let Some(file) = ekf2::beside(path)
    {
        let failed = |kind| DatasetError { file: file.clone(), kind };
        let bytes = std::fs::read(&file).map_err(DatasetErrorKind::Io).map_err(failed)?;
        recording.device = Some(ekf2::read(&bytes).map_err(failed)?);
    }
    Ok(recording)
}

/// Reads a recording of any known kind from memory.
///
/// ```
/// use stampfly_lab::dataset::{self, Kind};
///
/// let text = "timestamp_ms,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n\
///             10,0,0,0.01,0,0,-9.81\n12,0,0,0.02,0,0,-9.80\n";
/// let recording = dataset::parse("bench", text.as_bytes())?;
/// assert_eq!((recording.kind, recording.imu.len()), (Kind::StampFlyFlight, 2));
/// # Ok::<(), dataset::DatasetErrorKind>(())
/// ```
///
/// # Errors
/// When the bytes are of no known kind or broken.
pub fn parse(name: &str, bytes: &[u8]) -> Result<Recording, DatasetErrorKind> {
    let recording = if bytes.starts_with(b"PK") {
        let arrays = npz::read(bytes)?;
        if nanobench::is(&arrays) {
            nanobench::read(name, &arrays)
        } else if broad::is(&arrays) {
            broad::read(name, &arrays)
        } else {
            let names: Vec<_> = arrays.keys().map(String::as_str).collect();
            Err(DatasetErrorKind::Unknown { begins: format!("NPZ with {}", names.join(", ")) })
        }
    } else if mat::is(bytes) {
        broad::read_mat(name, bytes)
    } else if bytes.starts_with(b"\x89HDF") || bytes.starts_with(b"MATLAB 7.3") {
        Err(DatasetErrorKind::Hdf5)
    } else {
        let first = bytes.split(|byte| *byte == b'\n').next().unwrap_or_default();
        let header = csv::header(bytes);
        if stampfly::is_log(&header) {
            stampfly::read_log(name, bytes)
        } else if stampfly::is_flight(&header) {
            stampfly::read_flight(name, bytes)
        } else if nanobench::is_text(&header) {
            nanobench::read_text(name, bytes)
        } else if px4::is(first) {
            px4::read(name, bytes)
        } else {
            let begins: String = String::from_utf8_lossy(first).chars().filter(|c| !c.is_control()).take(60).collect();
            Err(DatasetErrorKind::Unknown { begins })
        }
    }?;
    if recording.imu.is_empty() { Err(DatasetErrorKind::Empty) } else { Ok(recording) }
}
