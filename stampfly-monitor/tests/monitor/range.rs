//! Range finder faults, and doors.

use crate::body::{Flight, Readings, VEHICLES};
use stampfly_types::messages::Finding;

/// Findings when a fault begins after six seconds of flight.
fn found(fault: impl Fn(&mut Readings) + Copy) -> Vec<Option<(Finding, f32)>> {
    let flights = (1..4).map(|seed| {
        let mut flight = Flight::new(VEHICLES[0], seed);
        assert_eq!(flight.until_found(6.0, |_| ()), None);
        flight.until_found(6.0, fault).map(|(findings, after)| (findings.range.finding, after))
    });
    flights.collect()
}

#[test]
fn what_jumps_and_stays_there_is_a_jump() {
    for found in found(|readings| readings.range -= 0.4) {
        let (finding, after) = found.expect("found");
        assert_eq!(finding, Finding::Jumped);
        assert!(after < 0.25, "{after} s");
    }
}

#[test]
fn what_stays_at_a_value_is_stuck() {
    for found in found(|readings| readings.range = 0.6) {
        let (finding, after) = found.expect("found");
        assert_eq!(finding, Finding::Stuck);
        assert!(after < 2.0, "{after} s");
    }
}

#[test]
fn what_is_never_compared_is_stuck_if_it_stays_at_a_value_and_nothing_if_it_does_not() {
    for found in found(|readings| readings.range = 0.03) {
        let (finding, after) = found.expect("found");
        assert_eq!(finding, Finding::Stuck);
        assert!(after < 1.0, "{after} s");
    }
    // A smeared window, with noise. The height of this estimate is not held meanwhile.
    for found in found(|readings| readings.range = 0.03 + 1e-3 * (20.0 * readings.time).fract()) {
        assert!(found.is_none_or(|(range, _)| range == Finding::None), "{found:?}");
    }
}

#[test]
fn a_door_is_no_fault_of_the_range() {
    for rise in [1.5, -1.5] {
        for found in found(|readings| readings.altitude += rise * (readings.time / 0.8).min(1.0)) {
            assert_eq!(found, None, "{rise} m");
        }
    }
}

#[test]
fn a_barometer_that_falls_silent_is_no_fault_of_the_range() {
    for found in found(|readings| readings.altitude = f32::NAN) {
        assert_eq!(found, None);
    }
    // Nor is a climb that no other sensor measures.
    let (mut flight, climbs) = (Flight::new(VEHICLES[0], 1), 0.3);
    assert_eq!(flight.until_found(6.0, |_| ()), None);
    flight.truth.velocity.z -= climbs;
    flight.estimate.velocity.z -= climbs;
    assert_eq!(flight.until_found(6.0, |readings| readings.altitude = f32::NAN), None);
}
