//! Commands, and what becomes of each.
//!
//! A command is acknowledged when it has reached the vehicle, not when it has been carried out: arming that would be refused is
//! denied at once, with the reasons as texts. What a program may ask for while another one commands is the
//! [lease](crate::lease)'s decision, acknowledged as `NOT_IN_CONTROL`.

use super::client::{Client, Put};
use super::identity::Identity;
use super::streams::{STREAMS, make, text};
use crate::cockpit::{Cockpit, Request};
use crate::refusal::{Refusal, Seat};
use stampfly_link::mavlink::dialects::common::*;
use stampfly_types::messages::{FlightPhase, GuidedCommand, GuidedKind};
use stampfly_types::{Duration, Instant, Vec3, frame};

/// A command with its parameters, however it came. Positions of `COMMAND_INT` are whole numbers of units that only a place on
/// Earth needs, so none is taken from them.
pub(super) struct Command {
    kind: MavCmd,
    /// The first is number 1.
    parameters: [f32; 7],
}

impl From<&COMMAND_LONG_DATA> for Command {
    fn from(command: &COMMAND_LONG_DATA) -> Self {
        let COMMAND_LONG_DATA { param1, param2, param3, param4, param5, param6, param7, command: kind, .. } = *command;
        Self { kind, parameters: [param1, param2, param3, param4, param5, param6, param7] }
    }
}

impl From<&COMMAND_INT_DATA> for Command {
    fn from(command: &COMMAND_INT_DATA) -> Self {
        let COMMAND_INT_DATA { param1, param2, param3, param4, z, command: kind, .. } = *command;
        Self { kind, parameters: [param1, param2, param3, param4, f32::NAN, f32::NAN, z] }
    }
}

/// A whole number in a parameter, which MAVLink has as a float: as large as a float still tells apart from the next.
fn whole(number: f32) -> Option<u32> {
    (number.is_finite() && (0.0..=16_777_215.0).contains(&number)).then_some(number as u32)
}

/// Does what is asked, and acknowledges it.
pub(super) fn obey<C>(
    now: Instant,
    identity: &Identity,
    client: &mut Client<C>,
    seat: Seat,
    command: &Command,
    cockpit: &mut dyn Cockpit,
    put: Put<'_, C>,
) {
    let result = outcome(now, identity, client, seat, command, cockpit, put);
    client.send(&MavMessage::COMMAND_ACK(COMMAND_ACK_DATA { command: command.kind, result }), put);
}

