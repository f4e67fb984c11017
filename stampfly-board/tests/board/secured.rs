//! A station with the vehicle's key at the radio of a vehicle on a table, which a stock transmitter has armed.

use crate::bench::{Bench, OLD};
use stampfly_board::link::Outgoing;
use stampfly_board::topics;
use stampfly_link::Address;
use stampfly_link::secure::{Key, MAX_FRAME, NotTaken, Payload, Refused, Station, Vehicle};
use stampfly_types::messages::{GuidedCommand, GuidedKind, PilotInput};

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
            let _ = bench.link.receive(bench.now, STATION, &mut frame.clone());
        }
    }
    acknowledged
}

fn say(bench: &mut Bench<'_>, station: &mut Station, payload: &Payload<'_>) -> Vec<u8> {
    let frame = station.seal(bench.now, payload, &mut [0; MAX_FRAME]).expect("sealed").to_vec();
    assert_eq!(bench.link.receive(bench.now, STATION, &mut frame.clone()), Ok(None), "{payload:?}");
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
        let again = bench.link.receive(bench.now, STATION, &mut frame.clone()).map(drop);
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
    let received = bench.link.receive(bench.now, STATION, &mut line).expect("taken");
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
