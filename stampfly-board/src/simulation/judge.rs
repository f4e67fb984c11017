//! What came of a flight: how it ended, and whether anything happened that never may.
//!
//! The first line that fits is the end of the flight. *After the fault* is after the first fault began, and the whole of a
//! flight without one; lengths and speeds are the truth's.
//!
//! | end | rule |
//! |---|---|
//! | `refused` | the motors never turned |
//! | `flown-away` | after the fault, 1 m above the highest commanded height, or 5 m beside the commanded path |
//! | `kept-on` | the motors were on at the end |
//! | `cut` | the motors stopped for good within 0.3 s of the fault, or of the first blow of a wall or a ceiling |
//! | `crashed` | after the fault it touched the ground faster than 1 m/s or tilted by more than 20°, or lies so at the end |
//! | `landed` | it began to land, or its motors stopped, before the mission asked for landing; or it was not within 1 m of a place of the mission |
//! | `degraded` | after the fault an alert, another flight mode, 0.15 m above the highest commanded height, or 0.5 m beside the path |
//! | `transparent` | anything else |
//!
//! The commanded path is the mission's, in the world as it was at the start: a set-point that follows a wrong estimate
//! excuses nothing. With a pilot, who holds a place less exactly, the bounds of `transparent` are twice as wide.
//!
//! | invariant | what is checked at every step |
//! |---|---|
//! | `I1` | every duty is a number from 0 to 1 |
//! | `I2` | not armed: every duty is 0 |
//! | `I3` | the vehicle is armed while nothing blocks arming |
//! | `I4` | the estimate's numbers are finite, and its quaternion is a rotation within 1e-4 |
//! | `I5` | phases change as [`transitions`] say |
//! | `I6` | armed, and no command for 520 ms: the alert `COMM_LOST` |
//! | `I7` | no inertial sample for 32.5 ms (25 ms, and three periods): the motors are off |
//! | `I9` | the instants of a topic never go back |
//! | `I10` | 3 s, and 1 s for each 0.3 m of height, after an alert that demands landing: the motors are off |
//! | `I12` | every fault began, and changed something |

use super::mission::{Mission, Step};
use crate::topics::{COUNT, Id};
use serde::Serialize;
use stampfly_flight::newest::message;
use stampfly_mode::transitions;
use stampfly_sim::Truth;
use stampfly_sim::fault::{Class, Injector, Moment};
use stampfly_types::messages::{
    Alerts, FlightMode, FlightPhase, FlightStatus, MotorOutput, StateEstimate, SystemAlert,
};
use stampfly_types::{Duration, FieldKind, Instant, Message, Vec3, frame};
use std::collections::BTreeSet;
use std::string::{String, ToString};
use std::vec::Vec;

/// Above the place where it stood: it has left the ground, m.
const OFF_GROUND: f32 = 0.05;
/// It climbs, m: half way to the lowest take-off height but clear of the ground.
const CLIMBED: f32 = 0.15;
/// Bounds of `flown-away`: above the highest commanded height and beside the path, m.
const AWAY: [f32; 2] = [1.0, 5.0];
/// Bounds of `transparent`, in the same order, m.
const EXACT: [f32; 2] = [0.15, 0.5];
/// It has been at a place of the mission that it came as near as this, m.
const VISITED: f32 = 1.0;
/// A pilot's bounds are this many times as wide.
const PILOT: f32 = 2.0;
/// Motors that stop within this time of a fault were cut.
const CUT: Duration = Duration::from_millis(300);
/// Hardest touch-down that is none of a crash, m/s.
const HARD: f32 = 1.0;
/// Largest tilt of a vehicle that has landed, degrees.
const TILTED: f32 = 20.0;
/// Horizontal speed of a vehicle that flies to another place, m/s.
const MOVES: f32 = 0.25;
/// It hovers after this time in flight.
const HOVERS: Duration = Duration::from_secs(1);
/// 500 ms, and 20 ms to notice.
const COMM_SILENCE: Duration = Duration::from_millis(520);
/// 25 ms, and three periods.
const IMU_SILENCE: Duration = Duration::from_micros(32_500);
/// Of I10.
const LAND_WITHIN: Duration = Duration::from_secs(3);
/// Of I10, m/s.
const LAND_RATE: f32 = 0.3;
/// Motors that were off for so long after a fault stay off; the second is for a vehicle that has not been armed yet, the third
/// for one that still falls.
const OVER: [Duration; 3] = [Duration::from_secs(3), Duration::from_secs(10), Duration::from_secs(30)];

