//! Commands, and what becomes of each.
//!
//! What changes the vehicle's state is acknowledged when it [has happened](crate::goal); arming
//! that would be refused is denied at once, with the reasons as texts. What a program may ask for
//! while another one commands is the [lease](crate::lease)'s decision, acknowledged as
//! `NOT_IN_CONTROL`.

use super::calibration::Calibrating;
use super::client::{Client, Put};
use super::identity::Own;
use super::leading::Leading;
use super::missions::Missions;
use super::orders::{Asked, Orders, Rise, say, take_off};
use super::streams::{STREAMS, make, text};
use super::unserved::Unserved;
use crate::access::{Request, VehicleAccess};
use crate::goal::CommandGoal;
use crate::refusal::{Refusal, Requester};
use stampfly_link::mavlink::MessageData;
use stampfly_link::mavlink::dialects::common::*;
use stampfly_types::messages::{ArmBlocks, FlightStatus, GuidedCommand};
use stampfly_types::{Duration, Instant, Vec3};

/// A command with its parameters, however it came. Positions of `COMMAND_INT` are whole numbers of units that only a place on
/// Earth needs, so none is taken from them.
pub(super) struct Command {
    kind: MavCmd,
    /// The first is number 1.
    parameters: [f32; 7],
    /// It is sent again, because no acknowledgement has come.
    is_repeated: bool,
}

impl From<&COMMAND_LONG_DATA> for Command {
    fn from(command: &COMMAND_LONG_DATA) -> Self {
        let COMMAND_LONG_DATA { param1, param2, param3, param4, param5, param6, param7, command: kind, .. } = *command;
        let parameters = [param1, param2, param3, param4, param5, param6, param7];
        Self { kind, parameters, is_repeated: command.confirmation > 0 }
    }
}

/// Obeyed as the command that has superseded it, and acknowledged as that, as PX4 does. PX4 has
/// main mode and sub-mode in the upper two bytes of its own modes.
impl From<&SET_MODE_DATA> for Command {
    fn from(mode: &SET_MODE_DATA) -> Self {
        let [_, _, main, sub] = mode.custom_mode.to_le_bytes().map(f32::from);
        let flags = f32::from(mode.base_mode.bits());
        let parameters = [flags, main, sub, 0.0, 0.0, 0.0, 0.0];
        Self { kind: MavCmd::MAV_CMD_DO_SET_MODE, parameters, is_repeated: false }
    }
}

impl From<&COMMAND_INT_DATA> for Command {
    fn from(command: &COMMAND_INT_DATA) -> Self {
        let COMMAND_INT_DATA { param1, param2, param3, param4, x, y, z, command: kind, .. } = *command;
        // A calibration has no position, so they are what they are.
        let [x, y] = match kind {
            MavCmd::MAV_CMD_PREFLIGHT_CALIBRATION => [x as f32, y as f32],
            _ => [f32::NAN; 2],
        };
        Self { kind, parameters: [param1, param2, param3, param4, x, y, z], is_repeated: false }
    }
}

impl Command {
    /// Landing, disarming, motors off.
    pub fn ends_a_flight(&self) -> bool {
        match self.kind {
            MavCmd::MAV_CMD_NAV_LAND | MavCmd::MAV_CMD_DO_FLIGHTTERMINATION => true,
            MavCmd::MAV_CMD_COMPONENT_ARM_DISARM => self.parameters.first().is_some_and(|arms| *arms == 0.0),
            _ => false,
        }
    }
}

/// A whole number in a parameter, which MAVLink has as a float: as large as a float still tells apart from the next.
fn whole(number: f32) -> Option<u32> {
    (number.is_finite() && (0.0..=16_777_215.0).contains(&number)).then_some(number as u32)
}

/// Why an item cannot be the next one.
pub(super) const NO_ITEM: &str = "the mission has no such item";

/// What a command meets: the vehicle, who asks, and where answers go.
pub(super) struct Turn<'t, 'p, C, const ITEMS: usize> {
    pub now: Instant,
    pub own: &'t Own,
    /// System and component that asks.
    pub asker: [u8; 2],
    pub client: &'t mut Client<C>,
    pub missions: &'t mut Missions<C, ITEMS>,
    pub calibrating: &'t mut Calibrating<C>,
    pub orders: &'t mut Orders<C>,
    pub leading: &'t mut Leading<C>,
    pub requester: Requester,
    pub access: &'t mut dyn VehicleAccess,
    pub put: Put<'p, C>,
}

