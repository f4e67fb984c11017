//! The path manager: a cycle of states, one of which executes whatever mode is current. None of them knows which.
//!
//! | state | what it does |
//! |---|---|
//! | comms with attitude | takes what the estimator says |
//! | comms with telemetry | hands commands, changes of the way-points and the watch's troubles to the [orders](crate::orders) |
//! | sensor fusion | makes of it what stages are told |
//! | mode executor | the one call, [`Selector::execute`] |
//! | coordinate turn, elevation | hands the demand to the autopilot, which flies it at its own rate |
//! | fatal failure | entered when anything fails or a demand would be no number, never left: throttle closed, a gentle turn, a glide |
//!
//! A crash disarms in every one of them.

use crate::Config;
use crate::messages::*;
use crate::modes::{Order, Plane, Report, Seen, report};
use crate::orders::{Circumstances, Orders};
use stampfly_control::fixed_wing::runway::Runway;
use stampfly_mode::stage::Selector;
use stampfly_types::messages::{ArmBlocks, GuidedCommand, GuidedKind, StateEstimate, Validity};
use stampfly_types::text::is_finite;
use stampfly_types::{Duration, Instant, frame, math};

/// Slower than this over the ground, m/s, the course is the nose's.
const MOVES: f32 = 2.0;
/// It stands on its wheels when it has been slow, low and level for this long, s.
const SETTLED: f32 = 0.5;
/// And this long, s, where nothing shows that it is slow.
const RESTED: f32 = 5.0;
/// It is disarmed after a landing when it has stood with its brakes on for this long, s.
const PARKED: f32 = 2.0;
/// After a failure it is down within this time, from the fence's height, and disarmed then.
const DOWN: Duration = Duration::from_secs(120);
/// Without an attitude nothing glides it: it is disarmed after this time. A gap of some samples is glided through.
const GONE: Duration = Duration::from_secs(1);

/// What a cycle is given.
#[derive(Clone, Copy, Debug)]
pub struct Sensed<'a> {
    /// What the estimator says.
    pub estimate: &'a StateEstimate,
    /// The air.
    pub air: &'a AirState,
    /// Where the local frame begins.
    pub home: &'a Home,
    /// What is wrong.
    pub safety: &'a Safety,
    /// Speeds, heights and so on.
    pub config: &'a Config,
    /// What somebody has asked for since the last cycle.
    pub commands: &'a [GuidedCommand],
    /// The same, of the way-points.
    pub edits: &'a [WayPointEdit],
}

/// The states.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum State {
    /// Takes what the estimator says.
    #[default]
    CommsWithAttitude,
    /// Takes commands.
    CommsWithTelemetry,
    /// Makes of both what stages are told.
    SensorFusion,
    /// Executes the current mode.
    ModeExecutor,
    /// Hands over the demand.
    CoordinateTurnElevation,
    /// Something has failed.
    FatalFailure,
}

/// The path manager.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PathManager {
    state: State,
    selector: Selector<Plane>,
    orders: Orders,
    runway: Option<Runway>,
    /// For how long it has been still on its wheels, and stood with its brakes on, s.
    settled: f32,
    parked: f32,
    failed: Option<Instant>,
    /// It has crashed, and nobody has disarmed it since.
    crashed: bool,
    last: Option<Instant>,
    /// Take-offs that were given up, as far as orders know.
    given_up: u32,
    demand: Demand,
    status: PathStatus,
}

impl PathManager {
    /// One whole cycle: what the autopilot is to do.
    pub fn cycle(&mut self, now: Instant, sensed: &Sensed<'_>) -> Demand {
        // Five states, and the one that ends it.
        for _ in 0..5 {
            if self.step(now, sensed) != CycleStatus::InCycle {
                break;
            }
        }
        self.demand
    }

