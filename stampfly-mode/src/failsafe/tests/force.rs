//! A specific force that fits neither gravity nor thrust and drag.

use super::*;

const WEIGHT: f32 = 0.36;

/// A vehicle of a palm's size.
fn airframe() -> FailsafeConfig {
    FailsafeConfig { hover_thrust: WEIGHT, drag: 1.0, drag_square: 0.1, ..FailsafeConfig::default() }
}

/// One that has hovered for a second.
fn hovering(config: FailsafeConfig) -> Rig {
    let mut rig = Rig { failsafe: Failsafe::new(config), ..Rig::flying() };
    rig.mode.mode = FlightMode::Acro;
    (rig.output.thrust, rig.thrust) = (WEIGHT, Some(WEIGHT));
    rig.settled()
}

/// After how many of 800 samples is this force, of gravity, implausible beside this thrust, of the
/// weight? The motors go on.
fn found_in(rig: &mut Rig, thrust: f32, force: f32) -> Option<u32> {
    (rig.output.thrust, rig.thrust) = (thrust * WEIGHT, Some(thrust * WEIGHT));
    (0..800).find(|_| {
        let alerts = rig.sample(REST * force, Vec3::zeros());
        assert!(!alerts.intersects(crate::decision::CUT), "{force} g at {thrust}: {:?}", alerts.names().last());
        alerts.contains(Alerts::FORCE_IMPLAUSIBLE)
    })
}

fn found(phase: FlightPhase, thrust: f32, force: f32) -> Option<u32> {
    let mut rig = hovering(airframe());
    rig.mode.phase = phase;
    found_in(&mut rig, thrust, force)
}

#[test]
fn d7_a_force_of_half_the_thrust_is_implausible_within_two_seconds() {
    for (thrust, force) in [(1.0, 0.5), (1.4, 0.7), (1.0, 0.0), (1.0, 2.0), (1.5, 2.8)] {
        for phase in [FlightPhase::TakeOff, FlightPhase::Flying, FlightPhase::Landing, FlightPhase::Flip] {
            let samples = found(phase, thrust, force);
            assert!(samples.is_some_and(|samples| samples > 400), "{force} g at {thrust} in {phase:?}: {samples:?}");
        }
    }
}

#[test]
fn what_gravity_or_thrust_explains_is_not() {
    // Hovering, a loop, a fall, an empty battery, a ceiling.
    for (thrust, force) in [(1.0, 1.0), (2.0, 2.0), (0.0, 0.1), (1.0, 0.7), (2.0, 1.0)] {
        assert_eq!(found(FlightPhase::Flying, thrust, force), None, "{force} g at {thrust}");
    }
    assert_eq!(found(FlightPhase::Armed, 0.0, 0.5), None, "it may be carried");
}

/// Falling at 6 m/s with hardly any thrust, the air pushes with more than the weight.
#[test]
fn drag_against_the_motion_explains_a_force_and_drag_along_it_does_not() {
    let fast = |down: f32, attitude: Quat| {
        let mut rig = hovering(airframe());
        (rig.estimate.velocity, rig.estimate.attitude) = (Vec3::new(0.0, 0.0, down), attitude);
        found_in(&mut rig, 0.2, 1.3)
    };
    let upright = Quat::identity();
    assert_eq!(fast(6.0, upright), None);
    assert!(fast(-6.0, upright).is_some(), "it climbs");
    assert!(fast(2.0, upright).is_some(), "no air pushes so hard at 2 m/s");
    let inverted = Quat::from_euler_angles(stampfly_types::math::PI, 0.0, 0.0);
    let mut rig = hovering(airframe());
    (rig.estimate.velocity, rig.estimate.attitude) = (Vec3::new(0.0, 0.0, -6.0), inverted);
    rig.thrust = Some(0.2 * WEIGHT);
    let seen = (0..800).fold(Alerts::NONE, |seen, _| seen | rig.sample(REST * 1.3, Vec3::zeros()));
    assert_eq!(seen, Alerts::TUMBLED, "on its back, climbing, which is too long on its back");
    let mut unknown = hovering(FailsafeConfig { drag: f32::INFINITY, ..airframe() });
    unknown.estimate.velocity.z = 0.5;
    assert_eq!(found_in(&mut unknown, 0.2, 1.3), None, "where drag may be anything");
}

