//! Shifts and jumps of the gyro's zero.

use crate::body::{Flight, VEHICLES};
use stampfly_types::messages::Finding;

#[test]
fn a_jump_is_found_before_the_vehicle_has_turned_far() {
    for vehicle in VEHICLES {
        for jump in [0.7, -1.0, 2.0] {
            for seed in 1..5 {
                let mut flight = Flight::new(vehicle, seed);
                assert_eq!(flight.until_found(3.3, |_| ()), None);
                let found = flight.until_found(1.0, |readings| readings.imu.gyro.x += jump);
                let case = format!("{jump} rad/s, seed {seed}, {vehicle:?}: {found:?}");
                let (findings, after) = found.expect(&case);
                assert_eq!((findings.gyro.finding, findings.flow.finding), (Finding::Shifted, Finding::None), "{case}");
                assert!(after < 0.2, "{case}");
                let off = flight.correction.gyro_bias.x - jump;
                assert!(off.abs() < 0.25 * jump.abs(), "{case}, {off}");
            }
        }
    }
}

#[test]
fn a_shift_that_ramps_up_is_not_taken_for_the_camera() {
    for vehicle in VEHICLES {
        for shift in [0.15, -0.3] {
            for seed in 1..5 {
                let mut flight = Flight::new(vehicle, seed);
                assert_eq!(flight.until_found(3.3, |_| ()), None);
                let ramp = |time: f32| shift * (time / 0.1).min(1.0);
                let found = flight.until_found(6.0, |readings| readings.imu.gyro.x += ramp(readings.time));
                let Some((findings, after)) = found else { continue };
                assert_eq!(findings.flow.finding, Finding::None, "{shift} rad/s, seed {seed}: {findings:?}, {after} s");
            }
        }
    }
}

#[test]
fn a_shift_during_the_take_off_is_not_taken_for_the_camera() {
    for shift in [0.2, -0.4] {
        for since in [0.3, 0.9] {
            for seed in 1..5 {
                let mut flight = Flight::new(VEHICLES[0], seed);
                let ramp = |time: f32| shift * ((time - since) / 0.1).clamp(0.0, 1.0);
                let found = flight.until_found(4.0, |readings| readings.imu.gyro.x += ramp(readings.time));
                let Some((findings, after)) = found else { continue };
                let case = format!("{shift} rad/s since {since} s, seed {seed}: {findings:?}, {after} s");
                assert_eq!(findings.flow.finding, Finding::None, "{case}");
            }
        }
    }
}
