//! Results of all calibrations of one vehicle, and their application to samples.
//!
//! [`Corrections`] are the numbers, kept as parameters of the vehicle. A [`Corrector`] applies them
//! once, where a driver's samples are published. Without a calibration a sample passes unchanged,
//! bit for bit.
//!
//! Order: drift with temperature, bias and scale of the accelerometer, tilt of the sensor. Not for
//! quantities that change from one power-on to the next: those belong to
//! [`StillCalibration`](super::StillCalibration) and the estimator.

use super::{AccelCorrection, Trim};
use stampfly_types::Vec3;
use stampfly_types::messages::{CalibrationKind, CalibrationReport, CalibrationStage, ImuData, MagData};

/// Tilt of the inertial sensor in the airframe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LevelCorrection {
    /// Roll of the sensor relative to the airframe, rad.
    pub roll: f32,
    /// Pitch of the sensor relative to the airframe, rad.
    pub pitch: f32,
}

/// Hard and soft iron: symmetric matrix · (measured − offset).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct IronCorrection {
    /// Hard iron, body FRD, µT.
    pub offset: Vec3,
    /// Diagonal of the matrix.
    pub diagonal: Vec3,
    /// Off-diagonal elements: xy, xz, yz.
    pub across: Vec3,
}

impl Default for IronCorrection {
    fn default() -> Self {
        Self { offset: Vec3::zeros(), diagonal: Vec3::repeat(1.0), across: Vec3::zeros() }
    }
}

impl IronCorrection {
    /// The corrected field, body FRD, µT.
    #[must_use]
    pub fn correct(&self, measured: Vec3) -> Vec3 {
        let (field, Vec3 { x: xy, y: xz, z: yz }) = (measured - self.offset, self.across);
        field.component_mul(&self.diagonal)
            + Vec3::new(xy * field.y + xz * field.z, xy * field.x + yz * field.z, xz * field.x + yz * field.y)
    }

    /// The measurement that [`correct`](Self::correct) maps to this field. `None` for a singular
    /// matrix.
    #[must_use]
    pub fn undo(&self, field: Vec3) -> Option<Vec3> {
        let (Vec3 { x: a, y: b, z: c }, Vec3 { x: xy, y: xz, z: yz }) = (self.diagonal, self.across);
        let matrix = nalgebra::Matrix3::new(a, xy, xz, xy, b, yz, xz, yz, c);
        Some(Vec3::from(matrix.try_inverse()? * nalgebra::Vector3::from(field)) + self.offset)
    }
}

/// Linear drift with the temperature of the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DriftCorrection {
    /// Temperature without correction, °C.
    pub reference: f32,
    /// Gyro bias per kelvin, body FRD, rad/s/K.
    pub gyro: Vec3,
    /// Accelerometer bias per kelvin, body FRD, m/s²/K.
    pub accel: Vec3,
}

impl Default for DriftCorrection {
    fn default() -> Self {
        Self { reference: 25.0, gyro: Vec3::zeros(), accel: Vec3::zeros() }
    }
}

/// Results of all calibrations. The default corrects nothing.
///
/// ```
/// use stampfly_eskf::calibration::{Corrections, Corrector};
/// use stampfly_types::{Vec3, messages::ImuData};
/// let mut found = Corrections::default();
/// found.accel.bias = Vec3::new(0.1, 0.0, -0.2);
/// let mut sample = ImuData { accel: Vec3::new(0.1, 0.0, -10.0), temperature: 25.0, ..Default::default() };
/// Corrector::new(&found).imu(&mut sample);
/// assert_eq!(sample.accel, Vec3::new(0.0, 0.0, -9.8));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Corrections {
    /// Bias and scale of the accelerometer.
    pub accel: AccelCorrection,
    /// Tilt of the inertial sensor.
    pub level: LevelCorrection,
    /// Hard and soft iron of the magnetometer.
    pub mag: IronCorrection,
    /// Drift with temperature.
    pub drift: DriftCorrection,
}

