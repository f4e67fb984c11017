//! Makes every set-point of the vehicle: take-off, route, sticks, holding, landing.
//!
//! There is one path, and what changes is what moves it. In flight it does not jump, but for the cases below the table:
//!
//! | phase | horizontally | vertically |
//! |---|---|---|
//! | on the ground | follows the estimate | follows the estimate |
//! | take-off | stays over the place of take-off | climbs to the take-off height |
//! | flying, position hold | pilot: sticks are velocities, released it brakes and holds; guided: the route | throttle is climb rate; guided: the route |
//! | flying, altitude hold | follows the estimate, the sticks lean; without a pilot it brakes and holds | throttle is climb rate |
//! | flying, manual | follows the estimate | follows the estimate |
//! | turning over | waits; altitude hold follows the estimate | waits |
//! | landing | brakes and holds, the pilot may steer | sinks at the rate the landing manager asks for |
//!
//! A path that follows the estimate takes its velocity over as well, so switching to position hold at speed brakes
//! instead of pulling back. A vehicle that cannot keep up (wind, a hand) makes the path wait for it; when the pilot centres the
//! sticks meanwhile, the path jumps to the vehicle. When a landing begins, it jumps down to one that something keeps below it.

use crate::autotune::AutotuneAxis;
use stampfly_types::messages::{
    CommandSetpoint, CommandSource, FlightMode, FlightPhase, FlightStatus, FlipDirection, GuidedCommand, GuidedKind,
    LandDetected, Setpoint, SetpointAxes, StateEstimate, Validity, stick,
};
use stampfly_types::{Duration, Instant, Vec3, frame, math};

use super::{Leg, Path, PathLimits, Refusal, Refused, Route, WayPoint};
use crate::bound::within;
use crate::timing::StepTimer;

/// Speeds, heights and tolerances of the [`Navigator`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NavigatorConfig {
    /// Bounds of the path.
    pub limits: PathLimits,
    /// Take-off height when the command names none, m.
    pub take_off_height: f32,
    /// Take-off speed when the command names none, m/s.
    pub take_off_speed: f32,
    /// Way-point speed when the command names none, m/s.
    pub route_speed: f32,
    /// Horizontal speed at full stick, m/s.
    pub stick_speed: f32,
    /// Climb rate at full throttle stick, m/s.
    pub climb_rate: f32,
    /// Rate of descent at full throttle stick down, m/s.
    pub sink_rate: f32,
    /// Rate of turn at full yaw stick, rad/s.
    pub turn_rate: f32,
    /// Sticks and commands keep at least this height over the place of take-off, m.
    pub height_min: f32,
    /// Sticks and commands keep at most this height over the place of take-off, m.
    pub height_max: f32,
    /// A way-point is reached when the path ends there, heading included, and the vehicle is this close, m.
    pub reached: f32,
    /// The path waits when the vehicle is farther away than this, m.
    pub leash: f32,
    /// While landing, the path is at most this far below the vehicle, and no farther above it when that begins, m.
    pub landing_lead: f32,
}

/// A vehicle that follows its path is within this share of the leash.
const FOLLOWS: f32 = 0.5;

impl Default for NavigatorConfig {
    fn default() -> Self {
        Self {
            limits: PathLimits::default(),
            take_off_height: 0.5,
            take_off_speed: 0.4,
            route_speed: 0.5,
            stick_speed: 0.5,
            climb_rate: 0.5,
            sink_rate: 0.4,
            turn_rate: 1.5,
            height_min: 0.2,
            height_max: 3.0,
            reached: 0.15,
            leash: 0.6,
            landing_lead: 0.25,
        }
    }
}

/// All the navigator looks at in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NavigatorInput<'a> {
    /// Flight phase and mode.
    pub flight_status: &'a FlightStatus,
    /// Where the vehicle is.
    pub estimate: &'a StateEstimate,
    /// The rate of descent asked for while landing.
    pub land_detected: &'a LandDetected,
    /// Who commands, and the sticks.
    pub command: &'a CommandSetpoint,
}

