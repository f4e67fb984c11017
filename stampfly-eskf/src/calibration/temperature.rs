//! Bias of gyro and accelerometer against temperature, as a table.
//!
//! The sensor of a small vehicle warms up by tens of degrees between power-on and landing, and its
//! bias changes with the temperature. The table learns the curve while the vehicle lies still, over
//! any number of warm-ups, and interpolates.
//!
//! Use it if the bias at power-on does not hold for a flight; for a straight line use
//! [`DriftFit`](super::DriftFit). Gyro values are absolute. Accelerometer values are changes
//! relative to the first stretch, because at rest the bias cannot be separated from gravity: take
//! the absolute bias from [`SixPosition`](super::SixPosition) at the temperature at which the
//! table's accelerometer value is zero. Not a replacement for
//! [`StillCalibration`](super::StillCalibration): the bias also differs from one power-on to the
//! next.

use super::{NotStill, StillAverage, StillMean, StillnessConfig};
use stampfly_types::messages::ImuData;
use stampfly_types::{Instant, Vec3, math};

/// Lowest temperature of the table, °C.
const COLDEST: f32 = -10.0;
/// Width of a bin, °C.
const WIDTH: f32 = 5.0;
/// Number of bins: up to 85 °C.
const BINS: usize = 19;
/// Smallest distance of two bins for a slope, °C.
const SLOPE: f32 = 0.5 * WIDTH;

/// Reason for which a sample or a stretch was not used.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum TemperatureRefusal {
    /// The vehicle moves.
    Moving(NotStill),
    /// The sensor has no temperature.
    NoTemperature,
    /// Outside −10 to 85 °C.
    OutOfRange {
        /// Mean of the stretch, °C.
        temperature: f32,
    },
    /// The vehicle was moved since the last stretch and the table does not cover this temperature,
    /// so that a change of the accelerometer bias cannot be separated from the change of attitude.
    Moved,
}

/// Whether the table covers a temperature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coverage {
    /// Between two temperatures with data.
    Inside,
    /// Outside by up to one bin of 5 °C: extrapolated with the outermost slope.
    Beside,
    /// Farther outside: the value one bin outside.
    Clamped,
}

/// A bias from the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemperatureBias {
    /// Bias of the gyro, body FRD, rad/s.
    pub gyro: Vec3,
    /// Change of the accelerometer's bias, body FRD, m/s².
    pub accel: Vec3,
    /// Coverage of the temperature.
    pub coverage: Coverage,
    /// Still samples of the bin used, or of the poorer of the two.
    pub samples: u32,
}

/// Quality of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemperatureQuality {
    /// Number of bins with data.
    pub filled: u32,
    /// Lowest and highest temperature with data, °C.
    pub span: [f32; 2],
    /// Root mean square difference of a stretch's gyro mean from that of its bin, any axis, rad/s:
    /// noise, the slope within a bin, and changes from one power-on to the next.
    pub gyro_scatter: f32,
    /// Number of still samples in all bins.
    pub samples: u32,
}

/// Means of the stretches in a bin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Bin {
    stretches: u32,
    samples: u32,
    temperature: f32,
    gyro: Vec3,
    accel: Vec3,
    /// Sum of squared distances of the gyro means from their mean.
    gyro_squares: f32,
}

impl Bin {
    fn add(&mut self, temperature: f32, mean: &StillMean, accel: &Vec3) {
        self.stretches = self.stretches.saturating_add(1);
        self.samples = self.samples.saturating_add(mean.samples);
        let share = 1.0 / self.stretches as f32;
        let before = mean.gyro - self.gyro;
        self.temperature += (temperature - self.temperature) * share;
        self.gyro += before * share;
        self.accel += (accel - self.accel) * share;
        self.gyro_squares += before.dot(&(mean.gyro - self.gyro));
    }
}

/// The table. Plain data: store it over power-offs and continue it after each power-on.
///
/// ```
/// use stampfly_eskf::calibration::{Coverage, TemperatureTable};
/// use stampfly_types::{Instant, Vec3, messages::ImuData};
/// let mut table = TemperatureTable::default();
/// for k in 0..60_000 {
///     // Warms up from 20 °C to 50 °C in two and a half minutes.
///     let temperature = 20.0 + 0.0005 * k as f32;
///     let gyro = Vec3::new(0.0002 * (temperature - 20.0), 0.0, 0.0);
///     table.step(Instant::from_micros(2_500 * k), &ImuData { accel: Vec3::new(0.0, 0.0, -9.81), gyro, temperature, ..Default::default() }).unwrap();
/// }
/// let bias = table.bias(33.0).unwrap();
/// assert!((bias.gyro.x - 0.0026).abs() < 2e-5 && bias.coverage == Coverage::Inside);
/// assert_eq!(table.bias(80.0).unwrap().coverage, Coverage::Clamped);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TemperatureTable {
    average: StillAverage,
    bins: [Bin; BINS],
    span: [f32; 2],
    /// Specific force in the present attitude at the temperature with accelerometer value zero.
    anchor: Option<Vec3>,
}

