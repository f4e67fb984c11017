//! A few numbers for what a torque does to the body rate: gain, motor lag, delay, and the lead of rotors that are heavy.
//!
//! ```text
//!         k · (1 + s·ζ) · e^(−s·T)
//! P(s) = ──────────────────────────        k = 1 / moment of inertia
//!              s · (1 + s·τ)
//! ```
//!
//! The lead ζ is yaw's: a rotor that speeds up turns the body against itself, before its drag does. Lag and lead are kept only if they are
//! worth it, so roll and pitch have k·e^(−sT)/(s·(1 + sτ)), and motors without a lag k·e^(−sT)/s.
//!
//! The fit is least squares of the logarithm, which weighs a phase of a tenth of a radian like a magnitude of a tenth, and each point
//! by its spread: P. Guillaume, R. Pintelon and J. Schoukens, *Robust parametric transfer function estimation using complex
//! logarithmic frequency response data*, IEEE Transactions on Automatic Control 40 (1995). For given lead and lag the logarithm is linear
//! in ln k and in T, so only those two are searched for, on a grid: there is no start to choose and nothing that can diverge.
//!
//! Use it for an axis that a torque accelerates. Not for one with an elastic mode or strong damping within the measured band:
//! the fit's [`misfit`](PlantModel::misfit) tells.

use nalgebra::Complex;
use stampfly_types::math;

use super::excitation::TONES;
use super::spectrum::PlantPoint;

/// Lags that are tried in a round, and as many leads in the second part of the search; each round looks more closely.
const ROUND: u16 = 12;
const ROUNDS: u16 = 4;
/// Shortest and longest time constant that is looked for, s.
const TIMES: [f32; 2] = [0.001, 0.3];
/// Longest delay, s.
const DELAY_MAX: f32 = 0.05;
/// No point is trusted to better than this: the model itself is no better.
const SPREAD_MIN: f32 = 0.02;
/// A lag has to lower the weighted sum of squares by this to count as one, a lead by this; three and five standard deviations.
const LAG_WORTH: f32 = 9.0;
const LEAD_WORTH: f32 = 25.0;

/// A plant with gain, lead, lag and delay.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PlantModel {
    /// Angular acceleration per torque, k, rad/s² per N·m.
    pub gain: f32,
    /// Time constant of the zero, ζ, s. Zero where none was found.
    pub lead: f32,
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
    /// let slow = PlantModel { gain: 1000.0, lag: 0.02, delay: 0.005, ..PlantModel::default() };
    /// let response = slow.response(50.0);
    /// assert!((response.norm_sqr() - 200.0).abs() < 1e-2, "20 rad/s per N*m, and 3 dB less");
    /// ```
    #[must_use]
    pub fn response(&self, frequency: f32) -> Complex<f32> {
        let (sin, cos) = math::sin_cos(self.delay * frequency);
        let s = Complex::new(0.0, frequency);
        Complex::new(cos, -sin) * (s * self.lead + 1.0) * self.gain / (s * (s * self.lag + 1.0))
    }
}

/// A search for lead and lag, one candidate a step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Fit {
    tried: u16,
    /// Where this round looks for a lead and for a lag, s.
    lead: [f32; 2],
    lag: [f32; 2],
    /// Without either, with a lag, and with both.
    plain: Candidate,
    lagging: Candidate,
    leading: Candidate,
}

#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Candidate {
    model: PlantModel,
    cost: f32,
}

impl Candidate {
    fn or_better(&mut self, other: Self) {
        // False for what is no number.
        if other.cost < self.cost {
            *self = other;
        }
    }
}

impl Fit {
    pub(super) fn new() -> Self {
        // Any cost is less.
        let none = Candidate { model: PlantModel::default(), cost: f32::INFINITY };
        Self { tried: 0, lead: TIMES, lag: TIMES, plain: none, lagging: none, leading: none }
    }

