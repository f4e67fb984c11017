//! A vehicle that cannot lift itself.
//!
//! It takes off, its controller asks for more thrust than carries the weight, and neither height nor specific force follows:
//! it is too heavy, its battery too weak, or something holds it. Motors at their limit take it over the floor, and heat up.
//!
//! The height alone does not show it: a range finder that hangs measures the same while the vehicle climbs. So the specific
//! force has to be missing as well.

use super::config::FailsafeConfig;
use super::input::FailsafeInput;
use crate::lasting::lasts;
use stampfly_types::messages::{FlightPhase, Validity};
use stampfly_types::{Duration, GRAVITY, Instant};

/// Thrust above that of the weight, and above the specific force, in shares of the weight: the hover thrust is known to a few
/// per cent.
const MISSING: f32 = 0.1;
/// Weight of a step in the mean force: 50 ms at 400 Hz, as motors follow.
const WEIGHT: f32 = 0.05;
/// Meanwhile the ceiling of a take-off's thrust rises from 1.2 of the weight to 1.6, so that motors which give 0.65 of the
/// demand lift the vehicle.
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
    /// Has the controller asked for more thrust than the weight for [`PATIENCE`], without height and force?
    pub(super) fn step(&mut self, config: &FailsafeConfig, now: Instant, input: &FailsafeInput<'_>) -> bool {
        let estimate = input.estimate;
        self.force += (-estimate.specific_force.z - self.force) * WEIGHT;
        if input.flight_status.phase != FlightPhase::TakeOff {
            self.short = None;
            return false;
        }
        // All that is asked for, with what is unmet: a battery that does not give it is a reason.
        let asked = input.output.thrust / config.hover_thrust;
        let carries = self.force / GRAVITY;
        let stays = estimate.valid.contains(Validity::HEIGHT) && estimate.height < config.lift_height;
        let short = stays && asked > 1.0 + MISSING && asked > carries + MISSING;
        lasts(&mut self.short, now, short, PATIENCE)
    }
}
