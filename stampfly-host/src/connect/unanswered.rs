//! Commands of a program at MAVLink's ports that went to the vehicle and wait for its answer.
//!
//! When the line is lost they are lost with it, or their answers are; the program is told that they
//! have failed. A command that lies on the line and arrives late is refused by the vehicle.

use stampfly_link::mavlink::dialects::common::{COMMAND_ACK_DATA, MavCmd, MavMessage, MavResult};
use std::collections::VecDeque;

/// Most commands that wait: a program gives one after the other.
const MOST: usize = 8;

/// System and component of who gave a command.
pub(super) type Numbers = [u8; 2];

/// The commands of one program, in their order.
#[derive(Debug, Default)]
pub(super) struct Unanswered(VecDeque<(MavCmd, Numbers)>);

impl Unanswered {
    /// A command goes to the vehicle. One that is given again has one answer.
    pub fn asks(&mut self, command: MavCmd, numbers: Numbers) {
        self.0.retain(|waiting| *waiting != (command, numbers));
        if self.0.len() >= MOST {
            self.0.pop_front();
        }
        self.0.push_back((command, numbers));
    }

    /// The vehicle has answered, or says that it is at it.
    pub fn hears(&mut self, ack: &COMMAND_ACK_DATA) {
        // System or component zero is everybody.
        let is_for = |[system, component]: Numbers| {
            [0, system].contains(&ack.target_system) && [0, component].contains(&ack.target_component)
        };
        if ack.result != MavResult::MAV_RESULT_IN_PROGRESS {
            self.0.retain(|(command, numbers)| *command != ack.command || !is_for(*numbers));
        }
    }

    /// The line is lost: the answers, to be sent to the program.
    pub fn lost(&mut self) -> impl Iterator<Item = MavMessage> {
        self.0.drain(..).map(|(command, numbers)| answer(command, MavResult::MAV_RESULT_FAILED, numbers))
    }
}

/// The command that this order is, if it is one that is answered.
pub(super) const fn command(order: &MavMessage) -> Option<MavCmd> {
    match order {
        MavMessage::COMMAND_LONG(data) => Some(data.command),
        MavMessage::COMMAND_INT(data) => Some(data.command),
        _ => None,
    }
}

/// The answer to this command of a program of these numbers.
pub(super) fn answer(command: MavCmd, result: MavResult, [target_system, target_component]: Numbers) -> MavMessage {
    let ack = COMMAND_ACK_DATA { command, result, target_system, target_component, ..COMMAND_ACK_DATA::default() };
    MavMessage::COMMAND_ACK(ack)
}

#[cfg(test)]
mod tests {
    use super::MavCmd::{
        MAV_CMD_COMPONENT_ARM_DISARM as ARM, MAV_CMD_NAV_LAND as LAND, MAV_CMD_NAV_TAKEOFF as TAKE_OFF,
    };
    use super::*;

    const GROUND: Numbers = [255, 190];
    const OTHER: Numbers = [254, 190];

    fn hears(waiting: &mut Unanswered, command: MavCmd, result: MavResult, numbers: Numbers) {
        let MavMessage::COMMAND_ACK(ack) = answer(command, result, numbers) else { return };
        waiting.hears(&ack);
    }

    #[test]
    fn what_the_vehicle_has_not_answered_has_failed_when_the_line_is_lost() {
        let mut waiting = Unanswered::default();
        for command in [ARM, TAKE_OFF, TAKE_OFF, LAND] {
            waiting.asks(command, GROUND);
        }
        hears(&mut waiting, ARM, MavResult::MAV_RESULT_ACCEPTED, GROUND);
        hears(&mut waiting, TAKE_OFF, MavResult::MAV_RESULT_IN_PROGRESS, GROUND);
        hears(&mut waiting, LAND, MavResult::MAV_RESULT_ACCEPTED, OTHER);
        let failed = |command| answer(command, MavResult::MAV_RESULT_FAILED, GROUND);
        assert_eq!(waiting.lost().collect::<Vec<_>>(), [failed(TAKE_OFF), failed(LAND)]);
        assert_eq!(waiting.lost().count(), 0, "each is told once");
    }

    #[test]
    fn an_answer_to_everybody_is_an_answer() {
        let mut waiting = Unanswered::default();
        waiting.asks(ARM, GROUND);
        waiting.asks(ARM, OTHER);
        hears(&mut waiting, ARM, MavResult::MAV_RESULT_DENIED, [0, 0]);
        assert_eq!(waiting.lost().count(), 0);
    }

    #[test]
    fn a_program_that_asks_without_end_takes_no_more_room() {
        let mut waiting = Unanswered::default();
        (0..=u8::MAX).for_each(|system| waiting.asks(ARM, [system, 1]));
        assert_eq!(waiting.lost().count(), MOST);
    }
}
