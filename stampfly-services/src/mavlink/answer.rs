//! Which message goes where.

use super::commands::{self, NO_ITEM, Turn};
use super::heard::Heard;
use super::identity::{AUTOPILOT, Own};
use super::orders::say;
use super::unreadable::Unreadable;
use super::unserved::Unserved;
use super::{parameters, streams, targets};
use stampfly_link::mavlink::MavlinkFrame;
use stampfly_link::mavlink::dialects::common::{LOG_ENTRY_DATA, MavMissionType, MavResult, PING_DATA, TIMESYNC_DATA};
use stampfly_types::Origin;
use stampfly_types::messages::{FlightMode, PilotInput};

/// Answers one message. Returns where on Earth the vehicle is, if it was told.
pub(super) fn message<C: Copy + PartialEq, const ITEMS: usize>(
    turn: Turn<'_, '_, C, ITEMS>,
    message: &Heard,
) -> Option<Origin> {
    let (now, own, requester) = (turn.now, turn.own, turn.requester);
    if turn.client.pulse.is_held() && is_an_order(message) {
        late(turn, message);
        return None;
    }
    match message {
        Heard::Heartbeat => sign_of_life(turn),
        Heard::CommandLong(command) if own.is_meant(command.target_system, command.target_component) => {
            commands::obey(turn, &commands::Command::from(command));
        }
        Heard::CommandInt(command) if own.is_meant(command.target_system, command.target_component) => {
            commands::obey(turn, &commands::Command::from(command));
        }
        Heard::SetPositionTargetLocalNed(target) if own.is_meant(target.target_system, target.target_component) => {
            targets::fly(turn, target);
        }
        Heard::SetPositionTargetGlobalInt(target) if own.is_meant(target.target_system, target.target_component) => {
            targets::fly_on_earth(turn, target);
        }
        Heard::SetAttitudeTarget(target) if own.is_meant(target.target_system, target.target_component) => {
            turn.client.complain(Unserved::Attitude, &"send places or velocities", turn.put);
        }
        Heard::SetMode(mode) if own.is_meant(mode.target_system, AUTOPILOT) => {
            commands::obey(turn, &commands::Command::from(mode));
        }
        // Which channel is which stick, and which of its ends is forward, is a matter of each
        // transmitter.
        Heard::RcChannelsOverride(channels) if own.is_meant(channels.target_system, channels.target_component) => {
            turn.client.complain(Unserved::Override, &"send MANUAL_CONTROL", turn.put);
        }
        Heard::ManualControl(sticks) if own.is_meant(sticks.target, AUTOPILOT) => {
            let share = |axis: i16| if axis == i16::MAX { 0.0 } else { f32::from(axis) / 1000.0 };
            let input = PilotInput {
                pitch: share(sticks.x),
                roll: share(sticks.y),
                // A lever from 0 to 1000, at rest in its middle.
                throttle: 2.0 * share(sticks.z) - 1.0,
                yaw: share(sticks.r),
                mode: FlightMode::PosHold,
                arm: turn.access.view().state().armed,
                kill: false,
            };
            if let Err(refusal) = turn.access.steer(now, requester, &input.cleaned()) {
                turn.client.complain(Unserved::Sticks, &refusal, turn.put);
            }
        }
        Heard::ParamRequestList(request) if own.is_meant(request.target_system, request.target_component) => {
            turn.client.next_parameter = Some(0);
        }
        Heard::ParamRequestRead(request) if own.is_meant(request.target_system, request.target_component) => {
            parameters::read(turn.client, request, turn.asker, turn.access.parameters(), turn.put);
        }
        Heard::ParamSet(request) if own.is_meant(request.target_system, request.target_component) => {
            parameters::set(turn.client, request, turn.asker, turn.access, turn.put);
        }
        Heard::SetGpsGlobalOrigin(request) if own.is_meant(request.target_system, AUTOPILOT) => {
            return set_origin(
                turn,
                Origin { latitude: request.latitude, longitude: request.longitude, altitude: request.altitude },
            );
        }
        // A record of flights is not kept where MAVLink could read it.
        Heard::LogRequestList(request) if own.is_meant(request.target_system, request.target_component) => {
            turn.client.send(&LOG_ENTRY_DATA::default().into(), turn.put);
        }
        // With an addressee it is an answer.
        Heard::Ping(ping) if ping.target_system == 0 && ping.target_component == 0 => {
            let [target_system, target_component] = turn.asker;
            turn.client.send(&PING_DATA { target_system, target_component, ..ping.clone() }.into(), turn.put);
        }
        Heard::Timesync(sync) if sync.tc1 == 0 && own.is_meant(sync.target_system, sync.target_component) => {
            let [target_system, target_component] = turn.asker;
            let tc1 = (now.as_micros() as i64).saturating_mul(1000);
            let answer = TIMESYNC_DATA { tc1, ts1: sync.ts1, target_system, target_component };
            turn.client.send(&answer.into(), turn.put);
        }
        _ => mission(turn, message),
    }
    None
}

/// Does a frame land the vehicle or stop its motors? That is done whatever its age, at the request of any client.
#[must_use]
pub fn ends_a_flight(frame: &MavlinkFrame<'_>) -> bool {
    match Heard::read(frame) {
        Some(Ok(Heard::CommandLong(command))) => commands::Command::from(&command).ends_a_flight(),
        Some(Ok(Heard::CommandInt(command))) => commands::Command::from(&command).ends_a_flight(),
        _ => false,
    }
}