/// The navigator.
///
/// ```
/// use stampfly_control::guidance::{Navigator, NavigatorInput};
/// use stampfly_types::messages::*;
/// use stampfly_types::{Duration, Instant, Vec3};
///
/// let mut navigator = Navigator::default();
/// let there = Vec3::new(1.0, 0.0, -0.5);
/// navigator.accept(&GuidedCommand { kind: GuidedKind::WayPoint, position: there, ..Default::default() })?;
///
/// let mut estimate = StateEstimate { valid: Validity::ALL, ..Default::default() };
/// let mode = FlightStatus { phase: FlightPhase::Flying, mode: FlightMode::PosHold, armed: true, ..Default::default() };
/// let command = CommandSetpoint { source: CommandSource::Guided, ..Default::default() };
/// let mut now = Instant::ZERO;
/// let setpoint = loop {
///     let input = NavigatorInput { flight_status: &mode, estimate: &estimate, land_detected: &Default::default(), command: &command };
///     let setpoint = navigator.step(now, &input);
///     if setpoint.arrived {
///         break setpoint;
///     }
///     estimate.position = setpoint.position; // a vehicle that follows perfectly
///     now += Duration::from_micros(2_500);
/// };
/// assert_eq!(setpoint.position, there);
/// assert!(now > Instant::from_secs(2) && now < Instant::from_secs(4));
/// # Ok::<(), stampfly_control::guidance::Refused>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Navigator {
    config: NavigatorConfig,
    timer: StepTimer,
    path: Path,
    route: Route,
    /// The way to the take-off height or to the first way-point, while it is being flown.
    leg: Option<Leg>,
    /// Since when the vehicle has been at the first way-point.
    reached_at: Option<Instant>,
    arrived: bool,
    take_off: GuidedCommand,
    /// Which way to turn over, as it was asked for last.
    flip: Option<FlipDirection>,
    /// Which rate loop to tune; nothing, or one flag.
    autotune: SetpointAxes,
    /// Height reference: where the vehicle last stood.
    ground: f32,
    phase: FlightPhase,
    mode: FlightMode,
    /// The throttle stick has been centred since it got its present meaning.
    throttle_centred: bool,
    position_known: bool,
    /// The sticks moved the path horizontally in the last step, or would have.
    steered: bool,
    refused: u32,
}

impl Default for Navigator {
    fn default() -> Self {
        Self::new(&NavigatorConfig::default())
    }
}

impl Navigator {
    /// A navigator at the origin.
    #[must_use]
    pub fn new(config: &NavigatorConfig) -> Self {
        Self {
            config: *config,
            timer: StepTimer::default(),
            path: Path::at(Vec3::zeros(), 0.0, config.limits),
            route: Route::default(),
            leg: None,
            reached_at: None,
            arrived: false,
            take_off: GuidedCommand::default(),
            flip: None,
            autotune: SetpointAxes::NONE,
            ground: 0.0,
            phase: FlightPhase::Init,
            mode: FlightMode::default(),
            throttle_centred: false,
            position_known: false,
            steered: false,
            refused: 0,
        }
    }

    /// Takes a command in. Those that are about states rather than places (arm, kill) leave the navigator cold.
    ///
    /// # Errors
    /// Gives the command back when the route is full or a number is none; [`Self::refused`] counts them.
    pub fn accept(&mut self, command: &GuidedCommand) -> Result<(), Refused> {
        if command.kind != GuidedKind::None {
            self.autotune = AutotuneAxis::commanded(command.kind).map_or(SetpointAxes::NONE, AutotuneAxis::flag);
        }
        let taken = match command.kind {
            GuidedKind::AutotuneRoll | GuidedKind::AutotunePitch | GuidedKind::AutotuneYaw => Ok(()),
            GuidedKind::None | GuidedKind::Arm | GuidedKind::Disarm | GuidedKind::Kill => Ok(()),
            GuidedKind::FlipLeft | GuidedKind::FlipRight | GuidedKind::FlipForward | GuidedKind::FlipBack => {
                self.flip = command.kind.flip();
                Ok(())
            }
            GuidedKind::TakeOff => self.accept_take_off(command),
            GuidedKind::WayPoint => self.accept_way_point(command),
            GuidedKind::Hold | GuidedKind::Land => {
                self.forget_route();
                Ok(())
            }
        };
        taken.map_err(|reason| {
            self.refused = self.refused.wrapping_add(1);
            Refused { command: *command, reason }
        })
    }

    /// Commands refused since power-on.
    #[must_use]
    pub fn refused(&self) -> u32 {
        self.refused
    }

