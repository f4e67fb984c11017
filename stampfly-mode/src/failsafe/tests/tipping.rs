//! A vehicle that turns over a leg while it takes off or lands.

use super::*;

/// How it stood, rad, and how it leans and turns now, rad and rad/s, all about roll; its height, m, and the torque against it.
struct Tips {
    phase: FlightPhase,
    stood: f32,
    lean: f32,
    rate: f32,
    height: f32,
    torque: f32,
    weak: bool,
    mode: FlightMode,
}

const LANDING: Tips = Tips {
    phase: FlightPhase::Landing,
    stood: 0.0,
    lean: 0.1,
    rate: 4.0,
    height: 0.05,
    torque: -1.5,
    weak: false,
    mode: FlightMode::AltHold,
};

impl Tips {
    /// Samples until it counts as tumbled.
    fn tumbled(&self) -> Option<u32> {
        let config = FailsafeConfig { weak_roll: 1.0, weak_pitch: 1.0, ..FailsafeConfig::default() };
        let mut rig = Rig { failsafe: Failsafe::new(config), ..Rig::flying() };
        let roll = |angle: f32| Quat::from_axis_angle(&Vec3::x_axis(), angle);
        (rig.mode.phase, rig.mode.mode, rig.estimate.attitude) = (FlightPhase::Armed, self.mode, roll(self.stood));
        for _ in 0..10 {
            rig.sample(REST, Vec3::zeros());
        }
        if self.weak {
            (rig.mode.phase, rig.output.torque) = (FlightPhase::Flying, Vec3::new(2.0, 2.0, 0.0));
            let found = (0..400).any(|_| rig.sample(REST, Vec3::zeros()).contains(Alerts::MOTOR_WEAK));
            assert!(found, "a weak motor");
        }
        (rig.mode.phase, rig.estimate.height, rig.estimate.attitude) = (self.phase, self.height, roll(self.lean));
        rig.estimate.angular_rate.x = self.rate;
        rig.output.torque = Vec3::new(self.torque, 0.0, 0.0);
        (1..=100).find(|_| rig.sample(REST, Vec3::zeros()).contains(Alerts::TUMBLED))
    }
}

#[test]
fn a_vehicle_that_turns_over_a_leg_while_landing_stops() {
    let soon = |tips: &Tips| tips.tumbled().is_some_and(|samples| samples <= 12);
    assert!(soon(&LANDING), "30 ms: {:?}", LANDING.tumbled());
    assert!(soon(&Tips { lean: -0.1, rate: -4.0, torque: 1.5, ..LANDING }), "to the left");
    assert!(soon(&Tips { torque: 0.0, weak: true, ..LANDING }), "a weak motor pushes it");
    for (tips, why) in [
        (Tips { height: 0.2, ..LANDING }, "in the air"),
        (Tips { rate: 0.0, ..LANDING }, "it does not turn"),
        (Tips { rate: -4.0, ..LANDING }, "it turns back"),
        (Tips { torque: 0.0, ..LANDING }, "nothing pushes back: as the pilot wants"),
        (Tips { torque: 1.5, ..LANDING }, "the controller wants it"),
    ] {
        assert_eq!(tips.tumbled(), None, "{why}");
    }
}

#[test]
fn a_manual_mode_that_turns_over_on_the_ground_stops() {
    let flies = Tips { phase: FlightPhase::Flying, mode: FlightMode::Acro, torque: -2.5, ..LANDING };
    assert!(flies.tumbled().is_some_and(|samples| samples <= 12), "30 ms: {:?}", flies.tumbled());
    for (tips, why) in [
        (Tips { height: 0.2, ..flies }, "in the air"),
        (Tips { torque: -1.5, ..flies }, "a stick and a leg ask for as much"),
        (Tips { torque: 2.5, ..flies }, "the stick wants it"),
        (Tips { mode: FlightMode::AltHold, ..flies }, "a mode that holds its height flies when it has taken off"),
    ] {
        assert_eq!(tips.tumbled(), None, "{why}");
    }
}

#[test]
fn a_take_off_from_a_slope_turns_to_level() {
    let slope = Tips { phase: FlightPhase::TakeOff, stood: 0.175, torque: 0.0, ..LANDING };
    for (lean, rate) in [(0.1, -2.0), (0.0, -2.0), (0.175, 0.0), (0.0, 0.0)] {
        assert_eq!(Tips { lean, rate, ..slope }.tumbled(), None, "{lean} rad, {rate} rad/s");
    }
    assert!(Tips { lean: -0.2, rate: -2.0, ..slope }.tumbled().is_some(), "beyond level");
}

#[test]
fn a_flip_may_be_upside_down_for_as_long_as_a_loop_of_a_pilot() {
    let config = FailsafeConfig::default();
    let upside_down = |phase, mode| {
        let mut rig = Rig::flying();
        (rig.mode.phase, rig.mode.mode) = (phase, mode);
        rig.estimate.attitude = Quat::from_axis_angle(&Vec3::x_axis(), core::f32::consts::PI);
        (1..=2_000).find(|_| rig.sample(REST, Vec3::zeros()).contains(Alerts::TUMBLED))
    };
    let flip = upside_down(FlightPhase::Flip, FlightMode::PosHold);
    assert_eq!(flip, upside_down(FlightPhase::Flying, FlightMode::Acro));
    let samples = flip.expect("it does not come back") as f32;
    assert!((samples * PERIOD.seconds() - config.acro_time.seconds()).abs() < 0.01, "{samples} samples");
}
