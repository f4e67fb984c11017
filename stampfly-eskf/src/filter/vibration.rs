//! Vibration of the inertial signals, measured as their change from sample to sample.
//!
//! A sample stands for the interval until the next. Where the signal changes by Δ from one to the next, that is
//! wrong by some share of Δ: vibration, aliasing, a jerk, the samples that a logger left out. So the noise that drives
//! the filter is the sensor's own plus a share of what the signal is doing, and one tuning serves a vehicle that
//! stands, one that is carried and one whose propellers are out of balance.
//!
//! Not a noise estimate for its own sake: a slow, smooth manoeuvre leaves it where it is.

use stampfly_types::Vec3;

/// Time constant of the average, s: some samples, so that it is there when a jerk is, and a few periods of a
/// propeller.
const TIME_CONSTANT: f32 = 0.05;

/// Mean square of a signal's change from sample to sample, per axis.
///
/// ```
/// use stampfly_eskf::filter::Vibration;
/// use stampfly_types::Vec3;
/// let mut vibration = Vibration::default();
/// for n in 0..400 {
///     vibration.add(&Vec3::new(if n % 2 == 0 { 0.1 } else { -0.1 }, 0.0, -9.8), 0.0025);
/// }
/// // One axis of three changes by 0.2 at every sample.
/// assert!((vibration.mean_square() - 0.04 / 3.0).abs() < 1e-4);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Vibration {
    last: Option<Vec3>,
    mean_square: f32,
}

impl Vibration {
    /// Takes the next sample, `dt` seconds after the last.
    #[inline]
    pub fn add(&mut self, sample: &Vec3, dt: f32) {
        if let Some(last) = self.last.replace(*sample) {
            let change = (sample - last).norm_squared() * (1.0 / 3.0);
            self.mean_square += (change - self.mean_square) * (dt / (TIME_CONSTANT + dt));
        }
    }

    /// Mean square of the change, in the signal's unit squared.
    #[inline]
    #[must_use]
    pub const fn mean_square(&self) -> f32 {
        self.mean_square
    }
}
