//! The vehicle's end of MAVLink, asked by a ground station made of the crate `mavlink` alone.

use crate::common::{Id, Vehicle};
use stampfly_link::mavlink::dialects::common::*;
use stampfly_link::mavlink::signing::{Signer, SigningKey};
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter};
use stampfly_link::secure::Key;
use stampfly_services::mavlink::{CLIENTS, Identity, Mavlink, short_name};
use stampfly_services::{Asked, CommandNotice, Request, Requester};
use stampfly_types::messages::{
    Alerts, ArmBlocks, CalibrationKind, CalibrationReport, CalibrationStage, GuidedKind, SystemAlert,
};
use stampfly_types::{Instant, Vec3};

const IDENTITY: Identity =
    Identity { system: 7, kind: MavType::MAV_TYPE_QUADROTOR, take_off_height: 0.5, reach: 0.25, version: [1, 2, 3] };

/// A ground station at a line of its own.
struct Station {
    id: u8,
    writer: MavlinkWriter,
    decoder: MavlinkDecoder<MavMessage>,
    heard: Vec<MavMessage>,
}

impl Station {
    fn new(id: u8) -> Self {
        Self { id, writer: MavlinkWriter::new(250 + id % 6, 190), decoder: MavlinkDecoder::new(), heard: Vec::new() }
    }

    fn says(&mut self, message: &MavMessage) -> Vec<u8> {
        let mut bytes = [0; LONGEST];
        self.writer.write(MavlinkVersion::V1, message, &mut bytes).expect("of version 1").to_vec()
    }

    fn hears(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.heard.extend(self.decoder.feed(*byte).map(|frame| frame.message::<MavMessage>().expect("a message")));
        }
    }

    /// What came back at once.
    fn asks(
        &mut self,
        now: Instant,
        mavlink: &mut Mavlink<u8>,
        vehicle: &mut Vehicle,
        message: &MavMessage,
    ) -> Vec<MavMessage> {
        let (bytes, id) = (self.says(message), self.id);
        let mut sent = Vec::new();
        mavlink.hear(now, id, &bytes, vehicle, &mut |to, frame| {
            assert_eq!(*to, id);
            sent.extend(frame);
        });
        self.heard.clear();
        self.hears(&sent);
        std::mem::take(&mut self.heard)
    }
}

fn command(kind: MavCmd, parameters: [f32; 7]) -> MavMessage {
    let [param1, param2, param3, param4, param5, param6, param7] = parameters;
    MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
        param1,
        param2,
        param3,
        param4,
        param5,
        param6,
        param7,
        command: kind,
        target_system: 7,
        target_component: 1,
        confirmation: 0,
    })
}

fn result(answers: &[MavMessage]) -> Option<MavResult> {
    answers.iter().find_map(|answer| match answer {
        MavMessage::COMMAND_ACK(ack) => Some(ack.result),
        _ => None,
    })
}

fn arm() -> MavMessage {
    command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
}

/// Polls for so long, 50 times a second, and returns what each client was sent.
fn polled(mavlink: &mut Mavlink<u8>, vehicle: &mut Vehicle, from_ms: u64, to_ms: u64) -> Vec<(u8, MavMessage)> {
    let mut sent: Vec<(u8, Vec<u8>)> = Vec::new();
    for ms in (from_ms..to_ms).step_by(20) {
        mavlink.poll(Instant::from_millis(ms), vehicle, &mut |to, frame| sent.push((*to, frame.to_vec())));
    }
    let mut messages = Vec::new();
    for (to, frame) in sent {
        let mut station = Station::new(to);
        station.hears(&frame);
        messages.extend(station.heard.drain(..).map(|message| (to, message)));
    }
    messages
}

#[test]
fn a_client_that_says_nothing_is_sent_heartbeats_and_streams_at_their_rates() {
    let (mut mavlink, mut vehicle) = (Mavlink::new(IDENTITY), Vehicle::standing());
    mavlink.open(Instant::ZERO, 1, true);
    let sent = polled(&mut mavlink, &mut vehicle, 0, 10_000);
    let count = |wanted: fn(&MavMessage) -> bool| sent.iter().filter(|(_, message)| wanted(message)).count();
    assert_eq!(count(|message| matches!(message, MavMessage::HEARTBEAT(_))), 10);
    assert_eq!(count(|message| matches!(message, MavMessage::EXTENDED_SYS_STATE(_))), 20);
    let attitudes = count(|message| matches!(message, MavMessage::ATTITUDE(_)));
    assert!((190..=200).contains(&attitudes), "{attitudes}");
    assert_eq!(count(|message| matches!(message, MavMessage::DISTANCE_SENSOR(_))), 0, "no range was ever measured");
}

#[test]
fn arming_is_denied_with_the_reasons_in_words_and_passed_on_when_there_are_none() {
    let (mut mavlink, mut vehicle, mut station) = (Mavlink::new(IDENTITY), Vehicle::standing(), Station::new(1));
    vehicle.status(|status| status.blocks = ArmBlocks::TILTED | ArmBlocks::NO_BATTERY);
    let answers = station.asks(Instant::ZERO, &mut mavlink, &mut vehicle, &arm());
    assert_eq!(result(&answers), Some(MavResult::MAV_RESULT_DENIED));
    let texts: Vec<_> = answers
        .iter()
        .filter_map(|answer| match answer {
            MavMessage::STATUSTEXT(text) => Some(text.text.to_str().expect("text").to_owned()),
            _ => None,
        })
        .collect();
    assert_eq!(texts, ["not armed: NO_BATTERY", "not armed: TILTED"]);
    assert!(vehicle.guided.is_empty());

    vehicle.status(|status| status.blocks = ArmBlocks::NONE);
    let answers = station.asks(Instant::ZERO, &mut mavlink, &mut vehicle, &arm());
    assert_eq!(result(&answers), None, "when it is armed");
    assert_eq!(vehicle.guided.iter().map(|command| command.kind).collect::<Vec<_>>(), [GuidedKind::Arm]);
}

