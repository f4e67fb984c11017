//! A simulated pilot: flies a mission with the sticks and switches of a transmitter.
//!
//! The pilot sees where the vehicle really is, 0.2 s late, and reads the transmitter's display. What is not seen in time
//! is not corrected, and nothing is done in an emergency: what the vehicle does by itself is what is to be known. But a vehicle that
//! drifts away in POS_HOLD is flown in ALT_HOLD, as anybody would.
//!
//! | mode | sticks |
//! |---|---|
//! | POS_HOLD | velocities; centred within 0.1 m of the place |
//! | ALT_HOLD | lean angles; throttle is climb rate |
//! | STABILIZE | lean angles; throttle is thrust |
//! | ACRO | rates; throttle is thrust |
//!
//! In the modes that hold height, turning the arm switch off lands. In the others the pilot sinks to the ground, pulls the
//! throttle down and turns the switch off. The heading is kept: places in a mission are flown to, headings are not.
//!
//! `tricks` has the steps of a mission that are no places, `sticks` the pilot that replays a stick
//! file, whatever the vehicle does.

mod sticks;
mod tricks;

pub(super) use sticks::{approach, mission_around};

use super::ground_station::Progress;
use super::home::Home;
use super::mission::{LONGEST_LEG, Mission, Step};
use super::radio::Radio;
use super::settings::Settings;
use stampfly_control::CascadeConfig;
use stampfly_control::guidance::NavigatorConfig;
use stampfly_sim::World;
use stampfly_types::messages::{FlightMode, FlightPhase, GuidedCommand, PilotInput};
use stampfly_types::{Duration, Instant, Vec3, frame};
use std::collections::VecDeque;

/// Of the transmitter's frames.
const PERIOD: Duration = Duration::from_millis(20);
/// A program that has asked for something says as often as this that it is still there, frames.
const ALIVE: u32 = 5;
/// Frames until a pilot reacts: 0.2 s, a trained person's reaction to what is seen.
const REACTION: usize = 10;
/// Sticks closer to their centre than this do nothing, as the vehicle's arbitration has it.
const DEAD_BAND: f32 = 0.05;
/// A place is reached within these distances, m: beside and above.
const REACHED: [f32; 2] = [0.25, 0.15];
/// And stays so for this long.
const SETTLED: Duration = Duration::from_millis(500);
/// So far from its place, m, and farther away for so long: POS_HOLD does not hold a position.
const LOST: f32 = 1.5;
const LOST_FOR: Duration = Duration::from_secs(2);
/// A vehicle that goes away from the place to which it is flown, by so much, m, is held by something: the place is given up.
const STRAYS: f32 = 1.0;
/// Longest time to a place in another mode than the one that was asked for.
const BY_SIGHT: Duration = Duration::from_secs(10);
/// Above this nothing touches the ground any more, m.
const CLEAR: f32 = 0.1;
/// What is lower than this, m, and does not sink, m/s, stands: a contact lasts for milliseconds, and nobody sees a centimetre.
const STANDS: f32 = 0.01;
const SINKS: f32 = 0.1;
/// How fast the pilot climbs and sinks, m/s.
const CLIMB: f32 = 0.3;
/// Highest speed to a place, m/s.
const SPEED: f32 = 0.4;

/// How fast the lean that stays over a place is learned, g per metre and second: a quarter of what the loop would bear.
const LEARNS: f32 = 0.02;

/// What the pilot wants.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Aim {
    /// Stand, with the throttle at rest.
    Stand,
    /// Be at this place, world NED of the take-off spot.
    Be(Vec3),
    /// Sink to the ground over this place.
    Sink(Vec3),
    /// Leave the vehicle to itself, sticks centred.
    LetGo,
}

/// What full stick means to this vehicle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meaning {
    navigator: NavigatorConfig,
    lean: f32,
    tilt_rate: f32,
    yaw_rate: f32,
    /// The throttle at which it hovers.
    hover: f32,
}

impl Meaning {
    pub fn new(navigator: &NavigatorConfig, cascade: &CascadeConfig) -> Self {
        Self {
            navigator: *navigator,
            lean: cascade.sticks.lean_max,
            tilt_rate: cascade.sticks.tilt_rate_max,
            yaw_rate: cascade.sticks.yaw_rate_max,
            hover: cascade.altitude.hover_thrust / cascade.altitude.thrust_max,
        }
    }
}

