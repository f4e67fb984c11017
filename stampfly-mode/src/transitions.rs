//! Which event leads from which phase to which: the whole table, as one total function.
//!
//! ```text
//! INIT ─ready─► IDLE_GROUND ◄─lifted/set down─► IDLE_HELD
//!                 │ arm                 ▲ disarm, emergency
//!                 ▼                     │ (from every phase below)
//!               ARMED ─take off─► TAKEOFF ─complete─► FLYING ─land─► LANDING ─touchdown─► IDLE_GROUND
//! ```
//!
//! Who finds out that an event has happened is the [mode machine](crate::machine).

use stampfly_types::messages::FlightPhase;

/// Something that may change the phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Sensors, calibration and estimate are ready.
    Ready,
    /// A hand has lifted the vehicle.
    Lifted,
    /// It stands again.
    SetDown,
    /// Arming was asked for and nothing speaks against it.
    Arm,
    /// Take-off was asked for.
    TakeOff,
    /// The take-off height is reached.
    TakeOffComplete,
    /// Landing was asked for, or the failsafe demands it.
    Land,
    /// Touchdown is sure.
    Touchdown,
    /// Disarming was asked for.
    Disarm,
    /// Motors off now.
    Emergency,
}

impl Event {
    /// Every event, most urgent first: the order in which [`ModeMachine::step`](crate::ModeMachine::step) looks at them.
    pub const ALL: [Self; 10] = [
        Self::Emergency,
        Self::Disarm,
        Self::Touchdown,
        Self::Land,
        Self::TakeOffComplete,
        Self::TakeOff,
        Self::Arm,
        Self::SetDown,
        Self::Lifted,
        Self::Ready,
    ];
}

/// The transition table. `holds_height` says whether the flight mode holds height by itself: then a disarm in the air
/// lands first.
#[must_use]
pub const fn next(phase: FlightPhase, event: Event, holds_height: bool) -> Option<FlightPhase> {
    use Event as E;
    use FlightPhase as S;
    match (phase, event) {
        (S::Init, E::Ready) => Some(S::IdleGround),
        (S::IdleGround, E::Lifted) => Some(S::IdleHeld),
        (S::IdleHeld, E::SetDown) => Some(S::IdleGround),
        (S::IdleGround, E::Arm) => Some(S::Armed),
        (S::Armed, E::TakeOff) => Some(S::TakeOff),
        (S::TakeOff, E::TakeOffComplete) => Some(S::Flying),
        (S::TakeOff | S::Flying, E::Land) => Some(S::Landing),
        (S::TakeOff | S::Flying, E::Disarm) => Some(if holds_height { S::Landing } else { S::IdleGround }),
        (S::Landing, E::Touchdown | E::Disarm) | (S::Armed, E::Disarm | E::Land) => Some(S::IdleGround),
        (S::Armed | S::TakeOff | S::Flying | S::Landing, E::Emergency) => Some(S::IdleGround),
        (S::Init, E::Lifted | E::SetDown | E::Arm | E::TakeOff | E::TakeOffComplete | E::Land | E::Touchdown)
        | (S::Init, E::Disarm | E::Emergency)
        | (S::IdleGround, E::Ready | E::SetDown | E::TakeOff | E::TakeOffComplete | E::Land | E::Touchdown)
        | (S::IdleGround, E::Disarm | E::Emergency)
        | (S::IdleHeld, E::Ready | E::Lifted | E::Arm | E::TakeOff | E::TakeOffComplete | E::Land | E::Touchdown)
        | (S::IdleHeld, E::Disarm | E::Emergency)
        | (S::Armed, E::Ready | E::Lifted | E::SetDown | E::Arm | E::TakeOffComplete | E::Touchdown)
        | (S::TakeOff, E::Ready | E::Lifted | E::SetDown | E::Arm | E::TakeOff | E::Touchdown)
        | (S::Flying, E::Ready | E::Lifted | E::SetDown | E::Arm | E::TakeOff | E::TakeOffComplete | E::Touchdown)
        | (S::Landing, E::Ready | E::Lifted | E::SetDown | E::Arm | E::TakeOff | E::TakeOffComplete | E::Land) => None,
    }
}

/// May the motors turn in this phase?
#[must_use]
pub const fn is_armed(phase: FlightPhase) -> bool {
    matches!(phase, FlightPhase::Armed | FlightPhase::TakeOff | FlightPhase::Flying | FlightPhase::Landing)
}
