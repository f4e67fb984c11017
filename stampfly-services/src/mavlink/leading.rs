//! Velocities and accelerations that a program sends again and again.
//!
//! A vehicle is asked to fly to places, and knows how fast it may get there. So a velocity is flown
//! as a way-point that moves ahead of the vehicle's path at this velocity, fifty times a second:
//! the path follows at the distance in which it could stop, whatever its limits are. An
//! acceleration changes the velocity at which the way-point moves, from the path's own on. When the
//! program has said nothing for half a second, the vehicle stays where it is, as PX4 and ArduPilot
//! do after half a second and after three.
//!
//! A pilot who takes the sticks, a landing and the failsafe end it. The program has to fall silent
//! before it may begin again: its stream must not take the vehicle back from the pilot.

use crate::access::VehicleAccess;
use crate::refusal::{Refusal, Requester};
use stampfly_types::messages::{
    CommandSource, FlightPhase, FlightStatus, GuidedCommand, GuidedKind, Setpoint, SetpointAxes,
};
use stampfly_types::{Duration, Instant, Vec3, math};

/// A program that was not heard for this long does not lead any more, and a vehicle that does not
/// follow after this long will not.
const SILENCE: Duration = Duration::from_millis(500);
/// The way-point is at most so far ahead, m, and this much farther, s, for the velocity of the
/// path: about what it takes to stop.
const AHEAD: f32 = 0.15;
const TO_STOP: f32 = 0.6;
/// The heading that is wanted is at most so far ahead, rad.
const TURN_AHEAD: f32 = 0.5;
/// The distance in which the path could stop grows with its velocity, so a way-point that gets faster
/// has to run ahead: by this share of what the path is slower than it, and less below this speed,
/// m/s, at which that distance is short.
const RUNS_AHEAD: f32 = 3.0;
const FAST: f32 = 0.4;
/// The velocity that accelerations lead to is at most so far from the path's, m/s. One that far ahead
/// of a path that may not be faster is turned round at the path, which could stop in about this time,
/// s: it brakes when it is asked to.
const FROM_PATH: f32 = 0.25;
const TO_BRAKE: f32 = 0.4;
/// The path may be faster than the way-point by this factor, as fast as it is, and this fast at
/// least, m/s, so that it comes to where a slow one is.
const FASTER: f32 = 1.2;
const SLOWEST: f32 = 0.3;
/// Between two moves of the way-point at most, s.
const LONGEST: f32 = 0.1;

/// How a program wants the vehicle to move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    /// World frame, m/s. An axis without one keeps the velocity that it has.
    pub velocity: [Option<f32>; 3],
    /// World frame, m/s²: how the velocity changes from the instant on at which this was said.
    pub acceleration: [f32; 3],
    /// Down, m: instead of a vertical velocity.
    pub down: Option<f32>,
    /// Heading, rad; `None` keeps it.
    pub yaw: Option<f32>,
    /// Or how fast it turns, rad/s.
    pub yaw_rate: f32,
}

/// How far it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// It has begun.
    Begins,
    /// The vehicle follows.
    Followed,
    /// The vehicle does not follow any more.
    Over,
}

/// A program that leads the vehicle.
#[derive(Clone, Copy, Debug)]
struct Lead<C> {
    client: C,
    requester: Requester,
    motion: Motion,
    /// The way-point, how fast it moves, and the heading there.
    place: Vec3,
    velocity: Vec3,
    yaw: f32,
    begun: Instant,
    heard: Instant,
    moved: Instant,
    stage: Stage,
}

/// The program that leads the vehicle, if one does.
#[derive(Clone, Debug)]
pub(super) struct Leading<C>(Option<Lead<C>>);

/// Why a vehicle is not led.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NotLed {
    Refused(Refusal),
    /// It does not know where it is.
    Nowhere,
    /// It has begun, and the vehicle does not follow.
    NotFollowed,
}

/// The path, of a vehicle that flies along one.
fn path(access: &dyn VehicleAccess) -> Result<Setpoint, NotLed> {
    let (_, setpoint) = access.view().setpoint().ok_or(NotLed::Refused(Refusal::Unsupported))?;
    let place = SetpointAxes::POSITION_XY | SetpointAxes::POSITION_Z;
    if setpoint.axes.contains(place) { Ok(setpoint) } else { Err(NotLed::Nowhere) }
}

fn follows(status: &FlightStatus) -> bool {
    status.phase == FlightPhase::Flying && status.commander == CommandSource::Guided
}

impl<C: Copy + PartialEq> Leading<C> {
    pub const fn new() -> Self {
        Self(None)
    }

