//! Late receivers: 50 to 300 ms, with correct stamps.

use super::run::{Plan, check, run};
use super::world::Setting;
use stampfly_eskf::EskfConfig;

#[test]
fn fixes_on_time_are_as_good_as_the_receiver_allows() {
    let setting = Setting::default();
    let outcome = run(setting, Plan::default(), EskfConfig::outdoors());
    check("on time", &setting, &outcome);
    assert_eq!(outcome.refused, 0);
}

#[test]
fn late_fixes_are_compared_with_the_state_of_their_time() {
    for millis in [50.0, 150.0, 300.0, 480.0] {
        let setting = Setting { fix_delay: millis * 1e-3, ..Setting::default() };
        let outcome = run(setting, Plan::default(), EskfConfig::outdoors());
        check(&format!("{millis} ms late"), &setting, &outcome);
        assert_eq!(outcome.refused, 0, "{millis} ms");
    }
}

#[test]
fn a_horizon_holds_at_any_inertial_rate() {
    for rate in [50.0, 100.0, 385.0, 1000.0, 8000.0] {
        let setting = Setting { rate, fix_delay: 0.3, ..Setting::default() };
        let outcome = run(setting, Plan::default(), EskfConfig::outdoors());
        check(&format!("{rate} Hz, 300 ms late"), &setting, &outcome);
        assert_eq!(outcome.refused, 0, "{rate} Hz");
    }
}
