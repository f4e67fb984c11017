//! Linear drift of gyro and accelerometer with temperature.
//!
//! The sensor of a small vehicle warms up by ten degrees and more between power-on and landing, and
//! its bias drifts. While the vehicle lies still, its mean rate is the gyro bias, and changes of
//! its mean specific force are those of the accelerometer bias. A line fitted over temperature is
//! the drift.
//!
//! Use it for a range of some ten degrees and a result of a few numbers. For a curved dependence
//! use [`TemperatureTable`](super::TemperatureTable). It finds slopes only; the bias itself is
//! found after every power-on.
//!
//! Method: sums of squares about running means (B. P. Welford, "Note on a method for calculating
//! corrected sums of squares and products", Technometrics 1962), separately for each attitude in
//! which the vehicle lies, then pooled.

use super::{NotStill, StillAverage, StillMean, StillnessConfig};
use stampfly_types::messages::ImuData;
use stampfly_types::{Instant, Vec3, math};

/// Reason for which a sample or a stretch was not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DriftRefusal {
    /// The vehicle moves.
    Moving(NotStill),
    /// The sensor has no temperature.
    NoTemperature,
}

/// A fitted drift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Of the gyro, body FRD, rad/s/K.
    pub gyro: Vec3,
    /// Of the accelerometer, body FRD, m/s²/K.
    pub accel: Vec3,
    /// Mean temperature, °C.
    pub temperature: f32,
    /// Root mean square of the gyro's changes, all axes, rad/s.
    pub before: f32,
    /// The same about the fitted line.
    pub residual: f32,
}

/// Sums about the means of one attitude. The squares and products are kept over all attitudes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Sums {
    /// Stretches in this attitude.
    count: f32,
    temperature: f32,
    gyro: Vec3,
    accel: Vec3,
    /// Stretches in all attitudes.
    all: f32,
    temperature_squares: f32,
    gyro_products: Vec3,
    accel_products: Vec3,
    gyro_squares: f32,
}

impl Sums {
    fn add(&mut self, temperature: f32, mean: &StillMean) {
        self.count += 1.0;
        self.all += 1.0;
        let (warmer, gyro, accel) = (temperature - self.temperature, mean.gyro - self.gyro, mean.accel - self.accel);
        self.temperature += warmer / self.count;
        self.gyro += gyro / self.count;
        self.accel += accel / self.count;
        // Welford: the distance from the old mean times the distance from the new one.
        let after = temperature - self.temperature;
        self.temperature_squares += warmer * after;
        self.gyro_products += gyro * after;
        self.accel_products += accel * after;
        self.gyro_squares += gyro.dot(&(mean.gyro - self.gyro));
    }

    fn moved(&mut self) {
        *self = Self { count: 0.0, temperature: 0.0, gyro: Vec3::zeros(), accel: Vec3::zeros(), ..*self };
    }
}

/// Fit of the drift while a vehicle lies still and warms up or cools down.
///
/// ```
/// use stampfly_eskf::calibration::DriftFit;
/// use stampfly_types::{Instant, Vec3, messages::ImuData};
/// let mut fit = DriftFit::default();
/// for k in 0..40_000 {
///     let temperature = 25.0 + 0.0004 * k as f32;
///     let gyro = Vec3::new(0.0, 2e-4 * temperature, 0.0);
///     let still = ImuData { accel: Vec3::new(0.0, 0.0, -9.81), gyro, temperature, ..Default::default() };
///     fit.step(Instant::from_micros(2_500 * k), &still).unwrap();
/// }
/// let found = fit.solve().unwrap();
/// assert!((found.gyro.y - 2e-4).abs() < 1e-6 && fit.span() > 15.0 && found.residual < 1e-5);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DriftFit {
    average: StillAverage,
    sums: Sums,
    /// Coldest and warmest temperature in this attitude, °C.
    span: [f32; 2],
    /// Largest range of temperature in one attitude, K.
    widest: f32,
}

const NO_SPAN: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

impl Default for DriftFit {
    /// A stretch is one second at 400 Hz, in which the temperature is practically constant.
    fn default() -> Self {
        Self::new(StillnessConfig { samples: 400, force_range: [7.8, 11.8], ..Default::default() })
    }
}

