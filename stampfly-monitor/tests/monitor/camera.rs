//! Camera faults, and flights without a fault.

use crate::body::{Flight, Readings, VEHICLES};
use stampfly_types::math;
use stampfly_types::messages::{Finding, SensorFindings};

/// Findings for each vehicle when a fault begins after `delay` seconds of flight.
fn found(delay: f32, fault: fn(&mut Readings)) -> Vec<Option<(SensorFindings, f32)>> {
    let flights = VEHICLES.iter().flat_map(|vehicle| (1..4).map(move |seed| (*vehicle, seed)));
    let flights = flights.map(|(vehicle, seed)| {
        let mut flight = Flight::new(vehicle, seed);
        assert_eq!(flight.until_found(delay, |_| ()), None, "{vehicle:?}, seed {seed}");
        flight.until_found(4.0, fault)
    });
    flights.collect()
}

#[test]
fn a_sound_vehicle_has_no_findings() {
    for vehicle in VEHICLES {
        for seed in 1..9 {
            let found = Flight::new(vehicle, seed).until_found(30.0, |_| ());
            assert_eq!(found, None, "{vehicle:?}, seed {seed}");
        }
    }
}

#[test]
fn axes_that_are_reversed_swapped_or_dead_are_found() {
    let faults: [(&str, fn(&mut Readings)); 3] = [
        ("reversed", |readings| readings.picture = readings.picture.map(|rate| -rate)),
        ("swapped", |readings| readings.picture.reverse()),
        ("dead", |readings| readings.picture = [0.0; 2]),
    ];
    for (name, fault) in faults {
        for delay in [0.3, 2.2, 7.7] {
            for found in found(delay, fault) {
                let Some((findings, after)) = found else { panic!("{name} after {delay} s: not found") };
                assert_ne!(findings.flow.finding, Finding::None, "{name} after {delay} s: {findings:?}");
                assert!(after < 3.0, "{name} after {delay} s: {after} s");
            }
        }
    }
}

#[test]
fn an_offset_that_begins_is_a_jump() {
    for found in found(5.0, |readings| readings.picture[0] += 1.5) {
        let (findings, after) = found.expect("found");
        assert_eq!(findings.flow.finding, Finding::Jumped, "{findings:?}");
        assert!(after < 0.4, "{after} s");
    }
}

#[test]
fn an_offset_from_the_ground_on_is_found_as_the_vehicle_climbs() {
    for offset in [2.5, -3.0] {
        for seed in 1..5 {
            let mut flight = Flight::new(VEHICLES[0], seed);
            let found = flight.until_found(4.0, |readings| readings.picture[0] += offset);
            let (findings, after) = found.expect("found");
            assert_ne!(findings.flow.finding, Finding::None, "{offset} rad/s, seed {seed}: {findings:?}");
            assert!(after < 2.5, "{offset} rad/s, seed {seed}: {after} s");
        }
    }
}

/// Water below, or a field in the wind.
#[test]
fn of_a_floor_that_moves_to_and_fro_no_second_shift_of_the_gyro_is_made() {
    for (speed, period) in [(0.8, 3.0), (1.2, 4.0), (1.5, 6.0)] {
        for seed in 1..4 {
            let mut flight = Flight::new(VEHICLES[0], seed);
            assert_eq!(flight.until_found(3.0, |_| ()), None);
            let began = flight.corrections;
            flight.fly_on(6.0, |readings| {
                readings.picture[0] += speed / 0.6 * math::sin(readings.time * core::f32::consts::TAU / period);
            });
            let corrections = flight.corrections - began;
            assert!(corrections <= 2, "{speed} m/s in {period} s, seed {seed}: {corrections} corrections");
        }
    }
}

#[test]
fn an_estimate_that_is_no_number_is_not_remembered() {
    let mut flight = Flight::new(VEHICLES[0], 1);
    assert_eq!(flight.until_found(3.0, |_| ()), None);
    let estimate = flight.estimate;
    flight.estimate.velocity.x = f32::NAN;
    assert_eq!(flight.until_found(0.1, |_| ()), None);
    flight.estimate = estimate;
    flight.truth.velocity = estimate.velocity;
    assert_eq!(flight.until_found(3.0, |_| ()), None);
}
