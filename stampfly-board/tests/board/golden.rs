//! The golden flight: this machine computes what the committed record says, and a changed record is not taken for it.

use stampfly_board::golden::{FLIGHT, Outcome, TOLERANCE, self_test};
use stampfly_board::{VehicleConfig, schedule::Runnables, topics::Bus};
use stampfly_flight::golden::{GoldenError, Report, Verdict, play};
use stampfly_types::messages::SelfTestVerdict;
use std::mem::MaybeUninit;

#[test]
fn this_machine_publishes_the_recorded_bits() {
    let outcome = self_test(&mut MaybeUninit::uninit(), &mut Bus::new());
    let report = match outcome.0 {
        Ok(report) => report,
        Err(error) => panic!("{error}: `cargo xtask golden --fix` records the flight again, if flights were to change"),
    };
    // The record has the hash of all that was published when it was recorded.
    assert_eq!(report.verdict, Verdict::Identical);
    assert!(outcome.may_fly());
    assert_eq!(outcome.message().verdict, SelfTestVerdict::Identical);
}

#[test]
fn other_gains_are_beyond_and_do_not_fly() {
    let mut config = VehicleConfig::default();
    config.cascade.rate.roll.kp *= 2.0;
    let report = play::<Runnables>(&mut Bus::new(), FLIGHT, &config, TOLERANCE, &mut ()).expect("plays");
    assert!(matches!(report.verdict, Verdict::Beyond { worst, .. } if worst > TOLERANCE), "{report:?}");
    for failed in [Outcome(Ok(report)), Outcome(Err(GoldenError::Damaged))] {
        assert!(!failed.may_fly() && failed.to_string().contains("FAILED"), "{failed}");
        assert_eq!(failed.message().verdict, SelfTestVerdict::Failed);
    }
    let rounding = Outcome(Ok(Report { verdict: Verdict::WithinTolerance { worst: 0.001 }, ..report }));
    assert!(rounding.may_fly());
    assert_eq!(rounding.message().verdict, SelfTestVerdict::WithinTolerance);
}