fn outcome<C>(
    now: Instant,
    identity: &Identity,
    client: &mut Client<C>,
    seat: Seat,
    Command { kind, parameters: [p1, p2, p3, .., p7] }: &Command,
    cockpit: &mut dyn Cockpit,
    put: Put<'_, C>,
) -> MavResult {
    let status = cockpit.view().state();
    let mut guide = |command| result(cockpit.guide(now, seat, command));
    let simple = |kind| GuidedCommand { kind, ..Default::default() };
    match kind {
        MavCmd::MAV_CMD_COMPONENT_ARM_DISARM if *p1 == 1.0 => {
            if !status.armed && !status.blocks.is_empty() {
                for name in status.blocks.names() {
                    client.send(&text(MavSeverity::MAV_SEVERITY_ERROR, "not armed: ", name), put);
                }
                return MavResult::MAV_RESULT_DENIED;
            }
            guide(simple(GuidedKind::Arm))
        }
        MavCmd::MAV_CMD_COMPONENT_ARM_DISARM if *p1 == 0.0 => {
            // 21196 says "whatever it does": motors off.
            let force = *p2 == 21_196.0;
            guide(simple(if force { GuidedKind::Kill } else { GuidedKind::Disarm }))
        }
        MavCmd::MAV_CMD_DO_FLIGHTTERMINATION if *p1 == 1.0 => guide(simple(GuidedKind::Kill)),
        MavCmd::MAV_CMD_NAV_TAKEOFF if !status.armed => MavResult::MAV_RESULT_DENIED,
        MavCmd::MAV_CMD_NAV_TAKEOFF => {
            let height = if p7.is_finite() && *p7 > 0.0 { *p7 } else { identity.take_off_height };
            let position = Vec3::new(0.0, 0.0, -height);
            guide(GuidedCommand { kind: GuidedKind::TakeOff, position, ..Default::default() })
        }
        MavCmd::MAV_CMD_NAV_LAND => guide(simple(GuidedKind::Land)),
        MavCmd::MAV_CMD_NAV_LOITER_UNLIM => guide(simple(GuidedKind::Hold)),
        MavCmd::MAV_CMD_NAV_RETURN_TO_LAUNCH if status.phase == FlightPhase::Flying => {
            let down = cockpit.view().estimate().map_or(0.0, |(_, estimate)| estimate.position.z);
            let position = Vec3::new(0.0, 0.0, down);
            result(cockpit.fly_to(now, seat, GuidedCommand { position, ..Default::default() }))
        }
        MavCmd::MAV_CMD_REQUEST_MESSAGE => {
            let message = whole(*p1).and_then(|id| make(id, now, identity, &cockpit.view()));
            let Some(message) = message else { return MavResult::MAV_RESULT_UNSUPPORTED };
            client.send(&message, put);
            MavResult::MAV_RESULT_ACCEPTED
        }
        MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL => set_interval(now, client, *p1, *p2),
        MavCmd::MAV_CMD_PREFLIGHT_STORAGE if *p1 == 1.0 => result(cockpit.request(now, Request::SaveParameters)),
        MavCmd::MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN if *p1 == 1.0 => result(cockpit.request(now, Request::Restart)),
        // Type 0 is a throttle in per cent.
        MavCmd::MAV_CMD_DO_MOTOR_TEST if *p2 == 0.0 && (0.0..=100.0).contains(p3) => {
            let motor = whole(*p1).and_then(|motor| u8::try_from(motor).ok()).unwrap_or(0);
            let request = match *p3 > 0.0 {
                true => Request::TestMotor { motor, duty: p3 / 100.0 },
                false => Request::StopMotor,
            };
            result(cockpit.request(now, request))
        }
        _ => MavResult::MAV_RESULT_UNSUPPORTED,
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

/// Sends the vehicle to a place. Programs repeat the same target many times a second: only a new one is passed on.
pub(super) fn go_to<C>(
    now: Instant,
    client: &mut Client<C>,
    seat: Seat,
    target: &SET_POSITION_TARGET_LOCAL_NED_DATA,
    cockpit: &mut dyn Cockpit,
) {
    type Mask = PositionTargetTypemask;
    let place = Mask::POSITION_TARGET_TYPEMASK_X_IGNORE
        | Mask::POSITION_TARGET_TYPEMASK_Y_IGNORE
        | Mask::POSITION_TARGET_TYPEMASK_Z_IGNORE;
    // A place, or nothing: velocities alone are not flown.
    if target.type_mask.intersects(place) || cockpit.view().state().phase != FlightPhase::Flying {
        return;
    }
    let Some((_, estimate)) = cockpit.view().estimate() else { return };
    let asked = Vec3::new(target.x, target.y, target.z);
    let position = match target.coordinate_frame {
        MavFrame::MAV_FRAME_LOCAL_NED => asked,
        MavFrame::MAV_FRAME_LOCAL_OFFSET_NED => estimate.position + asked,
        MavFrame::MAV_FRAME_BODY_FRD => {
            estimate.position + frame::from_yaw(frame::yaw(&estimate.attitude)).transform_vector(&asked)
        }
        _ => return,
    };
    let turns = !target.type_mask.contains(Mask::POSITION_TARGET_TYPEMASK_YAW_IGNORE);
    let yaw = if turns { target.yaw } else { frame::yaw(&estimate.attitude) };
    let [x, y, z] = asked.to_array();
    // Without a heading of its own, the present one must not make the target look new.
    let new = [x, y, z, if turns { yaw } else { 0.0 }];
    if client.target == Some(new) {
        return;
    }
    if cockpit.fly_to(now, seat, GuidedCommand { position, yaw, ..Default::default() }).is_ok() {
        client.target = Some(new);
    }
}
