//! Which step of a mission it is, and the commands that it takes.
//!
//! One step at a time is asked of the vehicle, and the next one when the first is seen to be done. The runner never insists: when the pilot takes the sticks,
//! another program lands, the failsafe acts or whoever started the mission falls silent, it stops asking, and says why. It can be continued at the same step.

use super::step::{Event, Halt, Step, Steps};
use crate::access::VehicleAccess;
use crate::lease::SILENCE;
use crate::refusal::{Refusal, Requester};
use stampfly_types::messages::{CommandSource, FlightPhase, GuidedCommand, GuidedKind, StateEstimate, Validity};
use stampfly_types::{Duration, Instant, Vec3, frame};

/// So long a command may take to be seen in the vehicle's state.
const SEEN: Duration = Duration::from_millis(500);

/// Where in a step the vehicle is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// Nothing was asked of it yet.
    Begin,
    /// It rises, because the step needs a vehicle that flies.
    Rising(Instant),
    /// It goes there, and has been there since.
    Going(Vec3, Option<Instant>),
    /// It comes down.
    Landing(Instant),
    /// It waits.
    Waiting(Instant),
}

/// What the mission is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Idle,
    Halted,
    Runs(Stage),
    Finished,
}

/// Flies a mission.
///
/// Call [`poll`](Self::poll) about fifty times a second. The steps are the caller's; they must stay the same while it [runs](Self::is_running).
///
/// ```
/// use stampfly_services::mission::Runner;
/// let runner = Runner::new(0.5, 0.25);
/// assert_eq!((runner.current(), runner.is_running(), runner.is_finished()), (0, false, false));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Runner {
    /// Height that it takes off to when the mission does not say one, m.
    take_off_height: f32,
    /// A place is reached within this distance unless the step says another, m.
    reach: f32,
    current: usize,
    state: State,
    requester: Requester,
    heard: Instant,
    speed: f32,
    /// When arming was asked for: programs start a mission before they can have seen that it worked.
    arming: Option<Instant>,
    /// A route of this mission is being flown: a way-point is appended to it.
    routed: bool,
}

impl Runner {
    /// One that is not flying. A mission that does not begin with a take-off takes off to this height, m; a place is reached within
    /// `reach`, m, unless its step says another distance.
    #[must_use]
    pub const fn new(take_off_height: f32, reach: f32) -> Self {
        Self {
            take_off_height,
            reach,
            current: 0,
            state: State::Idle,
            requester: Requester::Console,
            heard: Instant::ZERO,
            speed: 0.0,
            arming: None,
            routed: false,
        }
    }

    /// The step that is flown, or will be when it is started.
    #[must_use]
    pub const fn current(&self) -> usize {
        self.current
    }

    /// Does it ask for anything by itself?
    #[must_use]
    pub const fn is_running(&self) -> bool {
        matches!(self.state, State::Runs(_))
    }

    /// Was it started, and is not over?
    #[must_use]
    pub const fn is_halted(&self) -> bool {
        matches!(self.state, State::Halted)
    }

    /// Is its last step done?
    #[must_use]
    pub const fn is_finished(&self) -> bool {
        matches!(self.state, State::Finished)
    }

    /// Flies from here on with the step at this place, at once if it runs.
    pub fn set_current(&mut self, place: usize) {
        self.current = place;
        match self.state {
            State::Runs(_) => self.begin_step(),
            _ => self.state = State::Idle,
        }
    }

    /// Begins, or goes on where it was halted; from the first step when it was finished.
    ///
    /// # Errors
    /// When the motors are off, or a pilot flies.
    pub fn start(&mut self, now: Instant, requester: Requester, access: &dyn VehicleAccess) -> Result<(), Halt> {
        let status = access.view().state();
        if !status.armed && !self.is_arming(now) {
            return Err(Halt::Disarmed);
        }
        if status.commander == CommandSource::Pilot {
            return Err(Halt::Pilot);
        }
        if self.is_running() {
            return Ok(());
        }
        if self.is_finished() {
            self.current = 0;
        }
        (self.requester, self.heard, self.routed) = (requester, now, false);
        if self.current == 0 {
            self.speed = 0.0;
        }
        self.begin_step();
        Ok(())
    }

    /// The vehicle has been asked to arm, and will be armed in a moment if it can.
    pub const fn arms(&mut self, now: Instant) {
        self.arming = Some(now);
    }

    fn is_arming(&self, now: Instant) -> bool {
        self.arming.is_some_and(|asked| now.since(asked) < SEEN)
    }

    /// Asks for nothing more. Says whether it did before.
    pub fn halt(&mut self) -> bool {
        let was = self.is_running();
        if was {
            self.state = State::Halted;
        }
        was
    }

    /// There is another mission, or none.
    pub fn reset(&mut self) {
        (self.current, self.state) = (0, State::Idle);
    }

    /// A sign of life of whoever sits there.
    pub fn alive(&mut self, now: Instant, requester: Requester) {
        if requester == self.requester {
            self.heard = now;
        }
    }

    fn begin_step(&mut self) {
        self.state = State::Runs(Stage::Begin);
    }

    fn halted(&mut self, why: Halt) -> Option<Event> {
        self.state = State::Halted;
        Some(Event::Halted(why))
    }

