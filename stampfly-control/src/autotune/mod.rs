//! Tuning a rate loop in flight, by measuring the plant.
//!
//! ```text
//!  start ─► lead-in ─► windows ─► ramp out ─► fit ─► search ─► report ── accept, disarmed ─► gains
//!              └───────────┴──────────┴── anything wrong: nothing is excited any more, and the gains are as before
//! ```
//!
//! While the vehicle hovers under its controller, [`Autotune`] adds a small [multi-sine](frequencies) to the torque about one axis. From
//! torque and rate it estimates the plant at eight frequencies ([`PlantPoint`]), fits gain, lag and delay ([`PlantModel`]), and looks for
//! the quickest PID that keeps a phase and a gain margin ([`Margins`]) with both. It changes no gains: the [report](AutotuneReport) has
//! the present and the proposed ones with their margins, and [`Autotune::accept`] hands the latter out once the vehicle is disarmed.
//! It ends by itself in any case, at the latest after [`AutotuneConfig::time_limit`] and three seconds of computing.
//!
//! Use it after a change of the airframe: another battery, a payload, other propellers. It needs a vehicle that hovers already, with
//! gains that are within a [factor](AutotuneConfig::change_max) of the right ones; and a place with room around it, because nobody
//! steers meanwhile. Not on the ground, whose contact is another plant, and not in strong wind, where it says [`AutotuneStop::Quality`].

mod axis;
mod config;
mod design;
mod excitation;
mod margins;
mod measurement;
mod model;
mod report;
mod spectrum;
mod status;
mod watch;

pub use axis::AutotuneAxis;
pub use config::AutotuneConfig;
pub use excitation::{TONES, frequencies};
pub use margins::Margins;
pub use model::PlantModel;
pub use report::{AcceptError, AutotuneReport};
pub use spectrum::PlantPoint;
pub use status::{AutotuneStage, AutotuneStatus};
pub use watch::{AutotuneInput, AutotuneStop};

use stampfly_types::messages::{FlightStatus, SetpointAxes};
use stampfly_types::{Instant, Vec3};

use crate::airframe::Airframe;
use crate::pid::PidGains;
use design::Search;
use measurement::{Measured, Measurement};
use model::Fit;

#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[allow(clippy::large_enum_variant, reason = "there is one of them, and nowhere to put a large one")]
enum State {
    Idle,
    Exciting(Measurement),
    Fitting(Measured, Fit),
    Searching(Measured, Search),
    Done { report: AutotuneReport, accepted: bool },
    Stopped(AutotuneStop),
}

/// Tunes one axis of the rate loop at a time.
///
/// ```
/// use stampfly_control::Airframe;
/// use stampfly_control::autotune::{Autotune, AutotuneAxis, AutotuneInput, AutotuneStage, AutotuneStop};
/// use stampfly_control::pid::{Integration, Pid};
/// use stampfly_control::rate::RateConfig;
/// use stampfly_types::messages::*;
/// use stampfly_types::{Duration, Instant, Vec3};
///
/// // A vehicle whose battery has grown: it has half as much inertia again as its gains are for.
/// let config = RateConfig::for_airframe(&Airframe::EXAMPLE);
/// let (inertia, lag) = (1.5 * Airframe::EXAMPLE.inertia.x, Airframe::EXAMPLE.motor_lag);
/// let mut pid = Pid::new(config.roll, config.torque_max.x);
///
/// let mut autotune = Autotune::for_airframe(&Airframe::EXAMPLE);
/// let flight_status = FlightStatus { phase: FlightPhase::Flying, mode: FlightMode::PosHold, armed: true, ..Default::default() };
/// let land_detected = LandDetected { contact: GroundContact::Air, ..Default::default() };
/// let mut estimate = StateEstimate { height: 1.0, valid: Validity::ALL, ..Default::default() };
/// let (mut now, mut rotors, mut rates) = (Instant::ZERO, 0.0f32, [0.0f32; 3]);
/// for step in 0..10_000 {
///     let input = AutotuneInput {
///         estimate: &estimate, command: &CommandSetpoint::default(), flight_status: &flight_status, land_detected: &land_detected,
///         alerts: Alerts::default(), unmet: [0.0; 4],
///     };
///     if step == 400 {
///         autotune.start(now, AutotuneAxis::Roll, config.roll, &input)?;
///     }
///     let torque = Vec3::new(pid.step(0.0, estimate.angular_rate.x, 0.0025, Integration::Free), 0.0, 0.0);
///     let torque = autotune.step(now, &input, &torque);
///     rotors += (torque.x - rotors) * 0.0025 / lag;
///     // What the gyro sees comes two periods later.
///     let [before, last, rate] = rates;
///     rates = [last, rate, rate + rotors / inertia * 0.0025];
///     estimate.angular_rate.x = before;
///     now += Duration::from_micros(2_500);
/// }
/// assert_eq!(autotune.stage(), AutotuneStage::Done);
/// let report = autotune.report().expect("it is done");
/// assert!((report.model.gain * inertia - 1.0).abs() < 0.05);
/// assert!(report.after.phase >= 0.96 && report.after.gain >= 2.5);
///
/// // Landed and disarmed, somebody wants it.
/// let landed = FlightStatus { armed: false, ..flight_status };
/// let (axis, gains) = autotune.accept(&landed).expect("there is a result");
/// assert!(axis == AutotuneAxis::Roll && gains.kp > config.roll.kp);
/// # Ok::<(), AutotuneStop>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Autotune {
    roll: AutotuneConfig,
    pitch: AutotuneConfig,
    yaw: AutotuneConfig,
    axis: AutotuneAxis,
    present: PidGains,
    state: State,
    /// Has the status changed since it was last asked for?
    news: bool,
    /// What the set-point asked for in the period before.
    asked: Option<AutotuneAxis>,
}