    /// One step; the model with the last.
    pub(super) fn step(&mut self, points: &[PlantPoint; TONES]) -> Option<PlantModel> {
        const FIRST: u16 = ROUND * ROUNDS;
        const SECOND: u16 = ROUND * ROUND * ROUNDS;
        if let Some(tried) = self.tried.checked_sub(FIRST) {
            if tried == 0 {
                self.lag = TIMES;
            }
            let (row, column) = (tried / ROUND % ROUND, tried % ROUND);
            self.leading.or_better(candidate(points, at(self.lead, row), at(self.lag, column)));
            if (row, column) == (ROUND - 1, ROUND - 1) {
                let model = self.leading.model;
                (self.lead, self.lag) = (closer(self.lead, model.lead), closer(self.lag, model.lag));
            }
        } else {
            if self.tried == 0 {
                self.plain.or_better(candidate(points, 0.0, 0.0));
            }
            let column = self.tried % ROUND;
            self.lagging.or_better(candidate(points, 0.0, at(self.lag, column)));
            if column == ROUND - 1 {
                self.lag = closer(self.lag, self.lagging.model.lag);
            }
        }
        self.tried += 1;
        (self.tried == FIRST + SECOND).then(|| {
            let lagging = self.lagging.cost + LAG_WORTH < self.plain.cost;
            let simple = if lagging { self.lagging } else { self.plain };
            if self.leading.cost + LEAD_WORTH < simple.cost { self.leading.model } else { simple.model }
        })
    }
}

/// A place in a range, s, in equal ratios.
fn at([from, to]: [f32; 2], place: u16) -> f32 {
    from * math::pow(to / from, f32::from(place) / f32::from(ROUND - 1))
}

/// The range around the best of a round, s: the least lies between its neighbours.
fn closer([from, to]: [f32; 2], best: f32) -> [f32; 2] {
    let step = math::pow(to / from, 1.0 / f32::from(ROUND - 1));
    let best = best.max(TIMES[0]);
    [(best / step).max(TIMES[0]), (best * step).min(TIMES[1])]
}

/// The best gain and delay for lead and lag.
fn candidate(points: &[PlantPoint; TONES], lead: f32, lag: f32) -> Candidate {
    // The logarithm of each point times jω(1 + jωτ)/(1 + jωζ), which is that of k·e^(−jωT): magnitude and phase, with weight.
    let mut turned = 0.0;
    let lines = points.map(|point| {
        let s = Complex::new(0.0, point.frequency);
        let rest = point.response * s * (s * lag + 1.0) / (s * lead + 1.0);
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
    Candidate { model: PlantModel { gain: math::exp(ln_gain), lead, lag, delay, misfit }, cost }
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
        (0..1_000).find_map(|_| fit.step(&points)).expect("it ends")
    }

    #[test]
    fn gain_lag_and_delay_are_found() {
        for gain in [50.0, 1_667.0, 109_000.0] {
            for lag in [0.009, 0.018, 0.05] {
                for delay in [0.0, 0.005, 0.012, 0.03] {
                    let plant = PlantModel { gain, lag, delay, ..PlantModel::default() };
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
    fn the_lead_of_heavy_rotors_is_found_and_only_there() {
        for (lead, lag) in [(0.05, 0.018), (0.03, 0.01), (0.1, 0.03), (0.0, 0.018)] {
            let plant = PlantModel { gain: 800.0, lead, lag, delay: 0.006, misfit: 0.0 };
            let found = fit(&plant, 0.02, None);
            assert!((found.gain / 800.0 - 1.0).abs() < 0.02 && found.misfit < 0.01, "{plant:?} {found:?}");
            assert!((found.lead - lead).abs() <= 0.04 * lead, "{plant:?} {found:?}");
            assert!((found.lag / lag - 1.0).abs() < 0.04 && (found.delay - 0.006).abs() < 3e-4, "{plant:?} {found:?}");
        }
    }

    #[test]
    fn motors_without_a_lag_get_none() {
        let plant = PlantModel { gain: 1_000.0, lag: 0.0, delay: 0.01, ..PlantModel::default() };
        let found = fit(&plant, 0.03, None);
        assert!(found.lag == 0.0 && (found.delay - 0.01).abs() < 1e-4, "{found:?}");
    }

    #[test]
    fn a_point_of_large_spread_hardly_counts() {
        let plant = PlantModel { gain: 1_000.0, lag: 0.018, delay: 0.006, ..PlantModel::default() };
        let found = fit(&plant, 0.02, Some(0));
        assert!((found.gain / 1_000.0 - 1.0).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn what_is_no_number_fits_nothing() {
        let plant = PlantModel { gain: f32::NAN, lag: 0.018, delay: 0.006, ..PlantModel::default() };
        assert!(fit(&plant, 0.02, None).gain == 0.0);
    }
}
