//! Every reason to stop is reached, and after each the vehicle flies as if nothing had been.

use super::plant::{PERIOD, Plant, Rig};
use proptest::prelude::*;
use stampfly_control::autotune::{AcceptError, Autotune, AutotuneAxis, AutotuneConfig, AutotuneStage, AutotuneStop};
use stampfly_control::guidance::{Navigator, NavigatorInput};
use stampfly_control::pid::PidGains;
use stampfly_types::messages::{
    Alerts, CommandSetpoint, CommandSource, FlightMode, FlightPhase, FlightStatus, GroundContact, GuidedCommand,
    GuidedKind, LandDetected, SetpointAxes, StateEstimate, Validity,
};
use stampfly_types::{Duration, Instant, Quat, Vec3};

const AXIS: AutotuneAxis = AutotuneAxis::Roll;

fn rig() -> Rig {
    Rig::new(Plant::nominal(AXIS), AXIS)
}

/// Three seconds into the excitation.
fn excited() -> Rig {
    let mut rig = rig();
    rig.fly(0.5);
    rig.start().expect("it hovers");
    rig.fly(3.0);
    assert_eq!(rig.autotune.stage(), AutotuneStage::Exciting);
    assert!((0..40).any(|_| {
        rig.step();
        rig.torque != rig.asked
    }));
    rig
}

fn with_config(change: impl Fn(&mut AutotuneConfig)) -> Rig {
    let mut rig = rig();
    let configs = [AutotuneAxis::Roll, AutotuneAxis::Pitch, AutotuneAxis::Yaw].map(|axis| {
        let mut config = *rig.autotune.config(axis);
        change(&mut config);
        config
    });
    rig.autotune = Autotune::new(configs);
    rig
}

/// It stopped for this reason, adds nothing any more, and there is nothing to accept.
fn assert_stopped(rig: &mut Rig, reason: AutotuneStop) {
    assert_eq!(rig.torque, rig.asked, "{reason}: nothing is added in the step that stops it");
    assert_eq!((rig.autotune.stage(), rig.autotune.stopped()), (AutotuneStage::Stopped, Some(reason)));
    assert!(rig.autotune.report().is_none());
    let landed = FlightStatus { armed: false, ..rig.flight_status };
    assert_eq!(rig.autotune.accept(&landed), Err(AcceptError::Nothing));
    for _ in 0..400 {
        rig.step();
        assert_eq!(rig.torque, rig.asked, "{reason}");
    }
}

