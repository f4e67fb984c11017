//! Which event leads from which phase to which: the whole table.
//!
//! ```text
//! INIT ─ready─► IDLE_GROUND ◄─lifted/set down─► IDLE_HELD
//!                 │ arm                 ▲ stop, emergency
//!                 ▼                     │ (from every phase below)
//!               ARMED ─take off─► TAKEOFF ─complete─► FLYING ─land─► LANDING ─touchdown─► IDLE_GROUND
//!                                                      │  ▲
//!                                                 flip ▼  │ over
//!                                                      FLIP ─land─► LANDING
//! ```
//!
//! [`decide`](crate::decision::decide) finds out which events have happened. `docs/reference/modes.md` is printed from [`TABLE`] and
//! [`Event::guard`].

use stampfly_types::messages::FlightPhase;

/// Something that may change the phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Sensors, calibration and estimate are ready.
    Ready,
    /// The vehicle was lifted by a person.
    Lifted,
    /// It stands again.
    SetDown,
    /// Arming was asked for and nothing speaks against it.
    Arm,
    /// Take-off was asked for.
    TakeOff,
    /// The take-off height is reached.
    TakeOffComplete,
    /// Landing was asked for, or is demanded by a fault.
    Land,
    /// To turn over was asked for.
    Flip,
    /// It has turned over, or given it up.
    FlipOver,
    /// Touchdown is sure.
    Touchdown,
    /// Motors off, because a person or program asked for it or the phase took too long.
    Stop,
    /// Motors off now.
    Emergency,
}

impl Event {
    /// Every event, most urgent first: the order in which [`decide`](crate::decision::decide) looks at them.
    pub const ALL: [Self; 12] = [
        Self::Emergency,
        Self::Stop,
        Self::Touchdown,
        Self::Land,
        Self::FlipOver,
        Self::Flip,
        Self::TakeOffComplete,
        Self::TakeOff,
        Self::Arm,
        Self::SetDown,
        Self::Lifted,
        Self::Ready,
    ];

    /// When it happens, in words: for `docs/reference/modes.md`.
    #[must_use]
    pub const fn guard(self) -> &'static str {
        match self {
            Self::Emergency => {
                "kill from any link, a press of the button, the cut-off, or `IMPACT`, `GYRO_ANOMALY`, `TUMBLED`, `IMU_LOST`, \
                 `IMU_FAULTY`, `MOTOR_LOST`"
            }
            Self::Stop => {
                "ARMED: arm switch off, `Disarm`, or armed for too long. TAKEOFF, FLYING: arm switch off in a manual mode. TAKEOFF: `NO_LIFT`. \
                 LANDING: arm switch off or `Disarm` at the ground, a second deliberate switch-off of the pilot whose switch \
                 began the landing, a landing that takes too long, or `FORCE_IMPLAUSIBLE` or \
                 `ACCEL_FAULTY` below `standing_height`"
            }
            Self::Touchdown => "the land detector is sure",
            Self::Land => {
                "`Land` or `Disarm` from any program, arm switch off in a mode that holds height, link lost for too long (at \
                 once without height), height lost for too long, horizontal velocity lost for too long without a pilot, a \
                 take-off that takes too long, after a flip when it is level, or `CRITICAL_BATTERY`, \
                 `ESTIMATE_DIVERGED`, `MOTOR_WEAK`, `NO_LIFT`, `IMU_NOISY`, `FORCE_IMPLAUSIBLE`, `ACCEL_FAULTY`, `STRUCK`"
            }
            Self::Flip => {
                "a `Flip` of any direction, while a program flies in a mode that holds height: level, at rest, above `flip_height`, \
                 `flip_room` below `ceiling`, the battery not low, nothing wrong with range, flow and link"
            }
            Self::FlipOver => {
                "level and at rest again after it was upside down, or without that `flip_start` after it began; after `flip_timeout` \
                 in any case"
            }
            Self::TakeOffComplete => {
                "the land detector says so, or in a manual mode the vehicle has left the ground, or in ACRO three \
                 seconds have passed"
            }
            Self::TakeOff => {
                "`TakeOff`, the spool-up time after arming in a mode that holds height, or the pilot's throttle raised from \
                 rest"
            }
            Self::Arm => {
                "arm switch on, a click, or `Arm`, with an empty list of blocks and nothing in the same step that kills, \
                 disarms or lands"
            }
            Self::SetDown => "height below `standing_height`, or unknown for `height_unknown`",
            Self::Lifted => "height above `held_height`",
            Self::Ready => "still-calibration complete and tilt known",
        }
    }
}

/// A row of the table: in this phase, this event leads to that phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transition {
    /// The phase before.
    pub from: FlightPhase,
    /// What happens.
    pub event: Event,
    /// The phase after.
    pub to: FlightPhase,
}

