//! The mission protocol and what is flown of it, asked by a ground station made of the crate `mavlink` alone.
#![allow(deprecated, reason = "older programs send what the protocol has superseded")]

use crate::common::{Id, Vehicle};
use stampfly_link::mavlink::dialects::common::*;
use stampfly_link::mavlink::signing::{Signer, SigningKey, Verifier};
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter};
use stampfly_services::mavlink::{Identity, Mavlink};
use stampfly_types::messages::*;
use stampfly_types::{Instant, Vec3};

const IDENTITY: Identity =
    Identity { system: 7, kind: MavType::MAV_TYPE_QUADROTOR, take_off_height: 0.5, reach: 0.25, version: [1, 2, 3] };
const NO: MavMissionType = MavMissionType::MAV_MISSION_TYPE_MISSION;

/// No bytes.
const NOTHING: [u8; 0] = [];

type Answers = Vec<MavMessage>;

/// A vehicle and its service, and a station with the number 255.
struct Scene {
    mavlink: Mavlink<u8>,
    vehicle: Vehicle,
    now: Instant,
}

impl Scene {
    fn new(vehicle: Vehicle) -> Self {
        Self { mavlink: Mavlink::new(IDENTITY), vehicle, now: Instant::ZERO }
    }

    fn read(bytes: &[u8]) -> Answers {
        let mut decoder = MavlinkDecoder::<MavMessage>::new();
        bytes.iter().filter_map(|byte| decoder.feed(*byte).map(|frame| frame.message().expect("a message"))).collect()
    }

    fn hear(&mut self, from: u8, bytes: &[u8]) -> Vec<u8> {
        let mut sent = Vec::new();
        self.mavlink.hear(self.now, from, bytes, &mut self.vehicle, &mut |_, frame| sent.extend(frame));
        sent
    }

    fn says(&mut self, message: MavMessage) -> Answers {
        let mut bytes = [0; LONGEST];
        let frame = MavlinkWriter::new(255, 190).write(MavlinkVersion::V2, &message, &mut bytes).expect("a frame");
        let frame = frame.to_vec();
        Self::read(&self.hear(1, &frame))
    }

    /// Lets so much time pass, fifty times a second, with a heartbeat of the station twice a second if it is there.
    fn passes(&mut self, ms: u64, is_there: bool, mut fly: impl FnMut(&mut Vehicle)) -> Answers {
        let (end, mut sent) = (self.now.as_micros() / 1_000 + ms, Vec::new());
        for at in (self.now.as_micros() / 1_000 + 20..=end).step_by(20) {
            self.now = Instant::from_millis(at);
            if is_there && at % 500 == 0 {
                sent.extend(self.says(MavMessage::HEARTBEAT(HEARTBEAT_DATA::default())));
            }
            fly(&mut self.vehicle);
            let mut bytes = Vec::new();
            self.mavlink.poll(self.now, &mut self.vehicle, &mut |_, frame| bytes.extend(frame));
            sent.extend(Self::read(&bytes));
        }
        sent.retain(|message| {
            use MavMessage as M;
            matches!(
                message,
                M::MISSION_ACK(_) | M::MISSION_REQUEST_INT(_) | M::MISSION_ITEM_REACHED(_) | M::STATUSTEXT(_)
            )
        });
        sent
    }

    fn upload(&mut self, items: &[MISSION_ITEM_INT_DATA]) -> MavMissionResult {
        let mut answers = self.says(count(items.len()));
        for _ in 0..=items.len() {
            match &answers[..] {
                [MavMessage::MISSION_REQUEST_INT(request)] => {
                    let mut item = items[usize::from(request.seq)].clone();
                    item.seq = request.seq;
                    answers = self.says(MavMessage::MISSION_ITEM_INT(item));
                }
                [MavMessage::MISSION_ACK(ack), ..] => return ack.mavtype,
                other => panic!("{other:?}"),
            }
        }
        panic!("too many questions")
    }

    fn commands(&mut self, kind: MavCmd, p1: f32) -> MavResult {
        self.result_of(kind, p1).expect("acknowledged")
    }

