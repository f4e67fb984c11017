//! Large distances, heights and speeds: limits are configurable, and the default is not a room.

use super::run::{Plan, check, run};
use super::world::Setting;
use stampfly_eskf::{Eskf, EskfConfig, Estimator};
use stampfly_types::messages::{CalibrationResult, ImuData};
use stampfly_types::{Instant, Vec3};

#[test]
fn a_wide_circle_a_climb_and_a_fast_line_are_no_divergence() {
    let slow = Setting::default();
    let cases = [
        ("a circle of 160 m", Setting { radius: 160.0, speed: 12.0, ..slow }),
        ("a climb to 170 m", Setting { climb: 1.5, ..slow }),
        ("60 m/s", Setting { radius: 800.0, speed: 60.0, stands: 10.0, ..slow }),
        ("3 km from the origin", Setting { origin: [2_000.0, -2_300.0, -40.0], ..slow }),
    ];
    for (name, setting) in cases {
        let outcome = run(setting, Plan { from: 40.0, ..Plan::default() }, EskfConfig::outdoors());
        check(name, &setting, &outcome);
        assert_eq!((outcome.gated, outcome.refused, outcome.resets), (0, 0, 0), "{name}");
        assert!(!outcome.eskf.expect("flown").status().diverged, "{name}");
    }
}

#[test]
fn beyond_its_limits_a_filter_says_that_it_has_diverged() {
    let diverged = |config: EskfConfig, position: f32| {
        let mut eskf = Eskf::new(EskfConfig { external_lockout: 0.2, ..config });
        let force = Vec3::new(0.0, 0.0, -9.80665);
        eskf.initialize(Instant::ZERO, &CalibrationResult { specific_force: force, ..CalibrationResult::default() });
        for step in 1..200u64 {
            let at = Instant::from_micros(step * 10_000);
            eskf.predict(at, &ImuData { accel: force, ..ImuData::default() });
            let from_there = Vec3::new(position, 0.0, 0.0);
            _ = eskf.fuse_position(at, &from_there, &Vec3::new(0.1, 0.1, 0.1));
        }
        eskf.status().diverged
    };
    let room = EskfConfig { max_position: 100.0, ..EskfConfig::default() };
    assert!(diverged(room, 130.0) && !diverged(room, 90.0));
    assert!(!diverged(EskfConfig::default(), 130.0), "the default is no room");
}
