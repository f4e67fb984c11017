//! A specific force that fits neither gravity nor thrust.

use super::*;

/// After how many of 400 samples is a vehicle stopped that asks for this thrust and feels this force, both of gravity?
fn found(phase: FlightPhase, thrust: f32, force: f32) -> Option<u32> {
    let config = FailsafeConfig { hover_thrust: 0.36, ..FailsafeConfig::default() };
    let mut rig = Rig { failsafe: Failsafe::new(config), ..Rig::flying() };
    (rig.mode.phase, rig.mode.mode) = (phase, FlightMode::Acro);
    rig.output.thrust = 0.36;
    let mut rig = rig.settled();
    rig.output.thrust = thrust * 0.36;
    (0..400).find(|_| rig.sample(REST * force, Vec3::zeros()).contains(Alerts::IMU_FAULTY))
}

#[test]
fn d7_a_force_of_half_the_thrust_stops_the_motors_within_300_ms() {
    for (thrust, force) in [(1.0, 0.5), (1.4, 0.7), (1.0, 0.0), (1.0, 2.0), (1.5, 2.8)] {
        let samples = found(FlightPhase::Flying, thrust, force);
        assert!(samples.is_some_and(|samples| samples < 120), "{force} g at {thrust}: {samples:?}");
    }
}

#[test]
fn a_weak_motor_makes_less_thrust_than_is_asked_for_and_that_is_no_fault_of_the_sensor() {
    let faulty = |weak: bool| {
        let config =
            FailsafeConfig { hover_thrust: 0.36, weak_roll: 1.0, weak_pitch: 1.0, ..FailsafeConfig::default() };
        let mut rig = Rig { failsafe: Failsafe::new(config), ..Rig::flying() };
        rig.output.thrust = 0.36;
        rig.output.torque = if weak { Vec3::new(2.0, 2.0, 0.0) } else { Vec3::zeros() };
        for _ in 0..400 {
            rig.sample(REST, Vec3::zeros());
        }
        (0..400).any(|_| rig.sample(REST * 0.5, Vec3::zeros()).contains(Alerts::IMU_FAULTY))
    };
    assert_eq!([true, false].map(faulty), [false, true]);
}

#[test]
fn what_gravity_or_thrust_explains_does_not() {
    // Hovering, a loop, a fall, an empty battery, a ceiling.
    for (thrust, force) in [(1.0, 1.0), (2.0, 2.0), (0.0, 0.1), (1.0, 0.7), (2.0, 1.0)] {
        assert_eq!(found(FlightPhase::Flying, thrust, force), None, "{force} g at {thrust}");
    }
    assert_eq!(found(FlightPhase::Armed, 0.0, 0.5), None, "it may be carried");
}

#[test]
fn on_the_ground_only_gravity_does() {
    for (force, faulty) in [(0.5, true), (1.4, true), (0.8, false), (1.2, false)] {
        assert_eq!(found(FlightPhase::IdleGround, 0.0, force).is_some(), faulty, "{force} g");
    }
}

#[test]
fn d7_a_force_that_no_flight_has_is_a_fault_of_any_airframe_within_1_1_s() {
    let found_in = |mode: FlightMode, phase: FlightPhase, factor: f32| {
        let mut rig = Rig::flying();
        (rig.mode.mode, rig.mode.phase) = (mode, phase);
        let mut rig = rig.settled();
        (0..440).any(|_| rig.sample(REST * factor, Vec3::zeros()).contains(Alerts::IMU_FAULTY))
    };
    let found = |mode: FlightMode, factor: f32| found_in(mode, FlightPhase::Flying, factor);
    assert!([0.0, 0.1, 2.8].into_iter().all(|factor| found(FlightMode::PosHold, factor)));
    assert!(!found(FlightMode::PosHold, 0.5));
    assert!(!found(FlightMode::Acro, 0.0), "falling with the motors at rest, where the throttle is the pilot's");
    assert!(found_in(FlightMode::Acro, FlightPhase::Landing, 0.1), "what lands by itself has no motors at rest");
}

#[test]
fn a_zero_that_vibration_moves_is_no_fault() {
    let config = FailsafeConfig { hover_thrust: 0.36, ..FailsafeConfig::default() };
    let mut rig = Rig { failsafe: Failsafe::new(config), ..Rig::flying() };
    rig.output.thrust = 1.1 * 0.36;
    for n in 0..2_000 {
        let shake = Vec3::new(6.0, -5.0, 9.0) * if n % 2 == 0 { 1.0 } else { -1.0 };
        let alerts = rig.sample(REST * 0.7 + shake, Vec3::zeros());
        assert!(!alerts.contains(Alerts::IMU_FAULTY), "sample {n}");
    }
}

/// For so many samples each, in turn, it feels these forces: is it stopped within two seconds?
fn stopped(forces: [(u32, f32); 2], repeats: bool) -> bool {
    let config = FailsafeConfig { hover_thrust: 0.36, ..FailsafeConfig::default() };
    let mut rig = Rig { failsafe: Failsafe::new(config), ..Rig::flying() };
    rig.output.thrust = 0.36;
    let mut rig = rig.settled();
    let [(first, force), (second, other)] = forces;
    (0..800u32).any(|n| {
        let is_first = if repeats { n % (first + second) < first } else { n < first };
        rig.sample(REST * if is_first { force } else { other }, Vec3::zeros()).contains(Alerts::IMU_FAULTY)
    })
}

#[test]
fn what_is_unexplained_adds_up_and_a_jerk_does_not() {
    assert!(stopped([(30, 0.3), (15, 0.9)], true), "what fits in between is no excuse");
    assert!(!stopped([(15, 0.3), (60, 0.9)], true), "it is less than what fits");
    for force in [2.2, 2.9, -0.2] {
        assert!(!stopped([(12, force), (1, 1.0)], false), "30 ms of {force} g");
    }
}

/// Half of the force that the thrust makes, which a quiet flight of any length does not hide, and one that shakes does.
#[test]
fn how_much_it_shakes_is_a_mean_over_a_quarter_of_a_second() {
    let config = FailsafeConfig { hover_thrust: 0.36, ..FailsafeConfig::default() };
    let found = |quiet: u32, shakes: f32| {
        let mut rig = Rig { failsafe: Failsafe::new(config), ..Rig::flying() };
        rig.output.thrust = 0.36;
        for _ in 0..quiet {
            assert_eq!(rig.sample(REST, Vec3::zeros()), Alerts::NONE);
        }
        // It shakes for an eighth of a second and does not for the next.
        (0..1_200).find(|n| {
            let strength = if n / 50 % 2 == 0 { shakes } else { 0.0 };
            let shake = Vec3::new(0.0, 1.0, 0.0) * if n % 2 == 0 { strength } else { -strength };
            // The force falls when it has begun to shake.
            let force = REST * if *n < 100 { 1.0 } else { 0.5 } + shake;
            rig.sample(force, Vec3::zeros()).contains(Alerts::IMU_FAULTY)
        })
    };
    for quiet in [400, 4_000] {
        let samples = found(quiet, 0.0);
        assert!(samples.is_some_and(|samples| (100..220).contains(&samples)), "{quiet} before: {samples:?}");
    }
    assert_eq!(found(400, 15.0), None);
}