/// What the pilot has seen.
#[derive(Clone, Copy, Debug)]
struct Seen {
    position: Vec3,
    velocity: Vec3,
    yaw: f32,
    /// Where the thrust pushes it, horizontally: forward and right, in units of gravity.
    lean: [f32; 2],
    contact: bool,
}

pub(super) struct Pilot<'b> {
    radio: Radio<'b>,
    world: World,
    home: Home,
    meaning: Meaning,
    past: VecDeque<Seen>,
    input: PilotInput,
    /// What the pilot has learned of the throttle that hovers, share.
    trim: f32,
    /// What the pilot has learned of the lean that stays over a place, forward and right, in units of gravity.
    lean_trim: [f32; 2],
    /// Since when it has been far from its place.
    lost: Option<Instant>,
    settings: Option<Settings<'b>>,
    /// The program beside the pilot has asked for something.
    asked: bool,
    frames: u32,
}

impl<'b> Pilot<'b> {
    pub fn new(radio: Radio<'b>, world: &World, home: Home, meaning: Meaning, mode: FlightMode) -> Self {
        let input = PilotInput { mode, ..PilotInput::default() };
        Self {
            radio,
            world: world.clone(),
            home,
            meaning,
            past: VecDeque::new(),
            input,
            trim: 0.0,
            lean_trim: [0.0; 2],
            lost: None,
            settings: None,
            asked: false,
            frames: 0,
        }
    }

    /// One who can change parameters.
    pub fn with_settings(self, settings: Settings<'b>) -> Self {
        Self { settings: Some(settings), ..self }
    }

    /// Flies the mission. A place that cannot be reached is given up. With `waits`, two seconds pass between the
    /// display's permission and arming.
    pub async fn fly(mut self, mission: &Mission, waits: bool, progress: &Progress) {
        self.steps(&mission.steps, waits, progress).await;
        progress.finished.set(true);
        loop {
            self.frame(Aim::Stand).await;
        }
    }

    async fn steps(&mut self, steps: &[Step], waits: bool, progress: &Progress) {
        let mut place = Vec3::zeros();
        for step in steps {
            match *step {
                Step::Arm => {
                    while !self.may_arm() {
                        self.frame(Aim::Stand).await;
                    }
                    if waits {
                        self.keep(Aim::Stand, Duration::from_secs(2)).await;
                    }
                    while !self.may_arm() {
                        self.frame(Aim::Stand).await;
                    }
                    self.input.arm = true;
                    while !self.radio.telemetry().armed {
                        self.frame(Aim::Stand).await;
                    }
                }
                Step::TakeOff { height } => {
                    place.z = -height;
                    // Where the mode holds height the vehicle climbs by itself, and the pilot keeps it over its
                    // place as soon as it is clear of the ground, on which a lean would tip it over.
                    let mut height = 0.0;
                    while !self.flown().is_manual() && self.radio.telemetry().phase != FlightPhase::Flying {
                        let aim = if height > CLEAR { Aim::Be(place) } else { Aim::LetGo };
                        height = -self.frame_with(aim, Some(0.0)).await.position.z;
                    }
                    self.fly_to(place).await;
                }
                Step::GoTo { place: [north, east, up], dwell, .. } => {
                    place = Vec3::new(north, east, -up);
                    self.fly_to(place).await;
                    self.keep(Aim::Be(place), Duration::from_seconds(dwell)).await;
                }
                Step::Hover { seconds } => self.keep(Aim::Be(place), Duration::from_seconds(seconds)).await,
                Step::Flip { direction } => self.turn_over(direction).await,
                Step::Mode { mode } => self.turn_to(mode, place).await,
                Step::Chop { seconds } => self.chop(seconds).await,
                Step::Set { index, value } => {
                    let now = self.radio.clock().now();
                    // A refusal is seen: the parameter's moment never comes.
                    let _ = self.settings.as_mut().map(|settings| settings.set(now, index, value));
                }
                // No switch of a transmitter asks for it.
                Step::Autotune { .. } => {}
                Step::Land => self.land(place).await,
            }
            progress.done.set(progress.done.get() + 1);
        }
    }

