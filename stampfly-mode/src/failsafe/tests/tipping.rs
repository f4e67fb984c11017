//! A vehicle that turns over a leg while it takes off or lands.

use super::*;

/// How it stood, rad, and how it leans and turns now, rad and rad/s, all about one axis; its height, m, and the torque against it.
struct Tips {
    phase: FlightPhase,
    /// Roll or pitch.
    axis: Vec3,
    stood: f32,
    lean: f32,
    rate: f32,
    height: f32,
    torque: f32,
    weak: bool,
    mode: FlightMode,
}

const ROLL: Vec3 = Vec3::new(1.0, 0.0, 0.0);
const PITCH: Vec3 = Vec3::new(0.0, 1.0, 0.0);
const LANDING: Tips = Tips {
    phase: FlightPhase::Landing,
    axis: ROLL,
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
        let lean = |angle: f32| Quat::from_scaled_axis(self.axis * angle);
        (rig.mode.phase, rig.mode.mode, rig.estimate.attitude) = (FlightPhase::Armed, self.mode, lean(self.stood));
        for _ in 0..10 {
            rig.sample(REST, Vec3::zeros());
        }
        if self.weak {
            (rig.mode.phase, rig.output.torque) = (FlightPhase::Flying, Vec3::new(2.0, 2.0, 0.0));
            let found = (0..400).any(|_| rig.sample(REST, Vec3::zeros()).contains(Alerts::MOTOR_WEAK));
            assert!(found, "a weak motor");
        }
        (rig.mode.phase, rig.estimate.height, rig.estimate.attitude) = (self.phase, self.height, lean(self.lean));
        rig.estimate.angular_rate = self.axis * self.rate;
        rig.output.torque = self.axis * self.torque;
        (1..=100).find(|_| rig.sample(REST, Vec3::zeros()).contains(Alerts::TUMBLED))
    }
}

#[test]
fn a_vehicle_that_turns_over_a_leg_while_landing_stops() {
    let soon = |tips: &Tips| tips.tumbled().is_some_and(|samples| samples <= 12);
    assert!(soon(&LANDING), "30 ms: {:?}", LANDING.tumbled());
    assert!(soon(&Tips { lean: -0.1, rate: -4.0, torque: 1.5, ..LANDING }), "to the left");
    assert!(soon(&Tips { torque: 0.0, weak: true, ..LANDING }), "a weak motor pushes it");
    let pitches = Tips { axis: PITCH, ..LANDING };
    assert!(soon(&pitches), "backwards: {:?}", pitches.tumbled());
    assert!(soon(&Tips { lean: -0.1, rate: -4.0, torque: 1.5, ..pitches }), "forwards");
    for (tips, why) in [
        (Tips { torque: 0.5, ..pitches }, "backwards, and the controller wants it"),
        (Tips { rate: 0.0, ..pitches }, "it does not pitch"),
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
        rig.estimate.attitude = Quat::from_axis_angle(&Vec3::x(), core::f32::consts::PI);
        (1..=2_000).find(|_| rig.sample(REST, Vec3::zeros()).contains(Alerts::TUMBLED))
    };
    let flip = upside_down(FlightPhase::Flip, FlightMode::PosHold);
    assert_eq!(flip, upside_down(FlightPhase::Flying, FlightMode::Acro));
    let samples = flip.expect("it does not come back") as f32;
    assert!((samples * PERIOD.seconds() - config.acro_time.seconds()).abs() < 0.01, "{samples} samples");
}

/// After how many of 4,000 samples does gravity contradict an attitude that is level, when the vehicle leans by this, rad?
fn contradicted(prepare: fn(&mut Rig), lean: f32) -> Option<u32> {
    let mut rig = Rig::flying();
    (rig.mode.phase, rig.mode.armed) = (FlightPhase::IdleGround, false);
    prepare(&mut rig);
    for _ in 0..400 {
        assert_eq!(rig.sample(REST, Vec3::zeros()), Alerts::NONE);
    }
    let force = Quat::from_scaled_axis(PITCH * lean) * REST;
    let found = (1..=4_000).find(|_| rig.sample(force, Vec3::zeros()).contains(Alerts::TILT_MISMATCH));
    if found.is_some() {
        assert!((0..4_000).any(|_| rig.sample(REST, Vec3::zeros()) == Alerts::NONE), "it ends with agreement");
    }
    found
}

/// 10°, and the mean of a second has to be there for half a second.
#[test]
fn a_tilt_that_gravity_contradicts_is_an_alert_on_the_ground() {
    for lean in [0.25, -0.25] {
        let found = contradicted(|_| (), lean);
        assert!(found.is_some_and(|samples| (600..760).contains(&samples)), "{lean} rad: {found:?}");
    }
    assert_eq!(contradicted(|_| (), 0.16), None, "within what the floor and the sensor are off by");
    assert_eq!(contradicted(|rig| rig.mode.phase = FlightPhase::Flying, 0.25), None, "in flight it feels its thrust");
    assert_eq!(contradicted(|rig| rig.estimate.valid = Validity::NONE, 0.25), None, "nothing to contradict");
}
