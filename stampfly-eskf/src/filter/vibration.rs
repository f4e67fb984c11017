//! Vibration of the inertial signals, measured as their change from sample to sample.
//!
//! A sample represents the interval until the next one. If the signal changes by Δ between them,
//! the integral is wrong by a share of Δ, be it from vibration, aliasing, a jerk or samples that a
//! logger dropped. The process noise is therefore the sensor's own plus a share of this change, and
//! one tuning serves a vehicle at rest, one carried by a person and one with unbalanced propellers.
//!
//! Not a general noise estimate: slow, smooth manoeuvres do not change it.

use stampfly_types::Vec3;

/// Time constant of the average, s: a few samples, so that it reacts within a jerk, and a few
/// propeller periods.
const TIME_CONSTANT: f32 = 0.05;

/// Mean square of a signal's change from sample to sample, averaged over the axes.
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
    /// Adds the next sample, `dt` seconds after the last.
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
