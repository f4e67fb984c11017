//! Take-off and landing: contact with the ground, when take-off is done, when touchdown is sure.
//!
//! Everything here reads the estimate and the thrust that was asked for, never a sensor: a range finder that hangs
//! must not stop a landing.
//!
//! Near the ground the thrust ceiling is ramped down, so the vehicle settles instead of floating on its own ground effect.
//! The ramp is also the test for touchdown: a vehicle whose specific force does not follow its thrust stands. So does one
//! that has lost half of its thrust, in whatever way, and none of its specific force. Neither height nor climb rate can
//! make a vehicle in the air count as landed. One that falls although its height says that it stands gets its thrust back,
//! and comes down blind, as one without height and climb rate does.

mod blind;
mod config;
mod weight;

use crate::lasting::lasting;
use blind::BlindDescent;
pub use config::LandingConfig;
use stampfly_types::messages::{
    ControlOutput, FlightPhase, GroundContact, LandDetected, Setpoint, StateEstimate, Validity,
};
use stampfly_types::{Duration, Instant};
use weight::{Answers, Support, WeightTest};

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
/// use stampfly_types::Vec3;
/// let mut manager = TakeoffLanding::new(LandingConfig::default());
/// // A vehicle of half a kilogram that stands on the floor in LANDING: its thrust falls, its specific force does not.
/// let specific_force = Vec3::new(0.0, 0.0, -9.8);
/// let estimate = StateEstimate { height: 0.03, specific_force, valid: Validity::ALL, ..Default::default() };
/// let (mut landed_at, mut ceiling) = (None, 1.0f32);
/// for k in 0..1000u64 {
///     let land_detected = manager.step(Instant::from_micros(2_500 * k), &LandingInput {
///         estimate: &estimate, phase: FlightPhase::Landing, setpoint: &Setpoint::default(),
///         demand: &ControlOutput { thrust: 4.9 * ceiling.min(1.0), ..Default::default() },
///     });
///     ceiling = land_detected.thrust_ceiling;
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
    /// Since when it has been falling under a falling ceiling.
    falling: Option<Instant>,
    /// Since when something else than its thrust has carried it.
    carried: Option<Instant>,
    weight: WeightTest,
    /// The descent without height and climb rate, once it has begun.
    blind: Option<BlindDescent>,
    /// Was thrust being taken away in the step before?
    is_testing: bool,
}

/// A vehicle that falls for this long while its ramp goes down is in the air, whatever its height says: from 6 cm it would
/// be on the ground by then.
const FREE_FALL: Duration = Duration::from_millis(250);

