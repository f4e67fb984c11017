//! Wrong fixes and missing fixes.

use super::run::{Plan, check, run};
use super::world::Setting;
use stampfly_eskf::{Aiding, EskfConfig};

#[test]
fn reflected_signals_do_not_move_the_state() {
    for (metres, seconds) in [(35.0, 0.4), (35.0, 1.2), (20.0, 3.0), (150.0, 2.0)] {
        let setting = Setting { fix_delay: 0.15, ..Setting::default() };
        let plan = Plan { multipath: [60.0, 60.0 + seconds, metres], ..Plan::default() };
        let outcome = run(setting, plan, EskfConfig::outdoors());
        check(&format!("{metres} m off for {seconds} s"), &setting, &outcome);
        assert!(outcome.worst < 1.0, "{metres} m for {seconds} s: worst {} m", outcome.worst);
        assert_eq!(outcome.resets, 0);
        let gated = outcome.eskf.expect("flown").tally(Aiding::Position).gated;
        assert_eq!(gated, outcome.gated, "counted");
        assert!(f64::from(gated) >= (seconds / setting.fix_period).floor() - 1.0, "{gated} of {seconds} s");
    }
}

#[test]
fn two_bad_fixes_move_nobody_with_the_default_either() {
    let setting = Setting::default();
    let plan = Plan { multipath: [60.0, 60.4, 35.0], ..Plan::default() };
    let config = EskfConfig { horizon: 0.3, ..EskfConfig::default() };
    let outcome = run(setting, plan, config);
    assert!(outcome.worst < 1.5 && outcome.resets == 0 && outcome.gated > 0, "{} m", outcome.worst);
}

#[test]
fn a_slow_receiver_is_enough() {
    let setting = Setting { fix_period: 1.1, ..Setting::default() };
    let outcome = run(setting, Plan::default(), EskfConfig::outdoors());
    check("a fix every 1.1 s", &setting, &outcome);
}

#[test]
fn after_half_a_minute_without_fixes_it_is_where_the_receiver_says() {
    let setting = Setting { fix_delay: 0.1, ..Setting::default() };
    let plan = Plan { gap: [60.0, 90.0], from: 100.0, seconds: 160.0, ..Plan::default() };
    let outcome = run(setting, plan, EskfConfig::outdoors());
    check("30 s without", &setting, &outcome);
}

#[test]
fn errors_that_wander_are_not_taken_for_motion() {
    let setting = Setting { wander_sigma: 1.5, fix_delay: 0.15, seed: 3, ..Setting::default() };
    let outcome = run(setting, Plan::default(), EskfConfig::outdoors());
    // No sensor removes such an error: the limit is that of the receiver.
    assert!(
        outcome.horizontal < 1.5 * 1.5 && outcome.heading < 3.0,
        "{} m, {} degrees",
        outcome.horizontal,
        outcome.heading
    );
    assert!(outcome.sigmas[1] < 5.0 && outcome.resets == 0, "{:?}", outcome.sigmas);
}
