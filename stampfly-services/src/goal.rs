//! The goal of each command, and the vehicle state in which it is reached.
//!
//! The mode machine may still refuse a command that has reached the vehicle. A service therefore
//! acknowledges a command only when the published [state](crate::View::state) shows that its goal is
//! reached, mostly one or two control cycles later.
//!
//! | command | reached when |
//! |---|---|
//! | arming | armed |
//! | disarming, motors off | disarmed; in the air disarming lands first, and continues meanwhile |
//! | take-off | rising or flying |
//! | landing | landing or disarmed |
//! | hold, return, go to a place, tuning | a program has authority and the vehicle is not landing |
//! | guided mode | the same, or disarmed: the next arming by a program is then guided |
//! | flip | flipping |
//!
//! A command whose goal is not reached after [`SOON`] has failed.

use crate::access::VehicleAccess;
use core::fmt;
use stampfly_types::messages::{
    ArmBlocks, CommandSource, FlightPhase, FlightStatus, FlipBlocks, GuidedCommand, GuidedKind,
};
use stampfly_types::{Duration, Instant};

/// A vehicle that has not done it after this long does not. Programs send a command again after
/// half a second, and three times in all.
pub const SOON: Duration = Duration::from_millis(1_500);

/// As many commands wait to be seen done as may.
pub const TOO_MANY: &str = "refused: too many commands at once";

/// It waited to be seen done when another came that ends the flight.
pub const OVERTAKEN: &str = "refused: a later command ends the flight";

/// The vehicle's state says no more.
pub(crate) const NOT_NOW: &str = "the vehicle does not do it now";

/// What a command asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CommandGoal {
    /// That the motors may turn.
    Arm,
    /// That they may not; in the air, landing first.
    Disarm,
    /// That they stop now.
    Kill,
    /// To rise.
    TakeOff,
    /// To land.
    Land,
    /// To stay.
    Hold,
    /// To be led by a program.
    Guided,
    /// To come back.
    Return,
    /// To go to a place.
    GoTo,
    /// To turn over.
    Flip,
    /// To tune a rate loop.
    Tune,
}

/// A line of the table: the text of a denial, the command to the vehicle, and when it has happened.
type Line = (&'static str, GuidedKind, fn(&FlightStatus) -> bool);

impl CommandGoal {
    const fn line(self) -> Line {
        match self {
            Self::Arm => ("arming denied", GuidedKind::Arm, |now| now.armed),
            Self::Disarm => ("disarming denied", GuidedKind::Disarm, |now| !now.armed),
            Self::Kill => ("motors off denied", GuidedKind::Kill, |now| !now.armed),
            Self::TakeOff => ("take-off denied", GuidedKind::TakeOff, rises),
            Self::Land => ("landing denied", GuidedKind::Land, |now| !now.armed || now.phase == FlightPhase::Landing),
            Self::Hold => ("hold denied", GuidedKind::Hold, is_led),
            Self::Guided => ("guided mode denied", GuidedKind::Hold, |now| !now.armed || is_led(now)),
            Self::Return => ("return denied", GuidedKind::WayPoint, is_led),
            Self::GoTo => ("going there denied", GuidedKind::WayPoint, is_led),
            Self::Flip => ("flip denied", GuidedKind::FlipLeft, |now| now.phase == FlightPhase::Flip),
            Self::Tune => ("tuning denied", GuidedKind::AutotuneRoll, is_led),
        }
    }

    /// What this kind of command asks for. `None` of a sign of life.
    #[must_use]
    pub const fn of(kind: GuidedKind) -> Option<Self> {
        Some(match kind {
            GuidedKind::None => return None,
            GuidedKind::Arm => Self::Arm,
            GuidedKind::Disarm => Self::Disarm,
            GuidedKind::TakeOff => Self::TakeOff,
            GuidedKind::WayPoint => Self::GoTo,
            GuidedKind::Hold => Self::Hold,
            GuidedKind::Land => Self::Land,
            GuidedKind::Kill => Self::Kill,
            GuidedKind::FlipLeft | GuidedKind::FlipRight | GuidedKind::FlipForward | GuidedKind::FlipBack => Self::Flip,
            GuidedKind::AutotuneRoll | GuidedKind::AutotunePitch | GuidedKind::AutotuneYaw => Self::Tune,
        })
    }

    /// The text of a denial.
    #[must_use]
    pub const fn denied(self) -> &'static str {
        self.line().0
    }

    /// What the vehicle is asked for. A take-off has a height besides, a return a place.
    #[must_use]
    pub fn command(self) -> GuidedCommand {
        GuidedCommand { kind: self.line().1, ..Default::default() }
    }

    /// Is it seen in this state?
    #[must_use]
    pub fn has_happened(self, status: &FlightStatus) -> bool {
        let (_, _, has_happened) = self.line();
        has_happened(status)
    }

    /// It ends a flight: nothing may keep it from the vehicle.
    #[must_use]
    pub const fn ends_a_flight(self) -> bool {
        matches!(self, Self::Disarm | Self::Kill | Self::Land)
    }

    /// What speaks against it before the vehicle is asked.
    #[must_use]
    pub fn refusal(self, status: &FlightStatus) -> Option<&'static str> {
        match self {
            Self::TakeOff | Self::Hold | Self::Return | Self::GoTo | Self::Flip | Self::Tune if !status.armed => {
                Some("motors are off")
            }
            Self::Return | Self::GoTo | Self::Flip | Self::Tune if status.phase != FlightPhase::Flying => {
                Some("it does not fly")
            }
            _ => None,
        }
    }
}