impl Corrections {
    /// The rotation from the sensor to the airframe.
    #[must_use]
    pub fn trim(&self) -> Trim {
        Trim::of(self.level.roll, self.level.pitch)
    }

    /// The measured specific force, body FRD, m/s², of a corrected one; the drift stays corrected.
    #[must_use]
    pub fn undo_accel(&self, corrected: Vec3) -> Vec3 {
        let AccelCorrection { bias, scale } = self.accel;
        self.trim().undo(corrected).component_div(&scale) + bias
    }

    /// Adopts the result of a calibration, for the next start. Returns false and changes nothing if
    /// there is no result.
    ///
    /// The level trim is computed from corrected accelerations. A six-position calibration
    /// therefore clears an earlier level trim, which must be repeated after it.
    ///
    /// ```
    /// use stampfly_eskf::calibration::Corrections;
    /// use stampfly_types::messages::{CalibrationKind, CalibrationReport, CalibrationStage};
    /// let (mut vehicle, mut report) = (Corrections::default(), CalibrationReport::default());
    /// assert!(!vehicle.accept(&report));
    /// report.kind = CalibrationKind::SixPositions;
    /// report.stage = CalibrationStage::Done;
    /// report.values = [0.1, 0.0, -0.1, 1.01, 1.0, 0.99, 0.0, 0.0, 0.0];
    /// assert!(vehicle.accept(&report) && vehicle.accel.bias.x == 0.1 && vehicle.accel.scale.z == 0.99);
    /// ```
    #[must_use]
    pub fn accept(&mut self, report: &CalibrationReport) -> bool {
        if report.stage != CalibrationStage::Done {
            return false;
        }
        let [a, b, c, d, e, f, g, h, i] = report.values;
        let (first, second, third) = (Vec3::new(a, b, c), Vec3::new(d, e, f), Vec3::new(g, h, i));
        match report.kind {
            CalibrationKind::None => return false,
            CalibrationKind::Level => {
                // The report holds the uncorrected mean force, so that the trim fits the present
                // correction.
                let trim = Trim::levelling(&self.accel.correct(first));
                self.level = LevelCorrection { roll: trim.roll, pitch: trim.pitch };
            }
            CalibrationKind::SixPositions => {
                self.accel = AccelCorrection { bias: first, scale: second };
                self.level = LevelCorrection::default();
            }
            CalibrationKind::Magnetometer => {
                self.mag = IronCorrection { offset: first, diagonal: second, across: third };
            }
            CalibrationKind::Temperature => {
                self.drift = DriftCorrection { gyro: first, accel: second, reference: g };
            }
        }
        true
    }
}

/// The drift correction follows the temperature in steps of this size, K. Otherwise the
/// temperature's noise would make a sensor that repeats one value look alive. A step changes a rate
/// by less than the noise of one sample.
const STEP: f32 = 0.5;

/// Applies [`Corrections`] to samples.
///
/// ```
/// use stampfly_eskf::calibration::{Corrections, Corrector};
/// use stampfly_types::{Vec3, messages::MagData};
/// let mut found = Corrections::default();
/// found.mag.offset.y = 12.0;
/// let mut sample = MagData { field: Vec3::new(30.0, 7.0, 36.0) };
/// Corrector::new(&found).mag(&mut sample);
/// assert_eq!(sample.field, Vec3::new(30.0, -5.0, 36.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corrector {
    corrections: Corrections,
    trim: Option<Trim>,
    /// Temperature used for the drift correction; `None` before the first one, and without drift.
    temperature: Option<f32>,
}

impl Corrector {
    /// A corrector with these corrections.
    #[must_use]
    pub fn new(corrections: &Corrections) -> Self {
        let trim = (corrections.level != LevelCorrection::default()).then(|| corrections.trim());
        Self { corrections: *corrections, trim, temperature: None }
    }

    /// The corrections in use.
    #[must_use]
    pub const fn corrections(&self) -> &Corrections {
        &self.corrections
    }