#[test]
fn what_a_tired_battery_does_not_give_is_not_missed() {
    let mut rig = hovering(airframe());
    for n in 0..800 {
        (rig.output.thrust, rig.thrust) = (1.7 * WEIGHT, Some(0.7 * WEIGHT));
        let alerts = rig.sample(REST * 0.65, Vec3::zeros());
        assert_eq!(alerts, Alerts::NONE, "sample {n}");
    }
}

#[test]
fn where_thrust_or_velocity_is_unknown_no_force_is_implausible() {
    let unlike: [(&str, fn(&mut Rig)); 4] = [
        ("thrust", |rig| rig.thrust = None),
        ("velocity", |rig| rig.estimate.valid = Validity::TILT),
        ("battery", |rig| rig.battery.voltage = 1.0),
        ("motor", |rig| rig.output.torque = Vec3::new(2.0, 2.0, 0.0)),
    ];
    for (what, make) in unlike {
        let config = FailsafeConfig { weak_roll: 1.0, weak_pitch: 1.0, ..airframe() };
        let mut rig = hovering(config);
        make(&mut rig);
        // Weak motors are found within a tenth of a second.
        (0..80).for_each(|_| _ = rig.sample(REST, Vec3::zeros()));
        let found = (0..800).any(|_| rig.sample(REST * 0.4, Vec3::zeros()).contains(Alerts::FORCE_IMPLAUSIBLE));
        assert!(!found, "{what}");
    }
    let mut unknown = hovering(FailsafeConfig::default());
    assert_eq!(found_in(&mut unknown, 1.0, 0.0), None, "an unknown airframe");
}

/// Rotors come up 0.11 s after their duties.
#[test]
fn thrust_that_comes_late_is_not_missed() {
    let mut rig = hovering(airframe());
    let mut force = 1.0f32;
    for n in 0..2_000 {
        let thrust = [1.0, 0.0, 1.7, 0.2][n / 200 % 4];
        (rig.output.thrust, rig.thrust) = (thrust * WEIGHT, Some(thrust * WEIGHT));
        force += (thrust - force) * (0.0025 / 0.11);
        assert_eq!(rig.sample(REST * force, Vec3::zeros()), Alerts::NONE, "sample {n}");
    }
}

#[test]
fn on_the_ground_only_gravity_is_a_reason() {
    for (force, faulty) in [(0.5, true), (1.4, true), (0.8, false), (1.2, false)] {
        let mut rig = hovering(airframe());
        rig.mode.phase = FlightPhase::IdleGround;
        let seen = (0..800).fold(Alerts::NONE, |seen, _| seen | rig.sample(REST * force, Vec3::zeros()));
        let expected = if faulty { Alerts::IMU_FAULTY } else { Alerts::NONE };
        assert_eq!(seen, expected, "{force} g");
    }
}

#[test]
fn a_zero_that_vibration_moves_is_no_fault() {
    let mut rig = hovering(airframe());
    (rig.output.thrust, rig.thrust) = (1.1 * WEIGHT, Some(1.1 * WEIGHT));
    for n in 0..2_000 {
        let shake = Vec3::new(6.0, -5.0, 9.0) * if n % 2 == 0 { 1.0 } else { -1.0 };
        let alerts = rig.sample(REST * 0.7 + shake, Vec3::zeros());
        assert!(!alerts.contains(Alerts::FORCE_IMPLAUSIBLE), "sample {n}");
    }
}

#[test]
fn a_jerk_is_no_fault() {
    for force in [2.2, 2.9, -0.2] {
        let mut rig = hovering(airframe());
        for n in 0..400 {
            let force = if n < 12 { force } else { 1.0 };
            let alerts = rig.sample(REST * force, Vec3::zeros());
            assert!(!alerts.contains(Alerts::FORCE_IMPLAUSIBLE), "30 ms of {force} g");
        }
    }
}