#[test]
fn what_is_for_another_system_or_is_no_number_does_nothing() {
    let (mut mavlink, mut vehicle, mut station) = (Mavlink::new(IDENTITY), Vehicle::flying(), Station::new(1));
    let MavMessage::COMMAND_LONG(land) = command(MavCmd::MAV_CMD_NAV_LAND, [0.0; 7]) else { unreachable!() };
    for (target_system, target_component) in [(8, 1), (7, 2)] {
        let land = COMMAND_LONG_DATA { target_system, target_component, ..land.clone() };
        assert_eq!(station.asks(Instant::ZERO, &mut mavlink, &mut vehicle, &MavMessage::COMMAND_LONG(land)), []);
    }
    for wrong in [f32::NAN, f32::INFINITY, 1e6] {
        let mut target =
            SET_POSITION_TARGET_LOCAL_NED_DATA { target_system: 7, target_component: 1, ..Default::default() };
        (target.x, target.coordinate_frame) = (wrong, MavFrame::MAV_FRAME_LOCAL_NED);
        target.type_mask = PositionTargetTypemask::empty();
        station.asks(Instant::ZERO, &mut mavlink, &mut vehicle, &MavMessage::SET_POSITION_TARGET_LOCAL_NED(target));
        let motor = command(MavCmd::MAV_CMD_DO_MOTOR_TEST, [wrong, 0.0, wrong, 0.0, 0.0, 0.0, 0.0]);
        station.asks(Instant::ZERO, &mut mavlink, &mut vehicle, &motor);
    }
    assert_eq!(vehicle.guided, [], "a place that is none does not even cost the route");
    assert_eq!(vehicle.requests, []);
    // Everybody is meant by zero.
    let everybody = COMMAND_LONG_DATA { target_system: 0, target_component: 0, ..land };
    station.asks(Instant::ZERO, &mut mavlink, &mut vehicle, &MavMessage::COMMAND_LONG(everybody));
    assert_eq!(vehicle.guided.iter().map(|command| command.kind).collect::<Vec<_>>(), [GuidedKind::Land]);
}

#[test]
fn a_target_that_is_repeated_is_passed_on_once() {
    let (mut mavlink, mut vehicle, mut station) = (Mavlink::new(IDENTITY), Vehicle::flying(), Station::new(1));
    let mut target = SET_POSITION_TARGET_LOCAL_NED_DATA { target_system: 7, target_component: 1, ..Default::default() };
    (target.x, target.z, target.coordinate_frame) = (1.0, -0.5, MavFrame::MAV_FRAME_LOCAL_NED);
    target.type_mask = PositionTargetTypemask::POSITION_TARGET_TYPEMASK_YAW_IGNORE;
    for ms in 0..50 {
        let message = MavMessage::SET_POSITION_TARGET_LOCAL_NED(target.clone());
        station.asks(Instant::from_millis(20 * ms), &mut mavlink, &mut vehicle, &message);
    }
    let kinds: Vec<_> = vehicle.guided.iter().map(|command| command.kind).collect();
    assert_eq!(kinds, [GuidedKind::Hold, GuidedKind::WayPoint]);
    assert_eq!(vehicle.guided[1].position, Vec3::new(1.0, 0.0, -0.5));
}