    /// One step: the set-point of this control period.
    pub fn step(&mut self, now: Instant, input: &NavigatorInput<'_>) -> Setpoint {
        let dt = self.timer.step(now);
        let mode = input.flight_status;
        let entered = mode.phase != self.phase;
        if entered || mode.mode != self.mode {
            self.throttle_centred = false;
        }
        if entered {
            self.leg = None;
            self.reached_at = None;
        }
        let known = input.estimate.valid;
        // A position that comes back after an outage is another one: start from there.
        let position_known = known.contains(Validity::POSITION_XY);
        if position_known && !self.position_known {
            self.path.place_horizontally(&input.estimate.position, &input.estimate.velocity);
            self.leg = None;
        }
        self.position_known = position_known;
        (self.phase, self.mode) = (mode.phase, mode.mode);

        let axes = match mode.phase {
            FlightPhase::Init | FlightPhase::IdleGround | FlightPhase::IdleHeld | FlightPhase::Armed => {
                self.stand(entered, input);
                SetpointAxes::NONE
            }
            FlightPhase::TakeOff => self.take_off(entered, input, dt),
            FlightPhase::Flying => self.fly(now, input, dt) | self.tuning(input),
            FlightPhase::Landing => self.land(entered, input, dt),
            FlightPhase::Flip => self.hold(input, dt),
        };
        Setpoint { remaining: self.route.len() as u32, arrived: self.arrived, ..self.path.setpoint(axes) }
    }

    /// What to tune, while a program has authority: nobody tunes under a pilot's hands.
    fn tuning(&self, input: &NavigatorInput<'_>) -> SetpointAxes {
        if input.flight_status.commander == CommandSource::Guided { self.autotune } else { SetpointAxes::NONE }
    }

    fn accept_take_off(&mut self, command: &GuidedCommand) -> Result<(), Refusal> {
        if !(command.position.z + command.speed).is_finite() {
            return Err(Refusal::NotFinite);
        }
        self.take_off = *command;
        self.arrived = false;
        Ok(())
    }

    fn accept_way_point(&mut self, command: &GuidedCommand) -> Result<(), Refusal> {
        let GuidedCommand { position, yaw, speed, dwell, .. } = *command;
        if !(position.iter().sum::<f32>() + yaw + speed + dwell).is_finite() {
            return Err(Refusal::NotFinite);
        }
        let speed = if speed > 0.0 { speed } else { self.config.route_speed };
        self.route.append(WayPoint { position, yaw, speed, dwell }).map_err(|_| Refusal::Full)?;
        self.arrived = false;
        Ok(())
    }

    fn forget_route(&mut self) {
        self.route.clear();
        self.leg = None;
        self.reached_at = None;
        self.arrived = false;
    }

    /// On the ground or in a hand: wherever the vehicle is, is right.
    fn stand(&mut self, entered: bool, input: &NavigatorInput<'_>) {
        let estimate = input.estimate;
        self.path.place_horizontally(&estimate.position, &Vec3::zeros());
        self.path.place_vertically(estimate.position.z, 0.0);
        self.path.face(frame::yaw(&estimate.attitude));
        self.ground = self.path.position().z;
        // The route of a flight ends with it; one sent before take-off is kept.
        if entered && !input.flight_status.armed {
            self.forget_route();
            self.take_off = GuidedCommand::default();
        }
    }

    fn take_off(&mut self, entered: bool, input: &NavigatorInput<'_>, dt: f32) -> SetpointAxes {
        if entered {
            self.stand(false, input);
        }
        self.steer_heading(input, dt);
        if input.flight_status.mode.is_manual() {
            self.follow_horizontally(input);
            self.follow_vertically(input);
            return SetpointAxes::YAW;
        }
        let goal = self.ground - self.take_off_height();
        let speed = if self.take_off.speed > 0.0 { self.take_off.speed } else { self.config.take_off_speed };
        self.path.sink_to(goal, speed, dt);
        SetpointAxes::POSITION_Z | SetpointAxes::YAW | self.horizontal_axes(input, dt)
    }

    fn take_off_height(&self) -> f32 {
        let asked = -self.take_off.position.z;
        let height = if asked > 0.0 { asked } else { self.config.take_off_height };
        within(height, self.config.height_min, self.config.height_max)
    }

