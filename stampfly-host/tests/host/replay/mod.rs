//! A log replays bit for bit, and whatever is not bit for bit is found and named.

mod damage;
mod places;

use crate::flown::{HOP, Hop, LATE, hop};
use crate::thorough::{is_thorough, thorough};
use places::{find, key_frame_parts, messages, offset, places, without, without_key_frames};
use stampfly_board::schedule::{ACTIVATIONS, Runnables};
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_board::{EstimatorKind, VehicleConfig, topics};
use stampfly_flight::replay::{self, Difference, Replay, ReplayError, ReplayOptions};
use stampfly_host::flown::fly;
use stampfly_host::recorder::{Memory, Recorder};
use stampfly_log::ActivationTopic;
use stampfly_log::ulog::{Definitions, End, Message, ReadErrorKind, Reader, Sample, Topic, Writer};
use stampfly_sim::vehicle::Vehicle;
use stampfly_types::messages::{ImuData, PowerData};
use stampfly_types::{ActivationRecord, Duration, InputRecord, Instant, Message as _};
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// The log of a flight.
fn record(setup: &Setup) -> Vec<u8> {
    let mut recorder = Recorder::<StampFly>::with_log(setup, &[("seed".to_owned(), setup.simulation.seed.to_string())]);
    fly::<StampFly>(setup, &mut recorder, &mut |_, _| {});
    recorder.log().to_vec()
}

pub fn replay(log: &[u8]) -> Result<Replay, ReplayError> {
    replay_from(log, None)
}

fn replay_from(log: &[u8], from: Option<Instant>) -> Result<Replay, ReplayError> {
    let set = |config: &mut VehicleConfig, name: &str, value| StampFly::set_parameter(config, name, value).is_ok();
    replay::replay::<Runnables>(log, VehicleConfig::default(), set, ReplayOptions { from, ..Default::default() })
}

/// The topics of a log of ours.
static TOPICS: LazyLock<Vec<Topic>> = LazyLock::new(|| {
    let of_the_bus = topics::TOPICS.iter().map(|info| Topic { name: info.name, fields: info.fields });
    of_the_bus.chain(StampFly::BESIDE.iter().copied()).collect()
});

fn difference(log: &[u8]) -> Difference {
    replay(log).expect("a log that can be replayed").difference.expect("a difference")
}

#[test]
fn flights_replay_bit_for_bit() {
    let all = [(4, Some(2)), (1, None), (2, None), (3, Some(1)), (5, Some(3)), (6, Some(4))];
    for (seed, jitter) in &all[..thorough(2, all.len())] {
        let mut setup = hop(*seed, *jitter);
        // Stamps beyond 32 bits, too.
        setup.simulation.start = Instant::from_micros(if seed % 2 == 0 { (1 << 32) - 6_000_000 } else { 0 });
        let log = record(&setup);
        let result = replay(&log).expect("a log that can be replayed");
        assert_eq!(result.difference, None, "seed {seed}, jitter {jitter:?}");
        assert!(result.activations > 20_000 && result.samples > 20_000, "{result:?}");
        assert_eq!((result.gaps, result.skipped), (0, 0));
        // One a second, and a moment later where an activation is pending.
        assert!(result.key_frames as f32 > 0.95 * result.duration.seconds(), "{result:?}");
    }
}

#[test]
fn a_replay_begins_at_any_key_frame() {
    for (jitter, Hop { log, .. }) in [(None, &*HOP), (Some(1), &*LATE)] {
        let whole = replay(log).expect("a log that can be replayed");
        for from in [0.5, 3.0, 5.7, 7.3] {
            let result = replay_from(log, Some(Instant::ZERO + Duration::from_seconds(from)));
            let result = result.unwrap_or_else(|error| panic!("from {from} s of {}: {error}", whole.duration));
            assert_eq!((&result.difference, result.gaps), (&None, 0), "from {from} s, jitter {jitter:?}");
            assert_eq!(result.activations + result.skipped, whole.activations, "{result:?}");
            let left_out = whole.duration.seconds() - result.duration.seconds();
            assert!((from - 0.1..from + 1.1).contains(&left_out), "from {from} s: {result:?}");
        }
        assert_eq!(replay_from(log, Some(Instant::from_secs(3_600))), Err(ReplayError::NoKeyFrame));
        let none = without_key_frames(log);
        assert_eq!(replay_from(&none, Some(Instant::from_secs(3))), Err(ReplayError::NoKeyFrame));
        let result = replay(&none).expect("from power-on");
        assert_eq!(result, Replay { key_frames: 0, ..whole });
    }
}

