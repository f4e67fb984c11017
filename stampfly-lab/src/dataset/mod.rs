//! Recorded sensor data, with a reference where there is one, from five public formats, in our conventions.
//!
//! | kind | file | reference |
//! |---|---|---|
//! | [`Kind::StampFlyLog`] | CSV of 22 or 25 columns, `raw_accel_x` … `dev_yaw_deg` | the flying device's own estimate |
//! | [`Kind::StampFlyFlight`] | CSV of 7, 11 or 29 columns, `gyro_x` … | 29 columns: the device's own estimate |
//! | [`Kind::NanoBench`] | NPZ with `t`, `data`, `cols` | motion capture, 100 Hz |
//! | [`Kind::Broad`] | NPZ with `gyr`, `acc`, `mag`, `quat`, … | motion capture, with gaps |
//! | [`Kind::Px4Replay`] | CSV lines `time_us,sensor,values…` | none |
//!
//! Which one a file is is found out from its content, never from its name. Everything comes out in SI units, body
//! FRD, world NED, accelerometer as specific force, whatever the file has. Time stamps are put in order (see
//! [`Timing`]); what had to be dropped or moved for that is counted, never hidden.

mod broad;
mod csv;
mod nanobench;
mod npz;
mod px4;
mod stampfly;
mod timing;

pub use timing::Timing;

use crate::flight::Flight;
use stampfly_drivers::Sample;
use stampfly_types::messages::{BaroData, FlowData, ImuData, MagData, TofData};
use stampfly_types::{Duration, Instant, Message, Quat, Vec3, message};
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

/// Where a recording comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// Sensor log of a StampFly, moved by hand.
    StampFlyLog,
    /// Capture of a StampFly, flying.
    StampFlyFlight,
    /// NanoBench: Crazyflie 2.1 under motion capture.
    NanoBench,
    /// BROAD: an IMU moved by hand under motion capture.
    Broad,
    /// Input of PX4's estimator, for its replay test.
    Px4Replay,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::StampFlyLog => "StampFly sensor log",
            Self::StampFlyFlight => "StampFly flight capture",
            Self::NanoBench => "NanoBench flight",
            Self::Broad => "BROAD trial",
            Self::Px4Replay => "PX4 EKF2 replay",
        })
    }
}

/// What an outside observer saw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthPoint {
    /// When.
    pub at: Instant,
    /// Body FRD → world NED.
    pub attitude: Option<Quat>,
    /// World NED, metres.
    pub position: Option<Vec3>,
    /// World NED, m/s.
    pub velocity: Option<Vec3>,
    /// Does the data set's own metric count this point?
    pub counts: bool,
}

/// What the recording device itself believed at the time. A comparison, not a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DevicePoint {
    /// When.
    pub at: Instant,
    /// Body FRD → world NED.
    pub attitude: Quat,
    /// World NED, metres.
    pub position: Vec3,
    /// World NED, m/s.
    pub velocity: Vec3,
}

/// One recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Where it comes from.
    pub kind: Kind,
    /// The file's name without folder and ending.
    pub name: String,
    /// Inertial samples, strictly in order.
    pub imu: Vec<Sample<ImuData>>,
    /// Ranges to the ground.
    pub tof: Vec<Sample<TofData>>,
    /// Optical flow.
    pub flow: Vec<Sample<FlowData>>,
    /// Magnetic field.
    pub mag: Vec<Sample<MagData>>,
    /// Barometric altitude.
    pub baro: Vec<Sample<BaroData>>,
    /// The reference; empty when there is none.
    pub truth: Vec<TruthPoint>,
    /// Stretches of the reference without an attitude.
    pub truth_gaps: usize,
    /// The device's own estimate, if recorded.
    pub device: Option<Vec<DevicePoint>>,
    /// What was done to the time stamps of the inertial samples.
    pub timing: Timing,
    /// Rows of sensors that are of no use here, by name.
    pub skipped: BTreeMap<String, usize>,
}

/// Why a file is no recording.
#[derive(Debug)]
pub struct DatasetError {
    /// The file.
    pub file: PathBuf,
    /// What is wrong with it.
    pub kind: DatasetErrorKind,
}

/// What is wrong with a file.
#[derive(Debug)]
#[non_exhaustive]
pub enum DatasetErrorKind {
    /// It could not be read.
    Io(std::io::Error),
    /// None of the known formats begins like this.
    Unknown {
        /// The first characters.
        begins: String,
    },
    /// A line of a CSV file is broken.
    Line {
        /// Line number, from one.
        line: usize,
        /// The column.
        field: String,
        /// What is wrong.
        problem: String,
    },
    /// An array of an NPZ file is missing or broken.
    Array {
        /// The array, or column of an array.
        field: String,
        /// What is wrong.
        problem: String,
    },
    /// There is not one usable inertial sample.
    Empty,
}