const fn rises(status: &FlightStatus) -> bool {
    matches!(status.phase, FlightPhase::TakeOff | FlightPhase::Flying | FlightPhase::Flip)
}

fn is_led(status: &FlightStatus) -> bool {
    let lands = status.phase == FlightPhase::Landing;
    status.armed && !lands && status.commander == CommandSource::Guided
}

impl CommandGoal {
    /// Says why a vehicle in this state does not do it, as far as that is known before it is asked.
    /// `false` when nothing speaks against it.
    pub fn refuse(self, status: &FlightStatus, words: &mut dyn fmt::Write) -> bool {
        match self {
            // That a program is there, the command itself shows.
            Self::Arm if !status.armed => {
                let blocks = status.blocks.without(ArmBlocks::NO_LINK);
                if list(blocks.names(), words) {
                    return true;
                }
            }
            Self::Flip if status.phase == FlightPhase::Flying => {
                let blocks = status.flip_blocks.without(FlipBlocks::NOT_LED);
                if list(blocks.names(), words) {
                    return true;
                }
            }
            _ => {}
        }
        let why = match self {
            Self::Land if !status.armed => Some("it stands on the ground"),
            _ => self.refusal(status),
        };
        if let Some(why) = why {
            _ = write!(words, "refused: {why}");
        }
        why.is_some()
    }
}

/// Writes these reasons. `false` when there is none.
fn list<'a>(reasons: impl Iterator<Item = &'a str>, words: &mut dyn fmt::Write) -> bool {
    let mut some = false;
    for name in reasons {
        // What is too long is cut.
        _ = write!(words, "{}{name}", if some { ", " } else { "refused: " });
        some = true;
    }
    some
}

/// One that was asked for, until it is seen to have happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waited {
    goal: CommandGoal,
    since: Instant,
    /// Refusals to arm that there were before.
    refused: u32,
}

impl Waited {
    /// The vehicle is asked for it now.
    #[must_use]
    pub fn new(now: Instant, goal: CommandGoal, access: &dyn VehicleAccess) -> Self {
        Self::with(now, goal, refusals(access))
    }

    /// The same for who has no access: the vehicle has refused to arm so many times.
    #[must_use]
    pub const fn with(now: Instant, goal: CommandGoal, refusals: u32) -> Self {
        Self { goal, since: now, refused: refusals }
    }

    /// When it was asked for.
    #[must_use]
    pub const fn since(&self) -> Instant {
        self.since
    }

    /// What has become of it: done, or why not. `None` while neither is seen.
    #[must_use]
    pub fn look(&self, now: Instant, access: &dyn VehicleAccess) -> Option<Result<(), &'static str>> {
        self.look_at(now, &access.view().state(), refusals(access))
    }

    /// The same for who has no access: the vehicle is in this state, and has refused to arm so
    /// many times.
    #[must_use]
    pub fn look_at(&self, now: Instant, status: &FlightStatus, refusals: u32) -> Option<Result<(), &'static str>> {
        let lands = self.goal == CommandGoal::Disarm && status.phase == FlightPhase::Landing;
        if lands || self.goal.has_happened(status) {
            return Some(Ok(()));
        }
        // A vehicle that turns over remembers it, and lands as soon as it is level.
        if self.goal.ends_a_flight() && status.phase == FlightPhase::Flip {
            return None;
        }
        let is_refused = self.goal == CommandGoal::Arm && refusals != self.refused;
        (is_refused || now.since(self.since) >= SOON).then(|| Err(why_not(status)))
    }
}

/// Refusals to arm so far.
pub(crate) fn refusals(access: &dyn VehicleAccess) -> u32 {
    access.view().refusals().map_or(0, |(_, refusals)| refusals.attempts)
}

/// Why a vehicle in this state does not do something, as far as its state says so.
pub fn why_not(status: &FlightStatus) -> &'static str {
    match status {
        status if !status.armed => status.blocks.names().next().unwrap_or("motors are off"),
        FlightStatus { phase: FlightPhase::Landing, .. } => "it lands",
        FlightStatus { commander: CommandSource::Pilot, .. } => "a pilot flies",
        FlightStatus { commander: CommandSource::Failsafe, .. } => "the failsafe flies",
        _ => NOT_NOW,
    }
}
