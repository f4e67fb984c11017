//! The reference mission through the real drivers and emulated chips: as good as over models of the sensors.

use stampfly_board::schedule;
use stampfly_board::simulation::metrics::FIGURES;
use stampfly_board::simulation::sensing::Sensing;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_host::campaign;
use stampfly_host::flown::fly;
use stampfly_host::recorder::Recorder;

/// Mission, figure, statistic, bar.
const BARS: [(&str, &str, &str, f64); 7] = include!("../../bars.rs");

fn setup(seed: u64) -> Setup {
    Setup { sensing: Sensing::Chips, ..Setup::reference(seed) }
}

#[test]
fn the_reference_mission_keeps_its_bars() {
    let flights = campaign::run::<StampFly, ()>(&[2, 28, 49, 81].map(|seed| (seed, setup(seed))), &|_, _| (), &|_| {});
    for flight in &flights {
        let metrics = &flight.flown.outcome.metrics;
        assert!(flight.succeeded(), "seed {}: {metrics:?}", flight.seed);
        for (_, name, _, bar) in BARS.iter().filter(|(mission, ..)| *mission == "square") {
            let (.., figure) = FIGURES.iter().find(|(figure, ..)| figure == name).expect("a figure of that name");
            let value = figure(metrics);
            assert!(value.is_some_and(|value| value <= *bar), "seed {}: {name} is {value:?}: {metrics:?}", flight.seed);
        }
    }
}

#[test]
fn every_sample_is_estimated_and_no_deadline_passes() {
    let mut recorder = Recorder::<StampFly>::hash_only().with_timing();
    fly::<StampFly>(&setup(81), &mut recorder, &mut |_, _| {});
    let count = |id: schedule::Id| recorder.timing()[id as usize].count;
    let (estimation, failsafe) = (count(schedule::Id::estimation), count(schedule::Id::failsafe));
    assert!(estimation > 9_000, "400 a second: {estimation}");
    // Until the inertial sensor runs, some 200 ms, the deadline of 5 ms is what activates it.
    assert!(failsafe >= estimation && failsafe - estimation < 60, "{failsafe} for {estimation}");
}
