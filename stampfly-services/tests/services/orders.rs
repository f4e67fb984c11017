//! Commands that change a vehicle's state are acknowledged when the vehicle shows that they have
//! happened, to who has asked.
#![allow(deprecated, reason = "older programs send what the protocol has superseded")]

use crate::common::{Id, Vehicle};
use stampfly_link::mavlink::dialects::common::*;
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter};
use stampfly_services::mavlink::{Identity, Mavlink};
use stampfly_types::Instant;
use stampfly_types::messages::*;

const IDENTITY: Identity =
    Identity { system: 7, kind: MavType::MAV_TYPE_QUADROTOR, take_off_height: 0.5, reach: 0.25, version: [1, 2, 3] };

/// A vehicle that does nothing by itself, and its stations behind one connection.
struct Scene {
    mavlink: Mavlink<u8>,
    vehicle: Vehicle,
    now: u64,
}

/// What was sent: results of commands with the addressee, and texts.
#[derive(Debug, Default, PartialEq)]
struct Said {
    results: Vec<(MavCmd, MavResult, [u8; 2])>,
    texts: Vec<String>,
}

impl Said {
    fn read(bytes: &[u8]) -> Self {
        let (mut said, mut decoder) = (Self::default(), MavlinkDecoder::<MavMessage>::new());
        for byte in bytes {
            match decoder.feed(*byte).map(|frame| frame.message().expect("a message")) {
                Some(MavMessage::COMMAND_ACK(ack)) => {
                    said.results.push((ack.command, ack.result, [ack.target_system, ack.target_component]));
                }
                Some(MavMessage::STATUSTEXT(text)) => {
                    said.texts.push(text.text.to_str().expect("UTF-8").to_owned());
                }
                _ => {}
            }
        }
        said
    }

    fn results(&self) -> Vec<MavResult> {
        self.results.iter().map(|(_, result, _)| *result).collect()
    }
}

impl Scene {
    fn new(vehicle: Vehicle) -> Self {
        Self { mavlink: Mavlink::new(IDENTITY), vehicle, now: 0 }
    }

    /// A station with this system and component asks for something.
    fn asks(&mut self, [system, component]: [u8; 2], kind: MavCmd, parameters: [f32; 3]) -> Said {
        let [param1, param2, param7] = parameters;
        self.sends([system, component], COMMAND_LONG_DATA { param1, param2, param7, command: kind, ..to_it() })
    }

    fn sends(&mut self, [system, component]: [u8; 2], command: COMMAND_LONG_DATA) -> Said {
        let (mut bytes, mut sent) = ([0; LONGEST], Vec::new());
        let message = MavMessage::COMMAND_LONG(command);
        let frame = MavlinkWriter::new(system, component).write(MavlinkVersion::V2, &message, &mut bytes);
        let now = Instant::from_millis(self.now);
        self.mavlink.hear(now, 1, frame.expect("a frame"), &mut self.vehicle, &mut |_, frame| sent.extend(frame));
        Said::read(&sent)
    }

    /// Lets so much time pass.
    fn passes(&mut self, ms: u64) -> Said {
        let mut sent = Vec::new();
        for _ in 0..ms / 20 {
            self.now += 20;
            self.mavlink.poll(Instant::from_millis(self.now), &mut self.vehicle, &mut |_, frame| sent.extend(frame));
        }
        Said::read(&sent)
    }

    /// Of a vehicle in this state.
    fn shows(&mut self, change: impl FnOnce(&mut FlightStatus)) -> Said {
        self.vehicle.status(change);
        self.passes(20)
    }

    fn asked(&mut self) -> Vec<GuidedKind> {
        let all = std::mem::take(&mut self.vehicle.guided);
        all.into_iter().map(|command| command.kind).filter(|kind| *kind != GuidedKind::None).collect()
    }
}

fn to_it() -> COMMAND_LONG_DATA {
    COMMAND_LONG_DATA { target_system: 7, target_component: 1, ..Default::default() }
}

const STATION: [u8; 2] = [255, 190];
const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
const TAKE_OFF: MavCmd = MavCmd::MAV_CMD_NAV_TAKEOFF;
const ON: [f32; 3] = [1.0, 0.0, 0.0];
const OFF: [f32; 3] = [0.0; 3];
const KILL: [f32; 3] = [0.0, 21_196.0, 0.0];
const ACCEPTED: MavResult = MavResult::MAV_RESULT_ACCEPTED;
const DENIED: MavResult = MavResult::MAV_RESULT_DENIED;
const FAILED: MavResult = MavResult::MAV_RESULT_FAILED;
const GOES_ON: MavResult = MavResult::MAV_RESULT_IN_PROGRESS;