    /// Of a command, if it is acknowledged at once.
    fn result_of(&mut self, kind: MavCmd, p1: f32) -> Option<MavResult> {
        let command = COMMAND_LONG_DATA {
            param1: p1,
            command: kind,
            target_system: 7,
            target_component: 1,
            ..Default::default()
        };
        let answers = self.says(MavMessage::COMMAND_LONG(command));
        answers.iter().find_map(|answer| match answer {
            MavMessage::COMMAND_ACK(ack) if ack.command == kind => Some(ack.result),
            _ => None,
        })
    }

    fn asked_of_vehicle(&mut self) -> Vec<(GuidedKind, Vec3)> {
        let all = std::mem::take(&mut self.vehicle.guided);
        all.into_iter().filter(|one| one.kind != GuidedKind::None).map(|one| (one.kind, one.position)).collect()
    }
}

fn count(count: usize) -> MavMessage {
    let count = count as u16;
    MavMessage::MISSION_COUNT(MISSION_COUNT_DATA { count, target_system: 7, target_component: 1, ..Default::default() })
}

fn item(command: MavCmd, [x, y, z]: [f32; 3]) -> MISSION_ITEM_INT_DATA {
    MISSION_ITEM_INT_DATA {
        command,
        frame: MavFrame::MAV_FRAME_LOCAL_NED,
        x: (x * 1e4) as i32,
        y: (y * 1e4) as i32,
        z,
        param4: f32::NAN,
        target_system: 7,
        target_component: 1,
        autocontinue: 1,
        ..Default::default()
    }
}

fn take_off() -> MISSION_ITEM_INT_DATA {
    item(MavCmd::MAV_CMD_NAV_TAKEOFF, [0.0, 0.0, -0.6])
}

fn way_point(place: [f32; 3]) -> MISSION_ITEM_INT_DATA {
    item(MavCmd::MAV_CMD_NAV_WAYPOINT, place)
}

fn land() -> MISSION_ITEM_INT_DATA {
    MISSION_ITEM_INT_DATA { x: i32::MAX, y: i32::MAX, ..item(MavCmd::MAV_CMD_NAV_LAND, [0.0; 3]) }
}

fn square() -> [MISSION_ITEM_INT_DATA; 4] {
    [take_off(), way_point([1.0, 0.0, -0.6]), way_point([1.0, 1.0, -0.6]), land()]
}

/// Does at once what it was last asked to.
fn obeys(vehicle: &mut Vehicle) {
    let Some(command) = vehicle.guided.last().copied() else { return };
    match command.kind {
        GuidedKind::TakeOff => vehicle.status(|status| status.phase = FlightPhase::Flying),
        GuidedKind::WayPoint => at(vehicle, command.position),
        GuidedKind::Land => vehicle.status(|status| (status.armed, status.phase) = (false, FlightPhase::IdleGround)),
        _ => {}
    }
}

fn at(vehicle: &mut Vehicle, position: Vec3) {
    let valid = Validity::TILT | Validity::POSITION_XY | Validity::POSITION_Z;
    vehicle.publish(Id::estimate_state, &StateEstimate { valid, position, ..Default::default() });
}

fn armed() -> Vehicle {
    let mut vehicle = Vehicle::standing();
    vehicle.status(|status| (status.armed, status.phase) = (true, FlightPhase::Armed));
    vehicle
}

