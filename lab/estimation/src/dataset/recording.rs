//! One recording: its samples, its reference, and what became of its time stamps.
//!
//! Every reader fills one of these, whatever its format; what follows (an estimator, a plot) knows nothing else.

use super::timing::{Clock, Timing, put_in_order};
use stampfly_drivers::Sample;
use stampfly_host::Flight;
use stampfly_types::messages::{BaroData, FlowData, ImuData, MagData, TofData};
use stampfly_types::{Duration, Instant, Message, Quat, Vec3, message};
use std::collections::BTreeMap;
use std::fmt;

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
    /// World NED, metres; `None` where the log holds none.
    pub position: Option<Vec3>,
    /// World NED, m/s.
    pub velocity: Vec3,
}

/// What a satellite receiver said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GnssFix {
    /// From the recording's first fix, NED, metres.
    pub position: Vec3,
    /// NED, m/s.
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
    /// Fixes of a satellite receiver, stamped when they arrived: they are valid for a moment before.
    pub gnss: Vec<Sample<GnssFix>>,
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

impl Recording {
    /// A recording with inertial samples only; their stamps are put in order.
    pub(super) fn new(kind: Kind, name: &str, imu: Vec<Sample<ImuData>>, clock: Clock) -> Self {
        let (imu, timing) = put_in_order(imu, clock);
        Self {
            kind,
            name: name.to_owned(),
            imu,
            tof: Vec::new(),
            flow: Vec::new(),
            mag: Vec::new(),
            baro: Vec::new(),
            gnss: Vec::new(),
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
        for Sample { at, data } in &self.gnss {
            flight.push("gnss", *at, &Fix { position: data.position, velocity: data.velocity });
        }
        for DevicePoint { at, attitude, position, velocity } in self.device.iter().flatten() {
            // What the log does not hold is not a number, so that plots show a gap.
            let position = position.unwrap_or(Vec3::new(f32::NAN, f32::NAN, f32::NAN));
            let pose = Pose { attitude: *attitude, position, velocity: *velocity };
            flight.push("device", *at, &pose);
        }
        flight
    }
}

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

message! {
    /// How [`GnssFix`] looks as a topic.
    struct Fix {
        /// From the first fix, NED.
        position: Vec3 ["m"],
        /// NED.
        velocity: Vec3 ["m/s"],
    }
}

/// The unit quaternion nearest to these numbers; `None` when they are not finite or far from one.
pub(super) fn attitude(w: f64, x: f64, y: f64, z: f64) -> Option<Quat> {
    let norm = (w * w + x * x + y * y + z * z).sqrt();
    ((norm - 1.0).abs() < 0.05).then(|| {
        let [w, x, y, z] = [w, x, y, z].map(|value| (value / norm) as f32);
        Quat::new_unchecked(w, x, y, z)
    })
}
