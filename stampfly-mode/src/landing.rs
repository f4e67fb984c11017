//! Take-off and landing: contact with the ground, when take-off is done, when touchdown is sure.
//!
//! Everything here reads the estimate and the thrust that was asked for, never a sensor: a range finder that hangs
//! must not stop a landing. Without a valid height the descent is slow all the way and touchdown is recognised by the
//! vehicle not sinking although it is asked to.
//!
//! Near the ground the thrust ceiling is ramped down, so the vehicle settles instead of floating on its own ground
//! effect; the ramp also makes the test for touchdown safe: with two thirds of its weight carried, a vehicle that does
//! not sink stands.

use stampfly_types::messages::{
    ControlOutput, FlightPhase, GroundContact, LandDetected, Setpoint, StateEstimate, Validity,
};
use stampfly_types::{Duration, Instant};

/// Limits of take-off and landing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LandingConfig {
    /// Rise above the take-off spot that counts as airborne, m.
    pub airborne_rise: f32,
    /// Climb rate that counts as airborne, m/s.
    pub airborne_speed: f32,
    /// Descent speed, m/s.
    pub descent: f32,
    /// Descent speed at the ground, m/s.
    pub touchdown: f32,
    /// Below this height the descent slows down, m.
    pub flare_height: f32,
    /// Below this height the thrust ceiling begins to fall, m.
    pub ceiling_height: f32,
    /// Where the ceiling ends, share of hover thrust.
    pub ceiling_share: f32,
    /// How long the ceiling takes to get there.
    pub ceiling_time: Duration,
    /// Slower than this, or upwards, is not sinking, m/s.
    pub still_speed: f32,
    /// Not sinking for this long although it is asked to, the vehicle may stand: the thrust ceiling begins to fall at any
    /// height.
    pub stall_time: Duration,
    /// A vehicle that demands less thrust than this does not carry itself, share of hover thrust.
    pub unloaded_thrust: f32,
    /// Touchdown needs a thrust ceiling below this, share of hover thrust; above [`Self::ceiling_share`], which it has to
    /// pass.
    pub unloaded_ceiling: f32,
    /// Not sinking for this long with the ceiling down is touchdown.
    pub touchdown_time: Duration,
    /// Within this band of its goal take-off has arrived, m.
    pub takeoff_band: f32,
    /// Vertical speed with which take-off has arrived, m/s.
    pub takeoff_speed: f32,
    /// Vertical speed of the path that has arrived, m/s.
    pub takeoff_path_speed: f32,
    /// Time in the band that completes take-off.
    pub takeoff_settle: Duration,
    /// Time after which take-off is complete in any case.
    pub takeoff_limit: Duration,
}

impl Default for LandingConfig {
    /// Speeds, heights and times for flights indoors.
    fn default() -> Self {
        Self {
            airborne_rise: 0.05,
            // Twice `still_speed`, as for `takeoff_speed`: what the estimate of a vehicle that stands does not reach.
            airborne_speed: 0.16,
            descent: 0.3,
            touchdown: 0.15,
            flare_height: 0.3,
            ceiling_height: 0.06,
            // With less than two thirds of its weight carried, a vehicle that does not sink stands.
            ceiling_share: 0.6,
            ceiling_time: Duration::from_millis(800),
            still_speed: 0.08,
            stall_time: Duration::from_secs(1),
            unloaded_thrust: 0.8,
            unloaded_ceiling: 0.85,
            touchdown_time: Duration::from_millis(300),
            takeoff_band: 0.06,
            takeoff_speed: 0.16,
            takeoff_path_speed: 0.02,
            takeoff_settle: Duration::from_millis(400),
            takeoff_limit: Duration::from_secs(8),
        }
    }
}

/// What the manager looks at.
#[derive(Clone, Copy, Debug)]
pub struct LandingInput<'a> {
    /// The estimate.
    pub estimate: &'a StateEstimate,
    /// The present flight phase.
    pub phase: FlightPhase,
    /// The set-point one step ago.
    pub setpoint: &'a Setpoint,
    /// The controller's demand one step ago.
    pub demand: &'a ControlOutput,
}