#[test]
fn a_mission_is_uploaded_and_the_same_is_downloaded() {
    let mut scene = Scene::new(Vehicle::standing());
    assert_eq!(scene.upload(&square()), MavMissionResult::MAV_MISSION_ACCEPTED);
    let list = MISSION_REQUEST_LIST_DATA { target_system: 7, target_component: 1, ..Default::default() };
    let answers = scene.says(MavMessage::MISSION_REQUEST_LIST(list.clone()));
    assert!(matches!(&answers[..], [MavMessage::MISSION_COUNT(count)] if count.count == 4), "{answers:?}");
    for (seq, sent) in square().into_iter().enumerate() {
        let request =
            MISSION_REQUEST_INT_DATA { seq: seq as u16, target_system: 7, target_component: 1, mission_type: NO };
        let answers = scene.says(MavMessage::MISSION_REQUEST_INT(request));
        let [MavMessage::MISSION_ITEM_INT(item)] = &answers[..] else { panic!("{answers:?}") };
        assert!(item.param4.is_nan());
        let same = MISSION_ITEM_INT_DATA { param4: 0.0, ..item.clone() };
        let current = (seq == 0).into();
        let sent = MISSION_ITEM_INT_DATA {
            param4: 0.0,
            seq: seq as u16,
            current,
            target_system: 255,
            target_component: 190,
            ..sent
        };
        assert_eq!(same, sent);
    }
    let behind = MISSION_REQUEST_INT_DATA { seq: 4, target_system: 7, target_component: 1, mission_type: NO };
    let answers = scene.says(MavMessage::MISSION_REQUEST_INT(behind));
    let invalid = MavMissionResult::MAV_MISSION_INVALID_SEQUENCE;
    assert!(matches!(&answers[..], [MavMessage::MISSION_ACK(ack)] if ack.mavtype == invalid), "{answers:?}");

    // Fences are another mission, and there are none.
    let fence = MavMissionType::MAV_MISSION_TYPE_FENCE;
    let answers =
        scene.says(MavMessage::MISSION_REQUEST_LIST(MISSION_REQUEST_LIST_DATA { mission_type: fence, ..list }));
    assert!(matches!(&answers[..], [MavMessage::MISSION_COUNT(c)] if c.count == 0 && c.mission_type == fence));
    let clear = MISSION_CLEAR_ALL_DATA { target_system: 7, target_component: 1, ..Default::default() };
    scene.says(MavMessage::MISSION_CLEAR_ALL(clear));
    assert_eq!(scene.commands(MavCmd::MAV_CMD_MISSION_START, 0.0), MavResult::MAV_RESULT_DENIED, "there is none");
}

#[test]
fn an_item_that_does_not_come_is_asked_for_again_and_given_up_after_a_while() {
    let mut scene = Scene::new(Vehicle::standing());
    scene.says(count(2));
    // A round trip was never seen: after 0.9, 1.8, 3, 3, 3 s, and given up after another 3.
    assert_eq!(scene.passes(14_600, true, |_| {}).len(), 5);
    let asked = scene.passes(200, true, |_| {});
    let requests = asked.iter().filter(|message| matches!(message, MavMessage::MISSION_REQUEST_INT(_))).count();
    assert_eq!(requests, 0);
    let cancelled = MavMissionResult::MAV_MISSION_OPERATION_CANCELLED;
    assert!(matches!(asked.last(), Some(MavMessage::MISSION_ACK(ack)) if ack.mavtype == cancelled), "{asked:?}");
    let late = MavMessage::MISSION_ITEM_INT(take_off());
    let error = MavMissionResult::MAV_MISSION_ERROR;
    assert!(matches!(&scene.says(late)[..], [MavMessage::MISSION_ACK(ack)] if ack.mavtype == error));

    // One that comes twice, or too early, is passed over: the timer asks for the right one. It is
    // not named as MAV_MISSION_INVALID_SEQUENCE, because an acknowledgement that is no acceptance
    // ends the upload at its partner, and a network that delays or doubles a datagram would end it
    // so.
    scene.says(count(3));
    for (seq, next) in [(1, None), (0, Some(1)), (0, None), (2, None)] {
        let item = MISSION_ITEM_INT_DATA { seq, ..take_off() };
        let answers = scene.says(MavMessage::MISSION_ITEM_INT(item));
        let asked = answers.iter().map(|answer| match answer {
            MavMessage::MISSION_REQUEST_INT(request) => request.seq,
            other => panic!("{other:?}"),
        });
        assert!(asked.eq(next), "{answers:?}");
    }
    let asked = scene.passes(260, true, |_| {});
    assert!(matches!(&asked[..], [MavMessage::MISSION_REQUEST_INT(request)] if request.seq == 1), "{asked:?}");
    // Another station has to wait.
    let other = {
        let mut bytes = [0; LONGEST];
        let frame = MavlinkWriter::new(254, 190).write(MavlinkVersion::V2, &count(1), &mut bytes).expect("a frame");
        Scene::read(&scene.hear(2, frame))
    };
    let denied = MavMissionResult::MAV_MISSION_DENIED;
    assert!(matches!(&other[..], [MavMessage::MISSION_ACK(ack)] if ack.mavtype == denied), "{other:?}");
}

