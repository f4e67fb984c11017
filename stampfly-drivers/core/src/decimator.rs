//! Decimates an inertial sensor's samples by four with a low-pass filter against aliasing.
//!
//! The filter is two moving averages of four in a row, which gives the weights 1 2 3 4 3 2 1,
//! computed exactly in integers. It has double zeros at one and two times the output rate, the
//! frequencies that alias to zero: with 1600 Hz in and 400 Hz out it damps a rotor at hover
//! (478 Hz) by 30 dB. The weights are symmetric, so every frequency is delayed by three input
//! samples: the output is valid for the first sample of the newest group.
//!
//! Not for ratios other than four. It does not replace a notch filter: frequencies below half the
//! output rate pass.

/// The filter for six channels: three of acceleration, three of angular rate.
///
/// ```
/// use stampfly_driver_core::Decimator;
/// let mut decimator = Decimator::default();
/// assert_eq!(decimator.push(&[[10; 6]; 4]), None, "the first group only fills the filter");
/// assert_eq!(decimator.push(&[[10; 6]; 4]), Some([160; 6]), "in sixteenths");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decimator {
    /// The previous group's share of the next output; `None` before the first group.
    carry: Option<[i32; 6]>,
}

impl Decimator {
    /// Sum of the weights. An output divided by it is in counts of the input.
    pub const GAIN: i32 = 16;

    /// Takes four samples and returns one, in sixteenths of an input count. The first group fills
    /// the filter and returns `None`.
    #[must_use]
    pub fn push(&mut self, group: &[[i16; 6]; 4]) -> Option<[i32; 6]> {
        // The seven weights span two groups: the samples of this group have the falling weights
        // 4 3 2 1 in this output and the rising weights 0 1 2 3 in the next one.
        let before = self.carry.replace(weighted(group, [0, 1, 2, 3]));
        let mut sum = weighted(group, [4, 3, 2, 1]);
        for (sum, before) in sum.iter_mut().zip(before?) {
            *sum += before;
        }
        Some(sum)
    }
}

fn weighted(group: &[[i16; 6]; 4], weights: [i32; 4]) -> [i32; 6] {
    let mut sum = [0; 6];
    for (sample, weight) in group.iter().zip(weights) {
        for (sum, value) in sum.iter_mut().zip(sample) {
            *sum += weight * i32::from(*value);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gain(frequency: f64) -> f64 {
        let mut decimator = Decimator::default();
        let wave = |n: usize| 20_000.0 * (core::f64::consts::TAU * frequency * n as f64 / 1600.0).cos();
        let mut peak = 0.0f64;
        for group in 0..400 {
            let samples = core::array::from_fn(|i| [wave(4 * group + i) as i16; 6]);
            peak = peak.max(decimator.push(&samples).map_or(0.0, |y| (f64::from(y[0]) / 16.0).abs()));
        }
        peak / 20_000.0
    }

    #[test]
    fn constants_pass_exactly_and_ramps_are_delayed_by_three_samples() {
        let mut decimator = Decimator::default();
        assert_eq!(decimator.push(&[[i16::MIN; 6]; 4]), None);
        assert_eq!(decimator.push(&[[i16::MIN; 6]; 4]), Some([-32768 * Decimator::GAIN; 6]));
        let mut decimator = Decimator::default();
        assert_eq!(decimator.push(&[[0; 6], [1; 6], [2; 6], [3; 6]]), None);
        assert_eq!(decimator.push(&[[4; 6], [5; 6], [6; 6], [7; 6]]), Some([4 * Decimator::GAIN; 6]), "7 − 3");
    }

    #[test]
    fn the_loop_bandwidth_passes_and_the_rotors_do_not() {
        assert!(gain(20.0) > 0.99 && gain(60.0) > 0.92, "{} {}", gain(20.0), gain(60.0));
        assert!(gain(400.0) < 1e-3 && gain(800.0) < 1e-3);
        assert!((0.02..0.04).contains(&gain(478.0)), "{}", gain(478.0));
    }
}