fn armed(status: &mut FlightStatus) {
    (status.armed, status.phase, status.commander) = (true, FlightPhase::Armed, CommandSource::Guided);
}

#[test]
fn arming_is_acknowledged_when_it_is_armed_and_a_take_off_after_that_is_flown() {
    let mut scene = Scene::new(Vehicle::standing());
    assert_eq!(scene.asks(STATION, ARM, ON), Said::default());
    assert_eq!(scene.passes(100), Said::default(), "nothing has happened yet");
    assert_eq!(scene.shows(armed).results, [(ARM, ACCEPTED, STATION)]);
    assert_eq!(scene.passes(2_000), Said::default(), "once");
    assert_eq!(scene.asks(STATION, TAKE_OFF, [0.0, 0.0, 0.7]), Said::default());
    let rises = scene.shows(|status| status.phase = FlightPhase::TakeOff);
    assert_eq!(rises.results, [(TAKE_OFF, ACCEPTED, STATION)]);
    assert_eq!(scene.vehicle.guided[1].position.z, -0.7);
    assert_eq!(scene.asked(), [GuidedKind::Arm, GuidedKind::TakeOff]);
}

#[test]
fn what_the_mode_machine_refuses_is_denied_with_its_reasons_and_what_never_happens_has_failed() {
    let mut scene = Scene::new(Vehicle::standing());
    scene.asks(STATION, ARM, ON);
    let refusals = ArmRefusals { attempts: 1, blocks: ArmBlocks::CRASHED, ..Default::default() };
    scene.vehicle.publish(Id::arm_refusals, &refusals);
    let said = scene.passes(20);
    assert_eq!((said.results, said.texts), (vec![(ARM, DENIED, STATION)], vec!["not armed: CRASHED".to_owned()]));
    // Asked again, and refused again.
    scene.asks(STATION, ARM, ON);
    assert_eq!(scene.passes(100), Said::default(), "of the first time");
    scene.vehicle.publish(Id::arm_refusals, &ArmRefusals { attempts: 2, ..refusals });
    assert_eq!(scene.passes(20).results(), [DENIED]);
    // A vehicle that says nothing at all.
    scene.asks(STATION, ARM, ON);
    assert_eq!(scene.passes(1_480), Said::default());
    let said = scene.passes(40);
    assert_eq!((said.results(), &said.texts[0][..]), (vec![FAILED], "arming denied: the vehicle does not do it now"));
}

#[test]
fn silence_does_not_deny_arming_because_the_command_ends_it() {
    let mut scene = Scene::new(Vehicle::standing());
    scene.vehicle.status(|status| status.blocks = ArmBlocks::NO_LINK);
    assert_eq!(scene.asks(STATION, ARM, ON), Said::default());
    assert_eq!(scene.asked(), [GuidedKind::Arm]);
}

#[test]
fn each_command_has_happened_when_the_vehicle_shows_it() {
    use FlightPhase as P;
    type Change = fn(&mut FlightStatus);
    let flying: Change = |status| (status.phase, status.commander) = (P::Flying, CommandSource::Guided);
    let disarmed: Change = |status| (status.armed, status.phase) = (false, P::IdleGround);
    let piloted: Change = |status| (status.phase, status.commander) = (P::Flying, CommandSource::Pilot);
    let landing: Change = |status| status.phase = P::Landing;
    let terminate = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;
    let mode = MavCmd::MAV_CMD_DO_SET_MODE;
    // The command, its parameters, the state before, one in which it has not happened, and one in
    // which it has.
    let table: [(MavCmd, [f32; 3], Change, Change, Change); 10] = [
        (ARM, ON, disarmed, disarmed, armed),
        (ARM, OFF, armed, armed, disarmed),
        (ARM, KILL, flying, flying, disarmed),
        (terminate, ON, flying, landing, disarmed),
        (TAKE_OFF, [0.0, 0.0, 1.0], armed, armed, |status| status.phase = P::TakeOff),
        (MavCmd::MAV_CMD_NAV_LAND, OFF, flying, flying, landing),
        (MavCmd::MAV_CMD_NAV_LOITER_UNLIM, OFF, piloted, piloted, flying),
        (MavCmd::MAV_CMD_NAV_RETURN_TO_LAUNCH, OFF, piloted, piloted, flying),
        (MavCmd::MAV_CMD_DO_PAUSE_CONTINUE, OFF, piloted, piloted, flying),
        (mode, [8.0, 0.0, 0.0], piloted, piloted, flying),
    ];
    for (kind, parameters, before, not_yet, then) in table {
        let mut scene = Scene::new(Vehicle::standing());
        scene.vehicle.status(armed);
        scene.vehicle.status(before);
        let what = format!("{kind:?} {parameters:?}");
        assert_eq!(scene.asks(STATION, kind, parameters), Said::default(), "{what}");
        assert_eq!(scene.shows(not_yet), Said::default(), "{what}");
        assert_eq!(scene.shows(then).results, [(kind, ACCEPTED, STATION)], "{what}");
        // A state that is there already is acknowledged at once.
        let again = scene.asks(STATION, kind, parameters).results();
        assert_eq!(again, [ACCEPTED], "{what}");
        assert_eq!(scene.passes(2_000), Said::default(), "{what}");
    }
}