/// The take-off and landing manager.
///
/// ```
/// use stampfly_mode::{LandingConfig, LandingInput, TakeoffLanding};
/// use stampfly_types::{Instant, messages::*};
/// // A vehicle of half a kilogram.
/// let mut manager = TakeoffLanding::new(4.9, LandingConfig::default());
/// // Standing on the floor in LANDING, asked to sink and not sinking: after a while it has landed.
/// let estimate = StateEstimate { height: 0.03, valid: Validity::ALL, ..Default::default() };
/// let mut landed_at = None;
/// for k in 0..1000u64 {
///     let land_detected = manager.step(Instant::from_micros(2_500 * k), &LandingInput {
///         estimate: &estimate, phase: FlightPhase::Landing, setpoint: &Setpoint::default(),
///         demand: &ControlOutput { thrust: 2.7, ..Default::default() },
///     });
///     if land_detected.landed && landed_at.is_none() { landed_at = Some(k as f32 * 0.0025) }
/// }
/// assert!(landed_at.is_some_and(|t| t > 0.3 && t < 1.5));
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TakeoffLanding {
    /// Thrust that carries the vehicle, N.
    hover_thrust: f32,
    config: LandingConfig,
    phase: FlightPhase,
    contact: GroundContact,
    /// Height of the estimate when the phase was entered.
    entry_height: f32,
    entered: Instant,
    /// Since when take-off has been in its band, the descent has stalled, the ceiling has been falling, and the vehicle
    /// has been still under it.
    in_band: Option<Instant>,
    stalled: Option<Instant>,
    ceiling: Option<Instant>,
    still: Option<Instant>,
}

/// Thrust ceiling that is none, share of hover thrust.
const UNLIMITED: f32 = 2.0;

/// How long a condition has held without a break.
fn lasting(since: &mut Option<Instant>, now: Instant, holds: bool) -> Duration {
    if !holds {
        *since = None;
        return Duration::ZERO;
    }
    now.since(*since.get_or_insert(now))
}

impl TakeoffLanding {
    /// A manager of a vehicle that stands and hovers with this thrust, N.
    #[must_use]
    pub fn new(hover_thrust: f32, config: LandingConfig) -> Self {
        Self {
            hover_thrust,
            config,
            phase: FlightPhase::Init,
            contact: GroundContact::Ground,
            entry_height: 0.0,
            entered: Instant::ZERO,
            in_band: None,
            stalled: None,
            ceiling: None,
            still: None,
        }
    }

    fn enter(&mut self, now: Instant, input: &LandingInput<'_>) {
        self.phase = input.phase;
        self.entered = now;
        self.entry_height = input.estimate.height;
        (self.in_band, self.stalled, self.ceiling, self.still) = (None, None, None, None);
    }

