//! The smallest flight in which the same goes wrong.
//!
//! One thing after the other is made smaller, and kept so when the flight still fails: fewer faults, an earlier end, calmer
//! surroundings, the usual value, a shorter fault, a rounder moment. When nothing can be made smaller any more, that is
//! the smallest form: not the smallest of all, but one in which every part is needed.

use super::case::Case;
use stampfly_sim::fault::{Fault, Moment, When};
use stampfly_sim::vehicle::{Vehicle, WorldKind};
use stampfly_types::Duration;

/// Most flights that are flown to make one smaller.
const MOST_FLIGHTS: usize = 60;

/// Durations to try, s: a fault that is over at once is easier to understand than one that stays.
const DURATIONS: [f64; 6] = [0.05, 0.1, 0.3, 1.0, 3.0, 10.0];

/// Makes a flight smaller as long as it `fails`. That function flies it, and says whether the same goes wrong.
pub fn shrink<V: Vehicle>(case: &Case, fails: &mut dyn FnMut(&Case) -> bool) -> Case {
    let mut smallest = case.clone();
    let mut flights = 0;
    loop {
        let mut found = None;
        for smaller in smaller::<V>(&smallest) {
            if flights == MOST_FLIGHTS {
                return smallest;
            }
            flights += 1;
            if fails(&smaller) {
                found = Some(smaller);
                break;
            }
        }
        match found {
            Some(smaller) => smallest = smaller,
            None => return smallest,
        }
    }
}

/// Every flight that is smaller by one thing; what makes it most easy to understand first.
fn smaller<V: Vehicle>(case: &Case) -> Vec<Case> {
    let mut all = Vec::new();
    let mut change = |change: &dyn Fn(&mut Case)| {
        let mut changed = case.clone();
        change(&mut changed);
        if changed.arguments() != case.arguments() {
            all.push(changed);
        }
    };
    let faults = &case.options.fault;
    if faults.len() > 1 {
        (0..faults.len()).for_each(|place| change(&|case| drop(case.options.fault.remove(place))));
    }
    change(&|case| case.options.jitter = None);
    change(&|case| case.options.chips = false);
    change(&|case| case.options.cameras = false);
    change(&|case| case.options.pilot = None);
    for mission in V::shorter_missions(&case.options, case.seed) {
        change(&|case| case.options.mission = Some(mission.clone()));
    }
    change(&|case| case.options.wind = None);
    change(&|case| case.options.gust = Some(0.0));
    change(&|case| case.options.vibration = Some(0.0));
    change(&|case| case.options.world = WorldKind::default());
    change(&|case| case.options.plant.clear());
    change(&|case| case.options.param.clear());
    for (place, text) in faults.iter().enumerate() {
        for simpler in Fault::parse(text, V::FAULTS).map(|fault| simpler(&fault)).unwrap_or_default() {
            change(&|case| {
                if let Some(fault) = case.options.fault.get_mut(place) {
                    simpler.clone_into(fault);
                }
            });
        }
    }
    // The first seed, which need not be written.
    change(&|case| case.seed = 1);
    all
}

/// Simpler forms of a fault, as texts.
fn simpler(fault: &Fault) -> Vec<String> {
    let Fault { kind, value, when, lasts } = *fault;
    let mut all = Vec::new();
    if value != kind.value.default() {
        all.push(Fault { value: kind.value.default(), ..*fault });
        let rounder = value.map(|value| format!("{value:.0e}").parse().unwrap_or(value));
        all.extend((rounder != value).then_some(Fault { value: rounder, ..*fault }));
    }
    let shorter = DURATIONS.map(|seconds| Duration::from_micros((1e6 * seconds) as u64));
    let shorter = shorter.into_iter().filter(|shorter| lasts.is_none_or(|lasts| *shorter < lasts));
    all.extend(shorter.map(|lasts| Fault { lasts: Some(lasts), ..*fault }));
    if let When::After(time) = when {
        all.extend(Moment::ALL.map(|moment| Fault { when: When::Moment(moment), ..*fault }));
        let whole = Duration::from_secs(time.as_micros() / 1_000_000);
        all.extend((whole != time).then_some(Fault { when: When::After(whole), ..*fault }));
    }
    all.iter().map(short).collect()
}

/// A fault's text without a value that is the usual one.
fn short(fault: &Fault) -> String {
    let value = fault.value.filter(|value| Some(*value) != fault.kind.value.default());
    Fault { value, ..*fault }.to_string()
}
