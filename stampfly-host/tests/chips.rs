//! The reference mission through the real drivers and emulated chips: as good as over models of the sensors.

use stampfly_board::plan;
use stampfly_host::campaign;
use stampfly_host::metrics::FIGURES;
use stampfly_host::recorder::Recorder;
use stampfly_host::sensing::Sensing;
use stampfly_host::simulate::{FlightConfig, fly};

/// Mission, figure, statistic, bar.
const BARS: [(&str, &str, &str, f64); 7] = include!("../bars.rs");

fn config(seed: u64) -> FlightConfig {
    FlightConfig { sensing: Sensing::Chips, ..FlightConfig::reference(seed) }
}

#[test]
fn the_reference_mission_keeps_its_bars() {
    let flights = campaign::run(&[2, 28, 49, 81].map(config), &|_| {});
    for flight in &flights {
        let metrics = &flight.outcome.metrics;
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
    let mut recorder = Recorder::hash_only().with_timing();
    fly(&config(81), &mut recorder, &mut |_, _| {});
    let count = |id: plan::Id| recorder.timing()[id as usize].count;
    let (estimation, failsafe) = (count(plan::Id::estimation), count(plan::Id::failsafe));
    assert!(estimation > 9_000, "400 a second: {estimation}");
    // Until the inertial sensor runs, some 200 ms, the deadline of 5 ms is what activates it.
    assert!(failsafe >= estimation && failsafe - estimation < 60, "{failsafe} for {estimation}");
}
