//! The flight record by radio: a station with the key asks for it before the take-off, and what arrives replays bit for bit.

use crate::thorough::thorough;
use stampfly_board::VehicleConfig;
use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::{Air, Setup, StampFly};
use stampfly_flight::compact::{File, Samples};
use stampfly_flight::replay::{ReplayOptions, replay};
use stampfly_host::flight_log;
use stampfly_host::flown::fly;
use stampfly_host::log::record::{as_log, run_again};
use stampfly_types::messages::FlightMode;
use stampfly_types::{Duration, Instant};

/// So many frames of a thousand are lost: none, as at the end of a garden, as at a desk.
const LOSSES: [u16; 3] = [0, 10, 2];
/// A frame of ESP-NOW has room for so much of a chunk.
const LARGEST: usize = 219;

/// What arrives of a flight.
fn received(loss: u16) -> (Vec<u8>, [u32; 2]) {
    let mission = Mission::parse("arm\ntakeoff 0.6\nhover 25\nland\n").expect("a mission");
    let air = Some(Air { record: true, loss, ..Air::default() });
    // Sticks, because a command that is lost is not said again.
    let setup = Setup { mission, air, pilot: Some(FlightMode::PosHold), ..Setup::reference(5) };
    let outcome = fly::<StampFly>(&setup, &mut (), &mut |_, _| {}).outcome;
    assert!(outcome.finished, "{loss}");
    (outcome.record, outcome.air.chunks)
}

/// How often the numbers of what has arrived jump, and how many are missing.
fn jumps(file: &[u8]) -> (u64, u32) {
    let numbers: Vec<u32> = File::new(file).expect("a record").flatten().map(|chunk| chunk.number).collect();
    let steps = numbers.iter().zip(&numbers[1..]).map(|(one, next)| next - one);
    (steps.clone().filter(|step| *step != 1).count() as u64, steps.map(|step| step - 1).sum())
}

/// Was it armed, each change of it, in the whole log of what arrived?
fn armed(file: &[u8]) -> Vec<bool> {
    let (log, _) = as_log(file).expect("reads");
    let parsed = flight_log::parse(&log).expect("a log");
    let status = &parsed.flight.topics["flight_status"];
    let mut armed: Vec<bool> = status.column("armed").expect("a field").iter().map(|value| *value != 0.0).collect();
    armed.dedup();
    armed
}

#[test]
fn what_arrives_replays_bit_for_bit_and_what_does_not_is_counted() {
    for loss in LOSSES.into_iter().take(thorough(2, 3)) {
        let (file, [sent, arrived]) = received(loss);
        let largest = File::new(&file).expect("a record").flatten().map(|chunk| chunk.words.len()).max();
        assert!(largest.is_some_and(|largest| (LARGEST - 40..=LARGEST).contains(&largest)), "{largest:?}");
        let (gaps, missing) = jumps(&file);
        let (log, contents) = run_again(&file, None, Samples::Recorded).expect("reads");
        println!("{loss} of 1000: {sent} chunks, {arrived} arrived, {gaps} gaps, {contents:?}");
        // The last ones may be missing without a later one that shows it.
        assert!(sent - arrived >= missing && sent - arrived < missing + 3, "{sent} {arrived} {missing}");
        assert_eq!((contents.gaps, contents.lost, contents.idle_since), (gaps, 0, None));
        let options = ReplayOptions { from: Some(Instant::ZERO), is_thinned: true };
        let replayed = replay::<Runnables>(&log, VehicleConfig::default(), |_, _, _| true, options).expect("replays");
        assert_eq!(replayed.difference, None, "{loss}");
        assert!(replayed.activations > 1_000, "{replayed:?}");
        let [from, to] = contents.span.expect("a key frame");
        if loss == 0 {
            // Whole: from before it was armed until after it was disarmed.
            assert_eq!((gaps, sent), (0, arrived));
            assert_eq!(armed(&file), [false, true, false]);
            assert!(to.since(from) > Duration::from_secs(12), "{from} {to}");
        } else {
            assert!(gaps > 0, "{loss}");
        }
    }
}
