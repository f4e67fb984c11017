//! The table of transitions: state and event in, decision out, nothing else.
//!
//! A pure function without a catch-all arm: a new state or a new event does not compile until somebody has thought about
//! every combination. It knows no time and no sensors; [`super::ModeMachine`] turns those into events.

use stampfly_types::messages::{ArmBlocks, FlightState};

/// What can happen, most urgent first. At most one transition is made per step; of several events the first one that
/// makes a transition counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Event {
    /// The kill switch, or a guided kill.
    Kill,
    /// Impact, gyro anomaly, tumbling, or no inertial sensor.
    Crash,
    /// Disarm by switch or button.
    Disarm,
    /// The estimate is lost, or the mode's vertical outputs are.
    EstimateLost,
    /// The battery is at the level where the vehicle must land.
    BatteryCritical,
    /// Nobody has commanded for too long, the grace of hovering included.
    LinkLost,
    /// A program commands a vehicle that can no longer hold its place.
    GuidanceLost,
    /// Land here.
    Land,
    /// Standing armed is no longer safe or no longer wanted: tilt mismatch, battery, link, too long; or a take-off does
    /// not leave the ground.
    Unsafe,
    /// Touchdown is confirmed.
    Landed,
    /// The take-off height is reached.
    TakeOffComplete,
    /// Take off.
    TakeOff,
    /// A hand lifts the vehicle.
    Lifted,
    /// It has been set down.
    SetDown,
    /// Arm by switch, button or program.
    Arm,
    /// Calibrated, and the attitude is known.
    Ready,
}

impl Event {
    /// Every event, most urgent first.
    pub const ALL: [Self; 16] = [
        Self::Kill,
        Self::Crash,
        Self::Disarm,
        Self::EstimateLost,
        Self::BatteryCritical,
        Self::LinkLost,
        Self::GuidanceLost,
        Self::Land,
        Self::Unsafe,
        Self::Landed,
        Self::TakeOffComplete,
        Self::TakeOff,
        Self::Lifted,
        Self::SetDown,
        Self::Arm,
        Self::Ready,
    ];
}

/// What the table needs to know besides state and event.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// Reasons against arming.
    pub blocks: ArmBlocks,
    /// The pilot commands thrust directly: there is no height to hold, and disarming means motors off.
    pub manual: bool,
}

/// What follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Nothing.
    Stay,
    /// A transition.
    Go(FlightState),
    /// Arming was asked for and is refused.
    Refuse(ArmBlocks),
}

/// The decision for an event in a state.
///
/// ```
/// use stampfly_mode::machine::{Decision, Event, Facts, next};
/// use stampfly_types::messages::FlightState;
/// let facts = Facts::default();
/// assert_eq!(next(FlightState::Flying, Event::LinkLost, &facts), Decision::Go(FlightState::Landing));
/// assert_eq!(next(FlightState::Flying, Event::Crash, &facts), Decision::Go(FlightState::IdleGround));
/// assert_eq!(next(FlightState::Flying, Event::Landed, &facts), Decision::Stay, "a low hover is no landing");
/// ```
#[must_use]
pub fn next(state: FlightState, event: Event, facts: &Facts) -> Decision {
    use Decision::{Go, Stay};
    use Event as E;
    use FlightState as S;

    match state {
        S::Init => match event {
            E::Ready => Go(S::IdleGround),
            E::Kill
            | E::Crash
            | E::Disarm
            | E::EstimateLost
            | E::BatteryCritical
            | E::LinkLost
            | E::GuidanceLost
            | E::Land
            | E::Unsafe
            | E::Landed
            | E::TakeOffComplete
            | E::TakeOff
            | E::Lifted
            | E::SetDown
            | E::Arm => Stay,
        },
        S::IdleGround => match event {
            E::Lifted => Go(S::IdleHeld),
            E::Arm if facts.blocks.is_empty() => Go(S::Armed),
            E::Arm => Decision::Refuse(facts.blocks),
            E::Kill
            | E::Crash
            | E::Disarm
            | E::EstimateLost
            | E::BatteryCritical
            | E::LinkLost
            | E::GuidanceLost
            | E::Land
            | E::Unsafe
            | E::Landed
            | E::TakeOffComplete
            | E::TakeOff
            | E::SetDown
            | E::Ready => Stay,
        },
        S::IdleHeld => match event {
            E::SetDown => Go(S::IdleGround),
            E::Arm => Decision::Refuse(facts.blocks.with(ArmBlocks::NOT_ON_GROUND)),
            E::Kill
            | E::Crash
            | E::Disarm
            | E::EstimateLost
            | E::BatteryCritical
            | E::LinkLost
            | E::GuidanceLost
            | E::Land
            | E::Unsafe
            | E::Landed
            | E::TakeOffComplete
            | E::TakeOff
            | E::Lifted
            | E::Ready => Stay,
        },
        S::Armed => match event {
            E::TakeOff => Go(S::TakeOff),
            // It stands: the safe state is one step away.
            E::Kill
            | E::Crash
            | E::Disarm
            | E::EstimateLost
            | E::BatteryCritical
            | E::LinkLost
            | E::Land
            | E::Unsafe
            | E::Lifted => Go(S::IdleGround),
            E::GuidanceLost | E::Landed | E::TakeOffComplete | E::SetDown | E::Arm | E::Ready => Stay,
        },
        S::TakeOff => match event {
            E::TakeOffComplete => Go(S::Flying),
            E::Kill | E::Crash | E::Unsafe => Go(S::IdleGround),
            E::Disarm => Go(if facts.manual { S::IdleGround } else { S::Landing }),
            E::EstimateLost | E::BatteryCritical | E::LinkLost | E::GuidanceLost | E::Land => Go(S::Landing),
            E::Landed | E::TakeOff | E::Lifted | E::SetDown | E::Arm | E::Ready => Stay,
        },
        S::Flying => match event {
            E::Kill | E::Crash => Go(S::IdleGround),
            E::Disarm => Go(if facts.manual { S::IdleGround } else { S::Landing }),
            E::EstimateLost | E::BatteryCritical | E::LinkLost | E::GuidanceLost | E::Land => Go(S::Landing),
            E::Unsafe | E::Landed | E::TakeOffComplete | E::TakeOff | E::Lifted | E::SetDown | E::Arm | E::Ready => {
                Stay
            }
        },
        S::Landing => match event {
            // Disarming a second time means "now".
            E::Kill | E::Crash | E::Disarm | E::Landed => Go(S::IdleGround),
            // The link coming back does not take a landing back: nobody can rely on it staying.
            E::EstimateLost
            | E::BatteryCritical
            | E::LinkLost
            | E::GuidanceLost
            | E::Land
            | E::Unsafe
            | E::TakeOffComplete
            | E::TakeOff
            | E::Lifted
            | E::SetDown
            | E::Arm
            | E::Ready => Stay,
        },
    }
}

/// May the motors turn in this state?
#[must_use]
pub fn armed(state: FlightState) -> bool {
    match state {
        FlightState::Init | FlightState::IdleGround | FlightState::IdleHeld => false,
        FlightState::Armed | FlightState::TakeOff | FlightState::Flying | FlightState::Landing => true,
    }
}

/// A small set of events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Events(u32);

impl Events {
    /// Adds an event if it has happened.
    pub(super) fn note(&mut self, event: Event, happened: bool) {
        self.0 |= u32::from(happened) << event as u32;
    }

    /// The events, most urgent first.
    pub(super) fn iter(self) -> impl Iterator<Item = Event> {
        Event::ALL.into_iter().filter(move |event| self.0 & (1 << *event as u32) != 0)
    }
}
