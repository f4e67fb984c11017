//! A room with cameras: late poses, some lost, make the position a matter of millimetres.

use crate::flown::reference;
use crate::thorough::thorough;
use stampfly_board::simulation::{Outcome, Setup, StampFly};
use stampfly_host::campaign::run;
use stampfly_sim::vehicle::Verdict;

/// Position error of the estimate, m.
fn error(outcome: &Outcome) -> f64 {
    assert!(outcome.succeeded());
    outcome.metrics.est_pos_rms_m.expect("it flew")
}

#[test]
fn late_poses_are_worth_millimetres() {
    let without = reference(thorough(3, 10));
    let setups: Vec<_> =
        without.iter().map(|flight| (flight.seed, Setup { cameras: true, ..Setup::reference(flight.seed) })).collect();
    for (with, without) in run::<StampFly, ()>(&setups, &|_, _| (), &|_| {}).iter().zip(without) {
        let (seen, alone) = (error(&with.flown.outcome), error(&without.flown.outcome));
        assert!(seen < 0.01 && seen < 0.5 * alone, "seed {}: {seen} m with cameras, {alone} m without", with.seed);
    }
}