#[test]
fn what_it_cannot_fly_is_refused_with_the_reason_and_the_old_mission_stays() {
    let mut scene = Scene::new(Vehicle::standing());
    assert_eq!(scene.upload(&square()), MavMissionResult::MAV_MISSION_ACCEPTED);
    let at = way_point;
    let framed = |frame, x, y, z| MISSION_ITEM_INT_DATA { frame, x, y, z, ..way_point([0.0; 3]) };
    let global = MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT;
    use MavMissionResult as R;
    let refusals = [
        (item(MavCmd::MAV_CMD_DO_SET_SERVO, [0.0; 3]), R::MAV_MISSION_UNSUPPORTED),
        (framed(global, 470_000_000, 80_000_000, 1.0), R::MAV_MISSION_UNSUPPORTED_FRAME),
        (framed(MavFrame::MAV_FRAME_GLOBAL_TERRAIN_ALT, 1, 1, 1.0), R::MAV_MISSION_UNSUPPORTED_FRAME),
        (at([2_000.0, 0.0, -1.0]), R::MAV_MISSION_INVALID_PARAM5_X),
        (at([0.0, 2_000.0, -1.0]), R::MAV_MISSION_INVALID_PARAM6_Y),
        (at([0.0, 0.0, f32::NAN]), R::MAV_MISSION_INVALID_PARAM7),
        (MISSION_ITEM_INT_DATA { param1: -1.0, ..at([0.0; 3]) }, R::MAV_MISSION_INVALID_PARAM1),
        (MISSION_ITEM_INT_DATA { param2: f32::INFINITY, ..at([0.0; 3]) }, R::MAV_MISSION_INVALID_PARAM2),
        (MISSION_ITEM_INT_DATA { param4: 1e9, ..at([0.0; 3]) }, R::MAV_MISSION_INVALID_PARAM4),
        (item(MavCmd::MAV_CMD_NAV_TAKEOFF, [0.0, 0.0, 1.0]), R::MAV_MISSION_INVALID_PARAM7),
        (
            MISSION_ITEM_INT_DATA { param2: -5.0, ..item(MavCmd::MAV_CMD_DO_CHANGE_SPEED, [0.0; 3]) },
            R::MAV_MISSION_INVALID_PARAM2,
        ),
    ];
    for (wrong, why) in refusals {
        assert_eq!(scene.upload(&[take_off(), wrong.clone()]), why, "{wrong:?}");
    }
    assert_eq!(scene.upload(&vec![take_off(); 65]), R::MAV_MISSION_NO_SPACE);
    let list = MISSION_REQUEST_LIST_DATA { target_system: 7, target_component: 1, ..Default::default() };
    let answers = scene.says(MavMessage::MISSION_REQUEST_LIST(list));
    assert!(matches!(&answers[..], [MavMessage::MISSION_COUNT(count)] if count.count == 4), "{answers:?}");

    // As soon as it knows where on Earth it is, places there can be flown to.
    let origin = SET_GPS_GLOBAL_ORIGIN_DATA {
        latitude: 470_000_000,
        longitude: 80_000_000,
        target_system: 7,
        ..Default::default()
    };
    assert_eq!(scene.says(MavMessage::SET_GPS_GLOBAL_ORIGIN(origin)).len(), 2);
    assert_eq!(scene.upload(&[framed(global, 470_000_100, 80_000_000, 1.0)]), R::MAV_MISSION_ACCEPTED);
    assert_eq!(scene.upload(&[framed(global, 480_000_000, 80_000_000, 1.0)]), R::MAV_MISSION_INVALID_PARAM5_X);
}

#[test]
fn a_mission_is_flown_step_by_step_and_stations_are_told() {
    let mut scene = Scene::new(armed());
    scene.upload(&square());
    assert_eq!(scene.commands(MavCmd::MAV_CMD_MISSION_START, 0.0), MavResult::MAV_RESULT_ACCEPTED);
    let told = scene.passes(3_000, true, obeys);
    let reached: Vec<_> = told
        .iter()
        .filter_map(|message| match message {
            MavMessage::MISSION_ITEM_REACHED(reached) => Some(reached.seq),
            _ => None,
        })
        .collect();
    assert_eq!(reached, [0, 1, 2, 3]);
    assert!(matches!(told.last(), Some(MavMessage::STATUSTEXT(text)) if text.text.to_str() == Ok("mission complete")));
    let high = |x, y| Vec3::new(x, y, -0.6);
    let hold = (GuidedKind::Hold, Vec3::default());
    assert_eq!(
        scene.asked_of_vehicle(),
        [
            (GuidedKind::TakeOff, high(0.0, 0.0)),
            hold,
            (GuidedKind::WayPoint, high(1.0, 0.0)),
            (GuidedKind::WayPoint, high(1.0, 1.0)),
            (GuidedKind::Land, Vec3::default())
        ]
    );
}