/// What is wrong, and how it is told. Each holds before the start and in flight.
type Wrong = (&'static str, fn(&mut Rig), AutotuneStop);
const WRONG: &[Wrong] = &[
    ("disarmed", |rig| rig.flight_status.armed = false, AutotuneStop::NotHovering),
    ("landing", |rig| rig.flight_status.phase = FlightPhase::Landing, AutotuneStop::NotHovering),
    ("by hand", |rig| rig.flight_status.mode = FlightMode::Stabilize, AutotuneStop::NotHovering),
    ("touches", |rig| rig.land_detected.contact = GroundContact::Ground, AutotuneStop::NotHovering),
    ("failsafe", |rig| rig.command.source = CommandSource::Failsafe, AutotuneStop::NotHovering),
    ("low", |rig| rig.estimate.height = 0.2, AutotuneStop::NotHovering),
    ("height is none", |rig| rig.estimate.height = f32::NAN, AutotuneStop::NotHovering),
    ("height unknown", |rig| rig.estimate.valid = Validity::ALL.without(Validity::HEIGHT), AutotuneStop::NotHovering),
    ("moves", |rig| rig.estimate.velocity.x = 1.5, AutotuneStop::NotHovering),
    ("falls", |rig| rig.estimate.velocity.z = 1.5, AutotuneStop::NotHovering),
    ("tilt unknown", |rig| rig.estimate.valid = Validity::ALL.without(Validity::TILT), AutotuneStop::Estimate),
    ("rate is none", |rig| rig.estimate.angular_rate.z = f32::NAN, AutotuneStop::Estimate),
    ("rate is infinite", |rig| rig.estimate.angular_rate.x = f32::INFINITY, AutotuneStop::Estimate),
    ("tilts", |rig| rig.estimate.attitude = Quat::from_euler_angles(0.0, 0.4, 0.0), AutotuneStop::Excursion),
    ("turns", |rig| rig.estimate.angular_rate.y = -4.0, AutotuneStop::Excursion),
    ("roll stick", |rig| rig.command.roll = 0.2, AutotuneStop::Sticks),
    ("pitch stick", |rig| rig.command.pitch = -0.2, AutotuneStop::Sticks),
    ("yaw stick", |rig| rig.command.yaw = 0.2, AutotuneStop::Sticks),
    ("throttle", |rig| rig.command.throttle = -0.2, AutotuneStop::Sticks),
    ("stick is none", |rig| rig.command.roll = f32::NAN, AutotuneStop::Sticks),
    ("battery", |rig| rig.alerts = Alerts::LOW_BATTERY, AutotuneStop::Alert),
    ("link", |rig| rig.alerts = Alerts::COMM_LOST, AutotuneStop::Alert),
];

#[test]
fn what_is_wrong_refuses_the_start() {
    for (name, wrong, reason) in WRONG {
        let mut rig = rig();
        rig.fly(0.5);
        wrong(&mut rig);
        let before = rig.autotune.clone();
        assert_eq!(rig.start(), Err(*reason), "{name}");
        assert_eq!(rig.autotune, before, "{name}: nothing has changed");
    }
}

#[test]
fn what_goes_wrong_ends_it_in_the_same_step() {
    for (name, wrong, reason) in WRONG {
        let mut rig = excited();
        wrong(&mut rig);
        rig.step();
        assert_eq!(rig.autotune.stopped(), Some(*reason), "{name}");
        assert_eq!(
            rig.torque.to_array().map(f32::to_bits),
            rig.asked.to_array().map(f32::to_bits),
            "{name}: nothing is added"
        );
        let stopped = rig.autotune.clone();
        rig.flight_status.armed = false;
        rig.step();
        assert_eq!(rig.autotune, stopped, "{name}: it stays so");
    }
}

#[test]
fn it_flies_on_after_a_stop() {
    let mut rig = excited();
    rig.command.roll = 0.2;
    rig.step();
    assert_stopped(&mut rig, AutotuneStop::Sticks);
    // And it can begin anew.
    rig.command.roll = 0.0;
    rig.start().expect("the stick is centred");
    assert_eq!(rig.start(), Err(AutotuneStop::Busy));
}

#[test]
fn torque_that_is_cut_too_often_ends_it() {
    let mut rig = excited();
    rig.unmet[0] = 0.3;
    let cut = (0..400).find(|_| {
        rig.step();
        rig.autotune.stage() == AutotuneStage::Stopped
    });
    assert!(cut.is_some_and(|steps| (5..100).contains(&steps)), "not at once, and soon: {cut:?}");
    assert_stopped(&mut rig, AutotuneStop::Saturated);
    // What another axis lost does not matter.
    let mut rig = excited();
    rig.unmet[2] = 0.3;
    rig.fly(1.0);
    assert_eq!(rig.autotune.stage(), AutotuneStage::Exciting);
    // Its own limit counts alike.
    let mut rig = with_config(|config| config.torque_max *= 0.05);
    rig.fly(0.5);
    rig.start().expect("it hovers");
    rig.fly(4.0);
    assert_stopped(&mut rig, AutotuneStop::Saturated);
}

#[test]
fn steps_that_are_missing_end_it() {
    let mut rig = excited();
    rig.now += Duration::from_millis(30);
    rig.step();
    assert_stopped(&mut rig, AutotuneStop::Timing);
    let mut rig = excited();
    rig.now = Instant::from_micros(rig.now.as_micros() - PERIOD.as_micros());
    rig.step();
    assert_eq!(rig.autotune.stopped(), Some(AutotuneStop::Timing), "the same instant twice");
}

#[test]
fn it_does_not_take_longer_than_it_may() {
    let mut rig = with_config(|config| config.time_limit = Duration::from_secs(5));
    assert_eq!(rig.tune(), AutotuneStage::Stopped);
    assert_stopped(&mut rig, AutotuneStop::Timeout);
}

#[test]
fn noise_that_hides_the_vehicle_ends_it() {
    let mut rig = with_config(|config| config.amplitude *= 0.1);
    rig.plant.noise = 0.3;
    assert_eq!(rig.tune(), AutotuneStage::Stopped);
    assert_stopped(&mut rig, AutotuneStop::Quality);
    // So does a vehicle that is not of the kind.
    let mut rig = with_config(|config| config.misfit_max = 1e-4);
    assert_eq!(rig.tune(), AutotuneStage::Stopped);
    assert_stopped(&mut rig, AutotuneStop::Quality);
}

#[test]
fn margins_that_no_gains_have_end_it() {
    let mut rig = with_config(|config| config.phase_margin = 1.55);
    assert_eq!(rig.tune(), AutotuneStage::Stopped);
    assert_stopped(&mut rig, AutotuneStop::Margins);
}

#[test]
fn gains_that_are_far_from_the_present_ones_end_it() {
    let mut rig = with_config(|config| config.change_max = 1.05);
    rig.plant.inertia *= 1.5;
    assert_eq!(rig.tune(), AutotuneStage::Stopped);
    assert_stopped(&mut rig, AutotuneStop::Bounds);
    for broken in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let rig = self::rig();
        let gains = PidGains { kp: broken, ..rig.gains };
        let mut rig = rig.with_gains(gains);
        assert_eq!(rig.start(), Err(AutotuneStop::Bounds), "{broken}");
    }
}