    /// Position hold steers with the sticks or stays; the other modes lean with them, and stay while there is no pilot.
    fn horizontal_axes(&mut self, input: &NavigatorInput<'_>, dt: f32) -> SetpointAxes {
        let piloted = input.command.source == CommandSource::Pilot;
        if !input.flight_status.mode.holds_place() && piloted {
            self.follow_horizontally(input);
            return SetpointAxes::NONE;
        }
        self.drift(input, dt);
        known_horizontally(input)
    }

    fn fly(&mut self, now: Instant, input: &NavigatorInput<'_>, dt: f32) -> SetpointAxes {
        let guided = input.command.source == CommandSource::Guided;
        if !(guided && input.flight_status.mode.holds_place()) {
            // A leg is a plan from where the path was; once something else has moved it, the plan is void.
            self.leg = None;
            self.reached_at = None;
        }
        match input.flight_status.mode {
            FlightMode::Acro | FlightMode::Stabilize => {
                self.steer_heading(input, dt);
                self.follow_horizontally(input);
                self.follow_vertically(input);
                if input.flight_status.mode.commands_rates() {
                    self.path.face(frame::yaw(&input.estimate.attitude));
                    return SetpointAxes::NONE;
                }
                SetpointAxes::YAW
            }
            FlightMode::AltHold => {
                self.steer_heading(input, dt);
                self.climb(input, dt);
                SetpointAxes::POSITION_Z | SetpointAxes::YAW | self.horizontal_axes(input, dt)
            }
            FlightMode::PosHold if guided => {
                self.follow_route(now, input, dt);
                SetpointAxes::POSITION_Z | SetpointAxes::YAW | known_horizontally(input)
            }
            FlightMode::PosHold => {
                self.steer_heading(input, dt);
                self.drift(input, dt);
                self.climb(input, dt);
                SetpointAxes::POSITION_Z | SetpointAxes::YAW | known_horizontally(input)
            }
        }
    }

    fn land(&mut self, entered: bool, input: &NavigatorInput<'_>, dt: f32) -> SetpointAxes {
        if entered {
            self.forget_route();
        }
        // Nothing that lands climbs: not after a path that something kept it from, nor when a range
        // shows that it is lower than it was thought to be.
        let highest = input.estimate.position.z - self.config.landing_lead;
        if self.path.position().z < highest {
            self.path.place_vertically(highest, self.path.velocity().z);
        }
        self.steer_heading(input, dt);
        let rate = input.land_detected.descent_rate;
        self.path.sink(if rate.is_finite() { rate.max(0.0) } else { 0.0 }, dt);
        // Once the ground holds the vehicle, the path must not run away below it.
        let lowest = input.estimate.position.z + self.config.landing_lead;
        if self.path.position().z > lowest {
            self.path.place_vertically(lowest, self.path.velocity().z);
        }
        // In every mode: what lands at a speed that nobody asked for falls over its legs.
        self.drift(input, dt);
        SetpointAxes::POSITION_Z | SetpointAxes::YAW | known_horizontally(input)
    }

    /// While it turns over, the path waits where it was: the vehicle comes back to it. In altitude hold it has drifted, and may stay
    /// where it comes out.
    fn hold(&mut self, input: &NavigatorInput<'_>, dt: f32) -> SetpointAxes {
        if input.flight_status.mode.holds_place() {
            self.path.drift(0.0, 0.0, dt);
        } else {
            self.follow_horizontally(input);
        }
        self.path.sink(0.0, dt);
        self.path.turn_at(0.0, dt);
        let axes = SetpointAxes::POSITION_Z | SetpointAxes::YAW | known_horizontally(input);
        self.flip.map_or(axes, |direction| axes | SetpointAxes::turn_over(direction))
    }

    fn follow_route(&mut self, now: Instant, input: &NavigatorInput<'_>, dt: f32) {
        let Some(way_point) = self.route.first().copied() else {
            self.path.drift(0.0, 0.0, dt);
            self.path.sink(0.0, dt);
            self.path.turn_at(0.0, dt);
            return;
        };
        self.path.turn_to(way_point.yaw, dt);
        if self.strayed(input, self.config.leash) {
            self.path.drift(0.0, 0.0, dt);
            self.path.sink(0.0, dt);
            self.leg = None;
            return;
        }
        let mut goal = way_point.position;
        goal.z = within(goal.z, self.ground - self.config.height_max, self.ground - self.config.height_min);
        let leg = *self.leg.get_or_insert_with(|| self.path.leg_to(goal, way_point.speed));
        self.path.follow(&leg, dt);
        let close = (input.estimate.position - goal).norm() <= self.config.reached;
        if self.path.ends(&leg) && self.path.faces(way_point.yaw) && (close || self.reached_at.is_some()) {
            let since = *self.reached_at.get_or_insert(now);
            if now.since(since) >= Duration::from_seconds(way_point.dwell) {
                self.route.advance();
                self.leg = None;
                self.reached_at = None;
                self.arrived = self.route.is_empty();
            }
        }
    }

