//! Commands that change the vehicle's state, each acknowledged when it is seen to have happened.
//!
//! What a program sends next depends on what the first command has done. So the acknowledgement waits
//! until the [goal](crate::goal) is seen. Nothing is said meanwhile, because many programs take the
//! first acknowledgement for the last one; a program that asks again meanwhile is told that it goes
//! on, and the vehicle is not asked twice.

use super::client::{Client, Put};
use super::commands::acknowledge;
use crate::access::VehicleAccess;
use crate::goal::{CommandGoal, NOT_NOW, SOON, refusals, why_not};
use crate::mission::Runner;
use crate::refusal::Requester;
use core::fmt::{self, Write};
use heapless::{String, Vec};
use stampfly_link::mavlink::dialects::common::{MavResult, MavSeverity};
use stampfly_types::messages::{FlightPhase, GuidedCommand};
use stampfly_types::{Duration, Instant, Vec3};

/// Commands that are waited for at once. A program that asks for more is told to try later.
const AT_ONCE: usize = 3;
/// More of them, for commands that end a flight.
const ENDING: usize = 3;
/// No landing takes longer.
const LANDING: Duration = Duration::from_secs(60);
/// Between two acknowledgements that it goes on.
const AGAIN: Duration = Duration::from_millis(500);
/// How far it is, is not known.
const UNKNOWN: u8 = u8::MAX;

/// A take-off to this height, m.
pub(super) fn take_off(height: f32) -> GuidedCommand {
    GuidedCommand { position: Vec3::new(0.0, 0.0, -height), ..CommandGoal::TakeOff.command() }
}

/// Who asks, over which connection, by which system and component and with which number of a
/// command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Asked<C> {
    pub client: C,
    pub asker: [u8; 2],
    pub number: u16,
    pub goal: CommandGoal,
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
    requester: Requester,
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
    all: Vec<Order<C>, { AT_ONCE + ENDING }>,
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

    /// Is there room only for commands that end a flight?
    pub fn is_full(&self) -> bool {
        self.all.len() >= AT_ONCE
    }

    /// Is it waited for already? Sent again, it is not done again.
    pub fn has(&self, asked: &Asked<C>) -> bool {
        self.all.iter().any(|order| order.asked == *asked)
    }

    /// Is the vehicle about to arm?
    pub fn is_arming(&self) -> bool {
        self.all.iter().any(|order| order.asked.goal == CommandGoal::Arm)
    }

    /// A command has come that ends flights: one that has not begun does not begin.
    pub fn end(&mut self) {
        for order in self.all.iter_mut().filter(|order| matches!(order.rise, Rise::Waits(_))) {
            order.rise = Rise::Void;
        }
    }

    /// Waits for it. `false` when there is no room.
    pub fn wait(
        &mut self,
        now: Instant,
        asked: Asked<C>,
        requester: Requester,
        rise: Rise,
        access: &dyn VehicleAccess,
    ) -> bool {
        let refused = refusals(access);
        self.all.push(Order { asked, requester, rise, since: now, told: 0, refused }).is_ok()
    }

    /// Looks what has happened, and acknowledges it. Call it about fifty times a second.
    pub fn poll(
        &mut self,
        now: Instant,
        clients: &mut [Client<C>],
        access: &mut dyn VehicleAccess,
        runner: &mut Runner,
        put: Put<'_, C>,
    ) {
        let is_arming = self.is_arming();
        self.all.retain_mut(|order| {
            let Asked { client, asker, number, goal } = order.asked;
            // The program is gone.
            let Some(client) = clients.iter_mut().find(|known| known.id == client) else { return false };
            let fate = order.look(now, is_arming, access, runner);
            let result = match fate {
                Fate::Waits => return true,
                Fate::GoesOn => MavResult::MAV_RESULT_IN_PROGRESS,
                Fate::Done => MavResult::MAV_RESULT_ACCEPTED,
                Fate::Denied(why) => {
                    why.into_iter().for_each(|why| say(client, goal.denied(), &why, put));
                    MavResult::MAV_RESULT_DENIED
                }
                Fate::Failed => {
                    let status = access.view().state();
                    let why = if goal == CommandGoal::Arm { NOT_NOW } else { why_not(&status) };
                    say(client, goal.denied(), &why, put);
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
    fn look(&mut self, now: Instant, is_arming: bool, access: &mut dyn VehicleAccess, runner: &mut Runner) -> Fate {
        let (status, goal) = (access.view().state(), self.asked.goal);
        let waited = now.since(self.since);
        match self.rise {
            Rise::Asked => {}
            Rise::Waits(height) if status.armed => return self.rise(now, height, access, runner),
            Rise::Waits(_) if is_arming => return Fate::Waits,
            Rise::Waits(_) => return Fate::Denied(Some("motors are off")),
            Rise::Void => return Fate::Denied(Some("another command has ended it")),
        }
        if goal.has_happened(&status) {
            return Fate::Done;
        }
        if goal == CommandGoal::Arm && refusals(access) != self.refused {
            // Every station is told the reasons.
            return Fate::Denied(None);
        }
        let lands = goal == CommandGoal::Disarm && status.phase == FlightPhase::Landing;
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
    fn rise(&mut self, now: Instant, height: f32, access: &mut dyn VehicleAccess, runner: &mut Runner) -> Fate {
        if access.guide(now, self.requester, take_off(height)).is_err() {
            return Fate::Denied(Some("the vehicle takes no command"));
        }
        runner.halt();
        (self.rise, self.since) = (Rise::Asked, now);
        Fate::Waits
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
