//! What the board and the flight stack tell each other beside sensors and motors: motor test, flash, cut-off, restart.

use crate::bench::{Bench, OLD};
use stampfly_board::console::{Command, TEST_TIME};
use stampfly_board::messages::{CutoffState, MotorTest, StorageBusy};
use stampfly_board::topics::{self, Id};
use stampfly_types::messages::{Alerts, ArmBlocks, ArmRefusals, GuidedKind, SystemAlert};

/// A vehicle that is ready to fly, with a program beside its pilot.
fn ready(bus: &mut topics::Bus) -> Bench<'_> {
    let mut bench = Bench::new(bus, Some(OLD));
    bench.program = true;
    bench.pass(6_000, false, &[(OLD, false)]);
    assert_eq!(bench.blocks(), ArmBlocks::NONE);
    bench
}

fn arm(bench: &mut Bench<'_>) {
    bench.command(GuidedKind::Arm);
    bench.pass(20, false, &[(OLD, false)]);
    assert!(bench.armed());
}

#[test]
fn a_motor_test_turns_one_motor_for_two_seconds() {
    let mut bus = topics::Bus::new();
    let mut bench = ready(&mut bus);
    bench.console(Command::TestMotor { motor: 3, duty: 0.125 });
    bench.pass(TEST_TIME.as_millis() - 5, false, &[]);
    let motors = bench.motors();
    assert_eq!((motors.armed, motors.duty), (true, [0.0, 0.0, 0.125, 0.0, 0.0, 0.0, 0.0, 0.0]));
    assert!(!bench.armed(), "the vehicle is not");
    bench.pass(10, false, &[]);
    assert_eq!((bench.motors().armed, bench.motors().duty), (false, [0.0; 8]));

    bench.console(Command::TestMotor { motor: 1, duty: 0.2 });
    bench.pass(20, false, &[]);
    assert_eq!(bench.motors().duty[0], 0.2);
    bench.console(Command::StopMotor);
    bench.pass(5, false, &[]);
    assert!(!bench.motors().armed);
}

#[test]
fn arming_ends_a_motor_test_for_good() {
    let mut bus = topics::Bus::new();
    let mut bench = ready(&mut bus);
    bench.console(Command::TestMotor { motor: 1, duty: 0.2 });
    bench.pass(20, false, &[]);
    assert_eq!(bench.motors().duty[0], 0.2);
    arm(&mut bench);
    bench.console(Command::TestMotor { motor: 2, duty: 0.2 });
    bench.pass(20, false, &[]);
    assert_eq!(bench.motors().duty, [0.0; 8], "armed, without thrust");
    bench.command(GuidedKind::Disarm);
    bench.pass(20, false, &[]);
    assert_eq!((bench.armed(), bench.motors().armed, bench.motors().duty), (false, false, [0.0; 8]));
}

#[test]
fn no_nonsense_turns_a_motor() {
    let mut bus = topics::Bus::new();
    let mut bench = ready(&mut bus);
    for (motor, duty) in [(0, 0.1), (5, 0.1), (9, 0.1), (u32::MAX, 0.1), (1, 0.31), (1, -0.1), (1, f32::NAN)] {
        bench.ends.console.motor_test.publish(bench.now, &MotorTest { motor, duty, until: u64::MAX });
        bench.pass(5, false, &[]);
        assert_eq!((bench.motors().armed, bench.motors().duty), (false, [0.0; 8]), "{motor} {duty}");
    }
}

#[test]
fn no_motor_turns_while_flash_is_written() {
    let mut bus = topics::Bus::new();
    let mut bench = ready(&mut bus);
    bench.ends.storage.storage_busy.publish(bench.now, &StorageBusy { busy: true });
    bench.console(Command::TestMotor { motor: 1, duty: 0.2 });
    bench.pass(20, false, &[]);
    assert!(!bench.motors().armed);
    arm(&mut bench);
    assert!(!bench.motors().armed, "also when the vehicle is armed meanwhile");
    bench.ends.storage.storage_busy.publish(bench.now, &StorageBusy { busy: false });
    bench.pass(5, false, &[]);
    assert!(bench.motors().armed);
}

