//! What people see and hear: one table for lights, one for tunes.
//!
//! The status light tells the phase, the two body lights the flight mode, as on the StampFly. Rows of a table are
//! looked at from the top; the first one that applies wins. A vehicle that crashed or whose motors were cut off shows an error
//! until this is acknowledged.

use crate::transitions::is_airborne;
use stampfly_types::messages::{Alerts, ArmBlocks, FlightMode, FlightPhase, FlightStatus, Signal, Tone};
use stampfly_types::{Duration, Instant};

/// How a light shows its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Blink {
    Solid,
    /// One second.
    Slow,
    /// A quarter of a second.
    Fast,
}

type Colour = [u8; 3];

const OFF: Colour = [0, 0, 0];
const WHITE: Colour = [32, 32, 32];
const RED: Colour = [32, 0, 0];
const GREEN: Colour = [0, 32, 0];
const BLUE: Colour = [0, 0, 32];
const CYAN: Colour = [0, 32, 32];
const MAGENTA: Colour = [32, 0, 32];
const ORANGE: Colour = [32, 16, 0];
const LIME: Colour = [16, 32, 0];

/// The signaller.
///
/// ```
/// use stampfly_mode::Signaller;
/// use stampfly_types::{Instant, messages::*};
/// let mut signaller = Signaller::default();
/// let idle = FlightStatus { phase: FlightPhase::IdleGround, ..Default::default() };
/// let shown = signaller.step(Instant::ZERO, &idle, Alerts::NONE);
/// assert!(shown.status[1] > 0 && shown.status[0] == 0, "green: ready");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Signaller {
    last_phase: Option<FlightPhase>,
    last_warning: Option<Instant>,
    was_error: bool,
    was_pairing: bool,
    tone: Tone,
    tone_count: u32,
}

/// What the vehicle should not fly with.
const FAULT: Alerts = Alerts::IMU_LOST
    .with(Alerts::IMU_FAULTY)
    .with(Alerts::ESTIMATE_DIVERGED)
    .with(Alerts::TILT_MISMATCH)
    .with(Alerts::POWER_LOST)
    .with(Alerts::MOTOR_WEAK)
    .with(Alerts::MOTOR_LOST)
    .with(Alerts::MOTOR_RUNS)
    .with(Alerts::NO_LIFT)
    .with(Alerts::FORCE_IMPLAUSIBLE)
    .with(Alerts::ACCEL_FAULTY)
    .with(Alerts::STRUCK)
    .with(Alerts::IMU_NOISY);
/// What a person has to look at before the vehicle flies again.
const ERROR: ArmBlocks = ArmBlocks::CRASHED.with(ArmBlocks::CUT_OFF).with(ArmBlocks::SELF_TEST);
/// A low battery is called out again after this long.
const REPEAT: Duration = Duration::from_secs(10);

