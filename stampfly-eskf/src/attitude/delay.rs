//! Delay of the magnetometer: conversion and averaging make samples older than their stamp, by a
//! time that data sheets do not state. A hand that turns at 5 rad/s makes an error of several
//! degrees of it.
//!
//! A field delayed by δ is rotated into the level frame with too late an attitude, and deviates
//! there from the mean by δ·ω×m. Deviations from an uneven field or from magnets on the sensor
//! depend on place or attitude, not on the rate. δ is therefore the regression of the deviation on
//! ω×m over all three axes, with a prior of zero and standard deviation
//! [`AttitudeConfig::mag_delay_sigma`].
//!
//! Not for a delay that changes from sample to sample.

use super::config::AttitudeConfig;
use stampfly_types::Vec3;

/// Largest delay, s.
const LARGEST: f32 = 0.05;
/// Time constant of the mean field, s: longer than a movement of a hand, shorter than a walk to
/// another place.
const MEAN_TIME: f32 = 10.0;
/// Deviations above this share of the field have another cause and are ignored.
const SHARE: f32 = 0.2;

/// Estimator of the delay.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct MagDelay {
    /// Mean field, level frame, and the time over which it was averaged, s.
    mean: Vec3,
    averaged: f32,
    /// Weighted sums of the regression: numerator, 1/s, and information, 1/s².
    along: f32,
    information: f32,
}

impl MagDelay {
    /// Delay in addition to the configured one, s.
    pub fn value(&self, config: &AttitudeConfig) -> f32 {
        let sigma = config.mag_delay_sigma;
        // A prior of zero makes the result zero.
        let prior = sigma * sigma;
        let delay = prior * self.along / (1.0 + prior * self.information);
        delay.max(-config.mag_delay).min(LARGEST)
    }

    /// Takes a field, level frame, µT, rotated with the present delay, and the rate at that time,
    /// level frame, rad/s.
    pub fn step(&mut self, config: &AttitudeConfig, field: &Vec3, rate: &Vec3, dt: f32) {
        let taken = self.value(config);
        self.averaged = (self.averaged + dt).min(MEAN_TIME);
        self.mean += (field - self.mean) * (dt / self.averaged);
        // The deviation from an unfinished mean would contain the rotation itself.
        if self.averaged < MEAN_TIME {
            return;
        }
        let off = field - self.mean;
        if off.norm() > SHARE * self.mean.norm() {
            return;
        }
        let sweep = rate.cross(&self.mean);
        // The field's variation is correlated over `field_time`: weigh the samples down
        // accordingly.
        let weight = dt / (config.field_time * config.field_sigma * config.field_sigma);
        self.information += sweep.norm_squared() * weight;
        self.along += (off.dot(&sweep) + taken * sweep.norm_squared()) * weight;
    }
}
