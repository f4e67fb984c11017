//! The same setup is the same flight, bit for bit, whoever watches and whatever else flies in the process.
//!
//! The hash covers every sample of every topic with its instant and number, so one different bit anywhere shows.

use crate::flown::{HOP, Hop, hop};
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_host::flown::fly;
use stampfly_host::recorder::Recorder;
use stampfly_types::Instant;
use std::sync::LazyLock;

const SEEDS: [u64; 8] = [1, 2, 3, 5, 8, 13, 21, 34];

fn setup(seed: u64) -> Setup {
    hop(seed, None)
}

fn hash_with(setup: &Setup, mut recorder: Recorder<StampFly>) -> u64 {
    let outcome = fly::<StampFly>(setup, &mut recorder, &mut |_, _| {}).outcome;
    assert!(outcome.finished && outcome.metrics.landed, "seed {}", setup.simulation.seed);
    recorder.hash()
}

fn hash(setup: &Setup) -> u64 {
    hash_with(setup, Recorder::<StampFly>::hash_only())
}

#[test]
fn watching_changes_nothing() {
    let setup = setup(1);
    let expected = hash(&setup);
    assert_eq!(hash(&setup), expected, "flown again");
    assert_eq!(HOP.hash, expected, "with a log and a compact record");
    assert_eq!(hash_with(&setup, Recorder::<StampFly>::with_log(&setup, &[])), expected, "with a log");
    assert_eq!(hash_with(&setup, Recorder::<StampFly>::hash_only().with_timing()), expected, "with timing");
    let facts = [("who".to_owned(), "somebody".to_owned())];
    assert_eq!(
        hash_with(&setup, Recorder::<StampFly>::with_log(&setup, &facts).with_timing()),
        expected,
        "with both, and facts"
    );
}

#[test]
fn the_log_and_the_figures_are_the_same_too() {
    let (first, second) = (&*HOP, Hop::fly(&setup(1)));
    assert!(first.log.len() > 1_000_000, "a whole flight");
    assert!(*first == second);
}

#[test]
fn whatever_decides_a_flight_changes_its_hash() {
    let reference = setup(1);
    let changed = |change: fn(&mut Setup)| {
        let mut setup = reference.clone();
        change(&mut setup);
        hash(&setup)
    };
    let mut hashes = vec![
        ("nothing", HOP.hash),
        ("seed", changed(|setup| setup.simulation.seed = 2)),
        ("start", changed(|setup| setup.simulation.start = Instant::from_micros(1))),
        ("mass", changed(|setup| setup.simulation.plant.mass *= 1.000_001)),
        ("vibration", changed(|setup| setup.simulation.vibration = 0.999)),
        ("gust", changed(|setup| setup.simulation.wind.gust = 0.499)),
        ("a gain", changed(|setup| setup.vehicle.cascade.altitude.height_gain *= 1.000_01)),
        ("jitter", changed(|setup| setup.jitter = Some(1))),
        ("other jitter", changed(|setup| setup.jitter = Some(2))),
    ];
    hashes.sort_by_key(|(_, hash)| *hash);
    for pair in hashes.windows(2) {
        assert_ne!(pair[0].1, pair[1].1, "{} and {} fly the same", pair[0].0, pair[1].0);
    }
}

#[test]
fn a_late_executor_is_late_in_the_same_way_again() {
    let setup = Setup { jitter: Some(7), ..setup(1) };
    assert_eq!(hash(&setup), hash(&setup));
}

/// The hash of each, each by itself.
static ALONE: LazyLock<Vec<u64>> = LazyLock::new(|| SEEDS.iter().map(|seed| hash(&setup(*seed))).collect());

#[test]
fn vehicles_on_other_threads_do_not_matter() {
    let together: Vec<u64> = std::thread::scope(|scope| {
        let threads: Vec<_> = SEEDS.iter().map(|seed| scope.spawn(|| hash(&setup(*seed)))).collect();
        threads.into_iter().map(|thread| thread.join().expect("no panic")).collect()
    });
    assert_eq!(*ALONE, together);
}

/// Flies the first vehicle; in the middle of its flight flies the next one, and so on.
fn nested(seeds: &[u64]) -> Vec<u64> {
    let Some((seed, others)) = seeds.split_first() else { return Vec::new() };
    let (mut looks, mut inner) = (0, Vec::new());
    let mut recorder = Recorder::<StampFly>::hash_only();
    fly::<StampFly>(&setup(*seed), &mut recorder, &mut |_, _| {
        looks += 1;
        if looks == 60 {
            inner = nested(others);
        }
    });
    assert!(looks > 60, "the others were flown in the middle");
    inner.insert(0, recorder.hash());
    inner
}

/// Eight vehicles in the air at once on one thread: there is nothing they could share.
#[test]
fn vehicles_on_the_same_thread_do_not_matter() {
    // Without optimisation a flight needs a quarter of a megabyte of stack.
    let stack = SEEDS.len() << 20;
    let thread = std::thread::Builder::new().stack_size(stack).spawn(|| nested(&SEEDS)).expect("a thread");
    assert_eq!(thread.join().expect("no panic"), *ALONE);
}