/// Does it move the vehicle, or change how it flies? A command that ends a flight is done whatever its age.
fn is_an_order(message: &Heard) -> bool {
    match message {
        Heard::CommandLong(command) => !commands::Command::from(command).ends_a_flight(),
        Heard::CommandInt(command) => !commands::Command::from(command).ends_a_flight(),
        Heard::SetPositionTargetLocalNed(_)
        | Heard::SetPositionTargetGlobalInt(_)
        | Heard::SetMode(_)
        | Heard::ManualControl(_)
        | Heard::MissionSetCurrent(_)
        | Heard::ParamSet(_) => true,
        _ => false,
    }
}

/// Says that an order came too late to be carried out.
fn late<C: Copy + PartialEq, const ITEMS: usize>(turn: Turn<'_, '_, C, ITEMS>, message: &Heard) {
    let Turn { own, client, asker, put, .. } = turn;
    let (number, target) = match message {
        Heard::CommandLong(command) => (command.command as u16, [command.target_system, command.target_component]),
        Heard::CommandInt(command) => (command.command as u16, [command.target_system, command.target_component]),
        _ => return client.complain(Unserved::Late, &"it was held up on its way", put),
    };
    if own.is_meant(target[0], target[1]) {
        client.complain(Unserved::Late, &"it was held up on its way", put);
        commands::acknowledge(client, number, asker, (MavResult::MAV_RESULT_TEMPORARILY_REJECTED, 0), put);
    }
}

/// The messages of the mission protocol.
fn mission<C: Copy + PartialEq, const ITEMS: usize>(turn: Turn<'_, '_, C, ITEMS>, message: &Heard) {
    let Turn { now, own, asker, client, missions, put, .. } = turn;
    match message {
        Heard::MissionCount(request) if own.is_meant(request.target_system, request.target_component) => {
            missions.count(now, client, asker, request, put);
        }
        Heard::MissionItemInt(item) if own.is_meant(item.target_system, item.target_component) => {
            missions.item(now, client, own, asker, (item.seq, item.mission_type, Some(item.into())), put);
        }
        Heard::MissionItem(item) if own.is_meant(item.target_system, item.target_component) => {
            missions.item(now, client, own, asker, (item.seq, item.mission_type, Some(item.into())), put);
        }
        Heard::MissionRequestList(request) if own.is_meant(request.target_system, request.target_component) => {
            missions.list(client, asker, request.mission_type, put);
        }
        Heard::MissionRequestInt(request) if own.is_meant(request.target_system, request.target_component) => {
            missions.request(client, asker, (request.seq, request.mission_type), put);
        }
        // Older programs ask so, and read both kinds of item.
        Heard::MissionRequest(request) if own.is_meant(request.target_system, request.target_component) => {
            missions.request(client, asker, (request.seq, request.mission_type), put);
        }
        Heard::MissionClearAll(request) if own.is_meant(request.target_system, request.target_component) => {
            missions.clear(client, asker, request.mission_type, put);
        }
        Heard::MissionSetCurrent(request) if own.is_meant(request.target_system, request.target_component) => {
            if !missions.set_current(usize::from(request.seq)) {
                say(client, "not the current item", &NO_ITEM, put);
            }
            client.send(&missions.state(), put);
        }
        // Parts of a mission are not exchanged.
        Heard::MissionWritePartialList(request) if own.is_meant(request.target_system, request.target_component) => {
            missions.refuse(client, asker, request.mission_type, put);
        }
        Heard::MissionRequestPartialList(request) if own.is_meant(request.target_system, request.target_component) => {
            missions.refuse(client, asker, request.mission_type, put);
        }
        Heard::MissionAck(ack) if own.is_meant(ack.target_system, ack.target_component) => {
            missions.acknowledged(client, asker, ack);
        }
        _ => {}
    }
}

fn sign_of_life<C, const ITEMS: usize>(turn: Turn<'_, '_, C, ITEMS>) {
    turn.access.alive(turn.now, turn.requester);
    turn.missions.runner.alive(turn.now, turn.requester);
}

/// A station says where on Earth the vehicle is. Not while a mission with places on Earth is flown, which would be elsewhere then; and not to a vehicle
/// that knows.
fn set_origin<C: Copy + PartialEq, const ITEMS: usize>(turn: Turn<'_, '_, C, ITEMS>, origin: Origin) -> Option<Origin> {
    let Turn { now, own, client, missions, access, put, .. } = turn;
    let moves = missions.is_global() && missions.runner.is_running();
    let taken = (origin.is_sound() && !moves && access.origin().is_none()).then_some(origin);
    // What it is now, so that a station sees whether it was taken.
    let now_own = Own { origin: taken.or(own.origin), ..*own };
    for id in [49, 242] {
        if let Some(message) = streams::make(id, now, &now_own, &access.view()) {
            client.send(&message, put);
        }
    }
    taken
}

/// What cannot be read is answered so that nobody waits for it.
pub(super) fn unreadable<C: Copy + PartialEq, const ITEMS: usize>(turn: Turn<'_, '_, C, ITEMS>, message: Unreadable) {
    let own = turn.own;
    match message {
        Unreadable::Heartbeat => sign_of_life(turn),
        Unreadable::Command { number, target: [to, component] } if own.is_meant(to, component) => {
            commands::refuse(turn.client, number, turn.asker, turn.put);
        }
        Unreadable::Target { target: [to, component] } if own.is_meant(to, component) => {
            turn.client.complain(Unserved::Target, &"not in this frame", turn.put);
        }
        Unreadable::Item { sequence, kind: 0, target: [to, component] } if own.is_meant(to, component) => {
            let kind = MavMissionType::MAV_MISSION_TYPE_MISSION;
            turn.missions.item(turn.now, turn.client, own, turn.asker, (sequence, kind, None), turn.put);
        }
        _ => {}
    }
}