/// The ground carries a vehicle that keeps its specific force without its thrust for this long.
const CARRIED: Duration = Duration::from_secs(1);

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
            falling: None,
            carried: None,
            weight: WeightTest::default(),
            blind: None,
            is_testing: false,
        }
    }

    fn enter(&mut self, now: Instant, input: &LandingInput<'_>) {
        self.phase = input.phase;
        self.entered = now;
        self.entry_height = input.estimate.height;
        (self.in_band, self.stalled, self.ceiling, self.still) = (None, None, None, None);
        (self.falling, self.carried, self.blind, self.is_testing) = (None, None, None, false);
        if input.phase == FlightPhase::Landing {
            self.weight.begin_landing();
        }
    }

    /// One step, at the control rate.
    pub fn step(&mut self, now: Instant, input: &LandingInput<'_>) -> LandDetected {
        if input.phase != self.phase {
            self.enter(now, input);
        }
        let config = self.config;
        let estimate = input.estimate;
        let weight = self.weight.step(now, -estimate.specific_force.z, input.demand.thrust, self.is_testing);
        let mut land_detected =
            LandDetected { thrust_ceiling: f32::MAX, descent_rate: config.descent, ..LandDetected::default() };
        match self.phase {
            FlightPhase::Init | FlightPhase::IdleGround | FlightPhase::IdleHeld | FlightPhase::Armed => {
                self.contact = GroundContact::Ground;
            }
            FlightPhase::TakeOff => {
                let time = now.since(self.entered).seconds();
                land_detected.thrust_ceiling = config.takeoff_ceiling + config.takeoff_ceiling_rise * time;
                land_detected.takeoff_complete = self.take_off(now, input);
            }
            FlightPhase::Flying | FlightPhase::Flip => self.contact = GroundContact::Air,
            FlightPhase::Landing => {
                let climb_known = estimate.valid.contains(Validity::VELOCITY_Z);
                let landed = if climb_known && self.blind.is_none() {
                    self.land(now, estimate, weight, &mut land_detected)
                } else {
                    let blind = self.blind.get_or_insert_default();
                    let (ceiling, landed) = blind.step(now, weight, config.touchdown_time);
                    (land_detected.thrust_ceiling, self.is_testing) = (ceiling, blind.is_testing());
                    land_detected.descent_rate = config.touchdown;
                    landed
                };
                let carried = lasting(&mut self.carried, now, weight.is_carried) >= CARRIED;
                land_detected.landed = landed || carried;
                if land_detected.landed {
                    self.contact = GroundContact::Ground;
                }
            }
        }
        land_detected.contact = self.contact;
        land_detected
    }

    /// Is take-off complete? A vehicle that something holds never completes it.
    fn take_off(&mut self, now: Instant, input: &LandingInput<'_>) -> bool {
        let (config, estimate, path) = (&self.config, input.estimate, input.setpoint);
        let height_known = estimate.valid.contains(Validity::HEIGHT);
        let climb_known = estimate.valid.contains(Validity::VELOCITY_Z);
        let has_risen = height_known && estimate.height - self.entry_height > config.airborne_rise;
        let climbs = climb_known && estimate.velocity.z < -config.airborne_speed;
        if has_risen || climbs {
            self.contact = GroundContact::Air;
        }
        let airborne = self.contact == GroundContact::Air;
        let away = (path.position.z - estimate.position.z).abs();
        let arrived = airborne
            && path.velocity.z.abs() < config.takeoff_path_speed
            && away < config.takeoff_band
            && estimate.velocity.z.abs() < config.takeoff_speed;
        let in_band = lasting(&mut self.in_band, now, arrived);
        // One that something holds down, such as a ceiling, never completes it: its time is limited by the mode machine.
        let overdue = now.since(self.entered) > config.takeoff_limit && away < 2.0 * config.takeoff_band;
        in_band >= config.takeoff_settle || (airborne && overdue)
    }

    /// One step of a landing whose climb rate is known. Has the vehicle landed?
    fn land(&mut self, now: Instant, estimate: &StateEstimate, weight: Answers, asked: &mut LandDetected) -> bool {
        let config = &self.config;
        let height_known = estimate.valid.contains(Validity::HEIGHT);
        asked.descent_rate = if height_known {
            let flare = (estimate.height / config.flare_height).clamp(0.0, 1.0);
            config.touchdown + (config.descent - config.touchdown) * flare
        } else {
            config.touchdown
        };
        let sinking = estimate.velocity.z > config.still_speed;
        let stalled = lasting(&mut self.stalled, now, !sinking) > config.stall_time;
        let low = height_known && estimate.height < config.ceiling_height;
        let ramp = lasting(&mut self.ceiling, now, low || stalled);
        self.is_testing = self.ceiling.is_some();
        if self.is_testing {
            let fallen = (ramp.seconds() / config.ceiling_time.seconds()).min(1.0);
            asked.thrust_ceiling = 1.0 - (1.0 - config.ceiling_share) * fallen;
        }
        if lasting(&mut self.falling, now, weight.quick == Support::Falls) >= FREE_FALL {
            // Low, or not sinking, it says, and it falls: neither height nor climb rate is to be believed.
            (self.blind, self.is_testing) = (Some(BlindDescent::default()), false);
            return false;
        }
        lasting(&mut self.still, now, weight.steady == Support::Stands) >= config.touchdown_time
    }
}

#[cfg(test)]
mod tests;
