//! Samples to attitude: mounting, offsets, filters, and Mahony's filter; and the calibration that finds the offsets.
//!
//! Each axis has a low-pass of two equal second-order sections, −6 dB at its corner. Mahony's filter has no integral term, so a gyro offset of 0.01 rad/s leaves a tilt of
//! one degree: calibrate. A calibration takes the mean of everything it is shown, on a level table, and starts the attitude anew.

use crate::messages::{Attitude, SensorOffsets};
use crate::parameters::{FilterParameters, OffsetParameters, Parameters};
use crate::rate_loops::{PERIOD, RATE};
use serde::{Deserialize, Serialize};
use stampfly_control::filter::{BiquadAxes, BiquadCoefficients};
use stampfly_drivers::chip::{Axis, AxisMap};
use stampfly_eskf::attitude::Mahony;
use stampfly_types::messages::ImuData;
use stampfly_types::{GRAVITY, Quat, Vec3, frame};

/// How the chip sits on the board: its x axis points right, y forward, z up.
pub const MOUNTING: AxisMap = match AxisMap::new(Axis::PlusY, Axis::PlusX, Axis::MinusZ) {
    Some(map) => map,
    None => panic!("no rotation"),
};
/// Gain of Mahony's filter, 1/s.
const GAIN: f32 = 0.5;

/// A parameter is within its range, so there is a filter; one that passes everything otherwise.
fn design(corner: f32) -> BiquadCoefficients {
    let through = BiquadCoefficients { b: [1.0, 0.0, 0.0], a: [0.0; 2] };
    BiquadCoefficients::low_pass(corner, RATE, BiquadCoefficients::BUTTERWORTH).unwrap_or(through)
}

/// Sums over a calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Sums {
    /// In double precision: eight thousand samples lose a digit otherwise.
    values: [f64; 6],
    count: u32,
}

impl Sums {
    fn add(&mut self, accel: &Vec3, gyro: &Vec3) {
        let sample = accel.to_array().into_iter().chain(gyro.to_array());
        self.values.iter_mut().zip(sample).for_each(|(sum, value)| *sum += f64::from(value));
        self.count += 1;
    }

    fn offsets(&self) -> SensorOffsets {
        let count = f64::from(self.count.max(1));
        let [ax, ay, az, gx, gy, gz] = self.values.map(|sum| (sum / count) as f32);
        // A level vehicle that stands measures −1 g downwards.
        SensorOffsets { accel: Vec3::new(ax, ay, az + GRAVITY), gyro: Vec3::new(gx, gy, gz) }
    }
}

/// The sensing of the vehicle.
///
/// ```
/// use stampfly_stm32_quad::{Parameters, attitude::Sensing};
/// use stampfly_types::{Vec3, messages::ImuData};
/// let parameters = Parameters::default();
/// let mut sensing = Sensing::new(&parameters);
/// let still = ImuData { accel: Vec3::new(0.1, 0.0, -9.8), gyro: Vec3::new(0.02, 0.0, 0.0), ..Default::default() };
/// for _ in 0..8_000 {
///     assert_eq!(sensing.step(&still, true).1, None);
/// }
/// let (attitude, found) = sensing.step(&still, false);
/// assert!((found.unwrap().gyro.x - 0.02).abs() < 1e-6 && attitude.rate.x.abs() < 1e-6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensing {
    offsets: SensorOffsets,
    /// Board → body.
    mounted: Quat,
    /// While it calibrates.
    sums: Option<Sums>,
    accel: BiquadAxes<f32, 2>,
    gyro: BiquadAxes<f32, 2>,
    mahony: Mahony,
    /// Has there been a sample? The filters begin with the first, not with zero.
    begun: bool,
}

impl Sensing {
    /// Level, before the first sample.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        let FilterParameters { accel, gyro, .. } = parameters.filter;
        Self {
            offsets: offsets(&parameters.offset),
            mounted: frame::from_yaw(parameters.frame.board_yaw),
            sums: None,
            accel: BiquadAxes::new(design(accel)),
            gyro: BiquadAxes::new(design(gyro)),
            mahony: Mahony::new(GAIN),
            begun: false,
        }
    }

    /// Other parameters, and with them other offsets.
    pub fn adopt(&mut self, parameters: &Parameters) {
        self.offsets = offsets(&parameters.offset);
        self.mounted = frame::from_yaw(parameters.frame.board_yaw);
        self.accel.retune(design(parameters.filter.accel));
        self.gyro.retune(design(parameters.filter.gyro));
    }

    /// Takes a sample. Returns what a calibration has found when it has just ended.
    pub fn step(&mut self, sample: &ImuData, calibrating: bool) -> (Attitude, Option<SensorOffsets>) {
        let (accel, gyro) = (self.mounted * sample.accel, self.mounted * sample.gyro);
        let found = match (&mut self.sums, calibrating) {
            (sums, true) => {
                sums.get_or_insert_default().add(&accel, &gyro);
                None
            }
            (sums, false) => sums.take().map(|sums| sums.offsets()),
        };
        if let Some(found) = found {
            self.offsets = found;
            self.mahony = Mahony::new(GAIN);
        }
        let (accel, gyro) = (accel - self.offsets.accel, gyro - self.offsets.gyro);
        if !self.begun || found.is_some() {
            self.begun = true;
            self.accel.reset(accel.to_array());
            self.gyro.reset(gyro.to_array());
        }
        let vector = |[x, y, z]: [f32; 3]| Vec3::new(x, y, z);
        let accel = vector(self.accel.step(accel.to_array()));
        let rate = vector(self.gyro.step(gyro.to_array()));
        self.mahony.step(&accel, &rate, PERIOD.seconds());
        let attitude = self.mahony.attitude();
        let [roll, pitch, yaw] = frame::roll_pitch_yaw(&attitude);
        (Attitude { attitude, angle: Vec3::new(roll, pitch, yaw), rate, accel }, found)
    }
}

fn offsets(of: &OffsetParameters) -> SensorOffsets {
    SensorOffsets {
        accel: Vec3::new(of.accel_x, of.accel_y, of.accel_z),
        gyro: Vec3::new(of.gyro_x, of.gyro_y, of.gyro_z),
    }
}
