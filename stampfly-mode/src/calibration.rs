<<<<<<< HEAD
//! Still-calibration: wait until nobody touches the vehicle, then average.
//!
//! A vehicle that calibrates in somebody's hand flips after take-off. So the average only counts samples of a period
//! in which the gyro and the accelerometer were quiet from beginning to end; any motion starts it again. Limits are
//! the StampFly's (BMI270); the method is the exponentially weighted mean and variance.
//!
//! Not for soft or hard iron, nor for accelerometer scale: those need the vehicle to be turned.

use stampfly_types::messages::{BaroData, CalibrationResult, ImuData, MagData};
use stampfly_types::{Micros, Vec3};

/// What counts as still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StillnessConfig {
    /// Largest mean angular rate, rad/s. Above the gyro's own offset, which may be 1 °/s an axis.
    pub rate_max: f32,
    /// Largest variance of the angular rate, (rad/s)².
    pub rate_variance_max: f32,
    /// Mean specific force must lie between these, m/s².
    pub force_range: [f32; 2],
    /// Largest variance of the specific force, (m/s²)².
    pub force_variance_max: f32,
    /// Time to settle before the average begins, s.
    pub settle: f32,
    /// Samples averaged.
    pub samples: u32,
}

impl Default for StillnessConfig {
    fn default() -> Self {
        Self {
            rate_max: 0.06,
            rate_variance_max: 1e-3,
            force_range: [9.3, 10.3],
            force_variance_max: 0.05,
            settle: 1.0,
            samples: 1000,
=======
//! Still-calibration: what the sensors read while nothing moves.
//!
//! The vehicle stands, somewhere, sometime; calibration waits for that instead of demanding it. After a second to settle
//! it averages 2.5 s (at 400 Hz) of inertial samples, each of which has to pass the stillness gate; any motion starts
//! the collection anew. The reference firmware once calibrated while being carried and flipped at take-off: hence the
//! gate. Magnetometer and barometer are averaged alongside when they are there.

use stampfly_types::messages::{CalibrationResult, ImuData};
use stampfly_types::{Micros, Vec3, math};

/// The gate and the length of the collection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationConfig {
    /// Still samples to collect.
    pub samples: u32,
    /// Time of stillness before the collection begins.
    pub settle: Micros,
    /// Share of a new sample in the running mean and variance.
    pub forgetting: f32,
    /// Largest running mean of the angular rate, rad/s. A bias of 1 °/s passes.
    pub rate_max: f32,
    /// Largest running variance of the angular rate, (rad/s)².
    pub rate_variance_max: f32,
    /// Range of the running mean of the specific force, m/s².
    pub force: (f32, f32),
    /// Largest running variance of the specific force, (m/s²)².
    pub force_variance_max: f32,
}

impl Default for CalibrationConfig {
    fn default() -> Self {
        Self {
            samples: 1_000,
            settle: Micros::from_secs(1),
            forgetting: 0.05,
            rate_max: 0.05,
            rate_variance_max: 1e-3,
            force: (9.3, 10.3),
            force_variance_max: 0.05,
>>>>>>> control
        }
    }
}

<<<<<<< HEAD
/// Weight of a new sample in the running mean and variance: about 50 ms at 400 Hz.
const WEIGHT: f32 = 0.05;

/// Mean and variance with an exponential window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Spread {
    mean: Vec3,
    variance: f32,
}

impl Spread {
    fn add(&mut self, value: &Vec3) {
        let off = value - self.mean;
        self.mean += off * WEIGHT;
        self.variance += WEIGHT * (off.norm_squared() - self.variance);
    }
}

/// The still-calibration.
=======
/// Collects still samples.
>>>>>>> control
///
/// ```
/// use stampfly_mode::StillCalibration;
/// use stampfly_types::{Micros, Vec3, messages::ImuData};
/// let mut calibration = StillCalibration::default();
<<<<<<< HEAD
/// let still = ImuData { accel: Vec3::new(0.0, 0.0, -9.81), gyro: Vec3::new(0.01, 0.0, 0.0), temperature: 25.0 };
/// for k in 0..1500 {
///     calibration.step(Micros(2_500 * k), &still);
/// }
/// let result = calibration.result();
/// assert!(result.complete && (result.gyro_bias.x - 0.01).abs() < 1e-5);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct StillCalibration {
    config: StillnessConfig,
    rate: Spread,
    force: Spread,
    since: Option<Micros>,
    count: u32,
    rate_sum: Vec3,
    force_sum: Vec3,
    field: Vec3,
    altitude: Option<f32>,
=======
/// let still = ImuData { accel: Vec3::new(0.0, 0.0, -9.8), gyro: Vec3::new(0.01, 0.0, 0.0), temperature: 25.0 };
/// for n in 0..2_000u64 {
///     calibration.step(Micros(2_500 * n), &still, None, None);
/// }
/// let result = calibration.result();
/// assert!(result.complete && (result.gyro_bias.x - 0.01).abs() < 1e-6);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct StillCalibration {
    config: CalibrationConfig,
    rate: Running,
    force: Running,
    still_since: Option<Micros>,
    gyro: Mean,
    accel: Mean,
    field: Mean,
    altitude: Mean,
>>>>>>> control
    result: CalibrationResult,
}

