//! A vehicle that cannot lift itself.
//!
//! It takes off, its controller asks for more thrust than carries the weight, and neither height nor specific force follows:
//! it is too heavy, its battery too weak, or something holds it. Motors at their limit take it over the floor, and heat up.
//! The height alone does not show it: a range finder that hangs measures the same while the vehicle climbs. So the specific
//! force has to be missing as well.
//!
//! Or it flies, its motors get all that the battery has and make less than the controller asks for, hardly more than the
//! weight, and it does not climb. A moment later it would sink, and nothing would stop it.

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
/// In the air: the share of the demand that is unmet, and the thrust, in shares of the weight, that
/// carries a vehicle of any specimen: two families of measurements of one propeller lie a fifth apart.
const UNMET: f32 = 0.02;
const CARRIES: f32 = 1.2;
/// Slower it does not climb, m/s, in the mean over this time, s: as long as gusts push it down.
const CLIMBS: f32 = 0.05;
const CLIMB_TIME: f32 = 1.0;
/// Three times as long as a gust.
const SPENT: Duration = Duration::from_secs(3);
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
    /// Mean climb rate, m/s, and when it was taken last.
    climb: f32,
    last: Option<Instant>,
    spent: Option<Instant>,
}

impl LiftMonitor {
    /// Does the vehicle not lift itself? See the head of this file.
    pub(super) fn step(&mut self, config: &FailsafeConfig, now: Instant, input: &FailsafeInput<'_>) -> bool {
        let estimate = input.estimate;
        self.force += (-estimate.specific_force.z - self.force) * WEIGHT;
        let dt = self.last.replace(now).map_or(0.0, |last| now.since(last).seconds());
        self.climb += (-estimate.velocity.z - self.climb) * (dt / (CLIMB_TIME + dt));
        let phase = input.flight_status.phase;
        let short = phase == FlightPhase::TakeOff && self.stays(config, input);
        let spent = phase == FlightPhase::Flying && self.is_spent(config, input);
        lasts(&mut self.short, now, short, PATIENCE) | lasts(&mut self.spent, now, spent, SPENT)
    }

    /// Does neither height nor force follow a take-off's thrust?
    fn stays(&self, config: &FailsafeConfig, input: &FailsafeInput<'_>) -> bool {
        // All that is asked for, with what is unmet: a battery that does not give it is a reason.
        let asked = input.output.thrust / config.hover_thrust;
        let carries = self.force / GRAVITY;
        let height = input.estimate.valid.contains(Validity::HEIGHT).then_some(input.estimate.height);
        height.is_some_and(|height| height < config.lift_height) && asked > 1.0 + MISSING && asked > carries + MISSING
    }

    /// Do motors that get all there is make hardly more than the weight, without a climb?
    fn is_spent(&self, config: &FailsafeConfig, input: &FailsafeInput<'_>) -> bool {
        let [.., unmet] = input.unmet;
        let makes = input.thrust.is_none_or(|thrust| thrust < CARRIES * config.hover_thrust);
        let stays = input.estimate.valid.contains(Validity::VELOCITY_Z) && self.climb < CLIMBS;
        unmet > UNMET && makes && stays
    }
}