    /// Something else was asked of the vehicle.
    pub const fn stop(&mut self) {
        self.0 = None;
    }

    /// A program says how the vehicle is to move. Returns whether it has just begun to.
    pub fn hear(
        &mut self,
        now: Instant,
        client: C,
        requester: Requester,
        motion: &Motion,
        access: &mut dyn VehicleAccess,
    ) -> Result<bool, NotLed> {
        let known = self.0.as_mut().filter(|lead| lead.client == client && now.since(lead.heard) < SILENCE);
        if let Some(lead) = known {
            (lead.motion, lead.heard) = (*motion, now);
            lead.yaw = motion.yaw.unwrap_or(lead.yaw);
            return if lead.stage == Stage::Over { Err(NotLed::NotFollowed) } else { Ok(false) };
        }
        let path = path(access)?;
        let (place, yaw) = (path.position, motion.yaw.unwrap_or(path.yaw));
        let (motion, stage) = (*motion, Stage::Begins);
        let velocity = path.velocity;
        let mut lead =
            Lead { client, requester, motion, place, velocity, yaw, begun: now, heard: now, moved: now, stage };
        lead.move_on(now, &path, access).map_err(NotLed::Refused)?;
        self.0 = Some(lead);
        Ok(true)
    }

    /// Moves the way-point on. Call it about fifty times a second.
    pub fn poll(&mut self, now: Instant, access: &mut dyn VehicleAccess) {
        let Some(lead) = &mut self.0 else { return };
        let is_followed = follows(&access.view().state());
        if now.since(lead.heard) >= SILENCE {
            if is_followed && lead.stage == Stage::Followed {
                let hold = GuidedCommand { kind: GuidedKind::Hold, ..Default::default() };
                _ = access.guide(now, lead.requester, hold);
            }
            self.0 = None;
            return;
        }
        lead.stage = match lead.stage {
            Stage::Over => return,
            _ if is_followed => Stage::Followed,
            Stage::Begins if now.since(lead.begun) < SILENCE => Stage::Begins,
            Stage::Begins | Stage::Followed => Stage::Over,
        };
        if lead.stage == Stage::Followed
            && let Ok(path) = path(access)
        {
            // What there is no room for is said with the next one.
            _ = lead.move_on(now, &path, access);
        }
    }
}

impl<C> Lead<C> {
    fn move_on(&mut self, now: Instant, path: &Setpoint, access: &mut dyn VehicleAccess) -> Result<(), Refusal> {
        let Motion { down, yaw_rate, .. } = self.motion;
        let dt = now.since(self.moved).seconds().min(LONGEST);
        let said = now.since(self.heard).seconds();
        self.moved = now;
        let wanted = self.motion.velocity.into_iter().zip(self.motion.acceleration);
        let lead = self.place.iter_mut().zip(self.velocity.iter_mut());
        for ((wanted, (place, velocity)), (path, path_velocity)) in
            wanted.zip(lead).zip(path.position.iter().zip(path.velocity.iter()))
        {
            let behind = match wanted {
                (Some(said_velocity), acceleration) => {
                    *velocity = said_velocity + acceleration * said;
                    0.0
                }
                (None, acceleration) => {
                    let ahead = (*velocity - path_velocity) * acceleration;
                    if ahead < -0.9 * FROM_PATH * acceleration.abs() {
                        (*velocity, *place) = (*path_velocity, path + path_velocity * TO_BRAKE);
                    }
                    let from_path = *velocity + acceleration * dt - path_velocity;
                    let from_path = from_path.clamp(-FROM_PATH, FROM_PATH);
                    *velocity = path_velocity + from_path;
                    from_path
                }
            };
            // Behind a vehicle that cannot follow, it waits.
            let most = AHEAD + TO_STOP * velocity.abs();
            let runs_ahead = RUNS_AHEAD * (velocity.abs() / FAST).min(1.0);
            let moved = *place + (*velocity + runs_ahead * behind) * dt;
            *place = path + (moved - path).max(-most).min(most);
        }
        let (mut place, velocity) = (self.place, self.velocity);
        if yaw_rate != 0.0 {
            let ahead = math::wrap_angle(self.yaw + yaw_rate * dt - path.yaw);
            self.yaw = math::wrap_angle(path.yaw + ahead.clamp(-TURN_AHEAD, TURN_AHEAD));
        }
        place.z = down.unwrap_or(place.z);
        let speed = (FASTER * velocity.norm()).max(path.velocity.norm()).max(SLOWEST);
        let way_point = GuidedCommand { position: place, yaw: self.yaw, speed, ..Default::default() };
        access.fly_to(now, self.requester, way_point)
    }
}
