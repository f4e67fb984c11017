//! A station with the vehicle's key at the radio of a vehicle on a table, which a stock transmitter has armed.

use crate::bench::{Bench, OLD};
use stampfly_board::link::Outgoing;
use stampfly_board::topics::{self, Id};
use stampfly_link::Address;
use stampfly_link::secure::{Key, MAX_FRAME, NotTaken, Payload, Refused, Station, Vehicle};
use stampfly_services::{Refusal, Requester};
use stampfly_types::Duration;
use stampfly_types::messages::{
    Alerts, CommandSource, FlightPhase, FlightStatus, GuidedCommand, GuidedKind, PilotInput, SystemAlert,
};

const STATION: Address = Address([2, 0, 0, 0, 0, 9]);

fn key() -> Key {
    Key::generate(1, core::array::from_fn(|place| place as u8 ^ 0x5A)).expect("random enough")
}

/// Lets time pass while the station answers, and returns how many of its frames were acknowledged as taken.
fn talk(bench: &mut Bench<'_>, station: &mut Station, armed: bool) -> u32 {
    let mut acknowledged = 0;
    for turn in 0..20u8 {
        bench.pass(20, false, &[(OLD, armed)]);
        for mut frame in core::mem::take(&mut bench.said) {
            let heard = station.receive(bench.now, &mut frame).ok().flatten();
            let taken = heard.map(|received| received.payload);
            acknowledged += u32::from(matches!(taken, Some(Payload::Acknowledgement { taken: true, .. })));
        }
        let mut room = [0; MAX_FRAME];
        if let Some(frame) = station.transmit(bench.now, [turn + 1; 8], &mut room).map(<[u8]>::to_vec) {
            let _ = bench.link.receive(&mut bench.arbiter, bench.now, STATION, &mut frame.clone());
        }
    }
    acknowledged
}

fn say(bench: &mut Bench<'_>, station: &mut Station, payload: &Payload<'_>) -> Vec<u8> {
    let frame = station.seal(bench.now, payload, &mut [0; MAX_FRAME]).expect("sealed").to_vec();
    assert_eq!(bench.link.receive(&mut bench.arbiter, bench.now, STATION, &mut frame.clone()), Ok(None), "{payload:?}");
    frame
}

#[test]
fn every_form_of_a_kill_stops_the_motors_and_commands_are_acknowledged() {
    let kills = [
        (Payload::Kill, 1),
        (Payload::Guided(GuidedCommand { kind: GuidedKind::Kill, ..Default::default() }), 1),
        (Payload::Sticks(PilotInput { kill: true, ..Default::default() }), 0),
    ];
    for (kill, acknowledgements) in kills {
        let mut bus = topics::Bus::new();
        let mut bench = Bench::with_key(&mut bus, Some(OLD), Some(Vehicle::new(key())));
        let mut station = Station::new(key());
        bench.pass(6_000, false, &[(OLD, false)]);
        bench.pass(300, false, &[(OLD, true)]);
        assert!(bench.armed());
        talk(&mut bench, &mut station, true);
        assert!(station.session().is_some() && bench.armed());

        let frame = say(&mut bench, &mut station, &kill);
        bench.pass(5, false, &[]);
        assert!(!bench.armed(), "{kill:?}");
        let again = bench.link.receive(&mut bench.arbiter, bench.now, STATION, &mut frame.clone()).map(drop);
        assert_eq!(again, Err(NotTaken::Secure(Refused::Old)));
        assert_eq!(talk(&mut bench, &mut station, false), acknowledgements, "{kill:?}");
    }
}