#[test]
fn parameters_come_from_the_log() {
    let mut setup = hop(1, None);
    setup.vehicle.cascade.altitude.height_gain *= 1.5;
    setup.vehicle.estimator = EstimatorKind::Complementary;
    setup.limit = Duration::from_secs(8);
    let result = replay(&record(&setup)).expect("a log that can be replayed");
    assert_eq!(result.difference, None);
}

/// How disorderly a flight was: activations of the estimator that found more than one inertial sample waiting, and
/// activations of the background that were interrupted by the flight band between reading and publishing.
fn disorder(log: &[u8]) -> (usize, usize) {
    let inputs: BTreeMap<String, usize> = Reader::new(log)
        .expect("a ULog")
        .filter_map(|message| match message {
            Ok(Message::Format(format)) => Some((format.name.to_owned(), ActivationTopic::inputs_of(&format)?)),
            _ => None,
        })
        .collect();
    let (mut waited, mut interrupted, mut telemetry_reads) = (0, 0, None);
    for place in places(log) {
        let payload = &log[place.payload];
        match place.topic.as_str() {
            "activation_estimation" => {
                let record = ActivationTopic::decode(payload, inputs["activation_estimation"]).expect("a record");
                waited += usize::from(record.inputs()[0].taken > 1);
                interrupted += usize::from(telemetry_reads == Some(false));
                telemetry_reads = telemetry_reads.map(|_| true);
            }
            "activation_telemetry" => telemetry_reads = Some(false),
            "telemetry" => telemetry_reads = None,
            _ => {}
        }
    }
    (waited, interrupted)
}

/// Without this, replaying flights with jitter would prove no more than replaying flights without.
#[test]
fn jitter_does_disturb() {
    let (waited, interrupted) = disorder(&HOP.log);
    assert!(interrupted == 0 && waited < 5, "an executor that is never late: {waited} {interrupted}");
    let (waited, interrupted) = disorder(&LATE.log);
    assert!(waited > 50, "estimation was late {waited} times");
    assert!(interrupted > 20, "telemetry was interrupted {interrupted} times");
}

#[test]
fn one_flipped_bit_is_found_and_named() {
    let log = &HOP.log;
    let place = find(log, "sensor_imu", Instant::from_secs(7));
    let accel = offset(log, "sensor_imu", "accel", Some(0));
    let mut changed = log.clone();
    changed[place.payload.start + accel + 1] ^= 0x10; // mantissa, 2^-11 of the value
    let found = difference(&changed);
    assert_eq!(found.activation, "estimation", "{found}");
    assert_eq!(found.now, place.at, "{found}");
    assert_eq!(found.topic, "estimate_state", "{found}");
    assert!(found.generation > 1_000, "{found}");
    let field = found.field.split('[').next().unwrap_or_default();
    let fields = TOPICS.iter().find(|topic| topic.name == found.topic).expect("a topic of ours").fields;
    assert!(fields.iter().any(|info| info.name == field && !info.unit.is_empty()), "{found}");
    let [recorded, replayed] = [&found.recorded, &found.replayed].map(|text| text.parse::<f32>().expect("numbers"));
    assert!(recorded != replayed && (recorded - replayed).abs() < 0.1, "{found}");
    for part in ["estimation", "estimate_state", &found.field, &found.recorded, &found.replayed] {
        assert!(found.to_string().contains(part), "{found}");
    }

    // From a key frame before it, it is found as well; from one behind it, it was never read.
    let late = replay_from(&changed, Some(Instant::from_secs(5))).expect("a key frame");
    assert_eq!(late.difference, Some(found));
    let later = replay_from(&changed, Some(Instant::from_secs(8))).expect("a key frame");
    assert_eq!(later.difference, None);
}

