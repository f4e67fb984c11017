//! Who commands a vehicle behind `connect`: which page, and which program.
//!
//! At the vehicle's end all pages are one station, and programs of the same system and component
//! number are one. So this end tells them apart: pages ask a [`CommandArbiter`], as at the ports of a
//! simulated vehicle, and numbers belong to the connection that has used them first. What others
//! say with them does not keep a vehicle in the air whose commander has left.

#![allow(deprecated, reason = "programs speak what the protocol has superseded for years after")]

use stampfly_link::mavlink::MessageData;
use stampfly_link::mavlink::dialects::common::*;
use stampfly_services::{CommandArbiter, Passed, Refusal, Requester};
use stampfly_sim::ask::{Ask, Guided};
use stampfly_sim::vehicle::Client;
use stampfly_types::messages::{FlightStatus, GuidedCommand, PilotInput};
use stampfly_types::{Duration, Instant};
use std::collections::HashMap;

/// Numbers are free when the connection that has used them was not heard for this long: the vehicle
/// has taken its link for lost by then.
const FREE: Duration = Duration::from_secs(4);
/// What a program may ask with the numbers of another: what changes nothing, and is no sign of
/// life.
const READS: [u32; 6] = [
    PARAM_REQUEST_LIST_DATA::ID,
    PARAM_REQUEST_READ_DATA::ID,
    MISSION_REQUEST_LIST_DATA::ID,
    MISSION_REQUEST_DATA::ID,
    MISSION_REQUEST_INT_DATA::ID,
    TIMESYNC_DATA::ID,
];

/// Who commands.
#[derive(Debug, Default)]
pub(super) struct Crew {
    arbiter: CommandArbiter,
    /// Systems and components, who uses them, and when they were last heard.
    numbers: HashMap<[u8; 2], (Client, Instant)>,
    /// The vehicle's newest.
    status: FlightStatus,
}

impl Crew {
    /// What goes to the vehicle when a page asks this. `None`: it is to be left out, and needs no answer.
    ///
    /// # Errors
    /// When another page commands.
    pub fn ask(&mut self, now: Instant, page: u64, ask: &Ask) -> Result<Option<Ask>, Refusal> {
        self.keep(now);
        let requester = Requester::Page(page as u32);
        match ask {
            Ask::Guided(guided) => {
                self.arbiter.guide(now, requester, GuidedCommand::from(*guided), &mut |_| Ok(()))?;
            }
            Ask::Sticks(sticks) => {
                let mut passed = None;
                // A page sends its sticks as long as it is open, and knows from the commander's name that they do not fly.
                _ = self.arbiter.steer(now, requester, &PilotInput::from(*sticks), &self.status, &mut |what| {
                    passed = Some(what);
                    Ok(())
                });
                return Ok(passed.map(|passed| match passed {
                    Passed::Sticks(_) => ask.clone(),
                    // Its arm switch was turned off while another flies.
                    Passed::Command(_) => Ask::Guided(Guided::Land {}),
                }));
            }
            Ask::Alive {} if !self.arbiter.alive(now, requester) => return Ok(None),
            _ => {}
        }
        Ok(Some(ask.clone()))
    }

    /// Time goes on: the lease ends with the flight.
    pub fn keep(&mut self, now: Instant) {
        self.arbiter.keep(now, self.status.armed, &mut |_| Ok(()));
    }

    /// Who commands, as far as it is known here: a page and its number, or in words. Empty when none
    /// does.
    pub fn commander(&self, now: Instant) -> (String, Option<u64>) {
        match self.arbiter.holder(now) {
            Some(requester @ Requester::Page(number)) => (requester.to_string(), Some(number.into())),
            // No page had the lease: if the vehicle is led, it is led by a program.
            _ if self.arbiter.taker().is_none() => ("another program".to_owned(), None),
            _ => (String::new(), None),
        }
    }

    /// This page is gone.
    pub fn leave(&mut self, page: u64) {
        self.arbiter.leave(|requester| requester == Requester::Page(page as u32));
    }

    /// The vehicle is in this state. With motors off there is nothing to hold.
    pub const fn see(&mut self, status: FlightStatus) {
        self.status = status;
    }

    /// Does a frame with this number ask for something that the vehicle must not do late?
    pub fn is_order(id: u32) -> bool {
        id != HEARTBEAT_DATA::ID && !READS.contains(&id)
    }