#[test]
fn what_only_services_can_answer_is_handed_out_and_telemetry_is_sealed() {
    let mut bus = topics::Bus::new();
    let mut bench = Bench::with_key(&mut bus, Some(OLD), Some(Vehicle::new(key())));
    let mut station = Station::new(key());
    bench.pass(6_000, false, &[]);
    talk(&mut bench, &mut station, false);
    let line = station.seal(bench.now, &Payload::Line("status"), &mut [0; MAX_FRAME]).expect("sealed").to_vec();
    let mut line = line;
    let received = bench.link.receive(&mut bench.arbiter, bench.now, STATION, &mut line).expect("taken");
    assert_eq!(received.map(|received| received.payload), Some(Payload::Line("status")));

    let mut kinds = Vec::new();
    for _ in 0..2 {
        let (to, mut bytes) = bench.say(bench.now, Outgoing::Telemetry).expect("there is a station");
        assert_eq!(to, STATION);
        kinds.push(station.receive(bench.now, &mut bytes).expect("authentic").expect("telemetry").payload.kind());
    }
    kinds.sort_by_key(|kind| *kind as u8);
    assert_eq!(kinds, [stampfly_link::secure::Kind::Telemetry, stampfly_link::secure::Kind::Sample]);
}

const PAGE: Requester = Requester::Page(1);
const OTHER_STATION: Address = Address([2, 0, 0, 0, 0, 8]);

fn guided(kind: GuidedKind) -> GuidedCommand {
    GuidedCommand { kind, ..GuidedCommand::default() }
}

/// A page asks, as at a port.
fn ask(bench: &mut Bench<'_>, requester: Requester, kind: GuidedKind) -> Result<(), Refusal> {
    let Bench { arbiter, link, now, .. } = bench;
    arbiter.guide(*now, requester, guided(kind), &mut |passed| {
        let stampfly_services::Passed::Command(command) = passed else { panic!("{passed:?}") };
        link.command(*now, command).then_some(()).ok_or(Refusal::Full)
    })
}

/// Lets time pass as the firmware's radio does it, with a handshake; returns what the station is told.
fn heard(
    bench: &mut Bench<'_>,
    station: &mut Station,
    millis: u64,
    mut each: impl FnMut(&mut Bench<'_>, &mut Station),
) -> Vec<String> {
    let (mut texts, mut room) = (Vec::new(), [0; MAX_FRAME]);
    for _ in 0..millis / 20 {
        bench.pass(20, false, &[]);
        each(bench, station);
        let Bench { arbiter, link, now, said, .. } = bench;
        link.keep(arbiter, *now);
        said.extend(link.notice(arbiter, *now, &mut room).map(|(_, bytes)| bytes.to_vec()));
        for mut frame in core::mem::take(said) {
            match station.receive(*now, &mut frame).ok().flatten().map(|received| received.payload) {
                Some(Payload::Refusal { counter, why }) => texts.push(format!("{counter}: {why}")),
                Some(Payload::Notice { text, .. }) => texts.push(text.to_owned()),
                Some(Payload::Acknowledgement { counter, taken }) => texts.push(format!("{counter}: {taken}")),
                _ => {}
            }
        }
        if let Some(frame) = station.transmit(*now, now.as_micros().to_le_bytes(), &mut room).map(<[u8]>::to_vec) {
            let _ = link.receive(arbiter, *now, STATION, &mut frame.clone());
        }
    }
    texts
}

/// A vehicle on a table that is ready, and its station.
fn ready<'b>(bus: &'b mut topics::Bus) -> (Bench<'b>, Station) {
    let mut bench = Bench::with_key(bus, None, Some(Vehicle::new(key())));
    let mut station = Station::new(key());
    heard(&mut bench, &mut station, 6_000, |_, _| {});
    assert!(station.session().is_some());
    (bench, station)
}

/// From another address, in the same session.
fn say_from(bench: &mut Bench<'_>, station: &mut Station, from: Address, payload: &Payload<'_>) {
    let mut frame = station.seal(bench.now, payload, &mut [0; MAX_FRAME]).expect("sealed").to_vec();
    assert_eq!(bench.link.receive(&mut bench.arbiter, bench.now, from, &mut frame), Ok(None), "{payload:?}");
}

