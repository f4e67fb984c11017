//! Bias of gyro and accelerometer against temperature.
//!
//! A small vehicle's sensor warms up by tens of degrees between power-on and landing, and its bias moves with it. This
//! table learns the curve while the vehicle lies still, over any number of warm-ups, and gives the bias for a temperature.
//!
//! Use it when the bias at power-on does not hold for a flight. The gyro's values are absolute; the accelerometer's are
//! changes against the first stretch ever seen, because lying still shows a bias only together with gravity: take the
//! absolute bias from [`SixPosition`](super::SixPosition) at the temperature where the table's accelerometer value is zero.
//! Not a replacement for [`StillCalibration`](super::StillCalibration): bias also differs from one power-on to the next.

use super::{NotStill, StillAverage, StillMean, StillnessConfig};
use stampfly_types::messages::ImuData;
use stampfly_types::{Instant, Vec3, math};

/// Coldest temperature of the table, °C.
const COLDEST: f32 = -10.0;
/// Width of a bin, °C.
const WIDTH: f32 = 5.0;
/// Bins: up to 85 °C.
const BINS: usize = 19;
/// Two bins must be this far apart to show a slope, °C.
const SLOPE: f32 = 0.5 * WIDTH;

/// Why a sample or a stretch was not taken.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum TemperatureRefusal {
    /// It moves.
    Moving(NotStill),
    /// The sensor gave no temperature.
    NoTemperature,
    /// Outside −10 to 85 °C.
    OutOfRange {
        /// Mean of the stretch, °C.
        temperature: f32,
    },
    /// It was moved since the last stretch, and the table does not reach this temperature yet, so the change of the
    /// accelerometer's bias cannot be told from the change of attitude.
    Moved,
}

/// Whether the table knows the temperature that was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coverage {
    /// Between two temperatures it has seen.
    Inside,
    /// Outside by up to one bin of 5 °C: the outermost slope is continued.
    Beside,
    /// Farther outside: the value one bin outside, not more.
    Clamped,
}

/// A bias out of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemperatureBias {
    /// Bias of the gyro, body FRD, rad/s.
    pub gyro: Vec3,
    /// Change of the accelerometer's bias, body FRD, m/s².
    pub accel: Vec3,
    /// How far the table can be trusted with it.
    pub coverage: Coverage,
    /// Still samples behind it: of the poorer of the two bins used.
    pub samples: u32,
}

/// How good the table is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemperatureQuality {
    /// Bins with data.
    pub filled: u32,
    /// Coldest and warmest temperature seen, °C.
    pub span: [f32; 2],
    /// Root mean square of what a stretch's gyro mean differs from its bin's, any axis, rad/s: noise, the slope within a
    /// bin, and what changes from one power-on to the next.
    pub gyro_scatter: f32,
    /// Still samples in all bins.
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
    /// Sum of squared distances of the stretches' gyro means from their mean.
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

/// The table. Plain data: keep it over power-offs, and feed it after each power-on.
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
    /// Specific force in the present attitude at the temperature where the accelerometer's values are zero.
    anchor: Option<Vec3>,
}

impl Default for TemperatureTable {
    /// A stretch is one second at 400 Hz, in which the temperature is as good as constant.
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

    /// Takes an inertial sample with its temperature. True when a stretch has just gone into the table.
    ///
    /// # Errors
    /// Why the sample, or with its last sample the stretch, does not count.
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

    /// Call it at power-on with a table that was kept: the vehicle may lie differently now.
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

    /// The bias at a temperature, °C: straight lines between the bins' means. `None` for an empty table or a temperature
    /// that is not finite.
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
        // The two bins around it; outside, the outermost and the nearest that is far enough for a slope.
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

    /// How good the table is; `None` when it is empty.
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
