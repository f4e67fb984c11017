//! One serial line: a person types, a ground station speaks MAVLink, and this family's own station asks in tunnels of it.

use crate::common::{Board, Id, Two, Vehicle, topics};
use proptest::prelude::*;
use stampfly_flight::console::Request;
use stampfly_link::mavlink::dialects::common::{COMMAND_LONG_DATA, HEARTBEAT_DATA, MavCmd, MavMessage, MavType};
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter, Tunnel};
use stampfly_link::secure::Payload;
use stampfly_services::cable::{Assembly, BODY, Cable, Envelope, PART, PAUSE, Part, Split, TYPE, fingerprint};
use stampfly_services::mavlink::Identity;
use stampfly_services::{Asked, CommandNotice, Requester, VehicleAccess};
use stampfly_types::messages::*;
use stampfly_types::{Duration, Instant};

const IDENTITY: Identity =
    Identity { system: 1, kind: MavType::MAV_TYPE_QUADROTOR, take_off_height: 0.5, reach: 0.25, version: [0, 2, 0] };

/// Both ends of a line.
struct Line {
    cable: Cable<8>,
    vehicle: Vehicle,
    now: Instant,
    writer: MavlinkWriter,
    typed: Vec<u8>,
    sent: Vec<u8>,
    table: u16,
    /// When the station says things, by the vehicle's clock.
    said: Option<u32>,
}

impl Line {
    fn new() -> Self {
        let mut vehicle = Vehicle::standing();
        let table = fingerprint(&topics::TOPICS, vehicle.parameters());
        let (typed, sent) = (Vec::new(), Vec::new());
        let writer = MavlinkWriter::new(245, 190);
        Self {
            cable: Cable::new(IDENTITY, table),
            vehicle,
            now: Instant::from_secs(1),
            writer,
            typed,
            sent,
            table,
            said: None,
        }
    }

    fn hear(&mut self, bytes: &[u8]) {
        let Self { cable, vehicle, now, typed, sent, .. } = self;
        cable.hear(*now, bytes, vehicle, &mut |frame| sent.extend(frame), &mut |key| typed.push(key));
    }

    fn frame(&mut self, payload: &Payload<'_>, number: u16) -> Vec<u8> {
        let mut bytes = Vec::new();
        let Self { table, writer, said, .. } = self;
        Envelope::write(*table, number, *said, payload, &mut |part| {
            let tunnel = Tunnel::new(TYPE, [1, 1], part).unwrap();
            let mut room = [0; LONGEST];
            bytes.extend(writer.write_payload::<MavMessage>(Tunnel::ID, &tunnel.payload(), &mut room).unwrap());
        });
        bytes
    }

    fn ask(&mut self, payload: &Payload<'_>, number: u16) {
        let frame = self.frame(payload, number);
        self.hear(&frame);
    }

    /// Time passes; what the board is to do is returned.
    fn turn(&mut self) -> Option<Request<core::convert::Infallible>> {
        self.now += Duration::from_millis(10);
        let Self { cable, vehicle, now, sent, .. } = self;
        let newest = vehicle.samples();
        cable.poll(*now, vehicle, &newest, &mut |frame| sent.extend(frame));
        let armed = vehicle.view().state().armed;
        let request = cable.answer(*now, &mut Board(&mut vehicle.parameters, armed), &mut |frame| sent.extend(frame));
        (request != Request::Nothing).then_some(request)
    }

    /// What has come in envelopes, as text.
    fn heard(&mut self) -> Vec<(u16, String)> {
        let (mut decoder, mut assembly, mut heard) = (MavlinkDecoder::<MavMessage>::new(), Assembly::default(), vec![]);
        for byte in core::mem::take(&mut self.sent) {
            let Some(frame) = decoder.feed(byte).filter(|frame| frame.id == Tunnel::ID) else { continue };
            let tunnel = Tunnel::read(frame.payload).unwrap();
            assert_eq!((frame.system, tunnel.kind), (1, TYPE));
            if let Some((envelope, payload)) = assembly.feed(&tunnel.bytes) {
                heard.push((envelope.number, format!("{payload:?}")));
            }
        }
        assert_eq!(decoder.discarded(), 0, "it sends what is no frame");
        heard
    }
}

fn heartbeat(writer: &mut MavlinkWriter, version: MavlinkVersion) -> Vec<u8> {
    let mut room = [0; LONGEST];
    writer.write(version, &MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()), &mut room).unwrap().to_vec()
}