#[test]
fn a_station_is_refused_while_a_page_commands_and_told_who_does_and_what_was_done() {
    let mut bus = topics::Bus::new();
    let (mut bench, mut station) = ready(&mut bus);
    assert_eq!(ask(&mut bench, PAGE, GuidedKind::Arm), Ok(()));
    let told = heard(&mut bench, &mut station, 2_000, |_, _| {});
    assert!(bench.armed());
    assert_eq!(told.iter().filter(|told| *told == "page 1: arm").count(), 3, "frames are lost: {told:?}");

    let number = 41;
    say(&mut bench, &mut station, &Payload::Numbered { number, command: guided(GuidedKind::TakeOff) });
    let told = heard(&mut bench, &mut station, 500, |_, _| {});
    assert!(told.contains(&"41: page 1 commands".to_owned()) && !told.contains(&"41: true".to_owned()), "{told:?}");
    assert_eq!(bench.arbiter.holder(bench.now), Some(PAGE));

    // Its sticks, too, and it is told so now and then.
    let told = heard(&mut bench, &mut station, 1_000, |bench, station| {
        say(bench, station, &Payload::Sticks(PilotInput { throttle: 1.0, arm: true, ..PilotInput::default() }));
    });
    assert_eq!(told.iter().filter(|told| told.ends_with(": page 1 commands")).count(), 1, "{told:?}");
    assert_eq!(bench.newest::<PilotInput>(Id::command_pilot), PilotInput::default());
    assert_eq!(bench.newest::<FlightStatus>(Id::flight_status).commander, CommandSource::Guided);

    // It may stop the motors, in each of its words.
    say(&mut bench, &mut station, &Payload::Numbered { number: 42, command: guided(GuidedKind::Kill) });
    let told = heard(&mut bench, &mut station, 200, |_, _| {});
    assert!(!bench.armed() && told.contains(&"42: true".to_owned()), "{told:?}");
}

#[test]
fn what_the_vehicle_does_not_do_is_refused_with_the_reason_and_acknowledged_when_it_has_happened() {
    let mut bus = topics::Bus::new();
    let (mut bench, mut station) = ready(&mut bus);
    let kinds = [GuidedKind::TakeOff, GuidedKind::Hold, GuidedKind::WayPoint, GuidedKind::FlipLeft, GuidedKind::Land];
    for (number, kind) in (10..).zip(kinds) {
        let command = Payload::Numbered { number, command: guided(kind) };
        say(&mut bench, &mut station, &command);
        let told = heard(&mut bench, &mut station, 200, |_, _| {});
        let why = if kind == GuidedKind::Land { "it stands on the ground" } else { "motors are off" };
        assert_eq!(told, [format!("{number}: refused: {why}")], "{kind:?}");
    }
    for (number, kind) in [(20, GuidedKind::Arm), (21, GuidedKind::Kill)] {
        say(&mut bench, &mut station, &Payload::Numbered { number, command: guided(kind) });
        let told = heard(&mut bench, &mut station, 200, |_, _| {});
        assert!(told.contains(&format!("{number}: true")), "{kind:?}: {told:?}");
        assert_eq!(bench.armed(), kind == GuidedKind::Arm);
    }
}

#[test]
fn a_refused_command_that_is_said_again_is_refused_again_although_the_vehicle_would_do_it_now() {
    let mut bus = topics::Bus::new();
    let (mut bench, mut station) = ready(&mut bus);
    let take_off = Payload::Numbered { number: 10, command: guided(GuidedKind::TakeOff) };
    say(&mut bench, &mut station, &take_off);
    // It is armed otherwise, and the station has not heard the refusal.
    assert_eq!(ask(&mut bench, PAGE, GuidedKind::Arm), Ok(()));
    bench.pass(100, false, &[]);
    bench.said.clear();
    assert!(bench.armed());
    say(&mut bench, &mut station, &take_off);
    let told = heard(&mut bench, &mut station, 100, |_, _| {});
    assert!(told.contains(&"10: refused: motors are off".to_owned()), "{told:?}");
    assert!(bench.armed() && bench.newest::<FlightStatus>(Id::flight_status).phase != FlightPhase::TakeOff);
}

