//! Turning over once, to the left, to the right, forward or backward.
//!
//! ```text
//! climb ── fast enough ──► turn ── nearly once round ──► recover ── level and at rest ──► over
//!   └─ too slow ─► recover    └─ too long, too fast ─► recover   └─ too long ─► over
//! ```
//!
//! *Climb*: level with full thrust, because upside down there is none upwards. *Turn*: a trapezoid
//! of the rate about one axis, on the angle that the gyro has turned through; thrust follows the
//! cosine of it. *Recover*: the attitude loop levels it to the heading of before, thrust brakes the
//! fall. Whatever goes wrong ends in the recovery ([`FlipSequencer::abort`]), and the recovery
//! ends. Sideways the two halves of the turn push against each other; what remains is for the
//! position loop afterwards.
//!
//! [`FlipSequencer`] gives set-points for rate and thrust; [`FlipController`] makes thrust and torque of them, in place of the vehicle's
//! controller for as long as it takes. Whoever starts it tells its failsafe, which would stop the motors of a vehicle that turns so fast.
//! Not for vehicles whose thrust is less than 1.3 times their weight: they are refused, as is one that is too low, moves, or has little
//! battery left. The conditions are those of the StampFly's reference firmware; the gains follow from the [airframe](FlipConfig::for_airframe).

mod config;
mod controller;

pub use config::FlipConfig;
pub use controller::FlipController;

use stampfly_types::messages::{FlipDirection, StateEstimate, Validity};
use stampfly_types::{GRAVITY, Instant, Vec3, math};

use crate::attitude;
use crate::bound::{symmetric, within};
use crate::timing::StepTimer;

/// Why a vehicle does not turn over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlipRefusal {
    /// It is turning over already, or has only just.
    Busy,
    /// Tilt, height or climb rate are unknown.
    Estimate,
    /// Too low, or too weak to recover at any height.
    Height,
    /// It tilts, turns or moves.
    Unsteady,
}

impl core::fmt::Display for FlipRefusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Busy => "it turns over already, or has only just",
            Self::Estimate => "tilt, height or climb rate are unknown",
            Self::Height => "too low, or too weak",
            Self::Unsteady => "it tilts, turns or moves",
        })
    }
}

impl core::error::Error for FlipRefusal {}

/// Where in the sequence the vehicle is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum FlipStage {
    /// Nothing to do.
    #[default]
    Over,
    /// Gaining speed upwards.
    Climb,
    /// Turning.
    Turn,
    /// Levelling and braking.
    Recover,
}

/// What the sequence asks for in one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlipDemand {
    /// Body rate, rad/s.
    pub rate: Vec3,
    /// The angular acceleration at which that rate changes, rad/s².
    pub acceleration: Vec3,
    /// Collective thrust, N.
    pub thrust: f32,
}

/// The sequence.
///
/// ```
/// use stampfly_control::flip::{FlipRefusal, FlipStage};
/// use stampfly_control::{Airframe, FlipConfig, FlipSequencer};
/// use stampfly_types::messages::{FlipDirection, StateEstimate, Validity};
/// use stampfly_types::{Instant, Vec3};
///
/// let mut flip = FlipSequencer::new(&FlipConfig::for_airframe(&Airframe::EXAMPLE));
/// let low = StateEstimate { height: 0.2, valid: Validity::ALL, ..Default::default() };
/// assert_eq!(flip.start(Instant::ZERO, FlipDirection::Right, &low), Err(FlipRefusal::Height));
/// let high = StateEstimate { height: 2.0, ..low };
/// flip.start(Instant::ZERO, FlipDirection::Right, &high)?;
/// let climb = flip.step(Instant::from_micros(2_500), &high);
/// assert!(climb.rate.norm() < 1e-3 && climb.thrust > Airframe::EXAMPLE.hover_thrust());
/// let fast = StateEstimate { velocity: Vec3::new(0.0, 0.0, -3.0), ..high };
/// let turn = flip.step(Instant::from_micros(5_000), &fast);
/// assert!(flip.stage() == FlipStage::Turn && turn.acceleration.x > 0.0);
/// # Ok::<(), FlipRefusal>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FlipSequencer {
    config: FlipConfig,
    timer: StepTimer,
    stage: FlipStage,
    /// When the stage began, and when the last flip was over.
    entered: Instant,
    over: Option<Instant>,
    /// Pitch instead of roll, and in which sense.
    pitch: bool,
    sense: f32,
    /// The level attitude of before: cosine and sine of half its heading.
    heading: (f32, f32),
    /// Turned so far, rad, and the rate asked for, rad/s; both positive.
    angle: f32,
    rate: f32,
    complete: bool,
}

