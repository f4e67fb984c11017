//! From 1600 Hz to 400 Hz without folding.
//!
//! Two moving averages of four in a row, that is the weights 1 2 3 4 3 2 1, computed exactly in integers. Its double
//! zeros lie at 400 and 800 Hz, where the folds to zero would come from; a rotor at hover (478 Hz) is damped by
//! 30 dB. It is symmetric, so every frequency is delayed by the same three input samples: the output is valid for
//! the first sample of the newest group.

/// The filter for six channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Decimator {
    /// What the previous group adds to the next output.
    carry: Option<[i32; 6]>,
}

impl Decimator {
    /// Takes four samples and gives one in counts; the first group only fills the filter.
    pub(crate) fn push(&mut self, group: &[[i16; 6]; 4]) -> Option<[f64; 6]> {
        let weighted = |weights: [i32; 4]| -> [i32; 6] {
            core::array::from_fn(|channel| (0..4).map(|i| weights[i] * i32::from(group[i][channel])).sum())
        };
        let before = self.carry.replace(weighted([0, 1, 2, 3]))?;
        let now = weighted([4, 3, 2, 1]);
        Some(core::array::from_fn(|channel| f64::from(before[channel] + now[channel]) / 16.0))
    }
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
            peak = peak.max(decimator.push(&samples).map_or(0.0, |y| y[0].abs()));
        }
        peak / 20_000.0
    }

    #[test]
    fn constants_pass_exactly_and_ramps_are_delayed_by_three_samples() {
        let mut decimator = Decimator::default();
        assert_eq!(decimator.push(&[[i16::MIN; 6]; 4]), None);
        assert_eq!(decimator.push(&[[i16::MIN; 6]; 4]), Some([-32768.0; 6]));
        let mut decimator = Decimator::default();
        decimator.push(&[[0; 6], [1; 6], [2; 6], [3; 6]]);
        assert_eq!(decimator.push(&[[4; 6], [5; 6], [6; 6], [7; 6]]), Some([4.0; 6]), "7 − 3");
    }

    #[test]
    fn the_loop_bandwidth_passes_and_the_rotors_do_not() {
        assert!(gain(20.0) > 0.99 && gain(60.0) > 0.92, "{} {}", gain(20.0), gain(60.0));
        assert!(gain(400.0) < 1e-3 && gain(800.0) < 1e-3);
        assert!((0.02..0.04).contains(&gain(478.0)), "{}", gain(478.0));
    }
}
