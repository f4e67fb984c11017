//! What takes its time: taking off, landing, moving, turning, turning over.

use crate::access::VehicleAccess;
use crate::refusal::{Refusal, Requester};
use crate::view::View;
use stampfly_link::tello::{TelloAxis, TelloCommand, TelloDirection};
use stampfly_types::messages::{FlightPhase, FlipDirection, GuidedCommand, GuidedKind, SetpointAxes};
use stampfly_types::{Duration, Instant, Vec3, frame, math};

/// Height of a take-off, m: the ecosystem's vehicle's.
const TAKE_OFF: f32 = 0.5;
/// Heights that moves keep within, m, as the ecosystem's vehicle does.
const HEIGHTS: [f32; 2] = [0.2, 2.0];
/// A place is reached within this distance, m, and a heading within this angle, rad.
const NEAR: f32 = 0.12;
const AIMED: f32 = 0.06;
/// A vehicle farther from where it should be than this, m, does not follow it: a move begins where it is.
const FOLLOWS: f32 = 0.5;
/// Turns are flown in parts of at most a quarter: a heading alone does not say which way round.
const QUARTER: f32 = core::f32::consts::FRAC_PI_2;
/// What takes longer has failed. Programs wait seven seconds for most answers and twenty for a
/// take-off; one that waits says nothing else, and is taken for gone after fifteen: it has to be
/// answered before.
const LONGEST: Duration = Duration::from_secs(14);
/// A vehicle that has not armed after this long does not, and one that has not begun to turn over.
const ARMS: Duration = Duration::from_millis(2_500);
const TURNS_OVER: Duration = Duration::from_secs(1);
/// So long a take-off waits until the vehicle may arm: its calibration takes a few seconds after power-on.
const READY: Duration = Duration::from_secs(8);
/// The vehicle has seen a command after this long, and answers for it.
const SEEN: Duration = Duration::from_millis(200);

/// What is going on.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// About to be allowed to turn the motors.
    GettingReady,
    /// Allowed to turn the motors, about to rise.
    Arming,
    Rising,
    Landing,
    Moving {
        goal: Vec3,
    },
    Turning {
        place: Vec3,
        left: f32,
        goal: f32,
    },
    TurningOver {
        begun: bool,
    },
    Stopping,
}

/// What became of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Outcome {
    GoesOn,
    Done,
    Failed(&'static str),
}

/// Something that takes its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Action {
    kind: Kind,
    begun: Instant,
}

fn simple(kind: GuidedKind) -> GuidedCommand {
    GuidedCommand { kind, ..Default::default() }
}

fn said(asked: Result<(), Refusal>) -> Result<(), &'static str> {
    asked.map_err(|refusal| match refusal {
        Refusal::Occupied(_) | Refusal::PilotFlies => "somebody else commands",
        Refusal::Full => "busy",
        Refusal::Range => "out of range",
        Refusal::Armed => "motors are on",
        Refusal::Unsupported => "not supported",
    })
}