#[test]
fn a_person_types_between_frames_and_sees_text_alone_until_a_program_speaks() {
    let mut line = Line::new();
    for _ in 0..300 {
        line.turn();
    }
    line.hear(b"sta");
    assert!(line.sent.is_empty(), "nobody speaks MAVLink yet");
    let frame = heartbeat(&mut line.writer.clone(), MavlinkVersion::V1);
    line.hear(&frame);
    line.hear(b"tus\r");
    let frame = heartbeat(&mut line.writer.clone(), MavlinkVersion::V2);
    line.hear(&frame);
    line.hear("µ\r".as_bytes());
    line.turn();
    assert_eq!(line.typed, "status\rµ\r".as_bytes());
    assert!(!line.sent.is_empty() && !line.vehicle.alive.is_empty());
    // Thirty seconds of silence, and it is a terminal again.
    for _ in 0..3_100 {
        line.turn();
    }
    line.sent.clear();
    line.turn();
    assert!(line.sent.is_empty());
}

#[test]
fn a_byte_that_only_looks_like_a_frame_costs_no_more_text_than_comes_within_a_pause() {
    let mut line = Line::new();
    line.hear(&[0xFD]);
    line.hear(b"lost");
    line.now += PAUSE;
    line.hear(b"help\r");
    assert_eq!(line.typed, b"help\r");
}

#[test]
fn the_record_is_asked_for_in_an_envelope_and_its_chunks_come_out_as_they_went_in() {
    let mut line = Line::new();
    assert_eq!(line.cable.record(), None);
    line.ask(&Payload::Record { wanted: true }, 1);
    assert_eq!((line.cable.record(), line.cable.record()), (Some(true), None));
    line.ask(&Payload::Record { wanted: false }, 2);
    assert_eq!(line.cable.record(), Some(false));
    let chunk: Vec<u8> = (0..BODY).map(|byte| byte as u8).collect();
    for length in [16, PART, PART + 1, BODY] {
        line.cable.send_chunk(&chunk[..length], &mut |frame| line.sent.extend(frame));
        let heard = line.heard();
        assert_eq!(heard.len(), 1);
        assert_eq!(heard[0].1, format!("{:?}", Payload::Chunk(&chunk[..length])));
    }
}

#[test]
fn parameters_are_read_and_written_and_in_flight_those_that_may_change_there() {
    let mut line = Line::new();
    line.ask(&Payload::ReadParameter { index: 1 }, 7);
    line.ask(&Payload::WriteParameter { index: 0, value: 3.5 }, 8);
    line.ask(&Payload::WriteParameter { index: 0, value: 11.0 }, 9);
    line.ask(&Payload::ReadParameter { index: 2 }, 10);
    line.turn();
    let value = |index, value, taken| format!("{:?}", Payload::Parameter { index, value, taken });
    let expected =
        [(7, value(1, 2.0, true)), (8, value(0, 3.5, true)), (9, value(0, 3.5, false)), (10, value(2, 0.0, false))];
    assert_eq!(line.heard(), expected);
    line.vehicle.status(|status| status.armed = true);
    line.ask(&Payload::WriteParameter { index: 1, value: 1.0 }, 11);
    line.ask(&Payload::WriteParameter { index: 0, value: 1.0 }, 12);
    line.turn();
    assert_eq!(line.heard(), [(11, value(1, 2.0, false)), (12, value(0, 1.0, true))], "the first may change in flight");
}

#[test]
fn a_combination_that_cannot_fly_is_not_taken() {
    let mut line = Line::new();
    line.vehicle.parameters.0 = [3.0, 9.0];
    line.ask(&Payload::WriteParameter { index: 0, value: 7.0 }, 1);
    line.turn();
    let expected = format!("{:?}", Payload::Parameter { index: 0, value: 3.0, taken: false });
    assert_eq!(line.heard(), [(1, expected)]);
}

#[test]
fn a_long_answer_comes_whole_in_parts_and_another_line_waits_for_its_end() {
    let mut line = Line::new();
    line.ask(&Payload::Line("status"), 1);
    line.ask(&Payload::Line("version"), 2);
    for _ in 0..20 {
        line.turn();
    }
    let heard = line.heard();
    assert_eq!(heard[0].0, 2, "refused at once: {heard:?}");
    let text: String = heard[1..]
        .iter()
        .map(|(number, text)| {
            assert_eq!(*number, 1);
            text.split('"').nth(1).unwrap().replace("\\n", "\n")
        })
        .collect();
    let expected: String = (0..40).map(|line| format!("line {line} of µ\n")).collect();
    assert_eq!(text, expected);
    assert!(heard.last().unwrap().1.ends_with("last: true }") && heard[1].1.ends_with("last: false }"));
}