#[test]
fn somebody_may_end_it_but_not_undo_a_result() {
    let mut rig = excited();
    rig.autotune.cancel();
    rig.step();
    assert_stopped(&mut rig, AutotuneStop::Cancelled);
    let mut rig = self::rig();
    assert_eq!(rig.tune(), AutotuneStage::Done);
    rig.autotune.cancel();
    assert_eq!(rig.autotune.stage(), AutotuneStage::Done);
}

#[test]
fn gains_are_handed_out_once_and_on_the_ground() {
    let mut rig = rig();
    let landed = FlightStatus { armed: false, ..rig.flight_status };
    assert_eq!(rig.autotune.accept(&landed), Err(AcceptError::Nothing));
    assert_eq!(rig.tune(), AutotuneStage::Done);
    let (flying, proposed) = (rig.flight_status, rig.autotune.report().expect("it is done").proposed);
    assert_eq!(rig.autotune.accept(&flying), Err(AcceptError::Armed));
    assert_eq!(rig.autotune.accept(&landed), Ok((AXIS, proposed)));
    assert_eq!(rig.autotune.accept(&landed), Err(AcceptError::Nothing));
    assert!(rig.autotune.report().is_some(), "what was found, and the gains of before, can still be read");
}

/// Steps with a set-point that asks for `axes`.
fn follow(rig: &mut Rig, axes: SetpointAxes, steps: u32) {
    for _ in 0..steps {
        let (gains, mut autotune) = (rig.gains, rig.autotune.clone());
        autotune.follow(rig.now, axes, |_| gains, &rig.input(), &Vec3::zeros());
        rig.autotune = autotune;
        rig.now += PERIOD;
    }
}

#[test]
fn a_set_point_begins_it_and_ends_it() {
    let stage = |rig: &Rig| (rig.autotune.stage(), rig.autotune.stopped(), rig.autotune.status().axis);
    let mut rig = rig();
    follow(&mut rig, SetpointAxes::YAW, 10);
    assert_eq!(stage(&rig), (AutotuneStage::Idle, None, AutotuneAxis::Roll));
    follow(&mut rig, SetpointAxes::YAW | SetpointAxes::AUTOTUNE_PITCH, 10);
    assert_eq!(stage(&rig), (AutotuneStage::Exciting, None, AutotuneAxis::Pitch));
    assert_eq!(rig.autotune.news(), Some(rig.autotune.status()));
    assert_eq!(rig.autotune.news(), None, "told once");
    follow(&mut rig, SetpointAxes::AUTOTUNE_YAW, 10);
    assert_eq!(stage(&rig), (AutotuneStage::Exciting, None, AutotuneAxis::Yaw));
    follow(&mut rig, SetpointAxes::NONE, 1);
    assert_eq!(stage(&rig), (AutotuneStage::Stopped, Some(AutotuneStop::Cancelled), AutotuneAxis::Yaw));
    // Refused, and not tried again while the set-point asks for it.
    rig.estimate.height = 0.1;
    follow(&mut rig, SetpointAxes::AUTOTUNE_ROLL, 1);
    rig.estimate.height = 1.0;
    follow(&mut rig, SetpointAxes::AUTOTUNE_ROLL, 10);
    assert_eq!(stage(&rig), (AutotuneStage::Stopped, Some(AutotuneStop::NotHovering), AutotuneAxis::Roll));
}