impl Signaller {
    /// What to show now; call at about 30 Hz.
    pub fn step(&mut self, now: Instant, mode: &FlightStatus, alerts: Alerts) -> Signal {
        let low = alerts.intersects(Alerts::LOW_BATTERY | Alerts::CRITICAL_BATTERY);
        let error = alerts.intersects(FAULT) || mode.blocks.intersects(ERROR);
        let silent = alerts.contains(Alerts::COMM_LOST);
        if error && !self.was_error && self.last_phase.is_some() {
            (self.was_error, self.last_phase) = (true, Some(mode.phase));
            self.start(Tone::Error);
        } else if self.last_phase != Some(mode.phase) {
            let tone = match (self.last_phase, mode.phase) {
                (None, _) => Tone::Start,
                (Some(FlightPhase::Init), FlightPhase::IdleGround) => Tone::Ready,
                (_, FlightPhase::Armed) => Tone::Arm,
                (Some(FlightPhase::IdleHeld), FlightPhase::IdleGround) => Tone::None,
                (_, FlightPhase::IdleGround) => Tone::Disarm,
                _ => Tone::None,
            };
            self.last_phase = Some(mode.phase);
            self.start(tone);
        } else if mode.pairing && !self.was_pairing {
            self.start(Tone::Pair);
        } else if low && self.last_warning.is_none_or(|at| now.since(at) >= REPEAT) {
            self.last_warning = Some(now);
            self.start(Tone::LowBattery);
        }

        self.was_error &= error;
        self.was_pairing = mode.pairing;

        let status = [
            (error, RED, Blink::Fast),
            (low, CYAN, Blink::Slow),
            (mode.pairing, BLUE, Blink::Fast),
            (mode.phase == FlightPhase::Init, MAGENTA, Blink::Slow),
            // Nobody is heard: a hint while it stands, an alarm while the motors may turn.
            (silent && mode.armed, ORANGE, Blink::Fast),
            (silent && mode.phase == FlightPhase::IdleGround, BLUE, Blink::Solid),
            (mode.phase == FlightPhase::IdleGround, GREEN, Blink::Solid),
            (mode.phase == FlightPhase::IdleHeld, CYAN, Blink::Fast),
            (mode.phase == FlightPhase::Armed, GREEN, Blink::Slow),
            (mode.phase == FlightPhase::TakeOff, WHITE, Blink::Fast),
            (mode.phase == FlightPhase::Flying, GREEN, Blink::Solid),
            (mode.phase == FlightPhase::Landing, ORANGE, Blink::Slow),
            (mode.phase == FlightPhase::Flip, GREEN, Blink::Fast),
        ];
        let in_the_air = is_airborne(mode.phase);
        let rhythm = if in_the_air { Blink::Slow } else { Blink::Solid };
        let body = [
            (low, CYAN, Blink::Fast),
            (mode.phase == FlightPhase::Init, WHITE, Blink::Solid),
            (true, colour(mode.mode), rhythm),
        ];
        Signal { status: first(&status, now), body: first(&body, now), tone: self.tone, tone_count: self.tone_count }
    }

    fn start(&mut self, tone: Tone) {
        if tone != Tone::None {
            self.tone = tone;
            self.tone_count = self.tone_count.wrapping_add(1);
        }
    }
}

/// The colour of a flight mode.
const fn colour(mode: FlightMode) -> Colour {
    match mode {
        FlightMode::Acro => BLUE,
        FlightMode::Stabilize => LIME,
        FlightMode::AltHold => ORANGE,
        FlightMode::PosHold => MAGENTA,
    }
}

