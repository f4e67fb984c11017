//! Three numbers for what a torque does to the body rate: gain, motor lag, delay.
//!
//! ```text
//!             k · e^(−s·T)
//! P(s) = ──────────────────        k = 1 / moment of inertia
//!          s · (1 + s·τ)
//! ```
//!
//! The fit is least squares of the logarithm, which weighs a phase of a tenth of a radian like a magnitude of a tenth, and each point
//! by its spread: P. Guillaume, R. Pintelon and J. Schoukens, *Robust parametric transfer function estimation using complex
//! logarithmic frequency response data*, IEEE Transactions on Automatic Control 40 (1995). For a given lag the logarithm is linear in
//! ln k and in T, so only the lag is searched for: there is no start to choose and nothing that can diverge.
//!
//! Use it for an axis that a torque accelerates. Not for one with an elastic mode or strong damping within the measured band:
//! the fit's [`misfit`](PlantModel::misfit) tells.

use nalgebra::Complex;
use stampfly_types::math;

use super::excitation::TONES;
use super::spectrum::PlantPoint;

/// Lags that are tried, s: one a step, three rounds of which each looks more closely.
const ROUND: u8 = 16;
const ROUNDS: u8 = 3;
/// Shortest lag that is not none, and the longest, s.
const LAGS: [f32; 2] = [0.001, 0.2];
/// Longest delay, s.
const DELAY_MAX: f32 = 0.05;
/// No point is trusted to better than this: the model itself is no better.
const SPREAD_MIN: f32 = 0.02;
/// A lag has to lower the weighted sum of squares by this to count as one; three standard deviations.
const WORTH: f32 = 9.0;

/// A plant with gain, lag and delay.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PlantModel {
    /// Angular acceleration per torque, k, rad/s² per N·m.
    pub gain: f32,
    /// Time constant of the motors, τ, s. Zero where none was found.
    pub lag: f32,
    /// Delay from a computed torque to its effect and back to a measured rate, T, s, half a period of holding included.
    pub delay: f32,
    /// Root mean square of what the points differ from the model, relative, each weighted by its spread.
    pub misfit: f32,
}

impl PlantModel {
    /// Body rate over torque at an angular frequency, rad/s: rad/s per N·m.
    ///
    /// ```
    /// use stampfly_control::autotune::PlantModel;
    /// let slow = PlantModel { gain: 1000.0, lag: 0.02, delay: 0.005, misfit: 0.0 };
    /// let response = slow.response(50.0);
    /// assert!((response.norm_sqr() - 200.0).abs() < 1e-2, "20 rad/s per N*m, and 3 dB less");
    /// ```
    #[must_use]
    pub fn response(&self, frequency: f32) -> Complex<f32> {
        let (sin, cos) = math::sin_cos(self.delay * frequency);
        let s = Complex::new(0.0, frequency);
        Complex::new(cos, -sin) * self.gain / (s * (s * self.lag + 1.0))
    }
}

/// A search for the lag, one candidate a step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Fit {
    tried: u8,
    /// Where this round looks, s.
    from: f32,
    to: f32,
    best: Candidate,
    /// Without a lag.
    without: Candidate,
}

#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Candidate {
    model: PlantModel,
    cost: f32,
}

impl Fit {
    pub(super) fn new() -> Self {
        // Any cost is less.
        let none = Candidate { model: PlantModel::default(), cost: f32::INFINITY };
        Self { tried: 0, from: LAGS[0], to: LAGS[1], best: none, without: none }
    }

    /// One step; the model with the last.
    pub(super) fn step(&mut self, points: &[PlantPoint; TONES]) -> Option<PlantModel> {
        if self.tried == 0 {
            self.without = candidate(points, 0.0);
        }
        let place = f32::from(self.tried % ROUND) / f32::from(ROUND - 1);
        let tried = candidate(points, self.from * math::pow(self.to / self.from, place));
        if tried.cost < self.best.cost {
            self.best = tried;
        }
        self.tried += 1;
        if self.tried.is_multiple_of(ROUND) {
            // The least lies beside the best that was tried.
            let step = math::pow(self.to / self.from, 1.0 / f32::from(ROUND - 1));
            let lag = self.best.model.lag.max(LAGS[0]);
            (self.from, self.to) = ((lag / step).max(LAGS[0]), (lag * step).min(LAGS[1]));
        }
        let simple = self.without.cost <= self.best.cost + WORTH;
        (self.tried == ROUND * ROUNDS).then_some(if simple { self.without.model } else { self.best.model })
    }
}