#[test]
fn what_cannot_be_is_denied_at_once_and_people_are_told_why() {
    let mut scene = Scene::new(Vehicle::standing());
    let mut denied = |kind, parameters| {
        let said = scene.asks(STATION, kind, parameters);
        assert_eq!(said.results(), [DENIED], "{kind:?}");
        said.texts.concat()
    };
    assert_eq!(denied(TAKE_OFF, OFF), "take-off denied: motors are off");
    assert_eq!(denied(MavCmd::MAV_CMD_NAV_LOITER_UNLIM, OFF), "hold denied: motors are off");
    assert_eq!(denied(MavCmd::MAV_CMD_NAV_RETURN_TO_LAUNCH, OFF), "return denied: motors are off");
    assert_eq!(denied(MavCmd::MAV_CMD_MISSION_START, OFF), "mission not started: there is none");
    assert_eq!(denied(MavCmd::MAV_CMD_MISSION_START, ON), "mission not started: the mission has no such item");
    let current = denied(MavCmd::MAV_CMD_DO_SET_MISSION_CURRENT, ON);
    assert_eq!(current, "not the current item: the mission has no such item");
    assert_eq!(scene.asked(), []);
    // Standing with its motors off is what a landing ends with, and what a program's arming begins
    // with.
    assert_eq!(scene.asks(STATION, MavCmd::MAV_CMD_NAV_LAND, OFF).results(), [ACCEPTED]);
    assert_eq!(scene.asks(STATION, MavCmd::MAV_CMD_DO_SET_MODE, [8.0, 0.0, 0.0]).results(), [ACCEPTED]);

    let mut scene = Scene::new(Vehicle::flying());
    scene.asks(STATION, MavCmd::MAV_CMD_NAV_LOITER_UNLIM, OFF);
    let said = scene.asks([200, 190], MavCmd::MAV_CMD_NAV_LOITER_UNLIM, OFF);
    assert_eq!(said.results, [(MavCmd::MAV_CMD_NAV_LOITER_UNLIM, MavResult::MAV_RESULT_NOT_IN_CONTROL, [200, 190])]);
    assert_eq!(said.texts, ["hold denied: MAVLink 255/190, line 1 commands"]);
    // It lands, and does not take off again.
    scene.vehicle.status(|status| status.phase = FlightPhase::Landing);
    assert_eq!(scene.asks(STATION, TAKE_OFF, OFF), Said::default());
    let said = scene.passes(1_520);
    assert_eq!((said.results(), &said.texts[..]), (vec![FAILED], &["take-off denied: it lands".to_owned()][..]));
}

#[test]
fn what_is_sent_again_while_it_is_waited_for_is_done_once() {
    let mut scene = Scene::new(Vehicle::standing());
    let arm = COMMAND_LONG_DATA { command: ARM, param1: 1.0, ..to_it() };
    assert_eq!(scene.sends(STATION, arm.clone()), Said::default());
    for confirmation in 1..3 {
        scene.passes(200);
        let said = scene.sends(STATION, COMMAND_LONG_DATA { confirmation, ..arm.clone() });
        assert_eq!(said.results, [(ARM, GOES_ON, STATION)]);
    }
    assert_eq!(scene.asked(), [GuidedKind::Arm]);
    assert_eq!(scene.shows(armed).results, [(ARM, ACCEPTED, STATION)], "one acknowledgement");
    // The acknowledgement was lost.
    scene.asked();
    let said = scene.sends(STATION, COMMAND_LONG_DATA { confirmation: 3, ..arm });
    assert_eq!((said.results(), scene.asked()), (vec![ACCEPTED], vec![]));
    scene.vehicle.status(|status| status.phase = FlightPhase::TakeOff);
    let take_off = COMMAND_LONG_DATA { command: TAKE_OFF, confirmation: 1, ..to_it() };
    assert_eq!((scene.sends(STATION, take_off).results(), scene.asked()), (vec![ACCEPTED], vec![]));
    // Motors off may have been lost on its way, and twice is once.
    scene.asks(STATION, ARM, KILL);
    scene.asks(STATION, ARM, KILL);
    assert_eq!(scene.asked(), [GuidedKind::Kill; 2]);
}