/// An alert's time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AlertSpan {
    /// Its name.
    pub name: &'static str,
    /// When it began, s since power-on.
    pub since: f64,
    /// When it was over; `None` when it was not at the end.
    pub until: Option<f64>,
}

/// A fault of the flight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FaultSpan {
    /// As it was given.
    pub fault: String,
    /// When it began, s since power-on; `None` when its moment never came.
    pub since: Option<f64>,
    /// How often it has changed something.
    pub changes: u64,
}

/// What came of a flight. Serialised into the JSON object that describes it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Judgement {
    /// How it ended; see the [module](self) documentation.
    pub outcome: &'static str,
    /// The worst end that is acceptable.
    pub expected: &'static str,
    /// Is the end no worse than that?
    pub as_expected: bool,
    /// Names of the invariants that did not hold, see the [module](self) documentation.
    pub violations: Vec<&'static str>,
    /// Highest above the place where it stood, m.
    pub max_height_m: f64,
    /// Highest above the highest height commanded until then, after the fault, m; negative below it.
    pub max_above_m: f64,
    /// Farthest beside the commanded path, m.
    pub max_distance_m: f64,
    /// Sink rate at the first touch after the fault, or of the landing, m/s.
    pub touch_speed_mps: Option<f64>,
    /// From the fault until the motors stayed off, s.
    pub cut_after_s: Option<f64>,
    /// Height above the ground there, m.
    pub cut_height_m: Option<f64>,
    /// Alerts, in the order in which they began.
    pub alerts: Vec<AlertSpan>,
    /// Faults, as they were given.
    pub faults: Vec<FaultSpan>,
}

/// What happens beside the bus at an instant.
pub(super) struct Sight<'a> {
    pub now: Instant,
    /// In the vehicle's world.
    pub truth: &'a Truth,
    /// Height above the floor below, 0 when it stands, m.
    pub clearance: f32,
    /// Has it struck a wall or a ceiling?
    pub struck: bool,
    pub status: &'a FlightStatus,
    /// Steps of the mission that are done.
    pub done: usize,
}

#[derive(Clone, Copy)]
struct Touch {
    at: Instant,
    speed: f32,
    tilt: f32,
}

pub(super) struct Judge {
    injector: Injector,
    mission: Mission,
    piloted: bool,
    hover_without_link: Duration,
    violations: BTreeSet<&'static str>,
    last_at: [Option<Instant>; COUNT],
    status: FlightStatus,
    alerts: Alerts,
    spans: Vec<AlertSpan>,
    /// When an alert that demands landing came, and until when the motors must be off.
    must_be_off: Option<Instant>,
    comm_lost_since: Option<Instant>,
    motors_on: bool,
    turned: bool,
    /// The last instant at which the motors stopped, and the height there.
    stopped: Option<(Instant, f32)>,
    start: Option<Instant>,
    last: Option<Truth>,
    /// Above the floor below, m.
    clearance: f32,
    struck: Option<Instant>,
    now: Instant,
    in_air: bool,
    highest: f32,
    above: f32,
    beside: f32,
    /// After the fault.
    away: [f32; 2],
    touches: Vec<Touch>,
    flying_since: Option<Instant>,
    was_landing: bool,
    /// Landing began before the mission asked for it.
    early: bool,
    /// The motors stopped for good before the mission asked for landing.
    stopped_early: bool,
    mode: Option<FlightMode>,
    other_mode: bool,
    new_alert: bool,
    /// Steps of the mission that are done.
    done: usize,
    /// Places of the mission, and has it been there?
    places: Vec<([f32; 2], bool)>,
}