impl FlipSequencer {
    /// A vehicle at rest: climb rate, m/s, tilt and rates, with which the recovery is over, and for how fast it turns, rad/s.
    const AT_REST: [f32; 3] = [0.4, 0.2, 1.5];
    /// Cosine of the tilt up to which thrust points upwards enough to be worth it: 70°.
    const COS_USEFUL: f32 = 0.34;

    /// Nothing to do.
    #[must_use]
    pub fn new(config: &FlipConfig) -> Self {
        Self {
            config: *config,
            timer: StepTimer::default(),
            stage: FlipStage::Over,
            entered: Instant::ZERO,
            over: None,
            pitch: false,
            sense: 1.0,
            heading: (1.0, 0.0),
            angle: 0.0,
            rate: 0.0,
            complete: false,
        }
    }

    /// Where it is.
    #[must_use]
    pub fn stage(&self) -> FlipStage {
        self.stage
    }

    /// Did the last flip turn the vehicle once round and leave it level and at rest?
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.complete
    }

    /// Begins. That the battery is up to it, somebody else has to know.
    ///
    /// # Errors
    /// Says why the vehicle must not turn over; nothing has changed then.
    pub fn start(
        &mut self,
        now: Instant,
        direction: FlipDirection,
        estimate: &StateEstimate,
    ) -> Result<(), FlipRefusal> {
        let config = &self.config;
        if self.stage != FlipStage::Over || self.over.is_some_and(|over| now.since(over) < config.pause) {
            return Err(FlipRefusal::Busy);
        }
        let climb_known = climb_rate(estimate).is_some();
        if !(is_known(estimate) && climb_known && estimate.valid.contains(Validity::HEIGHT)) {
            return Err(FlipRefusal::Estimate);
        }
        // Comparisons are false for NaN, and then refuse.
        let high = estimate.height >= config.height_min;
        if !high {
            return Err(FlipRefusal::Height);
        }
        let [tilt, rate, drift, climb] = config.steady;
        let down = attitude::down_in_body(&estimate.attitude);
        let stays = !estimate.valid.contains(Validity::VELOCITY_XY) || estimate.velocity.horizontal().norm() <= drift;
        let still =
            down.z >= math::cos(tilt) && estimate.angular_rate.norm() <= rate && estimate.velocity.z.abs() <= climb;
        if !(still && stays) {
            return Err(FlipRefusal::Unsteady);
        }
        (self.pitch, self.sense) = match direction {
            FlipDirection::Left => (false, -1.0),
            FlipDirection::Right => (false, 1.0),
            FlipDirection::Forward => (true, -1.0),
            FlipDirection::Back => (true, 1.0),
        };
        self.heading = attitude::half_heading(&estimate.attitude);
        (self.angle, self.rate, self.complete) = (0.0, 0.0, false);
        self.enter(now, FlipStage::Climb);
        Ok(())
    }

    /// Gives up climb or turn, and levels: something has failed.
    pub fn abort(&mut self, now: Instant) {
        if matches!(self.stage, FlipStage::Climb | FlipStage::Turn) {
            self.enter(now, FlipStage::Recover);
        }
    }

    /// One control period of a sequence that is not over. `estimate` may be anything: one without a
    /// tilt is over, and without a climb rate it levels.
    pub fn step(&mut self, now: Instant, estimate: &StateEstimate) -> FlipDemand {
        let dt = self.timer.step(now);
        if !is_known(estimate) {
            self.finish(now, false);
        }
        let elapsed = now.since(self.entered);
        let config = self.config;
        match self.stage {
            FlipStage::Climb => {
                let climb = climb_rate(estimate);
                if climb.is_some_and(|climb| climb >= config.climb) {
                    self.angle = self.sense * self.lean(estimate);
                    self.enter(now, FlipStage::Turn);
                } else if climb.is_none() || elapsed >= config.climb_limit {
                    self.enter(now, FlipStage::Recover);
                }
            }
            FlipStage::Turn => {
                let turning = self.turning(estimate);
                self.angle += turning * dt;
                let once = self.angle >= math::TAU - config.hand_over;
                if once || elapsed >= config.turn_limit || estimate.angular_rate.norm() > config.rate_limit {
                    self.complete = once;
                    self.enter(now, FlipStage::Recover);
                }
            }
            FlipStage::Recover => {
                let [climb, tilt, rate] = Self::AT_REST;
                let level = attitude::down_in_body(&estimate.attitude).z >= math::cos(tilt);
                let stays = climb_rate(estimate).is_none_or(|known| known.abs() <= climb);
                let rests = stays && estimate.angular_rate.norm() <= rate;
                if (level && rests) || elapsed >= config.recover_limit {
                    self.finish(now, self.complete && level && rests);
                }
            }
            FlipStage::Over => {}
        }
        match self.stage {
            FlipStage::Climb => FlipDemand { thrust: config.thrust_max, ..self.level(estimate) },
            FlipStage::Turn => self.turn(estimate, dt),
            FlipStage::Recover => FlipDemand { thrust: self.brake(estimate), ..self.level(estimate) },
            FlipStage::Over => FlipDemand { thrust: config.hover_thrust, ..FlipDemand::default() },
        }
    }

    /// Ends it, wherever it is: somebody else flies on.
    pub fn cancel(&mut self, now: Instant) {
        if self.stage != FlipStage::Over {
            self.finish(now, false);
        }
    }

    fn enter(&mut self, now: Instant, stage: FlipStage) {
        (self.stage, self.entered) = (stage, now);
    }

    fn finish(&mut self, now: Instant, complete: bool) {
        (self.complete, self.over) = (complete, Some(now));
        self.enter(now, FlipStage::Over);
    }

    /// The angle of roll or pitch, rad.
    fn lean(&self, estimate: &StateEstimate) -> f32 {
        let down = attitude::down_in_body(&estimate.attitude);
        math::atan2(if self.pitch { -down.x } else { down.y }, down.z)
    }

    /// The rate about the axis of the flip in its sense, rad/s.
    fn turning(&self, estimate: &StateEstimate) -> f32 {
        self.sense * if self.pitch { estimate.angular_rate.y } else { estimate.angular_rate.x }
    }

    /// A vector along the axis of the flip.
    fn along(&self, length: f32) -> Vec3 {
        let length = self.sense * length;
        if self.pitch { Vec3::new(0.0, length, 0.0) } else { Vec3::new(length, 0.0, 0.0) }
    }

    /// The rate that levels it, to the heading of before.
    fn level(&self, estimate: &StateEstimate) -> FlipDemand {
        let wanted = attitude::from_down_axis(&Vec3::z(), self.heading);
        let rate = attitude::rate_towards(&self.config.attitude, &estimate.attitude, &wanted);
        FlipDemand { rate, ..FlipDemand::default() }
    }

    fn turn(&mut self, estimate: &StateEstimate, dt: f32) -> FlipDemand {
        let config = &self.config;
        let acceleration = config.acceleration[usize::from(self.pitch)];
        // The speed from which the rest of the turn brakes it to what the attitude loop takes over with.
        let last = config.attitude.tilt_rate_max;
        let ahead = self.angle + self.turning(estimate) * config.motor_lag;
        let left = (math::TAU - config.hand_over - ahead).max(0.0);
        let braking = math::sqrt(last * last + 2.0 * acceleration * left);
        let faster = (self.rate + acceleration * dt).min(config.rate);
        let rate = faster.min(braking);
        // A turn that is braked too early waits for the angle: what does not change has no acceleration.
        let change = symmetric((rate - self.rate) / dt, acceleration);
        self.rate = rate;
        let upright = within((math::cos(self.angle) - Self::COS_USEFUL) / (1.0 - Self::COS_USEFUL), 0.0, 1.0);
        FlipDemand {
            rate: self.along(rate),
            acceleration: self.along(change),
            thrust: config.thrust_turn + (config.thrust_max - config.thrust_turn) * upright,
        }
    }

    /// Thrust that brakes the fall, as far as it points upwards.
    fn brake(&self, estimate: &StateEstimate) -> f32 {
        let config = &self.config;
        let cos_tilt = attitude::down_in_body(&estimate.attitude).z;
        if cos_tilt < Self::COS_USEFUL {
            return config.thrust_turn;
        }
        let climb = climb_rate(estimate).unwrap_or_default();
        let wanted = config.hover_thrust * (1.0 - config.climb_gain * climb / GRAVITY) / cos_tilt;
        within(wanted, config.thrust_turn, config.thrust_max)
    }
}

/// Are the numbers known that a turn is flown by? Height and climb rate are not among them: upside
/// down no range measures them.
fn is_known(estimate: &StateEstimate) -> bool {
    let tilt = estimate.valid.contains(Validity::TILT) && estimate.attitude.is_unit();
    tilt && estimate.angular_rate.sum().is_finite()
}

/// How fast it climbs, m/s, if that is known.
fn climb_rate(estimate: &StateEstimate) -> Option<f32> {
    let known = estimate.valid.contains(Validity::VELOCITY_Z) && estimate.velocity.z.is_finite();
    known.then_some(-estimate.velocity.z)
}

#[cfg(test)]
mod tests;