fn first(rows: &[(bool, Colour, Blink)], now: Instant) -> Colour {
    let Some((_, colour, blink)) = rows.iter().find(|(applies, ..)| *applies) else { return OFF };
    let on = match blink {
        Blink::Solid => true,
        Blink::Slow => (now.as_micros() / 500_000).is_multiple_of(2),
        Blink::Fast => (now.as_micros() / 125_000).is_multiple_of(2),
    };
    if on { *colour } else { OFF }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_state_shows_something_and_warnings_win() {
        for &phase in FlightPhase::ALL {
            let mode = FlightStatus { phase, ..Default::default() };
            let mut signaller = Signaller::default();
            assert_ne!(signaller.step(Instant::ZERO, &mode, Alerts::NONE).status, OFF, "{phase:?}");
            assert_eq!(signaller.step(Instant::ZERO, &mode, Alerts::LOW_BATTERY).status, CYAN);
            assert_eq!(signaller.step(Instant::ZERO, &mode, Alerts::LOW_BATTERY | Alerts::IMU_LOST).status, RED);
        }
    }

    #[test]
    fn every_phase_that_begins_has_its_tone() {
        use FlightPhase::{Armed, IdleGround, IdleHeld, Init};
        let mut signaller = Signaller::default();
        let mut tones =
            [Init, IdleGround, Armed, IdleGround, IdleHeld, IdleGround].into_iter().zip(0..).map(|(phase, second)| {
                signaller.step(Instant::from_secs(second), &FlightStatus { phase, ..Default::default() }, Alerts::NONE);
                signaller.tone
            });
        let heard = [(); 6].map(|()| tones.next());
        // What is set down or lifted says nothing: the last tone stays.
        let expected = [Tone::Start, Tone::Ready, Tone::Arm, Tone::Disarm, Tone::Disarm, Tone::Disarm];
        assert_eq!(heard, expected.map(Some));
    }

    #[test]
    fn a_vehicle_nobody_flies_waits_in_blue_and_calls_in_the_air() {
        let mut signaller = Signaller::default();
        let mut status = |phase, armed, millis| {
            let mode = FlightStatus { phase, armed, ..Default::default() };
            signaller.step(Instant::from_millis(millis), &mode, Alerts::COMM_LOST).status
        };
        for millis in (0..2_000).step_by(30) {
            assert_eq!(status(FlightPhase::IdleGround, false, millis), BLUE, "it does not blink at {millis}");
        }
        assert_eq!(status(FlightPhase::Init, false, 0), MAGENTA);
        for phase in [FlightPhase::Armed, FlightPhase::TakeOff, FlightPhase::Flying, FlightPhase::Landing] {
            assert_eq!([0, 125].map(|millis| status(phase, true, millis)), [ORANGE, OFF], "{phase:?}");
        }
    }

    #[test]
    fn a_crash_is_an_error_until_it_is_acknowledged() {
        let mut signaller = Signaller::default();
        let mut count = 0;
        let mut shown = |phase, blocks, millis| {
            let status = FlightStatus { phase, blocks, armed: phase == FlightPhase::Flying, ..Default::default() };
            let signal = signaller.step(Instant::from_millis(millis), &status, Alerts::NONE);
            let tone = if signal.tone_count == count { Tone::None } else { signal.tone };
            count = signal.tone_count;
            (signal.status, tone)
        };
        use FlightPhase::{Flying, IdleGround, IdleHeld};
        shown(Flying, ArmBlocks::NONE, 0);
        assert_eq!(shown(IdleGround, ArmBlocks::CRASHED, 1_000), (RED, Tone::Error));
        for (phase, millis) in [(IdleHeld, 2_000), (IdleGround, 3_000)] {
            assert_eq!(shown(phase, ArmBlocks::CRASHED, millis), (RED, Tone::None), "{phase:?}");
        }
        assert_eq!(shown(IdleGround, ArmBlocks::NONE, 4_000), (GREEN, Tone::None), "acknowledged");
        assert_eq!(shown(IdleGround, ArmBlocks::CUT_OFF, 5_000), (RED, Tone::Error));
    }

    #[test]
    fn pairing_is_heard_once() {
        let mut signaller = Signaller::default();
        let idle = FlightStatus { phase: FlightPhase::IdleGround, ..Default::default() };
        let pairing = FlightStatus { pairing: true, ..idle };
        signaller.step(Instant::ZERO, &idle, Alerts::NONE);
        let signals = [1, 2].map(|second| signaller.step(Instant::from_secs(second), &pairing, Alerts::NONE));
        assert_eq!(signals.map(|signal| (signal.tone, signal.tone_count)), [(Tone::Pair, 2); 2]);
    }

    #[test]
    fn faults_are_red() {
        for fault in [Alerts::IMU_LOST, Alerts::ESTIMATE_DIVERGED, Alerts::TILT_MISMATCH, Alerts::POWER_LOST] {
            let mode = FlightStatus { phase: FlightPhase::IdleGround, ..Default::default() };
            assert_eq!(Signaller::default().step(Instant::ZERO, &mode, fault).status, RED, "{fault:?}");
        }
    }

    #[test]
    fn a_warning_repeats_every_ten_seconds() {
        let mut signaller = Signaller::default();
        let mode = FlightStatus { phase: FlightPhase::Flying, ..Default::default() };
        let mut count = 0;
        for second in 0..30 {
            count = signaller.step(Instant::from_secs(second), &mode, Alerts::LOW_BATTERY).tone_count;
        }
        assert_eq!(count, 4, "the start, and three warnings");
    }

    /// Whether a light is on at 0, 125 and 500 ms.
    const SOLID: [bool; 3] = [true, true, true];
    const SLOW: [bool; 3] = [true, true, false];
    const FAST: [bool; 3] = [true, false, true];

    fn shown(status: &FlightStatus, alerts: Alerts) -> [[Colour; 3]; 2] {
        let signals =
            [0, 125, 500].map(|millis| Signaller::default().step(Instant::from_millis(millis), status, alerts));
        [signals.map(|signal| signal.status), signals.map(|signal| signal.body)]
    }

    fn lit(colour: Colour, on: [bool; 3]) -> [Colour; 3] {
        on.map(|on| if on { colour } else { OFF })
    }

    #[test]
    fn every_phase_has_its_light() {
        for (phase, colour, on) in [
            (FlightPhase::Init, MAGENTA, SLOW),
            (FlightPhase::IdleGround, GREEN, SOLID),
            (FlightPhase::IdleHeld, CYAN, FAST),
            (FlightPhase::Armed, GREEN, SLOW),
            (FlightPhase::TakeOff, WHITE, FAST),
            (FlightPhase::Flying, GREEN, SOLID),
            (FlightPhase::Landing, ORANGE, SLOW),
            (FlightPhase::Flip, GREEN, FAST),
        ] {
            let status = FlightStatus { phase, ..Default::default() };
            assert_eq!(shown(&status, Alerts::NONE)[0], lit(colour, on), "{phase:?}");
            let pairing = FlightStatus { pairing: true, ..status };
            assert_eq!(shown(&pairing, Alerts::NONE)[0], lit(BLUE, FAST), "{phase:?}");
        }
        let held = FlightStatus { phase: FlightPhase::IdleHeld, ..Default::default() };
        assert_eq!(shown(&held, Alerts::COMM_LOST)[0], lit(CYAN, FAST), "nobody has to be heard by what is carried");
    }

    #[test]
    fn every_mode_has_its_light_and_it_blinks_in_the_air() {
        for (mode, colour) in [
            (FlightMode::Acro, BLUE),
            (FlightMode::Stabilize, LIME),
            (FlightMode::AltHold, ORANGE),
            (FlightMode::PosHold, MAGENTA),
        ] {
            for (phase, on) in [(FlightPhase::Armed, SOLID), (FlightPhase::Flying, SLOW)] {
                let status = FlightStatus { phase, mode, ..Default::default() };
                assert_eq!(shown(&status, Alerts::NONE)[1], lit(colour, on), "{mode:?}");
                assert_eq!(shown(&status, Alerts::CRITICAL_BATTERY)[1], lit(CYAN, FAST), "{mode:?}");
            }
            let status = FlightStatus { phase: FlightPhase::Init, mode, ..Default::default() };
            assert_eq!(shown(&status, Alerts::NONE)[1], lit(WHITE, SOLID), "{mode:?}");
        }
    }

    #[test]
    fn an_error_at_power_on_is_no_change_and_a_fault_is_called_out() {
        let mut signaller = Signaller::default();
        let status = FlightStatus { phase: FlightPhase::Flying, ..Default::default() };
        let mut tone = |second, alerts| {
            let signal = signaller.step(Instant::from_secs(second), &status, alerts);
            (signal.tone, signal.tone_count)
        };
        assert_eq!(tone(0, Alerts::IMU_NOISY), (Tone::Start, 1));
        assert_eq!(tone(1, Alerts::IMU_NOISY), (Tone::Error, 2));
        assert_eq!(tone(2, Alerts::IMU_NOISY), (Tone::Error, 2), "once");
        assert_eq!(tone(3, Alerts::NONE), (Tone::Error, 2));
        assert_eq!(tone(4, Alerts::IMU_NOISY), (Tone::Error, 3), "again");
    }
}
