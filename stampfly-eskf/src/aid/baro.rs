//! Barometric altitude as a measurement of the vertical position.
//!
//! h = −p_z + offset, so the only derivative is −1. Air pressure drifts by metres an hour. The
//! offset is therefore estimated, too ([`Offset`]): a random walk whose variance is added to the
//! sensor noise and which is updated with the same innovation. It is not one of the fifteen states:
//! its correlation with them is negligible, because it drifts by centimetres a minute while a range
//! is accurate to a centimetre.
//!
//! Conditions in [`Eskf`](crate::Eskf):
//! - **Start**: `baro_enable`. The first altitude defines the offset.
//! - **Continue**: a test ratio of at most one. Updates height and offset.
//! - **With a receiver** and `baro_backup`: updates only the offset while an external height is
//!   younger than two seconds.
//! - **Stop**: not finite or not new, refused at once. Inactive one second after the last accepted
//!   altitude.
//! - **Reset**: rejected for longer than `lockout`. With another source of height (range, receiver,
//!   ground) the offset is set to the altitude and the state is unchanged; not counted towards
//!   divergence. Without one the height is set to an altitude within 2 m, and a larger residual
//!   stays rejected.
//! - **Take-off**: starting propellers change the pressure. The offset's variance grows by
//!   `baro_wash`², and so does the noise near the floor ([`wash`]).
//! - **Origin reset by command**: the offset moves with the origin.

use super::Row;
use crate::filter::{NominalState, POSITION};

/// Predicted altitude, where `offset` is the altitude of the origin, m.
#[inline]
#[must_use]
pub fn altitude(state: &NominalState, offset: f32) -> Row {
    Row::new(offset - state.position.z, [(POSITION + 2, -1.0)])
}

/// Height at which the propellers' pressure has fallen to half of its value at the floor, m. Ground
/// effect reaches about two rotor diameters, and the rotors of small multirotors measure 0.05 to
/// 0.1 m.
const WASH_HEIGHT: f32 = 0.2;

/// Standard deviation of the altitude due to propeller wash, m, at `height` metres above the floor;
/// `floor` is the value at the floor. It decreases with the square of the height.
#[inline]
#[must_use]
pub fn wash(floor: f32, height: f32) -> f32 {
    let share = height.max(0.0) / WASH_HEIGHT;
    floor / (1.0 + share * share)
}

/// Altitude that the barometer reads at the origin, with its variance.
///
/// ```
/// use stampfly_eskf::aid::baro::Offset;
/// let mut offset = Offset::new(120.0, 0.1);
/// // Ten minutes at 0.02 m/√s: a standard deviation of 0.5 m, so an innovation of 0.5 m
/// // is mostly drift.
/// offset.propagate(600.0, 0.02);
/// offset.update(0.5, 0.01);
/// assert!((offset.value() - 120.45).abs() < 0.05);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Offset {
    value: f32,
    variance: f32,
}

impl Offset {
    /// An offset in m with an initial variance in m².
    #[must_use]
    pub const fn new(value: f32, variance: f32) -> Self {
        Self { value, variance }
    }

    /// Altitude of the origin, m.
    #[must_use]
    pub const fn value(&self) -> f32 {
        self.value
    }

    /// Its variance, m².
    #[must_use]
    pub const fn variance(&self) -> f32 {
        self.variance
    }

    /// Moves the origin down by `down` metres.
    pub fn shift(&mut self, down: f32) {
        self.value -= down;
    }

    /// Adds `variance`, m².
    pub fn inflate(&mut self, variance: f32) {
        self.variance += variance;
    }

    /// Propagates the variance over `seconds` of random walk, with `walk` in m/√s.
    pub fn propagate(&mut self, seconds: f32, walk: f32) {
        self.variance += walk * walk * seconds;
    }

    /// Updates with an innovation, m. `others` is the innovation variance without the offset's own
    /// part, m².
    pub fn update(&mut self, innovation: f32, others: f32) {
        let gain = self.variance / (self.variance + others);
        self.value += gain * innovation;
        self.variance *= 1.0 - gain;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wash_fades_with_the_height() {
        assert_eq!([-0.1, 0.0, 0.2].map(|height| wash(0.6, height)), [0.6, 0.6, 0.3]);
        assert!(wash(0.6, 1.0) < 0.03 && wash(0.0, 0.1) == 0.0);
    }

    #[test]
    fn jacobian_matches_numerical_differentiation() {
        crate::aid::numeric::check(|state| altitude(state, 12.0));
    }
}