#[test]
fn a_cut_off_disarms() {
    let mut bus = topics::Bus::new();
    let mut bench = ready(&mut bus);
    arm(&mut bench);
    bench.ends.cutoff.cutoff_state.publish(bench.now, &CutoffState { tripped: true });
    bench.pass(5, false, &[(OLD, false)]);
    assert!(!bench.armed() && !bench.motors().armed);
    bench.ends.cutoff.cutoff_state.publish(bench.now, &CutoffState { tripped: false });
    bench.pass(100, false, &[(OLD, false)]);
    assert_eq!(bench.blocks(), ArmBlocks::CUT_OFF, "to be acknowledged");
    bench.command(GuidedKind::Disarm);
    bench.pass(20, false, &[(OLD, false)]);
    arm(&mut bench);
    bench.pass(100, false, &[(OLD, false)]);
    assert!(bench.armed());
}

#[test]
fn d14_sticks_that_the_background_band_does_not_pass_on_are_a_lost_link() {
    let mut bus = topics::Bus::new();
    let mut bench = ready(&mut bus);
    // With a program beside the pilot, whose signs of life must not fill the queue for its kill.
    bench.pass(200, false, &[(OLD, true)]);
    assert!(bench.armed());
    bench.background = false;
    bench.pass(400, false, &[(OLD, true)]);
    assert!(!bench.newest::<SystemAlert>(Id::system_alert).active.contains(Alerts::COMM_LOST));
    bench.pass(120, false, &[(OLD, true)]);
    assert!(bench.newest::<SystemAlert>(Id::system_alert).active.contains(Alerts::COMM_LOST), "though frames come in");
    bench.command(GuidedKind::Kill);
    bench.pass(5, false, &[(OLD, true)]);
    assert!(!bench.armed(), "a kill gets through");
}

#[test]
fn d9_a_vehicle_whose_aiding_sensors_are_silent_says_which_and_does_not_arm() {
    let mut bus = topics::Bus::new();
    let mut bench = ready(&mut bus);
    bench.aiding = false;
    bench.pass(2_000, false, &[]);
    bench.command(GuidedKind::Arm);
    bench.pass(20, false, &[]);
    let missing = ArmBlocks::NO_RANGE | ArmBlocks::NO_FLOW | ArmBlocks::NO_BARO;
    assert!(!bench.armed() && bench.blocks().contains(missing), "{:?}", bench.blocks());
    let refusals = bench.newest::<ArmRefusals>(Id::arm_refusals);
    assert!(refusals.attempts == 1 && refusals.blocks.contains(missing), "{refusals:?}");
    let range = refusals.check.iter().position(|check| *check == ArmBlocks::NO_RANGE).expect("in the list");
    // Silent for two seconds, of which the first is none.
    assert!((0.9..1.1).contains(&bench.now.since(refusals.since[range]).seconds()), "{refusals:?}");
}

#[test]
fn five_seconds_on_the_button_restart_a_vehicle_that_was_disarmed_all_the_while() {
    let mut bus = topics::Bus::new();
    let mut bench = ready(&mut bus);
    arm(&mut bench);
    // The press stops the motors, and is held on.
    bench.pass(6_000, true, &[(OLD, false)]);
    bench.pass(500, false, &[(OLD, false)]);
    assert!(!bench.armed() && bench.ends.supervisor.restart_request.latest().is_none());
    bench.pass(4_500, true, &[(OLD, false)]);
    assert!(bench.ends.supervisor.restart_request.latest().is_none(), "not yet");
    bench.pass(1_000, true, &[(OLD, false)]);
    assert!(bench.ends.supervisor.restart_request.latest().is_some_and(|request| request.data.requested));
}
