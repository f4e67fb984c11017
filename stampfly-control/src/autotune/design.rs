//! The quickest rate loop that keeps a phase and a gain margin.
//!
//! Nothing is linearised and no rule is trusted: every candidate's loop is computed at 48 frequencies, once with the fitted plant and
//! once with what was measured, and the lesser margins count. Candidates are a derivative time and a crossover; the gain follows from
//! the crossover, the integral time is so long that it costs a fixed phase there (as K. J. Åström and T. Hägglund, *Advanced PID Control*,
//! chapter 6, do for a fitted plant). From high to low, the first crossover that holds both margins is
//! the derivative time's, and the highest of those wins; of equals the one with the least derivative.
//!
//! One candidate a step, so that a search of some hundred does not delay a control loop.

use heapless::Vec;
use nalgebra::Complex;
use stampfly_types::math;

use super::config::AutotuneConfig;
use super::excitation::TONES;
use super::margins::{Margins, Scan, controller, warped};
use super::model::PlantModel;
use super::spectrum::PlantPoint;
use crate::pid::PidGains;

/// Frequencies at which a loop is computed.
const GRID: usize = 48;
/// Derivative times that are tried, from the present one over the [bound](AutotuneConfig::change_max) to that times the bound.
const LEADS: u8 = 13;
/// Crossovers that are tried for each: 4 % apart where the tones span a factor of ten.
const CROSSOVERS: u8 = 48;
/// Highest frequency of the grid, share of half the sampling rate.
const NYQUIST_SHARE: f32 = 0.9;
/// Lowest frequency of the grid and lowest crossover over the lowest tone, highest crossover over the highest tone.
const GRID_LOW: f32 = 0.2;
const CROSSOVER_LOW: f32 = 1.0;
const CROSSOVER_HIGH: f32 = 0.75;

/// The plant at one frequency of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Sample {
    frequency: f32,
    warped: f32,
    model: Complex<f32>,
    measured: Complex<f32>,
}

/// Gains and the margins that they have.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Tuned {
    pub(super) gains: PidGains,
    pub(super) margins: Margins,
}

/// A search, one candidate a step.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Search {
    grid: Vec<Sample, GRID>,
    model: PlantModel,
    period: f32,
    present: PidGains,
    lead: u8,
    crossover: u8,
    best: Option<Tuned>,
}

impl Search {
    /// A search around the present gains, for a control period in seconds.
    pub(super) fn new(present: PidGains, model: PlantModel, period: f32) -> Self {
        Self { grid: Vec::new(), model, period, present, lead: 0, crossover: 0, best: None }
    }

    /// The gains it started from.
    pub(super) fn present(&self) -> PidGains {
        self.present
    }

    /// The fitted plant.
    pub(super) fn model(&self) -> PlantModel {
        self.model
    }

    /// The lesser margins of these gains with the fitted and with the measured plant.
    pub(super) fn margins(&self, gains: &PidGains, attitude: f32) -> Option<Margins> {
        let (mut fitted, mut measured) = (Scan::default(), Scan::default());
        for sample in &self.grid {
            let controller = controller(gains, attitude, sample.warped);
            fitted.add(sample.frequency, sample.model * controller);
            measured.add(sample.frequency, sample.measured * controller);
        }
        Some(fitted.margins()?.worst(&measured.margins()?))
    }

    /// One step: first a frequency of the grid each, then a candidate each. The last gives the best gains, or none if no
    /// candidate holds both margins.
    pub(super) fn step(&mut self, config: &AutotuneConfig, points: &[PlantPoint; TONES]) -> Option<Option<Tuned>> {
        if self.lead >= LEADS {
            return Some(self.best);
        }
        let (lowest, highest) = (points[0].frequency, points[TONES - 1].frequency);
        if self.grid.len() < GRID {
            let (from, to) = (GRID_LOW * lowest, NYQUIST_SHARE * math::PI / self.period);
            let frequency = from * math::pow(to / from, self.grid.len() as f32 / (GRID - 1) as f32);
            let model = self.model.response(frequency);
            let measured = model * off(&self.model, points, frequency);
            let _ = self.grid.push(Sample { frequency, warped: warped(frequency, self.period), model, measured });
            return None;
        }
        let (low, high) = (CROSSOVER_LOW * lowest, config.crossover_max.min(CROSSOVER_HIGH * highest));
        let crossover = high * math::pow(low / high, f32::from(self.crossover) / f32::from(CROSSOVERS - 1));
        let slower = self.best.is_some_and(|best| best.margins.crossover >= crossover);
        let tuned = if slower { None } else { self.candidate(config, crossover) };
        let holds = tuned.is_some_and(|tuned| {
            tuned.margins.phase >= config.phase_margin && tuned.margins.gain >= config.gain_margin
        });
        if holds
            && tuned.is_some_and(|tuned| self.best.is_none_or(|best| tuned.margins.crossover > best.margins.crossover))
        {
            self.best = tuned;
        }
        self.crossover += 1;
        if holds || slower || self.crossover >= CROSSOVERS {
            // A loop without a derivative stays one.
            let leads = if self.present.td > 0.0 { 1 } else { LEADS };
            (self.lead, self.crossover) = (self.lead + leads, 0);
        }
        None
    }

    fn candidate(&self, config: &AutotuneConfig, crossover: f32) -> Option<Tuned> {
        let place = 2.0 * f32::from(self.lead) / f32::from(LEADS - 1) - 1.0;
        let td = self.present.td.max(0.0) * math::pow(config.change_max, place);
        let ti = if self.present.ti > 0.0 { config.integral_share / crossover } else { self.present.ti };
        let shape = PidGains { kp: 1.0, ti, td, eta: self.present.eta };
        let plant = self.model.response(crossover);
        let open = plant * controller(&shape, config.attitude_gain, warped(crossover, self.period));
        let gains = PidGains { kp: 1.0 / math::sqrt(open.norm_sqr()), ..shape };
        Some(Tuned { gains, margins: self.margins(&gains, config.attitude_gain)? })
    }
}

/// What was measured over the model at a frequency: between two points on the line from one to the other, beyond the last as
/// at the last.
fn off(model: &PlantModel, points: &[PlantPoint; TONES], frequency: f32) -> Complex<f32> {
    let ratio = |point: &PlantPoint| point.response / model.response(point.frequency);
    let mut last: Option<&PlantPoint> = None;
    for point in points {
        if frequency <= point.frequency {
            let Some(last) = last else { return ratio(point) };
            let share = (frequency - last.frequency) / (point.frequency - last.frequency);
            return ratio(last) * (1.0 - share) + ratio(point) * share;
        }
        last = Some(point);
    }
    last.map_or(Complex::new(1.0, 0.0), ratio)
}