impl Judge {
    pub fn new(injector: &Injector, mission: &Mission, piloted: bool, hover_without_link: Duration) -> Self {
        let places = mission.steps.iter().filter_map(|step| match *step {
            Step::GoTo { place: [north, east, _], .. } => Some(([north, east], false)),
            Step::Arm | Step::TakeOff { .. } | Step::Hover { .. } | Step::Land => None,
        });
        Self {
            injector: injector.clone(),
            mission: mission.clone(),
            piloted,
            hover_without_link,
            violations: BTreeSet::new(),
            last_at: [None; COUNT],
            status: FlightStatus::default(),
            alerts: Alerts::NONE,
            spans: Vec::new(),
            must_be_off: None,
            comm_lost_since: None,
            motors_on: false,
            turned: false,
            stopped: None,
            start: None,
            last: None,
            clearance: 0.0,
            struck: None,
            now: Instant::ZERO,
            in_air: false,
            highest: 0.0,
            above: f32::NEG_INFINITY,
            beside: 0.0,
            away: [f32::NEG_INFINITY; 2],
            touches: Vec::new(),
            flying_since: None,
            was_landing: false,
            early: false,
            stopped_early: false,
            mode: None,
            other_mode: false,
            new_alert: false,
            done: 0,
            places: places.collect(),
        }
    }

    fn require(&mut self, name: &'static str, holds: bool) {
        if !holds {
            self.violations.insert(name);
        }
    }

    /// A sample was published.
    pub fn published(&mut self, id: Id, at: Instant, words: &[u32]) {
        let last = self.last_at.get_mut(id as usize).and_then(|last| last.replace(at));
        self.require("I9", last.is_none_or(|last| last <= at));
        match id {
            Id::actuator_motor => {
                if let Some(output) = message::<MotorOutput>(words) {
                    self.require("I1", output.duty.iter().all(|duty| (0.0..=1.0).contains(duty)));
                    self.require("I2", self.status.armed || output.duty.iter().all(|duty| *duty == 0.0));
                } else {
                    self.require("I1", false);
                }
            }
            Id::estimate_state => {
                let estimate = message::<StateEstimate>(words);
                self.require("I4", estimate.is_some_and(|estimate| is_sound(&estimate, words)));
            }
            Id::flight_status => {
                if let Some(status) = message::<FlightStatus>(words) {
                    self.status_changes(at, &status);
                }
            }
            Id::system_alert => {
                if let Some(alert) = message::<SystemAlert>(words) {
                    self.alerts_change(at, alert.active);
                }
            }
            _ => {}
        }
    }

    fn status_changes(&mut self, at: Instant, status: &FlightStatus) {
        let (from, to) = (self.status.phase, status.phase);
        if from != to {
            let exists = transitions::TABLE.iter().any(|row| row.from == from && row.to == to);
            self.require("I5", exists);
        }
        if status.armed && !self.status.armed {
            self.require("I3", status.blocks.is_empty());
        }
        self.status = *status;
        if to == FlightPhase::Flying {
            self.flying_since = self.flying_since.or(Some(at));
        }
    }

