//! A change of parameters: nothing before it is applied, all of it at once, back when it fails.

use proptest::prelude::*;
use stampfly_param::{
    ParameterAction, ParameterError, ParameterRequest, ParameterSet, ParameterTable, key, parameters,
};
use stampfly_types::{Duration, Instant, Message};

parameters! {
    /// A crane.
    pub struct Crane {
        /// Hoist.
        hoist: Hoist {
            /// Slow speed.
            slow = 0.1 in [0.0, 1.0] "m/s";
            /// Fast speed.
            fast = 0.5 in [0.0, 2.0] "m/s";
        }
        /// Slewing gear.
        slew: Slew {
            /// Its speed.
            rate = 0.2 in [0.0, 1.0] "rad/s";
        }
    }
    where crane:
    "hoist.slow" "hoist.fast" crane.hoist.slow <= crane.hoist.fast => "slow would be faster than fast";
}

const PROBATION: Duration = Duration::from_secs(1);

fn set() -> ParameterSet<Crane> {
    ParameterSet::new(Crane::default(), PROBATION).expect("the defaults are valid")
}

fn at(millis: u64) -> Instant {
    Instant::from_millis(millis)
}

fn request(action: ParameterAction, index: u32, value: f32) -> ParameterRequest {
    ParameterRequest { action, index, value }
}

#[test]
fn the_table_has_every_parameter() {
    let names: Vec<_> =
        Crane::TABLE.iter().map(|row| (row.info.name, row.info.min, row.info.max, row.info.unit)).collect();
    assert_eq!(
        names,
        [("hoist.slow", 0.0, 1.0, "m/s"), ("hoist.fast", 0.0, 2.0, "m/s"), ("slew.rate", 0.0, 1.0, "rad/s")]
    );
    assert_eq!(Crane::find("slew.rate").map(|row| row.get(&Crane::default())), Ok(0.2));
    assert_eq!(Crane::find("slew").err(), Some(ParameterError::Unknown));
    assert_ne!(key("hoist.slow"), key("hoist.fast"));
}

#[test]
fn the_set_is_a_message() {
    let crane = Crane { slew: Slew { rate: 0.7 }, ..Crane::default() };
    assert_eq!(crane.to_words().map(f32::from_bits), [0.1, 0.5, 0.7]);
    assert_eq!(Crane::from_words(&crane.to_words()), Some(crane));
    assert_eq!(
        Crane::FIELDS.iter().map(|field| (field.name, field.count)).collect::<Vec<_>>(),
        [("hoist", 2), ("slew", 1)]
    );
}

#[test]
fn a_change_is_used_as_a_whole_from_the_next_period_on() {
    let mut set = set();
    set.set(0, 0.6).expect("in range");
    set.set(1, 0.9).expect("in range");
    assert_eq!(set.step(at(0), true), Crane::default(), "not applied");
    set.apply().expect("consistent");
    assert_eq!(set.step(at(10), true).hoist, Hoist { slow: 0.6, fast: 0.9 });
    assert_eq!((set.status().version, set.status().applied_at), (1, at(10)));
}

#[test]
fn what_is_not_valid_changes_nothing() {
    let mut set = set();
    assert_eq!(set.set(3, 0.0), Err(ParameterError::Unknown));
    assert_eq!(set.set(0, 1.1), Err(ParameterError::OutOfRange { min: 0.0, max: 1.0 }));
    assert_eq!(set.set(0, f32::NAN), Err(ParameterError::OutOfRange { min: 0.0, max: 1.0 }));
    set.set(0, 0.9).expect("in range");
    let refused = set.apply().expect_err("slow is faster than fast");
    assert_eq!(refused.to_string(), "hoist.slow with hoist.fast: slow would be faster than fast");
    set.set(1, 0.4).expect("in range");
    set.apply().expect("the candidate started again, without the 0.9");
    assert_eq!(set.step(at(0), true).hoist, Hoist { slow: 0.1, fast: 0.4 });
    let broken = Crane { slew: Slew { rate: -1.0 }, ..Crane::default() };
    assert_eq!(ParameterSet::new(broken, PROBATION), Err(ParameterError::OutOfRange { min: 0.0, max: 1.0 }));
}

#[test]
fn requests_do_the_same_and_refusals_are_counted() {
    let mut set = set();
    assert_eq!(set.request(&request(ParameterAction::Set, 2, 0.9)), Ok(()));
    assert_eq!(
        set.request(&request(ParameterAction::Set, 2, 9.0)),
        Err(ParameterError::OutOfRange { min: 0.0, max: 1.0 })
    );
    assert_eq!(set.request(&request(ParameterAction::Set, u32::MAX, 0.0)), Err(ParameterError::Unknown));
    assert_eq!(set.request(&request(ParameterAction::Apply, 0, 0.0)), Ok(()));
    assert_eq!(set.step(at(0), true).slew.rate, 0.9);
    assert_eq!(set.request(&request(ParameterAction::RollBack, 0, 0.0)), Ok(()));
    assert_eq!(set.step(at(10), true).slew.rate, 0.2);
    assert_eq!((set.status().version, set.status().refused), (2, 2));
}

#[test]
fn a_fault_within_the_probation_rolls_back_and_only_then() {
    for (fault_after, rolled_back) in [(10, true), (1_000, true), (1_010, false)] {
        let mut set = set();
        set.set(2, 0.9).expect("in range");
        set.apply().expect("valid");
        set.step(at(0), true);
        for period in 1..fault_after / 10 {
            assert_eq!(set.step(at(10 * period), true).slew.rate, 0.9);
        }
        let expected = if rolled_back { 0.2 } else { 0.9 };
        assert_eq!(set.step(at(fault_after), false).slew.rate, expected, "after {fault_after} ms");
        assert_eq!(set.step(at(fault_after + 10), false).slew.rate, expected, "once, not to and fro");
    }
}

#[test]
fn a_fault_without_a_change_rolls_nothing_back() {
    let mut set = set();
    assert_eq!(set.step(at(0), false), Crane::default());
    assert_eq!(set.status().version, 0);
}

proptest! {
    #[test]
    fn the_set_in_use_is_always_valid(requests in proptest::collection::vec((0u32..3, 0u32..4, -0.5f32..2.5, any::<bool>()), 0..60)) {
        let mut set = set();
        for (period, (action, index, value, healthy)) in requests.into_iter().enumerate() {
            let action = ParameterAction::from_number(action).expect("three actions");
            let _ = set.request(&request(action, index, value));
            let now = at(10 * period as u64);
            prop_assert_eq!(parameters::validate(&set.step(now, healthy)), Ok(()));
        }
    }
}
