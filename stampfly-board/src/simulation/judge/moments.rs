//! The moments of a flight at which faults may begin, from the truth, the vehicle's status and the
//! topics of the bus.

use super::sight::Sight;
use crate::topics::Id;
use stampfly_flight::newest::message;
use stampfly_sim::fault::{Injector, Moment};
use stampfly_types::messages::{CalibrationResult, FlightMode, FlightPhase, PilotInput};
use stampfly_types::{Duration, Instant};

/// It climbs, m: half way to the lowest take-off height but clear of the ground.
const CLIMBED: f32 = 0.15;
/// Horizontal speed of a vehicle that flies to another place, m/s.
const MOVES: f32 = 0.25;
/// It hovers after this time in flight.
const HOVERS: Duration = Duration::from_secs(1);
/// A throttle stick below this is at its lowest: a pilot who holds a climb or a descent stays above
/// it.
const LOWEST: f32 = -0.9;

/// What is remembered of a flight to tell its moments.
pub(super) struct Moments {
    flying_since: Option<Instant>,
    /// The mode of the step before, if it flew then.
    mode: Option<FlightMode>,
    /// It flies, clear of the ground.
    in_air: bool,
    /// The pilot's throttle stick in the frame before.
    throttle: f32,
}

impl Default for Moments {
    fn default() -> Self {
        // A stick that is at its lowest from the beginning on was never pulled there.
        Self { flying_since: None, mode: None, in_air: false, throttle: LOWEST }
    }
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
        let mode = flying.then_some(status.mode);
        let turned = self.mode.zip(mode).is_some_and(|(before, mode)| before != mode);
        (self.mode, self.in_air) = (mode, flying && clearance > CLIMBED);
        let moments = [
            (Moment::Ground, status.phase == FlightPhase::IdleGround && status.blocks.is_empty()),
            (Moment::Spool, motors_on),
            (Moment::TakeOff, clearance > CLIMBED),
            (Moment::Hover, hovers),
            (Moment::Move, hovers && truth.velocity.horizontal().norm() > MOVES),
            (Moment::Flip, status.phase == FlightPhase::Flip),
            (Moment::Mode, turned),
            (Moment::Landing, sinks && truth.velocity.z > 0.1),
            (Moment::Touch, touches),
        ];
        for (moment, _) in moments.iter().filter(|(_, has_come)| *has_come) {
            injector.reached(*moment, now);
        }
    }

    /// A sample was published.
    pub fn published(&mut self, injector: &Injector, id: Id, at: Instant, words: &[u32]) {
        let has_come = match id {
            Id::calibration => {
                let runs = |result: CalibrationResult| result.progress > 0.0 && !result.complete;
                message(words).is_some_and(runs).then_some(Moment::Calibration)
            }
            Id::parameter_change => Some(Moment::Parameter),
            Id::command_pilot => {
                let throttle = message(words).map_or(self.throttle, |input: PilotInput| input.throttle);
                let before = core::mem::replace(&mut self.throttle, throttle);
                (self.in_air && before > LOWEST && throttle <= LOWEST).then_some(Moment::Chop)
            }
            _ => None,
        };
        has_come.into_iter().for_each(|moment| injector.reached(moment, at));
    }
}
