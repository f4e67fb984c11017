//! Faults of the camera, and none.

use crate::body::{Flight, Readings, VEHICLES};
use stampfly_types::messages::{Finding, SensorFindings};

/// What each vehicle finds when a fault begins after it has flown for so long, s.
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
