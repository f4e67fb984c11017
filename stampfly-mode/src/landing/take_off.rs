//! Take-off: spool-up, lift-off, climb.
//!
//! | stage | from | to | thrust |
//! |---|---|---|---|
//! | spool-up | armed | the machine takes off | none is asked for |
//! | lift-off | phase TAKEOFF | risen by [`LandingConfig::airborne_rise`], or climbing; without a range, with more thrust than its weight | under a ceiling that rises |
//! | climb | off the ground | complete, says the machine | under the same ceiling |
//!
//! When to take off, and when to give it up, is the machine's decision: one that something holds down, such as a ceiling, never
//! completes its take-off.
//!
//! [`LandingConfig::airborne_rise`]: super::LandingConfig::airborne_rise

use super::config::LandingConfig;
use super::seen::{Asked, Multicopter, Seen};
use crate::lasting::lasting;
use crate::stage::{Limit, Mode, Stage, Step};
use core::convert::Infallible;
use stampfly_types::Instant;
use stampfly_types::messages::{FlightPhase, GroundContact, SensorMask};

/// This share of the thrust that carries the weight lifts the vehicle, in the mean of the weight test's last tenths of a second. Hover thrust
/// is known to a few per cent, and a take-off asks for 1.15 at least.
const LIFTS: f32 = 1.1;

/// A take-off: when and where the vehicle was sent off.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TakeOff {
    began: Instant,
    /// Height of the estimate then, m.
    height: f32,
}

impl Mode for TakeOff {
    type Vehicle = Multicopter;
    type Stage = TakeOffStage;
    type End = Infallible;
    const FIRST: TakeOffStage = TakeOffStage::SpoolUp;

    fn enter(now: Instant, seen: &Seen<'_>) -> Self {
        Self { began: now, height: seen.estimate.height }
    }
}

crate::stages! {
    /// The stages of a take-off.
    pub enum TakeOffStage for TakeOff {
        SpoolUp: SpoolUp,
        LiftOff: LiftOff,
        Climb: Climb,
    }
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum TakeOffMemory;
}

impl TakeOff {
    /// Nothing new, under the ceiling of thrust.
    fn asked(&self, config: &LandingConfig, now: Instant, seen: &Seen<'_>, contact: GroundContact) -> Asked {
        let mut asked = seen.touching(contact);
        let time = now.since(self.began).seconds();
        asked.land_detected.thrust_ceiling = config.takeoff_ceiling + config.takeoff_ceiling_rise * time;
        asked
    }
}

/// Motors idle; the vehicle stands.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SpoolUp;

impl Stage<TakeOff> for SpoolUp {
    fn enter(_: &mut TakeOff, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &TakeOff) -> Limit<TakeOff> {
        Limit::Unlimited("the machine disarms after ModeConfig::armed_timeout")
    }

    fn execute(&mut self, _: &mut TakeOff, _: Instant, seen: &Seen<'_>) -> Step<TakeOff> {
        if seen.phase == FlightPhase::TakeOff {
            return Step::Stage(TakeOffStage::LiftOff);
        }
        Step::Stay(seen.touching(GroundContact::Ground))
    }
}

/// Sent off, and still on the ground as far as anybody can tell.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LiftOff;

impl Stage<TakeOff> for LiftOff {
    fn enter(take_off: &mut TakeOff, now: Instant, seen: &Seen<'_>) -> Self {
        // The place and the instant of the take-off are these, not those of arming.
        (take_off.began, take_off.height) = (now, seen.estimate.height);
        Self
    }

    fn limit(&self, _: &TakeOff) -> Limit<TakeOff> {
        Limit::Unlimited("the machine lands after ModeConfig::take_off_timeout")
    }

    fn execute(&mut self, take_off: &mut TakeOff, now: Instant, seen: &Seen<'_>) -> Step<TakeOff> {
        let config = seen.config;
        let has_risen = seen.height().is_some_and(|height| height - take_off.height > config.airborne_rise);
        let climbs = seen.sink_rate().is_some_and(|rate| rate < -config.airborne_speed);
        // Without a range nothing measures so small a rise: not the barometer under propellers that have just started, and not the
        // accelerometer, whose zero they move. What is left is that thrust lifts what it is larger than.
        let lifted =
            seen.weight.thrust > LIFTS * config.hover_thrust && !seen.estimate.sensors.contains(SensorMask::TOF);
        if has_risen || climbs || lifted || seen.contact == GroundContact::Air {
            return Step::Stage(TakeOffStage::Climb);
        }
        Step::Stay(take_off.asked(config, now, seen, GroundContact::Ground))
    }
}

/// Off the ground, on the way to its height.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Climb {
    /// Since when it has been at its height.
    in_band: Option<Instant>,
}

impl Stage<TakeOff> for Climb {
    fn enter(_: &mut TakeOff, _: Instant, _: &Seen<'_>) -> Self {
        Self { in_band: None }
    }

    fn limit(&self, _: &TakeOff) -> Limit<TakeOff> {
        Limit::Unlimited("the machine lands after ModeConfig::take_off_timeout")
    }

    fn execute(&mut self, take_off: &mut TakeOff, now: Instant, seen: &Seen<'_>) -> Step<TakeOff> {
        let (config, estimate, path) = (seen.config, seen.estimate, seen.setpoint);
        let away = (path.position.z - estimate.position.z).abs();
        let arrived = path.velocity.z.abs() < config.takeoff_path_speed
            && away < config.takeoff_band
            && estimate.velocity.z.abs() < config.takeoff_speed;
        let in_band = lasting(&mut self.in_band, now, arrived);
        let overdue = now.since(take_off.began) > config.takeoff_limit && away < 2.0 * config.takeoff_band;
        let mut asked = take_off.asked(config, now, seen, GroundContact::Air);
        asked.land_detected.takeoff_complete = in_band >= config.takeoff_settle || overdue;
        Step::Stay(asked)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_without_a_limit_says_who_ends_it() {
        let take_off = TakeOff { began: Instant::ZERO, height: 0.0 };
        for limit in [SpoolUp.limit(&take_off), LiftOff.limit(&take_off), Climb { in_band: None }.limit(&take_off)] {
            assert!(matches!(limit, Limit::Unlimited(why) if why.contains("ModeConfig")));
        }
    }
}
