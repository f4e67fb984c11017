//! The part of tuning that a vehicle feels: ramp in, windows, ramp out.
//!
//! ```text
//!          ┌──────────┬──────────┬──  …  ──┬──────────┐
//!        ┌─┘          │ window 1 │         │ window n │└─┐
//!      ──┘   lead-in  │          │         │          │  └──
//! ```
//!
//! The lead-in is as long as a window, so that what the ramp stirs up is over when the first window begins.

use stampfly_types::{Duration, Instant, math};

use super::config::AutotuneConfig;
use super::excitation::{TONES, angle, carriers, frequencies, sum};
use super::spectrum::{PlantPoint, Spectrum};
use super::watch::AutotuneStop;
use crate::bound::within;

/// Length of the ramps, as the part of a window.
const RISE_PART: u64 = 2;
const FALL_PART: u64 = 4;
/// Least samples in a period of the highest tone.
const SAMPLES_PER_PERIOD: u32 = 4;
/// Periods of the highest tone in a window.
const HIGHEST: u32 = 51;
/// Steps over which saturation is counted.
const COUNTED: f32 = 200.0;
/// A share that was not delivered below this is rounding.
const NOTICEABLE: f32 = 0.01;
/// After a longer gap the excitation is not what the spectrum takes it for: half a period of 25 Hz.
const LONGEST_GAP: Duration = Duration::from_millis(20);

/// The points, and what they were measured with.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Measured {
    pub(super) points: [PlantPoint; TONES],
    pub(super) windows: u16,
    /// Mean control period.
    pub(super) period: Duration,
}

/// An excitation under way.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Measurement {
    began: Instant,
    last: Option<Instant>,
    /// Number of the window; the lead-in is the one before the first.
    window: u64,
    spectrum: Spectrum,
    /// Share of steps whose torque was cut, lately.
    cut: f32,
    /// What was found, and since when the excitation falls.
    measured: Option<(Measured, Instant)>,
}

impl Measurement {
    pub(super) fn new(now: Instant) -> Self {
        Self { began: now, last: None, window: 0, spectrum: Spectrum::default(), cut: 0.0, measured: None }
    }

    /// What was found, once nothing is excited any more.
    pub(super) fn finished(&self, config: &AutotuneConfig, now: Instant) -> Option<Measured> {
        self.measured.filter(|(_, since)| now.since(*since) >= config.window / FALL_PART).map(|(measured, _)| measured)
    }

    /// The torque of this step, N·m, from the controller's `torque` about the axis and the `rate` that it was computed from, rad/s;
    /// `unmet` is what the mixer gave up of the last one.
    pub(super) fn step(
        &mut self,
        config: &AutotuneConfig,
        now: Instant,
        rate: f32,
        torque: f32,
        unmet: f32,
    ) -> Result<f32, AutotuneStop> {
        let gap = self.last.replace(now).map(|last| now.since(last));
        if gap.is_some_and(|gap| gap == Duration::ZERO || gap > LONGEST_GAP) {
            return Err(AutotuneStop::Timing);
        }
        let elapsed = now.since(self.began);
        if elapsed > config.time_limit {
            return Err(AutotuneStop::Timeout);
        }
        let length = config.window.as_micros().max(1);
        let (window, into) = (elapsed.as_micros() / length, Duration::from_micros(elapsed.as_micros() % length));
        if window != self.window {
            self.next(config, now)?;
            self.window = window;
        }
        let carriers = carriers(into, config.window);
        let wanted = config.amplitude * self.envelope(config, now, elapsed) * sum(&carriers);
        let wanted = if wanted.is_finite() { wanted } else { 0.0 };
        let given = within(wanted, (-config.torque_max - torque).min(0.0), (config.torque_max - torque).max(0.0));
        let lost = given != wanted || unmet.abs() > NOTICEABLE || unmet.is_nan();
        self.cut += (if lost { 1.0 } else { 0.0 } - self.cut) / COUNTED;
        if self.cut > config.saturation_max {
            return Err(AutotuneStop::Saturated);
        }
        if window > 0 && self.measured.is_none() {
            let hann = 1.0 - math::cos(angle(1, into, config.window));
            self.spectrum.add(&carriers, hann, rate, torque + given);
        }
        Ok(torque + given)
    }

    fn envelope(&self, config: &AutotuneConfig, now: Instant, elapsed: Duration) -> f32 {
        let share = |time: Duration, part: u64| time.seconds() / (config.window / part).seconds();
        match self.measured {
            Some((_, since)) => (1.0 - share(now.since(since), FALL_PART)).max(0.0),
            None => share(elapsed, RISE_PART).min(1.0),
        }
    }

    /// A window is complete: is that enough?
    fn next(&mut self, config: &AutotuneConfig, now: Instant) -> Result<(), AutotuneStop> {
        if self.window == 0 || self.measured.is_some() {
            return Ok(());
        }
        if self.spectrum.samples() < SAMPLES_PER_PERIOD * HIGHEST {
            return Err(AutotuneStop::Timing);
        }
        self.spectrum.close();
        let windows = self.spectrum.windows();
        let ([least, most], [good, bad]) = (config.windows, config.spread);
        if windows < least.max(2) {
            return Ok(());
        }
        let points = self.spectrum.points(&frequencies(config.window));
        // False for what is no number.
        let within = |limit: f32| points.iter().all(|point| point.spread <= limit);
        if within(good) || (windows >= most && within(bad)) {
            let period = (config.window * u64::from(windows)) / u64::from(self.spectrum.total().max(1));
            self.measured = Some((Measured { points, windows, period }, now));
        } else if windows >= most {
            return Err(AutotuneStop::Quality);
        }
        Ok(())
    }
}
