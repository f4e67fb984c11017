//! A flip as a controller: thrust and torque from the sequence's set-points.
//!
//! The innermost loop is the [incremental](crate::indi) one, because the turn is over before an integral has found anything, and
//! with the sequence's angular acceleration ahead of it the rate follows its ramps without an error to begin with.

use stampfly_types::messages::{ControlOutput, FlightPhase, FlipDirection, Setpoint, StateEstimate};
use stampfly_types::{Instant, Vec3};

use super::{FlipConfig, FlipRefusal, FlipSequencer, FlipStage};
use crate::airframe::Airframe;
use crate::bound::possible_thrust;
use crate::indi::{IndiConfig, IndiRate};
use crate::rate::RateLaw;
use crate::timing::StepTimer;

/// A [`FlipSequencer`] with its rate loop.
///
/// ```
/// use stampfly_control::flip::FlipRefusal;
/// use stampfly_control::{Airframe, FlipController};
/// use stampfly_types::messages::{FlipDirection, StateEstimate, Validity};
/// use stampfly_types::{Instant, Vec3};
///
/// let mut flip = FlipController::for_airframe(&Airframe::EXAMPLE);
/// let estimate = StateEstimate { height: 2.0, valid: Validity::ALL, ..Default::default() };
/// flip.start(Instant::ZERO, FlipDirection::Back, &estimate)?;
/// // In place of the controller, while it gives something.
/// let output = flip.step(Instant::from_micros(2_500), &estimate, [0.0; 4]).expect("it has only begun");
/// assert!(output.thrust > Airframe::EXAMPLE.hover_thrust());
/// # Ok::<(), FlipRefusal>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FlipController {
    sequence: FlipSequencer,
    rate: IndiRate,
    timer: StepTimer,
    /// The phase of the period before.
    phase: FlightPhase,
    /// Rate asked for per angular acceleration, s, so that the loop's torque has that acceleration.
    ahead: Vec3,
    thrust_max: f32,
}

impl FlipController {
    /// Configured by the rules for an airframe.
    #[must_use]
    pub fn for_airframe(airframe: &Airframe) -> Self {
        Self::new(&FlipConfig::for_airframe(airframe), &IndiConfig::for_airframe(airframe))
    }

    /// Nothing to do.
    #[must_use]
    pub fn new(config: &FlipConfig, rate: &IndiConfig) -> Self {
        Self {
            sequence: FlipSequencer::new(config),
            rate: IndiRate::new(rate),
            timer: StepTimer::default(),
            phase: FlightPhase::Init,
            ahead: ahead(rate),
            thrust_max: config.thrust_max,
        }
    }

    /// Changes the gains of the rate loop in flight, before, during or after a flip. Its state stays.
    pub fn set_gains(&mut self, rate: &IndiConfig) {
        self.rate.set_gains(rate);
        self.ahead = ahead(rate);
    }

    /// The sequence.
    #[must_use]
    pub fn sequence(&self) -> &FlipSequencer {
        &self.sequence
    }

    /// Begins; see [`FlipSequencer::start`].
    ///
    /// # Errors
    /// Says why the vehicle must not turn over.
    pub fn start(
        &mut self,
        now: Instant,
        direction: FlipDirection,
        estimate: &StateEstimate,
    ) -> Result<(), FlipRefusal> {
        self.sequence.start(now, direction, estimate)?;
        self.rate.reset();
        Ok(())
    }

    /// One control period; `None` when it is over and the vehicle's controller flies on. `unmet` is the mixer's report.
    pub fn step(&mut self, now: Instant, estimate: &StateEstimate, unmet: [f32; 4]) -> Option<ControlOutput> {
        let dt = self.timer.step(now);
        if self.sequence.stage() == FlipStage::Over {
            return None;
        }
        let demand = self.sequence.step(now, estimate);
        if self.sequence.stage() == FlipStage::Over {
            return None;
        }
        let target = demand.rate + demand.acceleration.component_mul(&self.ahead);
        let torque = self.rate.step(&target, &estimate.angular_rate, dt, unmet, [false; 3]);
        Some(ControlOutput { thrust: possible_thrust(demand.thrust, self.thrust_max, f32::MAX, 1.0), torque })
    }

    /// One control period of a vehicle whose mode machine knows [`FlightPhase::Flip`]: a flip begins with the phase, in the
    /// direction that the set-point has, and ends with it. `None` while the vehicle's controller flies; so it does, hovering, in
    /// the phase of a flip that is refused. The mode machine has looked at the battery.
    #[inline]
    pub fn follow(
        &mut self,
        now: Instant,
        phase: FlightPhase,
        setpoint: &Setpoint,
        estimate: &StateEstimate,
        unmet: [f32; 4],
    ) -> Option<ControlOutput> {
        let before = core::mem::replace(&mut self.phase, phase);
        if phase == FlightPhase::Flip {
            return self.turn_over(now, before, setpoint, estimate, unmet);
        }
        if before == FlightPhase::Flip {
            self.cancel(now);
        }
        None
    }

    /// In the phase of a flip. Apart, because a vehicle is seldom in it.
    #[inline(never)]
    fn turn_over(
        &mut self,
        now: Instant,
        before: FlightPhase,
        setpoint: &Setpoint,
        estimate: &StateEstimate,
        unmet: [f32; 4],
    ) -> Option<ControlOutput> {
        if before != FlightPhase::Flip
            && let Some(direction) = setpoint.axes.flip()
        {
            let _ = self.start(now, direction, estimate);
        }
        self.step(now, estimate, unmet)
    }

    /// Levels it; see [`FlipSequencer::abort`].
    pub fn abort(&mut self, now: Instant) {
        self.sequence.abort(now);
    }

    /// Ends it; see [`FlipSequencer::cancel`].
    pub fn cancel(&mut self, now: Instant) {
        self.sequence.cancel(now);
    }
}

/// Rate asked for per angular acceleration: the damping takes λ of it off again.
fn ahead(rate: &IndiConfig) -> Vec3 {
    rate.damping.zip_map(&rate.bandwidth, |damping, bandwidth| (1.0 + damping) / bandwidth)
}