    fn alerts_change(&mut self, at: Instant, active: Alerts) {
        let seconds = at.seconds_f64();
        let after_fault = self.has_begun(at);
        for (name, bit) in names() {
            let (was, is) = (self.alerts.bits() & bit != 0, active.bits() & bit != 0);
            if is && !was {
                self.spans.push(AlertSpan { name, since: seconds, until: None });
                // Before the first command nobody has been heard, and sensors start.
                self.new_alert |= after_fault && (self.turned || self.injector.faults().next().is_some());
            } else if was
                && !is
                && let Some(span) = self.spans.iter_mut().rev().find(|span| span.name == name)
            {
                span.until = Some(seconds);
            }
        }
        self.alerts = active;
        let heard = [Id::command_pilot, Id::command_guided].map(|id| self.last_at.get(id as usize).copied().flatten());
        let heard = heard.into_iter().flatten().max();
        let silent = heard.is_some_and(|heard| at.since(heard) > COMM_SILENCE);
        self.require("I6", !(self.status.armed && silent) || active.contains(Alerts::COMM_LOST));
        self.comm_lost_since =
            active.contains(Alerts::COMM_LOST).then(|| self.comm_lost_since.unwrap_or(at)).filter(|_| self.motors_on);
        let abandoned = self.comm_lost_since.is_some_and(|since| at.since(since) >= self.hover_without_link);
        let lands = abandoned || active.intersects(Alerts::CRITICAL_BATTERY | Alerts::ESTIMATE_DIVERGED);
        self.must_be_off = (lands && self.motors_on).then(|| {
            self.must_be_off.unwrap_or(at + LAND_WITHIN + Duration::from_seconds(self.clearance.max(0.0) / LAND_RATE))
        });
    }

    /// What the motors are given, whoever decides it.
    pub fn motors(&mut self, now: Instant, on: bool) {
        if self.motors_on && !on {
            self.stopped = Some((now, self.clearance));
            self.stopped_early = !self.is_landing_step(self.done);
        }
        if on {
            (self.stopped, self.stopped_early) = (None, false);
        }
        self.turned |= on;
        self.motors_on = on;
    }

    fn has_begun(&self, now: Instant) -> bool {
        self.injector.faults().next().is_none() || self.injector.first_begun(now).is_some()
    }

    /// Looks at the truth, at the control rate.
    pub fn see(&mut self, sight: &Sight<'_>) {
        let Sight { now, truth, clearance, struck, status, done } = *sight;
        self.struck = self.struck.or(struck.then_some(now));
        self.clearance = clearance;
        (self.now, self.done) = (now, done);
        self.start = self.start.or(Some(now));
        let (up, sink) = (height(truth), self.last.map_or(0.0, |last| last.velocity.z));
        let landing = status.phase == FlightPhase::Landing || (self.is_landing_step(done) && status.armed);
        if landing && !self.was_landing {
            self.early |= !self.is_landing_step(done);
        }
        self.was_landing = landing;
        let touches = self.in_air && truth.contact;
        self.in_air = (self.in_air || clearance > OFF_GROUND) && !truth.contact;
        self.tell_moments(now, truth, status, landing, touches);

        let after_fault = self.has_begun(now);
        if touches && (after_fault && self.injector.faults().next().is_some() || landing) {
            let tilt = frame::tilt(&truth.attitude).to_degrees();
            self.touches.push(Touch { at: now, speed: sink.max(0.0), tilt });
        }
        for ([north, east], visited) in &mut self.places {
            let away = truth.position.xy() - Vec3::new(*north, *east, 0.0).xy();
            *visited |= away.norm() < VISITED;
        }
        let (top, beside) = self.commanded(done, truth.position);
        self.highest = self.highest.max(up);
        self.beside = self.beside.max(beside);
        if after_fault {
            self.above = self.above.max(up - top);
            self.away = [self.away[0].max(up - top), self.away[1].max(beside)];
        }
        if status.phase == FlightPhase::Flying {
            let mode = *self.mode.get_or_insert(status.mode);
            self.other_mode |= after_fault && mode != status.mode;
        }
        let imu = self.last_at.get(Id::sensor_imu as usize).copied().flatten();
        self.require("I7", !self.motors_on || imu.is_none_or(|imu| now.since(imu) <= IMU_SILENCE));
        self.require("I10", !self.motors_on || self.must_be_off.is_none_or(|until| now <= until));
        self.last = Some(*truth);
    }

