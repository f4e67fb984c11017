//! Self-tests of chips without a built-in one: a healthy chip passes and continues to measure, each
//! failure is named, and the test ends with any bus fault.

use crate::drivers::spoilt::Change;
use core::cell::Cell;
use stampfly_drivers::chip::ChipError;
use stampfly_sim::chips::{Attached, BusError};
use stampfly_sim::time::Clock;

type Outcome = Result<(), ChipError<BusError>>;
type Bench<D> = (Clock, Attached, D);

/// Replaces bytes in answers of this length to this register, from this position on.
fn put(register: u16, length: usize, place: usize, bytes: &'static [u8]) -> Change {
    Box::new(move |asked, answer| {
        if (asked, answer.len()) == (register, length) {
            answer[place..][..bytes.len()].copy_from_slice(bytes);
        }
    })
}

/// The first byte of this register differs with each read: 1, 2, 3.
fn restless(register: u16) -> Change {
    let count = Cell::new(0);
    Box::new(move |asked, answer| {
        if asked == register {
            count.set(count.get() + 1);
            answer[0] = count.get();
        }
    })
}

/// Healthy, or with a broken sensing element: checks result, duration, and that the chip measures
/// as before.
macro_rules! tells_healthy_from_broken {
    ($bench:expr, $millis:expr, $figure:ident, $tolerance:expr) => {
        for broken in [false, true] {
            let (clock, attached, mut driver) = $bench(Spoil::NOT);
            let mut figure = || {
                let sample = block_on(&clock, driver.next()).expect("a sample");
                (sample.at, sample.data.$figure)
            };
            let [.., before] = [0; 5].map(|_| figure());
            attached.set_broken(broken);
            let begun = clock.now();
            let outcome = block_on(&clock, driver.self_test());
            let took = clock.now().since(begun);
            assert_eq!(outcome, if broken { Err(ChipError::SelfTest) } else { Ok(()) });
            assert!(took < Duration::from_millis($millis), "{took}");
            attached.set_broken(false);
            let after = [0; 5].map(|_| {
                let sample = block_on(&clock, driver.next()).expect("a sample");
                (sample.at, sample.data.$figure)
            });
            let off = after.map(|(at, figure)| (at > before.0, (figure - before.1).abs() < $tolerance));
            assert_eq!(off[2..], [(true, true); 3], "{before:?} and then {after:?}");
        }
    };
}

/// On a bus without answers, with refusals, bit errors or latency, before and after a start.
macro_rules! ends_in_time {
    ($bench:expr, $slow:expr, $millis:expr) => {
        let limit = Duration::from_millis($millis);
        let faults = [
            Faults { dead: true, ..Faults::default() },
            Faults { refusals: 1.0, ..Faults::default() },
            Faults { refusals: 0.1, ..Faults::default() },
            Faults { bit_errors: 0.001, ..Faults::default() },
            Faults { bit_errors: 0.3, ..Faults::default() },
        ];
        for faults in faults {
            for started in [false, true] {
                let (clock, attached, mut driver) = $bench(Spoil::NOT);
                if started {
                    assert_eq!(block_on(&clock, driver.start()), Ok(()));
                }
                attached.set_faults(faults);
                let begun = clock.now();
                let outcome = block_on(&clock, driver.self_test());
                let took = clock.now().since(begun);
                assert!(took < limit, "{faults:?}: {took}");
                assert!(outcome.is_err() || faults.refusals + faults.bit_errors < 0.2, "{faults:?}: {outcome:?}");
                attached.set_faults(Faults::default());
                assert_eq!(block_on(&clock, driver.self_test()), Ok(()), "after {faults:?}");
            }
        }
        let outcomes: [(Duration, Outcome); 2] =
            [(Duration::from_secs(100), Err(ChipError::BusTimeout)), (Duration::from_millis($slow), Ok(()))];
        for (delay, expected) in outcomes {
            let (clock, _, mut driver) = $bench(Spoil::slow(delay));
            let begun = clock.now();
            assert_eq!(block_on(&clock, driver.self_test()), expected, "{delay} more");
            let took = clock.now().since(begun);
            assert!(took < limit, "{delay} more: {took}");
        }
    };
}

/// Each change of the chip's answers has its result.
macro_rules! says {
    ($bench:expr, $millis:expr, $changes:expr) => {
        for (number, (change, expected)) in $changes.into_iter().enumerate() {
            let (clock, _, mut driver) = $bench(Spoil::changed(change));
            let begun = clock.now();
            assert_eq!(block_on(&clock, driver.self_test()), expected, "change {number}");
            assert!(clock.now().since(begun) < Duration::from_millis($millis), "change {number}");
        }
    };
}

const fn identification(found: u16) -> Outcome {
    Err(ChipError::Identification { found })
}

const fn configuration(status: u8) -> Outcome {
    Err(ChipError::Configuration { status })
}

const FAILED: Outcome = Err(ChipError::SelfTest);

mod bmp280;
mod ina3221;
mod pmw3901;
mod vl53l3cx;
