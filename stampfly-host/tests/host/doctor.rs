//! The doctor names what is wrong with an emulated vehicle, and finds nothing on a sound one.

use crate::thorough::thorough;
use stampfly_board::simulation::bench::{Fault, fault, with_vehicle};
use stampfly_board::topics::Id;
use stampfly_host::doctor::{Chart, emulated};
use stampfly_types::{Duration, Instant};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

fn names(chart: &Chart) -> Vec<&str> {
    chart.findings().map(|row| row.name.as_str()).collect()
}

/// Does the work for each on all cores; the answers in order.
fn each<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some((place, item)) =
                    Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|place| Some((place, items.get(place)?)))
                {
                    let result = work(item);
                    done.lock().expect("no thread panics with it").push((place, result));
                }
            });
        }
    });
    let mut done = done.into_inner().expect("no thread panics with it");
    done.sort_by_key(|(place, _)| *place);
    done.into_iter().map(|(_, result)| result).collect()
}

#[test]
fn every_fault_is_named_and_nothing_else() {
    let faults = fault::all();
    assert!(faults.len() >= 25, "{}", faults.len());
    let charts = each(&faults, |Fault { defect, .. }| emulated::examine(Some(defect), 1));
    let wrong: Vec<String> = faults
        .iter()
        .zip(&charts)
        .filter(|(fault, chart)| names(chart) != [fault.name.as_str()])
        .map(|(fault, chart)| format!("{}: {:?}\n{chart}", fault.name, names(chart)))
        .collect();
    // The firmware sends an answer as one piece up to this length; a longer one is made twice, and counts go on in between.
    let longest = charts.iter().flat_map(|chart| chart.transcript.split("> doctor\n").skip(1));
    let longest = longest.map(|rest| rest.split("\n> ").next().unwrap_or(rest).len()).max();
    assert!(longest.is_some_and(|length| length < 2_048), "{longest:?}");
    assert!(wrong.is_empty(), "{} of {} faults:\n{}", wrong.len(), faults.len(), wrong.join("\n"));
}

#[test]
fn nothing_is_found_on_a_sound_vehicle() {
    let seeds: Vec<u64> = (1..=thorough(3, 6)).collect();
    let charts = each(&seeds, |seed| emulated::examine(None, *seed));
    for (seed, chart) in seeds.iter().zip(&charts) {
        assert_eq!(names(chart), [""; 0], "seed {seed}:\n{chart}");
        assert!(chart.rows.len() > 20, "it was examined:\n{chart}");
    }
}

#[test]
fn the_same_vehicle_gives_the_same_file() {
    let [one, other] = [1, 1].map(|seed| emulated::examine(None, seed).file());
    assert_eq!(one, other);
}

/// The silences that `docs/stampfly/first-flight.md` tells.
#[test]
fn every_sensor_measures_within_a_second_and_it_is_ready_within_four() {
    with_vehicle(None, 1, |bench| {
        bench.pass(Duration::from_secs(1));
        let sensors = Id::ALL.iter().filter(|topic| topic.info().name.starts_with("sensor_"));
        for topic in sensors {
            assert!(bench.published(*topic).is_some(), "{}", topic.info().name);
        }
        bench.pass(Duration::from_secs(3));
        let notes: Vec<_> = bench.heard().iter().filter(|(at, _)| *at > Instant::from_secs(1)).collect();
        assert!(notes.len() == 3 && notes.iter().all(|(_, hertz)| *hertz == notes[0].1), "{:?}", bench.heard());
    });
}
