//! Commands that change the vehicle's state, each acknowledged when it is seen to have happened.
//!
//! A command that has reached the vehicle may still be refused by its mode machine, and what a
//! program sends next depends on what the first has done. So the acknowledgement waits for the
//! [state](crate::View::state) that the vehicle publishes, mostly one or two control cycles.
//! Nothing is said meanwhile, because many programs take the first acknowledgement for the last
//! one; a program that asks again meanwhile is told that it goes on, and the vehicle is not asked
//! twice.
//!
//! | asked for | has happened when |
//! |---|---|
//! | arming | it is armed |
//! | disarming, motors off | it is disarmed; in the air disarming lands first, and goes on meanwhile |
//! | take-off | it rises or flies |
//! | landing | it lands or is disarmed |
//! | hold, return | a program has authority, and it does not land |
//! | guided mode | the same, or it is disarmed: then the next arming by a program is guided |
//!
//! What has not happened after [`SOON`] has failed, with a text why.

use super::client::{Client, Put};
use super::commands::acknowledge;
use crate::cockpit::Cockpit;
use crate::mission::Runner;
use crate::refusal::Seat;
use core::fmt::{self, Write};
use heapless::{String, Vec};
use stampfly_link::mavlink::dialects::common::{MavResult, MavSeverity};
use stampfly_types::messages::{CommandSource, FlightPhase, FlightStatus, GuidedCommand, GuidedKind};
use stampfly_types::{Duration, Instant, Vec3};

/// Commands that are waited for at once. A program that asks for more is told to try later, unless
/// it ends a flight.
const AT_ONCE: usize = 3;
/// A vehicle that has not done it after this long does not. Programs send a command again after
/// half a second, and three times in all.
const SOON: Duration = Duration::from_millis(1_500);
/// No landing takes longer.
const LANDING: Duration = Duration::from_secs(60);
/// Between two acknowledgements that it goes on.
const AGAIN: Duration = Duration::from_millis(500);
/// The vehicle's state says no more.
const NOT_NOW: &str = "the vehicle does not do it now";
/// How far it is, is not known.
const UNKNOWN: u8 = u8::MAX;

/// What a command asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Deed {
    Arm,
    Disarm,
    Kill,
    TakeOff,
    Land,
    Hold,
    Guided,
    Return,
}

/// A line of the table: the text of a denial, the command to the vehicle, and when it has happened.
type Line = (&'static str, GuidedKind, fn(&FlightStatus) -> bool);

impl Deed {
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
        }
    }

    /// The text of a denial.
    pub const fn denied(self) -> &'static str {
        self.line().0
    }

    /// What the vehicle is asked for. A take-off has a height besides, a return a place.
    pub fn command(self) -> GuidedCommand {
        GuidedCommand { kind: self.line().1, ..Default::default() }
    }

    pub fn has_happened(self, status: &FlightStatus) -> bool {
        let (_, _, has_happened) = self.line();
        has_happened(status)
    }

    /// It ends a flight: nothing may keep it from the vehicle.
    pub const fn ends_a_flight(self) -> bool {
        matches!(self, Self::Disarm | Self::Kill | Self::Land)
    }

    /// What speaks against it before the vehicle is asked.
    pub fn refusal(self, status: &FlightStatus) -> Option<&'static str> {
        match self {
            Self::TakeOff | Self::Hold | Self::Return if !status.armed => Some("motors are off"),
            Self::Return if status.phase != FlightPhase::Flying => Some("it does not fly"),
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

/// A take-off to this height, m.
pub(super) fn take_off(height: f32) -> GuidedCommand {
    GuidedCommand { position: Vec3::new(0.0, 0.0, -height), ..Deed::TakeOff.command() }
}

/// Who asks, over which connection, by which system and component and with which number of a
/// command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Asked<C> {
    pub client: C,
    pub asker: [u8; 2],
    pub number: u16,
    pub deed: Deed,
}

/// Of a take-off: does it wait until the vehicle is armed?
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rise {
    /// The vehicle was asked.
    Asked,
    /// It will be asked to rise to this height, m.
    Waits(f32),
    /// Another command has ended it.
    Void,
}

/// One that is waited for.
#[derive(Clone, Copy, Debug)]
struct Order<C> {
    asked: Asked<C>,
    seat: Seat,
    rise: Rise,
    since: Instant,
    /// How often it was told that it goes on.
    told: u8,
    /// Refusals to arm that there were before.
    refused: u32,
}

/// Those that are waited for.
#[derive(Clone, Debug)]
pub(super) struct Orders<C> {
    all: Vec<Order<C>, AT_ONCE>,
}

/// How far one is.
enum Fate {
    Waits,
    GoesOn,
    Done,
    /// With the reason for people, unless they are told it elsewhere.
    Denied(Option<&'static str>),
    Failed,
}

impl<C: Copy + PartialEq> Orders<C> {
    pub const fn new() -> Self {
        Self { all: Vec::new() }
    }

    pub fn is_full(&self) -> bool {
        self.all.is_full()
    }

    /// Is it waited for already? Sent again, it is not done again.
    pub fn has(&self, asked: &Asked<C>) -> bool {
        self.all.iter().any(|order| order.asked == *asked)
    }