impl Default for StillCalibration {
    fn default() -> Self {
<<<<<<< HEAD
        Self::new(StillnessConfig::default())
=======
        Self::new(&CalibrationConfig::default())
>>>>>>> control
    }
}

impl StillCalibration {
<<<<<<< HEAD
    /// Nothing collected yet.
    #[must_use]
    pub fn new(config: StillnessConfig) -> Self {
        Self {
            config,
            rate: Spread::default(),
            force: Spread::default(),
            since: None,
            count: 0,
            rate_sum: Vec3::zeros(),
            force_sum: Vec3::zeros(),
            field: Vec3::zeros(),
            altitude: None,
=======
    /// An empty collection.
    #[must_use]
    pub fn new(config: &CalibrationConfig) -> Self {
        Self {
            config: *config,
            rate: Running::default(),
            force: Running::default(),
            still_since: None,
            gyro: Mean::default(),
            accel: Mean::default(),
            field: Mean::default(),
            altitude: Mean::default(),
>>>>>>> control
            result: CalibrationResult::default(),
        }
    }

<<<<<<< HEAD
    fn is_still(&self) -> bool {
        let [low, high] = self.config.force_range;
        self.rate.mean.norm() <= self.config.rate_max
            && self.rate.variance <= self.config.rate_variance_max
            && (low..=high).contains(&self.force.mean.norm())
            && self.force.variance <= self.config.force_variance_max
    }

    /// Takes an inertial sample. After completion nothing changes any more.
    pub fn step(&mut self, now: Micros, imu: &ImuData) {
        if self.result.complete || !imu.accel.iter().chain(imu.gyro.iter()).all(|v| v.is_finite()) {
            return;
        }
        if self.since.is_none() {
            // The first sample is the first mean; a variance counted from zero would be motion.
            (self.rate.mean, self.force.mean) = (imu.gyro, imu.accel);
        }
        self.rate.add(&imu.gyro);
        self.force.add(&imu.accel);
        let since = *self.since.get_or_insert(now);
        if !self.is_still() {
            if self.count > 0 {
                self.result.restarts = self.result.restarts.wrapping_add(1);
            }
            self.since = Some(now);
            (self.count, self.rate_sum, self.force_sum) = (0, Vec3::zeros(), Vec3::zeros());
        } else if now.since(since).seconds() >= self.config.settle {
            self.count += 1;
            self.rate_sum += imu.gyro;
            self.force_sum += imu.accel;
        }
        self.result.progress = self.count as f32 / self.config.samples as f32;
        if self.count >= self.config.samples {
            let share = 1.0 / self.count as f32;
            self.result.gyro_bias = self.rate_sum * share;
            self.result.specific_force = self.force_sum * share;
            self.result.field = self.field;
            self.result.baro_altitude = self.altitude.unwrap_or(0.0);
            self.result.progress = 1.0;
            self.result.complete = true;
        }
    }

    /// Takes a magnetometer sample.
    pub fn add_mag(&mut self, mag: &MagData) {
        if mag.field.iter().all(|v| v.is_finite()) {
            let first = self.field == Vec3::zeros();
            self.field += (mag.field - self.field) * if first { 1.0 } else { 0.1 };
        }
    }

    /// Takes a barometer sample.
    pub fn add_baro(&mut self, baro: &BaroData) {
        if baro.altitude.is_finite() {
            self.altitude = Some(self.altitude.map_or(baro.altitude, |a| a + 0.1 * (baro.altitude - a)));
=======
    /// Takes an inertial sample, and a magnetic field (µT, body) or a barometric altitude (m) if there is a new one.
    /// Does nothing once complete.
    pub fn step(&mut self, now: Micros, imu: &ImuData, field: Option<Vec3>, altitude: Option<f32>) {
        if self.result.complete {
            return;
        }
        if !self.still(imu) {
            if self.gyro.count > 0 {
                self.result.restarts = self.result.restarts.wrapping_add(1);
            }
            self.clear();
            return;
        }
        let since = *self.still_since.get_or_insert(now);
        if now.since(since) < self.config.settle {
            return;
        }
        self.gyro.add(&imu.gyro);
        self.accel.add(&imu.accel);
        if let Some(field) = field.filter(is_finite) {
            self.field.add(&field);
        }
        if let Some(altitude) = altitude.filter(|a| a.is_finite()) {
            self.altitude.add(&Vec3::new(altitude, 0.0, 0.0));
        }
        let progress = self.gyro.count as f32 / self.config.samples.max(1) as f32;
        self.result.progress = progress.min(1.0);
        if self.gyro.count >= self.config.samples {
            self.result = CalibrationResult {
                gyro_bias: self.gyro.mean,
                specific_force: self.accel.mean,
                field: self.field.mean,
                baro_altitude: self.altitude.mean.x,
                complete: true,
                ..self.result
            };
>>>>>>> control
        }
    }

    /// What has been found so far.
    #[must_use]
<<<<<<< HEAD
    pub fn result(&self) -> CalibrationResult {
        self.result
    }
=======
    pub fn result(&self) -> &CalibrationResult {
        &self.result
    }

    /// Starts over, for instance after a crash.
    pub fn restart(&mut self) {
        let restarts = self.result.restarts.wrapping_add(1);
        *self = Self::new(&self.config);
        self.result.restarts = restarts;
    }

    fn clear(&mut self) {
        self.still_since = None;
        for mean in [&mut self.gyro, &mut self.accel, &mut self.field, &mut self.altitude] {
            *mean = Mean::default();
        }
        self.result.progress = 0.0;
    }

    fn still(&mut self, imu: &ImuData) -> bool {
        let config = &self.config;
        let (rate, force) = (length(&imu.gyro), length(&imu.accel));
        // No sensor measures that (NaN is not less than anything either), and the running mean would take long to
        // forget it.
        if !(rate < 100.0 && force < 1_000.0) {
            (self.rate, self.force) = (Running::default(), Running::default());
            return false;
        }
        self.rate.add(rate, config.forgetting);
        self.force.add(force, config.forgetting);
        self.rate.mean <= config.rate_max
            && self.rate.variance <= config.rate_variance_max
            && (config.force.0..=config.force.1).contains(&self.force.mean)
            && self.force.variance <= config.force_variance_max
    }
}

/// Running mean and variance with exponential forgetting; the first sample is taken whole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Running {
    mean: f32,
    variance: f32,
    started: bool,
}

impl Running {
    fn add(&mut self, value: f32, share: f32) {
        if !self.started {
            *self = Self { mean: value, variance: 0.0, started: true };
            return;
        }
        let change = value - self.mean;
        self.mean += share * change;
        self.variance = (1.0 - share) * (self.variance + share * change * change);
    }
}

/// Plain mean, formed step by step so that a long sum does not swallow small samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Mean {
    mean: Vec3,
    count: u32,
}

impl Mean {
    fn add(&mut self, value: &Vec3) {
        self.count += 1;
        self.mean += (value - self.mean) / self.count as f32;
    }
}

fn is_finite(vector: &Vec3) -> bool {
    (vector.x + vector.y + vector.z).is_finite()
}

fn length(vector: &Vec3) -> f32 {
    math::sqrt(vector.norm_squared())
>>>>>>> control
}

#[cfg(test)]
mod tests {
    use super::*;
<<<<<<< HEAD

    fn still() -> ImuData {
        ImuData { accel: Vec3::new(0.1, 0.0, -9.8), gyro: Vec3::new(0.01, -0.02, 0.005), temperature: 30.0 }
    }

    #[test]
    fn motion_starts_the_average_again() {
        let mut calibration = StillCalibration::default();
        for k in 0..1000u64 {
            calibration.step(Micros(2_500 * k), &still());
        }
        assert!(calibration.result().progress > 0.5);
        for k in 1000..1020u64 {
            calibration.step(Micros(2_500 * k), &ImuData { gyro: Vec3::new(1.0, 0.0, 0.0), ..still() });
        }
        assert_eq!((calibration.result().progress, calibration.result().restarts), (0.0, 1));
        for k in 1020..4000u64 {
            calibration.step(Micros(2_500 * k), &still());
        }
        let result = calibration.result();
        assert!(result.complete && (result.gyro_bias - still().gyro).norm() < 1e-5, "the motion left no trace");
    }

    #[test]
    fn a_hand_is_never_still() {
        let mut calibration = StillCalibration::default();
        for k in 0..8000u64 {
            let swing = stampfly_types::math::sin(k as f32 * 0.03) * 0.2;
            calibration.step(Micros(2_500 * k), &ImuData { gyro: Vec3::new(swing, 0.0, 0.0), ..still() });
        }
        assert!(!calibration.result().complete);
    }
=======
    use proptest::prelude::*;

    const STILL: ImuData =
        ImuData { accel: Vec3::new(0.1, -0.2, -9.8), gyro: Vec3::new(0.012, -0.006, 0.003), temperature: 25.0 };

    fn feed(calibration: &mut StillCalibration, from: u64, samples: impl IntoIterator<Item = ImuData>) -> u64 {
        let mut index = from;
        for imu in samples {
            calibration.step(Micros(index * 2_500), &imu, Some(Vec3::new(20.0, 0.0, 40.0)), Some(12.5));
            index += 1;
        }
        index
    }

    fn noise(n: u32) -> Vec3 {
        // A deterministic spread of about ±1, different per axis.
        let part = |k: u32| ((n.wrapping_mul(k) >> 7) % 2001) as f32 / 1000.0 - 1.0;
        Vec3::new(part(2_654_435_761), part(2_246_822_519), part(3_266_489_917))
    }

    #[test]
    fn takes_settling_and_two_and_a_half_seconds() {
        let mut calibration = StillCalibration::default();
        let end = feed(&mut calibration, 0, std::iter::repeat_n(STILL, 1_399));
        assert!(!calibration.result().complete && calibration.result().progress > 0.99);
        feed(&mut calibration, end, std::iter::repeat_n(STILL, 1));
        let result = calibration.result();
        assert!(result.complete);
        assert_eq!((result.progress, result.restarts, result.baro_altitude), (1.0, 0, 12.5));
        assert!((result.specific_force - STILL.accel).norm() < 1e-4);
        assert!((result.gyro_bias - STILL.gyro).norm() < 1e-6);
    }

    #[test]
    fn averages_the_noise_of_the_real_sensor() {
        let mut calibration = StillCalibration::default();
        let samples = (0..1_500).map(|n| ImuData {
            accel: STILL.accel + noise(n) * 0.03,
            gyro: STILL.gyro + noise(n + 77) * 0.005,
            ..STILL
        });
        feed(&mut calibration, 0, samples);
        let result = calibration.result();
        assert!(result.complete);
        assert!((result.gyro_bias - STILL.gyro).norm() < 5e-4, "{:?}", result.gyro_bias);
        assert!((result.specific_force - STILL.accel).norm() < 3e-3);
    }

    #[test]
    fn motion_of_any_kind_starts_over() {
        let turned = ImuData { gyro: Vec3::new(0.0, 0.0, 2.0), ..STILL };
        let lifted = ImuData { accel: Vec3::new(0.0, 0.0, -14.0), ..STILL };
        let broken = ImuData { gyro: Vec3::repeat(f32::NAN), ..STILL };
        for motion in [turned, lifted, broken] {
            let mut calibration = StillCalibration::default();
            let end = feed(&mut calibration, 0, std::iter::repeat_n(STILL, 1_200));
            assert!(calibration.result().progress > 0.5);
            let end = feed(&mut calibration, end, [motion, motion, motion]);
            assert_eq!(calibration.result().progress, 0.0, "{motion:?}");
            assert_eq!(calibration.result().restarts, 1);
            feed(&mut calibration, end, std::iter::repeat_n(STILL, 2_000));
            assert!(calibration.result().complete, "and completes once it is still again");
        }
    }

    #[test]
    fn being_carried_never_completes() {
        let mut calibration = StillCalibration::default();
        let carried = (0..8_000).map(|n| {
            let sway = math::sin(n as f32 * 0.0025 * 6.0);
            ImuData {
                accel: STILL.accel + Vec3::new(1.5 * sway, 0.0, 1.5 * sway),
                gyro: Vec3::new(0.4 * sway, 0.0, 0.0),
                ..STILL
            }
        });
        feed(&mut calibration, 0, carried);
        assert!(!calibration.result().complete);
    }

    proptest! {
        #[test]
        fn results_are_finite_whatever_comes(samples in prop::collection::vec(any::<[f32; 6]>(), 0..200)) {
            let mut calibration = StillCalibration::default();
            let imu = samples.into_iter().map(|[a, b, c, d, e, f]| ImuData {
                accel: Vec3::new(a, b, c), gyro: Vec3::new(d, e, f), temperature: 0.0,
            });
            let end = feed(&mut calibration, 0, imu);
            feed(&mut calibration, end, std::iter::repeat_n(STILL, 3_000));
            prop_assert!(calibration.result().complete);
            prop_assert!(calibration.result().gyro_bias.iter().all(|x| x.is_finite()));
        }
    }
>>>>>>> control
}