impl Default for TemperatureTable {
    /// A stretch is one second at 400 Hz, in which the temperature is practically constant.
    fn default() -> Self {
        Self::new(StillnessConfig { samples: 400, ..Default::default() })
    }
}

impl TemperatureTable {
    /// An empty table.
    #[must_use]
    pub fn new(still: StillnessConfig) -> Self {
        let span = [f32::INFINITY, f32::NEG_INFINITY];
        Self { average: StillAverage::new(still), bins: [Bin::default(); BINS], span, anchor: None }
    }

    /// Takes an inertial sample with its temperature. Returns true when a stretch has been added to
    /// the table.
    ///
    /// # Errors
    /// The reason for which the sample, or with its last sample the stretch, is not used.
    pub fn step(&mut self, now: Instant, imu: &ImuData) -> Result<bool, TemperatureRefusal> {
        match self.average.step(now, imu) {
            Err(reason) => {
                if reason != NotStill::NotFinite {
                    self.anchor = None;
                }
                Err(TemperatureRefusal::Moving(reason))
            }
            Ok(Some(mean)) => self.add(&mean).map(|()| true),
            Ok(None) => Ok(false),
        }
    }

    /// Prepares a stored table after power-on: the vehicle may lie in another attitude.
    pub fn begin(&mut self) {
        *self = Self { bins: self.bins, span: self.span, ..Self::new(self.average.config()) };
    }

    fn add(&mut self, mean: &StillMean) -> Result<(), TemperatureRefusal> {
        let temperature = mean.temperature.ok_or(TemperatureRefusal::NoTemperature)?;
        let out_of_range = TemperatureRefusal::OutOfRange { temperature };
        let place = math::floor((temperature - COLDEST) / WIDTH);
        if !(0.0..BINS as f32).contains(&place) {
            return Err(out_of_range);
        }
        // After a motion, the known bias at this temperature gives the new anchor; an unknown one
        // would mix attitude and bias.
        let anchor = match (self.anchor, self.bias(temperature)) {
            (Some(anchor), _) => anchor,
            (None, None) => mean.accel,
            (None, Some(known)) if known.coverage != Coverage::Clamped => mean.accel - known.accel,
            (None, Some(_)) => return Err(TemperatureRefusal::Moved),
        };
        self.anchor = Some(anchor);
        let [low, high] = self.span;
        self.span = [low.min(temperature), high.max(temperature)];
        let bin = self.bins.get_mut(place as usize).ok_or(out_of_range)?;
        bin.add(temperature, mean, &(mean.accel - anchor));
        Ok(())
    }

    fn filled(&self) -> impl DoubleEndedIterator<Item = &Bin> {
        self.bins.iter().filter(|bin| bin.stretches > 0)
    }

    /// The bias at a temperature, °C, interpolated linearly between the bins' means. `None` for an
    /// empty table or a temperature that is not finite.
    #[must_use]
    pub fn bias(&self, temperature: f32) -> Option<TemperatureBias> {
        let (coldest, warmest) = (self.filled().next()?, self.filled().next_back()?);
        if !temperature.is_finite() {
            return None;
        }
        let [low, high] = self.span;
        let coverage = match (low - temperature).max(temperature - high) {
            outside if outside <= 0.0 => Coverage::Inside,
            outside if outside <= WIDTH => Coverage::Beside,
            _ => Coverage::Clamped,
        };
        let temperature = temperature.max(low - WIDTH).min(high + WIDTH);
        // The two bins around it; outside, the outermost bin and the nearest one at least `SLOPE`
        // away.
        let (a, b) = if temperature < coldest.temperature {
            (coldest, self.filled().find(|bin| bin.temperature >= coldest.temperature + SLOPE).unwrap_or(coldest))
        } else if temperature > warmest.temperature {
            let inner = self.filled().rev().find(|bin| bin.temperature <= warmest.temperature - SLOPE);
            (inner.unwrap_or(warmest), warmest)
        } else {
            (
                self.filled().rev().find(|bin| bin.temperature <= temperature).unwrap_or(coldest),
                self.filled().find(|bin| bin.temperature >= temperature).unwrap_or(warmest),
            )
        };
        let distance = b.temperature - a.temperature;
        let share = if distance > 0.0 { (temperature - a.temperature) / distance } else { 0.0 };
        Some(TemperatureBias {
            gyro: a.gyro + (b.gyro - a.gyro) * share,
            accel: a.accel + (b.accel - a.accel) * share,
            coverage,
            samples: a.samples.min(b.samples),
        })
    }

    /// Quality of the table; `None` if it is empty.
    #[must_use]
    pub fn quality(&self) -> Option<TemperatureQuality> {
        self.filled().next()?;
        let stretches: f32 = self.filled().map(|bin| bin.stretches as f32).sum();
        let squares: f32 = self.filled().map(|bin| bin.gyro_squares).sum();
        Some(TemperatureQuality {
            filled: self.filled().count() as u32,
            span: self.span,
            gyro_scatter: math::sqrt(squares / (3.0 * stretches)),
            samples: self.filled().fold(0, |sum, bin| sum.saturating_add(bin.samples)),
        })
    }
}