const fn row(from: FlightPhase, event: Event, to: FlightPhase) -> Transition {
    Transition { from, event, to }
}

use Event as E;
use FlightPhase as S;

/// Every transition there is, those of a phase most urgent first. A phase ignores an event without a row.
pub const TABLE: &[Transition] = &[
    row(S::Init, E::Ready, S::IdleGround),
    row(S::IdleGround, E::Arm, S::Armed),
    row(S::IdleGround, E::Lifted, S::IdleHeld),
    row(S::IdleHeld, E::SetDown, S::IdleGround),
    row(S::Armed, E::Emergency, S::IdleGround),
    row(S::Armed, E::Stop, S::IdleGround),
    row(S::Armed, E::Land, S::IdleGround),
    row(S::Armed, E::TakeOff, S::TakeOff),
    row(S::TakeOff, E::Emergency, S::IdleGround),
    row(S::TakeOff, E::Stop, S::IdleGround),
    row(S::TakeOff, E::Land, S::Landing),
    row(S::TakeOff, E::TakeOffComplete, S::Flying),
    row(S::Flying, E::Emergency, S::IdleGround),
    row(S::Flying, E::Stop, S::IdleGround),
    row(S::Flying, E::Land, S::Landing),
    row(S::Flying, E::Flip, S::Flip),
    row(S::Landing, E::Emergency, S::IdleGround),
    row(S::Landing, E::Stop, S::IdleGround),
    row(S::Landing, E::Touchdown, S::IdleGround),
    row(S::Flip, E::Emergency, S::IdleGround),
    row(S::Flip, E::Land, S::Landing),
    row(S::Flip, E::FlipOver, S::Flying),
];

/// First row of each phase, and the one after its last. The whole table in every step would be 150 instructions.
const PLACES: [(usize, usize); FlightPhase::ALL.len()] = {
    let mut places = [(0, 0); FlightPhase::ALL.len()];
    let mut index = 0;
    while index < TABLE.len() {
        let (first, end) = &mut places[TABLE[index].from as usize];
        if *end == 0 {
            *first = index;
        }
        assert!(*end == 0 || *end == index, "the rows of a phase stand together");
        *end = index + 1;
        index += 1;
    }
    places
};

/// The rows of a phase, most urgent first.
#[must_use]
pub fn rows(phase: FlightPhase) -> &'static [Transition] {
    let place = PLACES.get(phase as usize);
    place.and_then(|(first, end)| TABLE.get(*first..*end)).unwrap_or_default()
}

/// Where an event leads; `None` when the phase ignores it.
///
/// ```
/// use stampfly_mode::transitions::{Event, next};
/// use stampfly_types::messages::FlightPhase;
/// assert_eq!(next(FlightPhase::Flying, Event::Land), Some(FlightPhase::Landing));
/// assert_eq!(next(FlightPhase::Flying, Event::Arm), None);
/// ```
#[must_use]
pub fn next(phase: FlightPhase, event: Event) -> Option<FlightPhase> {
    rows(phase).iter().find(|row| row.event == event).map(|row| row.to)
}

/// May the motors turn in this phase?
#[must_use]
pub const fn is_armed(phase: FlightPhase) -> bool {
    matches!(phase, FlightPhase::Armed) || is_airborne(phase)
}

/// Has the vehicle been sent into the air?
#[must_use]
pub const fn is_airborne(phase: FlightPhase) -> bool {
    matches!(phase, FlightPhase::TakeOff | FlightPhase::Flying | FlightPhase::Landing | FlightPhase::Flip)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_event_has_a_guard_of_its_own_and_leads_where_the_table_says() {
        let guards: std::collections::BTreeSet<_> = Event::ALL.iter().map(|event| event.guard()).collect();
        assert_eq!(guards.len(), Event::ALL.len());
        assert!(guards.iter().all(|guard| guard.len() > 10), "{guards:?}");
        for &phase in FlightPhase::ALL {
            for event in Event::ALL {
                let to = TABLE.iter().find(|known| known.from == phase && known.event == event).map(|known| known.to);
                assert_eq!(next(phase, event), to, "{phase:?}, {event:?}");
                assert!(to.is_none_or(|to| TABLE.contains(&row(phase, event, to))));
            }
        }
        assert_eq!(next(FlightPhase::Flying, Event::Land), Some(FlightPhase::Landing));
    }

    #[test]
    fn the_most_urgent_event_of_a_phase_comes_first_and_each_comes_once() {
        let place = |event| Event::ALL.iter().position(|known| *known == event);
        for &phase in FlightPhase::ALL {
            let events: std::vec::Vec<_> =
                TABLE.iter().filter(|row| row.from == phase).map(|row| place(row.event)).collect();
            assert!(events.is_sorted_by(|a, b| a < b), "{phase:?}: {events:?}");
        }
    }
}
