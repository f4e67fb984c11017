//! Is the estimator as good as it says, and is that measured rightly?

use stampfly_host::campaign::run_recorded;
use stampfly_host::mission::Mission;
use stampfly_host::recorder::Recorder;
use stampfly_host::simulate::FlightConfig;
use stampfly_lab::consistency::Summary;

fn campaign(flights: u64, change: impl Fn(&mut FlightConfig)) -> Summary {
    let configs: Vec<FlightConfig> = (1..=flights)
        .map(|seed| {
            let mut config = FlightConfig::reference(seed);
            config.mission = Mission::random(seed);
            change(&mut config);
            config
        })
        .collect();
    let recorder = |config: &FlightConfig| Recorder::hash_only().with_consistency(config.simulation.seed);
    let flights = run_recorded(&configs, &recorder, &|_| {});
    assert!(flights.iter().all(|flight| flight.succeeded()));
    let seen: Vec<_> = flights.into_iter().filter_map(|flight| flight.consistency).collect();
    assert_eq!(seen.len(), configs.len());
    Summary::of(&seen)
}

#[test]
fn an_executor_that_is_late_changes_nothing_about_the_repetition() {
    let summary = campaign(4, |config| config.jitter = Some(config.simulation.seed));
    assert_eq!(summary.different, 0);
    assert_eq!(summary.unresolved, 0);
}

#[test]
fn overconfidence_is_seen() {
    // Readings that hold one picture or two, taken for good to a tenth.
    let summary = campaign(4, |config| {
        config.vehicle.eskf.flow_sigma = 0.07;
        config.vehicle.eskf.flow_scale_sigma = 0.1;
    });
    assert_eq!(summary.different, 0, "the second estimator has the tuning of the first");
    let flow = &summary.innovations[1];
    assert!(!flow.is_good() && flow.mean > flow.band[1], "{flow:?}");
    assert!(!summary.is_good());
}