    /// Is the vehicle about to arm?
    pub fn is_arming(&self) -> bool {
        self.all.iter().any(|order| order.asked.deed == Deed::Arm)
    }

    /// A command has come that ends flights: one that has not begun does not begin.
    pub fn end(&mut self) {
        for order in self.all.iter_mut().filter(|order| matches!(order.rise, Rise::Waits(_))) {
            order.rise = Rise::Void;
        }
    }

    /// Waits for it. `false` when there is no room.
    pub fn wait(&mut self, now: Instant, asked: Asked<C>, seat: Seat, rise: Rise, cockpit: &dyn Cockpit) -> bool {
        let refused = refusals(cockpit);
        self.all.push(Order { asked, seat, rise, since: now, told: 0, refused }).is_ok()
    }

    /// Looks what has happened, and acknowledges it. Call it about fifty times a second.
    pub fn poll(
        &mut self,
        now: Instant,
        clients: &mut [Client<C>],
        cockpit: &mut dyn Cockpit,
        runner: &mut Runner,
        put: Put<'_, C>,
    ) {
        let is_arming = self.is_arming();
        self.all.retain_mut(|order| {
            let Asked { client, asker, number, deed } = order.asked;
            // The program is gone.
            let Some(client) = clients.iter_mut().find(|known| known.id == client) else { return false };
            let fate = order.look(now, is_arming, cockpit, runner);
            let result = match fate {
                Fate::Waits => return true,
                Fate::GoesOn => MavResult::MAV_RESULT_IN_PROGRESS,
                Fate::Done => MavResult::MAV_RESULT_ACCEPTED,
                Fate::Denied(why) => {
                    why.into_iter().for_each(|why| say(client, deed.denied(), &why, put));
                    MavResult::MAV_RESULT_DENIED
                }
                Fate::Failed => {
                    let status = cockpit.view().state();
                    let why = if deed == Deed::Arm { NOT_NOW } else { why_not(&status) };
                    say(client, deed.denied(), &why, put);
                    MavResult::MAV_RESULT_FAILED
                }
            };
            let goes_on = matches!(fate, Fate::GoesOn);
            acknowledge(client, number, asker, (result, if goes_on { UNKNOWN } else { 0 }), put);
            goes_on
        });
    }
}

impl<C> Order<C> {
    fn look(&mut self, now: Instant, is_arming: bool, cockpit: &mut dyn Cockpit, runner: &mut Runner) -> Fate {
        let (status, deed) = (cockpit.view().state(), self.asked.deed);
        let waited = now.since(self.since);
        match self.rise {
            Rise::Asked => {}
            Rise::Waits(height) if status.armed => return self.rise(now, height, cockpit, runner),
            Rise::Waits(_) if is_arming => return Fate::Waits,
            Rise::Waits(_) => return Fate::Denied(Some("motors are off")),
            Rise::Void => return Fate::Denied(Some("another command has ended it")),
        }
        if deed.has_happened(&status) {
            return Fate::Done;
        }
        if deed == Deed::Arm && refusals(cockpit) != self.refused {
            // Every station is told the reasons.
            return Fate::Denied(None);
        }
        let lands = deed == Deed::Disarm && status.phase == FlightPhase::Landing;
        if waited >= if lands { LANDING } else { SOON } {
            return Fate::Failed;
        }
        if lands && waited >= AGAIN * self.told.into() {
            self.told = self.told.saturating_add(1);
            return Fate::GoesOn;
        }
        Fate::Waits
    }

    /// It is armed: asks for the take-off that has waited for it.
    fn rise(&mut self, now: Instant, height: f32, cockpit: &mut dyn Cockpit, runner: &mut Runner) -> Fate {
        if cockpit.guide(now, self.seat, take_off(height)).is_err() {
            return Fate::Denied(Some("the vehicle takes no command"));
        }
        runner.halt();
        (self.rise, self.since) = (Rise::Asked, now);
        Fate::Waits
    }
}

fn refusals(cockpit: &dyn Cockpit) -> u32 {
    cockpit.view().refusals().map_or(0, |(_, refusals)| refusals.attempts)
}

/// Why a vehicle in this state does not do something, as far as its state says so.
pub(super) fn why_not(status: &FlightStatus) -> &'static str {
    match status {
        status if !status.armed => status.blocks.names().next().unwrap_or("motors are off"),
        FlightStatus { phase: FlightPhase::Landing, .. } => "it lands",
        FlightStatus { commander: CommandSource::Pilot, .. } => "a pilot flies",
        FlightStatus { commander: CommandSource::Failsafe, .. } => "the failsafe flies",
        _ => NOT_NOW,
    }
}

/// Says to people why something is not done.
// By itself: its room for a sentence is on the stack once.
#[inline(never)]
pub(super) fn say<C>(client: &mut Client<C>, what: &str, why: &dyn fmt::Display, put: Put<'_, C>) {
    let mut sentence = String::<96>::new();
    // A sentence that is too long is cut.
    _ = write!(sentence, "{what}: {why}");
    client.say(MavSeverity::MAV_SEVERITY_ERROR, &sentence, put);
}