    fn tell_moments(&self, now: Instant, truth: &Truth, status: &FlightStatus, landing: bool, touches: bool) {
        let flying = status.phase == FlightPhase::Flying;
        let hovers = flying && self.flying_since.is_some_and(|since| now.since(since) >= HOVERS);
        let moments = [
            (Moment::Ground, status.phase == FlightPhase::IdleGround && status.blocks.is_empty()),
            (Moment::Spool, self.motors_on),
            (Moment::TakeOff, self.clearance > CLIMBED),
            (Moment::Hover, hovers),
            (Moment::Move, hovers && truth.velocity.xy().norm() > MOVES),
            (Moment::Landing, landing && self.in_air && truth.velocity.z > 0.1),
            (Moment::Touch, landing && touches),
        ];
        for (moment, _) in moments.iter().filter(|(_, has_come)| *has_come) {
            self.injector.reached(*moment, now);
        }
    }

    fn is_landing_step(&self, done: usize) -> bool {
        self.mission.steps.get(done).is_none_or(|step| *step == Step::Land)
    }

    /// The highest height commanded until this step, and the distance of a place from the path until there.
    fn commanded(&self, done: usize, place: Vec3) -> (f32, f32) {
        let (mut top, mut corner) = (0.0_f32, [0.0, 0.0]);
        let mut beside = place.xy().norm();
        for step in self.mission.steps.iter().take(done + 1) {
            match *step {
                Step::TakeOff { height } => top = top.max(height),
                Step::GoTo { place: [north, east, up], .. } => {
                    top = top.max(up);
                    beside = beside.min(distance([place.x, place.y], corner, [north, east]));
                    corner = [north, east];
                }
                Step::Arm | Step::Hover { .. } | Step::Land => {}
            }
        }
        (top, beside)
    }

    /// Is there nothing more to come of a fault? The motors are off, and whoever commands waits for something else.
    pub fn is_over(&self, now: Instant) -> bool {
        let Some(begun) = self.injector.first_begun(now) else { return false };
        let since = self.stopped.map_or(begun, |(at, _)| at.max(begun));
        let [off, idle, fallen] = OVER;
        let in_air = self.last.is_some_and(|truth| !truth.contact);
        let enough = if !self.turned {
            idle
        } else if in_air {
            fallen
        } else {
            off
        };
        !self.motors_on && now.since(since) >= enough
    }

    pub fn finish(mut self) -> Judgement {
        let begun = self.injector.first_begun(self.now);
        let count = self.injector.faults().count();
        let faults: Vec<_> = self
            .injector
            .faults()
            .enumerate()
            .map(|(place, fault)| FaultSpan {
                fault: fault.to_string(),
                since: self.injector.begins(place).filter(|since| *since <= self.now).map(Instant::seconds_f64),
                changes: self.injector.changes(place),
            })
            .collect();
        self.require("I12", faults.iter().all(|span| span.since.is_some() && span.changes > 0));
        let expected = self.injector.faults().map(|fault| fault.expected()).max().unwrap_or(Class::Transparent);
        let outcome = self.class(begun);
        // Motors that were off already stayed off from the beginning of the fault.
        let stopped = if self.turned { self.stopped } else { Some((self.now, 0.0)) };
        let stopped = begun.zip(stopped).map(|(begun, (at, height))| {
            let at = if self.turned { at } else { begun };
            (at.since(begun).seconds_f64(), f64::from(height.max(0.0)))
        });
        let touch = self.touches.iter().find(|touch| begun.is_none_or(|begun| touch.at >= begun));
        Judgement {
            outcome: outcome.name(),
            expected: expected.name(),
            as_expected: outcome.is_within(expected) && (count > 0 || outcome != Class::Refused),
            violations: self.violations.iter().copied().collect(),
            max_height_m: self.highest.into(),
            max_above_m: if self.above.is_finite() { self.above.into() } else { 0.0 },
            max_distance_m: self.beside.into(),
            touch_speed_mps: touch.map(|touch| touch.speed.into()),
            cut_after_s: stopped.map(|(after, _)| after),
            cut_height_m: stopped.map(|(_, height)| height),
            alerts: self.spans,
            faults,
        }
    }