impl fmt::Display for DatasetErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io(error) => error.fmt(f),
            Self::Unknown { begins } => write!(f, "no known kind of recording begins with `{begins}`"),
            Self::Line { line, field, problem } => write!(f, "line {line}: {field}: {problem}"),
            Self::Array { field, problem } => write!(f, "array {field}: {problem}"),
            Self::Empty => f.write_str("no usable inertial sample"),
        }
    }
}

impl fmt::Display for DatasetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.file.display(), self.kind)
    }
}

impl std::error::Error for DatasetError {}

/// Reads a recording of any known kind.
///
/// # Errors
/// When the file cannot be read, is of no known kind, or is broken; the error says where.
pub fn load(path: impl AsRef<Path>) -> Result<Recording, DatasetError> {
    let path = path.as_ref();
    let failed = |kind| DatasetError { file: path.to_owned(), kind };
    let bytes = std::fs::read(path).map_err(DatasetErrorKind::Io).map_err(failed)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    parse(&name, &bytes).map_err(failed)
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
    } else {
        let first = bytes.split(|byte| *byte == b'\n').next().unwrap_or_default();
        if stampfly::is_log(first) {
            stampfly::read_log(name, bytes)
        } else if stampfly::is_flight(first) {
            stampfly::read_flight(name, bytes)
        } else if px4::is(first) {
            px4::read(name, bytes)
        } else {
            let begins: String = String::from_utf8_lossy(first).chars().filter(|c| !c.is_control()).take(60).collect();
            Err(DatasetErrorKind::Unknown { begins })
        }
    }?;
    if recording.imu.is_empty() { Err(DatasetErrorKind::Empty) } else { Ok(recording) }
}

impl std::error::Error for DatasetErrorKind {}

message! {
    /// How [`TruthPoint`] and [`DevicePoint`] look as a topic.
    struct Pose {
        /// Body FRD → world NED.
        attitude: Quat,
        /// World NED.
        position: Vec3 ["m"],
        /// World NED.
        velocity: Vec3 ["m/s"],
    }
}

impl Recording {
    /// A recording with inertial samples only; their stamps are put in order.
    fn new(kind: Kind, name: &str, imu: Vec<Sample<ImuData>>, clock: timing::Clock) -> Self {
        let (imu, timing) = timing::put_in_order(imu, clock);
        Self {
            kind,
            name: name.to_owned(),
            imu,
            tof: Vec::new(),
            flow: Vec::new(),
            mag: Vec::new(),
            baro: Vec::new(),
            truth: Vec::new(),
            truth_gaps: 0,
            device: None,
            timing,
            skipped: BTreeMap::new(),
        }
    }

    /// First to last inertial sample.
    #[must_use]
    pub fn duration(&self) -> Duration {
        match (self.imu.first(), self.imu.last()) {
            (Some(first), Some(last)) => last.at.since(first.at),
            _ => Duration::ZERO,
        }
    }

    /// The recording as a flight: `sensor_imu` …, `truth` and `device`, to plot beside an estimate.
    #[must_use]
    pub fn to_flight(&self) -> Flight {
        fn sensor<M: Message>(flight: &mut Flight, topic: &str, samples: &[Sample<M>]) {
            samples.iter().for_each(|sample| flight.push(topic, sample.at, &sample.data));
        }
        let mut flight = Flight::default();
        flight.info.insert("recording".to_owned(), format!("{}, {}", self.name, self.kind));
        sensor(&mut flight, "sensor_imu", &self.imu);
        sensor(&mut flight, "sensor_tof", &self.tof);
        sensor(&mut flight, "sensor_flow", &self.flow);
        sensor(&mut flight, "sensor_mag", &self.mag);
        sensor(&mut flight, "sensor_baro", &self.baro);
        for point in &self.truth {
            let pose = [
                point.attitude.map(|attitude| Pose { attitude, ..Default::default() }),
                point.position.map(|position| Pose { position, ..Default::default() }),
                point.velocity.map(|velocity| Pose { velocity, ..Default::default() }),
            ];
            // What was not seen is not a number, so that plots show a gap.
            let words: [u32; Pose::WORDS] = std::array::from_fn(|word| {
                let part = match word {
                    0..4 => 0,
                    4..7 => 1,
                    _ => 2,
                };
                pose[part].map_or(f32::NAN.to_bits(), |pose| pose.to_words()[word])
            });
            flight.push_words("truth", point.at, Pose::FIELDS, &words);
        }
        for DevicePoint { at, attitude, position, velocity } in self.device.iter().flatten() {
            let pose = Pose { attitude: *attitude, position: *position, velocity: *velocity };
            flight.push("device", *at, &pose);
        }
        flight
    }
}

/// The unit quaternion nearest to these numbers; `None` when they are not finite or far from one.
fn attitude(w: f64, x: f64, y: f64, z: f64) -> Option<Quat> {
    let norm = (w * w + x * x + y * y + z * z).sqrt();
    ((norm - 1.0).abs() < 0.05).then(|| {
        let [w, x, y, z] = [w, x, y, z].map(|value| (value / norm) as f32);
        Quat::new_unchecked(nalgebra::Quaternion::new(w, x, y, z))
    })
}