    /// A vehicle that moves away from where it should be does not hold its place, whatever it believes: a pilot then takes the
    /// mode in which it only holds its height.
    fn mistrust(&mut self, place: Vec3, seen: &Seen, now: Instant) {
        let error = (place - seen.position).horizontal();
        let lost = self.flown().holds_place() && error.norm() > LOST && error.dot(&seen.velocity) < 0.0;
        let since = if lost { *self.lost.get_or_insert(now) } else { now };
        self.lost = self.lost.filter(|_| lost);
        if now.since(since) >= LOST_FOR {
            self.input.mode = FlightMode::AltHold;
        }
    }

    /// The mode that the display shows, which a vehicle that has lost a sensor chooses itself.
    fn flown(&mut self) -> FlightMode {
        let frame = self.radio.telemetry();
        if frame.armed { frame.mode } else { self.input.mode }
    }

    fn may_arm(&mut self) -> bool {
        let frame = self.radio.telemetry();
        frame.phase == FlightPhase::IdleGround && frame.blocks.is_empty()
    }

    async fn keep(&mut self, aim: Aim, time: Duration) {
        let until = self.radio.clock().now() + time;
        while self.radio.clock().now() < until {
            self.frame(aim).await;
        }
    }

    async fn fly_to(&mut self, place: Vec3) {
        let began = self.radio.clock().now();
        let mut since = began;
        let mut nearest = f32::MAX;
        loop {
            let seen = self.frame(Aim::Be(place)).await;
            let away = seen.position - place;
            let now = self.radio.clock().now();
            if away.horizontal().norm() > REACHED[0] || away.z.abs() > REACHED[1] {
                since = now;
            }
            nearest = nearest.min(away.norm());
            let strays = away.norm() > nearest + STRAYS;
            let longest = if self.flown() == self.input.mode { LONGEST_LEG } else { BY_SIGHT };
            // A vehicle that is not flying any more goes nowhere.
            if now.since(since) >= SETTLED || now.since(began) >= longest || strays || !self.radio.telemetry().armed {
                return;
            }
        }
    }

    async fn land(&mut self, place: Vec3) {
        if self.flown().is_manual() {
            // A link that was lost for a moment leaves it in a mode that holds its height.
            while !self.frame(Aim::Sink(place)).await.contact
                && self.radio.telemetry().armed
                && self.flown().is_manual()
            {}
            self.keep(Aim::Stand, Duration::from_millis(300)).await;
        }
        self.input.arm = false;
        while self.radio.telemetry().armed {
            let aim = if self.flown() == FlightMode::AltHold { Aim::Be(place) } else { Aim::LetGo };
            self.frame(aim).await;
        }
    }

    /// Looks, sends a frame, and waits for the next.
    async fn frame(&mut self, aim: Aim) -> Seen {
        self.frame_with(aim, None).await
    }

    /// The same, with the throttle stick at this place.
    async fn frame_with(&mut self, aim: Aim, throttle: Option<f32>) -> Seen {
        let now = self.radio.clock().now();
        let seen = self.look(now);
        self.steer(aim, &seen);
        self.input.throttle = throttle.unwrap_or(self.input.throttle);
        self.radio.sticks(&self.input);
        self.frames += 1;
        if self.asked && self.frames.is_multiple_of(ALIVE) {
            self.radio.command(GuidedCommand::default());
        }
        if let Aim::Be(place) | Aim::Sink(place) = aim {
            self.mistrust(place, &seen, now);
        }
        let clock = self.radio.clock().clone();
        clock.sleep_until(now + PERIOD).await;
        seen
    }

    fn look(&mut self, now: Instant) -> Seen {
        let mut truth = self.world.truth_at(now);
        self.home.bring(&mut truth);
        let yaw = frame::yaw(&truth.attitude);
        let up = truth.attitude * Vec3::new(0.0, 0.0, -1.0);
        let ahead = frame::from_yaw(-yaw) * up;
        let seen = Seen {
            position: truth.position,
            velocity: truth.velocity,
            yaw,
            lean: [ahead.x, ahead.y],
            contact: truth.contact || (truth.position.z > -STANDS && truth.velocity.z < SINKS),
        };
        self.past.push_back(seen);
        if self.past.len() > REACTION { self.past.pop_front().unwrap_or(seen) } else { seen }
    }

