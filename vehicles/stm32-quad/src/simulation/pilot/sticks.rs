//! A pilot who plays a stick file: the arm switch of the file becomes the gestures that this
//! vehicle is armed and disarmed with.
//!
//! The pilot calibrates first, which takes three and a half seconds. A file that begins armed in
//! the air begins where the pilot has flown the vehicle by sight. After the last row the pilot
//! lands it where it is, in ANGLE.

use super::{ARM, DISARM, Pilot, SETTLE, Sticks as Transmitted};
use crate::simulation::is_acro;
use crate::simulation::plant::HOVER;
use stampfly_sim::sight::{LOOK, Progress};
use stampfly_sim::sticks::{Player, Row, Start, StickOptions, Sticks, Throttle};
use stampfly_sim::vehicle::{Options, SetupError};
use stampfly_types::messages::{FlightMode, PilotInput};
use stampfly_types::{Duration, Instant, Vec3};
use std::prelude::v1::*;

/// A gesture is made for this long.
const GESTURE: Duration = Duration::from_millis(300);
/// The approach: longest, and at rest at its place for so long.
const APPROACH: Duration = Duration::from_secs(60);
const RESTS: Duration = Duration::from_secs(2);
/// Away from the place of the approach, m.
const THERE: f32 = 0.3;
/// A landing by sight takes no longer.
const LANDING: Duration = Duration::from_secs(90);
/// A vehicle that was disarmed is watched for so long.
const DISARMED: Duration = Duration::from_secs(3);

/// The stick file that is typed, as far as this vehicle's transmitter has the sticks and switches
/// for it.
pub(in crate::simulation) fn sticks_of(typed: &StickOptions, options: &Options) -> Result<Sticks, SetupError> {
    if options.mission.is_some() || options.pilot.is_some() || options.live.is_some() {
        return Err("--sticks says what is flown: there is neither a mission, nor a pilot, nor another program".into());
    }
    let mode = match typed.mode.as_deref() {
        None => None,
        Some(name) => Some(if is_acro(name)? { FlightMode::Acro } else { FlightMode::Stabilize }),
    };
    // The whole travel of the stick is thrust.
    let throttle = Throttle { rest: -1.0, hover: 2.0 * HOVER - 1.0, of_file: None };
    let sticks = Sticks::new(typed, mode, throttle)?;
    for Row { at, input, flip, land } in sticks.file.rows() {
        let seconds = at.seconds_f64();
        if !sticks.flown(input.mode).is_manual() {
            let has = "this vehicle has stabilize, which is its ANGLE, and acro";
            return Err(format!("--sticks: mode {} at {seconds} s: {has}", name_of(input.mode)));
        }
        let switches = [("flip", *flip), ("kill", input.kill), ("land", *land)];
        if let Some((name, _)) = switches.iter().find(|(_, is_on)| *is_on) {
            return Err(format!("--sticks: {name} at {seconds} s: this vehicle's transmitter has no switch for it"));
        }
    }
    Ok(sticks)
}

fn name_of(mode: FlightMode) -> &'static str {
    stampfly_sim::sticks::MODES.iter().find(|(_, known)| *known == mode).map_or("", |(name, _)| name)
}

/// The sticks of a row as this transmitter has them.
fn transmitted(input: &PilotInput) -> Transmitted {
    let PilotInput { roll, pitch, yaw, throttle, mode, .. } = *input;
    Transmitted { roll, pitch: -pitch, yaw, throttle: 0.5 * (throttle + 1.0), acro: mode.commands_rates() }
}

impl Pilot<'_> {
    /// Plays the file, and lands.
    pub async fn play(mut self, sticks: &Sticks, progress: &Progress) {
        let power_on = self.clock.now();
        self.hold(Transmitted::REST, 1.0).await;
        let ready = self.calibrate().await && self.begin(sticks).await;
        if ready {
            let begins = if sticks.start == Start::PowerOn { power_on } else { self.clock.now() };
            self.rows(sticks, begins).await;
            progress.legs.set(1);
            self.land().await;
        }
        // One whose gesture is not answered puts the transmitter down.
        self.transmitter.set(Transmitted::REST);
        progress.finished.set(true);
    }

    /// Brings the vehicle to where the file begins. Is it there?
    async fn begin(&mut self, sticks: &Sticks) -> bool {
        let height = match sticks.start {
            Start::PowerOn | Start::Ready => return true,
            Start::Armed => None,
            Start::Height(height) => Some(height),
        };
        if !self.gesture(ARM, |lights| lights.armed, 0.2).await {
            return false;
        }
        let Some(height) = height else { return true };
        let place = Vec3::new(0.0, 0.0, -height);
        let (began, mut since) = (self.clock.now(), self.clock.now());
        self.acro = false;
        while self.clock.now().since(since) < RESTS && self.clock.now().since(began) < APPROACH {
            if (self.steer(place, false).await.position - place).norm() > THERE {
                since = self.clock.now();
            }
        }
        true
    }

    async fn rows(&mut self, sticks: &Sticks, begins: Instant) {
        let mut player = Player::new(&sticks.file);
        let mut arm = matches!(sticks.start, Start::Armed | Start::Height(_));
        let mut gesture: Option<(Transmitted, Instant)> = None;
        let (mut was_armed, mut disarmed) = (false, None);
        loop {
            let now = self.clock.now();
            let input = sticks.sent(&player.at(now.since(begins)).input);
            if input.arm != arm {
                arm = input.arm;
                gesture = Some((if arm { ARM } else { DISARM }, now + GESTURE));
            }
            let shown =
                gesture.filter(|(_, until)| now < *until).map_or_else(|| transmitted(&input), |(sticks, _)| sticks);
            self.transmitter.set(shown);
            let armed = self.is_armed();
            was_armed |= armed;
            disarmed = disarmed.or(Some(now)).filter(|_| was_armed && !armed);
            let given_up = disarmed.is_some_and(|since| now.since(since) >= DISARMED);
            if player.is_over() || (given_up && !player.arms_again()) {
                return;
            }
            self.clock.sleep_until(now + LOOK).await;
        }
    }

    /// Down to the ground where it is, and disarmed.
    async fn land(&mut self) {
        self.acro = false;
        let began = self.clock.now();
        let mut place = self.eye.look(began).position;
        while self.is_armed() && self.clock.now().since(began) < LANDING {
            let seen = self.steer(place, true).await;
            place.z = seen.position.z;
            if seen.contact {
                break;
            }
        }
        for sticks in SETTLE.into_iter().filter(|_| self.is_armed()).collect::<Vec<_>>() {
            self.hold(sticks, 0.5).await;
        }
        self.hold(Transmitted::REST, 0.5).await;
        self.hold(DISARM, 0.5).await;
    }

    fn is_armed(&self) -> bool {
        self.lights.is_some_and(|lights| lights.get().armed)
    }
}
