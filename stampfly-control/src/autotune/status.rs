//! What others are told of tuning: where it is, why it ended, and what was found.
//!
//! Published when it changes. On a vehicle whose parts talk by topics this is how a console shows the result and how somebody accepts
//! it; within one program the [report](super::AutotuneReport) says more.

use stampfly_types::{message, message_enum};

use super::axis::AutotuneAxis;
use super::report::AutotuneReport;
use super::watch::AutotuneStop;
use crate::rate::RateConfig;

message_enum! {
    /// Where tuning is.
    pub enum AutotuneStage {
        /// Not begun.
        #[default]
        Idle = 0,
        /// The vehicle is excited.
        Exciting = 1,
        /// The vehicle flies as ever; the result is being computed, a bit a step.
        Computing = 2,
        /// There is a result.
        Done = 3,
        /// It ended without one, for a reason.
        Stopped = 4,
    }
}

message! {
    /// Tuning of a rate loop. Gains, margins and plant are zero unless it is done.
    pub struct AutotuneStatus {
        /// The axis.
        axis: AutotuneAxis,
        /// Where it is.
        stage: AutotuneStage,
        /// Why it ended, if it has stopped.
        stop: AutotuneStop,
        /// Proposed proportional gain.
        kp: f32 ["N*m/(rad/s)"],
        /// Proposed integral time.
        ti: f32 ["s"],
        /// Proposed derivative time.
        td: f32 ["s"],
        /// Phase margin of the present and of the proposed gains.
        phase_margin: [f32; 2] ["rad"],
        /// Gain margin of the present and of the proposed gains, a factor.
        gain_margin: [f32; 2],
        /// Crossover of the present and of the proposed gains.
        crossover: [f32; 2] ["rad/s"],
        /// Moment of inertia that was found.
        inertia: f32 ["kg*m^2"],
        /// Motor lag that was found.
        lag: f32 ["s"],
        /// Lead that was found; zero for none.
        lead: f32 ["s"],
        /// Delay that was found.
        delay: f32 ["s"],
    }
}

impl AutotuneStatus {
    /// The status of a result.
    #[must_use]
    pub(super) fn of(report: &AutotuneReport) -> Self {
        let (before, after, model) = (report.before.unwrap_or_default(), report.after, report.model);
        Self {
            axis: report.axis,
            stage: AutotuneStage::Done,
            stop: AutotuneStop::default(),
            kp: report.proposed.kp,
            ti: report.proposed.ti,
            td: report.proposed.td,
            phase_margin: [before.phase, after.phase],
            gain_margin: [before.gain, after.gain],
            crossover: [before.crossover, after.crossover],
            inertia: 1.0 / model.gain,
            lag: model.lag,
            lead: model.lead,
            delay: model.delay,
        }
    }
}

impl AutotuneStatus {
    /// Puts the proposed gains where the rate loop of the axis has its own. False if there are none. On the ground: [`AcceptError`] is for
    /// whoever has the [`Autotune`] itself.
    ///
    /// [`AcceptError`]: super::AcceptError
    /// [`Autotune`]: super::Autotune
    ///
    /// ```
    /// use stampfly_control::autotune::{AutotuneStage, AutotuneStatus};
    /// use stampfly_control::{Airframe, rate::RateConfig};
    /// let mut config = RateConfig::for_airframe(&Airframe::EXAMPLE);
    /// assert!(!AutotuneStatus::default().accept(&mut config));
    /// let found = AutotuneStatus { stage: AutotuneStage::Done, kp: 0.03, ti: 0.4, td: 0.02, ..Default::default() };
    /// assert!(found.accept(&mut config) && config.roll.kp == 0.03);
    /// ```
    #[must_use]
    pub fn accept(&self, config: &mut RateConfig) -> bool {
        let done = self.stage == AutotuneStage::Done;
        if done {
            let gains = self.axis.gains_mut(config);
            (gains.kp, gains.ti, gains.td) = (self.kp, self.ti, self.td);
        }
        done
    }
}

impl core::fmt::Display for AutotuneStatus {
    /// In one line.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}: ", self.axis.name())?;
        match self.stage {
            AutotuneStage::Idle => f.write_str("not tuned"),
            AutotuneStage::Exciting => f.write_str("being measured"),
            AutotuneStage::Computing => f.write_str("being computed"),
            AutotuneStage::Stopped => write!(f, "{}", self.stop),
            AutotuneStage::Done => {
                let margins = |of: usize| {
                    let pick = |pair: [f32; 2]| pair.get(of).copied().unwrap_or_default();
                    (pick(self.phase_margin).to_degrees(), pick(self.gain_margin), pick(self.crossover))
                };
                let ((p0, g0, w0), (p1, g1, w1)) = (margins(0), margins(1));
                write!(
                    f,
                    "margins {p0:.0} deg, x{g0:.1} at {w0:.0} rad/s; with kp {:.3e}, ti {:.3}, ",
                    self.kp, self.ti
                )?;
                write!(f, "td {:.4}: {p1:.0} deg, x{g1:.1} at {w1:.0} rad/s; ", self.td)?;
                let (lag, delay) = (1e3 * self.lag, 1e3 * self.delay);
                write!(f, "inertia {:.3e} kg*m^2, motors {lag:.1} ms, delay {delay:.1} ms", self.inertia)?;
                if self.lead > 0.0 { write!(f, ", lead {:.1} ms", 1e3 * self.lead) } else { Ok(()) }
            }
        }
    }
}