    /// Goes on. Call it about fifty times a second.
    pub fn poll(&mut self, now: Instant, access: &mut dyn VehicleAccess, steps: Steps<'_>) -> Option<Event> {
        let State::Runs(stage) = self.state else { return None };
        let Some(step) = steps(self.current) else {
            self.state = State::Finished;
            return Some(Event::Finished);
        };
        let status = access.view().state();
        let lands = matches!(stage, Stage::Landing(_));
        if lands && !status.armed {
            return self.done();
        }
        if !status.armed && self.is_arming(now) {
            return None;
        }
        let why = match status.phase {
            _ if !status.armed => Some(Halt::Disarmed),
            FlightPhase::Landing if !lands => Some(Halt::Landing),
            _ if status.commander == CommandSource::Pilot => Some(Halt::Pilot),
            _ if status.commander == CommandSource::Failsafe => Some(Halt::Failsafe),
            // Asking would be a sign of life that nobody gave: the vehicle's failsafe has to notice the silence.
            _ if now.since(self.heard) >= SILENCE => Some(Halt::Silent),
            _ => None,
        };
        if let Some(why) = why {
            return self.halted(why);
        }
        match self.advance(now, stage, step, access) {
            Ok(true) => self.done(),
            // Tried again with the next call.
            Ok(false) | Err(Refusal::Full) => None,
            Err(refusal) => self.halted(Halt::Refused(refusal)),
        }
    }

    fn done(&mut self) -> Option<Event> {
        let place = self.current;
        self.current = place.saturating_add(1);
        self.begin_step();
        Some(Event::Reached(place))
    }

    /// Asks for what is next in a step. Is the step done?
    fn advance(
        &mut self,
        now: Instant,
        stage: Stage,
        step: Step,
        access: &mut dyn VehicleAccess,
    ) -> Result<bool, Refusal> {
        let phase = access.view().state().phase;
        let flies = matches!(phase, FlightPhase::Flying | FlightPhase::Flip);
        let next = match (stage, step) {
            (Stage::Begin, Step::Speed(speed)) => {
                self.speed = speed;
                return Ok(true);
            }
            (Stage::Begin, Step::Wait(_)) => Stage::Waiting(now),
            (Stage::Waiting(since), Step::Wait(time)) => return Ok(now.since(since) >= time),
            (Stage::Begin, Step::TakeOff(_)) if flies => return Ok(true),
            (Stage::Begin, _) if !flies => {
                let height = if let Step::TakeOff(height) = step { height } else { self.take_off_height };
                if phase == FlightPhase::Armed {
                    let position = Vec3::new(0.0, 0.0, -height);
                    let command = GuidedCommand { kind: GuidedKind::TakeOff, position, ..Default::default() };
                    access.guide(now, self.requester, command)?;
                }
                Stage::Rising(now)
            }
            (Stage::Rising(_), Step::TakeOff(_)) if flies => return Ok(true),
            (Stage::Rising(_), _) if flies => Stage::Begin,
            // The command may have been lost on its way through the queue.
            (Stage::Rising(since), _) if phase == FlightPhase::Armed && now.since(since) >= SEEN => Stage::Begin,
            (Stage::Begin, Step::GoTo { place, yaw, .. }) => {
                self.go_to(now, place, yaw, stay(step), access)?;
                Stage::Going(place, None)
            }
            (Stage::Begin, Step::Land(Some([north, east]))) => {
                let Some(estimate) = usable(access) else { return Ok(false) };
                let place = Vec3::new(north, east, estimate.position.z);
                self.go_to(now, place, None, Duration::ZERO, access)?;
                Stage::Going(place, None)
            }
            (Stage::Begin, Step::Land(None)) => self.land(now, access)?,
            (Stage::Going(place, since), _) => {
                let Some(estimate) = usable(access) else { return Ok(false) };
                let radius =
                    if let Step::GoTo { radius, .. } = step { radius.unwrap_or(self.reach) } else { self.reach };
                let since = since.or(((estimate.position - place).norm() <= radius).then_some(now));
                match (since, step) {
                    (Some(_), Step::Land(_)) => self.land(now, access)?,
                    (Some(_), Step::GoTo { stay: None, .. }) | (None, _) => Stage::Going(place, since),
                    (Some(there), _) if now.since(there) >= stay(step) => return Ok(true),
                    _ => Stage::Going(place, since),
                }
            }
            (Stage::Landing(since), _) if flies && now.since(since) >= SEEN => self.land(now, access)?,
            _ => return Ok(false),
        };
        self.state = State::Runs(next);
        Ok(false)
    }

    fn go_to(
        &mut self,
        now: Instant,
        position: Vec3,
        yaw: Option<f32>,
        stay: Duration,
        access: &mut dyn VehicleAccess,
    ) -> Result<(), Refusal> {
        let present = access.view().estimate().map_or(0.0, |(_, estimate)| frame::yaw(&estimate.attitude));
        let dwell = stay.seconds();
        let yaw = yaw.unwrap_or(present);
        let command = GuidedCommand { kind: GuidedKind::WayPoint, position, yaw, speed: self.speed, dwell };
        // What was asked before the mission is forgotten; then one follows the other without a halt.
        if self.routed {
            access.guide(now, self.requester, command)?;
        } else {
            access.fly_to(now, self.requester, command)?;
        }
        self.routed = true;
        Ok(())
    }

    fn land(&mut self, now: Instant, access: &mut dyn VehicleAccess) -> Result<Stage, Refusal> {
        access.guide(now, self.requester, GuidedCommand { kind: GuidedKind::Land, ..Default::default() })?;
        self.routed = false;
        Ok(Stage::Landing(now))
    }
}

fn stay(step: Step) -> Duration {
    if let Step::GoTo { stay: Some(stay), .. } = step { stay } else { Duration::ZERO }
}

/// The estimate, if its position may be used.
fn usable(access: &dyn VehicleAccess) -> Option<StateEstimate> {
    let position = Validity::POSITION_XY | Validity::POSITION_Z;
    access.view().estimate().map(|(_, estimate)| estimate).filter(|estimate| estimate.valid.contains(position))
}