/// What a component has learned shows in its state before it shows in what it publishes.
#[test]
fn another_state_is_found_too() {
    let log = &HOP.log;
    let parts = key_frame_parts(log);
    let part = &parts[parts.len() / 2];
    let mut changed = log.clone();
    changed[part.end - 1] ^= 1;
    let found = difference(&changed);
    assert_eq!((found.activation.as_str(), found.field.as_str()), ("(key frame)", "(bytes)"), "{found}");
}

#[test]
fn a_changed_parameter_or_output_is_found_too() {
    let log = &HOP.log;
    let mut changed = log.clone();
    let name = b"position.pos.kp";
    let at = log.windows(name.len()).position(|window| window == name).expect("the parameter is in the log");
    changed[at + name.len() + 1] ^= 0x10;
    assert_eq!(difference(&changed).activation, "control");

    let place = find(log, "actuator_motor", Instant::from_secs(7));
    let mut changed = log.clone();
    changed[place.payload.start + offset(log, "actuator_motor", "duty", Some(2))] ^= 1;
    let found = difference(&changed);
    assert_eq!((found.activation.as_str(), found.field.as_str()), ("actuation", "duty[2]"), "{found}");
}

/// Something is missing: the replay passes over it, says so, and goes on at the next key frame.
fn goes_on(lossy: &[u8], what: &str) {
    let result = replay(lossy).expect("key frames follow");
    assert_eq!((&result.difference, result.gaps), (&None, 1), "without {what}");
    assert!(result.skipped > 0 && result.skipped < 5_000 && result.activations > 20_000, "{result:?}");
}