#[test]
fn two_stations_do_not_steer_one_vehicle_but_both_can_stop_it() {
    let (mut mavlink, mut vehicle) = (Mavlink::new(IDENTITY), Vehicle::flying());
    let (mut first, mut second) = (Station::new(1), Station::new(2));
    let hold = command(MavCmd::MAV_CMD_NAV_LOITER_UNLIM, [0.0; 7]);
    let mut ask = |station: &mut Station, message: &MavMessage| {
        result(&station.asks(Instant::ZERO, &mut mavlink, &mut vehicle, message))
    };
    assert_eq!(ask(&mut first, &hold), Some(MavResult::MAV_RESULT_ACCEPTED));
    assert_eq!(ask(&mut second, &hold), Some(MavResult::MAV_RESULT_NOT_IN_CONTROL));
    assert_eq!(ask(&mut second, &command(MavCmd::MAV_CMD_NAV_LAND, [0.0; 7])), None, "when it lands");
    let stop = command(MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(ask(&mut second, &stop), None, "when it is disarmed");
    assert_eq!(vehicle.guided.last().map(|command| command.kind), Some(GuidedKind::Kill));
}

#[test]
fn parameters_are_listed_read_and_set_within_their_range_on_the_ground() {
    let (mut mavlink, mut vehicle, mut station) = (Mavlink::new(IDENTITY), Vehicle::standing(), Station::new(1));
    let list = PARAM_REQUEST_LIST_DATA { target_system: 7, target_component: 1 };
    station.asks(Instant::ZERO, &mut mavlink, &mut vehicle, &MavMessage::PARAM_REQUEST_LIST(list));
    let listed: Vec<_> = polled(&mut mavlink, &mut vehicle, 0, 100)
        .into_iter()
        .filter_map(|(_, message)| match message {
            MavMessage::PARAM_VALUE(value) => {
                Some((value.param_id.to_str().expect("text").to_owned(), value.param_count))
            }
            _ => None,
        })
        .collect();
    let long = short_name("a.name.that.is.longer.than.sixteen");
    assert_eq!(listed, [("gain".to_owned(), 2), (long.to_string(), 2)]);

    let mut set = |vehicle: &mut Vehicle, name: &str, value: f32| {
        let set = PARAM_SET_DATA {
            param_value: value,
            target_system: 7,
            target_component: 1,
            param_id: name.into(),
            param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
        };
        let answers = station.asks(Instant::ZERO, &mut mavlink, vehicle, &MavMessage::PARAM_SET(set));
        answers.into_iter().find_map(|answer| match answer {
            MavMessage::PARAM_VALUE(value) => Some(value.param_value),
            _ => None,
        })
    };
    assert_eq!(set(&mut vehicle, "gain", 3.0), Some(3.0));
    assert_eq!(set(&mut vehicle, "gain", 11.0), Some(3.0), "out of range");
    assert_eq!(set(&mut vehicle, "gain", f32::NAN), Some(3.0), "no number");
    assert_eq!(set(&mut vehicle, &long, 4.0), Some(4.0));
    assert_eq!(set(&mut vehicle, "nonsense", 4.0), None);
    vehicle.status(|status| status.armed = true);
    assert_eq!(set(&mut vehicle, "gain", 5.0), Some(5.0), "may change in flight");
    assert_eq!(set(&mut vehicle, "gain", 11.0), Some(5.0), "as far as its range goes");
    assert_eq!(vehicle.parameters.0, [5.0, 4.0]);
}

#[test]
fn what_may_not_change_in_flight_is_taken_and_said_to_wait() {
    let (mut mavlink, mut vehicle, mut station) = (Mavlink::new(IDENTITY), Vehicle::flying(), Station::new(1));
    let set = |name: &str, value| {
        let mut param_id = [0; 16];
        param_id.iter_mut().zip(name.bytes()).for_each(|(to, from)| *to = from);
        MavMessage::PARAM_SET(PARAM_SET_DATA {
            param_value: value,
            target_system: 7,
            target_component: 1,
            param_id: param_id.into(),
            param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
        })
    };
    let mut texts = |vehicle: &mut Vehicle, message: &MavMessage| {
        let answers = station.asks(Instant::from_millis(10), &mut mavlink, vehicle, message);
        answers.iter().fold(String::new(), |said, answer| match answer {
            MavMessage::STATUSTEXT(text) => said + text.text.to_str().expect("UTF-8"),
            _ => said,
        })
    };
    let long = "a.name.that.is.longer.than.sixteen";
    let said = texts(&mut vehicle, &set(&short_name(long), 4.0));
    assert_eq!(said, format!("{long}: not in flight: waits until the vehicle is disarmed"));
    assert_eq!(texts(&mut vehicle, &set("gain", 4.0)), "");
    assert_eq!(vehicle.parameters.0, [4.0, 4.0]);
}

#[test]
fn a_combination_that_cannot_fly_keeps_the_old_value_and_says_why_in_pieces() {
    let (mut mavlink, mut vehicle, mut station) = (Mavlink::new(IDENTITY), Vehicle::standing(), Station::new(1));
    vehicle.parameters.0 = [3.0, 9.0];
    let set = PARAM_SET_DATA {
        param_value: 7.0,
        target_system: 7,
        target_component: 1,
        param_id: "gain".into(),
        param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
    };
    let (mut values, mut pieces) = (Vec::new(), Vec::new());
    for answer in station.asks(Instant::from_millis(10), &mut mavlink, &mut vehicle, &MavMessage::PARAM_SET(set)) {
        match answer {
            MavMessage::PARAM_VALUE(value) => values.push(value.param_value),
            MavMessage::STATUSTEXT(piece) => pieces.push(piece),
            _ => {}
        }
    }
    assert_eq!((values, vehicle.parameters.0), (vec![3.0], [3.0, 9.0]));
    let text: String = pieces.iter().map(|piece| piece.text.to_str().expect("text")).collect();
    assert_eq!(text, "gain with a.name.that.is.longer.than.sixteen: seven and nine never fly together, on no day");
    let places: Vec<_> = pieces.iter().map(|piece| (piece.id, piece.chunk_seq)).collect();
    assert!(places[0].0 != 0 && places == [(places[0].0, 0), (places[0].0, 1)], "{places:?}");
}

#[test]
fn an_alert_is_told_once_and_again_when_it_comes_back() {
    let (mut mavlink, mut vehicle) = (Mavlink::new(IDENTITY), Vehicle::flying());
    mavlink.open(Instant::ZERO, 1, true);
    let mut told = |vehicle: &mut Vehicle, active, from| {
        vehicle.publish(Id::system_alert, &SystemAlert { active, seen: active });
        let sent = polled(&mut mavlink, vehicle, from, from + 200);
        sent.iter().filter(|(_, message)| matches!(message, MavMessage::STATUSTEXT(_))).count()
    };
    assert_eq!(told(&mut vehicle, Alerts::TOF_LOST | Alerts::FLOW_LOST, 0), 2);
    assert_eq!(told(&mut vehicle, Alerts::TOF_LOST | Alerts::FLOW_LOST, 200), 0);
    assert_eq!(told(&mut vehicle, Alerts::NONE, 400), 0);
    assert_eq!(told(&mut vehicle, Alerts::TOF_LOST, 600), 1);
}

#[test]
fn there_is_room_for_eight_clients_and_those_that_fall_silent_make_room() {
    let (mut mavlink, mut vehicle) = (Mavlink::new(IDENTITY), Vehicle::standing());
    for id in 0..=CLIENTS as u8 {
        let mut station = Station::new(id);
        let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
        station.asks(Instant::ZERO, &mut mavlink, &mut vehicle, &heartbeat);
    }
    assert_eq!(mavlink.refused(), 1);
    assert_eq!(vehicle.alive.len(), CLIENTS);
    assert!(matches!(vehicle.alive.first(), Some(Requester::Mavlink { .. })));
    polled(&mut mavlink, &mut vehicle, 40_000, 40_020);
    let mut late = Station::new(99);
    late.asks(Instant::from_secs(41), &mut mavlink, &mut vehicle, &MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
    assert_eq!(mavlink.refused(), 1);
}

#[test]
fn datagrams_that_are_not_mavlink_take_no_place() {
    let (mut mavlink, mut vehicle) = (Mavlink::new(IDENTITY), Vehicle::standing());
    let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
    let frame = Station::new(0).says(&heartbeat);
    let half = frame.len() / 2;
    let garbage =
        [&b"takeoff"[..], &frame[..half], &[b"GET / HTTP/1.1\r\n\r\n", frame.as_slice()].concat(), &[], &[0xFD; 40]]
            .map(<[u8]>::to_vec);
    for (id, bytes) in (0..200).zip(garbage.iter().cycle()) {
        mavlink.hear(Instant::ZERO, id, bytes, &mut vehicle, &mut |_, _| panic!("it is answered"));
    }
    polled(&mut mavlink, &mut vehicle, 0, 100);
    assert_eq!((mavlink.refused(), vehicle.alive.len()), (200, 0));
    let answers = Station::new(201).asks(Instant::from_millis(100), &mut mavlink, &mut vehicle, &arm());
    assert_eq!((vehicle.guided.len(), answers.is_empty()), (1, true), "it waits to be seen armed");
}

#[test]
fn the_commander_is_a_connection_and_not_a_number() {
    let (mut mavlink, mut vehicle) = (Mavlink::new(IDENTITY), Vehicle::flying());
    let (mut one, mut two) = (Station::new(1), Station::new(7));
    let at = Instant::from_millis;
    let hold = command(MavCmd::MAV_CMD_NAV_LOITER_UNLIM, [0.0; 7]);
    let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
    one.asks(at(0), &mut mavlink, &mut vehicle, &hold);
    assert_eq!(vehicle.guided.len(), 1);
    // Of the same system and component.
    let answers = two.asks(at(100), &mut mavlink, &mut vehicle, &hold);
    assert_eq!(result(&answers), Some(MavResult::MAV_RESULT_NOT_IN_CONTROL));
    mavlink.close(1, &mut vehicle);
    for ms in (200..10_000).step_by(200) {
        two.asks(at(ms), &mut mavlink, &mut vehicle, &heartbeat);
        assert!(ms < 3_000 || !vehicle.lease.is_sign_due(at(ms)), "{ms} ms: another's heartbeats keep it in the air");
    }
    vehicle.guided.clear();
    two.asks(at(10_000), &mut mavlink, &mut vehicle, &hold);
    assert_eq!(vehicle.guided.len(), 1, "it takes over");
}

#[test]
fn a_command_that_a_network_has_held_up_is_refused_and_what_ends_a_flight_is_done() {
    let (mut mavlink, mut vehicle, mut station) = (Mavlink::new(IDENTITY), Vehicle::flying(), Station::new(1));
    let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
    let hold = command(MavCmd::MAV_CMD_NAV_LOITER_UNLIM, [0.0; 7]);
    let land = command(MavCmd::MAV_CMD_NAV_LAND, [0.0; 7]);
    let (mut ms, mut said) = (0, 0);
    for held in [3_000, 5_000, 20_000] {
        for _ in 0..5 {
            station.asks(Instant::from_millis(ms), &mut mavlink, &mut vehicle, &heartbeat);
            ms += 1_000;
        }
        // What it has said meanwhile comes at once.
        ms += held - 1_000;
        (0..held / 1_000)
            .for_each(|_| _ = station.asks(Instant::from_millis(ms), &mut mavlink, &mut vehicle, &heartbeat));
        let answers = station.asks(Instant::from_millis(ms), &mut mavlink, &mut vehicle, &hold);
        assert_eq!(result(&answers), Some(MavResult::MAV_RESULT_TEMPORARILY_REJECTED), "held for {held} ms");
        said += answers.iter().filter(|answer| matches!(answer, MavMessage::STATUSTEXT(_))).count();
        assert_eq!(vehicle.guided, [], "it is not done");
        station.asks(Instant::from_millis(ms + 10), &mut mavlink, &mut vehicle, &land);
        assert_eq!(vehicle.guided.drain(..).count(), 1, "it lands");
        ms += 500;
        station.asks(Instant::from_millis(ms), &mut mavlink, &mut vehicle, &hold);
        assert_eq!(vehicle.guided.drain(..).count(), 1, "what comes after that is fresh");
    }
    assert!(said > 0);
}

#[test]
fn a_program_that_comes_and_asks_at_once_is_not_taken_for_held_up() {
    let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
    let hold = command(MavCmd::MAV_CMD_NAV_LOITER_UNLIM, [0.0; 7]);
    // At any time of the vehicle's.
    for begun in [0, 1_000, 40_000] {
        let (mut mavlink, mut vehicle, mut station) = (Mavlink::new(IDENTITY), Vehicle::flying(), Station::new(1));
        for ms in [begun, begun + 5, begun + 25, begun + 3_000, begun + 3_005] {
            let now = Instant::from_millis(ms);
            station.asks(now, &mut mavlink, &mut vehicle, &heartbeat);
            let answers = station.asks(now, &mut mavlink, &mut vehicle, &hold);
            assert_ne!(result(&answers), Some(MavResult::MAV_RESULT_TEMPORARILY_REJECTED), "{ms} ms");
        }
        assert!(!vehicle.guided.is_empty());
    }
}

#[test]
fn a_program_that_streams_is_obeyed_again_when_its_heartbeats_come_at_their_pace() {
    let (mut mavlink, mut vehicle, mut station) = (Mavlink::new(IDENTITY), Vehicle::flying(), Station::new(1));
    let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
    let hold = command(MavCmd::MAV_CMD_NAV_LOITER_UNLIM, [0.0; 7]);
    let ping = MavMessage::TIMESYNC(TIMESYNC_DATA::default());
    // Twenty frames a second without a pause, a heartbeat a second; held up from 5 s to 8 s.
    let mut obeyed = [0; 12];
    for ms in (0..12_000).step_by(50) {
        if (5_000..8_000).contains(&ms) {
            continue;
        }
        let now = Instant::from_millis(ms);
        let from = if ms == 8_000 { 5_000 } else { ms };
        for said in (from..=ms).step_by(50) {
            if said % 1_000 == 0 {
                station.asks(now, &mut mavlink, &mut vehicle, &heartbeat);
            }
            station.asks(now, &mut mavlink, &mut vehicle, &ping);
            if said % 200 == 100 {
                vehicle.guided.clear();
                station.asks(now, &mut mavlink, &mut vehicle, &hold);
                obeyed[said as usize / 1_000] += vehicle.guided.len();
            }
        }
    }
    assert_eq!(obeyed[..5], [5; 5]);
    assert_eq!(obeyed[6..8], [0; 2], "those behind the second heartbeat");
    assert_eq!(obeyed[9..], [5; 3], "it is back");
}

#[test]
fn what_lay_in_a_queue_is_refused_and_what_ends_a_flight_is_done() {
    let (mut mavlink, mut vehicle, mut station) = (Mavlink::<u8>::new(IDENTITY), Vehicle::flying(), Station::new(1));
    let mut late = |mavlink: &mut Mavlink<u8>, vehicle: &mut Vehicle, message: &MavMessage| {
        let (bytes, mut sent) = (station.says(message), Vec::new());
        mavlink.hear_late(Instant::from_secs(1), 1, true, &bytes, vehicle, &mut |_, frame| sent.extend(frame));
        station.heard.clear();
        station.hears(&sent);
        std::mem::take(&mut station.heard)
    };
    let answers = late(&mut mavlink, &mut vehicle, &command(MavCmd::MAV_CMD_NAV_LOITER_UNLIM, [0.0; 7]));
    assert_eq!(result(&answers), Some(MavResult::MAV_RESULT_TEMPORARILY_REJECTED), "{answers:?}");
    let (target_system, target_component) = (7, 1);
    let place = SET_POSITION_TARGET_LOCAL_NED_DATA { target_system, target_component, ..Default::default() };
    let sticks = MANUAL_CONTROL_DATA { target: 7, x: 500, ..Default::default() };
    let parameter = PARAM_SET_DATA { target_system, target_component, ..Default::default() };
    for message in [
        MavMessage::SET_POSITION_TARGET_LOCAL_NED(place),
        MavMessage::MANUAL_CONTROL(sticks),
        MavMessage::PARAM_SET(parameter),
        arm(),
    ] {
        late(&mut mavlink, &mut vehicle, &message);
    }
    assert_eq!((vehicle.guided.len(), vehicle.steered.len()), (0, 0));
    // A question is answered, and what ends a flight is done.
    let asked = late(&mut mavlink, &mut vehicle, &command(MavCmd::MAV_CMD_REQUEST_MESSAGE, [148.0; 7]));
    assert_eq!(result(&asked), Some(MavResult::MAV_RESULT_TEMPORARILY_REJECTED), "a command is a command");
    assert!(!late(&mut mavlink, &mut vehicle, &MavMessage::TIMESYNC(TIMESYNC_DATA::default())).is_empty());
    let kill = command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, [0.0, 21_196.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    for (message, kind) in [(command(MavCmd::MAV_CMD_NAV_LAND, [0.0; 7]), GuidedKind::Land), (kill, GuidedKind::Kill)] {
        late(&mut mavlink, &mut vehicle, &message);
        assert_eq!(vehicle.guided.last().map(|command| command.kind), Some(kind));
    }
}

#[test]
fn what_the_vehicle_has_said_itself_does_not_come_back() {
    let key = SigningKey::from_passphrase("a phrase");
    let (mut mavlink, mut vehicle) = (Mavlink::new(IDENTITY).with_key(key, 1_000), Vehicle::standing());
    mavlink.open(Instant::ZERO, 1_u8, true);
    for ms in (0..20_000).step_by(20) {
        let now = Instant::from_millis(ms);
        let mut said = Vec::new();
        mavlink.poll(now, &mut vehicle, &mut |_, frame| said.push(frame.to_vec()));
        // To the stream it was sent to, and as datagrams.
        for frame in &said {
            for client in [1, 2] {
                mavlink.hear(now, client, frame, &mut vehicle, &mut |_, _| {});
            }
        }
        assert!(!mavlink.is_believed(1) && !mavlink.is_believed(2), "{ms} ms");
    }
    assert_eq!(vehicle.alive, []);
}

#[test]
fn only_the_key_that_is_derived_for_signing_signs() {
    let key = Key::generate(1, core::array::from_fn(|place| place as u8 ^ 0x5A)).expect("random enough");
    let (mut mavlink, mut vehicle) =
        (Mavlink::new(IDENTITY).with_key(SigningKey::of(&key), 1_000), Vehicle::standing());
    let raw = SigningKey::new(*key.bytes());
    // What a page's address ends with, as bytes, and as the digits that people see.
    let page = key.purpose(b"stampfly-webpage");
    let digits: String = page.iter().map(|byte| format!("{byte:02x}")).collect();
    let typed: String = key.bytes().iter().map(|byte| format!("{byte:02x}")).collect();
    let purpose = SigningKey::new(*key.phrase().as_str().as_bytes().first_chunk().expect("64 digits"));
    let others = [
        raw,
        SigningKey::new(page),
        SigningKey::from_passphrase(&digits),
        SigningKey::from_passphrase(&typed),
        purpose,
    ];
    let all = others.into_iter().map(|key| (key, false)).chain([(SigningKey::of(&key), true)]);
    for (client, (signing, is_believed)) in (1..).zip(all) {
        let (mut room, mut signer) = ([0; LONGEST], Signer::new(signing, 0, 2_000));
        let frame = MavlinkWriter::new(255, 190).write_signed(Instant::ZERO, &arm(), &mut signer, &mut room);
        mavlink.hear(Instant::ZERO, client, frame.expect("there is room"), &mut vehicle, &mut |_, _| {});
        assert_eq!(mavlink.is_believed(client), is_believed, "{client}");
        assert_eq!(vehicle.guided.len(), usize::from(is_believed), "{client}");
    }
}

#[test]
fn every_station_is_told_what_was_done_and_by_whom_once() {
    let (mut mavlink, mut vehicle) = (Mavlink::new(IDENTITY), Vehicle::standing());
    for client in [1, 2] {
        mavlink.open(Instant::ZERO, client, true);
    }
    let mut texts = |vehicle: &mut Vehicle, from| {
        let sent = polled(&mut mavlink, vehicle, from, from + 200);
        let texts = sent.into_iter().filter_map(|(to, message)| match message {
            MavMessage::STATUSTEXT(text) => Some((to, text.text.to_str().expect("text").to_owned())),
            _ => None,
        });
        texts.collect::<Vec<_>>()
    };
    assert_eq!(texts(&mut vehicle, 0), []);
    let done = [(Requester::Page(3), GuidedKind::Arm), (Requester::Link(2), GuidedKind::Kill)];
    vehicle.told.extend(done.map(|(requester, kind)| CommandNotice { requester, what: Asked::Command(kind) }));
    let wanted = ["page 3: arm", "the station with the key, line 2: KILL"];
    let mut heard = texts(&mut vehicle, 200);
    heard.sort_by_key(|(to, _)| *to);
    assert_eq!(heard, [1, 2].map(|to| wanted.map(|text| (to, text.to_owned()))).concat());
    assert_eq!(texts(&mut vehicle, 400), [], "once");
    vehicle.told.push(CommandNotice { requester: Requester::Page(3), what: Asked::Left });
    assert_eq!(texts(&mut vehicle, 600).len(), 2);
}

#[test]
fn a_station_whose_clock_is_ahead_does_not_lock_others_out() {
    let key = SigningKey::from_passphrase("a phrase");
    let (mut mavlink, mut vehicle) = (Mavlink::new(IDENTITY).with_key(key.clone(), 1_000), Vehicle::standing());
    let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
    let mut say = |mavlink: &mut Mavlink<u8>, id: u8, ms, signer: &mut Signer| {
        let (mut room, now) = ([0; LONGEST], Instant::from_millis(ms));
        let frame = MavlinkWriter::new(200 + id, 190).write_signed(now, &heartbeat, signer, &mut room);
        let mut newest = 0;
        mavlink.hear(now, id, frame.expect("there is room"), &mut vehicle, &mut |_, frame| {
            let mut decoder = MavlinkDecoder::<MavMessage>::new();
            let heard = frame.iter().find_map(|byte| decoder.feed(*byte).and_then(|frame| frame.signature));
            newest = newest.max(heard.map_or(0, |signature| signature.time));
        });
        newest
    };
    let month = 30 * 86_400 * 100_000;
    say(&mut mavlink, 1, 20, &mut Signer::new(key.clone(), 0, 1_000 + month));
    assert!(mavlink.is_believed(1));
    // The vehicle tells one whose clock is right a time that it believes.
    let mut right = Signer::new(key, 0, 1_000);
    let told = say(&mut mavlink, 2, 40, &mut right);
    assert!(told > month && !mavlink.is_believed(2), "{told}");
    right.not_before(told);
    say(&mut mavlink, 2, 60, &mut right);
    assert!(mavlink.is_believed(2));
}

#[test]
fn an_interval_is_changed_and_put_back_and_a_message_is_sent_when_asked_for() {
    let (mut mavlink, mut vehicle, mut station) = (Mavlink::new(IDENTITY), Vehicle::standing(), Station::new(1));
    let interval =
        |id: f32, micros: f32| command(MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL, [id, micros, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let mut set = |vehicle: &mut Vehicle, mavlink: &mut Mavlink<u8>, id, micros| {
        result(&station.asks(Instant::ZERO, mavlink, vehicle, &interval(id, micros)))
    };
    let attitudes = |mavlink: &mut Mavlink<u8>, vehicle: &mut Vehicle, from| {
        let sent = polled(mavlink, vehicle, from, from + 1_000);
        sent.iter().filter(|(_, message)| matches!(message, MavMessage::ATTITUDE(_))).count()
    };
    assert_eq!(set(&mut vehicle, &mut mavlink, 30.0, 1.0), Some(MavResult::MAV_RESULT_ACCEPTED));
    assert_eq!(attitudes(&mut mavlink, &mut vehicle, 0), 50, "as often as it is polled, not more");
    assert_eq!(set(&mut vehicle, &mut mavlink, 30.0, -1.0), Some(MavResult::MAV_RESULT_ACCEPTED));
    assert_eq!(attitudes(&mut mavlink, &mut vehicle, 1_000), 0);
    assert_eq!(set(&mut vehicle, &mut mavlink, 30.0, f32::NAN), Some(MavResult::MAV_RESULT_DENIED));
    assert_eq!(set(&mut vehicle, &mut mavlink, 9_999.0, 0.0), Some(MavResult::MAV_RESULT_UNSUPPORTED));

    let version = command(MavCmd::MAV_CMD_REQUEST_MESSAGE, [148.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let answers = station.asks(Instant::ZERO, &mut mavlink, &mut vehicle, &version);
    let found = answers.iter().find_map(|answer| match answer {
        MavMessage::AUTOPILOT_VERSION(version) => Some(version.flight_sw_version),
        _ => None,
    });
    assert_eq!(found, Some(0x0102_03FF));
    assert_eq!(result(&answers), Some(MavResult::MAV_RESULT_ACCEPTED));
}

#[test]
fn a_motor_is_tested_in_per_cent_and_stopped_with_none() {
    let (mut mavlink, mut vehicle, mut station) = (Mavlink::new(IDENTITY), Vehicle::standing(), Station::new(1));
    for share in [10.0, 0.0] {
        let test = command(MavCmd::MAV_CMD_DO_MOTOR_TEST, [2.0, 0.0, share, 1.0, 0.0, 0.0, 0.0]);
        station.asks(Instant::ZERO, &mut mavlink, &mut vehicle, &test);
    }
    assert_eq!(vehicle.requests, [Request::TestMotor { motor: 2, duty: 0.1 }, Request::StopMotor]);
}

#[test]
fn bytes_of_strangers_are_answered_by_nothing() {
    let (mut mavlink, mut vehicle) = (Mavlink::new(IDENTITY), Vehicle::flying());
    let mut word = 1_u32;
    let noise: Vec<u8> = (0..100_000)
        .map(|_| {
            // xorshift
            word ^= word << 13;
            word ^= word >> 17;
            word ^= word << 5;
            if word.is_multiple_of(5) { 0xFD } else { (word >> 9) as u8 }
        })
        .collect();
    for part in noise.chunks(97) {
        mavlink.hear(Instant::ZERO, 1, part, &mut vehicle, &mut |_, frame| panic!("{frame:02x?}"));
    }
    assert!(vehicle.guided.is_empty() && vehicle.steered.is_empty() && vehicle.alive.is_empty());
}

/// Texts of a station, and results of the calibration command with their progress.
fn calibration_of(of: u8, sent: &[(u8, MavMessage)]) -> (Vec<String>, Vec<(MavResult, u8)>) {
    let (mut texts, mut results) = (Vec::new(), Vec::new());
    for (_, message) in sent.iter().filter(|(to, _)| *to == of) {
        match message {
            MavMessage::STATUSTEXT(text) if text.chunk_seq == 0 => {
                texts.push(text.text.to_str().expect("UTF-8").to_owned())
            }
            MavMessage::COMMAND_ACK(ack) if ack.command == MavCmd::MAV_CMD_PREFLIGHT_CALIBRATION => {
                results.push((ack.result, ack.progress));
            }
            _ => {}
        }
    }
    (texts, results)
}

/// A vehicle whose level is being calibrated for station 1, with a second station beside it.
fn calibrating() -> (Mavlink<u8>, Vehicle, Station) {
    let (mut mavlink, mut vehicle, mut station) = (Mavlink::new(IDENTITY), Vehicle::standing(), Station::new(1));
    let level = command(MavCmd::MAV_CMD_PREFLIGHT_CALIBRATION, [0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    let now = Instant::from_millis(20);
    let answers = station.asks(now, &mut mavlink, &mut vehicle, &level);
    let (texts, results) =
        calibration_of(1, &answers.into_iter().map(|answer| (1, answer)).collect::<Vec<(u8, MavMessage)>>());
    assert_eq!(results, [(MavResult::MAV_RESULT_IN_PROGRESS, u8::MAX)]);
    assert_eq!(texts[0], "[cal] calibration started: 2 level");
    assert_eq!(vehicle.requests, [Request::Calibrate(CalibrationKind::Level)]);
    // Asked again, because the acknowledgement was lost: it goes on.
    assert_eq!(result(&station.asks(now, &mut mavlink, &mut vehicle, &level)), Some(MavResult::MAV_RESULT_IN_PROGRESS));
    let mut other = Station::new(2);
    let answers = other.asks(now, &mut mavlink, &mut vehicle, &level);
    assert_eq!(result(&answers), Some(MavResult::MAV_RESULT_TEMPORARILY_REJECTED));
    assert_eq!(vehicle.requests.len(), 1);
    (mavlink, vehicle, station)
}

fn report(stage: CalibrationStage, progress: f32) -> CalibrationReport {
    CalibrationReport { kind: CalibrationKind::Level, stage, progress, ..Default::default() }
}

#[test]
fn a_calibration_is_in_progress_until_it_is_done_and_is_then_taken() {
    let (mut mavlink, mut vehicle, _) = calibrating();
    // What an earlier one has found is none of this one's.
    vehicle.publish_at(Instant::from_millis(10), Id::calibration_report, &report(CalibrationStage::Done, 1.0));
    let (_, results) = calibration_of(1, &polled(&mut mavlink, &mut vehicle, 40, 200));
    assert_eq!((results, vehicle.requests.len()), (vec![], 1));
    vehicle.publish_at(Instant::from_millis(200), Id::calibration_report, &report(CalibrationStage::Running, 0.4));
    let sent = polled(&mut mavlink, &mut vehicle, 200, 2_220);
    let (texts, results) = calibration_of(1, &sent);
    assert_eq!(results, [(MavResult::MAV_RESULT_IN_PROGRESS, 40); 5], "twice a second, and at once");
    assert_eq!(texts[1], "[cal] progress <40>");
    assert!(texts[0].starts_with("[cal] level: 40 %"), "{texts:?}");
    assert_eq!(calibration_of(2, &sent), (vec![], vec![]), "nothing of that is for others");
    let found = report(CalibrationStage::Done, 1.0);
    vehicle.publish_at(Instant::from_millis(2_300), Id::calibration_report, &found);
    let (texts, results) = calibration_of(1, &polled(&mut mavlink, &mut vehicle, 2_300, 4_000));
    assert_eq!(results, [(MavResult::MAV_RESULT_ACCEPTED, 100)]);
    assert_eq!(texts.last().expect("a text"), "[cal] calibration done: level");
    assert_eq!(vehicle.requests[1..], [Request::AcceptCalibration(found)]);
}

#[test]
fn a_calibration_that_ends_otherwise_is_not_taken_and_says_so() {
    for (stage, expected, text) in [
        (CalibrationStage::Cancelled, MavResult::MAV_RESULT_CANCELLED, "[cal] calibration cancelled"),
        (CalibrationStage::Armed, MavResult::MAV_RESULT_FAILED, "[cal] calibration failed: level"),
        (CalibrationStage::TimedOut, MavResult::MAV_RESULT_FAILED, "[cal] calibration failed: level"),
        (CalibrationStage::Implausible, MavResult::MAV_RESULT_FAILED, "[cal] calibration failed: level"),
    ] {
        let (mut mavlink, mut vehicle, _) = calibrating();
        vehicle.publish_at(Instant::from_millis(100), Id::calibration_report, &report(stage, 0.5));
        let (texts, results) = calibration_of(1, &polled(&mut mavlink, &mut vehicle, 100, 1_000));
        assert_eq!((results, vehicle.requests.len()), (vec![(expected, 100)], 1), "{stage:?}");
        assert_eq!(texts.last().expect("a text"), text);
    }
    // Somebody at the command line has begun another one.
    let (mut mavlink, mut vehicle, _) = calibrating();
    let other = CalibrationReport { kind: CalibrationKind::Magnetometer, ..report(CalibrationStage::Running, 0.1) };
    vehicle.publish_at(Instant::from_millis(100), Id::calibration_report, &other);
    let (_, results) = calibration_of(1, &polled(&mut mavlink, &mut vehicle, 100, 1_000));
    assert_eq!(results, [(MavResult::MAV_RESULT_CANCELLED, 100)]);
    // A vehicle that says nothing.
    let (mut mavlink, mut vehicle, _) = calibrating();
    let (_, results) = calibration_of(1, &polled(&mut mavlink, &mut vehicle, 100, 5_000));
    assert_eq!(results, [(MavResult::MAV_RESULT_FAILED, 0)]);
    // Whoever has asked is gone: nothing is taken.
    let (mut mavlink, mut vehicle, _) = calibrating();
    mavlink.close(1, &mut vehicle);
    vehicle.publish_at(Instant::from_millis(100), Id::calibration_report, &report(CalibrationStage::Done, 1.0));
    assert_eq!(calibration_of(1, &polled(&mut mavlink, &mut vehicle, 100, 1_000)), (vec![], vec![]));
    assert_eq!(vehicle.requests.len(), 1);
}

#[test]
fn what_cannot_be_calibrated_is_said_in_words_and_nothing_cancels_everything() {
    let (mut mavlink, mut vehicle, mut station) = (Mavlink::new(IDENTITY), Vehicle::standing(), Station::new(1));
    let mut ask = |vehicle: &mut Vehicle, parameters| {
        let command = command(MavCmd::MAV_CMD_PREFLIGHT_CALIBRATION, parameters);
        let answers = station.asks(Instant::from_millis(20), &mut mavlink, vehicle, &command);
        (result(&answers).expect("an answer"), answers.len() > 1)
    };
    let gyro = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(ask(&mut vehicle, gyro), (MavResult::MAV_RESULT_UNSUPPORTED, true));
    let both = [0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0];
    assert_eq!(ask(&mut vehicle, both), (MavResult::MAV_RESULT_DENIED, false));
    assert_eq!(vehicle.requests, []);
    assert_eq!(ask(&mut vehicle, [0.0; 7]), (MavResult::MAV_RESULT_ACCEPTED, false));
    assert_eq!(vehicle.requests, [Request::Calibrate(CalibrationKind::None)]);
}