#[test]
fn a_mission_that_begins_with_a_place_takes_off_first_and_stays_there_as_long_as_it_says() {
    let mut scene = Scene::new(armed());
    scene.upload(&[MISSION_ITEM_INT_DATA { param1: 2.0, ..way_point([1.0, 0.0, -0.8]) }]);
    assert_eq!(scene.commands(MavCmd::MAV_CMD_MISSION_START, 0.0), MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(scene.passes(1_900, true, obeys), [], "it stays");
    assert_eq!(scene.asked_of_vehicle().first(), Some(&(GuidedKind::TakeOff, Vec3::new(0.0, 0.0, -0.5))));
    assert_eq!(scene.passes(400, true, |_| {}).len(), 2, "reached, and over");
}

#[test]
fn nobody_is_heard_and_the_runner_gives_no_sign_of_life_in_his_place() {
    let mut scene = Scene::new(armed());
    scene.upload(&square());
    assert_eq!(scene.commands(MavCmd::MAV_CMD_MISSION_START, 0.0), MavResult::MAV_RESULT_ACCEPTED);
    scene.passes(1_000, true, |vehicle| vehicle.status(|status| status.phase = FlightPhase::Flying));
    scene.asked_of_vehicle();
    let told = scene.passes(4_000, false, |_| {});
    assert!(
        matches!(told.last(), Some(MavMessage::STATUSTEXT(text)) if text.text.to_str() == Ok("mission halted: nobody is heard")),
        "{told:?}"
    );
    let place = Vec3::new(1.0, 0.0, -0.6);
    scene.passes(2_000, false, |vehicle| at(vehicle, place));
    assert_eq!(scene.asked_of_vehicle(), [], "although the way-point is reached");
    assert_eq!(scene.vehicle.lease.holder(scene.now), None);
}

#[test]
fn a_pilot_the_failsafe_and_other_commands_end_it_and_it_can_be_continued() {
    let halted = |change: fn(&mut FlightStatus)| {
        let mut scene = Scene::new(armed());
        scene.upload(&square());
        assert_eq!(scene.commands(MavCmd::MAV_CMD_MISSION_START, 0.0), MavResult::MAV_RESULT_ACCEPTED);
        scene.passes(200, true, |vehicle| vehicle.status(|status| status.phase = FlightPhase::Flying));
        scene.vehicle.status(change);
        scene.passes(100, true, |_| {});
        scene.asked_of_vehicle();
        let place = Vec3::new(1.0, 0.0, -0.6);
        scene.passes(500, true, |vehicle| at(vehicle, place));
        assert_eq!(scene.asked_of_vehicle(), []);
        scene
    };
    halted(|status| status.commander = CommandSource::Failsafe);
    halted(|status| status.phase = FlightPhase::Landing);
    halted(|status| status.armed = false);
    let mut scene = halted(|status| status.commander = CommandSource::Pilot);
    assert_eq!(scene.commands(MavCmd::MAV_CMD_MISSION_START, 0.0), MavResult::MAV_RESULT_DENIED, "he still flies");
    scene.vehicle.status(|status| status.commander = CommandSource::Guided);
    assert_eq!(scene.commands(MavCmd::MAV_CMD_DO_PAUSE_CONTINUE, 1.0), MavResult::MAV_RESULT_ACCEPTED);
    scene.passes(100, true, |_| {});
    assert_eq!(scene.asked_of_vehicle()[1], (GuidedKind::WayPoint, Vec3::new(1.0, 0.0, -0.6)), "the same step again");
    // A pause, which is a command of its own.
    assert_eq!(scene.commands(MavCmd::MAV_CMD_DO_PAUSE_CONTINUE, 0.0), MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(scene.asked_of_vehicle().last(), Some(&(GuidedKind::Hold, Vec3::default())));
    scene.passes(500, true, |_| {});
    assert_eq!(scene.asked_of_vehicle(), []);
}

#[test]
fn a_mission_is_not_replaced_while_it_is_flown_and_starts_right_after_arming() {
    let mut scene = Scene::new(Vehicle::standing());
    scene.upload(&square());
    assert_eq!(scene.commands(MavCmd::MAV_CMD_MISSION_START, 0.0), MavResult::MAV_RESULT_DENIED, "not armed");
    assert_eq!(scene.result_of(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 1.0), None, "it is not armed yet");
    assert_eq!(scene.commands(MavCmd::MAV_CMD_MISSION_START, 0.0), MavResult::MAV_RESULT_ACCEPTED);
    scene.passes(100, true, |_| {});
    scene.vehicle.status(|status| (status.armed, status.phase) = (true, FlightPhase::Armed));
    scene.passes(100, true, |_| {});
    assert_eq!(scene.asked_of_vehicle().last().map(|(kind, _)| *kind), Some(GuidedKind::TakeOff));
    assert_eq!(scene.upload(&square()), MavMissionResult::MAV_MISSION_DENIED);
}

#[test]
fn a_command_and_an_item_of_another_dialect_are_answered() {
    let mut scene = Scene::new(Vehicle::standing());
    // COMMAND_LONG and COMMAND_INT with the number 42424, which no dialect has.
    for id in [75, 76] {
        let mut payload = [0; 33];
        payload[28..32].copy_from_slice(&[0xB8, 0xA5, 7, 1]);
        let mut bytes = [0; LONGEST];
        let frame =
            MavlinkWriter::new(255, 190).write_payload::<MavMessage>(id, &payload, &mut bytes).expect("a frame");
        let answer = scene.hear(1, frame);
        assert_eq!(answer[0], 0xFD);
        assert_eq!(answer[7..13], [77, 0, 0, 0xB8, 0xA5, MavResult::MAV_RESULT_UNSUPPORTED as u8]);
        assert_eq!(answer[13..20], [0, 0, 0, 0, 0, 255, 190], "for the station that has asked");
        // Not for this vehicle.
        payload[30] = 8;
        let frame =
            MavlinkWriter::new(255, 190).write_payload::<MavMessage>(id, &payload, &mut bytes).expect("a frame");
        assert_eq!(scene.hear(1, frame), NOTHING);
    }
    scene.says(count(1));
    let mut payload = [0; 38];
    payload[28..34].copy_from_slice(&[0, 0, 0xB8, 0xA5, 7, 1]);
    let mut bytes = [0; LONGEST];
    let frame = MavlinkWriter::new(255, 190).write_payload::<MavMessage>(73, &payload, &mut bytes).expect("a frame");
    let answers = Scene::read(&scene.hear(1, frame));
    let unsupported = MavMissionResult::MAV_MISSION_UNSUPPORTED;
    assert!(matches!(&answers[..], [MavMessage::MISSION_ACK(ack)] if ack.mavtype == unsupported), "{answers:?}");
}

#[test]
fn with_a_key_only_what_is_signed_does_anything_and_strangers_hear_nothing() {
    let key = SigningKey::from_passphrase("a long sentence that nobody guesses");
    let mut scene = Scene::new(Vehicle::standing());
    scene.mavlink = Mavlink::new(IDENTITY).with_key(key.clone(), 1_000_000);
    let kill = |signer: Option<&mut Signer>| {
        let command = COMMAND_LONG_DATA {
            command: MavCmd::MAV_CMD_DO_FLIGHTTERMINATION,
            param1: 1.0,
            target_system: 7,
            target_component: 1,
            ..Default::default()
        };
        let (message, mut bytes) = (MavMessage::COMMAND_LONG(command), [0; LONGEST]);
        let mut writer = MavlinkWriter::new(255, 190);
        let frame = match signer {
            Some(signer) => writer.write_signed(Instant::ZERO, &message, signer, &mut bytes),
            None => writer.write(MavlinkVersion::V2, &message, &mut bytes),
        };
        frame.expect("a frame").to_vec()
    };
    let wrong = SigningKey::from_passphrase("another");
    for frame in [kill(None), kill(Some(&mut Signer::new(wrong, 0, 2_000_000)))] {
        assert_eq!(scene.hear(1, &frame), NOTHING, "no answer");
    }
    assert_eq!(scene.vehicle.guided, []);
    assert_eq!(scene.mavlink.untrusted(), 2);
    let mut sent = Vec::new();
    scene.now = Instant::from_secs(10);
    scene.mavlink.poll(scene.now, &mut scene.vehicle, &mut |to, frame| sent.push((*to, frame.to_vec())));
    assert_eq!(sent, [], "a stranger is not sent to");

    let mut signer = Signer::new(key.clone(), 0, 2_000_000);
    let frame = kill(Some(&mut signer));
    let answer = scene.hear(1, &frame);
    let mut verifier = Verifier::new(key, 0);
    let mut decoder = MavlinkDecoder::<MavMessage>::new();
    let judged: Vec<_> =
        answer.iter().filter_map(|byte| decoder.feed(*byte).map(|frame| verifier.verify(&frame))).collect();
    assert_eq!(judged, [Ok(())], "the answer is signed too");
    assert_eq!(scene.vehicle.guided.len(), 1);
    assert_eq!(scene.hear(1, &frame), NOTHING, "sent again");
    assert_eq!(scene.mavlink.untrusted(), 3);

    // On a cable nothing has to be signed.
    scene.mavlink.open_local(scene.now, 2, false);
    assert_ne!(scene.hear(2, &kill(None)), NOTHING);
    assert_eq!(scene.vehicle.guided.len(), 2);
    let mut told = Vec::new();
    scene.now = Instant::from_secs(20);
    scene.mavlink.poll(scene.now, &mut scene.vehicle, &mut |to, frame| {
        if *to == 2 {
            told.extend(frame.to_vec());
        }
    });
    let text = Scene::read(&told).into_iter().find_map(|message| match message {
        MavMessage::STATUSTEXT(text) => text.text.to_str().ok().map(str::to_owned),
        _ => None,
    });
    assert_eq!(text.as_deref(), Some("3 frames not signed with the key, ignored"));
}

#[test]
fn strangers_do_not_keep_a_station_with_the_key_out() {
    let key = SigningKey::from_passphrase("a long sentence that nobody guesses");
    let mut scene = Scene::new(armed());
    scene.mavlink = Mavlink::new(IDENTITY).with_key(key.clone(), 0);
    for stranger in 10..60 {
        scene.hear(stranger, b"\xFD nothing");
    }
    let (mut bytes, mut signer) = ([0; LONGEST], Signer::new(key, 0, 1));
    let message = MavMessage::PARAM_REQUEST_READ(PARAM_REQUEST_READ_DATA {
        target_system: 7,
        target_component: 1,
        ..Default::default()
    });
    let frame = MavlinkWriter::new(255, 190).write_signed(Instant::ZERO, &message, &mut signer, &mut bytes);
    assert_ne!(scene.hear(1, frame.expect("a frame")), NOTHING);
}

#[test]
fn a_vehicle_with_less_memory_says_that_there_is_no_space_and_takes_what_there_is_space_for() {
    let mut mavlink = Mavlink::<u8, 1, 4>::for_clients(IDENTITY);
    let mut vehicle = Vehicle::standing();
    let mut says = |message: MavMessage| {
        let (mut bytes, mut sent) = ([0; LONGEST], Vec::new());
        let frame = MavlinkWriter::new(255, 190).write(MavlinkVersion::V2, &message, &mut bytes).expect("a frame");
        mavlink.hear(Instant::ZERO, 1, frame, &mut vehicle, &mut |_, frame| sent.extend(frame));
        Scene::read(&sent)
    };
    match &says(count(5))[..] {
        [MavMessage::MISSION_ACK(ack)] => assert_eq!(ack.mavtype, MavMissionResult::MAV_MISSION_NO_SPACE),
        other => panic!("{other:?}"),
    }
    let mut answers = says(count(4));
    for seq in 0..4 {
        assert!(
            matches!(&answers[..], [MavMessage::MISSION_REQUEST_INT(request)] if request.seq == seq),
            "{answers:?}"
        );
        answers =
            says(MavMessage::MISSION_ITEM_INT(MISSION_ITEM_INT_DATA { seq, ..way_point([f32::from(seq), 0.0, -1.0]) }));
    }
    match &answers[..] {
        [MavMessage::MISSION_ACK(ack), MavMessage::MISSION_CURRENT(state)] => {
            assert_eq!((ack.mavtype, state.total), (MavMissionResult::MAV_MISSION_ACCEPTED, 4));
        }
        other => panic!("{other:?}"),
    }
}
