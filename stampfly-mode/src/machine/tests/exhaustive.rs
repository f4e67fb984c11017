//! The machine from outside with everything at once: every phase, up to three commands in every order, gestures, switches and
//! alerts. What the motors do is read from the output stage that flies. The decision itself is explored in
//! `decision/tests.rs`; this is about what stands before and after it.

use super::*;
use crate::state::CUT;
use crate::transitions::is_airborne;
use stampfly_control::{Airframe, Mixed, MotorConfig, MotorStage};
use std::vec::Vec;

const FULL: Mixed = Mixed { thrust: [10.0; 8], count: 8, unmet: [0.0; 4] };

/// What the pilot sends in the step: nothing, switch on, switch off, kill.
const FRAMES: [Option<(bool, bool)>; 4] = [None, Some((true, false)), Some((false, false)), Some((true, true))];

#[test]
fn whatever_comes_in_a_step_motors_turn_only_armed_and_a_kill_stops_them() {
    let gestures: Vec<_> = ButtonGesture::ALL.iter().map(|gesture| Some(*gesture)).chain([None]).collect();
    let alerts: Vec<_> = [Alerts::NONE].iter().chain(Alerts::EACH).copied().collect();
    let mut commands: Vec<[Command; 3]> = Vec::new();
    for a in GuidedKind::ALL {
        for b in GuidedKind::ALL {
            commands.extend(GuidedKind::ALL.iter().map(|c| [*a, *b, *c]));
        }
    }
    let mut motors = MotorStage::new(&MotorConfig::for_airframe(&Airframe::EXAMPLE));
    let (mut now, mut steps, mut turned) = (Instant::ZERO, 0u32, 0u32);
    for &phase in FlightPhase::ALL {
        let (machine, world) = in_phase_or_init(phase);
        for (frame, cut_off) in FRAMES.iter().flat_map(|frame| [false, true].map(|cut_off| (frame, cut_off))) {
            let pilot = frame.map(|(arm, kill)| PilotInput { arm, kill, ..Default::default() });
            for (turn, &button) in gestures.iter().enumerate() {
                for (index, some) in commands.iter().enumerate() {
                    // The sets of commands meet the alerts in turn, and other ones with every gesture.
                    let alert = alerts[(index + turn) % alerts.len()];
                    let mut ordered = *some;
                    ordered.sort_by_key(|kind| *kind as u32);
                    let step = |commands: &[Command]| {
                        let (mut machine, mut world) = (machine.clone(), world.clone());
                        (world.pilot, world.cut_off, world.button, world.alerts) = (pilot, cut_off, button, alert);
                        let output = world.step(&mut machine, commands);
                        (machine, output)
                    };
                    let (after, output) = step(some);
                    let why =
                        || std::format!("{phase:?}: {some:?}, {button:?}, {alert:?}, {pilot:?}, cut-off {cut_off}");
                    now += STEP;
                    let turns = motors
                        .step(now, &FULL, Some(7.4), output.flight_status.armed)
                        .duty
                        .iter()
                        .any(|duty| *duty > 0.0);
                    assert!(!turns || after.state.is_armed(), "motors of a disarmed vehicle: {}", why());
                    let pressed =
                        button.is_some_and(|gesture| gesture != ButtonGesture::None) && machine.state.is_armed();
                    let kill = some.contains(&GuidedKind::Kill)
                        || pilot.is_some_and(|pilot| pilot.kill)
                        || alert.intersects(CUT)
                        || cut_off
                        || pressed;
                    assert!(!kill || !(turns || output.flight_status.armed), "a kill lost: {}", why());
                    let lands = some.contains(&GuidedKind::Land) || some.contains(&GuidedKind::Disarm);
                    if lands && after.state.is_armed() {
                        assert_eq!(output.flight_status.phase, FlightPhase::Landing, "{}", why());
                    }
                    assert!(
                        is_airborne(phase) || !is_airborne(output.flight_status.phase) || phase == FlightPhase::Armed,
                        "{}",
                        why()
                    );
                    if *some != ordered {
                        assert_eq!(step(&ordered), (after, output), "the order matters: {}", why());
                    }
                    (steps, turned) = (steps + 1, turned + u32::from(turns));
                }
            }
        }
    }
    assert!(steps > 500_000 && turned > steps / 50, "{steps}, with motors on {turned}");
}

fn in_phase_or_init(phase: FlightPhase) -> (ModeMachine, World) {
    match phase {
        FlightPhase::Init => {
            (ModeMachine::default(), World { calibration: CalibrationResult::default(), ..World::ready() })
        }
        FlightPhase::Flip => {
            let (mut machine, world) = in_phase(FlightPhase::Flying);
            machine.state.phase = FlightPhase::Flip;
            (machine, world)
        }
        _ => in_phase(phase),
    }
}