/// Carries a command out, and acknowledges it, now or when it has happened.
pub(super) fn obey<C: Copy + PartialEq, const ITEMS: usize>(mut turn: Turn<'_, '_, C, ITEMS>, command: &Command) {
    let number = command.kind as u16;
    let result = if command.kind == MavCmd::MAV_CMD_PREFLIGHT_CALIBRATION {
        let Turn { now, client, asker, calibrating, access, put, .. } = &mut turn;
        calibrating.ask(*now, client, *asker, &command.parameters, &mut **access, &mut **put).err()
    } else {
        turn.outcome(number, command)
    };
    if let Some(result) = result {
        let progress = if result == MavResult::MAV_RESULT_IN_PROGRESS { u8::MAX } else { 0 };
        acknowledge(turn.client, number, turn.asker, (result, progress), turn.put);
    }
}

/// Says that a command that this dialect does not have is not supported.
pub(super) fn refuse<C>(client: &mut Client<C>, number: u16, asker: [u8; 2], put: Put<'_, C>) {
    acknowledge(client, number, asker, (MavResult::MAV_RESULT_UNSUPPORTED, 0), put);
}

/// Says to who has asked what has become of the command with this number, and how far it is in per
/// cent.
///
/// Written as bytes, because the dialect has not every number: the command, its result, the
/// progress, four bytes of no meaning here, and the addressee.
pub(super) fn acknowledge<C>(
    client: &mut Client<C>,
    number: u16,
    [system, component]: [u8; 2],
    (result, progress): (MavResult, u8),
    put: Put<'_, C>,
) {
    let [low, high] = number.to_le_bytes();
    let payload = [low, high, result as u8, progress, 0, 0, 0, 0, system, component];
    client.send_payload(COMMAND_ACK_DATA::ID, &payload, put);
}

impl<C: Copy + PartialEq, const ITEMS: usize> Turn<'_, '_, C, ITEMS> {
    /// What becomes of a command. `None`: it is acknowledged when it has happened.
    fn outcome(&mut self, number: u16, command: &Command) -> Option<MavResult> {
        let Command { kind, parameters: [p1, p2, p3, .., p7], is_repeated } = command;
        let status = self.access.view().state();
        // A mission may have begun since the acknowledgement that was lost: it is not ended.
        let is_done = |goal: CommandGoal| *is_repeated && goal.has_happened(&status);
        Some(match kind {
            MavCmd::MAV_CMD_COMPONENT_ARM_DISARM if *p1 == 1.0 && is_done(CommandGoal::Arm) => {
                MavResult::MAV_RESULT_ACCEPTED
            }
            MavCmd::MAV_CMD_NAV_TAKEOFF if is_done(CommandGoal::TakeOff) => MavResult::MAV_RESULT_ACCEPTED,
            MavCmd::MAV_CMD_COMPONENT_ARM_DISARM if *p1 == 1.0 => return self.does(number, CommandGoal::Arm, *p7),
            MavCmd::MAV_CMD_COMPONENT_ARM_DISARM if *p1 == 0.0 => {
                // 21196 says "whatever it does": motors off.
                let force = *p2 == 21_196.0;
                return self.does(number, if force { CommandGoal::Kill } else { CommandGoal::Disarm }, *p7);
            }
            MavCmd::MAV_CMD_DO_FLIGHTTERMINATION if *p1 == 1.0 => return self.does(number, CommandGoal::Kill, *p7),
            MavCmd::MAV_CMD_NAV_TAKEOFF => return self.does(number, CommandGoal::TakeOff, *p7),
            MavCmd::MAV_CMD_NAV_LAND => return self.does(number, CommandGoal::Land, *p7),
            MavCmd::MAV_CMD_NAV_LOITER_UNLIM => return self.does(number, CommandGoal::Hold, *p7),
            MavCmd::MAV_CMD_NAV_RETURN_TO_LAUNCH => return self.does(number, CommandGoal::Return, *p7),
            MavCmd::MAV_CMD_DO_SET_MODE => return self.set_mode(number, [*p1, *p2, *p3]),
            MavCmd::MAV_CMD_MISSION_START => match whole(*p1) {
                Some(0) => self.start_mission(),
                // Another first item than the first.
                Some(place) if self.missions.set_current(place as usize) => self.start_mission(),
                _ => {
                    self.not_started(&NO_ITEM);
                    MavResult::MAV_RESULT_DENIED
                }
            },
            MavCmd::MAV_CMD_DO_PAUSE_CONTINUE if *p1 == 0.0 => return self.does(number, CommandGoal::Hold, *p7),
            MavCmd::MAV_CMD_DO_PAUSE_CONTINUE if *p1 == 1.0 => self.start_mission(),
            MavCmd::MAV_CMD_DO_SET_MISSION_CURRENT => {
                match whole(*p1).is_some_and(|place| self.missions.set_current(place as usize)) {
                    true => MavResult::MAV_RESULT_ACCEPTED,
                    false => {
                        say(self.client, "not the current item", &NO_ITEM, self.put);
                        MavResult::MAV_RESULT_DENIED
                    }
                }
            }
            MavCmd::MAV_CMD_REQUEST_MESSAGE => whole(*p1).map_or(MavResult::MAV_RESULT_UNSUPPORTED, |id| self.show(id)),
            MavCmd::MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES => self.show(AUTOPILOT_VERSION_DATA::ID),
            MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL => set_interval(self.now, self.client, *p1, *p2),
            MavCmd::MAV_CMD_PREFLIGHT_STORAGE if *p1 == 1.0 => self.request(Request::SaveParameters),
            MavCmd::MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN if *p1 == 1.0 => self.request(Request::Restart),
            // Type 0 is a throttle in per cent.
            MavCmd::MAV_CMD_DO_MOTOR_TEST if *p2 == 0.0 && (0.0..=100.0).contains(p3) => {
                let motor = whole(*p1).and_then(|motor| u8::try_from(motor).ok()).unwrap_or(0);
                self.request(match *p3 > 0.0 {
                    true => Request::TestMotor { motor, duty: p3 / 100.0 },
                    false => Request::StopMotor,
                })
            }
            _ => MavResult::MAV_RESULT_UNSUPPORTED,
        })
    }