/// The best gain and delay for a lag.
fn candidate(points: &[PlantPoint; TONES], lag: f32) -> Candidate {
    // The logarithm of each point times jω(1 + jωτ), which is that of k·e^(−jωT): magnitude and phase, with weight.
    let mut turned = 0.0;
    let lines = points.map(|point| {
        let s = Complex::new(0.0, point.frequency);
        let rest = point.response * s * (s * lag + 1.0);
        // Neighbours differ by much less than half a turn, so the phase is followed from one to the next.
        turned += math::wrap_angle(math::atan2(rest.im, rest.re) - turned);
        let spread = point.spread.max(SPREAD_MIN);
        (point.frequency, 0.5 * math::ln(rest.norm_sqr()), turned, 1.0 / (spread * spread))
    });
    let sum = |term: fn(&(f32, f32, f32, f32)) -> f32| lines.iter().map(term).sum::<f32>();
    let weight = sum(|line| line.3);
    let ln_gain = sum(|line| line.3 * line.1) / weight;
    let late = -sum(|line| line.3 * line.0 * line.2) / sum(|line| line.3 * line.0 * line.0);
    let delay = late.clamp(0.0, DELAY_MAX);
    let cost = lines.iter().map(|(frequency, ln, phase, weight)| {
        let (magnitude, angle) = (ln - ln_gain, phase + frequency * delay);
        weight * (magnitude * magnitude + angle * angle)
    });
    let cost = cost.sum::<f32>();
    let misfit = math::sqrt(cost / weight);
    Candidate { model: PlantModel { gain: math::exp(ln_gain), lag, delay, misfit }, cost }
}

#[cfg(test)]
mod tests {
    use super::super::excitation::frequencies;
    use super::*;
    use stampfly_types::Duration;

    /// Points of a plant, the `wrong`-th of them off by a third.
    fn fit(plant: &PlantModel, spread: f32, wrong: Option<usize>) -> PlantModel {
        let mut index = 0;
        let points = frequencies(Duration::from_secs(2)).map(|frequency| {
            let off = if wrong == Some(index) { 1.33 } else { 1.0 };
            index += 1;
            let spread = if off > 1.0 { 0.5 } else { spread };
            PlantPoint { frequency, response: plant.response(frequency) * off, spread, coherence: 1.0 }
        });
        let mut fit = Fit::new();
        (0..=255).find_map(|_| fit.step(&points)).expect("it ends")
    }

    #[test]
    fn gain_lag_and_delay_are_found() {
        for gain in [50.0, 1_667.0, 109_000.0] {
            for lag in [0.009, 0.018, 0.05] {
                for delay in [0.0, 0.005, 0.012, 0.03] {
                    let plant = PlantModel { gain, lag, delay, misfit: 0.0 };
                    let found = fit(&plant, 0.02, None);
                    let near = |found: f32, truth: f32, by: f32| (found - truth).abs() < by;
                    assert!(near(found.gain / gain, 1.0, 0.01), "{plant:?} {found:?}");
                    assert!(near(found.lag, lag, 2e-4) && near(found.delay, delay, 2e-4), "{plant:?} {found:?}");
                    assert!(found.misfit < 0.01, "{found:?}");
                }
            }
        }
    }

    #[test]
    fn motors_without_a_lag_get_none() {
        let plant = PlantModel { gain: 1_000.0, lag: 0.0, delay: 0.01, misfit: 0.0 };
        let found = fit(&plant, 0.03, None);
        assert!(found.lag == 0.0 && (found.delay - 0.01).abs() < 1e-4, "{found:?}");
    }

    #[test]
    fn a_point_of_large_spread_hardly_counts() {
        let plant = PlantModel { gain: 1_000.0, lag: 0.018, delay: 0.006, misfit: 0.0 };
        let found = fit(&plant, 0.02, Some(0));
        assert!((found.gain / 1_000.0 - 1.0).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn what_is_no_number_fits_nothing() {
        let plant = PlantModel { gain: f32::NAN, lag: 0.018, delay: 0.006, misfit: 0.0 };
        assert!(fit(&plant, 0.02, None).gain == 0.0);
    }
}