    /// By the table of the [module](self) documentation.
    fn class(&self, begun: Option<Instant>) -> Class {
        let [above, beside] = self.away;
        let wide = if self.piloted { PILOT } else { 1.0 };
        let from = begun.or(self.start).unwrap_or(self.now);
        let hard = |touch: &Touch| touch.at >= from && (touch.speed > HARD || touch.tilt > TILTED);
        let lies = self.last.is_some_and(|truth| truth.contact && frame::tilt(&truth.attitude).to_degrees() > TILTED);
        let at_once = |from: Option<Instant>, at: Instant| from.is_some_and(|from| at >= from && at.since(from) <= CUT);
        if !self.turned {
            Class::Refused
        } else if above > AWAY[0] || beside > AWAY[1] {
            Class::FlownAway
        } else if self.motors_on {
            Class::KeptOn
        } else if self.stopped.is_some_and(|(at, _)| at_once(begun, at) || at_once(self.struck, at)) {
            Class::Cut
        } else if lies || self.touches.iter().any(hard) {
            Class::Crashed
        } else if self.early || self.stopped_early || self.places.iter().any(|(_, visited)| !visited) {
            Class::Landed
        } else if self.new_alert || self.other_mode || above > wide * EXACT[0] || beside > wide * EXACT[1] {
            Class::Degraded
        } else {
            Class::Transparent
        }
    }
}

fn height(truth: &Truth) -> f32 {
    -truth.position.z
}

/// Finite numbers, and a rotation.
fn is_sound(estimate: &StateEstimate, words: &[u32]) -> bool {
    let fields = StateEstimate::FIELDS.iter().scan(0, |next, field| {
        let start = *next;
        *next += field.words;
        Some((start, field))
    });
    let mut numbers = fields
        .filter(|(_, field)| field.kind == FieldKind::F32)
        .flat_map(|(start, field)| words.get(start..start + field.words).unwrap_or_default());
    numbers.all(|word| f32::from_bits(*word).is_finite()) && (estimate.attitude.into_inner().norm() - 1.0).abs() <= 1e-4
}

/// Every alert with its bit.
fn names() -> impl Iterator<Item = (&'static str, u32)> {
    let names = SystemAlert::FIELDS.first().map(|field| field.kind);
    let names = if let Some(FieldKind::Flags(names)) = names { names } else { &[] };
    names.iter().copied()
}

