//! A vehicle that cannot lift itself.
//!
//! It takes off, its controller asks for more thrust than carries the weight, and neither height nor specific force follows:
//! it is too heavy, its battery too weak, or something holds it. Motors at their limit take it over the floor, and heat up.
//!
//! Height alone is no witness: a range that hangs says the same of a vehicle that climbs. So the force has to be missing too.

use super::config::FailsafeConfig;
use super::input::FailsafeInput;
use crate::lasting::lasts;
use stampfly_types::messages::{FlightPhase, Validity};
use stampfly_types::{Duration, GRAVITY, Instant};

/// Thrust above that of the weight, and above what the specific force shows, in shares of the weight: three times what vibration
/// moves an accelerometer's zero by.
const MISSING: f32 = 0.1;
/// Weight of a step in the mean force: 50 ms at 400 Hz, as motors follow.
const WEIGHT: f32 = 0.05;
/// The ceiling of a take-off's thrust rises by 0.4 of the weight meanwhile, and lets a battery of half its strength lift.
const PATIENCE: Duration = Duration::from_secs(2);

/// What is remembered of a take-off.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct LiftMonitor {
    /// Mean force along the thrust, m/s².
    force: f32,
    short: Option<Instant>,
}

impl LiftMonitor {
    /// Has thrust been asked for, and lifted nothing, for long?
    pub(super) fn step(&mut self, config: &FailsafeConfig, now: Instant, input: &FailsafeInput<'_>) -> bool {
        let estimate = input.estimate;
        self.force += (-estimate.specific_force.z - self.force) * WEIGHT;
        if input.flight_status.phase != FlightPhase::TakeOff {
            self.short = None;
            return false;
        }
        let asked = input.output.thrust / config.hover_thrust;
        let carries = self.force / GRAVITY;
        let stays = estimate.valid.contains(Validity::HEIGHT) && estimate.height < config.lift_height;
        let short = stays && asked > 1.0 + MISSING && asked > carries + MISSING;
        lasts(&mut self.short, now, short, PATIENCE)
    }
}
