//! How late is the magnetometer? Conversion and averaging make its samples older than their stamp, by a time that data sheets do not
//! say and that a hand at 5 rad/s turns into degrees.
//!
//! A field that is δ older than it is taken for, is turned into the level frame with the attitude of a moment too late: there it
//! deviates from the mean by δ·ω×m. Deviations by an uneven world or by magnets on the sensor go with the place or the attitude,
//! not with the rate. So δ is the regression of the one on the other, from all three axes, beside a first guess (zero) that is
//! known to [`AttitudeConfig::mag_delay_sigma`].
//!
//! Not for a delay that changes from sample to sample.

use super::config::AttitudeConfig;
use stampfly_types::Vec3;

/// A magnetometer is not later than this, s.
const LARGEST: f32 = 0.05;
/// Time constant of the mean field, s: longer than a stroke of a hand, shorter than a walk to another place.
const MEAN_TIME: f32 = 10.0;
/// Deviations beyond this share of the field are of something else.
const SHARE: f32 = 0.2;

/// Estimates the magnetometer's delay.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct MagDelay {
    /// Mean field, level frame, and over what time, s.
    mean: Vec3,
    averaged: f32,
    /// Sums of the regression, over the noise: s and 1 over s².
    along: f32,
    information: f32,
}

impl MagDelay {
    /// The delay beyond the configured one, s.
    pub fn value(&self, config: &AttitudeConfig) -> f32 {
        let sigma = config.mag_delay_sigma;
        // Zero where it is known.
        let prior = sigma * sigma;
        let delay = prior * self.along / (1.0 + prior * self.information);
        delay.max(-config.mag_delay).min(LARGEST)
    }

    /// Takes a field, level frame, µT, that the present value was taken out of, and the rate of then, level frame, rad/s.
    pub fn step(&mut self, config: &AttitudeConfig, field: &Vec3, rate: &Vec3, dt: f32) {
        let taken = self.value(config);
        self.averaged = (self.averaged + dt).min(MEAN_TIME);
        self.mean += (field - self.mean) * (dt / self.averaged);
        if self.averaged < MEAN_TIME {
            return;
        }
        let off = field - self.mean;
        if off.norm() > SHARE * self.mean.norm() {
            return;
        }
        let sweep = rate.cross(&self.mean);
        // An uneven field stays the same for a while.
        let weight = dt / (config.field_time * config.field_sigma * config.field_sigma);
        self.information += sweep.norm_squared() * weight;
        self.along += (off.dot(&sweep) + taken * sweep.norm_squared()) * weight;
    }
}