#[test]
fn a_command_that_the_vehicle_takes_and_does_not_do_is_refused_three_times_after_a_second_and_a_half() {
    let mut bus = topics::Bus::new();
    let (mut bench, mut station) = ready(&mut bus);
    let arm = Payload::Numbered { number: 10, command: guided(GuidedKind::Arm) };
    let (mut told, mut room) = (Vec::new(), [0; MAX_FRAME]);
    // Its mode machine stands still: nothing comes of the command.
    for turn in 0..150 {
        // Said again, as long as a station does: it is taken once.
        if turn < 50 && turn % 3 == 0 {
            say(&mut bench, &mut station, &arm);
        }
        bench.now += Duration::from_millis(20);
        let now = bench.now;
        for what in Outgoing::ALL {
            let Some((_, mut frame)) = bench.say(now, what) else { continue };
            match station.receive(now, &mut frame).ok().flatten().map(|received| received.payload) {
                Some(Payload::Refusal { counter: 10, why }) => told.push((turn * 20, why.to_owned())),
                Some(Payload::Acknowledgement { counter: 10, .. }) => panic!("it is not done, and there was room"),
                _ => {}
            }
        }
        if let Some(frame) = station.transmit(now, now.as_micros().to_le_bytes(), &mut room).map(<[u8]>::to_vec) {
            let _ = bench.link.receive(&mut bench.arbiter, now, STATION, &mut frame.clone());
        }
    }
    assert_eq!(told.len(), 3, "{told:?}");
    assert!(told.iter().all(|(ms, why)| (1_480..2_000).contains(ms) && why.starts_with("refused: ")), "{told:?}");
}

#[test]
fn a_page_is_refused_while_a_station_commands_by_words_or_by_sticks() {
    let arms = [
        Payload::Numbered { number: 1, command: guided(GuidedKind::Arm) },
        Payload::Sticks(PilotInput { arm: true, ..PilotInput::default() }),
    ];
    for arm in arms {
        let mut bus = topics::Bus::new();
        let (mut bench, mut station) = ready(&mut bus);
        let off = Payload::Sticks(PilotInput::default());
        heard(&mut bench, &mut station, 500, |bench, station| say(bench, station, &off).clear());
        let is_sticks = matches!(arm, Payload::Sticks(_));
        say(&mut bench, &mut station, &arm);
        heard(&mut bench, &mut station, 500, |bench, station| {
            if is_sticks {
                say(bench, station, &arm);
            }
        });
        assert!(bench.armed(), "{arm:?}");
        let Some(holder @ Requester::Link(_)) = bench.arbiter.holder(bench.now) else { panic!("{arm:?}") };
        assert_eq!(ask(&mut bench, PAGE, GuidedKind::TakeOff), Err(Refusal::Occupied(holder)));
        assert_eq!(ask(&mut bench, PAGE, GuidedKind::Kill), Ok(()));
        heard(&mut bench, &mut station, 100, |_, _| {});
        assert!(!bench.armed());
    }
}

#[test]
fn another_station_and_a_page_do_not_keep_a_vehicle_armed_whose_station_has_left() {
    let mut bus = topics::Bus::new();
    let (mut bench, mut station) = ready(&mut bus);
    say(&mut bench, &mut station, &Payload::Numbered { number: 1, command: guided(GuidedKind::Arm) });
    heard(&mut bench, &mut station, 200, |_, _| {});
    assert!(bench.armed());
    let alerts = |bench: &Bench<'_>| bench.newest::<SystemAlert>(Id::system_alert).active;
    // Its signs of life keep the link, also between two that are half a second apart.
    for _ in 0..6 {
        say(&mut bench, &mut station, &Payload::Guided(GuidedCommand::default()));
        heard(&mut bench, &mut station, 500, |bench, _| assert!(!alerts(bench).contains(Alerts::COMM_LOST)));
    }
    // It has left. Another station and a page chatter on.
    let mut silent = None;
    for turn in 0..250 {
        heard(&mut bench, &mut station, 20, |bench, station| {
            say_from(bench, station, OTHER_STATION, &Payload::Guided(GuidedCommand::default()));
            let centred = Payload::Sticks(PilotInput { arm: true, ..PilotInput::default() });
            say_from(bench, station, OTHER_STATION, &centred);
            let now = bench.now;
            assert!(!bench.arbiter.alive(now, PAGE));
        });
        if alerts(&bench).contains(Alerts::COMM_LOST) {
            silent.get_or_insert(turn * 20);
        }
    }
    assert!(silent.is_some_and(|ms| (2_500..=3_600).contains(&ms)), "{silent:?} ms after its last sign");
    assert_eq!(bench.arbiter.holder(bench.now), None);
    say_from(&mut bench, &mut station, OTHER_STATION, &Payload::Guided(guided(GuidedKind::Disarm)));
    heard(&mut bench, &mut station, 100, |_, _| {});
    assert!(!bench.armed());
}

