//! Second-order low-pass for vectors, accurate in `f32` with time constants of seconds at kilohertz
//! rates.
//!
//! Butterworth response as a state-variable filter: two trapezoidal integrators with the loop
//! closed within the sample (Zavalishin, "The Art of VA Filter Design", chapter 4). A biquad would
//! have to represent 1 − 10⁻⁷ in its coefficients; here the coefficients themselves are small. The
//! derivative of the output is a state, without cancellation, and `dt` may change from sample to
//! sample.
//!
//! Until one time constant has passed, the output is the mean of the input, so the filter needs no
//! settling (Laidig, Seel, "VQF", Information Fusion 91, 2023, section 3.6).
//!
//! Not for control signals: with a corner near the sampling rate the tangent of the exact bilinear
//! transform matters, which is omitted here.

use nalgebra::SVector;

/// Low-pass of `N` channels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct LowPass<const N: usize> {
    time_constant: f32,
    /// Time filtered so far, up to the time constant, s.
    age: f32,
    /// Integrator state: derivative of the output divided by the corner frequency.
    slope: SVector<f32, N>,
    /// Integrator state: the output.
    level: SVector<f32, N>,
    value: SVector<f32, N>,
    rate: SVector<f32, N>,
}

impl<const N: usize> LowPass<N> {
    /// An empty filter. The time constant is in seconds and positive.
    pub fn new(time_constant: f32) -> Self {
        let zero = SVector::zeros();
        Self { time_constant, age: 0.0, slope: zero, level: zero, value: zero, rate: zero }
    }

    /// A filter in steady state at this value.
    pub fn settled_at(time_constant: f32, value: SVector<f32, N>) -> Self {
        Self { age: time_constant, level: value, value, ..Self::new(time_constant) }
    }

    /// Takes a sample `dt` seconds after the last one.
    pub fn step(&mut self, input: &SVector<f32, N>, dt: f32) {
        if self.age < self.time_constant {
            self.age += dt;
            self.value += (input - self.value) * (dt / self.age);
            self.level = self.value;
            return;
        }
        // Before this point the loop has not run: the output was the mean.
        let corner = core::f32::consts::SQRT_2 / self.time_constant;
        let gain = 0.5 * corner * dt;
        let loop_gain = 1.0 / (1.0 + gain * (gain + core::f32::consts::SQRT_2));
        let slope = (self.slope + (input - self.level) * gain) * loop_gain;
        let value = self.level + slope * gain;
        self.slope = slope * 2.0 - self.slope;
        self.level = value * 2.0 - self.level;
        self.rate = slope * corner;
        self.value = value;
    }

    /// The output.
    pub fn value(&self) -> &SVector<f32, N> {
        &self.value
    }

    /// Its derivative, 1/s. Zero until [`is_settled`](Self::is_settled).
    pub fn rate(&self) -> &SVector<f32, N> {
        &self.rate
    }

    /// Whether more than a time constant has been filtered.
    pub fn is_settled(&self) -> bool {
        self.age >= self.time_constant
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use nalgebra::Vector1;

    /// Largest difference from the bilinear biquad in `f64` on the same input.
    fn worst_difference(rate: f64, time_constant: f64) -> f64 {
        let gain = (0.5 * 2f64.sqrt() / time_constant / rate).tan();
        let scale = 1.0 / (1.0 + gain * (gain + 2f64.sqrt()));
        let b = gain * gain * scale;
        let [a1, a2] = [2.0 * (gain * gain - 1.0) * scale, (1.0 - gain * (2f64.sqrt() - gain)) * scale];
        let (mut x, mut y) = ([9.0f64; 2], [9.0f64; 2]);
        let mut ours = LowPass::settled_at(time_constant as f32, Vector1::new(9.0));
        let mut worst = 0.0f64;
        for step in 0..(30.0 * rate) as u32 {
            let input = 9.0 + (0.4 * f64::from(step) / rate).sin() * 2.0;
            let output = b * (input + 2.0 * x[0] + x[1]) - a1 * y[0] - a2 * y[1];
            (x, y) = ([input, x[0]], [output, y[0]]);
            ours.step(&Vector1::new(input as f32), (1.0 / rate) as f32);
            worst = worst.max((f64::from(ours.value()[0]) - output).abs());
        }
        worst
    }

    #[test]
    fn single_precision_is_enough_from_100_hz_to_8_khz() {
        for rate in [100.0, 400.0, 1_000.0, 8_000.0] {
            let worst = worst_difference(rate, 3.0);
            // In m/s², to be compared with gravity: a thirtieth of a degree of tilt.
            assert!(worst < 6e-3, "{worst} at {rate} Hz");
        }
    }

    #[test]
    fn the_rate_is_the_derivative() {
        let mut filter = LowPass::settled_at(1.0, Vector1::new(0.0));
        for step in 0..4_000u16 {
            filter.step(&Vector1::new(0.3 * f32::from(step) * 0.0025), 0.0025);
        }
        assert_abs_diff_eq!(filter.rate()[0], 0.3, epsilon = 1e-3);
    }

    #[test]
    fn starts_with_the_mean() {
        let mut filter = LowPass::new(1.0);
        for value in [1.0, 2.0, 3.0, 6.0] {
            filter.step(&Vector1::new(value), 0.1);
        }
        assert!((filter.value()[0] - 3.0).abs() < 1e-6 && filter.rate()[0] == 0.0 && !filter.is_settled());
    }
}