impl Autotune {
    /// Configured by the rules for an airframe.
    #[must_use]
    pub fn for_airframe(airframe: &Airframe) -> Self {
        let axes = [AutotuneAxis::Roll, AutotuneAxis::Pitch, AutotuneAxis::Yaw];
        Self::new(axes.map(|axis| AutotuneConfig::for_airframe(airframe, axis)))
    }

    /// Configured for roll, pitch and yaw.
    #[must_use]
    pub fn new([roll, pitch, yaw]: [AutotuneConfig; 3]) -> Self {
        let present = PidGains::proportional(0.0);
        Self { roll, pitch, yaw, axis: AutotuneAxis::Roll, present, state: State::Idle, news: false, asked: None }
    }

    /// Begins with an axis whose loop has these gains. What was found before and not accepted is forgotten.
    ///
    /// # Errors
    /// Says why the vehicle must not be excited; nothing has changed then.
    pub fn start(
        &mut self,
        now: Instant,
        axis: AutotuneAxis,
        present: PidGains,
        input: &AutotuneInput<'_>,
    ) -> Result<(), AutotuneStop> {
        if self.is_active() {
            return Err(AutotuneStop::Busy);
        }
        let positive = present.kp > 0.0 && [present.kp, present.td, present.eta].iter().all(|gain| gain.is_finite());
        if !positive || present.ti.is_nan() {
            return Err(AutotuneStop::Bounds);
        }
        watch::check(self.config(axis), input)?;
        (self.axis, self.present) = (axis, present);
        self.turn_to(State::Exciting(Measurement::new(now)));
        Ok(())
    }

    /// One control period: the `torque` that the controller asks for, N·m in body axes, with the excitation added to it.
    ///
    /// # Contract
    /// * The result differs from `torque` about the axis that is tuned only, by at most [`AutotuneConfig::amplitude`], and not at all
    ///   from the step on in which something goes wrong, whatever the input.
    /// * The excitation never takes the torque beyond [`AutotuneConfig::torque_max`].
    #[inline]
    pub fn step(&mut self, now: Instant, input: &AutotuneInput<'_>, torque: &Vec3) -> Vec3 {
        // Nearly never: this question is what a vehicle that tunes nothing pays for it.
        if self.is_active() { self.tune(now, input, torque) } else { *torque }
    }

    #[inline(never)]
    fn tune(&mut self, now: Instant, input: &AutotuneInput<'_>, torque: &Vec3) -> Vec3 {
        let mut result = *torque;
        let config = *self.config(self.axis);
        let next = match &mut self.state {
            State::Exciting(measurement) => match excite(measurement, &config, self.axis, now, input, torque) {
                Ok(with_excitation) => {
                    *self.axis.of_mut(&mut result) = with_excitation;
                    measurement.finished(&config, now).map(|measured| State::Fitting(measured, Fit::new()))
                }
                Err(stop) => Some(State::Stopped(stop)),
            },
            State::Fitting(measured, fit) => fit.step(&measured.points).map(|model| {
                // False for what is no number.
                if model.gain > 0.0 && model.misfit <= config.misfit_max {
                    State::Searching(*measured, Search::new(self.present, model, measured.period.seconds()))
                } else {
                    State::Stopped(AutotuneStop::Quality)
                }
            }),
            State::Searching(measured, search) => {
                search.step(&config, &measured.points).map(|tuned| finish(&config, self.axis, measured, search, tuned))
            }
            State::Idle | State::Done { .. } | State::Stopped(_) => None,
        };
        if let Some(next) = next {
            self.turn_to(next);
        }
        result
    }

    /// One control period of a vehicle whose set-point says what to tune, in place of [`Self::start`], [`Self::step`] and
    /// [`Self::cancel`]: it begins when the set-point begins to ask for an axis, whose loop has the gains that `present` gives, and ends
    /// when it no longer does. What speaks against it is the reason of [`Self::stopped`].
    pub fn follow(
        &mut self,
        now: Instant,
        axes: SetpointAxes,
        present: impl FnOnce(AutotuneAxis) -> PidGains,
        input: &AutotuneInput<'_>,
        torque: &Vec3,
    ) -> Vec3 {
        let asked = AutotuneAxis::asked(axes);
        if core::mem::replace(&mut self.asked, asked) != asked {
            self.ask(now, asked.map(|axis| (axis, present(axis))), input);
        }
        self.step(now, input, torque)
    }

