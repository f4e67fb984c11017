//! The incremental inner loop in closed loop, beside the default one.

use super::plant::{AIRFRAME, Flight, Spread, Vehicle};
use super::{GUSTS, cascade, mission, poison, print, step_of_lean, variations};
use stampfly_control::indi::IndiRate;
use stampfly_control::{CascadeConfig, Controller, IndiConfig, IndiController};
use stampfly_types::messages::{CommandSource, FlightMode, SetpointAxes};
use stampfly_types::{Quat, Vec3, frame};

fn indi_with(config: &IndiConfig) -> IndiController {
    IndiController::with_rate_law(&CascadeConfig::for_airframe(&AIRFRAME), IndiRate::new(config))
}

fn indi() -> IndiController {
    indi_with(&IndiConfig::for_airframe(&AIRFRAME))
}

#[test]
fn squares_in_still_air_and_in_gusts() {
    for (name, vehicle) in variations() {
        let calm = mission(indi(), vehicle, 0.0);
        print(&format!("{name}, incremental"), &calm);
        assert!(calm.top < 0.55, "{name}: overshoot at take-off");
        assert!(calm.path.rms() < 0.10 && calm.path.largest < 0.15, "{name}: path");
        assert!(calm.height.rms() < 0.01 && calm.hover_tilt.largest < 5f32.to_radians(), "{name}");
        let figures = mission(indi(), vehicle, GUSTS);
        print(&format!("{name}, incremental, gusts"), &figures);
        assert!(figures.top < 0.60 && figures.path.rms() < 0.15 && figures.height.rms() < 0.025, "{name}");
    }
}

#[test]
fn steps_of_lean_are_quick_and_damped() {
    for (name, vehicle) in variations() {
        let (risen, overshoot) = step_of_lean(indi(), vehicle);
        println!("{name:30} lean: 90 % in {:.0} ms, overshoot {:.0} %", 1e3 * risen, 100.0 * overshoot);
        assert!(risen < 0.28, "{name}: {risen} s");
        assert!(overshoot < 0.20, "{name}: overshoot by {overshoot}");
    }
}

#[test]
fn it_has_margins() {
    // Twice and half the moments of inertia believed, 10 ms of delay on top, motors twice as slow.
    let nominal = Vehicle::default();
    for (scale, vehicle) in [
        (2.0, nominal),
        (0.5, nominal),
        (1.0, Vehicle { delay: nominal.delay + 4, ..nominal }),
        (1.0, Vehicle { motor_lag: 2.0 * AIRFRAME.motor_lag, ..nominal }),
    ] {
        let config = IndiConfig::for_airframe(&AIRFRAME);
        let mut flight =
            Flight::hovering(indi_with(&IndiConfig { inertia: scale * config.inertia, ..config }), vehicle);
        flight.state.rate = Vec3::new(2.0, -2.0, 1.0);
        flight.fly(3.0, |_| ());
        assert!(flight.state.rate.norm() < 0.02, "inertia x{scale}, {vehicle:?}: {:?}", flight.state.rate);
        assert!(frame::tilt(&flight.state.attitude) < 0.02);
    }
}

/// A tenth of a motor's thrust fails: the largest tilt that comes of it, rad.
fn weakened<C: Controller>(controller: C) -> f32 {
    let mut flight = Flight::hovering(controller, Vehicle::default());
    flight.fly(1.0, |_| ());
    flight.vehicle.motor_gain[0] = 0.9;
    let mut tilt = Spread::default();
    flight.fly(2.0, |f| tilt.add(frame::tilt(&f.state.attitude)));
    tilt.largest
}

#[test]
fn a_motor_that_becomes_weak_is_made_up_for_at_once() {
    let (cascade, indi) = (weakened(cascade()), weakened(indi()));
    println!("one motor -10 % in flight: tilts by {:.2} and {:.2} deg", cascade.to_degrees(), indi.to_degrees());
    assert!(indi < 0.7 * cascade, "{indi} against {cascade} rad");
}

/// Held by a hand for ten seconds, ten degrees from level, then let go: the largest tilt after that, rad.
fn held<C: Controller>(controller: C) -> f32 {
    let mut flight = Flight::hovering(controller, Vehicle::default());
    flight.flight_status.mode = FlightMode::AltHold;
    flight.setpoint.axes = SetpointAxes::POSITION_Z | SetpointAxes::YAW;
    flight.command.source = CommandSource::Pilot;
    flight.fly(1.0, |_| ());
    let hand = flight.state;
    let attitude = Quat::from_euler_angles(0.12, -0.12, 0.0);
    flight.fly(10.0, |f| {
        (f.state.position, f.state.velocity, f.state.rate) = (hand.position, Vec3::zeros(), Vec3::zeros());
        f.state.attitude = attitude;
    });
    let mut tilt = Spread::default();
    flight.fly(2.0, |f| tilt.add(frame::tilt(&f.state.attitude)));
    tilt.largest
}

#[test]
fn what_a_hand_held_winds_nothing_up() {
    let (cascade, indi) = (held(cascade()), held(indi()));
    println!("held at 9.7 deg and let go: {:.1} and {:.1} deg", cascade.to_degrees(), indi.to_degrees());
    assert!(indi < 0.30, "{indi} rad");
}

#[test]
fn on_the_ground_it_answers_but_does_not_remember() {
    let mut flight = Flight::standing(indi(), Vehicle::default());
    flight.flight_status.mode = FlightMode::Stabilize;
    flight.setpoint.axes = SetpointAxes::YAW;
    flight.command.throttle = 0.1;
    flight.state.attitude = Quat::from_euler_angles(0.17, 0.0, 0.0);
    flight.fly(0.5, |_| ());
    let first = flight.output;
    flight.fly(60.0, |_| ());
    assert!((flight.output.torque - first.torque).norm() < 1e-3 * first.torque.norm(), "{:?} {first:?}", flight.output);
}

#[test]
fn a_reset_forgets_what_was_measured() {
    let vehicle = Vehicle { motor_gain: [0.9, 1.0, 1.0, 1.0], delay: 0, ..Vehicle::default() };
    let mut flight = Flight::hovering(indi(), vehicle);
    flight.fly(2.0, |_| ());
    let mut fresh = Flight::hovering(indi(), vehicle);
    (fresh.state, fresh.flight_status) = (flight.state, flight.flight_status);
    let mut reset = flight.flight_status;
    reset.control_resets += 1;
    flight.step();
    let remembered = flight.output.torque;
    (flight.state, flight.flight_status, fresh.flight_status) = (fresh.state, reset, reset);
    flight.step();
    fresh.step();
    assert_eq!(flight.output.torque, fresh.output.torque);
    assert!((remembered - fresh.output.torque).norm() > 0.05 * AIRFRAME.rotor_torque().norm());
}

#[test]
fn poison_never_reaches_the_output() {
    poison(indi());
}
