//! The moments at which faults may begin: a flight's, as the truth and the vehicle's status tell them.

use super::sight::Sight;
use stampfly_sim::fault::{Injector, Moment};
use stampfly_types::messages::FlightPhase;
use stampfly_types::{Duration, Instant};

/// It climbs, m: half way to the lowest take-off height but clear of the ground.
const CLIMBED: f32 = 0.15;
/// Horizontal speed of a vehicle that flies to another place, m/s.
const MOVES: f32 = 0.25;
/// It hovers after this time in flight.
const HOVERS: Duration = Duration::from_secs(1);

/// What is remembered of a flight to tell its moments.
#[derive(Default)]
pub(super) struct Moments {
    flying_since: Option<Instant>,
}

impl Moments {
    /// Tells the injector which moments have come. `sinks`: a vehicle that lands is in the air; `touches`: it has just touched
    /// the ground.
    pub fn tell(&mut self, injector: &Injector, sight: &Sight<'_>, motors_on: bool, sinks: bool, touches: bool) {
        let Sight { now, truth, clearance, status, .. } = *sight;
        let flying = status.phase == FlightPhase::Flying;
        if flying {
            self.flying_since = self.flying_since.or(Some(now));
        }
        let hovers = flying && self.flying_since.is_some_and(|since| now.since(since) >= HOVERS);
        let moments = [
            (Moment::Ground, status.phase == FlightPhase::IdleGround && status.blocks.is_empty()),
            (Moment::Spool, motors_on),
            (Moment::TakeOff, clearance > CLIMBED),
            (Moment::Hover, hovers),
            (Moment::Move, hovers && truth.velocity.horizontal().norm() > MOVES),
            (Moment::Landing, sinks && truth.velocity.z > 0.1),
            (Moment::Touch, touches),
        ];
        for (moment, _) in moments.iter().filter(|(_, has_come)| *has_come) {
            injector.reached(*moment, now);
        }
    }
}
