//! A pilot who plays a stick file: brings the vehicle to where the file begins, sends its rows, and
//! lets go of the sticks.
//!
//! | file begins | before it |
//! |---|---|
//! | disarmed | nothing: its time is the vehicle's, from power-on, or from when the vehicle may be armed |
//! | armed, throttle at its lowest | the pilot arms on the ground, in the file's mode |
//! | armed, throttle raised | the pilot arms, takes off, and flies to the height where it begins |
//!
//! There the approach is flown in STABILIZE when the file begins in a manual mode, because a manual
//! mode that is chosen in a mode that holds height waits for the throttle to pass the hover; else
//! in POS_HOLD, or in STABILIZE above the height that the navigator's sticks reach.
//!
//! After the last row the sticks are let go: centred, in the mode of the last row, or in ALT_HOLD
//! after a manual one. Two seconds later the arm switch is turned off, which lands; a landing that
//! has begun is left to itself. A file whose vehicle is disarmed is over when no row turns the arm
//! switch on again.

use super::{ALIVE, PERIOD, Pilot};
use crate::simulation::ground_station::Progress;
use crate::simulation::mission::{Mission, Step};
use stampfly_sim::sticks::{Player, Start, Sticks};
use stampfly_types::messages::{FlightMode, FlightPhase, GuidedCommand, GuidedKind, PilotInput};
use stampfly_types::{Duration, Instant};
use std::vec;

/// Steps of [`mission_around`] that are done while the file is played.
const PLAYS: usize = 2;
/// The approach ends with a hover, s: the vehicle is at rest when the file begins.
const RESTS: f32 = 2.0;
/// POS_HOLD climbs to the navigator's ceiling of 3 m, which holds back already below it.
const HELD_TO: f32 = 2.5;
/// A deflection that names the direction of a flip.
const NAMES: f32 = 0.2;
/// Sticks that were let go stay so for this long before the arm switch is turned off.
const LET_GO: Duration = Duration::from_secs(2);
/// No landing takes longer: the vehicle's own limit is 30 s and the height at 0.15 m/s, and this is
/// for 13 m.
const LANDING: Duration = Duration::from_secs(120);
/// A vehicle that was disarmed is watched for so long, and one that falls for no longer than that.
const DISARMED: Duration = Duration::from_secs(3);
const FALLS: Duration = Duration::from_secs(20);

/// The mission that a stick flight is to whoever watches it: up, the file, and down.
pub(in crate::simulation) fn mission_around(sticks: &Sticks) -> Mission {
    let height = if let Start::Height(height) = sticks.start { height } else { 0.5 };
    let seconds = sticks.length().seconds();
    Mission { steps: vec![Step::Arm, Step::TakeOff { height }, Step::Hover { seconds }, Step::Land] }
}

/// The mode in which the pilot comes to where the file begins.
pub(in crate::simulation) fn approach(sticks: &Sticks) -> FlightMode {
    let first = sticks.flown(sticks.file.first().input.mode);
    match sticks.start {
        Start::PowerOn | Start::Ready | Start::Armed => first,
        Start::Height(height) if first.is_manual() || height > HELD_TO => FlightMode::Stabilize,
        Start::Height(_) => FlightMode::PosHold,
    }
}

impl Pilot<'_> {
    /// Plays the file. With `waits`, two seconds pass between the display's permission and arming.
    pub async fn play(mut self, sticks: &Sticks, waits: bool, progress: &Progress) {
        let power_on = self.radio.clock().now();
        let begins = self.begin(sticks, waits, progress).await.unwrap_or(power_on);
        progress.done.set(PLAYS);
        let last = self.rows(sticks, begins).await;
        progress.done.set(PLAYS + 1);
        self.let_go(&last).await;
        progress.done.set(PLAYS + 2);
        progress.finished.set(true);
        loop {
            self.send().await;
        }
    }

    /// Brings the vehicle to where the file begins, and returns when that is; `None` is power-on.
    async fn begin(&mut self, sticks: &Sticks, waits: bool, progress: &Progress) -> Option<Instant> {
        match sticks.start {
            Start::PowerOn => return None,
            Start::Ready => {
                while !self.may_arm() {
                    self.frame(super::Aim::Stand).await;
                }
            }
            Start::Armed => self.steps(&[Step::Arm], waits, progress).await,
            Start::Height(height) => {
                let steps = [Step::Arm, Step::TakeOff { height }, Step::Hover { seconds: RESTS }];
                self.steps(&steps, waits, progress).await;
            }
        }
        Some(self.radio.clock().now())
    }

    /// Sends the rows, and returns the last frame.
    async fn rows(&mut self, sticks: &Sticks, begins: Instant) -> PilotInput {
        let mut player = Player::new(&sticks.file);
        let (mut asked, mut frames) = (false, 0_u32);
        let (mut was_armed, mut disarmed) = (false, None);
        loop {
            let now = self.radio.clock().now();
            let frame = player.at(now.since(begins));
            self.input = sticks.sent(&frame.input);
            self.send().await;
            let flips = frame.flip.then(|| flip(&frame.input));
            for kind in flips.into_iter().chain(frame.land.then_some(GuidedKind::Land)) {
                self.radio.command(GuidedCommand { kind, ..GuidedCommand::default() });
                asked = true;
            }
            frames += 1;
            if asked && frames.is_multiple_of(ALIVE) {
                self.radio.command(GuidedCommand::default());
            }
            let armed = self.radio.telemetry().armed;
            was_armed |= armed;
            disarmed = disarmed.or(Some(now)).filter(|_| was_armed && !armed);
            if player.is_over() || (!player.arms_again() && disarmed.is_some_and(|since| self.is_down(now, since))) {
                return self.input;
            }
        }
    }

    /// Does a vehicle that has been disarmed since then lie on the ground, or has it fallen for too
    /// long?
    fn is_down(&self, now: Instant, since: Instant) -> bool {
        let time = now.since(since);
        time >= FALLS || (time >= DISARMED && self.world.truth_at(now).contact)
    }

    /// Lets go, and turns the arm switch off.
    async fn let_go(&mut self, last: &PilotInput) {
        let mode = if last.mode.is_manual() { FlightMode::AltHold } else { last.mode };
        self.input = PilotInput { mode, arm: last.arm, kill: last.kill, ..PilotInput::default() };
        let began = self.radio.clock().now();
        while self.radio.telemetry().armed && self.radio.clock().now().since(began) < LANDING {
            // Turned off once more in a landing, the switch would stop the motors.
            let lands = self.radio.telemetry().phase == FlightPhase::Landing;
            self.input.arm &= lands || self.radio.clock().now().since(began) < LET_GO;
            self.send().await;
        }
        self.input.arm = false;
    }

    /// Sends a frame, and waits for the next.
    async fn send(&mut self) {
        let clock = self.radio.clock().clone();
        let now = clock.now();
        self.radio.sticks(&self.input);
        clock.sleep_until(now + PERIOD).await;
    }
}

/// The flip that the sticks point to: the farther one of roll and pitch, forward when both are
/// centred.
fn flip(input: &PilotInput) -> GuidedKind {
    let PilotInput { roll, pitch, .. } = *input;
    if roll.abs() > NAMES && roll.abs() > pitch.abs() {
        if roll > 0.0 { GuidedKind::FlipRight } else { GuidedKind::FlipLeft }
    } else if pitch < -NAMES {
        GuidedKind::FlipBack
    } else {
        GuidedKind::FlipForward
    }
}
