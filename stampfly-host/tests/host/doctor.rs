//! The doctor names what is wrong with an emulated vehicle, and finds nothing on a sound one.

use stampfly_board::simulation::bench::{Fault, fault};
use stampfly_host::doctor::{Chart, emulated};
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
    assert!(wrong.is_empty(), "{} of {} faults:\n{}", wrong.len(), faults.len(), wrong.join("\n"));
}

#[test]
fn nothing_is_found_on_a_sound_vehicle() {
    let seeds: Vec<u64> = (1..=6).collect();
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
