//! Gain and phase margin of a rate loop, from the plant's response at a list of frequencies.
//!
//! The loop is opened at the torque. Its response is the plant's times that of the [`Pid`](crate::Pid) as it is computed: bilinear, so that
//! the continuous formula holds at Ω = 2/Δ·tan(ωΔ/2) in place of ω. The derivative acts on the measurement and the attitude loop
//! around it on the set-point, so with an attitude gain a, 1/s,
//!
//! ```text
//! L = P · Kp · ( (1 + 1/(jΩ·Ti)) · (1 + a/(jΩ)) + jΩ·Td / (1 + jΩ·η·Td) )
//! ```
//!
//! Between two frequencies the logarithm of L is taken to be straight. The definitions are those of K. J. Åström and T. Hägglund,
//! *Advanced PID Control*, chapter 4: the phase margin is the least over all crossings of one, the gain margin the least factor, up
//! or down, over all crossings of −180°. A loop that never crosses −180° has the largest gain margin that is told, 100.

use nalgebra::Complex;
use stampfly_types::math;

use crate::pid::PidGains;

/// Gain margin of a loop to which no gain is too much.
const GAIN_MAX: f32 = 100.0;

/// How far a loop is from being unstable.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Margins {
    /// Phase margin, rad: what the loop may lag more where its gain is one.
    pub phase: f32,
    /// Gain margin, a factor: by how much the gain may grow, or fall, whichever is nearer.
    pub gain: f32,
    /// Highest angular frequency at which the loop's gain is one, rad/s.
    pub crossover: f32,
}

impl Margins {
    /// Gain margin in decibels.
    ///
    /// ```
    /// use stampfly_control::autotune::Margins;
    /// let margins = Margins { phase: 1.0, gain: 2.0, crossover: 40.0 };
    /// assert!((margins.gain_db() - 6.02).abs() < 0.01);
    /// ```
    #[must_use]
    pub fn gain_db(&self) -> f32 {
        20.0 / core::f32::consts::LN_10 * math::ln(self.gain)
    }

    /// Delay that the loop bears at its crossover, s, were it alone in it.
    #[must_use]
    pub fn delay(&self) -> f32 {
        self.phase / self.crossover
    }

    /// The lesser of both margins, and the crossover of `self`.
    #[must_use]
    pub fn worst(&self, other: &Self) -> Self {
        Self { phase: self.phase.min(other.phase), gain: self.gain.min(other.gain), crossover: self.crossover }
    }
}

/// Ω for ω at a period, both rad/s: where the continuous formula of a controller gives its discrete response.
#[inline]
pub(super) fn warped(frequency: f32, period: f32) -> f32 {
    2.0 / period * math::tan(0.5 * period * frequency)
}

/// Torque over negated rate of a controller, N·m per rad/s, at a [`warped`] frequency, with the attitude loop around it.
#[inline]
pub(super) fn controller(gains: &PidGains, attitude: f32, warped: f32) -> Complex<f32> {
    let integral = if gains.ti > 0.0 { 1.0 / (gains.ti * warped) } else { 0.0 };
    let outer = attitude / warped;
    let derivative = if gains.td > 0.0 {
        let (rise, corner) = (gains.td * warped, gains.eta * gains.td * warped);
        Complex::new(rise * corner, rise) / (1.0 + corner * corner)
    } else {
        Complex::new(0.0, 0.0)
    };
    // (1 − j·integral) (1 − j·outer)
    (Complex::new(1.0 - integral * outer, -integral - outer) + derivative) * gains.kp
}

/// Finds margins while a loop's response passes by, in ascending frequency from one where its delay does not matter yet.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Scan {
    last: Option<(f32, Complex<f32>)>,
    /// Whole turns that its phase has fallen by, negative. Without them a loop that lags a turn too much looks stable.
    turns: f32,
    /// Phase margin and where.
    found: Option<(f32, f32)>,
    gain: Option<f32>,
    lost: bool,
}

impl Scan {
    #[inline]
    pub(super) fn add(&mut self, frequency: f32, response: Complex<f32>) {
        let Some((before, from)) = self.last.replace((frequency, response)) else { return };
        let (was, is) = (from.norm_sqr(), response.norm_sqr());
        if !(was > 0.0 && is > 0.0 && was.is_finite() && is.is_finite()) {
            self.lost = true;
            return;
        }
        let crosses_one = (was >= 1.0) != (is >= 1.0);
        let crosses_axis = (from.im > 0.0) != (response.im > 0.0);
        if !(crosses_one || crosses_axis) {
            return;
        }
        // Angles from -180 degrees.
        let angle = math::atan2(-from.im, -from.re);
        let turn = response * from.conj();
        let turn = math::atan2(turn.im, turn.re);
        let (was, is) = (0.5 * math::ln(was), 0.5 * math::ln(is));
        if crosses_one {
            let share = was / (was - is);
            let margin = angle + share * turn + self.turns * math::TAU;
            // Of a loop that rises through one, what it lacks to -180 degrees on either side.
            let margin = if is < was { margin } else { margin.abs() };
            let least = self.found.map_or(margin, |(phase, _)| phase.min(margin));
            self.found = Some((least, before * math::pow(frequency / before, share)));
        }
        if crosses_axis {
            let end = angle + turn;
            if angle * end <= 0.0 {
                // Through -180 degrees.
                let ln = was - angle / turn * (is - was);
                let factor = math::exp(ln.abs());
                self.gain = Some(self.gain.map_or(factor, |gain| gain.min(factor)));
            } else if end.abs() > math::PI {
                // Through 0 degrees.
                self.turns += if end < 0.0 { -1.0 } else { 1.0 };
            }
        }
    }