/// A log that lost something says so with a mark.
#[test]
fn a_loss_that_is_marked_is_passed_over() {
    let log = &HOP.log;
    let place = find(log, "sensor_imu", Instant::from_secs(7)).message();
    // Size, type and milliseconds.
    let mark = [2, 0, b'O', 5, 0];
    let lossy = [&log[..place.start], &mark, &log[place.start..]].concat();
    goes_on(&lossy, "what the mark stands for");
    match replay(&without_key_frames(&lossy)) {
        Err(ReplayError::Dropout { at }) => {
            assert!(at >= Instant::from_millis(6_990) && at <= Instant::from_millis(7_010), "{at}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_is_missing_is_found() {
    let log = &HOP.log;
    // Not when a key frame is made: it holds the samples that nothing has read yet, and shows the loss first.
    let at = Instant::from_millis(7_300);
    for (topic, reader) in [("sensor_imu", "estimation"), ("sensor_power", "failsafe"), ("command_guided", "failsafe")]
    {
        let place = find(log, topic, at);
        let lossy = without(log, place.message());
        goes_on(&lossy, topic);
        match replay(&without_key_frames(&lossy)) {
            Err(ReplayError::Gap { activation, now }) => {
                assert_eq!(activation, reader, "{topic}");
                let late = now.since(place.at).as_micros().max(place.at.since(now).as_micros());
                assert!(late < 20_000, "{topic} from {}, found missing at {now}", place.at);
            }
            other => panic!("a sample of {topic} is missing, and replay says {other:?}"),
        }
    }
    let output = find(log, "setpoint", at);
    let found = difference(&without(log, output.message()));
    assert_eq!((found.topic.as_str(), found.recorded.as_str()), ("setpoint", "nothing"), "{found}");

    // Without its activation there is no set-point, and the next to read it is in want of it.
    let activation = find(log, "activation_navigation", at);
    let lossy = without(log, activation.message());
    goes_on(&lossy, "the activation of navigation");
    match replay(&without_key_frames(&lossy)) {
        Err(ReplayError::Gap { activation, .. }) => assert_eq!(activation, "control"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_last_output_missing_its_activation_is_found() {
    let log = &HOP.log;
    let last = places(log).into_iter().rfind(|place| place.topic == "activation_telemetry").expect("telemetry");
    let found = difference(&without(log, last.message()));
    assert_eq!((found.topic.as_str(), found.replayed.as_str()), ("telemetry", "nothing"), "{found}");
}

#[test]
fn a_log_that_was_cut_off_replays_up_to_there() {
    let log = &HOP.log;
    let place = find(log, "sensor_imu", Instant::from_secs(7));
    let at = place.message().start;
    let whole = replay(&log[..at]).expect("a log that can be replayed");
    for length in thorough(&[at + 1, at + 7][..], &[at + 1, at + 2, at + 3, at + 7, place.payload.end - 1][..]) {
        let result = replay(&log[..*length]).expect("a log that can be replayed");
        assert_eq!(result.end, End::Cut { at, rest: length - at });
        assert_eq!(Replay { end: End::Whole, ..result }, whole, "cut at {length}");
    }
    // In its head there is nothing to replay.
    assert!(matches!(replay(&log[..1_000]), Err(ReplayError::NoneLeft(End::Cut { .. }))));
}

/// Where the log is damaged, the replay goes on at the next key frame.
#[test]
fn a_damaged_log_replays_where_it_is_whole() {
    let log = &HOP.log;
    let whole = replay(log).expect("a log that can be replayed");
    let marks = Reader::new(log).expect("a log").filter(|message| *message == Ok(Message::Sync)).count();
    assert_eq!(marks as u64, whole.key_frames, "a mark before each key frame");
    let at = find(log, "sensor_imu", Instant::from_secs(5)).message().start;
    let mut damages = vec![("lost bytes", [&log[..at + 5], &log[at + 9..]].concat())];
    if is_thorough() {
        let mut zeros = log.clone();
        zeros[at..at + 4096].fill(0);
        damages.push(("zeros", zeros));
    }
    for (what, damaged) in damages {
        let result = replay(&damaged).expect("a log that can be replayed");
        let End::Damaged { at: told, skipped, .. } = result.end else { panic!("{what}: {}", result.end) };
        // A key frame a second, and a mark before each.
        assert!(told.abs_diff(at) < 100 && skipped < 600_000, "{what} at {at}: {}", result.end);
        assert!(result.difference.is_none() && result.gaps >= 1, "{what}: {result:?}");
        assert!(
            result.activations + 10_000 > whole.activations && result.activations < whole.activations,
            "{result:?}"
        );
    }
    // Damage without a key frame behind it ends the replay as a cut does.
    let last = [&log[..log.len() - 3_000], &log[log.len() - 2_990..]].concat();
    let result = replay(&last).expect("a log that can be replayed");
    assert!(!result.end.is_whole() && result.difference.is_none(), "{result:?}");
    assert!(result.activations + 1_000 > whole.activations, "{result:?}");
    // Without its topics there is nothing to repeat.
    let head = [&log[..200], &log[203..]].concat();
    assert!(matches!(replay(&head), Err(ReplayError::NoneLeft(End::Damaged { .. }))));
}

/// The vehicle was switched off while it wrote: every whole message is worth replaying.
#[test]
fn a_log_that_was_cut_between_two_messages_is_no_difference() {
    let log = &HOP.log;
    let messages = messages(log);
    let middle = find(log, "sensor_imu", Instant::from_secs(7)).message().start;
    let first = messages.iter().position(|(_, bytes)| bytes.start == middle).expect("a message");
    // A replay for each, of seven seconds.
    for (kind, bytes) in &messages[first..first + thorough(12, 40)] {
        let result = replay(&log[..bytes.end]).expect("a log that can be replayed");
        assert_eq!(result.difference, None, "cut behind a message '{}' at {}", char::from(*kind), bytes.end);
        assert!(result.activations > 10_000 && result.gaps == 0, "{result:?}");
    }
}

/// The same where a key frame, which is several messages, is written.
#[test]
fn a_log_that_was_cut_in_a_key_frame_is_no_difference() {
    let log = &HOP.log;
    let parts = key_frame_parts(log);
    let frames: Vec<_> = parts.chunk_by(|a, b| a.end == b.start).collect();
    let frame = frames[frames.len() / 2];
    assert!(frame.len() > 1, "{frame:?}");
    for part in frame {
        let result = replay(&log[..part.end]).expect("a log that can be replayed");
        assert_eq!(result.difference, None, "cut at {}", part.end);
        assert!(result.activations > 5_000 && result.gaps == 0, "{result:?}");
    }
}

fn written(
    topics: &[Topic],
    activations: &[ActivationTopic],
    parameter: Option<(&str, f32)>,
    write: impl FnOnce(&mut Writer<Memory, (&[Topic], &[ActivationTopic])>),
) -> Vec<u8> {
    let mut head = Definitions::start(Memory::default(), Instant::ZERO).expect("memory");
    if let Some((name, value)) = parameter {
        head.parameter(name, value.into()).expect("memory");
    }
    let mut log = head.data((topics, activations)).expect("memory");
    write(&mut log);
    log.into_sink().0
}

#[test]
fn logs_of_others_are_refused_with_a_reason() {
    assert!(
        matches!(replay(b"PK\x03\x04 no log"), Err(ReplayError::Log(error)) if error.kind == ReadErrorKind::NotULog)
    );
    assert!(matches!(replay(b""), Err(ReplayError::Log(_))));

    let foreign = [Topic { name: "vehicle_attitude", fields: PowerData::FIELDS }];
    let words = PowerData::default().to_words();
    let sample = Sample { at: Instant::from_micros(1), generation: 1, words: &words };
    let log = written(&foreign, &[], None, |log| log.sample(0, &sample).expect("memory"));
    assert_eq!(replay(&log), Err(ReplayError::NoActivations));

    // Ours, but recorded without activations.
    let ours = written(&TOPICS, &[], None, |_| {});
    assert_eq!(replay(&ours), Err(ReplayError::NoActivations));

    // A topic of ours that another version laid out otherwise.
    let other = [Topic { name: "sensor_imu", fields: PowerData::FIELDS }];
    let log = written(&other, &[], None, |_| {});
    assert_eq!(replay(&log), Err(ReplayError::Schema("sensor_imu".into())));
    let other = [Topic { name: "sensor_power", fields: ImuData::FIELDS }];
    let log = written(&other, &[], None, |_| {});
    assert_eq!(replay(&log), Err(ReplayError::Schema("sensor_power".into())));

    // A runnable this program does not have.
    let activations = [ActivationTopic { name: "warp_drive", index: 0, inputs: 1 }];
    let log = written(&TOPICS, &activations, None, |_| {});
    assert_eq!(replay(&log), Err(ReplayError::Schema("activation_warp_drive".into())));

    for parameter in [("no.such.parameter", 1.0), ("position.pos.kp", f32::NAN), ("position.pos.kp", 1e9)] {
        let log = written(&TOPICS, &[], Some(parameter), |_| {});
        assert_eq!(replay(&log), Err(ReplayError::Parameter(parameter.0.into())));
    }
    for error in [ReplayError::NoActivations, ReplayError::Schema("a".into()), ReplayError::Parameter("b".into())] {
        assert!(error.to_string().len() > 20, "{error}");
    }
}

/// A runnable that reads more than this program's is another version's.
#[test]
fn activations_with_other_inputs_are_refused() {
    let name = ACTIVATIONS[0].name;
    for inputs in [0, 1, 16] {
        let activations = [ActivationTopic { name, index: 0, inputs }];
        let log = written(&TOPICS, &activations, None, |log| {
            let mut record = ActivationRecord::new(0, Instant::from_micros(2_500));
            for _ in 0..inputs {
                record.push(InputRecord::default()).expect("room");
            }
            log.activation(&record).expect("memory");
        });
        assert_eq!(replay(&log), Err(ReplayError::Schema(format!("activation_{name}"))), "{inputs} inputs");
    }
}
