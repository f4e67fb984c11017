//! Still calibration after every power-on: waits until the vehicle lies still, then averages.
//!
//! Finds the gyro bias, the specific force for the initial attitude, the magnetic field and the
//! altitude. Stillness is defined by [`StillAverage`].
//!
//! Not for soft or hard iron, nor for accelerometer scale: those require the vehicle to be turned.

use super::{NotStill, StillAverage, StillMean, StillnessConfig};
use stampfly_types::messages::{BaroData, CalibrationResult, ImuData, MagData};
use stampfly_types::{GRAVITY, Instant, Vec3};

/// Quality of a completed still calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StillQuality {
    /// Standard deviation of one gyro sample, rad/s.
    pub gyro_noise: Vec3,
    /// Standard deviation of one accelerometer sample, m/s².
    pub accel_noise: Vec3,
    /// Length of the mean specific force minus gravity, m/s²: scale and bias of the accelerometer.
    pub force_error: f32,
    /// Number of samples averaged.
    pub samples: u32,
}

/// Still calibration.
///
/// ```
/// use stampfly_eskf::calibration::StillCalibration;
/// use stampfly_types::{Instant, Vec3, messages::ImuData};
/// let mut calibration = StillCalibration::default();
/// for k in 0..1500 {
///     // A sensor has noise. With one that repeats a value the calibration never completes.
///     let noise = Vec3::repeat(if k % 2 == 0 { 1e-3 } else { -1e-3 });
///     let accel = Vec3::new(0.0, 0.0, -9.81) + noise;
///     let still = ImuData { accel, gyro: Vec3::new(0.01, 0.0, 0.0) + noise, temperature: 25.0, ..Default::default() };
///     calibration.step(Instant::from_micros(2_500 * k), &still).unwrap();
/// }
/// let result = calibration.result();
/// assert!(result.complete && (result.gyro_bias.x - 0.01).abs() < 1e-5);
/// assert!(calibration.quality().unwrap().force_error.abs() < 0.01);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StillCalibration {
    average: StillAverage,
    mean: Option<StillMean>,
    field: Vec3,
    altitude: Option<f32>,
    result: CalibrationResult,
    last: [f32; 6],
    /// Number of consecutive repetitions of each axis.
    equal: [u32; 6],
}

/// Repetitions after which an axis counts as frozen: 50 ms at 400 Hz. One axis repeats a sample by
/// chance with a probability below 0.3, and this often with 10⁻¹⁰.
const FROZEN: u32 = 20;

impl StillCalibration {
    /// Nothing collected yet.
    #[must_use]
    pub fn new(config: StillnessConfig) -> Self {
        Self { average: StillAverage::new(config), ..Self::default() }
    }

    /// Takes an inertial sample. Ignored after completion.
    ///
    /// # Errors
    /// The reason for which the sample is not used. The collection restarts, except for a sample
    /// that is not finite. It never completes while an axis is frozen.
    pub fn step(&mut self, now: Instant, imu: &ImuData) -> Result<(), NotStill> {
        if self.result.complete {
            return Ok(());
        }
        let begun = self.average.progress() > 0.0;
        let mut step = self.average.step(now, imu);
        if self.is_frozen(imu) {
            self.average.drop_stretch(now);
            step = Err(NotStill::Frozen);
        }
        self.result.progress = self.average.progress();
        // Count only interruptions of a collection, not every moving sample.
        if step.is_err() && begun && self.result.progress == 0.0 {
            self.result.restarts = self.result.restarts.wrapping_add(1);
        }
        if let Some(mean) = step? {
            self.mean = Some(mean);
            self.result.gyro_bias = mean.gyro;
            self.result.specific_force = mean.accel;
            self.result.field = self.field;
            self.result.baro_altitude = self.altitude.unwrap_or(0.0);
            self.result.progress = 1.0;
            self.result.complete = true;
        }
        Ok(())
    }

    /// Whether an axis repeats its value.
    fn is_frozen(&mut self, imu: &ImuData) -> bool {
        let values = imu.accel.iter().chain(imu.gyro.iter());
        for ((value, last), equal) in values.zip(&mut self.last).zip(&mut self.equal) {
            *equal = if value.to_bits() == last.to_bits() { equal.saturating_add(1) } else { 0 };
            *last = *value;
        }
        self.equal.iter().any(|equal| *equal >= FROZEN)
    }

