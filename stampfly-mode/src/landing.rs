//! Take-off and landing: contact with the ground, when take-off is done, when touchdown is sure.
//!
//! Everything here reads the estimate and the thrust that was asked for, never a sensor: a range finder that hangs
//! must not stop a landing. Without a valid height the descent is slow all the way and touchdown is recognised by the
//! vehicle not sinking although it is asked to.
//!
//! Near the ground the thrust ceiling is ramped down, so the vehicle settles instead of floating on its own ground
//! effect; the ramp also makes the test for touchdown safe: with two thirds of its weight carried, a vehicle that does
//! not sink stands.

use stampfly_types::Instant;
use stampfly_types::messages::{
    ControlOutput, FlightPhase, GroundContact, LandDetected, Setpoint, StateEstimate, Validity,
};

/// Limits of take-off and landing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LandingConfig {
    /// Thrust that carries the vehicle, N.
    pub hover_thrust: f32,
    /// Rise above the take-off spot that counts as airborne, m.
    pub airborne_rise: f32,
    /// Descent speed, m/s.
    pub descent: f32,
    /// Descent speed at the ground, m/s.
    pub touchdown: f32,
    /// Below this height the descent slows down, m.
    pub flare_height: f32,
    /// Below this height the thrust ceiling begins to fall, m.
    pub ceiling_height: f32,
    /// Where the ceiling ends, as a share of hover thrust, and how long it takes to get there, s.
    pub ceiling: [f32; 2],
    /// Slower than this, or upwards, is not sinking, m/s.
    pub still_speed: f32,
    /// Not sinking for this long with the ceiling down is touchdown, s.
    pub touchdown_time: f32,
    /// Within this band of its goal take-off has arrived, m.
    pub takeoff_band: f32,
    /// Time in the band that completes take-off, and time after which it is complete in any case, s.
    pub takeoff_time: [f32; 2],
}

impl LandingConfig {
    /// The limits for a vehicle that hovers with this thrust, N. Speeds, heights and times are for flights indoors.
    #[must_use]
    pub const fn for_hover_thrust(hover_thrust: f32) -> Self {
        Self {
            hover_thrust,
            airborne_rise: 0.05,
            descent: 0.3,
            touchdown: 0.15,
            flare_height: 0.3,
            ceiling_height: 0.06,
            ceiling: [0.6, 0.8],
            still_speed: 0.08,
            touchdown_time: 0.3,
            takeoff_band: 0.06,
            takeoff_time: [0.4, 8.0],
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
/// let mut manager = TakeoffLanding::new(LandingConfig::for_hover_thrust(4.9));
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

/// How long a condition has held without a break, s.
fn lasting(since: &mut Option<Instant>, now: Instant, holds: bool) -> f32 {
    if !holds {
        *since = None;
        return 0.0;
    }
    now.since(*since.get_or_insert(now)).seconds()
}

impl TakeoffLanding {
    /// A manager of a vehicle that stands.
    #[must_use]
    pub fn new(config: LandingConfig) -> Self {
        Self {
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
        let config = self.config;
        let estimate = input.estimate;
        let height_known = estimate.valid.contains(Validity::HEIGHT);
        let mut land_detected =
            LandDetected { thrust_ceiling: 2.0, descent_rate: config.descent, ..LandDetected::default() };
        match self.phase {
            FlightPhase::Init | FlightPhase::IdleGround | FlightPhase::IdleHeld | FlightPhase::Armed => {
                self.contact = GroundContact::Ground;
            }
            FlightPhase::TakeOff => {
                let rise = estimate.height - self.entry_height;
                if rise > config.airborne_rise || estimate.velocity.z < -2.0 * config.still_speed {
                    self.contact = GroundContact::Air;
                }
                let path = input.setpoint;
                let arrived = self.contact == GroundContact::Air
                    && path.velocity.z.abs() < 0.02
                    && (path.position.z - estimate.position.z).abs() < config.takeoff_band
                    && estimate.velocity.z.abs() < 2.0 * config.still_speed;
                let in_band = lasting(&mut self.in_band, now, arrived);
                let [settle, limit] = config.takeoff_time;
                land_detected.takeoff_complete = in_band >= settle || now.since(self.entered).seconds() > limit;
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
                let stalled = lasting(&mut self.stalled, now, !sinking) > 1.0;
                let low = height_known && estimate.height < config.ceiling_height;
                let [share, ramp] = config.ceiling;
                let falling = lasting(&mut self.ceiling, now, low || stalled);
                if self.ceiling.is_some() {
                    land_detected.thrust_ceiling = 1.0 - (1.0 - share) * (falling / ramp).min(1.0);
                }
                let unloaded = input.demand.thrust < 0.8 * config.hover_thrust && land_detected.thrust_ceiling < 0.85;
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
        let mut manager = TakeoffLanding::new(LandingConfig::for_hover_thrust(HOVER_THRUST));
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
