//! Does the magnetic field confirm a rest? A body that turns slowly and evenly looks at rest to gyro and accelerometer, and its
//! rate is taken for bias. The field in the body turns with it all the same.
//!
//! | | condition |
//! |---|---|
//! | start | the body becomes quiet: the field of that moment is remembered, and with the rest the bias before it |
//! | contradicted | the field's direction has turned by more than [`TURNED`], as strong as before, and the gyro may have seen such a turn |
//! | then | the rest ends; the bias is the one before it, and the turn that was taken for bias is made up for |
//! | confirmed | [`CONFIRMS`] long the field has not turned by half of that: the bias stays, whatever comes |
//!
//! A magnet that passes a body at rest turns the field as well. It also changes its strength, or the gyro has not seen
//! anything that fits; then it is the new field of the same rest. Slower turns than 0.1°/s remain bias, and so do those of a
//! body without a magnetometer.

use super::bias::{GyroBias, KnownBias};
use super::config::AttitudeConfig;
use stampfly_types::{Vec3, math};

/// The noise of a small magnetometer, low-passed over half a second, stays below 0.4°, rad.
const TURNED: f32 = 1.5 * core::f32::consts::PI / 180.0;
/// While the field stays this near, the body has not turned and come back, rad.
const STAYED: f32 = 0.5 * TURNED;
/// A turn that moves the field by less is not seen when a rest ends, rad: twice the noise.
const VISIBLE: f32 = 0.8 * core::f32::consts::PI / 180.0;
/// A bias so many standard deviations from the one before is none, where the field cannot say.
const UNLIKELY: f32 = 2.0;
/// So long a rest without a turn shows the bias to less than a tenth of a degree a second, s.
const CONFIRMS: f32 = 20.0;
/// A field whose strength changed by this share of what is tolerated of a reference was bent, not turned.
const BENT: f32 = 0.5;

/// What is made up for when a rest was none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contradiction {
    /// What the rest did; `None` when the body had only been quiet.
    pub undo: Option<Undo>,
}

/// What a rest that was none did.
#[derive(Clone, Copy, Debug)]
pub(super) struct Undo {
    /// The bias before it.
    pub bias: KnownBias,
    /// By how much the body turned that was taken for bias, body, rad, and how well that is known, rad.
    pub turned: Vec3,
    pub sigma: f32,
}

/// A rest that may still be contradicted.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Rest {
    before: KnownBias,
    turned: Vec3,
    lasts: f32,
    /// How far the field has been from the first one, rad.
    farthest: f32,
}

impl Rest {
    fn undo(&self) -> Undo {
        Undo { bias: self.before, turned: self.turned, sigma: self.before.sigma() * self.lasts }
    }
}

/// Compares the field with that of the beginning of a rest.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Witness {
    /// Mean of the last moment; zero before the first.
    field: Vec3,
    /// The field when the body became quiet.
    first: Option<Vec3>,
    /// For how long it has been quiet since, s.
    quiet_for: f32,
    rest: Option<Rest>,
}

impl Witness {
    pub const fn new() -> Self {
        Self { field: Vec3::zeros(), first: None, quiet_for: 0.0, rest: None }
    }

    /// Another hard iron is taken out of the field from now on.
    pub fn start_over(&mut self) {
        (self.field, self.first) = (Vec3::zeros(), None);
    }

    /// The body is not quiet. A rest that ends before it was confirmed is one if the field fits it better than a turn; where no
    /// difference would be seen, if the bias that it showed is likely.
    pub fn moves(&mut self, bias: &GyroBias) -> Option<Contradiction> {
        let (first, rest) = (self.first.take(), self.rest.take());
        self.quiet_for = 0.0;
        let (first, rest) = (first?, rest?);
        let Rest { before, turned, .. } = rest;
        let now = self.field;
        // The world as the body sees it turns the other way.
        let expected = first - turned.cross(&first);
        let turns = if (expected - first).norm() > VISIBLE * first.norm() {
            (now - expected).norm() < (now - first).norm()
        } else {
            (bias.value() - before.value()).norm() > UNLIKELY * before.sigma()
        };
        turns.then(|| Contradiction { undo: Some(rest.undo()) })
    }

    /// The body is quiet, and at rest with `rests`; `bias` is the one that this step has integrated with.
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

    /// Takes a field, body, µT, free of hard iron, `dt` seconds after the one before; `rate` is the gyro's mean of the last
    /// moment, with its bias, and `bias` the present one.
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