#[test]
fn the_paired_transmitter_is_a_seat_and_a_page_that_flies_by_hand_does_not_share_the_vehicle_with_it() {
    let mut bus = topics::Bus::new();
    let mut bench = Bench::new(&mut bus, Some(OLD));
    bench.pass(6_000, false, &[(OLD, false)]);
    bench.pass(500, false, &[(OLD, true)]);
    assert!(bench.armed());
    assert_eq!(bench.arbiter.holder(bench.now), Some(Requester::Transmitter));
    assert_eq!(ask(&mut bench, PAGE, GuidedKind::TakeOff), Err(Refusal::Occupied(Requester::Transmitter)));
    bench.pass(200, false, &[(OLD, false)]);
    assert!(!bench.armed());

    // Its switch is off, and a page arms with its own.
    let (mut bus, mut was_armed) = (topics::Bus::new(), false);
    let mut bench = Bench::new(&mut bus, Some(OLD));
    bench.pass(6_000, false, &[(OLD, false)]);
    for turn in 0..100 {
        let input = PilotInput { arm: turn > 20, ..PilotInput::default() };
        let (now, status) = (bench.now, bench.newest::<FlightStatus>(Id::flight_status));
        let Bench { arbiter, link, .. } = &mut bench;
        let _ = arbiter.steer(now, PAGE, &input, &status, &mut |passed| {
            if let stampfly_services::Passed::Sticks(input) = passed {
                link.sticks(now, &input);
            }
            Ok(())
        });
        bench.pass(20, false, &[(OLD, false)]);
        assert!(bench.armed() || !was_armed, "it stays armed, turn {turn}");
        was_armed = bench.armed();
    }
    assert!(was_armed && bench.arbiter.holder(bench.now) == Some(PAGE));
}

#[test]
fn a_station_that_watches_does_not_silence_the_transmitter_that_flies_and_is_refused() {
    let mut bus = topics::Bus::new();
    let mut bench = Bench::with_key(&mut bus, Some(OLD), Some(Vehicle::new(key())));
    let mut station = Station::new(key());
    bench.pass(6_000, false, &[(OLD, false)]);
    bench.pass(300, false, &[(OLD, true)]);
    assert!(bench.armed());
    talk(&mut bench, &mut station, true);
    assert!(station.session().is_some());
    for _ in 0..100 {
        say_watch(&mut bench, &mut station);
        assert_eq!(bench.pass(20, false, &[(OLD, true)]), Some(Ok(())));
    }
    assert!(bench.armed() && !bench.newest::<SystemAlert>(Id::system_alert).active.contains(Alerts::COMM_LOST));
    say(&mut bench, &mut station, &Payload::Numbered { number: 1, command: guided(GuidedKind::TakeOff) });
    assert!(heard(&mut bench, &mut station, 100, |_, _| {}).contains(&"1: the transmitter commands".to_owned()));
    assert_eq!(bench.pass(20, false, &[(OLD, false)]), Some(Ok(())));
    bench.pass(200, false, &[(OLD, false)]);
    assert!(!bench.armed());
    // On the ground the station is heard, and the transmitter is not.
    say_watch(&mut bench, &mut station);
    assert_eq!(bench.pass(20, false, &[(OLD, true)]), Some(Err(NotTaken::Forbidden)));
}

fn say_watch(bench: &mut Bench<'_>, station: &mut Station) {
    let watch = Payload::Watch { topic: 3, period: 40 };
    let mut frame = station.seal(bench.now, &watch, &mut [0; MAX_FRAME]).expect("sealed").to_vec();
    assert!(matches!(bench.link.receive(&mut bench.arbiter, bench.now, STATION, &mut frame), Ok(Some(_))));
}