    /// Another axis is asked for, whose loop has these gains, or none.
    #[inline(never)]
    fn ask(&mut self, now: Instant, asked: Option<(AutotuneAxis, PidGains)>, input: &AutotuneInput<'_>) {
        self.cancel();
        if let Some((axis, present)) = asked
            && let Err(stop) = self.start(now, axis, present, input)
        {
            self.axis = axis;
            self.turn_to(State::Stopped(stop));
        }
    }

    /// Ends it, wherever it is. A result that is there already stays.
    pub fn cancel(&mut self) {
        if self.is_active() {
            self.turn_to(State::Stopped(AutotuneStop::Cancelled));
        }
    }

    fn turn_to(&mut self, state: State) {
        (self.state, self.news) = (state, true);
    }

    const fn is_active(&self) -> bool {
        matches!(self.state, State::Exciting(_) | State::Fitting(..) | State::Searching(..))
    }

    /// Hands out the proposed gains, once: whoever accepts them puts them where the rate loop has its own.
    ///
    /// # Errors
    /// While the vehicle is armed, and when there is no result.
    pub fn accept(&mut self, flight_status: &FlightStatus) -> Result<(AutotuneAxis, PidGains), AcceptError> {
        match &mut self.state {
            State::Done { accepted: false, .. } if flight_status.armed => Err(AcceptError::Armed),
            State::Done { report, accepted: accepted @ false } => {
                *accepted = true;
                Ok((report.axis, report.proposed))
            }
            _ => Err(AcceptError::Nothing),
        }
    }

    /// Where it is.
    #[must_use]
    pub fn stage(&self) -> AutotuneStage {
        match self.state {
            State::Idle => AutotuneStage::Idle,
            State::Exciting(_) => AutotuneStage::Exciting,
            State::Fitting(..) | State::Searching(..) => AutotuneStage::Computing,
            State::Done { .. } => AutotuneStage::Done,
            State::Stopped(_) => AutotuneStage::Stopped,
        }
    }

    /// What was found last, accepted or not.
    #[must_use]
    pub fn report(&self) -> Option<&AutotuneReport> {
        if let State::Done { report, .. } = &self.state { Some(report) } else { None }
    }

    /// Why it ended without a result.
    #[must_use]
    pub fn stopped(&self) -> Option<AutotuneStop> {
        if let State::Stopped(stop) = self.state { Some(stop) } else { None }
    }

    /// The same for others, who see neither.
    #[must_use]
    pub fn status(&self) -> AutotuneStatus {
        let stop = self.stopped().unwrap_or_default();
        let (axis, stage) = (self.axis, self.stage());
        self.report().map_or(AutotuneStatus { axis, stage, stop, ..AutotuneStatus::default() }, AutotuneStatus::of)
    }

    /// The [status](Self::status), once after each of its changes.
    pub fn news(&mut self) -> Option<AutotuneStatus> {
        core::mem::take(&mut self.news).then(|| self.status())
    }

    /// The configuration of an axis.
    #[must_use]
    pub fn config(&self, axis: AutotuneAxis) -> &AutotuneConfig {
        match axis {
            AutotuneAxis::Roll => &self.roll,
            AutotuneAxis::Pitch => &self.pitch,
            AutotuneAxis::Yaw => &self.yaw,
        }
    }
}

/// The torque about the axis, with the excitation, unless something speaks against it.
fn excite(
    measurement: &mut Measurement,
    config: &AutotuneConfig,
    axis: AutotuneAxis,
    now: Instant,
    input: &AutotuneInput<'_>,
    torque: &Vec3,
) -> Result<f32, AutotuneStop> {
    watch::check(config, input)?;
    if !torque.iter().all(|torque| torque.is_finite()) {
        return Err(AutotuneStop::Estimate);
    }
    let [roll, pitch, yaw, _] = input.unmet;
    let unmet = axis.of(&Vec3::new(roll, pitch, yaw));
    measurement.step(config, now, axis.of(&input.estimate.angular_rate), axis.of(torque), unmet)
}

/// What becomes of a search that is over.
fn finish(
    config: &AutotuneConfig,
    axis: AutotuneAxis,
    measured: &Measured,
    search: &Search,
    tuned: Option<design::Tuned>,
) -> State {
    let Some(tuned) = tuned else { return State::Stopped(AutotuneStop::Margins) };
    let present = search.present();
    let near = |found: f32, present: f32| found <= present * config.change_max && found * config.change_max >= present;
    let integral = !(present.ti > 0.0 && present.ti.is_finite()) || near(tuned.gains.ti, present.ti);
    if !(near(tuned.gains.kp, present.kp) && integral) {
        return State::Stopped(AutotuneStop::Bounds);
    }
    let report = AutotuneReport {
        axis,
        present,
        proposed: tuned.gains,
        before: search.margins(&present, config.attitude_gain),
        after: tuned.margins,
        model: search.model(),
        points: measured.points,
        windows: measured.windows,
        period: measured.period,
    };
    State::Done { report, accepted: false }
}
