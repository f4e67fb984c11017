//! Compact records of simulated flights: streamed, received, run again, replayed bit for bit, turned into logs.

use crate::flown::{HOP, Hop, LATE, hop};
use crate::thorough::thorough;
use stampfly_board::VehicleConfig;
use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_flight::compact::Samples;
use stampfly_flight::replay::{Replay, ReplayOptions, replay};
use stampfly_host::flight_log;
use stampfly_host::flown::fly;
use stampfly_host::log::info::Info;
use stampfly_host::log::record::{RecordError, as_log, run_again};
use stampfly_host::serve::{RecordOut, receive};
use stampfly_log::ulog::{Message, Reader};
use stampfly_rover::simulation::Rover;
use stampfly_sim::vehicle::{Options, Vehicle};
use stampfly_types::{Duration as FlightTime, Instant};
use std::net::UdpSocket;
use std::time::Duration;

fn again(log: &[u8]) -> Replay {
    let options = ReplayOptions { from: Some(Instant::ZERO), is_thinned: true };
    replay::<Runnables>(log, VehicleConfig::default(), |_, _, _| true, options).expect("replays")
}

/// Samples of a topic in a log, as they stand there.
fn samples(log: &[u8], name: &str) -> Vec<Vec<u8>> {
    let (mut ids, mut found) = (Vec::new(), Vec::new());
    for message in Reader::new(log).expect("a log") {
        match message.expect("whole") {
            Message::Subscription { id, topic, .. } if topic == name => ids.push(id),
            Message::Data { id, payload } if ids.contains(&id) => found.push(payload.to_vec()),
            _ => {}
        }
    }
    found
}

#[test]
fn flights_with_an_executor_that_is_late_replay_bit_for_bit() {
    let others = [(4, Some(2)), (3, Some(1))];
    let others = &others[..thorough(1, others.len())];
    let others: Vec<Hop> = others.iter().map(|(seed, jitter)| Hop::fly(&hop(*seed, *jitter))).collect();
    for flown in [&*HOP].into_iter().chain(&others) {
        let (log, contents) = run_again(&flown.record, None, Samples::Recorded).expect("reads");
        assert_eq!((contents.gaps, contents.lost, contents.idle_since), (0, 0, None));
        let replayed = again(&log);
        assert_eq!(replayed.difference, None);
        assert!(replayed.activations > 20_000 && replayed.samples > 100 && contents.key_frames > 1, "{replayed:?}");
    }
}

#[test]
fn a_record_run_again_is_the_log_of_the_same_flight() {
    let Hop { record: file, log, .. } = &*LATE;
    let (again, contents) = as_log(file).expect("reads");
    assert!(contents.is_some() && file.len() * 5 < log.len(), "{} of {}", file.len(), log.len());
    for topic in ["estimate_state", "actuator_motor", "sensor_imu", "telemetry"] {
        let (again, before) = (samples(&again, topic), samples(log, topic));
        // The record begins with its first key frame, a pass or two after power-on.
        assert!(again.len() > 100 && before.ends_with(&again) && before.len() < again.len() + 10, "{topic}");
    }
    let info = Info::of(&flight_log::parse(&again).expect("a log"));
    assert_eq!(info.facts["sys_name"], "stampfly");
}

#[test]
fn damaged_and_empty_files_are_errors_or_gaps() {
    let file = &LATE.record;
    for length in [0, 1, 8, 9, 40, 1000] {
        let part = &file[..length];
        assert!(run_again(part, None, Samples::Recorded).is_err() || length == 0, "{length}");
    }
    let part = &file[..file.len() / 2];
    let (log, contents) = run_again(part, None, Samples::Recorded).expect("what is there");
    assert!(contents.gaps <= 1 && again(&log).difference.is_none());
    // A bit of one chunk: the rest goes on at the next key frame.
    let mut flipped = file.clone();
    flipped[file.len() / 3] ^= 1;
    let (log, contents) = run_again(&flipped, None, Samples::Recorded).expect("reads");
    assert_eq!(contents.gaps, 1);
    assert!(again(&log).difference.is_none());
    assert!(matches!(run_again(file, Some("balloon"), Samples::Again), Err(RecordError::Vehicle(_))));
    assert!(matches!(run_again(file, Some("rover"), Samples::Again), Err(RecordError::Read(_))));
}

/// Cut off anywhere, and with any byte turned over: what is whole is run again, or an error says
/// what is wrong.
#[test]
fn a_record_cut_off_or_damaged_anywhere_is_read_as_far_as_it_is_whole() {
    let mut witness = RecordOut::memory(StampFly::NAME);
    fly::<StampFly>(&Setup { limit: FlightTime::from_secs(2), ..hop(1, None) }, &mut witness, &mut |_, _| {});
    let (file, cuts, bytes) = (witness.file().to_vec(), thorough(40, 1_000), thorough(20, 200));
    let mut before = 0;
    for cut in 0..cuts {
        if let Ok((_, contents)) = as_log(&file[..cut * file.len() / cuts]).map(|(log, contents)| (log.len(), contents))
        {
            let activations = contents.map_or(0, |contents| contents.activations);
            assert!(activations >= before, "cut {cut}: {activations} after {before}");
            before = activations;
        }
    }
    assert!(before > 1_000, "{before}");
    for place in (0..bytes).chain((0..bytes).map(|place| place * file.len() / bytes)) {
        let mut flipped = file.clone();
        flipped[place] ^= 0xff;
        let _ = run_again(&flipped, None, Samples::Again);
    }
}

#[test]
fn datagrams_arrive_as_the_same_file() {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    let to = socket.local_addr().expect("an address");
    let receiving = std::thread::spawn(move || {
        let mut file = Vec::new();
        let receiver = receive(&socket, &mut file, Duration::from_secs(60)).expect("receives");
        (file, receiver)
    });
    let mut witness = RecordOut::datagrams("stampfly", to).expect("a socket");
    fly::<StampFly>(&hop(1, Some(1)), &mut witness, &mut |_, _| {});
    let (file, receiver) = receiving.join().expect("received");
    assert!(receiver.chunks() > 50 && receiver.chunks() + receiver.missing() > 300, "{receiver:?}");
    let (log, contents) = run_again(&file, None, Samples::Recorded).expect("reads");
    // Loopback loses some when this machine is busy, and that is then a gap.
    assert!(receiver.missing() > 0 || file == LATE.record, "the same flight, the same file");
    assert!(contents.gaps <= receiver.missing() && again(&log).difference.is_none());
}

#[test]
fn a_rover_has_a_record_too() {
    let setup = Rover::setup(&Options::default(), 1).expect("a setup");
    let mut witness = RecordOut::memory(Rover::NAME);
    fly::<Rover>(&setup, &mut witness, &mut |_, _| {});
    let (log, contents) = run_again(witness.file(), None, Samples::Recorded).expect("reads");
    assert_eq!((contents.gaps, contents.idle_since), (0, None));
    let set = |config: &mut _, name: &str, value| Rover::set_parameter(config, name, value).is_ok();
    let options = ReplayOptions { from: Some(Instant::ZERO), is_thinned: true };
    let replayed = replay::<<Rover as Vehicle>::Runnables>(&log, Rover::default_config(), set, options);
    let replayed = replayed.expect("replays");
    assert!(replayed.difference.is_none() && replayed.activations > 1_000, "{replayed:?}");
}