    /// Asks the vehicle for something that changes its state. `None`: it is acknowledged when that
    /// has happened. A take-off has a height, m.
    fn does(&mut self, number: u16, goal: CommandGoal, height: f32) -> Option<MavResult> {
        let status = self.access.view().state();
        let asked = Asked { client: self.client.id, asker: self.asker, number, goal };
        if self.orders.has(&asked) {
            if goal.ends_a_flight() {
                // Twice is once, and the first may have been lost on a radio.
                _ = self.ask_for(goal, height);
            }
            return Some(MavResult::MAV_RESULT_IN_PROGRESS);
        }
        if self.orders.is_full() && !goal.ends_a_flight() {
            say(self.client, goal.denied(), &"too many commands at once", self.put);
            return Some(MavResult::MAV_RESULT_TEMPORARILY_REJECTED);
        }
        let height = if height.is_finite() && height > 0.0 { height } else { self.own.identity.take_off_height };
        if goal == CommandGoal::TakeOff && !status.armed && self.orders.is_arming() {
            // Sent together with the command to arm: it waits for that.
            self.orders.wait(self.now, asked, self.requester, Rise::Waits(height), self.access);
            return None;
        }
        if goal == CommandGoal::Arm && self.is_blocked(&status) {
            return Some(MavResult::MAV_RESULT_DENIED);
        }
        if let Some(why) = goal.refusal(&status) {
            say(self.client, goal.denied(), &why, self.put);
            return Some(MavResult::MAV_RESULT_DENIED);
        }
        if let Err(refusal) = self.ask_for(goal, height) {
            say(self.client, goal.denied(), &refusal, self.put);
            return Some(result(Err(refusal)));
        }
        if goal.has_happened(&status) {
            return Some(MavResult::MAV_RESULT_ACCEPTED);
        }
        // The vehicle was asked; without room to wait, the program asks again and hears how it
        // stands.
        let waits = self.orders.wait(self.now, asked, self.requester, Rise::Asked, self.access);
        (!waits).then_some(MavResult::MAV_RESULT_IN_PROGRESS)
    }

    /// Would arming be refused? Then every reason is said. Silence of all programs is none: the
    /// command ends it.
    fn is_blocked(&mut self, status: &FlightStatus) -> bool {
        let blocks = status.blocks.without(ArmBlocks::NO_LINK);
        if status.armed || blocks.is_empty() {
            return false;
        }
        for name in blocks.names() {
            self.client.send(&text(MavSeverity::MAV_SEVERITY_ERROR, "not armed: ", name), self.put);
        }
        true
    }

    /// Asks the vehicle. Whatever else was asked of it, a mission included, is over then.
    fn ask_for(&mut self, goal: CommandGoal, height: f32) -> Result<(), Refusal> {
        match goal {
            CommandGoal::TakeOff => self.access.guide(self.now, self.requester, take_off(height))?,
            CommandGoal::Return => {
                let down = self.access.view().estimate().map_or(0.0, |(_, estimate)| estimate.position.z);
                let home = GuidedCommand { position: Vec3::new(0.0, 0.0, down), ..goal.command() };
                self.access.fly_to(self.now, self.requester, home)?;
            }
            _ => self.access.guide(self.now, self.requester, goal.command())?,
        }
        match goal {
            CommandGoal::Arm => self.missions.runner.arms(self.now),
            _ => {
                self.missions.runner.halt();
                self.leading.stop();
            }
        }
        if goal.ends_a_flight() {
            self.orders.end();
        }
        Ok(())
    }

    fn request(&mut self, request: Request) -> MavResult {
        let asked = self.access.request(self.now, request);
        if let Err(refusal) = &asked {
            say(self.client, "denied", refusal, self.put);
        }
        result(asked)
    }