impl Action {
    /// Begins it; `None` when it is done at once.
    pub fn begin(
        now: Instant,
        requester: Requester,
        command: TelloCommand,
        speed: f32,
        access: &mut dyn VehicleAccess,
    ) -> Result<Option<Self>, &'static str> {
        let status = access.view().state();
        let flies = status.phase == FlightPhase::Flying;
        let mut guide = |command| said(access.guide(now, requester, command));
        let kind = match command {
            TelloCommand::TakeOff if status.armed => return Err("already in the air"),
            // A program that is used to a Tello knows of no calibration.
            TelloCommand::TakeOff => Kind::GettingReady,
            TelloCommand::Land => {
                guide(simple(GuidedKind::Land))?;
                if !status.armed {
                    return Ok(None);
                }
                Kind::Landing
            }
            TelloCommand::Stop if flies => {
                guide(simple(GuidedKind::Hold))?;
                Kind::Stopping
            }
            TelloCommand::Flip(direction) if flies => {
                guide(simple(match direction {
                    FlipDirection::Left => GuidedKind::FlipLeft,
                    FlipDirection::Right => GuidedKind::FlipRight,
                    FlipDirection::Forward => GuidedKind::FlipForward,
                    FlipDirection::Back => GuidedKind::FlipBack,
                }))?;
                Kind::TurningOver { begun: false }
            }
            TelloCommand::Move { direction, distance } if flies => {
                let along = match direction {
                    TelloDirection::Up => -Vec3::z(),
                    TelloDirection::Down => Vec3::z(),
                    TelloDirection::Left => -Vec3::y(),
                    TelloDirection::Right => Vec3::y(),
                    TelloDirection::Forward => Vec3::x(),
                    TelloDirection::Back => -Vec3::x(),
                };
                return fly(now, requester, along * distance, speed, access).map(Some);
            }
            TelloCommand::Go { offset, speed } if flies => return fly(now, requester, offset, speed, access).map(Some),
            TelloCommand::Rotate { angle } if flies => {
                let (place, heading) = base(&access.view()).ok_or("no attitude")?;
                Kind::Turning { place, left: angle, goal: heading }
            }
            TelloCommand::Autotune { axis, .. } if flies => {
                guide(simple(match axis {
                    TelloAxis::Roll => GuidedKind::AutotuneRoll,
                    TelloAxis::Pitch => GuidedKind::AutotunePitch,
                    TelloAxis::Yaw => GuidedKind::AutotuneYaw,
                }))?;
                return Ok(None);
            }
            TelloCommand::Stop
            | TelloCommand::Flip(_)
            | TelloCommand::Move { .. }
            | TelloCommand::Go { .. }
            | TelloCommand::Rotate { .. }
            | TelloCommand::Autotune { .. } => return Err("not flying"),
            // No camera, no pads, no network of its own.
            _ => return Err("not supported"),
        };
        Ok(Some(Self { kind, begun: now }))
    }

    /// Looks how far it has come.
    pub fn go_on(&mut self, now: Instant, requester: Requester, access: &mut dyn VehicleAccess) -> Outcome {
        let status = access.view().state();
        let Some((_, estimate)) = access.view().estimate() else { return Outcome::GoesOn };
        let age = now.since(self.begun);
        if age >= LONGEST {
            return Outcome::Failed("took too long");
        }
        // Before that, what is seen may be older than the command.
        if age < SEEN {
            return Outcome::GoesOn;
        }
        if !status.armed && !matches!(self.kind, Kind::Landing | Kind::Arming | Kind::GettingReady) {
            return Outcome::Failed("motors are off");
        }
        match &mut self.kind {
            Kind::GettingReady if status.blocks.is_empty() => {
                match said(access.guide(now, requester, simple(GuidedKind::Arm))) {
                    Ok(()) => *self = Self { kind: Kind::Arming, begun: now },
                    Err(why) => return Outcome::Failed(why),
                }
                Outcome::GoesOn
            }
            Kind::GettingReady if age >= READY => Outcome::Failed(status.blocks.names().next().unwrap_or("not ready")),
            Kind::Arming if status.armed => {
                let position = Vec3::new(0.0, 0.0, -TAKE_OFF);
                let rise = GuidedCommand { position, ..simple(GuidedKind::TakeOff) };
                match said(access.guide(now, requester, rise)) {
                    Ok(()) => *self = Self { kind: Kind::Rising, begun: now },
                    Err(why) => return Outcome::Failed(why),
                }
                Outcome::GoesOn
            }
            Kind::Arming if age >= ARMS => Outcome::Failed("motors do not start"),
            Kind::Rising if status.phase == FlightPhase::Flying => Outcome::Done,
            Kind::Landing if !status.armed => Outcome::Done,
            Kind::Stopping => Outcome::Done,
            Kind::Moving { goal } if (estimate.position - *goal).norm() < NEAR => Outcome::Done,
            Kind::TurningOver { begun } => {
                *begun |= status.phase == FlightPhase::Flip;
                match status.phase {
                    FlightPhase::Flip => Outcome::GoesOn,
                    FlightPhase::Flying if *begun => Outcome::Done,
                    FlightPhase::Flying if age < TURNS_OVER => Outcome::GoesOn,
                    _ => Outcome::Failed("no flip now"),
                }
            }
            Kind::Turning { place, left, goal } => {
                if math::wrap_angle(frame::yaw(&estimate.attitude) - *goal).abs() > AIMED {
                    return Outcome::GoesOn;
                }
                if *left == 0.0 {
                    return Outcome::Done;
                }
                let part = left.clamp(-QUARTER, QUARTER);
                (*goal, *left) = (math::wrap_angle(*goal + part), *left - part);
                let turn = GuidedCommand { position: *place, yaw: *goal, ..Default::default() };
                match said(access.fly_to(now, requester, turn)) {
                    Ok(()) => Outcome::GoesOn,
                    Err(why) => Outcome::Failed(why),
                }
            }
            _ => Outcome::GoesOn,
        }
    }
}

/// Place and heading from which a move counts: where the vehicle should be, so that what each move is short of does not add up.
fn base(view: &View<'_>) -> Option<(Vec3, f32)> {
    let (_, estimate) = view.estimate()?;
    let is = (estimate.position, frame::yaw(&estimate.attitude));
    let wanted = SetpointAxes::POSITION_XY | SetpointAxes::POSITION_Z | SetpointAxes::YAW;
    let should = view.setpoint().map(|(_, setpoint)| setpoint).filter(|setpoint| setpoint.axes.contains(wanted));
    let followed = should.filter(|setpoint| (setpoint.position - estimate.position).norm() < FOLLOWS);
    Some(followed.map_or(is, |setpoint| (setpoint.position, setpoint.yaw)))
}

/// Begins a move, given as the vehicle looks.
fn fly(
    now: Instant,
    requester: Requester,
    offset: Vec3,
    speed: f32,
    access: &mut dyn VehicleAccess,
) -> Result<Action, &'static str> {
    let (place, yaw) = base(&access.view()).ok_or("no position")?;
    let goal = place + frame::from_yaw(yaw).transform_vector(&offset);
    let [low, high] = HEIGHTS;
    let goal = Vec3::new(goal.x, goal.y, goal.z.clamp(-high, -low));
    said(access.fly_to(now, requester, GuidedCommand { position: goal, yaw, speed, ..Default::default() }))?;
    Ok(Action { kind: Kind::Moving { goal }, begun: now })
}