#[test]
fn what_only_the_board_can_do_is_answered_when_it_is_done_and_not_while_armed() {
    let mut line = Line::new();
    line.ask(&Payload::Line("param save"), 3);
    assert_eq!(line.turn(), Some(Request::SaveParameters));
    assert_eq!(line.turn(), None);
    line.heard();
    line.cable.report(&"saved");
    line.turn();
    assert_eq!(line.heard(), [(3, format!("{:?}", Payload::Reply { text: "saved", last: true }))]);
    line.vehicle.status(|status| status.armed = true);
    line.ask(&Payload::Line("reboot"), 4);
    assert_eq!(line.turn(), None);
    assert!(line.heard()[0].1.contains("the vehicle is armed"));
}

#[test]
fn what_was_held_up_on_the_line_is_not_done_and_what_ends_a_flight_is() {
    let mut line = Line::new();
    let command = |kind| Payload::Guided(GuidedCommand { kind, ..GuidedCommand::default() });
    let arm = command(GuidedKind::Arm);
    let others = [Payload::WriteParameter { index: 0, value: 2.0 }, Payload::Line("reboot"), arm];
    line.now = Instant::from_secs(100);
    for age in [1_500, 5_000, 20_000] {
        line.said = Some(100_000 - age);
        for (number, payload) in (1..).zip(&others) {
            line.ask(payload, number);
            let heard = line.heard();
            assert!(heard.len() == 1 && heard[0].0 == number && heard[0].1.contains("expired"), "{heard:?}");
        }
        for payload in [command(GuidedKind::None), Payload::Sticks(PilotInput::default())] {
            line.ask(&payload, 9);
            assert_eq!(line.heard(), [], "they come again");
        }
        assert_eq!(line.turn(), None);
        assert_eq!((line.vehicle.guided.len(), line.vehicle.alive.len(), line.vehicle.steered.len()), (0, 0, 0));
    }
    assert!(line.vehicle.parameters.0 == [1.0, 2.0]);
    line.vehicle.status(|status| (status.armed, status.phase) = (true, FlightPhase::Flying));
    for payload in [Payload::Kill, command(GuidedKind::Kill), command(GuidedKind::Land)] {
        line.ask(&payload, 1);
        line.vehicle.guided.pop().expect("it has reached the vehicle");
    }
    // A second is allowed, and a clock that is ahead.
    for said in [99_100, 100_000, 104_000] {
        line.said = Some(said);
        line.ask(&command(GuidedKind::Hold), 1);
        line.vehicle.guided.pop().expect("it has reached the vehicle");
    }
}

#[test]
fn orders_in_mavlinks_own_words_are_as_late_as_the_envelope_before_them() {
    let mut line = Line::new();
    let order = |line: &mut Line, command, param1, param3| {
        let data = COMMAND_LONG_DATA { command, param1, param3, ..COMMAND_LONG_DATA::default() };
        let message = MavMessage::COMMAND_LONG(data);
        let mut room = [0; LONGEST];
        line.writer.write(MavlinkVersion::V2, &message, &mut room).unwrap().to_vec()
    };
    let marked = |line: &mut Line, said, order: Vec<u8>| {
        line.said = said;
        line.now += Duration::from_millis(500);
        let bytes = [line.frame(&Payload::Watch { topic: u16::MAX, period: 0 }, 1), order].concat();
        line.hear(&bytes);
        (line.vehicle.guided.drain(..).count(), line.vehicle.requests.drain(..).count())
    };
    let arm = order(&mut line, MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 1.0, 0.0);
    let motor = order(&mut line, MavCmd::MAV_CMD_DO_MOTOR_TEST, 1.0, 10.0);
    line.now = Instant::from_secs(100);
    for age in [1_500, 5_000, 20_000] {
        for order in [&arm, &motor] {
            let said = Some((line.now.as_micros() / 1_000) as u32 + 500 - age);
            assert_eq!(marked(&mut line, said, order.clone()), (0, 0), "after {age} ms");
        }
        let said = Some((line.now.as_micros() / 1_000) as u32 + 500 - age);
        let kill = order(&mut line, MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, 1.0, 0.0);
        assert_eq!(marked(&mut line, said, kill), (1, 0), "it ends a flight");
    }
    // Fresh, without a time, and of another program than the one that was late, a moment later.
    let said = Some((line.now.as_micros() / 1_000) as u32);
    assert_eq!(marked(&mut line, said, motor.clone()), (0, 1));
    assert_eq!(marked(&mut line, None, motor.clone()), (0, 1));
    assert_eq!(marked(&mut line, Some(0), motor.clone()), (0, 0));
    line.now += Duration::from_millis(500);
    line.hear(&motor);
    assert_eq!(line.vehicle.requests.len(), 1);
}