    /// Takes a magnetometer sample into the running mean.
    pub fn add_mag(&mut self, mag: &MagData) {
        if mag.field.iter().all(|v| v.is_finite()) {
            let first = self.field == Vec3::zeros();
            self.field += (mag.field - self.field) * if first { 1.0 } else { 0.1 };
        }
    }

    /// Takes a barometer sample into the running mean.
    pub fn add_baro(&mut self, baro: &BaroData) {
        if baro.altitude.is_finite() {
            self.altitude = Some(self.altitude.map_or(baro.altitude, |a| a + 0.1 * (baro.altitude - a)));
        }
    }

    /// The result so far.
    #[must_use]
    pub fn result(&self) -> CalibrationResult {
        self.result
    }

    /// Its quality; `None` before completion.
    #[must_use]
    pub fn quality(&self) -> Option<StillQuality> {
        self.mean.map(|mean| StillQuality {
            gyro_noise: mean.gyro_noise,
            accel_noise: mean.accel_noise,
            force_error: mean.accel.norm() - GRAVITY,
            samples: mean.samples,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With the smallest noise.
    fn still(k: u64) -> ImuData {
        let noise = Vec3::repeat(if k.is_multiple_of(2) { 1e-6 } else { -1e-6 });
        let accel = Vec3::new(0.1, 0.0, -9.8) + noise;
        ImuData { accel, gyro: Vec3::new(0.01, -0.02, 0.005) + noise, temperature: 30.0, ..Default::default() }
    }

    #[test]
    fn d7_a_sensor_that_repeats_itself_never_completes() {
        let stuck: [fn(u64) -> ImuData; 4] = [
            |_| still(0),
            |k| ImuData { gyro: still(0).gyro, ..still(k) },
            |k| ImuData { accel: still(0).accel, ..still(k) },
            // It fails half-way.
            |k| still(k.min(900)),
        ];
        for sensor in stuck {
            let mut calibration = StillCalibration::default();
            let frozen = (0..8_000u64)
                .filter(|k| calibration.step(Instant::from_micros(2_500 * k), &sensor(*k)) == Err(NotStill::Frozen));
            assert!(frozen.count() > 5_000);
            assert!(!calibration.result().complete && calibration.result().progress < 0.6);
        }
    }

    #[test]
    fn motion_starts_the_average_again() {
        let mut calibration = StillCalibration::default();
        for k in 0..1000u64 {
            calibration.step(Instant::from_micros(2_500 * k), &still(k)).unwrap();
        }
        assert!(calibration.result().progress > 0.5);
        for k in 1000..1020u64 {
            let turning = ImuData { gyro: Vec3::new(1.0, 0.0, 0.0), ..still(k) };
            assert!(calibration.step(Instant::from_micros(2_500 * k), &turning).is_err());
        }
        assert_eq!((calibration.result().progress, calibration.result().restarts), (0.0, 1));
        for k in 1020..4000u64 {
            // The running means forget within some tenths of a second.
            let _ = calibration.step(Instant::from_micros(2_500 * k), &still(k));
        }
        let result = calibration.result();
        assert!(result.complete && (result.gyro_bias - still(0).gyro).norm() < 1e-5, "the motion left no trace");
    }

    #[test]
    fn a_hand_is_never_still() {
        let mut calibration = StillCalibration::default();
        for k in 0..8000u64 {
            let swing = stampfly_types::math::sin(k as f32 * 0.03) * 0.2;
            let _ = calibration
                .step(Instant::from_micros(2_500 * k), &ImuData { gyro: Vec3::new(swing, 0.0, 0.0), ..still(k) });
        }
        assert!(!calibration.result().complete && calibration.quality().is_none());
    }

    #[test]
    fn a_sample_that_is_not_finite_is_left_out_and_ends_nothing() {
        let mut calibration = StillCalibration::default();
        for k in 0..1600u64 {
            calibration.step(Instant::from_micros(2_500 * k), &still(k)).unwrap();
            let broken = ImuData { accel: Vec3::new([f32::NAN, 1e30][k as usize % 2], 0.0, 0.0), ..still(k) };
            assert!(k > 1300 || calibration.step(Instant::from_micros(2_500 * k), &broken) == Err(NotStill::NotFinite));
        }
        let quality = calibration.quality().unwrap();
        assert!(calibration.result().complete && calibration.result().restarts == 0);
        assert!(quality.accel_noise.amax() < 1e-3 && quality.gyro_noise.amax() < 1e-5, "{quality:?}");
    }
}