#[test]
fn a_navigator_asks_for_it_while_a_program_flies() {
    let mut navigator = Navigator::default();
    let mut rig = rig();
    let mut axes = |kind, commander| {
        navigator.accept(&GuidedCommand { kind, ..GuidedCommand::default() }).expect("no place in it");
        rig.now += PERIOD;
        rig.flight_status.commander = commander;
        let (flight_status, estimate) = (&rig.flight_status, &rig.estimate);
        let input =
            NavigatorInput { flight_status, estimate, land_detected: &rig.land_detected, command: &rig.command };
        AutotuneAxis::asked(navigator.step(rig.now, &input).axes)
    };
    assert_eq!(axes(GuidedKind::AutotunePitch, CommandSource::Guided), Some(AutotuneAxis::Pitch));
    assert_eq!(
        axes(GuidedKind::None, CommandSource::Guided),
        Some(AutotuneAxis::Pitch),
        "a sign of life changes nothing"
    );
    assert_eq!(axes(GuidedKind::None, CommandSource::Pilot), None);
    assert_eq!(axes(GuidedKind::AutotuneYaw, CommandSource::Guided), Some(AutotuneAxis::Yaw));
    assert_eq!(axes(GuidedKind::Hold, CommandSource::Guided), None);
}

fn any_float() -> impl Strategy<Value = f32> {
    prop_oneof![6 => -0.04f32..0.04, 1 => -1e3f32..1e3, 1 => any::<f32>()]
}

fn any_vector() -> impl Strategy<Value = Vec3> {
    (any_float(), any_float(), any_float()).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn what_is_added_is_bounded_whatever_comes_in(
        steps in prop::collection::vec((any_vector(), any_vector(), any_float(), any_float(), 0u64..30_000, 0u8..60), 1..400),
        axis in prop::sample::select(AutotuneAxis::ALL.to_vec()),
    ) {
        let mut rig = Rig::new(Plant::nominal(axis), axis);
        let config = *rig.autotune.config(axis);
        for (rate, torque, stick, height, span, chance) in steps {
            // Mostly what a flight looks like.
            rig.now += if chance < 58 { PERIOD } else { Duration::from_micros(span) };
            rig.estimate = StateEstimate { angular_rate: rate, height: 1.0, valid: Validity::ALL, ..StateEstimate::default() };
            rig.command = CommandSetpoint::default();
            if chance == 0 {
                (rig.command.roll, rig.estimate.height) = (stick, height);
            }
            let _ = rig.start();
            let mut autotune = rig.autotune.clone();
            let out = autotune.step(rig.now, &rig.input(), &torque);
            rig.autotune = autotune;
            let excited = rig.autotune.stage() == AutotuneStage::Exciting;
            for &other in AutotuneAxis::ALL {
                let (asked, given) = (other.of(&torque), other.of(&out));
                if other == axis && excited {
                    prop_assert!(asked.is_finite() && (given - asked).abs() <= 1.001 * config.amplitude + 1e-6 * asked.abs());
                    prop_assert!(given.abs() <= config.torque_max.max(asked.abs()) * 1.001);
                } else {
                    prop_assert_eq!(asked.to_bits(), given.to_bits());
                }
            }
        }
        prop_assert!(rig.autotune.report().is_none_or(|report| report.proposed.kp.is_finite()));
    }

    #[test]
    fn it_ends_whatever_the_rate_is(rates in prop::collection::vec(-1f32..1.0, 1..50)) {
        let mut rig = Rig::new(Plant::nominal(AXIS), AXIS);
        rig.start().expect("it hovers");
        for step in 0..12_000 {
            rig.estimate.angular_rate.x = rates[step % rates.len()];
            let mut autotune = rig.autotune.clone();
            autotune.step(rig.now, &rig.input(), &Vec3::zeros());
            rig.autotune = autotune;
            rig.now += PERIOD;
        }
        prop_assert!(matches!(rig.autotune.stage(), AutotuneStage::Done | AutotuneStage::Stopped));
        if let Some(report) = rig.autotune.report() {
            let (found, present) = (report.proposed, report.present);
            for (found, present) in [(found.kp, present.kp), (found.ti, present.ti), (found.td, present.td)] {
                prop_assert!((0.33..3.01).contains(&(found / present)), "{:?}", report);
            }
        }
    }
}

#[test]
fn the_ground_is_another_plant() {
    let mut rig = rig();
    (rig.land_detected, rig.flight_status) = (LandDetected::default(), FlightStatus::default());
    assert_eq!(rig.start(), Err(AutotuneStop::NotHovering));
}