    fn start_mission(&mut self) -> MavResult {
        if self.missions.is_empty() {
            self.not_started(&"there is none");
            return MavResult::MAV_RESULT_DENIED;
        }
        // Takes the lease, or says who has it.
        let asked = self.access.guide(self.now, self.requester, GuidedCommand::default());
        if let Err(refusal) = asked {
            self.not_started(&refusal);
            return result(asked);
        }
        match self.missions.runner.start(self.now, self.requester, self.access) {
            Ok(()) => {
                self.leading.stop();
                self.client.send(&self.missions.state(), self.put);
                MavResult::MAV_RESULT_ACCEPTED
            }
            Err(why) => {
                self.not_started(&why);
                MavResult::MAV_RESULT_DENIED
            }
        }
    }

    fn not_started(&mut self, why: &dyn core::fmt::Display) {
        say(self.client, "mission not started", why, self.put);
    }

    /// Modes have numbers of their own in every autopilot. Understood are MAVLink's own flags, "auto" for a mission and "guided" for staying in place, and
    /// the numbers of PX4 (main modes 4, "auto", and 6, "offboard"), which programs send to
    /// whatever is not ArduPilot.
    fn set_mode(&mut self, number: u16, [flags, main, sub]: [f32; 3]) -> Option<MavResult> {
        let flags = whole(flags).and_then(|flags| u8::try_from(flags).ok()).map(MavModeFlag::from_bits_truncate);
        let Some(flags) = flags else { return Some(MavResult::MAV_RESULT_DENIED) };
        let custom = flags.contains(MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED);
        match (whole(main), whole(sub)) {
            (Some(4), Some(3)) if custom => self.does(number, CommandGoal::Guided, 0.0),
            (Some(4), Some(4)) if custom => Some(self.start_mission()),
            (Some(4), Some(5)) if custom => self.does(number, CommandGoal::Return, 0.0),
            (Some(4), Some(6)) if custom => self.does(number, CommandGoal::Land, 0.0),
            // Set-points are flown in no mode of their own; programs ask for one before they send
            // them.
            (Some(6), _) if custom => self.does(number, CommandGoal::Guided, 0.0),
            _ if custom => self.no_such_mode(),
            _ if flags.contains(MavModeFlag::MAV_MODE_FLAG_AUTO_ENABLED) => Some(self.start_mission()),
            _ if flags.contains(MavModeFlag::MAV_MODE_FLAG_GUIDED_ENABLED) => {
                self.does(number, CommandGoal::Guided, 0.0)
            }
            _ => self.no_such_mode(),
        }
    }

    fn no_such_mode(&mut self) -> Option<MavResult> {
        self.client.complain(Unserved::Mode, &"this vehicle does not have it", self.put);
        Some(MavResult::MAV_RESULT_UNSUPPORTED)
    }

    /// Sends one message.
    fn show(&mut self, id: u32) -> MavResult {
        let message = match id {
            MISSION_CURRENT_DATA::ID => Some(self.missions.state()),
            _ => make(id, self.now, self.own, &self.access.view()),
        };
        let Some(message) = message else { return MavResult::MAV_RESULT_UNSUPPORTED };
        self.client.send(&message, self.put);
        MavResult::MAV_RESULT_ACCEPTED
    }
}

fn result(asked: Result<(), Refusal>) -> MavResult {
    match asked {
        Ok(()) => MavResult::MAV_RESULT_ACCEPTED,
        Err(Refusal::Occupied(_) | Refusal::PilotFlies) => MavResult::MAV_RESULT_NOT_IN_CONTROL,
        Err(Refusal::Full) => MavResult::MAV_RESULT_TEMPORARILY_REJECTED,
        Err(Refusal::Range | Refusal::Armed) => MavResult::MAV_RESULT_DENIED,
        Err(Refusal::Unsupported) => MavResult::MAV_RESULT_UNSUPPORTED,
    }
}

/// 0 asks for the stream's own interval, −1 for none.
fn set_interval<C>(now: Instant, client: &mut Client<C>, id: f32, interval_us: f32) -> MavResult {
    let place = whole(id).and_then(|id| STREAMS.iter().position(|stream| stream.id == id));
    let Some((due, stream)) = place.and_then(|place| Some((client.due.get_mut(place)?, STREAMS.get(place)?))) else {
        return MavResult::MAV_RESULT_UNSUPPORTED;
    };
    due.every = match whole(interval_us) {
        Some(0) => stream.every,
        // Not more often than the vehicle is asked what is due.
        Some(micros) => Some(Duration::from_micros(u64::from(micros).max(20_000))),
        None if interval_us == -1.0 => None,
        None => return MavResult::MAV_RESULT_DENIED,
    };
    due.next = now;
    MavResult::MAV_RESULT_ACCEPTED
}
