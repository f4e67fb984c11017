//! Receivers with a slowly varying error, and silent receivers: the stated standard deviation is
//! right.

use super::run::{Plan, run};
use super::world::Setting;
use stampfly_eskf::{EskfConfig, StartHeading, aid};

/// With or without a magnetometer.
fn config(mag: bool) -> EskfConfig {
    let outdoors = EskfConfig::outdoors();
    let with = EskfConfig {
        mag_enable: true,
        start_heading: StartHeading::Magnetic,
        earth_field: Some(aid::field::earth(0.0, 1.107)),
        ..outdoors
    };
    if mag { with } else { outdoors }
}

#[test]
fn a_position_whose_error_wanders_is_no_better_than_it_says() {
    for (seed, mag) in (1..6).flat_map(|seed| [(seed, false), (seed, true)]) {
        for (wander_sigma, wander_time) in [(1.5, 60.0), (3.0, 120.0), (0.8, 20.0)] {
            let setting =
                Setting { wander_sigma, wander_time, fix_delay: 0.15, seed, stands: 5.0, ..Setting::default() };
            let outcome = run(setting, Plan { mag, seconds: 300.0, ..Plan::default() }, config(mag));
            let name = format!("{wander_sigma} m in {wander_time} s, seed {seed}, magnetometer {mag}");
            println!("{name}: {:.2} m, heading {:.2}, {:?}", outcome.horizontal, outcome.heading, outcome.sigmas);
            // No sensor removes such an error: the limit is that of the receiver.
            assert!(outcome.horizontal < 1.5 * wander_sigma.hypot(0.5), "{name}: {} m", outcome.horizontal);
            assert!(outcome.heading < 3.0 && outcome.sigmas.iter().all(|off| *off < 5.0), "{name}: {outcome:?}");
            assert_eq!((outcome.resets, outcome.refused), (0, 0), "{name}");
        }
    }
}

#[test]
fn half_a_minute_without_fixes_is_no_more_wrong_than_it_says() {
    for gap in [[30.0, 60.0], [60.0, 90.0], [60.0, 65.0]] {
        for (seed, mag) in (1..4).flat_map(|seed| [(seed, false), (seed, true)]) {
            for heading in [0.0, 2.0] {
                let setting = Setting { heading, fix_delay: 0.1, seed, stands: 5.0, ..Setting::default() };
                let plan = Plan { mag, gap, from: 20.0, seconds: 160.0, ..Plan::default() };
                let outcome = run(setting, plan, config(mag));
                let name = format!("gap {gap:?}, seed {seed}, heading {heading}, magnetometer {mag}");
                println!("{name}: worst {:.1} m, heading {:.2}, {:?}", outcome.worst, outcome.heading, outcome.sigmas);
                // An accelerometer error of 0.01 m/s² and a tilt error of one milliradian are ten
                // metres after 30 s.
                assert!(outcome.worst < 30.0, "{name}: {} m", outcome.worst);
                assert!(outcome.heading < 3.0 && outcome.sigmas.iter().all(|off| *off < 5.0), "{name}: {outcome:?}");
                assert_eq!((outcome.resets, outcome.refused, outcome.gated), (0, 0, 0), "{name}");
            }
        }
    }
}