    /// The margins, if the gain is one somewhere and every response was a number.
    pub(super) fn margins(&self) -> Option<Margins> {
        let (phase, crossover) = self.found.filter(|_| !self.lost)?;
        Some(Margins { phase, gain: self.gain.unwrap_or(GAIN_MAX).min(GAIN_MAX), crossover })
    }
}

#[cfg(test)]
mod tests {
    use super::super::model::PlantModel;
    use super::*;
    use crate::pid::{Integration, Pid};

    const PERIOD: f32 = 0.0025;

    fn scan(plant: &PlantModel, gains: &PidGains, attitude: f32) -> Option<Margins> {
        let mut scan = Scan::default();
        for step in 0..48 {
            let frequency = 3.0 * math::pow(1_100.0 / 3.0, step as f32 / 47.0);
            scan.add(frequency, plant.response(frequency) * controller(gains, attitude, warped(frequency, PERIOD)));
        }
        scan.margins()
    }

    #[test]
    fn margins_of_an_integrator_with_delay_are_those_of_the_book() {
        // L = ω_c/s · e^(−sT): phase margin π/2 − ω_c·T, gain margin π / (2·ω_c·T).
        for (crossover, delay) in [(20.0, 0.01), (40.0, 0.007), (60.0, 0.01)] {
            let plant = PlantModel { gain: 1.0, lag: 0.0, delay, ..PlantModel::default() };
            let margins = scan(&plant, &PidGains::proportional(crossover), 0.0).expect("it crosses one");
            assert!((margins.crossover / crossover - 1.0).abs() < 2e-3, "{margins:?}");
            assert!((margins.phase - (math::FRAC_PI_2 - crossover * delay)).abs() < 2e-3, "{margins:?}");
            assert!((margins.gain / (math::FRAC_PI_2 / (crossover * delay)) - 1.0).abs() < 0.01, "{margins:?}");
        }
    }

    #[test]
    fn an_unstable_loop_has_less_than_no_margin() {
        let plant = PlantModel { gain: 1.0, lag: 0.018, delay: 0.03, ..PlantModel::default() };
        let margins = scan(&plant, &PidGains::proportional(60.0), 0.0).expect("it crosses one");
        assert!(margins.phase < 0.0, "{margins:?}");
        // It lags a whole turn and a third: from one point alone it would have 140 degrees.
        let plant = PlantModel { gain: 1.0, lag: 0.0, delay: 0.05, ..PlantModel::default() };
        let margins = scan(&plant, &PidGains::proportional(110.0), 0.0).expect("it crosses one");
        assert!(margins.phase < 0.0, "{margins:?}");
    }

    #[test]
    fn no_crossing_or_no_number_has_no_margins() {
        let plant = PlantModel { gain: 1.0, lag: 0.0, delay: 0.01, ..PlantModel::default() };
        assert_eq!(scan(&plant, &PidGains::proportional(1e-6), 0.0), None);
        assert_eq!(scan(&plant, &PidGains::proportional(f32::NAN), 0.0), None);
    }

    /// The response that is computed is the one that a [`Pid`] has when it is stepped.
    #[test]
    fn the_controller_responds_as_it_steps() {
        let gains = PidGains { kp: 2.0, ti: 0.3, td: 0.016, eta: 0.2 };
        for frequency in [20.0f32, 60.0, 150.0, 400.0] {
            let mut pid = Pid::new(gains, 1e6);
            let mut sum = Complex::new(0.0f32, 0.0);
            // Whole periods, nearly; the integral starts with an offset that the Hann window keeps out.
            let steps = (400.0 * math::TAU / (frequency * PERIOD)) as u32;
            for step in 0..steps {
                let angle = frequency * PERIOD * step as f32;
                let out = pid.step(0.0, math::cos(angle), PERIOD, Integration::Free);
                let hann = 1.0 - math::cos(math::TAU * step as f32 / steps as f32);
                sum += Complex::new(math::cos(angle), -math::sin(angle)) * (-out * hann);
            }
            let found = sum * (2.0 / steps as f32);
            let told = controller(&gains, 0.0, warped(frequency, PERIOD));
            assert!((found - told).norm_sqr() < 1e-4 * told.norm_sqr(), "{frequency} rad/s: {found} and {told}");
        }
    }
}