/// Distance of a place from a leg.
fn distance([x, y]: [f32; 2], [from_x, from_y]: [f32; 2], [to_x, to_y]: [f32; 2]) -> f32 {
    let (leg_x, leg_y) = (to_x - from_x, to_y - from_y);
    let square = leg_x * leg_x + leg_y * leg_y;
    let along = if square > 0.0 { ((x - from_x) * leg_x + (y - from_y) * leg_y) / square } else { 0.0 };
    let along = along.clamp(0.0, 1.0);
    let (dx, dy) = (x - from_x - along * leg_x, y - from_y - along * leg_y);
    stampfly_types::math::sqrt(dx * dx + dy * dy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::faults::FAULTS;
    use stampfly_sim::fault::Fault;
    use stampfly_types::messages::{ArmBlocks, ImuData};

    fn judge(faults: &[&str]) -> Judge {
        let faults: Vec<_> = faults.iter().filter_map(|text| Fault::parse(text, FAULTS).ok()).collect();
        let injector = Injector::new(Instant::ZERO, &faults);
        let mission = Mission::parse("arm\ntakeoff 0.5\ngoto 1 0 0.8\nland\n").expect("a mission");
        Judge::new(&injector, &mission, false, Duration::from_secs(3))
    }

    fn publish(judge: &mut Judge, id: Id, at: Instant, message: &impl Message) {
        judge.published(id, at, message.to_words().as_ref());
    }

    fn status(phase: FlightPhase) -> FlightStatus {
        FlightStatus { phase, armed: transitions::is_armed(phase), mode: FlightMode::PosHold, ..Default::default() }
    }

    /// Shows the judge a vehicle at this height, with this sink rate.
    fn show(judge: &mut Judge, now: Instant, phase: FlightPhase, (up, sink): (f32, f32), done: usize) {
        let truth = Truth {
            position: Vec3::new(0.0, 0.0, -up),
            velocity: Vec3::new(0.0, 0.0, sink),
            contact: up <= 0.0,
            ..Default::default()
        };
        judge.see(&Sight { now, truth: &truth, clearance: up, struck: false, status: &status(phase), done });
    }

    #[test]
    fn every_invariant_of_a_topic_can_fail() {
        let armed = status(FlightPhase::Armed);
        let duties = |duty: f32| MotorOutput { duty: [duty; 8], count: 4, ..Default::default() };
        let violated = |messages: &mut dyn FnMut(&mut Judge)| {
            let mut judge = judge(&[]);
            messages(&mut judge);
            judge.violations.into_iter().collect::<Vec<_>>()
        };
        let at = Instant::from_secs;
        assert_eq!(violated(&mut |_| {}), Vec::<&str>::new());
        for duty in [f32::NAN, -0.1, 1.1] {
            let mut broken = |judge: &mut Judge| {
                judge.status = armed;
                publish(judge, Id::actuator_motor, at(2), &duties(duty));
            };
            assert_eq!(violated(&mut broken), ["I1"]);
        }
        assert_eq!(violated(&mut |judge| publish(judge, Id::actuator_motor, at(1), &duties(0.5))), ["I2"]);
        let blocked = FlightStatus { blocks: ArmBlocks::LOW_BATTERY, ..armed };
        let mut arms = |judge: &mut Judge| {
            judge.status = status(FlightPhase::IdleGround);
            publish(judge, Id::flight_status, at(1), &blocked);
        };
        assert_eq!(violated(&mut arms), ["I3"]);
        let lost = StateEstimate { velocity: Vec3::new(f32::INFINITY, 0.0, 0.0), ..Default::default() };
        assert_eq!(violated(&mut |judge| publish(judge, Id::estimate_state, at(1), &lost)), ["I4"]);
        let mut jumps = |judge: &mut Judge| publish(judge, Id::flight_status, at(1), &status(FlightPhase::Flying));
        assert_eq!(violated(&mut jumps), ["I5"]);
        let mut silent = |judge: &mut Judge| {
            judge.status = armed;
            publish(judge, Id::command_pilot, at(1), &stampfly_types::messages::PilotInput::default());
            publish(judge, Id::system_alert, at(2), &SystemAlert::default());
        };
        assert_eq!(violated(&mut silent), ["I6"]);
        let mut back = |judge: &mut Judge| {
            publish(judge, Id::sensor_imu, at(2), &ImuData::default());
            publish(judge, Id::sensor_imu, at(1), &ImuData::default());
        };
        assert_eq!(violated(&mut back), ["I9"]);
    }

    #[test]
    fn motors_that_turn_without_samples_or_after_their_time_to_land_are_found() {
        let mut judge = judge(&[]);
        publish(&mut judge, Id::sensor_imu, Instant::from_millis(1000), &ImuData::default());
        judge.motors(Instant::from_millis(1000), true);
        show(&mut judge, Instant::from_millis(1032), FlightPhase::Flying, (0.6, 0.0), 1);
        assert!(judge.violations.is_empty());
        show(&mut judge, Instant::from_millis(1033), FlightPhase::Flying, (0.6, 0.0), 1);
        assert_eq!(judge.violations, BTreeSet::from(["I7"]));

        // 3 s, and 2 s for 0.6 m.
        let alert = SystemAlert { active: Alerts::CRITICAL_BATTERY, seen: Alerts::CRITICAL_BATTERY };
        judge.violations.clear();
        publish(&mut judge, Id::system_alert, Instant::from_millis(1100), &alert);
        for (milliseconds, expected) in [(6099, false), (6101, true)] {
            let now = Instant::from_millis(milliseconds);
            publish(&mut judge, Id::sensor_imu, now, &ImuData::default());
            show(&mut judge, now, FlightPhase::Flying, (0.6, 0.0), 1);
            assert_eq!(judge.violations.contains("I10"), expected, "{milliseconds}");
        }
    }

    /// Flies up to 0.5 m, suffers the fault at 2 s, and stops the motors at `stop` seconds at this height.
    fn flown(fault: &str, highest: f32, stop: Option<(f64, f32)>, touch: f32) -> Judgement {
        let mut judge = judge(&[fault]);
        let at = |seconds: f64| Instant::from_micros((seconds * 1e6) as u64);
        show(&mut judge, at(0.5), FlightPhase::Armed, (0.0, 0.0), 1);
        judge.motors(at(1.0), true);
        show(&mut judge, at(1.5), FlightPhase::Flying, (0.5, 0.0), 1);
        show(&mut judge, at(2.1), FlightPhase::Flying, (highest, 0.0), 1);
        if let Some((seconds, height)) = stop {
            show(&mut judge, at(seconds), FlightPhase::Flying, (height, touch), 2);
            judge.motors(at(seconds), false);
            show(&mut judge, at(seconds + 0.5), FlightPhase::IdleGround, (0.0, 0.0), 2);
        }
        judge.finish()
    }

    #[test]
    fn ends_are_told_apart() {
        let fault = "baro-step@2";
        let outcome = |highest, stop, touch| flown(fault, highest, stop, touch).outcome;
        assert_eq!(outcome(1.6, Some((4.0, 0.1)), 0.3), "flown-away");
        assert_eq!(outcome(0.5, None, 0.0), "kept-on");
        assert_eq!(outcome(0.5, Some((2.25, 0.5)), 3.0), "cut");
        assert_eq!(outcome(0.5, Some((2.35, 0.5)), 3.0), "crashed");
        assert_eq!(outcome(0.5, Some((4.0, 0.0)), 0.3), "landed");
        let cut = flown(fault, 0.5, Some((2.25, 0.4)), 3.0);
        assert!((cut.cut_after_s.unwrap_or_default() - 0.25).abs() < 1e-6, "{cut:?}");
        assert!((cut.cut_height_m.unwrap_or_default() - 0.4).abs() < 1e-6, "{cut:?}");
        assert_eq!(cut.touch_speed_mps, Some(3.0));
        assert!(cut.violations.contains(&"I12"), "nothing was changed: {cut:?}");
        assert_eq!(judge(&[fault]).finish().outcome, "refused");
    }

    #[test]
    fn distances_are_from_the_legs_that_are_flown() {
        let judge = judge(&[]);
        let place = Vec3::new(0.5, 0.3, 0.0);
        let (top, beside) = judge.commanded(1, place);
        assert!(top == 0.5 && (beside - place.xy().norm()).abs() < 1e-6);
        let (top, beside) = judge.commanded(2, place);
        assert!(top == 0.8 && (beside - 0.3).abs() < 1e-6);
        assert_eq!(distance([2.0, 0.0], [0.0, 0.0], [1.0, 0.0]), 1.0, "beyond its end");
        assert_eq!(distance([0.0, 2.0], [0.0, 0.0], [0.0, 0.0]), 2.0, "of no length");
    }
}
