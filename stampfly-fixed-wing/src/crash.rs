//! Has the aircraft crashed?
//!
//! | it has when | after |
//! |---|---|
//! | a blow comes from the front, the side or above, or from below with more sink than its wheels bear | at once: who sees every inertial sample says so |
//! | it is on its wheels as planned, and banked so far that a wing tip is on the ground | 0.3 s |
//! | it lies: gravity pulls in a direction in which no wheels carry it, and it does not turn | 0.5 s |
//! | its motor takes more current than at a standstill: the propeller is held | 0.3 s |
//! | it is meant to fly, and has neither airspeed nor speed over the ground | 2 s |
//!
//! An aeroplane flies in any attitude, on its back as well: what has airspeed and moves over the
//! ground does not lie, however it is turned. A blow is the one thing that stops its propeller in
//! the air. For aeroplanes on wheels; one that lands on its belly has no bank of its own.

use crate::messages::Place;
use stampfly_mode::failsafe::{Resting, RestingConfig};
use stampfly_types::messages::{AirState, PowerData, StateEstimate, Validity};
use stampfly_types::{Duration, Instant, frame};

/// It lies when it has for this long.
const LIES: Duration = Duration::from_millis(500);
/// A wing tip is on the ground when it has been for this long, and a propeller held: longer than a
/// bounce, and than an inrush of current.
const TOUCHES: Duration = Duration::from_millis(300);
/// It stands somewhere when it has for this long.
const STANDS: Duration = Duration::from_secs(2);
/// Slower than this over the ground, m/s, and than this share of its stall through the air, it
/// stands. What a crash leaves of an estimate may be off by more.
const STILL: f32 = 1.5;
const MOVES: f32 = 3.0;
const SLOW: f32 = 0.5;
/// And turns no faster than this, rad/s.
const TURNS: f32 = 0.1;

/// What an aircraft stands on, and what its motor takes. The default is the Ultra Stick 25e.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CrashConfig {
    /// Bank at which a wing tip touches the ground, wheels on it, rad: the arc tangent of the tip's
    /// height over its distance from the wheel. A little less, because legs give way.
    pub bank: f32,
    /// Pitch of the force that is felt at the hardest start and on the steepest slope, either way,
    /// rad. Farther down it lies on its nose, or on its back.
    pub pitch: f32,
    /// Rate of sink that its wheels bear, m/s.
    pub sink: f32,
    /// Current of its motor, A: twice that of full throttle at a standstill. A propeller that is
    /// held takes several times as much.
    pub current: f32,
}

impl Default for CrashConfig {
    fn default() -> Self {
        Self {
            // Tips 0.25 m above the ground and 0.47 m outside of the wheel: 28°.
            bank: 0.45,
            // It starts with 0.8 of its weight, which is felt as 39°.
            pitch: 0.8,
            // Springs of 3.7 kN/m give way by 33 mm, half of what is below the propeller.
            sink: 2.5,
            // 39 A.
            current: 78.0,
        }
    }
}

/// What it looks at.
#[derive(Clone, Copy, Debug)]
pub struct CrashInput<'a> {
    /// The estimate, if it is fresh.
    pub estimate: Option<&'a StateEstimate>,
    /// The air.
    pub air: &'a AirState,
    /// The battery, if it is measured.
    pub power: Option<&'a PowerData>,
    /// What it does.
    pub place: Place,
    /// Slowest flight, m/s.
    pub stall: f32,
    /// May the propeller turn?
    pub armed: bool,
    /// Who sees every inertial sample has seen a blow, or a rate that no surface makes.
    pub blow: bool,
}

/// What is remembered.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Crash {
    resting: Resting,
    banked: Option<Instant>,
    held: Option<Instant>,
    stands: Option<Instant>,
}

impl Crash {
    /// Has it crashed, and does it still show?
    pub fn step(&mut self, now: Instant, input: &CrashInput<'_>, config: &CrashConfig) -> bool {
        let CrashInput { estimate, air, power, place, stall, armed, blow } = *input;
        let lasts = |since: &mut Option<Instant>, holds: bool, time: Duration| {
            *since = if holds { since.or(Some(now)) } else { None };
            since.is_some_and(|since| now.since(since) >= time)
        };
        let held = power.is_some_and(|power| power.current > config.current);
        let held = lasts(&mut self.held, armed && held, TOUCHES);
        let Some(estimate) = estimate else { return blow || held };
        let resting = RestingConfig { lean: [config.bank, config.pitch], time: LIES };
        let knows_speed = estimate.valid.contains(Validity::VELOCITY_XY);
        let speed = estimate.velocity.horizontal().norm();
        let lies = self.resting.step(now, &resting, &estimate.specific_force, &estimate.angular_rate, 0.0)
            && !(knows_speed && speed > MOVES && air.airspeed > stall);
        let [bank, ..] = frame::roll_pitch_yaw(&estimate.attitude);
        let knows_bank = estimate.valid.contains(Validity::TILT);
        let banked =
            lasts(&mut self.banked, armed && knows_bank && is_on_wheels(place) && bank.abs() > config.bank, TOUCHES);
        let is_still = knows_speed && speed < STILL && estimate.angular_rate.norm() < TURNS;
        let stands = lasts(&mut self.stands, armed && flies(place) && is_still && air.airspeed < SLOW * stall, STANDS);
        blow || held || lies || banked || stands
    }
}

/// Is it on its wheels as planned?
const fn is_on_wheels(place: Place) -> bool {
    matches!(
        place,
        Place::TakeOffRoll
            | Place::LandingTouchdown
            | Place::TaxiingStop
            | Place::TaxiingTurnOff
            | Place::TaxiingPark
            | Place::TaxiingReturn
            | Place::TaxiingLineUp
    )
}

/// Is it meant to have airspeed?
const fn flies(place: Place) -> bool {
    matches!(
        place,
        Place::TakeOffClimb
            | Place::CruisingCruise
            | Place::LandingTransition
            | Place::LandingSlope
            | Place::LandingFlare
    )
}

#[cfg(test)]
mod tests;