    fn steer(&mut self, aim: Aim, seen: &Seen) {
        let mode = self.flown();
        let rest = if mode.is_manual() { -1.0 } else { 0.0 };
        let (place, sinks) = match aim {
            Aim::Stand | Aim::LetGo => {
                self.input = PilotInput { roll: 0.0, pitch: 0.0, yaw: 0.0, throttle: rest, ..self.input };
                return;
            }
            Aim::Be(place) => (place, false),
            Aim::Sink(place) => (place, true),
        };
        let error = frame::from_yaw(-seen.yaw) * (place - seen.position);
        let velocity = frame::from_yaw(-seen.yaw) * seen.velocity;
        let limit = |speed: f32, most: f32| speed.clamp(-most, most);

        for (trim, error) in self.lean_trim.iter_mut().zip([error.x, error.y]).filter(|_| !mode.holds_place()) {
            *trim = limit(*trim + LEARNS * PERIOD.seconds() * limit(error, 0.5), 0.2);
        }
        let axes = [
            (error.x, velocity.x, seen.lean[0], self.lean_trim[0]),
            (error.y, velocity.y, seen.lean[1], self.lean_trim[1]),
        ];
        let [pitch, roll] = axes.map(|(error, velocity, lean, trim)| match mode {
            // Within reach the stick is let go: the vehicle holds its place.
            FlightMode::PosHold if error.abs() < 0.1 => 0.0,
            FlightMode::PosHold => limit(0.8 * error, SPEED) / self.meaning.navigator.stick_speed,
            FlightMode::AltHold | FlightMode::Stabilize => {
                // 2 1/s of damping: two fifths of what the reaction time would bear.
                let wanted = 2.0 * (limit(0.7 * error, SPEED) - velocity) / stampfly_types::GRAVITY;
                (wanted + trim) / self.meaning.lean
            }
            FlightMode::Acro => {
                let wanted = 1.5 * (limit(0.6 * error, SPEED) - velocity) / stampfly_types::GRAVITY;
                // 3 1/s: two fifths of what the reaction time would bear, as for the velocity.
                3.0 * (limit(wanted + trim, 0.3) - lean) / self.meaning.tilt_rate
            }
        });
        let turn = if mode.holds_place() { self.meaning.navigator.turn_rate } else { self.meaning.yaw_rate };
        let climb = if sinks { -CLIMB } else { limit(-0.8 * error.z, CLIMB) };
        let throttle = if mode.is_manual() && !sinks && -seen.position.z < CLEAR {
            // Off the ground quickly: what still touches it tips the vehicle over.
            self.meaning.hover + self.trim + 0.14
        } else if mode.is_manual() {
            // 2 1/s of damping, and what is left over is learned in some seconds.
            let wrong = climb + velocity.z;
            self.trim = limit(self.trim + 0.001 * wrong, 0.2);
            (self.meaning.hover + self.trim + 0.12 * wrong).clamp(0.15, 1.0)
        } else if error.z.abs() < 0.06 {
            0.0
        } else if climb > 0.0 {
            climb / self.meaning.navigator.climb_rate
        } else {
            climb / self.meaning.navigator.sink_rate
        };
        let yaw = stick(limit(-seen.yaw, 0.8) / turn);
        self.input =
            PilotInput { roll: stick(roll), pitch: stick(pitch), yaw, throttle: stick(throttle), ..self.input };
    }
}

/// Where a stick is that means this share, beyond the dead band.
fn stick(share: f32) -> f32 {
    let beyond = share.signum() * (DEAD_BAND + (1.0 - DEAD_BAND) * share.abs());
    if share.abs() < 0.001 { 0.0 } else { beyond.clamp(-1.0, 1.0) }
}

/// Names of the flight modes, as options give them.
pub(super) const MODES: &[&str] = &["stabilize", "acro", "althold", "poshold"];

/// The flight mode of this name, as options give it; POS_HOLD when it is empty.
pub(super) fn mode_named(name: &str) -> Option<FlightMode> {
    match name {
        "" | "poshold" => Some(FlightMode::PosHold),
        "althold" => Some(FlightMode::AltHold),
        "stabilize" => Some(FlightMode::Stabilize),
        "acro" => Some(FlightMode::Acro),
        _ => None,
    }
}
