//! Tests the mean of the flow innovations: a mean that is not zero indicates a covariance that is
//! too small.
//!
//! A gate tests single innovations. A gyro bias far beyond its standard deviation never reaches it:
//! the tilt settles where flow corrects as fast as the bias tilts, with every innovation inside the
//! gate and all of one sign. The innovations of a consistent filter are white (Mehra, "On the
//! identification of variances and adaptive Kalman filtering", IEEE TAC 15(2), 1970), so their mean
//! is near zero. A biased mean requires inflation of the states that cause it.

/// Time constant of the mean, s.
const TIME_CONSTANT: f32 = 0.3;
/// Largest mean, in standard deviations of one innovation: five standard deviations of the mean at
/// 100 Hz.
const MAX_MEAN: f32 = 0.8;

/// Running mean of a sensor's whitened innovations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct InnovationBiasMonitor {
    mean: [f32; 2],
}

impl InnovationBiasMonitor {
    /// Adds the whitened innovations of a measurement over `dt` seconds. Returns true if the mean
    /// is biased, and then restarts from zero.
    pub(super) fn update(&mut self, innovations: &[f32; 2], dt: f32) -> bool {
        let share = dt / (TIME_CONSTANT + dt);
        for (mean, innovation) in self.mean.iter_mut().zip(innovations) {
            // Clamped, so that a single outlier cannot bias the mean; outliers are left to the
            // gate.
            *mean += (innovation.clamp(-3.0, 3.0) - *mean) * share;
        }
        let [x, y] = self.mean;
        let biased = x * x + y * y > MAX_MEAN * MAX_MEAN;
        if biased {
            *self = Self::default();
        }
        biased
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn innovations_of_alternating_sign_pass_and_of_one_sign_are_biased() {
        let mut monitor = InnovationBiasMonitor::default();
        for n in 0..1000 {
            let side = if n % 2 == 0 { 1.5 } else { -1.5 };
            assert!(!monitor.update(&[side, -side], 0.01));
        }
        let first = (0..100).find(|_| monitor.update(&[1.0, 0.8], 0.01)).expect("found");
        assert!((20..50).contains(&first), "after {first} readings");
        assert!(!monitor.update(&[1.0, 0.8], 0.01), "the mean starts again from zero");
    }
}
