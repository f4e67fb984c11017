//! What programs may ask of the vehicle: parameters, which wait while it is armed, and nothing that flies it.

use stampfly_bus::{Band, Taps as _};
use stampfly_flight::{Assembled, FlightLoop};
use stampfly_param::parameters::set;
use stampfly_services::{Refusal, Request, VehicleActions};
use stampfly_stm32_quad::Parameters;
use stampfly_stm32_quad::parameters::RollGains;
use stampfly_stm32_quad::schedule::Runnables;
use stampfly_stm32_quad::serial::{Board, Newest};
use stampfly_stm32_quad::topics::{Bus, Id, Outside};
use stampfly_types::messages::{GuidedCommand, GuidedKind, PilotInput};
use stampfly_types::{Duration, Instant};

/// Lets the vehicle run for 50 ms, and its board look ten times.
fn run(flight_loop: &mut FlightLoop<'_, Runnables>, board: &mut Board<'_>, now: &mut Instant, armed: bool) {
    for _ in 0..10 {
        *now += Duration::from_millis(5);
        while flight_loop.run_next(Band::Background, *now, &mut ()) {}
        board.poll(*now, armed);
    }
}

#[test]
fn a_parameter_that_is_changed_while_it_is_armed_is_in_use_when_it_is_disarmed() {
    let mut bus = Bus::new();
    let defaults = Parameters::default();
    let Assembled { mut flight_loop, outside, mut taps } =
        Assembled::<Runnables>::new(&mut bus, None, &defaults, Instant::ZERO);
    let Outside { link, .. } = outside;
    let mut board = Board::new(&defaults, &defaults, link);
    let mut newest = Newest::new();
    let mut in_use = || {
        taps.drain(&mut |topic, at, _, words| newest.note(topic, at, words));
        newest.get::<Parameters>(Id::parameters as usize).map(|(_, parameters)| parameters)
    };
    let mut now = Instant::ZERO;
    run(&mut flight_loop, &mut board, &mut now, false);

    set(board.parameters(), "roll.p", 0.25).expect("in its range");
    run(&mut flight_loop, &mut board, &mut now, true);
    assert_eq!(in_use(), Some(defaults), "armed");
    run(&mut flight_loop, &mut board, &mut now, false);
    assert_eq!(in_use(), Some(Parameters { roll: RollGains { p: 0.25, ..defaults.roll }, ..defaults }));
}

#[test]
fn nothing_but_its_transmitter_arms_or_flies_it() {
    let mut bus = Bus::new();
    let defaults = Parameters::default();
    let Assembled { outside, .. } = Assembled::<Runnables>::new(&mut bus, None, &defaults, Instant::ZERO);
    let Outside { link, .. } = outside;
    let mut board = Board::new(&defaults, &defaults, link);
    for kind in [GuidedKind::Arm, GuidedKind::Disarm, GuidedKind::Kill, GuidedKind::TakeOff] {
        let command = GuidedCommand { kind, ..GuidedCommand::default() };
        assert_eq!(board.command(Instant::ZERO, command), Err(Refusal::Unsupported));
    }
    let input = PilotInput { throttle: 1.0, arm: true, ..PilotInput::default() };
    assert_eq!(board.sticks(Instant::ZERO, &input), Err(Refusal::Unsupported));
    for request in [Request::TestMotor { motor: 1, duty: 0.5 }, Request::Restart] {
        assert_eq!(board.request(Instant::ZERO, request), Err(Refusal::Unsupported));
    }
    assert_eq!(board.request(Instant::ZERO, Request::SaveParameters), Ok(()));
}
