//! Phases and pairing that end by themselves; take-off.

use super::*;

#[test]
fn d16_pairing_ends_when_the_new_transmitter_talks_though_it_always_did() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.sends(&mut machine, frame(FlightMode::PosHold, false, 0.0));
    world.button = Some(ButtonGesture::HoldPair);
    assert!(world.step(&mut machine, &[]).flight_status.pairing);
    assert!(world.pass(&mut machine, 100).pairing, "a frame from before is still fresh");
    world.alerts = Alerts::COMM_LOST;
    assert_eq!(machine.refusals().map(|refusal| refusal.check).next(), Some(ArmBlocks::PAIRING));
    assert!(!world.pass(&mut machine, 200).pairing);
}

#[test]
fn d16_pairing_ends_by_itself_and_by_the_button() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    for again in [false, true] {
        world.button = Some(ButtonGesture::HoldPair);
        assert!(world.step(&mut machine, &[]).flight_status.pairing);
        if again {
            world.button = Some(ButtonGesture::HoldPair);
            assert!(!world.step(&mut machine, &[]).flight_status.pairing);
        } else {
            assert!(world.pass(&mut machine, 59_900).pairing);
            assert!(!world.pass(&mut machine, 200).pairing);
        }
    }
}

#[test]
fn d17_a_lifted_vehicle_that_does_not_know_its_height_stands_again() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleHeld);
    let resets = machine.state.full_resets;
    world.estimate.valid = Validity::NONE;
    assert_eq!(world.pass(&mut machine, 1_900).phase, FlightPhase::IdleHeld);
    assert_eq!(world.pass(&mut machine, 200).phase, FlightPhase::IdleGround);
    assert_eq!(machine.state.full_resets, resets + 1, "and the estimator begins anew");
}

#[test]
fn d17_take_off_and_landing_end_by_themselves() {
    let (mut machine, mut world) = in_phase(FlightPhase::TakeOff);
    assert_eq!(world.pass(&mut machine, 14_900).phase, FlightPhase::TakeOff);
    assert_eq!(world.pass(&mut machine, 200).phase, FlightPhase::Landing);
    for (valid, seconds) in [(Validity::ALL, 40), (Validity::TILT, 60)] {
        let (mut machine, mut world) = in_phase(FlightPhase::Flying);
        world.estimate.valid = valid;
        world.step(&mut machine, &[Command::Land]);
        assert_eq!(world.pass(&mut machine, seconds * 1_000 - 100).phase, FlightPhase::Landing);
        let status = world.pass(&mut machine, 300);
        assert!(!status.armed && status.blocks.contains(ArmBlocks::CRASHED));
    }
}

#[test]
fn d20_a_throttle_that_is_no_number_does_not_take_off() {
    for bad in [f32::INFINITY, f32::NAN] {
        let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
        world.sends(&mut machine, frame(FlightMode::Stabilize, false, bad));
        assert!(world.sends(&mut machine, frame(FlightMode::Stabilize, true, bad)).armed);
        assert_eq!(world.pass(&mut machine, 1_000).phase, FlightPhase::Armed);
        assert!(machine.unreadable_frames() > 50);
    }
}

#[test]
fn a_click_takes_off_and_holds_the_place() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.sends(&mut machine, frame(FlightMode::Stabilize, false, 0.0));
    let clicked = press(&mut world, &mut machine, Duration::ZERO, ButtonGesture::Click);
    assert_eq!((clicked.phase, clicked.mode), (FlightPhase::Armed, FlightMode::PosHold));
    let later = world.pass(&mut machine, 310);
    assert_eq!((later.phase, later.mode), (FlightPhase::TakeOff, FlightMode::PosHold));
}