    /// May this frame of a program go to the vehicle?
    pub fn may(&mut self, now: Instant, program: Client, numbers: [u8; 2], id: u32) -> bool {
        let (owner, heard) = self.numbers.entry(numbers).or_insert((program, now));
        // To the vehicle the next one is the same: a sign of life would keep in the air what its
        // commander has left, so that in flight only an order takes over.
        if *owner != program && now.since(*heard) >= FREE && (!self.status.armed || Self::is_order(id)) {
            *owner = program;
        }
        if *owner == program {
            *heard = now;
        }
        *owner == program || READS.contains(&id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_sim::ask::Sticks;

    fn program(number: u16) -> Client {
        Client { port: 2, address: ([127, 0, 0, 1], number).into() }
    }

    #[test]
    fn numbers_are_of_one_connection_until_it_is_gone_and_in_flight_until_another_commands() {
        let ids = [255, 190];
        let (beats, orders) = (HEARTBEAT_DATA::ID, COMMAND_LONG_DATA::ID);
        for is_armed in [false, true] {
            let mut crew = Crew::default();
            crew.see(FlightStatus { armed: is_armed, ..FlightStatus::default() });
            let mut may = |ms, number, id| crew.may(Instant::from_millis(ms), program(number), ids, id);
            for ms in (0..5_000).step_by(1_000) {
                assert!(may(ms, 1, beats) && !may(ms + 500, 2, beats) && !may(ms + 501, 2, orders));
            }
            // It is gone. The other chatters on, and is not heard before the vehicle's own patience
            // is over; in flight not at all.
            for ms in (5_000..8_000).step_by(500) {
                assert!(!may(ms, 2, beats) && !may(ms, 2, orders), "{ms} ms");
            }
            for ms in (8_000..20_000).step_by(500) {
                assert_eq!(may(ms, 2, beats), !is_armed, "{ms} ms");
            }
            assert!(may(20_000, 2, orders) && may(20_100, 2, beats) && !may(20_100, 1, beats));
            assert!(may(20_200, 1, PARAM_REQUEST_READ_DATA::ID));
            assert!(crew.may(Instant::from_millis(20_200), program(1), [254, 190], beats));
        }
    }

    #[test]
    fn one_page_commands_and_a_page_that_watches_is_no_sign_of_life_for_it() {
        let mut crew = Crew::default();
        let (arm, sticks) = (Ask::Guided(Guided::Arm {}), Ask::Sticks(Sticks::default()));
        let at = |seconds| Instant::from_secs(seconds);
        assert_eq!(crew.ask(at(0), 2, &Ask::Alive {}), Ok(Some(Ask::Alive {})), "none commands yet");
        assert_eq!(crew.ask(at(0), 1, &arm), Ok(Some(arm.clone())));
        crew.see(FlightStatus { armed: true, ..FlightStatus::default() });
        assert_eq!(crew.ask(at(0), 1, &arm), Ok(Some(arm.clone())));
        assert_eq!(crew.ask(at(1), 2, &arm), Err(Refusal::Occupied(Requester::Page(1))));
        for (page, passes) in [(1, true), (2, false)] {
            assert_eq!(crew.ask(at(1), page, &Ask::Alive {}).map(|ask| ask.is_some()), Ok(passes));
            assert_eq!(crew.ask(at(1), page, &sticks).map(|ask| ask.is_some()), Ok(passes));
        }
        crew.leave(1);
        for seconds in 2..20 {
            for silent in [&Ask::Alive {}, &sticks] {
                assert_eq!(crew.ask(at(seconds), 2, silent), Ok(None));
            }
        }
        for stops in [Guided::Kill {}, Guided::Land {}] {
            assert_eq!(crew.ask(at(20), 2, &Ask::Guided(stops)), Ok(Some(Ask::Guided(stops))));
        }
        assert_eq!(crew.ask(at(20), 2, &sticks), Ok(Some(sticks)), "it has taken over");
        crew.see(FlightStatus::default());
        assert_eq!(crew.ask(at(21), 3, &arm), Ok(Some(arm)));
    }

    /// A page with sticks sends them as long as it is open.
    #[test]
    fn sticks_at_rest_on_one_page_do_not_keep_another_from_arming() {
        let mut crew = Crew::default();
        let idle = Ask::Sticks(Sticks::default());
        for ms in (0..5_000).step_by(20) {
            assert_eq!(crew.ask(Instant::from_millis(ms), 2, &idle), Ok(Some(idle.clone())));
        }
        let now = Instant::from_secs(5);
        assert_eq!(crew.ask(now, 1, &Ask::Guided(Guided::Arm {})), Ok(Some(Ask::Guided(Guided::Arm {}))));
        // The vehicle's state comes later than what was asked: nothing is held yet.
        assert_eq!(crew.ask(now, 2, &idle), Ok(Some(idle.clone())), "it stands");
        crew.see(FlightStatus { armed: true, ..FlightStatus::default() });
        assert_eq!(crew.ask(now, 2, &idle), Ok(Some(idle.clone())), "it rests");
        let rise = Ask::Guided(Guided::TakeOff { height: 0.5 });
        assert_eq!(crew.ask(now, 1, &rise), Ok(Some(rise)));
        assert_eq!(crew.ask(now, 2, &idle), Ok(None), "another commands");
    }

    #[test]
    fn an_arm_switch_that_is_turned_off_on_another_page_lands_the_vehicle() {
        let mut crew = Crew::default();
        let now = Instant::from_secs(5);
        assert!(crew.ask(now, 1, &Ask::Guided(Guided::Arm {})).is_ok());
        crew.see(FlightStatus { armed: true, ..FlightStatus::default() });
        assert!(crew.ask(now, 1, &Ask::Guided(Guided::Hold {})).is_ok());
        let sticks = |arm| Ask::Sticks(Sticks { arm, ..Sticks::default() });
        assert_eq!(crew.ask(now, 2, &sticks(true)), Ok(None));
        assert_eq!(crew.ask(now, 2, &sticks(false)), Ok(Some(Ask::Guided(Guided::Land {}))));
    }
}
