//! Every chip, every fault: a typed error within its time, neighbours that notice nothing, recovery without a restart.
//!
//! All seven drivers run as in flight on the two buses. A fault begins after one second and ends 0.4 s later; a clock
//! that is held, which takes turns away from everybody, two seconds later.

mod rig;

use core::ops::Range;
use rig::{Access, NAMES, Said, run, run_with};
use stampfly_drivers::SensorErrorKind;
use stampfly_sim::chips::Faults;
use stampfly_types::{Duration, Instant};

const BEGIN: Instant = Instant::from_millis(1_000);
const FAULT_ENDS: Instant = Instant::from_millis(1_400);
const FAULT: Range<Instant> = BEGIN..FAULT_ENDS;
const END: Instant = Instant::from_millis(3_500);

/// What each driver promises, ms: time between samples, from a fault to an error, from its end to a sample.
///
/// The promises are the drivers' documentation: four output periods of the inertial sensor; `interval` and a transfer of
/// the flow sensor; a conversion and its limit; two periods and 20 ms of a range finder, and four and 350 ms more with a
/// start. To the recovery belong the start sequence, a driver's last attempt, and the 80 ms before the next.
const PROMISES: [(u64, u64, u64); 7] = [
    (3, 20, 330),    // imu
    (11, 40, 380),   // flow
    (42, 100, 230),  // mag
    (42, 100, 230),  // baro
    (105, 250, 430), // power
    (36, 90, 900),   // tof
    (36, 90, 900),   // tof_front
];

fn promise(index: usize) -> [Duration; 3] {
    let (period, error, recovery) = PROMISES[index];
    [period, error, recovery].map(Duration::from_millis)
}

fn samples(said: &[Said]) -> impl Iterator<Item = (Instant, f32)> {
    said.iter().filter_map(|(at, said)| said.ok().map(|figure| (*at, figure)))
}

fn errors(said: &[Said]) -> Vec<(Instant, SensorErrorKind)> {
    said.iter().filter_map(|(at, said)| said.err().map(|kind| (*at, kind))).collect()
}

/// The longest time without a sample between two instants.
fn longest_gap(said: &[Said], begin: Instant, end: Instant) -> Duration {
    let instants = samples(said).map(|(at, _)| at).filter(|at| (begin..=end).contains(at));
    let (last, gap) = instants.fold((begin, Duration::ZERO), |(last, gap), at| (at, gap.max(at.since(last))));
    gap.max(end.since(last))
}

/// The same from one second after the start on, when everything runs.
fn assert_unharmed(index: usize, said: &[Said], end: Instant, what: &str) {
    let late: Vec<_> = errors(said).into_iter().filter(|(at, _)| *at >= BEGIN).collect();
    assert!(late.is_empty(), "{what}: {} said {late:?}", NAMES[index]);
    let [period, ..] = promise(index);
    let gap = longest_gap(said, BEGIN, end);
    // A sample may come late by what the bus is busy, and one range finder by its look every 2 ms.
    assert!(gap <= period + period, "{what}: {} was silent for {gap}", NAMES[index]);
}

/// Samples come again within the promised time, and say what they said before.
fn assert_recovered(index: usize, said: &[Said], from: Instant, end: Instant, what: &str) {
    let [.., recovery] = promise(index);
    let again = samples(said).map(|(at, _)| at).find(|at| *at > from);
    let took = again.map(|at| at.since(from));
    assert!(took.is_some_and(|took| took <= recovery), "{what}: {} took {took:?}", NAMES[index]);
    let mean = |begin: Instant, end: Instant| {
        let figures: Vec<f32> = samples(said).filter(|(at, _)| (begin..end).contains(at)).map(|(_, f)| f).collect();
        figures.iter().sum::<f32>() / figures.len() as f32
    };
    let (before, after) = (mean(Instant::from_millis(700), BEGIN), mean(end - Duration::from_millis(700), end));
    // Noise of the mean of some samples: m/s², share, µT, Pa, V, m, share.
    let tolerance = [0.05, 0.1, 1.0, 2.0, 0.02, 0.002, 0.1][index];
    assert!((before - after).abs() < tolerance, "{what}: {} says {after} after {before}", NAMES[index]);
}

/// Runs every chip through a fault that lasts from [`BEGIN`] to [`FAULT_ENDS`].
fn each(
    chips: &[usize],
    what: &str,
    on: impl Fn(&Access, usize),
    off: impl Fn(&Access, usize),
    look: impl Fn(usize, &[Said]),
) {
    for &index in chips {
        let said = run(END, &[(BEGIN, &|access| on(access, index)), (FAULT_ENDS, &|access| off(access, index))]);
        look(index, &said[index]);
        assert_recovered(index, &said[index], FAULT_ENDS, END, what);
        for other in (0..NAMES.len()).filter(|other| *other != index) {
            assert_unharmed(other, &said[other], END, &format!("{what} of {}", NAMES[index]));
        }
    }
}