    /// Sticks as velocity; at rest or without a pilot, brake and hold.
    fn drift(&mut self, input: &NavigatorInput<'_>, dt: f32) {
        let command = input.command;
        let (mut north, mut east) = (0.0, 0.0);
        let (forward, right) = (stick(command.pitch), stick(command.roll));
        let steered = command.source == CommandSource::Pilot && (forward != 0.0 || right != 0.0);
        let was_steered = core::mem::replace(&mut self.steered, steered);
        if was_steered && !steered && self.strayed(input, FOLLOWS * self.config.leash) {
            // What kept the vehicle from following kept it from where the pilot wanted it: it holds where it is.
            self.follow_horizontally(input);
        } else if steered && !self.strayed(input, self.config.leash) {
            self.forget_route();
            let length = math::sqrt(forward * forward + right * right).max(1.0);
            let speed = self.config.stick_speed / length;
            let (sin, cos) = math::sin_cos(self.path.heading());
            north = speed * (forward * cos - right * sin);
            east = speed * (forward * sin + right * cos);
        }
        self.path.drift(north, east, dt);
    }

    /// Throttle as climb rate, between the lowest and the highest height.
    fn climb(&mut self, input: &NavigatorInput<'_>, dt: f32) {
        let throttle = match input.command.source {
            CommandSource::Pilot => stick(input.command.throttle),
            CommandSource::None | CommandSource::Guided | CommandSource::Failsafe => 0.0,
        };
        // A stick that was pushed before it meant climb must first come back.
        self.throttle_centred |= throttle == 0.0;
        let above = input.estimate.position.z - self.path.position().z;
        let waits = above * throttle > self.config.leash * throttle.abs();
        if throttle == 0.0 || !self.throttle_centred || waits {
            self.path.sink(0.0, dt);
        } else if throttle > 0.0 {
            self.path.sink_to(self.ground - self.config.height_max, throttle * self.config.climb_rate, dt);
        } else {
            self.path.sink_to(self.ground - self.config.height_min, -throttle * self.config.sink_rate, dt);
        }
    }

    fn steer_heading(&mut self, input: &NavigatorInput<'_>, dt: f32) {
        let rate = match input.command.source {
            CommandSource::Pilot => stick(input.command.yaw) * self.config.turn_rate,
            CommandSource::None | CommandSource::Guided | CommandSource::Failsafe => 0.0,
        };
        self.path.turn_at(rate, dt);
    }

    fn follow_horizontally(&mut self, input: &NavigatorInput<'_>) {
        let estimate = input.estimate;
        let known = estimate.valid.contains(Validity::VELOCITY_XY);
        let velocity = if known { estimate.velocity } else { Vec3::zeros() };
        self.path.place_horizontally(&estimate.position, &velocity);
    }

    fn follow_vertically(&mut self, input: &NavigatorInput<'_>) {
        let estimate = input.estimate;
        let known = estimate.valid.contains(Validity::VELOCITY_Z);
        self.path.place_vertically(estimate.position.z, if known { estimate.velocity.z } else { 0.0 });
    }

    /// Is the vehicle farther from the path than this, m?
    fn strayed(&self, input: &NavigatorInput<'_>, leash: f32) -> bool {
        let error = self.path.position() - input.estimate.position;
        self.position_known && error.x * error.x + error.y * error.y > leash * leash
    }
}

/// The best horizontal axes that the estimate can serve.
fn known_horizontally(input: &NavigatorInput<'_>) -> SetpointAxes {
    let valid = input.estimate.valid;
    if valid.contains(Validity::POSITION_XY) {
        SetpointAxes::POSITION_XY
    } else if valid.contains(Validity::VELOCITY_XY) {
        SetpointAxes::VELOCITY_XY
    } else {
        SetpointAxes::NONE
    }
}