impl DriftFit {
    /// A fit without data.
    #[must_use]
    pub fn new(still: StillnessConfig) -> Self {
        Self { average: StillAverage::new(still), sums: Sums::default(), span: NO_SPAN, widest: 0.0 }
    }

    /// Takes an inertial sample. Returns true when a stretch has been completed.
    ///
    /// # Errors
    /// The reason for which the sample, or with its last sample the stretch, is not used. Earlier
    /// stretches stay.
    pub fn step(&mut self, now: Instant, imu: &ImuData) -> Result<bool, DriftRefusal> {
        match self.average.step(now, imu) {
            Err(reason) => {
                if reason != NotStill::NotFinite {
                    self.sums.moved();
                    self.span = NO_SPAN;
                }
                Err(DriftRefusal::Moving(reason))
            }
            Ok(None) => Ok(false),
            Ok(Some(mean)) => {
                let temperature = mean.temperature.ok_or(DriftRefusal::NoTemperature)?;
                self.sums.add(temperature, &mean);
                let [low, high] = self.span;
                self.span = [low.min(temperature), high.max(temperature)];
                self.widest = self.widest.max(self.span[1] - self.span[0]);
                Ok(true)
            }
        }
    }

    /// Largest change of temperature in one attitude, K.
    #[must_use]
    pub fn span(&self) -> f32 {
        self.widest
    }

    /// The drift. `None` while the temperature has not changed.
    #[must_use]
    pub fn solve(&self) -> Option<Drift> {
        let Sums { all, temperature_squares, gyro_products, accel_products, gyro_squares, .. } = self.sums;
        let gyro = gyro_products / temperature_squares;
        let left = gyro_squares - gyro.dot(&gyro_products);
        let found = Drift {
            gyro,
            accel: accel_products / temperature_squares,
            temperature: self.sums.temperature,
            before: math::sqrt(gyro_squares / all),
            residual: math::sqrt(left.max(0.0) / all),
        };
        let numbers = found.gyro.iter().chain(found.accel.iter());
        (temperature_squares > 0.0 && numbers.chain([&found.residual]).all(|number| number.is_finite()))
            .then_some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::{Duration, GRAVITY};

    #[test]
    fn turned_halfway_it_is_still_the_drift_and_not_the_attitude_that_is_found() {
        let mut fit = DriftFit::default();
        let mut now = Instant::ZERO;
        for k in 0..16_000_u16 {
            now += Duration::from_micros(2_500);
            let temperature = 25.0 + 1e-3 * f32::from(k);
            let turning = (8_000..8_100).contains(&k);
            let up = if k < 8_000 { Vec3::new(0.0, 0.0, -GRAVITY) } else { Vec3::new(0.0, -GRAVITY, 0.0) };
            let gyro =
                Vec3::new(-3e-4, 0.0, 0.0) * temperature + if turning { Vec3::repeat(3.0) } else { Vec3::zeros() };
            let imu = ImuData {
                accel: up + Vec3::new(0.0, 0.0, 2e-3) * temperature,
                gyro,
                temperature,
                ..Default::default()
            };
            let _ = fit.step(now, &imu);
        }
        let found = fit.solve().unwrap();
        assert!((found.gyro - Vec3::new(-3e-4, 0.0, 0.0)).amax() < 1e-6, "{found:?}");
        assert!((found.accel - Vec3::new(0.0, 0.0, 2e-3)).amax() < 2e-5, "{found:?}");
        assert!(fit.span() < 9.0, "of one attitude: {}", fit.span());
    }

    #[test]
    fn without_a_change_of_temperature_there_is_no_drift() {
        let mut fit = DriftFit::default();
        let imu = ImuData { accel: Vec3::new(0.0, 0.0, -GRAVITY), temperature: 25.0, ..Default::default() };
        for k in 0..2_000 {
            assert!(fit.step(Instant::from_micros(2_500 * k), &imu).is_ok());
        }
        assert_eq!(fit.solve(), None);
        let cold = ImuData { temperature: f32::NAN, ..imu };
        let refused = (2_000..3_000).find_map(|k| fit.step(Instant::from_micros(2_500 * k), &cold).err());
        assert_eq!(refused, Some(DriftRefusal::NoTemperature));
    }
}