#[test]
fn a_take_off_sent_together_with_arming_waits_for_it() {
    let mut scene = Scene::new(Vehicle::standing());
    scene.asks(STATION, ARM, ON);
    assert_eq!(scene.asks(STATION, TAKE_OFF, [0.0, 0.0, 0.8]), Said::default());
    scene.passes(100);
    assert_eq!(scene.asked(), [GuidedKind::Arm], "not in one step with arming, where it would be lost");
    assert_eq!(scene.shows(armed).results, [(ARM, ACCEPTED, STATION)]);
    assert_eq!(scene.vehicle.guided.last().map(|command| command.position.z), Some(-0.8));
    let rises = scene.shows(|status| status.phase = FlightPhase::TakeOff);
    assert_eq!(rises.results, [(TAKE_OFF, ACCEPTED, STATION)]);

    // Motors off: the take-off that has waited does not come after it.
    let mut scene = Scene::new(Vehicle::standing());
    scene.asks(STATION, ARM, ON);
    scene.asks(STATION, TAKE_OFF, OFF);
    scene.asks([200, 190], ARM, KILL);
    let said = scene.shows(armed);
    assert_eq!(scene.asked(), [GuidedKind::Arm, GuidedKind::Kill]);
    assert_eq!(said.texts, ["take-off denied: another command has ended it"]);

    let mut scene = Scene::new(Vehicle::standing());
    scene.asks(STATION, ARM, ON);
    scene.asks(STATION, TAKE_OFF, OFF);
    scene.vehicle.publish(Id::arm_refusals, &ArmRefusals { attempts: 1, ..Default::default() });
    let said = scene.passes(40);
    assert_eq!(said.results(), [DENIED, DENIED]);
    assert_eq!(said.texts, ["take-off denied: motors are off"]);
    assert_eq!(scene.asked(), [GuidedKind::Arm]);
}

#[test]
fn disarming_in_the_air_goes_on_until_it_has_landed() {
    let mut scene = Scene::new(Vehicle::flying());
    assert_eq!(scene.asks(STATION, ARM, OFF), Said::default());
    let mut said = scene.shows(|status| status.phase = FlightPhase::Landing);
    said.results.extend(scene.passes(2_000).results);
    assert_eq!(said.results(), [GOES_ON; 5]);
    assert_eq!(scene.shows(|status| status.armed = false).results, [(ARM, ACCEPTED, STATION)]);
    // One that never ends.
    let mut scene = Scene::new(Vehicle::flying());
    scene.asks(STATION, ARM, OFF);
    scene.vehicle.status(|status| status.phase = FlightPhase::Landing);
    let mut results = Vec::new();
    for second in 0..62 {
        // The station is there.
        scene.asks(STATION, MavCmd::MAV_CMD_DO_SET_SERVO, OFF);
        let said = scene.passes(1_000);
        results.extend(said.results().into_iter().map(|result| (second, result)));
    }
    assert_eq!(results.last(), Some(&(59, FAILED)));
}

#[test]
fn there_is_room_for_three_and_always_for_what_ends_a_flight() {
    let mut scene = Scene::new(Vehicle::flying());
    for component in 0..3 {
        assert_eq!(scene.asks([255, component], MavCmd::MAV_CMD_NAV_LAND, OFF), Said::default());
    }
    let hold = scene.asks([255, 0], MavCmd::MAV_CMD_NAV_LOITER_UNLIM, OFF);
    assert_eq!(hold.results(), [MavResult::MAV_RESULT_TEMPORARILY_REJECTED]);
    scene.asked();
    // It has reached the vehicle, which turns its motors still.
    assert_eq!(scene.asks([255, 4], ARM, KILL), Said::default());
    assert_eq!(scene.asked(), [GuidedKind::Kill]);
    for component in 5..9 {
        let said = scene.asks([255, component], ARM, KILL);
        let no_room = if component > 6 { &[MavResult::MAV_RESULT_IN_PROGRESS][..] } else { &[] };
        assert_eq!(said.results(), no_room, "{component}");
        assert_eq!(scene.asked(), [GuidedKind::Kill]);
    }
    scene.vehicle.status(|status| status.phase = FlightPhase::Landing);
    let said = scene.passes(20);
    let told: Vec<_> = said.results.iter().map(|(_, result, [_, component])| (*result, *component)).collect();
    assert_eq!(told, [(ACCEPTED, 0), (ACCEPTED, 1), (ACCEPTED, 2)]);
    let mut scene = Scene::new(Vehicle::standing());
    // A station that is gone is told nothing.
    scene.asks(STATION, ARM, ON);
    scene.mavlink.close(1, &mut scene.vehicle);
    scene.vehicle.status(armed);
    assert_eq!(scene.passes(2_000), Said::default());
}