const ALL: [usize; 7] = [0, 1, 2, 3, 4, 5, 6];
const ON_I2C: [usize; 5] = [2, 3, 4, 5, 6];

fn set(faults: Faults) -> impl Fn(&Access, usize) {
    move |access, index| access.chip(index).set_faults(faults)
}

fn heal(access: &Access, index: usize) {
    access.chip(index).set_faults(Faults::default());
}

/// An error of one of these kinds came in time, and no sample during the fault but those already on their way.
fn assert_failed(index: usize, said: &[Said], fault: &Range<Instant>, kinds: &[SensorErrorKind], what: &str) {
    let [_, limit, _] = promise(index);
    let during: Vec<_> = errors(said).into_iter().filter(|(at, _)| fault.contains(at)).collect();
    let first = during.first().map(|(at, _)| at.since(fault.start));
    assert!(first.is_some_and(|first| first <= limit), "{what}: {} said {first:?}", NAMES[index]);
    assert!(during.iter().all(|(_, kind)| kinds.contains(kind)), "{what}: {} said {during:?}", NAMES[index]);
    let samples = samples(said).filter(|(at, _)| (fault.start + limit..fault.end).contains(at)).count();
    assert_eq!(samples, 0, "{what}: {} measures on", NAMES[index]);
}

#[test]
fn without_a_fault_nobody_says_an_error() {
    let said = run(END, &[]);
    for (index, said) in said.iter().enumerate() {
        assert_unharmed(index, said, END, "no fault");
        let first = samples(said).next().map(|(at, _)| at);
        assert!(first.is_some_and(|at| at < Instant::from_millis(700)), "{} began {first:?}", NAMES[index]);
    }
}

#[test]
fn a_dead_chip() {
    // All ones on SPI are an identity that no chip has, or data of sensors that do not run.
    use SensorErrorKind::*;
    let dead = Faults { dead: true, ..Faults::default() };
    each(&ALL, "death", set(dead), heal, |index, said| {
        assert_failed(index, said, &FAULT, &[Bus, Timeout, Absent, Configuration, Data, Restarted], "death");
    });
}

#[test]
fn refused_transfers() {
    let refusing = Faults { refusals: 1.0, ..Faults::default() };
    each(&ALL, "refusal", set(refusing), heal, |index, said| {
        // A range finder that does not acknowledge may have restarted at its first address.
        assert_failed(index, said, &FAULT, &[SensorErrorKind::Bus, SensorErrorKind::Restarted], "refusal");
    });
}

#[test]
fn a_short_refusal_leaves_a_short_gap_in_the_inertial_samples() {
    // A period has passed when the fault begins, and a pause after its end.
    let (unavoidable, end) = (Duration::from_micros(5_200), Instant::from_millis(1_100));
    for refused in [1, 8, 18].map(Duration::from_millis) {
        for begin in (0..10).map(|n| BEGIN + Duration::from_micros(270 * n)) {
            let refusing = set(Faults { refusals: 1.0, ..Faults::default() });
            let said =
                run(end, &[(begin, &|access| refusing(access, 0)), (begin + refused, &|access| heal(access, 0))]);
            let gap = longest_gap(&said[0], BEGIN, end);
            assert!(gap <= refused + unavoidable, "{refused} of refused transfers leave a gap of {gap}");
        }
    }
}

#[test]
fn bit_errors() {
    // At a hundredth every other transfer of a few bytes is hit, and hardly any start succeeds; at a thousandth starts do
    // succeed. What is garbled cannot always be known, but nobody hangs, and nobody stays wrong.
    for (seed, bit_errors) in (1..=4).flat_map(|seed| [0.01, 0.001].map(|bit_errors| (seed, bit_errors))) {
        let noisy = set(Faults { bit_errors, ..Faults::default() });
        for index in ALL {
            let said = run_with(
                seed,
                END,
                &[(BEGIN, &|access| noisy(access, index)), (FAULT_ENDS, &|access| heal(access, index))],
            );
            let what = format!("noise of {bit_errors} with seed {seed}");
            let [period, _, recovery] = promise(index);
            let mut last = BEGIN;
            for (at, _) in said[index].iter().filter(|(at, _)| (BEGIN..FAULT_ENDS).contains(at)) {
                let silence = at.since(last);
                assert!(silence <= period + recovery, "{what}: {} said nothing for {silence}", NAMES[index]);
                last = *at;
            }
            assert_recovered(index, &said[index], FAULT_ENDS, END, &what);
            for other in (0..NAMES.len()).filter(|other| *other != index) {
                assert_unharmed(other, &said[other], END, &format!("{what} of {}", NAMES[index]));
            }
        }
    }
}

