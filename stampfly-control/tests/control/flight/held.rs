//! Held by a hand with a stick pushed, then let go with the stick centred: what the loops have learned of the hand.

use super::plant::{Flight, Spread, Vehicle};
use super::{cascade, frame};
use stampfly_control::Controller;
use stampfly_types::Vec3;
use stampfly_types::messages::{CommandSource, FlightMode, SetpointAxes};

/// Largest tilt, degrees, within this time of letting go.
fn let_go<C: Controller>(controller: C, mode: FlightMode, roll: f32, within: f32) -> f32 {
    let mut flight = Flight::hovering(controller, Vehicle::default());
    flight.flight_status.mode = mode;
    flight.setpoint.axes = if mode == FlightMode::Acro { SetpointAxes::NONE } else { SetpointAxes::YAW };
    flight.command.source = CommandSource::Pilot;
    flight.command.throttle = 0.6;
    flight.fly(0.5, |_| ());
    let hand = flight.state;
    flight.command.roll = roll;
    flight.fly(60.0, |f| {
        (f.state.position, f.state.velocity, f.state.rate) = (hand.position, Vec3::zeros(), Vec3::zeros());
        f.state.attitude = hand.attitude;
    });
    flight.command.roll = 0.0;
    let mut tilt = Spread::default();
    flight.fly(within, |f| tilt.add(frame::tilt(&f.state.attitude)));
    tilt.largest.to_degrees()
}

#[test]
fn a_stick_that_nothing_answers_winds_nothing_up() {
    for roll in [1.0, -0.6] {
        for (mode, within) in [(FlightMode::Acro, 1.0), (FlightMode::Stabilize, 2.0)] {
            let tilt = let_go(cascade(), mode, roll, within);
            println!("{mode:?}, roll {roll}: {tilt:.1} deg");
            assert!(tilt < 6.0, "{mode:?}, roll {roll}: {tilt} deg");
        }
    }
}

#[test]
fn a_lean_within_the_integrals_reach_is_bounded_by_it() {
    // A hand against a small stick is a constant torque, which has to be learned.
    let tilt = let_go(cascade(), FlightMode::Stabilize, 0.25, 2.0);
    assert!((3.0..13.0).contains(&tilt), "{tilt} deg");
}
