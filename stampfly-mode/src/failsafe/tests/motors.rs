//! A motor that is lost, and one that runs by itself.

use super::*;

/// Of a weak motor's torque about roll and pitch, N·m. One rotor's share is 3.3 times as much.
const LIMITS: [f32; 2] = [2.0, 3.0];

fn rig(phase: FlightPhase, height: f32) -> Rig {
    let config =
        FailsafeConfig { weak_roll: LIMITS[0], weak_pitch: LIMITS[1], idle_current: 0.6, ..FailsafeConfig::default() };
    let mut rig = Rig { failsafe: Failsafe::new(config), ..Rig::flying() };
    (rig.mode.phase, rig.estimate.height) = (phase, height);
    rig
}

/// After how many of so many samples with this torque, in units of the limits, is the alert there?
fn found(rig: &mut Rig, torque: [f32; 2], samples: u32, alert: Alerts) -> Option<u32> {
    rig.output.torque = Vec3::new(torque[0] * LIMITS[0], torque[1] * LIMITS[1], 0.0);
    (1..=samples).find(|_| rig.sample(REST, Vec3::zeros()).contains(alert))
}

#[test]
fn a_torque_that_no_three_rotors_make_is_a_lost_motor() {
    let lost = |phase, height, torque, samples| {
        let mut rig = rig(phase, height);
        found(&mut rig, torque, samples, Alerts::MOTOR_LOST)
    };
    let after = lost(FlightPhase::Flying, 1.0, [4.0, -4.0], 400);
    assert!(after.is_some_and(|samples| (40..100).contains(&samples)), "a low-pass and 0.1 s: {after:?}");
    assert_eq!(lost(FlightPhase::Landing, 0.6, [4.0, -4.0], 400), after, "it drops a vehicle that lands, too");
    assert!(lost(FlightPhase::Flying, 1.0, [3.5, -3.5], 400).is_some(), "more than a share");
    for (phase, height, torque, samples, why) in [
        (FlightPhase::Flying, 1.0, [4.0, 2.5], 400, "about one axis"),
        (FlightPhase::Flying, 1.0, [3.2, 3.2], 400, "less than a share"),
        (FlightPhase::Flying, 1.0, [4.0, 4.0], 60, "a gust"),
        (FlightPhase::Flying, 0.03, [4.0, 4.0], 400, "near the ground"),
        (FlightPhase::Armed, 1.0, [4.0, 4.0], 400, "it stands"),
        (FlightPhase::Landing, 0.15, [4.0, 4.0], 400, "it lands, and may stand"),
    ] {
        assert_eq!(lost(phase, height, torque, samples), None, "{why}");
    }
}

/// Rotors that turn slowly slow down over many lags: what is asked of them is not what they make.
#[test]
fn a_throttle_that_was_pulled_is_no_weak_motor() {
    let weak = |thrust: f32| {
        let mut rig = rig(FlightPhase::Flying, 1.0);
        rig.failsafe.config.hover_thrust = 0.36;
        rig.output.thrust = 0.36;
        found(&mut rig, [0.0, 0.0], 200, Alerts::MOTOR_WEAK);
        rig.output.thrust = thrust;
        found(&mut rig, [2.0, -2.0], 400, Alerts::MOTOR_WEAK).is_some()
    };
    assert!(weak(0.36) && weak(0.25));
    assert!(!weak(0.0) && !weak(0.1));
}

/// Motors at their limit: what the controller asks for and does not get says nothing of a rotor.
#[test]
fn a_torque_that_was_not_made_is_neither_a_weak_motor_nor_a_lost_one() {
    let seen = |unmet: f32| {
        let mut rig = rig(FlightPhase::Flying, 1.0);
        rig.unmet = [unmet, unmet, 0.0, 0.0];
        [Alerts::MOTOR_WEAK, Alerts::MOTOR_LOST].map(|alert| found(&mut rig, [4.0, -4.0], 400, alert).is_some())
    };
    assert_eq!(seen(0.0), [true, true]);
    assert_eq!(seen(0.5), [true, false], "twice a weak motor's torque was made");
    assert_eq!(seen(0.8), [false, false], "0.8 of it");
    assert_eq!(seen(1.0), [false, false], "none");
    assert_eq!([seen(f32::NAN), seen(-1.0)], [[true, true]; 2], "no share");
}