    /// One state.
    pub fn step(&mut self, now: Instant, sensed: &Sensed<'_>) -> CycleStatus {
        // What is no number is not known.
        let (unknown, calm) = (StateEstimate::default(), AirState::default());
        let estimate = if is_finite(sensed.estimate) { sensed.estimate } else { &unknown };
        let sensed = &Sensed { estimate, air: if is_finite(sensed.air) { sensed.air } else { &calm }, ..*sensed };
        self.note_crash(sensed);
        self.state = match self.state {
            State::CommsWithAttitude if is_lost(sensed.safety) && self.orders.armed => State::FatalFailure,
            State::CommsWithAttitude => State::CommsWithTelemetry,
            State::CommsWithTelemetry => {
                let circumstances = Circumstances {
                    position: position(sensed.estimate),
                    may_arm: self.blocks(sensed).is_empty(),
                    on_ground: self.settled > SETTLED,
                };
                sensed.commands.iter().for_each(|command| self.orders.obey(command, &circumstances));
                let origin = sensed.home.origin();
                sensed.edits.iter().for_each(|edit| self.orders.edit(edit, origin.as_ref()));
                let dt = self.last.map_or(0.0, |last| now.since(last).seconds());
                self.orders.overrule(dt, sensed.safety, circumstances.position.is_some(), sensed.config);
                State::SensorFusion
            }
            State::SensorFusion => {
                self.settle(now, sensed);
                State::ModeExecutor
            }
            State::ModeExecutor => self.execute(now, sensed),
            State::CoordinateTurnElevation => State::CommsWithAttitude,
            State::FatalFailure => {
                let stops = |command: &GuidedCommand| matches!(command.kind, GuidedKind::Disarm | GuidedKind::Kill);
                let most = if sensed.safety.troubles.contains(Troubles::ATTITUDE) { GONE } else { DOWN };
                if now.since(*self.failed.get_or_insert(now)) > most || sensed.commands.iter().any(stops) {
                    self.orders.disarm();
                }
                State::FatalFailure
            }
        };
        self.status.cycle = match self.state {
            State::CommsWithAttitude => CycleStatus::CompletedCycle,
            State::FatalFailure => CycleStatus::FailureMode,
            _ => CycleStatus::InCycle,
        };
        if self.state == State::FatalFailure {
            // A wide turn with a closed throttle: it comes down near where it failed, as slowly as it glides.
            self.demand = Demand { bank: 0.15, bank_max: 0.3, pitch: -0.03, ..Demand::default() };
        }
        self.status.cycle
    }

    /// Where it is.
    #[must_use]
    pub const fn state(&self) -> State {
        self.state
    }

    /// Mode, stage, way-points.
    #[must_use]
    pub const fn status(&self) -> &PathStatus {
        &self.status
    }

    /// May the propeller turn?
    #[must_use]
    pub const fn is_armed(&self) -> bool {
        self.orders.armed
    }

    /// Does the watch fly it?
    #[must_use]
    pub const fn is_overruled(&self) -> bool {
        self.orders.failsafe
    }

    /// Why it would not arm.
    #[must_use]
    pub fn blocks(&self, sensed: &Sensed<'_>) -> ArmBlocks {
        let Sensed { estimate, home, safety, .. } = sensed;
        let is_placed =
            home.known && estimate.valid.contains(Validity::TILT | Validity::VELOCITY_Z | Validity::POSITION_Z);
        // One that knows where north is knows where it is, or has no receiver any more; the heading alone comes with the roll.
        let is_lost = estimate.valid.contains(Validity::HEADING) && position(estimate).is_none();
        [
            (ArmBlocks::ESTIMATE, !is_placed || is_lost || safety.troubles.contains(Troubles::HEIGHT)),
            (ArmBlocks::CRASHED, self.crashed || safety.troubles.contains(Troubles::CRASH)),
            (ArmBlocks::ATTITUDE, safety.troubles.contains(Troubles::ATTITUDE)),
            (ArmBlocks::LOW_BATTERY, safety.troubles.contains(Troubles::BATTERY)),
            (ArmBlocks::SENSOR, safety.troubles.contains(Troubles::AIRSPEED)),
        ]
        .iter()
        .fold(ArmBlocks::NONE, |all, (block, holds)| all.set(*block, *holds))
    }

