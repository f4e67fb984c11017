//! Tests a rest against the magnetic field.
//!
//! A body that turns slowly and evenly looks stationary to gyro and accelerometer, and its rate is
//! taken for bias. The field in the body still turns with it.
//!
//! - **Start**: the body becomes quiet. The field at that time is stored, and with the rest the
//!   bias before it.
//! - **Contradicted**: the direction of the field has changed by more than [`TURNED`] at the same
//!   strength, and the gyro is consistent with such a turn. The rest ends, the bias before it is
//!   restored, and the turn that was taken for bias is added to the attitude.
//! - **Confirmed**: within [`CONFIRMS`] the field has not turned by half of that. The bias is kept
//!   from then on.
//!
//! A magnet that passes a body at rest turns the field, too, but changes its strength or does not
//! fit the gyro; the new field then belongs to the same rest. Turns slower than 0.1°/s remain bias,
//! and so do those of a body without a magnetometer.

use super::bias::{GyroBias, KnownBias};
use super::config::AttitudeConfig;
use stampfly_types::{Vec3, math};

/// Change of the field's direction that contradicts a rest, rad. The noise of a small magnetometer,
/// low-passed over half a second, stays below 0.4°.
const TURNED: f32 = 1.5 * core::f32::consts::PI / 180.0;
/// Largest change of direction that excludes a turn and its return, rad.
const STAYED: f32 = 0.5 * TURNED;
/// Smallest change of direction that is visible at the end of a rest, rad: twice the noise.
const VISIBLE: f32 = 0.8 * core::f32::consts::PI / 180.0;
/// Number of standard deviations from the bias before, above which a bias is rejected where the
/// field cannot decide.
const UNLIKELY: f32 = 2.0;
/// Duration of a rest without a turn that confirms the bias to less than a tenth of a degree per
/// second, s.
const CONFIRMS: f32 = 20.0;
/// Change of the strength, as a share of the reference tolerance, above which the field was
/// distorted and not turned.
const BENT: f32 = 0.5;

/// A rest proved false.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contradiction {
    /// Effects of the rest to revert; `None` if the body had only been quiet.
    pub undo: Option<Undo>,
}

/// Effects of a false rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Undo {
    /// The bias before the rest.
    pub bias: KnownBias,
    /// Rotation that was taken for bias, body, rad, and its standard deviation, rad.
    pub turned: Vec3,
    pub sigma: f32,
}

/// A rest that is not yet confirmed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Rest {
    before: KnownBias,
    turned: Vec3,
    lasts: f32,
    /// Largest change of the field's direction so far, rad.
    farthest: f32,
}

impl Rest {
    fn undo(&self) -> Undo {
        Undo { bias: self.before, turned: self.turned, sigma: self.before.sigma() * self.lasts }
    }
}

/// Comparison of the field with that at the start of a rest.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Witness {
    /// Low-passed field; zero before the first sample.
    field: Vec3,
    /// The field when the body became quiet.
    first: Option<Vec3>,
    /// Time since then, s.
    quiet_for: f32,
    rest: Option<Rest>,
}

impl Witness {
    pub const fn new() -> Self {
        Self { field: Vec3::zeros(), first: None, quiet_for: 0.0, rest: None }
    }

    /// Restarts after a change of the hard iron that is subtracted.
    pub fn start_over(&mut self) {
        (self.field, self.first) = (Vec3::zeros(), None);
    }

    /// The body moves. A rest that ends unconfirmed is false if the field fits a turn better than a
    /// rest or, where the difference would not be visible, if the bias that it found is unlikely.
    pub fn moves(&mut self, bias: &GyroBias) -> Option<Contradiction> {
        let (first, rest) = (self.first.take(), self.rest.take());
        self.quiet_for = 0.0;
        let (first, rest) = (first?, rest?);
        let Rest { before, turned, .. } = rest;
        let now = self.field;
        // The world rotates in the body in the opposite direction.
        let expected = first - turned.cross(&first);
        let turns = if (expected - first).norm() > VISIBLE * first.norm() {
            (now - expected).norm() < (now - first).norm()
        } else {
            (bias.value() - before.value()).norm() > UNLIKELY * before.sigma()
        };
        turns.then(|| Contradiction { undo: Some(rest.undo()) })
    }

    /// The body is quiet, and stationary if `rests`. `bias` is the one used in this step.
    pub fn is_quiet(&mut self, rests: bool, bias: &GyroBias, dt: f32) {
        self.quiet_for += dt;
        if !rests {
            return;
        }
        let rest =
            self.rest.get_or_insert(Rest { before: bias.known(), turned: Vec3::zeros(), lasts: 0.0, farthest: 0.0 });
        rest.turned += (bias.value() - rest.before.value()) * dt;
        rest.lasts += dt;
        if rest.lasts > CONFIRMS && rest.farthest > STAYED {
            (rest.lasts, rest.farthest) = (0.0, 0.0);
        } else if rest.lasts > CONFIRMS {
            *rest = Rest { before: bias.known(), turned: Vec3::zeros(), lasts: 0.0, farthest: 0.0 };
        }
    }

    /// Takes a field, body, µT, without hard iron, `dt` seconds after the last one. `rate` is the
    /// gyro's mean including its bias, `bias` the present estimate.
    pub fn field(
        &mut self,
        config: &AttitudeConfig,
        field: &Vec3,
        rate: &Vec3,
        bias: &GyroBias,
        dt: f32,
    ) -> Option<Contradiction> {
        let share = if self.field == Vec3::zeros() { 1.0 } else { (dt / config.rest_filter_time).min(1.0) };
        self.field += (field - self.field) * share;
        let now = self.field;
        if self.quiet_for <= 0.0 {
            return None;
        }
        let first = *self.first.get_or_insert(now);
        let [was, is] = [first.norm(), now.norm()];
        let turn = math::atan2(first.cross(&now).norm(), first.dot(&now));
        if let Some(rest) = &mut self.rest {
            rest.farthest = rest.farthest.max(turn);
        }
        if turn < TURNED {
            return None;
        }
        let before = self.rest.map_or_else(|| bias.known(), |rest| rest.before);
        // The largest rotation since the start of the rest that fits the gyro.
        let seen = ((rate - before.value()).norm() + 3.0 * before.sigma()) * self.quiet_for;
        if (is - was).abs() > BENT * config.mag_strength_tolerance * was || seen < turn {
            self.first = Some(now);
            return None;
        }
        let undo = self.rest.take().map(|rest| rest.undo());
        (self.first, self.quiet_for) = (None, 0.0);
        Some(Contradiction { undo })
    }
}