    /// One step, at the control rate.
    pub fn step(&mut self, now: Instant, input: &LandingInput<'_>) -> LandDetected {
        if input.phase != self.phase {
            self.enter(now, input);
        }
        let config = &self.config;
        let estimate = input.estimate;
        let height_known = estimate.valid.contains(Validity::HEIGHT);
        let mut land_detected =
            LandDetected { thrust_ceiling: UNLIMITED, descent_rate: config.descent, ..LandDetected::default() };
        match self.phase {
            FlightPhase::Init | FlightPhase::IdleGround | FlightPhase::IdleHeld | FlightPhase::Armed => {
                self.contact = GroundContact::Ground;
            }
            FlightPhase::TakeOff => {
                let rise = estimate.height - self.entry_height;
                if rise > config.airborne_rise || estimate.velocity.z < -config.airborne_speed {
                    self.contact = GroundContact::Air;
                }
                let path = input.setpoint;
                let arrived = self.contact == GroundContact::Air
                    && path.velocity.z.abs() < config.takeoff_path_speed
                    && (path.position.z - estimate.position.z).abs() < config.takeoff_band
                    && estimate.velocity.z.abs() < config.takeoff_speed;
                let in_band = lasting(&mut self.in_band, now, arrived);
                let overdue = now.since(self.entered) > config.takeoff_limit;
                land_detected.takeoff_complete = in_band >= config.takeoff_settle || overdue;
            }
            FlightPhase::Flying => self.contact = GroundContact::Air,
            FlightPhase::Landing => {
                let flare = (estimate.height / config.flare_height).clamp(0.0, 1.0);
                land_detected.descent_rate = if height_known {
                    config.touchdown + (config.descent - config.touchdown) * flare
                } else {
                    config.touchdown
                };
                let sinking = estimate.velocity.z > config.still_speed;
                let stalled = lasting(&mut self.stalled, now, !sinking) > config.stall_time;
                let low = height_known && estimate.height < config.ceiling_height;
                let falling = lasting(&mut self.ceiling, now, low || stalled);
                if self.ceiling.is_some() {
                    let fallen = (falling.seconds() / config.ceiling_time.seconds()).min(1.0);
                    land_detected.thrust_ceiling = 1.0 - (1.0 - config.ceiling_share) * fallen;
                }
                let unloaded = input.demand.thrust < config.unloaded_thrust * self.hover_thrust
                    && land_detected.thrust_ceiling < config.unloaded_ceiling;
                // Rising counts: with so little thrust nothing can, but strong vibration makes the estimate believe so.
                let still = lasting(&mut self.still, now, unloaded && !sinking);
                land_detected.landed = still >= config.touchdown_time;
                if land_detected.landed {
                    self.contact = GroundContact::Ground;
                }
            }
        }
        land_detected.contact = self.contact;
        land_detected
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::Vec3;

    const HOVER_THRUST: f32 = 4.9;
    /// Less than what carries the vehicle: it stands, or it falls.
    const LOW_THRUST: f32 = 0.55 * HOVER_THRUST;

    fn run(
        seconds: f32,
        phase: FlightPhase,
        mut estimate: impl FnMut(f32) -> StateEstimate,
        thrust: f32,
    ) -> Option<f32> {
        let mut manager = TakeoffLanding::new(HOVER_THRUST, LandingConfig::default());
        (0..(seconds * 400.0) as u64).find_map(|k| {
            let t = k as f32 * 0.0025;
            let input = LandingInput {
                estimate: &estimate(t),
                phase,
                setpoint: &Setpoint::default(),
                demand: &ControlOutput { thrust, ..Default::default() },
            };
            manager.step(Instant::from_micros(2_500 * k), &input).landed.then_some(t)
        })
    }

    #[test]
    fn sinking_is_never_landed() {
        let sinking = |t: f32| StateEstimate {
            height: 1.0 - 0.2 * t,
            velocity: Vec3::new(0.0, 0.0, 0.2),
            valid: Validity::ALL,
            ..Default::default()
        };
        assert_eq!(run(5.0, FlightPhase::Landing, sinking, LOW_THRUST), None);
    }

    #[test]
    fn touchdown_is_recognised_while_vibration_makes_the_estimate_climb() {
        let shaken = |t: f32| StateEstimate {
            height: 0.04,
            velocity: Vec3::new(0.0, 0.0, -0.25 + 0.25 * stampfly_types::math::sin(40.0 * t)),
            valid: Validity::ALL,
            ..Default::default()
        };
        let landed = run(5.0, FlightPhase::Landing, shaken, LOW_THRUST);
        assert!(landed.is_some_and(|t| (0.5..1.0).contains(&t)), "{landed:?}");
    }

    #[test]
    fn hovering_low_in_flight_is_never_landed() {
        let low = |_: f32| StateEstimate { height: 0.04, valid: Validity::ALL, ..Default::default() };
        assert_eq!(run(20.0, FlightPhase::Flying, low, LOW_THRUST), None);
    }

    #[test]
    fn touchdown_is_recognised_without_any_height() {
        let blind = |_: f32| StateEstimate { height: 7.0, valid: Validity::TILT, ..Default::default() };
        assert!(run(5.0, FlightPhase::Landing, blind, LOW_THRUST).is_some());
    }
}