#[test]
fn commands_are_acknowledged_or_refused_in_words_and_signs_of_life_are_its_own() {
    let mut line = Line::new();
    let command = |kind| Payload::Guided(GuidedCommand { kind, ..GuidedCommand::default() });
    line.ask(&command(GuidedKind::TakeOff), 7);
    assert_eq!(line.heard()[0].1, "Reply { text: \"refused: motors are off\", last: true }");
    line.ask(&command(GuidedKind::Arm), 1);
    line.ask(&command(GuidedKind::None), 2);
    line.turn();
    assert_eq!(line.heard(), [], "it has not happened yet");
    line.vehicle.status(|status| (status.armed, status.phase) = (true, FlightPhase::Flying));
    line.turn();
    assert_eq!(line.heard(), [(1, format!("{:?}", Payload::Acknowledgement { counter: 1, taken: true }))]);
    assert_eq!(line.vehicle.alive.len(), 1);
    line.writer = MavlinkWriter::new(9, 190);
    line.ask(&command(GuidedKind::WayPoint), 3);
    assert!(line.heard()[0].1.contains("MAVLink 245/190, line 1 commands"));
    line.ask(&Payload::Kill, 4);
    let sticks = Payload::Sticks(PilotInput { roll: 0.5, ..PilotInput::default() });
    line.ask(&sticks, 5);
    assert!(line.vehicle.steered.is_empty(), "another commands");
    line.writer = MavlinkWriter::new(245, 190);
    line.ask(&sticks, 6);
    let kinds: Vec<_> = line.vehicle.guided.iter().map(|command| command.kind).collect();
    assert_eq!((kinds, line.vehicle.steered.len()), (vec![GuidedKind::Arm, GuidedKind::Kill], 1));
}

#[test]
fn a_station_is_told_once_what_others_ask() {
    let mut line = Line::new();
    let told = |kind| CommandNotice { requester: Requester::Link(7), what: Asked::Command(kind) };
    line.vehicle.told.push(told(GuidedKind::Arm));
    line.turn();
    assert_eq!(line.heard(), [], "there is none yet");
    line.ask(&Payload::Guided(GuidedCommand::default()), 1);
    line.vehicle.told.push(told(GuidedKind::TakeOff));
    (0..10).for_each(|_| assert_eq!(line.turn(), None));
    let notice = Payload::Notice { number: 2, text: "the station with the key, line 7: take off" };
    assert_eq!(line.heard(), [(0, format!("{notice:?}"))]);
}

#[test]
fn a_station_that_connects_anew_gets_no_answers_to_what_the_one_before_it_asked() {
    let mut line = Line::new();
    line.ask(&Payload::Watch { topic: Id::estimate_state as u16, period: 50 }, 1);
    line.ask(&Payload::Guided(GuidedCommand { kind: GuidedKind::Arm, ..GuidedCommand::default() }), 2);
    line.ask(&Payload::Line("help"), 3);
    line.heard();
    line.cable.close(&mut line.vehicle);
    line.ask(&Payload::Watch { topic: Id::sensor_tof as u16, period: 50 }, 9);
    line.vehicle.status(|status| status.armed = true);
    for _ in 0..200 {
        line.vehicle.publish_at(line.now, Id::estimate_state, &StateEstimate::default());
        line.turn();
    }
    let heard = line.heard();
    assert!(heard.len() == 1 && heard[0].0 == 9, "{heard:?}");
}

#[test]
fn topics_come_as_often_as_asked_for_and_no_sample_twice() {
    let mut line = Line::new();
    line.ask(&Payload::Watch { topic: Id::estimate_state as u16, period: 50 }, 1);
    line.ask(&Payload::Watch { topic: Id::sensor_tof as u16, period: 50 }, 2);
    line.heard();
    for _ in 0..100 {
        line.vehicle.publish_at(line.now, Id::estimate_state, &StateEstimate::default());
        line.turn();
    }
    let heard = line.heard();
    let samples = heard.iter().filter(|(_, text)| text.contains("Sample")).count();
    assert_eq!(samples, 21, "20 Hz of a topic at 100 Hz from its first on, and none of one without a sample");
    for _ in 0..100 {
        line.turn();
    }
    assert_eq!(line.heard().iter().filter(|(_, text)| text.contains("Sample")).count(), 0, "nothing new");
    line.ask(&Payload::Watch { topic: Id::estimate_state as u16, period: 0 }, 3);
    line.vehicle.publish_at(line.now, Id::estimate_state, &StateEstimate::default());
    line.heard();
    line.turn();
    assert!(line.heard().is_empty());
}

