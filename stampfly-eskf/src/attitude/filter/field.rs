//! Magnetic field updates of the attitude filter.
//!
//! A field is freed of hard iron, compared with the reference, and then corrects the heading as far
//! as its status allows. Nothing here changes the tilt.

use super::super::magnetic::{FieldStatus, Magnetic};
use super::super::rotation::{from_vector, product, within};
use super::super::witness::{Contradiction, Undo};
use super::{AttitudeFilter, LARGEST_FIELD, LONGEST_STEP, MOVING_START_SIGMA};
use crate::estimator::{Fusion, Refusal};
use nalgebra::Matrix3;
use stampfly_types::Vec3;

/// Largest age of a magnetometer sample, s.
const OLDEST: f32 = 0.1;
/// Direction error assumed for a field without a reference, rad.
const NO_REFERENCE_SIGMA: f32 = 0.2;
/// Change of the hard iron, as a share of the field, at which the new estimate is adopted at once.
const NEW_OFFSET: f32 = 0.05;
/// Time constant with which smaller changes are followed, s; the reference field follows, too.
const OFFSET_TIME: f32 = 10.0;

impl AttitudeFilter {
    /// Takes a magnetic field, body FRD, µT, measured `age` seconds before the last step and `dt`
    /// seconds after the field before it.
    ///
    /// Returns [`Fusion::Gated`] for a disturbed field and [`Fusion::Reset`] for one that became a
    /// new reference. Refuses fields older than 0.1 s, not finite, before the first step, or
    /// without a horizontal part.
    pub fn field(&mut self, field: &Vec3, age: f32, dt: f32) -> Fusion {
        if !self.started {
            return Fusion::Refused(Refusal::NotInitialized);
        }
        if !field.iter().all(|value| value.is_finite()) {
            return Fusion::Refused(Refusal::NotFinite);
        }
        if !within(field, LARGEST_FIELD) {
            return Fusion::Refused(Refusal::Range);
        }
        if !(0.0..=OLDEST).contains(&age) || dt.is_nan() || dt <= 0.0 {
            return Fusion::Refused(Refusal::Stale);
        }
        let dt = dt.min(LONGEST_STEP);
        self.ask_witness(field, dt);
        // Attitude at the time of the measurement: go back by the delays at the current rate.
        let late = age + self.mag_delay() - self.config.inertial_delay;
        let then = product(&self.strapdown, &from_vector(&(self.rate * -late)));
        let turn = Matrix3::from(self.level * then);
        self.remove_hard_iron(&turn, field, dt);
        let config = &self.config;
        let stationary = self.stationary.is_stationary(config);
        let level = turn * (field - self.offset);
        if config.mag_delay_sigma > 0.0 && self.force.is_settled() {
            self.mag_delay.step(config, &level, &(turn * self.rate), dt);
        }
        let vertical = turn.row(2).transpose().into();
        let status = self.magnetic.step(config, &level, self.rate.norm(), dt);
        match status {
            FieldStatus::Clean { ratio } => {
                let (share, off) = self.heading.update(config, &level, config.mag_sigma, stationary, dt);
                self.bias.update_vertical(config, &vertical, share, off, dt);
                Fusion::Fused { ratio }
            }
            FieldStatus::Disturbed { ratio } => {
                self.heading.update(config, &level, config.mag_disturbed_sigma, stationary, dt);
                self.bias.interrupt(dt / config.mag_agree_time);
                Fusion::Gated { ratio }
            }
            FieldStatus::NoReference => {
                // The only source of heading. Its variance is large while the tilt settles.
                if !self.force.is_settled() {
                    self.heading.inflate(MOVING_START_SIGMA);
                }
                self.heading.update(config, &level, NO_REFERENCE_SIGMA, stationary, dt);
                Fusion::Fused { ratio: 1.0 }
            }
            FieldStatus::FirstReference => {
                self.heading.inflate(MOVING_START_SIGMA);
                self.bias.interrupt(1.0);
                Fusion::Reset
            }
            FieldStatus::NewReference => {
                self.heading.change_reference(config, &level);
                self.bias.interrupt(1.0);
                Fusion::Reset
            }
            FieldStatus::ReferenceReturned => {
                self.heading.clear_declination();
                self.bias.interrupt(1.0);
                Fusion::Reset
            }
            FieldStatus::Vertical => Fusion::Refused(Refusal::Missing),
        }
    }

    /// Ends a rest that the field contradicts, and reverts its effects.
    fn ask_witness(&mut self, field: &Vec3, dt: f32) {
        let field = field - self.offset;
        let rate = self.stationary.rate();
        if let Some(contradiction) = self.witness.field(&self.config, &field, &rate, &self.bias, dt) {
            self.stationary.end();
            self.undo_rest(contradiction);
        }
    }

    /// Reverts the effect of a false rest on bias, attitude and heading.
    pub(super) fn undo_rest(&mut self, Contradiction { undo }: Contradiction) {
        if let Some(Undo { bias, turned, sigma }) = undo {
            self.bias.restore(&bias);
            self.strapdown = product(&self.strapdown, &from_vector(&turned));
            self.heading.inflate(sigma);
        }
    }

    /// Estimates hard iron, and adopts the estimate at once if it changed significantly.
    fn remove_hard_iron(&mut self, level: &Matrix3<f32>, field: &Vec3, dt: f32) {
        // While the tilt settles, its error looks like hard iron.
        if !self.config.hard_iron || !self.force.is_settled() {
            return;
        }
        let turning = self.rate.norm() > self.config.mag_renew_rate;
        self.hard_iron.step(&self.config, level, field, turning, dt);
        let offset = self.hard_iron.offset(&self.config);
        let change = (offset - self.offset).norm();
        let earth = self.hard_iron.field();
        if change > NEW_OFFSET * earth.norm() {
            self.offset = offset;
            self.witness.start_over();
            self.magnetic = Magnetic::new(Some(&earth));
            self.heading.inflate(change / earth.horizontal().norm().max(1.0));
            self.heading.clear_declination();
            self.bias.interrupt(1.0);
        } else {
            self.offset += (offset - self.offset) * (dt / OFFSET_TIME).min(1.0);
        }
    }
}