#[test]
fn a_weak_motor_is_lost_soon_or_not_at_all() {
    let lost = |waits: u32, height: f32| {
        let mut rig = rig(FlightPhase::Flying, 1.0);
        found(&mut rig, [1.5, 1.5], 400, Alerts::MOTOR_WEAK).expect("a weak motor");
        (rig.mode.phase, rig.estimate.height) = (FlightPhase::Landing, height);
        found(&mut rig, [1.5, 1.5], waits, Alerts::MOTOR_LOST)
            .or_else(|| found(&mut rig, [8.0, 8.0], 400, Alerts::MOTOR_LOST))
    };
    assert!(lost(0, 1.0).is_some_and(|samples| samples < 80), "{:?}", lost(0, 1.0));
    assert!(lost(0, 0.12).is_some(), "a take-off does not come higher before it turns over");
    assert_eq!(lost(60, 1.0), None, "it was uneven for 100 ms before it was found, and for 150 ms since then");
    assert_eq!(lost(0, 0.05), None, "near the ground");
}

#[test]
fn a_motor_that_becomes_weak_while_it_lands_is_not_told_and_not_dropped() {
    let mut rig = rig(FlightPhase::Landing, 0.6);
    assert_eq!(found(&mut rig, [1.5, 1.5], 400, Alerts::MOTOR_WEAK), None);
    assert_eq!(found(&mut rig, [8.0, 8.0], 400, Alerts::MOTOR_LOST), None);
}

/// What the controller asks for all the time is usual, and a battery may lie askew; but not so far.
#[test]
fn a_torque_that_was_asked_for_from_the_ground_on_is_a_weak_motor_from_more_than_twice_as_much_on() {
    let weak = |torque: [f32; 2]| {
        let mut rig = rig(FlightPhase::Armed, 0.03);
        assert_eq!(found(&mut rig, torque, 400, Alerts::MOTOR_WEAK), None, "it stands");
        (rig.mode.phase, rig.estimate.height) = (FlightPhase::Flying, 1.0);
        found(&mut rig, torque, 400, Alerts::MOTOR_WEAK)
    };
    assert_eq!(weak([2.6, -2.6]), Some(41), "after 0.1 s");
    assert_eq!(weak([2.4, 2.4]), None);
    assert_eq!(weak([3.0, 2.4]), None, "about one axis");
}

/// Samples until a motor counts as running, of so many; bursts of a sample ten times a second add to the current, A.
fn runs(armed: bool, current: f32, burst: f32) -> Option<u32> {
    let mut rig = rig(FlightPhase::IdleGround, 0.03);
    rig.mode.armed = armed;
    if armed {
        rig.mode.phase = FlightPhase::Armed;
    }
    (0..800).find(|n| {
        rig.battery.current = current + if n % 40 == 0 { burst } else { 0.0 };
        rig.sample(REST, Vec3::zeros()).contains(Alerts::MOTOR_RUNS)
    })
}

#[test]
fn only_a_motor_draws_amperes_while_disarmed() {
    assert!(runs(false, 2.6, 0.0).is_some_and(|samples| samples < 200), "{:?}", runs(false, 2.6, 0.0));
    assert_eq!(runs(false, 0.4, 2.0), None, "a radio's bursts");
    assert_eq!(runs(true, 2.6, 0.0), None, "its motors may turn");
}

#[test]
fn it_is_over_when_the_current_is() {
    let mut rig = rig(FlightPhase::IdleGround, 0.03);
    rig.mode.armed = false;
    rig.battery.current = 2.6;
    assert!((0..200).any(|_| rig.sample(REST, Vec3::zeros()).contains(Alerts::MOTOR_RUNS)));
    rig.battery.current = 0.2;
    assert!((0..400).any(|_| !rig.sample(REST, Vec3::zeros()).contains(Alerts::MOTOR_RUNS)));
}