#[test]
fn a_station_of_another_version_may_kill_and_nothing_else() {
    let mut line = Line::new();
    line.table ^= 1;
    line.ask(&Payload::WriteParameter { index: 0, value: 3.0 }, 1);
    line.ask(&Payload::Kill, 2);
    line.turn();
    assert!(line.heard()[0].1.contains("different versions"));
    assert_eq!((line.vehicle.parameters.0, line.cable.foreign()), ([1.0, 2.0], 1));
    assert_eq!(line.vehicle.guided.last().map(|command| command.kind), Some(GuidedKind::Kill));
}

#[test]
fn tables_that_differ_in_a_name_have_other_fingerprints() {
    let two = Two([0.0; 2]);
    assert_ne!(fingerprint(&topics::TOPICS, &two), fingerprint(&topics::TOPICS[1..], &two));
}

proptest! {
    /// Any text, any frames between any two of its bytes, in any pieces: all of the text and all of the frames come out.
    #[test]
    fn text_and_frames_are_told_apart(
        pieces in prop::collection::vec((prop::collection::vec(0_u8..0xFD, 0..20), any::<bool>(), any::<u8>()), 0..20)
    ) {
        let mut writer = MavlinkWriter::new(1, 1);
        let (mut all, mut text, mut frames) = (vec![], vec![], vec![]);
        for (typed, old, what) in pieces {
            all.extend(&typed);
            text.extend(&typed);
            let version = if old { MavlinkVersion::V1 } else { MavlinkVersion::V2 };
            let mut frame = heartbeat(&mut writer, version);
            // Even a broken one ends where its header says.
            frame[7] ^= what;
            all.extend(&frame);
            frames.extend(&frame);
        }
        let mut split = Split::new();
        let (mut out_text, mut out_frames) = (vec![], vec![]);
        for byte in all {
            match split.feed(Instant::from_secs(1), byte) {
                Part::Text => out_text.push(byte),
                Part::Frame => out_frames.push(byte),
            }
        }
        prop_assert_eq!((out_text, out_frames), (text, frames));
    }

    /// Whatever comes, every byte is given to one side, and a line that is typed after a pause is whole.
    #[test]
    fn garbage_costs_no_line_after_a_pause(garbage in prop::collection::vec(any::<u8>(), 0..600)) {
        let mut line = Line::new();
        line.hear(&garbage);
        line.now += PAUSE;
        line.typed.clear();
        line.hear(b"status\r");
        prop_assert_eq!(&line.typed[..], b"status\r");
    }
}

#[test]
fn commands_that_come_at_once_are_each_answered_as_the_vehicle_does_them_and_too_many_are_refused() {
    let guided = |kind| Payload::Guided(GuidedCommand { kind, ..GuidedCommand::default() });
    let mut line = Line::new();
    // A vehicle that does not arm, and does not say why.
    line.vehicle.status(|status| status.blocks = ArmBlocks::NONE);
    (1..=6).for_each(|number| line.ask(&guided(GuidedKind::Arm), number));
    line.turn();
    assert_eq!(line.heard(), [], "nothing is known of any");
    (0..160).for_each(|_| _ = line.turn());
    let heard = line.heard();
    let numbers: Vec<u16> = heard.iter().map(|(number, _)| *number).collect();
    assert_eq!(numbers, [1, 2, 3, 4, 5, 6]);
    assert!(heard.iter().all(|(_, text)| text.starts_with("Reply")), "{heard:?}");

    // Others of many are refused, and never called done.
    (1..=20).for_each(|number| line.ask(&guided(GuidedKind::Arm), number));
    let heard = line.heard();
    assert_eq!(heard.len(), 12);
    assert!(heard.iter().all(|(_, text)| text.contains("too many commands at once")), "{heard:?}");
    // What ends a flight finds room, and the oldest is told so.
    line.ask(&guided(GuidedKind::Kill), 30);
    line.turn();
    let heard = line.heard();
    assert!(heard[0].0 == 1 && heard[0].1.contains("a later command ends the flight"), "{heard:?}");
    assert!(heard[1].0 == 30 && heard[1].1.starts_with("Acknowledgement"), "{heard:?}");
    (0..160).for_each(|_| _ = line.turn());
    let heard = line.heard();
    assert!(heard.len() == 7 && heard.iter().all(|(_, text)| text.starts_with("Reply")), "{heard:?}");
}
