//! The mode machine under any sequence of steps.

use crate::Input;
use stampfly_mode::decision::CUT;
use stampfly_mode::transitions::TABLE;
use stampfly_mode::{ModeConfig, ModeInput, ModeMachine};
use stampfly_types::messages::{
    Alerts, ButtonGesture, CalibrationResult, CommandSource, FlightMode, GroundContact, GuidedKind, LandDetected,
    PilotInput, StateEstimate, Validity,
};
use stampfly_types::{Duration, Instant};

/// Steps: time, pilot's frame, gesture, alert, estimate, and up to three commands. Every step is taken with the commands in
/// two orders.
pub fn mode_machine(data: &[u8]) {
    let mut input = Input(data);
    let mut machine = ModeMachine::new(ModeConfig { flip_height: 1.0, ..ModeConfig::default() });
    let calibration = CalibrationResult { complete: true, ..Default::default() };
    let (mut now, mut frame) = (Instant::ZERO, PilotInput::default());
    while !input.is_empty() {
        now += Duration::from_micros(2_500 * u64::from(input.byte()));
        let [shown, gesture, alert, known] = [input.byte(), input.byte(), input.byte(), input.byte()];
        let pick = |byte: u8, count: usize| usize::from(byte) % count;
        if shown & 0x40 != 0 {
            let [roll, throttle] = [input.number(1.0), input.number(1.0)];
            frame = PilotInput { roll, throttle, ..frame };
        }
        (frame.arm, frame.kill) = (shown & 2 != 0, shown & 4 != 0);
        frame.mode = FlightMode::ALL[pick(shown >> 3, FlightMode::ALL.len())];
        let alerts = match alert {
            0 => Alerts::NONE,
            // Two of them, the same one for some bytes.
            byte => {
                let count = Alerts::EACH.len();
                Alerts::EACH[pick(byte - 1, count)] | Alerts::EACH[pick(byte / 10, count)]
            }
        };
        let estimate = StateEstimate {
            height: if known & 16 != 0 {
                input.number(3.0)
            } else if known & 1 != 0 {
                1.5
            } else {
                0.03
            },
            valid: if known & 2 != 0 { Validity::TILT } else { Validity::ALL },
            ..Default::default()
        };
        let land_detected = LandDetected {
            contact: if known & 1 != 0 { GroundContact::Air } else { GroundContact::Ground },
            takeoff_complete: known & 4 != 0,
            landed: known & 8 != 0,
            ..Default::default()
        };
        let kinds = GuidedKind::ALL;
        let commands: Vec<GuidedKind> = (0..input.byte() % 4).map(|_| kinds[pick(input.byte(), kinds.len())]).collect();
        let step = ModeInput {
            alerts,
            estimate: &estimate,
            calibration: &calibration,
            land_detected: &land_detected,
            pilot: (shown & 1 != 0).then_some((now, &frame)),
            sticks: if known & 32 != 0 { CommandSource::Failsafe } else { machine.state().commander },
            commands: &commands,
            button: (gesture != 0).then(|| ButtonGesture::ALL[pick(gesture, ButtonGesture::ALL.len())]),
            cut_off: known & 64 != 0,
        };
        let (before, was_armed) = (machine.state().phase, machine.state().is_armed());
        let mut other = machine.clone();
        let output = machine.step(now, &step);
        let status = output.flight_status;
        let pressed = was_armed && step.button.is_some_and(|gesture| gesture != ButtonGesture::None);
        let kill = commands.contains(&GuidedKind::Kill)
            || (shown & 1 != 0 && frame.kill)
            || alerts.intersects(CUT)
            || step.cut_off
            || pressed;
        assert!(!kill || !status.armed, "a kill lost in {before:?}: {step:?}");
        assert_eq!(status.armed, machine.state().is_armed(), "motors follow the state");
        let by_table = TABLE.iter().any(|row| row.from == before && row.to == status.phase);
        assert!(before == status.phase || by_table, "{before:?} to {:?}: {step:?}", status.phase);
        let reversed: Vec<_> = commands.iter().rev().copied().collect();
        let reversed = ModeInput { commands: &reversed, ..step };
        assert_eq!(other.step(now, &reversed), output, "the order matters: {commands:?}");
        assert_eq!(other, machine, "and to what is remembered");
    }
}