    /// Corrects an inertial sample.
    pub fn imu(&mut self, sample: &mut ImuData) {
        let Corrections { accel, drift, .. } = &self.corrections;
        if (drift.gyro, drift.accel) != Default::default() {
            if sample.temperature.is_finite()
                && self.temperature.is_none_or(|used| (sample.temperature - used).abs() > STEP)
            {
                self.temperature = Some(sample.temperature);
            }
            if let Some(used) = self.temperature {
                let above = used - drift.reference;
                sample.gyro -= drift.gyro * above;
                sample.accel -= drift.accel * above;
            }
        }
        if *accel != AccelCorrection::default() {
            sample.accel = accel.correct(sample.accel);
        }
        if let Some(trim) = &self.trim {
            sample.accel = trim.correct(sample.accel);
            sample.gyro = trim.correct(sample.gyro);
        }
    }

    /// Corrects a magnetic sample. It is not rotated by the trim, which belongs to the inertial
    /// sensor, another chip.
    pub fn mag(&self, sample: &mut MagData) {
        let iron = &self.corrections.mag;
        if *iron != IronCorrection::default() {
            sample.field = iron.correct(sample.field);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector(limit: f32) -> impl Strategy<Value = Vec3> {
        [-limit..limit, -limit..limit, -limit..limit].prop_map(|[x, y, z]| Vec3::new(x, y, z))
    }

    #[test]
    fn without_a_calibration_every_bit_stays() {
        let mut corrector = Corrector::new(&Corrections::default());
        let sample = ImuData {
            accel: Vec3::new(-0.0, 0.1, f32::from_bits(1)),
            gyro: Vec3::new(-0.0, 1e-30, 3.3),
            accel_peak: 0.7,
            temperature: f32::NAN,
        };
        let (mut imu, mut mag) = (sample, MagData { field: Vec3::new(-0.0, 33.3, 1e-9) });
        corrector.imu(&mut imu);
        corrector.mag(&mut mag);
        let bits = |vector: Vec3| vector.to_array().map(f32::to_bits);
        assert_eq!((bits(imu.accel), bits(imu.gyro)), (bits(sample.accel), bits(sample.gyro)));
        assert_eq!(bits(mag.field), bits(Vec3::new(-0.0, 33.3, 1e-9)));
    }

    #[test]
    fn a_sensor_that_repeats_itself_still_does() {
        let mut found = Corrections::default();
        found.drift.gyro.x = 1e-3;
        let mut corrector = Corrector::new(&found);
        let mut last = None;
        for k in 0..200_u16 {
            // Only the temperature changes.
            let temperature = 30.0 + 0.02 * f32::from(k % 7);
            let mut sample = ImuData { gyro: Vec3::new(0.25, 0.0, 0.0), temperature, ..Default::default() };
            corrector.imu(&mut sample);
            assert_eq!(*last.get_or_insert(sample.gyro.x.to_bits()), sample.gyro.x.to_bits());
        }
    }

    proptest! {
        #[test]
        fn what_is_undone_is_what_was_measured(
            bias in vector(1.0), scale in vector(0.1), roll in -0.08f32..0.08, pitch in -0.08f32..0.08,
            offset in vector(60.0), stretch in vector(0.2), across in vector(0.1), measured in vector(60.0),
        ) {
            let one = Vec3::repeat(1.0);
            let found = Corrections {
                accel: AccelCorrection { bias, scale: one + scale },
                level: LevelCorrection { roll, pitch },
                mag: IronCorrection { offset, diagonal: one + stretch, across },
                ..Default::default()
            };
            let mut imu = ImuData { accel: measured, ..Default::default() };
            Corrector::new(&found).imu(&mut imu);
            prop_assert!((found.undo_accel(imu.accel) - measured).amax() < 1e-4);
            let again = found.mag.undo(found.mag.correct(measured)).unwrap();
            prop_assert!((again - measured).amax() < 1e-3);
        }
    }
}
