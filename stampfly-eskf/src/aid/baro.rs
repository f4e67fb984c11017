//! Barometric altitude as vertical position.
//!
//! h = −p_z + offset, so the only derivative by the states is −1. Pressure drifts by metres an hour, so the offset is
//! an estimate of its own ([`Offset`]): a random walk with a variance, which adds to the sensor's noise as far as the
//! filter is concerned, and is updated with the same innovation. It is kept apart from the fifteen states: what couples
//! them is a drift of centimetres a minute beside a range that is good to a centimetre.
//!
//! | in [`Eskf`](crate::Eskf) | condition |
//! |---|---|
//! | start | `baro_enable`; the first altitude defines the offset |
//! | continue | a test ratio of at most one: updates the height and the offset |
//! | beside a receiver | with `baro_backup`: it only learns its offset while an outside height is younger than two seconds |
//! | stop | not finite or not new: refused at once, inactive one second after the last accepted altitude |
//! | reset | rejected for longer than `lockout`: the offset to the altitude, the state stays; not counted towards divergence |
//! | leaves the ground | starting propellers move the pressure: the offset's variance grows by `baro_wash`², and so does the noise, less with the height ([`wash`]) |
//! | origin reset by command | the offset shifts with the origin |

use super::Row;
use crate::filter::{NominalState, POSITION};

/// Predicted altitude for an altitude `offset` of the origin, m.
#[inline]
#[must_use]
pub fn altitude(state: &NominalState, offset: f32) -> Row {
    Row::new(offset - state.position.z, [(POSITION + 2, -1.0)])
}

/// Height at which the propellers' pressure is half of what it is at the floor, m. A rotor feels the ground up to about two diameters, and
/// those of small multirotors have 0.05 to 0.1 m.
const WASH_HEIGHT: f32 = 0.2;

/// Standard deviation of what propellers do to an altitude, m, at this height above the floor, for `floor` at the floor. It fades with the
/// square of the height.
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
/// // Ten minutes at 0.02 m/√s: a standard deviation of half a metre, so an innovation of half a metre is mostly drift.
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
    /// An offset with a first variance, m and m².
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

    /// The origin moved down by this much, m.
    pub fn shift(&mut self, down: f32) {
        self.value -= down;
    }

    /// Inflates its variance by `variance`, m².
    pub fn inflate(&mut self, variance: f32) {
        self.variance += variance;
    }

    /// Propagates the variance over `seconds` of random walk, with `walk` in m/√s.
    pub fn propagate(&mut self, seconds: f32, walk: f32) {
        self.variance += walk * walk * seconds;
    }

    /// Updates the offset with an innovation whose variance, without this offset's own, is `others`.
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
