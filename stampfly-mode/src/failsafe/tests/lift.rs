//! A vehicle that cannot lift itself, and those that look like it.

use super::*;

/// Thrust that carries the weight, N.
const WEIGHT: f32 = 0.4;

/// After how many of 2,000 steps of a take-off does it count as one that cannot lift? Thrust and specific force in shares of the
/// weight and of gravity.
fn found(phase: FlightPhase, height: f32, thrust: f32, force: f32) -> Option<u32> {
    let config = FailsafeConfig { hover_thrust: WEIGHT, ..FailsafeConfig::default() };
    let mut rig = Rig { failsafe: Failsafe::new(config), ..Rig::flying() };
    rig.mode.phase = FlightPhase::Armed;
    rig.estimate.height = 0.03;
    rig.estimate.specific_force = Vec3::new(0.0, 0.0, -GRAVITY);
    assert!((0..400).all(|_| !rig.sample(REST, Vec3::zeros()).contains(Alerts::NO_LIFT)), "it stands");
    (rig.mode.phase, rig.estimate.height, rig.output.thrust) = (phase, height, thrust * WEIGHT);
    rig.estimate.specific_force.z *= force;
    (1..=2_000).find(|_| rig.sample(force * REST, Vec3::zeros()).contains(Alerts::NO_LIFT))
}

#[test]
fn thrust_that_lifts_nothing_is_given_up_after_two_seconds() {
    for (thrust, force) in [(1.2, 1.0), (1.6, 1.0), (1.6, 1.3), (1.2, 0.95)] {
        assert_eq!(found(FlightPhase::TakeOff, 0.03, thrust, force), Some(801), "{thrust}, {force}");
    }
}

#[test]
fn what_lifts_flies_or_is_not_sent_off_is_never_given_up() {
    for (phase, height, thrust, force, why) in [
        (FlightPhase::TakeOff, 0.09, 1.6, 1.0, "it has left the ground"),
        (FlightPhase::TakeOff, 0.03, 1.05, 1.0, "less is asked for than lifts for certain"),
        (FlightPhase::TakeOff, 0.03, 1.3, 1.3, "it climbs, and its range hangs"),
        (FlightPhase::Flying, 0.03, 1.6, 1.0, "a low flight"),
        (FlightPhase::Landing, 0.03, 1.6, 1.0, "a landing"),
        (FlightPhase::Armed, 0.03, 1.6, 1.0, "it stands"),
    ] {
        assert_eq!(found(phase, height, thrust, force), None, "{why}");
    }
}

#[test]
fn a_vehicle_of_an_unknown_weight_is_never_given_up() {
    let mut rig = Rig::flying();
    (rig.mode.phase, rig.estimate.height, rig.output.thrust) = (FlightPhase::TakeOff, 0.03, 9.0);
    rig.estimate.specific_force = Vec3::new(0.0, 0.0, -GRAVITY);
    assert!((0..2_000).all(|_| !rig.sample(REST, Vec3::zeros()).contains(Alerts::NO_LIFT)));
}

/// After how many samples is a vehicle in flight found, whose motors make this share of the weight and
/// cannot make the rest of what is asked for, while it climbs so fast, m/s?
fn spent(makes: f32, unmet: f32, climb: f32) -> Option<u32> {
    let mut rig = Rig::flying();
    rig.failsafe.config.hover_thrust = 0.36;
    rig.output.thrust = 0.57;
    rig.thrust = Some(makes * 0.36);
    rig.unmet = [0.0, 0.0, 0.0, unmet];
    rig.estimate.velocity.z = -climb;
    (1..=2_000).find(|_| rig.sample(REST, Vec3::zeros()).contains(Alerts::NO_LIFT))
}

#[test]
fn motors_with_all_there_is_that_do_not_lift_it_are_found_in_flight() {
    assert_eq!(spent(1.0, 0.3, 0.0), Some(1_201), "3 s");
    assert_eq!(spent(0.9, 0.3, -0.5), Some(1_201), "it sinks");
    assert_eq!(spent(1.1, 0.3, 0.2), None, "it climbs, slower than it should");
    assert_eq!(spent(1.5, 0.1, 0.0), None, "something holds it, a ceiling maybe");
    assert_eq!(spent(1.0, 0.0, 0.0), None, "there is more");
}
