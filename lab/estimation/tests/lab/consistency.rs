//! Is the estimator as good as it says, and is that measured rightly?

use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_lab::consistency::{Observation, Summary};
use stampfly_sim::vehicle::{Vehicle, Verdict};

fn campaign(flights: u64, change: impl Fn(&mut Setup)) -> Summary {
    let seen: Vec<_> = (1..=flights)
        .map(|seed| {
            let mut setup = Setup { mission: Mission::random(seed), ..Setup::reference(seed) };
            change(&mut setup);
            let mut observation = Observation::new(setup.vehicle.eskf, seed);
            let ended = StampFly::fly(&setup, &mut observation, &mut |_, _| {});
            assert!(ended.outcome.succeeded(), "seed {seed}");
            observation.finish()
        })
        .collect();
    Summary::of(&seen)
}

#[test]
fn an_executor_that_is_late_changes_nothing_about_the_repetition() {
    let summary = campaign(4, |setup| setup.jitter = Some(setup.simulation.seed));
    assert_eq!(summary.different, 0);
    assert_eq!(summary.unresolved, 0);
}

#[test]
fn overconfidence_is_seen() {
    // Readings that hold one picture or two, taken for good to a tenth.
    let summary = campaign(4, |setup| {
        setup.vehicle.eskf.flow_sigma = 0.07;
        setup.vehicle.eskf.flow_scale_sigma = 0.1;
    });
    assert_eq!(summary.different, 0, "the second estimator has the tuning of the first");
    let flow = &summary.innovations[1];
    assert!(!flow.is_good() && flow.mean > flow.band[1], "{flow:?}");
    assert!(!summary.is_good());
}