#[test]
fn a_stretched_clock() {
    // Half a millisecond in every transfer: slow, but within what every driver allows.
    let slow = Faults { stretch: Duration::from_micros(500), ..Faults::default() };
    each(&ON_I2C, "stretching", set(slow), heal, |index, said| assert_unharmed(index, said, END, "stretching"));
}

#[test]
fn a_clock_that_is_held() {
    // 15 ms in every transfer is given up. Nobody can use the bus meanwhile, so the neighbours miss samples; but in
    // between they have their turns, and nobody is worse off afterwards. Who waits behind a held transfer is given up
    // with it and asks again after 80 ms at most, so which turns are lost is a matter of chance: in two seconds the
    // slowest neighbour is served some twenty times, and less than half of that would be starving.
    let held = Faults { stretch: Duration::from_millis(15), ..Faults::default() };
    let ends = Instant::from_millis(3_000);
    let end = Instant::from_millis(5_100);
    for index in ON_I2C {
        let said = run(end, &[(BEGIN, &|access| set(held)(access, index)), (ends, &|access| heal(access, index))]);
        let fault = BEGIN..ends;
        assert_failed(index, &said[index], &fault, &[SensorErrorKind::Timeout, SensorErrorKind::Bus], "held clock");
        for other in ON_I2C {
            assert_recovered(other, &said[other], ends, end, "held clock");
            let served = samples(&said[other]).filter(|(at, _)| fault.contains(at)).count();
            assert!(
                other == index || served >= 8,
                "held clock of {}: {} is served {served} times",
                NAMES[index],
                NAMES[other]
            );
        }
        assert_unharmed(0, &said[0], end, "held clock");
        assert_unharmed(1, &said[1], end, "held clock");
    }
}

#[test]
fn a_reset_in_flight() {
    use SensorErrorKind::*;
    each(
        &ALL,
        "reset",
        |access, index| access.chip(index).reset(),
        |_, _| {},
        |index, said| {
            let [_, limit, _] = promise(index);
            let (first, kind) = errors(said).into_iter().find(|(at, _)| *at >= BEGIN).expect("a chip that was reset");
            assert!(first.since(BEGIN) <= limit, "{} said so after {}", NAMES[index], first.since(BEGIN));
            // Some notice it by an answer that is none, before they look.
            assert!([Restarted, Bus, Timeout, Data].contains(&kind), "{} said {kind:?}", NAMES[index]);
            assert_recovered(index, said, BEGIN + limit, END, "reset");
        },
    );
}

#[test]
fn another_part() {
    let ids = |id: u16| {
        move |access: &Access, index: usize| {
            access.chip(index).set_id(id);
            access.chip(index).reset();
        }
    };
    let right = [0x24, 0x49, 0x32, 0x58, 0x3220, 0xEA, 0xEA];
    each(
        &ALL,
        "another part",
        ids(0x77),
        |access, index| ids(right[index])(access, index),
        |index, said| {
            let kinds = errors(said);
            assert!(
                kinds.iter().any(|(_, kind)| *kind == SensorErrorKind::Identification),
                "{}: {kinds:?}",
                NAMES[index]
            );
        },
    );
}

#[test]
fn a_data_line_that_is_held() {
    let said = run(END, &[(BEGIN, &|access| access.i2c.hold_sda())]);
    let failed: usize = ON_I2C.iter().map(|index| errors(&said[*index]).len()).sum();
    assert_eq!(failed, 1, "the one whose turn it was frees the bus for all");
    for index in ON_I2C {
        assert_recovered(index, &said[index], BEGIN, END, "held data line");
    }
    for index in [0, 1] {
        assert_unharmed(index, &said[index], END, "held data line");
    }
}

/// The chips answer and measure nothing, which only some of them can tell: the barometer's result cannot be, the others
/// say zero or that they do not vouch for it.
#[test]
fn a_dead_sensing_element() {
    each(
        &ALL,
        "dead element",
        |access, index| access.chip(index).set_broken(true),
        |access, index| access.chip(index).set_broken(false),
        |index, said| {
            if NAMES[index] == "baro" {
                return assert_failed(index, said, &FAULT, &[SensorErrorKind::Data], "dead element");
            }
            let [_, limit, _] = promise(index);
            let figures = samples(said).filter(|(at, _)| (BEGIN + limit..FAULT_ENDS).contains(at));
            let (count, most) = figures.fold((0, 0.0f32), |(count, most), (_, figure)| (count + 1, most.max(figure)));
            // m/s², share, µT, nothing, V, m, share: zero and noise. The one that looks ahead sees nothing anyway.
            let expected = [1.0, 0.1, 3.0, 0.0, 0.1, 0.001, 0.1][index];
            assert!(count > 0 && most < expected, "{} says {most} in {count} samples", NAMES[index]);
        },
    );
}