    /// One that has crashed is disarmed in whatever it does. Somebody who disarms it has looked at
    /// it.
    fn note_crash(&mut self, sensed: &Sensed<'_>) {
        if sensed.safety.troubles.contains(Troubles::CRASH) {
            self.crashed |= self.orders.armed;
            self.orders.disarm();
            self.orders.failsafe = false;
        } else if sensed.commands.iter().any(|command| command.kind == GuidedKind::Disarm) {
            self.crashed = false;
        }
    }

    /// Notices the strip, and that it stands.
    fn settle(&mut self, now: Instant, sensed: &Sensed<'_>) {
        let Sensed { estimate, air, config: p, home, .. } = sensed;
        let dt = self.last.map_or(0.0, |last| now.since(last).seconds());
        self.last = Some(now);
        let field = self.runway.map_or(0.0, |strip| strip.height);
        let low = -estimate.position.z - field < 3.0 && estimate.velocity.z.abs() < 0.4;
        let slow = air.airspeed < p.speed.rotation || self.orders.order == Order::Stand;
        // Down without an airspeed: what flies with a closed throttle sinks, and what has not sunk for a while stands.
        let rests = self.orders.order == Order::Down && !air.measured && self.demand.thrust == Thrust::Throttle;
        let pace = if slow { 1.0 } else { SETTLED / RESTED };
        self.settled = if low && (slow || rests) { self.settled + pace * dt } else { 0.0 };
        let speed = estimate.velocity.horizontal().norm();
        let is_slow = speed < 0.5 || !estimate.valid.contains(Validity::VELOCITY_XY);
        let comes_down = matches!(self.orders.order, Order::Land | Order::Down);
        let stands = self.demand.brake && self.demand.on_ground && is_slow && comes_down;
        self.parked = if stands { self.parked + dt } else { 0.0 };
        if self.parked > PARKED {
            self.orders.disarm();
            self.orders.failsafe = false;
        }
        let heading = frame::yaw(&estimate.attitude);
        if self.orders.order == Order::Fly && self.runway.is_none() && estimate.valid.contains(Validity::HEADING) {
            let placed = position(estimate).zip(home.origin());
            self.runway = placed.map(|(here, origin)| Runway::at(&origin, here, -estimate.position.z, heading));
        }
    }

    fn execute(&mut self, now: Instant, sensed: &Sensed<'_>) -> State {
        let Sensed { estimate, air, home, config, .. } = *sensed;
        let [north, east, _] = estimate.velocity.to_array();
        let ground_speed = math::sqrt(north * north + east * east);
        let heading = frame::yaw(&estimate.attitude);
        let seen = Seen {
            config,
            origin: home.origin().unwrap_or_default(),
            runway: self.runway,
            way_points: &self.orders.way_points,
            order: if self.orders.armed { self.orders.order } else { Order::Stand },
            hold: self.orders.hold,
            position: position(estimate),
            height: -estimate.position.z,
            airspeed: air.airspeed,
            is_measured: air.measured,
            wind: air.wind,
            ground_speed,
            course: if ground_speed > MOVES { math::atan2(east, north) } else { heading },
            heading,
            on_ground: self.settled > SETTLED,
        };
        let demand = self.selector.execute(now, &seen);
        let Report { place, way_point, remaining, landings, given_up } = report(&self.selector, &seen);
        if given_up != self.given_up {
            // It is not tried again before somebody arms it again.
            (self.given_up, self.orders.order) = (given_up, Order::Land);
        }
        let Orders { refusal, refused, .. } = self.orders;
        self.status = PathStatus { place, way_point, remaining, landings, refusal, refused, ..self.status };
        match demand {
            Ok(demand) if is_finite(&demand) => {
                self.demand = demand;
                State::CoordinateTurnElevation
            }
            _ => State::FatalFailure,
        }
    }
}

/// Is there nothing to fly by?
fn is_lost(safety: &Safety) -> bool {
    safety.troubles.contains(Troubles::ATTITUDE) || safety.troubles.contains(Troubles::HEIGHT)
}

fn position(estimate: &StateEstimate) -> Option<[f32; 2]> {
    let [north, east, _] = estimate.position.to_array();
    estimate.valid.contains(Validity::POSITION_XY | Validity::HEADING).then_some([north, east])
}
