//! What came of a flight: how it ended and why, and whether anything happened that never may.
//!
//! The first line that fits is the end of the flight. Faults name the worst end that is acceptable; without
//! faults it is `degraded`: the mission was flown to its end. *After the fault* is after the first fault began, and the whole of a
//! flight without one; lengths and speeds are the truth's.
//!
//! | end | rule |
//! |---|---|
//! | `refused` | the motors never turned |
//! | `flown-away` | after the fault, 1 m above the highest commanded height, or 5 m beside the commanded path |
//! | `kept-on` | the motors were on at the end |
//! | `cut` | the motors stopped for good within 0.3 s of the fault, of several one for which they are to stop, or of a blow of a wall or a ceiling, and not on the ground at the end of the mission |
//! | `crashed` | after the fault it touched the ground faster than 1 m/s, or tilted by more than 20° with its motors on, or lies so at the end; once the motors have stopped, what one that cannot be stopped does to it is not counted, nor that a hand drops what has landed in it |
//! | `landed` | it never left the ground; it began to land, or its motors stopped, before the mission asked for landing; or it was not within 1 m of a place of the mission |
//! | `degraded` | after the fault an alert, another flight mode, 0.15 m above the highest commanded height, or 0.5 m beside the path |
//! | `transparent` | anything else |
//!
//! The commanded path is the mission's, in the world as it was at the start: a set-point that follows a wrong estimate
//! excuses nothing. With a pilot, who holds a place less exactly, the bounds of `transparent` are twice as wide, and where it
//! flies by sight, in all but POS_HOLD, four times.
//!
//! A flight by a stick file has no commanded path: it may end anywhere, and a person's sticks can
//! fly a sound vehicle into the floor. So `flown-away` and `landed` are none of its ends, `cut` is
//! one that was stopped in the air by itself (`interventions.rs`), and every end from `refused` to
//! `crashed` is acceptable as long as the vehicle did nothing by itself while it was sound, and no
//! mode that holds the height has flown it into the ground. Where the file begins armed, `refused`
//! is not.
//!
//! A flight that [flies on](VehicleConfig::flies_on) where a protection would have stopped its
//! motors in the air is over as soon as it has crashed or flown away, and ends as that.
//!
//! A vehicle that lands because its battery does not carry it any more has ended well, whatever is
//! left of its mission.
//!
//! What never may happen is the table in `judge/invariants.rs`, and `I12`: every fault began, and changed something.

mod course;
mod interventions;
mod invariants;
mod moments;
mod sight;
mod soundness;

use super::mission::Mission;
use crate::VehicleConfig;
use crate::topics::Id;
use course::{Course, VISITED};
pub use interventions::Intervention;
use interventions::Interventions;
pub use invariants::Invariants;
use moments::Moments;
use serde::Serialize;
pub(super) use sight::Sight;
use stampfly_flight::newest::message;
use stampfly_sim::Truth;
use stampfly_sim::fault::{Class, FAULT_ACTED, Injector};
use stampfly_sim::sticks::{Start, Sticks};
use stampfly_types::messages::{Alerts, FlightMode, FlightPhase, SystemAlert};
use stampfly_types::{Duration, FieldKind, Instant, Message, frame};
use std::collections::BTreeSet;
use std::format;
use std::string::{String, ToString};
use std::vec::Vec;

/// Above the place where it stood: it has left the ground, m.
const OFF_GROUND: f32 = 0.05;
/// Bounds of `flown-away`: above the highest commanded height and beside the path, m.
const AWAY: [f32; 2] = [1.0, 5.0];
/// Bounds of `transparent`, in the same order, m.
const EXACT: [f32; 2] = [0.15, 0.5];
/// A pilot's bounds are this many times as wide. Where only the pilot's eyes hold the place, gusts of 1 m/s carry a vehicle without faults
/// 1 m away in more than half of the flights, and 2 m in few.
const PILOT: f32 = 2.0;
const BY_SIGHT: f32 = 4.0;
/// Motors that stop within this time of a fault were cut.
const CUT: Duration = Duration::from_millis(300);
/// A rotor that turns faster than this, rad/s, this long after the motors have stopped, is driven.
const TURNS: f32 = 1_000.0;
const COAST: Duration = Duration::from_millis(150);
/// Hardest touch-down that is none of a crash, m/s.
const HARD: f32 = 1.0;
/// A mode that holds the height has arrested any fall after this time: half a second to turn upright
/// from any attitude, and 4 m/s at 4 m/s², which is what motors that lift 1.4 of its weight do.
const ARRESTS: Duration = Duration::from_millis(1_500);
/// Largest tilt of a vehicle that has landed, degrees.
const TILTED: f32 = 20.0;
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
    /// Why it is no better end: a sentence without a capital letter, empty for `transparent`.
    pub reason: String,
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
    /// What the vehicle did by itself that changed the flight, in order.
    pub interventions: Vec<Intervention>,
    /// The protections that stopped the motors in the air, the first time that some did: alerts
    /// with `+` between two, or `CUT_OFF`.
    pub cut_in_air: Option<String>,
    /// Faults, as they were given.
    pub faults: Vec<FaultSpan>,
}

#[derive(Clone, Copy)]
struct Touch {
    at: Instant,
    speed: f32,
    tilt: f32,
    /// The vehicle was landing.
    landing: bool,
    /// A mode that holds the height has had the time to arrest any fall.
    held: bool,
}

pub(super) struct Judge {
    injector: Injector,
    invariants: Invariants,
    interventions: Interventions,
    /// A stick file is flown; is the vehicle to be armed by it, whatever the file does?
    sticks: Option<bool>,
    moments: Moments,
    course: Course,
    /// Protections stop no motors in the air: such a flight is over when it is lost.
    flies_on: bool,
    /// How many times as wide the bounds of `transparent` are.
    wide: f32,
    alerts: Alerts,
    spans: Vec<AlertSpan>,
    motors_on: bool,
    turned: bool,
    /// The last instant at which the motors stopped, and the height there.
    stopped: Option<(Instant, f32)>,
    start: Option<Instant>,
    last: Option<Truth>,
    /// Above the floor below, m.
    clearance: f32,
    strikes: u64,
    /// The last push of a wall or a ceiling.
    struck: Option<Instant>,
    /// Did the motors stop at once after one?
    stopped_by_blow: bool,
    now: Instant,
    in_air: bool,
    highest: f32,
    beside: f32,
    /// After the fault.
    away: [f32; 2],
    touches: Vec<Touch>,
    was_landing: bool,
    /// Landing began before the mission asked for it.
    early: bool,
    /// The motors stopped for good before the mission asked for landing.
    stopped_early: bool,
    /// A rotor went on turning when the motors had stopped.
    runs_on: bool,
    mode: Option<FlightMode>,
    other_mode: bool,
    /// Alerts after the fault; without one, since the motors turned.
    new_alerts: BTreeSet<&'static str>,
    /// Steps of the mission that are done.
    done: usize,
}

impl Judge {
    pub fn new(injector: &Injector, mission: &Mission, pilot: Option<FlightMode>, config: &VehicleConfig) -> Self {
        let course = Course::new(mission, config.mode.flip_room);
        Self {
            injector: injector.clone(),
            invariants: Invariants::new(config.mode.hover_without_link),
            interventions: Interventions::new(injector, config),
            sticks: None,
            moments: Moments::default(),
            wide: match pilot {
                None => 1.0,
                Some(mode) if course.modes().chain([mode]).all(|mode| mode.holds_place()) => PILOT,
                Some(_) => BY_SIGHT,
            },
            course,
            flies_on: config.flies_on,
            alerts: Alerts::NONE,
            spans: Vec::new(),
            motors_on: false,
            turned: false,
            stopped: None,
            start: None,
            last: None,
            clearance: 0.0,
            strikes: 0,
            struck: None,
            stopped_by_blow: false,
            now: Instant::ZERO,
            in_air: false,
            highest: 0.0,
            beside: 0.0,
            away: [f32::NEG_INFINITY; 2],
            touches: Vec::new(),
            was_landing: false,
            early: false,
            stopped_early: false,
            runs_on: false,
            mode: None,
            other_mode: false,
            new_alerts: BTreeSet::new(),
            done: 0,
        }
    }

    /// The same, of a flight by a stick file.
    pub fn of_sticks(self, sticks: &Sticks) -> Self {
        let arms = matches!(sticks.start, Start::Armed | Start::Height(_));
        Self { sticks: Some(arms), ..self }
    }

    /// A sample was published.
    pub fn published(&mut self, id: Id, at: Instant, words: &[u32]) {
        self.invariants.published(id, at, words);
        self.interventions.published(id, at, words);
        self.moments.published(&self.injector, id, at, words);
        if id == Id::system_alert
            && let Some(alert) = message::<SystemAlert>(words)
        {
            self.alerts_change(at, alert.active);
        }
    }

    fn alerts_change(&mut self, at: Instant, active: Alerts) {
        if active == self.alerts {
            return;
        }
        let seconds = at.seconds_f64();
        let after_fault = self.has_begun(at);
        for (name, bit) in names() {
            let (was, is) = (self.alerts.bits() & bit != 0, active.bits() & bit != 0);
            if is && !was {
                self.spans.push(AlertSpan { name, since: seconds, until: None });
                // Before the first command nobody has been heard, and sensors start.
                if after_fault && (self.turned || self.injector.faults().next().is_some()) {
                    self.new_alerts.insert(name);
                }
            } else if was
                && !is
                && let Some(span) = self.spans.iter_mut().rev().find(|span| span.name == name)
            {
                span.until = Some(seconds);
            }
        }
        self.alerts = active;
    }

    /// What the motors are given, whatever decides it.
    pub fn motors(&mut self, now: Instant, on: bool) {
        self.invariants.motors(on);
        if self.motors_on && !on {
            self.stopped = Some((now, self.clearance));
            self.stopped_early = !self.course.asks_to_land(self.done);
            self.stopped_by_blow = self.struck.is_some_and(|struck| now.since(struck) <= CUT);
        }
        if on {
            (self.stopped, self.stopped_early, self.runs_on) = (None, false, false);
        }
        self.turned |= on;
        self.motors_on = on;
    }

    /// A wall or a ceiling has pushed in so many steps since the start. To be told before the motors: they stop sooner after a
    /// blow than the truth is looked at.
    pub fn strikes(&mut self, now: Instant, strikes: u64) {
        if strikes > self.strikes {
            (self.strikes, self.struck) = (strikes, Some(now));
        }
    }

    fn has_begun(&self, now: Instant) -> bool {
        self.injector.faults().next().is_none() || self.injector.first_begun(now).is_some()
    }

    /// Looks at the truth, at the control rate.
    pub fn see(&mut self, sight: &Sight<'_>) {
        let Sight { now, truth, clearance, strikes, status, done } = *sight;
        self.strikes(now, strikes);
        let held = self.interventions.held_since().is_some_and(|since| now.since(since) > ARRESTS);
        self.interventions.see(sight);
        self.clearance = clearance;
        (self.now, self.done) = (now, done);
        self.start = self.start.or(Some(now));
        let (up, sink) = (height(truth), self.last.map_or(0.0, |last| last.velocity.z));
        let landing = status.phase == FlightPhase::Landing || (self.course.asks_to_land(done) && status.armed);
        if landing && !self.was_landing {
            self.early |= !self.course.asks_to_land(done);
        }
        self.was_landing = landing;
        let touches = self.in_air && truth.contact;
        self.in_air = (self.in_air || clearance > OFF_GROUND) && !truth.contact;
        self.moments.tell(&self.injector, sight, self.motors_on, landing && self.in_air, landing && touches);

        let after_fault = self.has_begun(now);
        if touches {
            // A leg that touches first turns over what its propellers push, and sets upright what they no longer do.
            let tilt = if self.motors_on { frame::tilt(&truth.attitude).to_degrees() } else { 0.0 };
            self.touches.push(Touch { at: now, speed: sink.max(0.0), tilt, landing, held });
        }
        self.course.visit(&truth.position);
        let (top, beside) = self.course.commanded(done, &truth.position);
        self.highest = self.highest.max(up);
        self.beside = self.beside.max(beside);
        if after_fault {
            self.away = [self.away[0].max(up - top), self.away[1].max(beside)];
        }
        if status.phase == FlightPhase::Flying {
            let mode = *self.mode.get_or_insert(status.mode);
            self.other_mode |= after_fault && mode != status.mode && !self.course.asks_for(status.mode);
        }
        let coasted = self.stopped.is_some_and(|(at, _)| now.since(at) > COAST);
        self.runs_on |= coasted && truth.rotor_speed.iter().any(|speed| *speed > TURNS);
        self.invariants.see(now, clearance);
        self.last = Some(*truth);
    }

    /// Has the flight shown all that comes of a fault? The motors are off, and the mission waits
    /// for something else. A flight that flies on is over when the vehicle has crashed or flown
    /// away. A stick file has no path that it could leave.
    pub fn is_over(&self, now: Instant) -> bool {
        let flew_away = self.sticks.is_none() && self.flew_away().is_some();
        if self.flies_on && (flew_away || self.crash(self.injector.first_begun(now)).is_some()) {
            return true;
        }
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
        self.invariants.require(FAULT_ACTED, faults.iter().all(|span| span.since.is_some() && span.changes > 0));
        let of_faults = self.injector.faults().map(|fault| fault.expected()).max();
        let (expected, (outcome, reason)) = match self.sticks {
            None => (of_faults.unwrap_or(Class::Degraded), self.end(begun)),
            Some(_) => (of_faults.unwrap_or(Class::Crashed).max(Class::Crashed), self.end_of_sticks(begun)),
        };
        let flew = count > 0 || outcome != Class::Refused;
        let as_expected = match self.sticks {
            None => (outcome.is_within(expected) || outcome == Class::Landed && self.is_spent()) && flew,
            Some(arms) => outcome <= expected && self.needless().is_none() && (flew || !arms) && !self.dropped(begun),
        };
        // Motors that were off already stayed off from the beginning of the fault.
        let stopped = if self.turned { self.stopped } else { Some((self.now, 0.0)) };
        let stopped = begun.zip(stopped).map(|(begun, (at, height))| {
            let at = if self.turned { at } else { begun };
            (at.since(begun).seconds_f64(), f64::from(height.max(0.0)))
        });
        let touch = self.touches.iter().find(|touch| begun.map_or(touch.landing, |begun| touch.at >= begun));
        let [above, _] = self.away;
        Judgement {
            outcome: outcome.name(),
            reason,
            expected: expected.name(),
            as_expected,
            violations: self.invariants.violations().collect(),
            max_height_m: self.highest.into(),
            max_above_m: if above.is_finite() { above.into() } else { 0.0 },
            max_distance_m: self.beside.into(),
            touch_speed_mps: touch.map(|touch| touch.speed.into()),
            cut_after_s: stopped.map(|(after, _)| after),
            cut_height_m: stopped.map(|(_, height)| height),
            alerts: self.spans,
            interventions: self.interventions.list().to_vec(),
            cut_in_air: self.interventions.cut_in_air().map(|one| one.alert.clone()),
            faults,
        }
    }

    /// Did the motors stop at once after a fault? Of several only those count for which they are to stop.
    fn stopped_by_fault(&self, at: Instant) -> bool {
        let alone = self.injector.faults().count() == 1;
        self.injector.faults().enumerate().any(|(place, fault)| {
            let since = self.injector.begins(place).filter(|since| *since <= at);
            (alone || fault.expected() == Class::Cut) && since.is_some_and(|since| at.since(since) <= CUT)
        })
    }

    /// Did the motors stop in a hand, when the mission asked to land? To be caught is a landing then.
    fn is_caught(&self) -> bool {
        self.stopped.filter(|_| !self.stopped_early).is_some_and(|(at, _)| {
            self.injector.faults().enumerate().any(|(place, fault)| {
                let since = self.injector.begins(place).filter(|since| *since <= at);
                let holds = fault.value.filter(|_| fault.kind.name == "hand");
                since.zip(holds).is_some_and(|(since, holds)| at.since(since).seconds_f64() < holds)
            })
        })
    }

    /// By the table of the [module](self) documentation, with the reason.
    fn end(&self, begun: Option<Instant>) -> (Class, String) {
        if !self.turned {
            return (Class::Refused, "the motors never turned".into());
        }
        let [above, beside] = self.away;
        if let Some(reason) = self.flew_away() {
            return (Class::FlownAway, reason);
        }
        let crash = self.crash(begun);
        if let Some(crash) = crash.as_ref().filter(|_| self.flies_on) {
            return (Class::Crashed, crash.clone());
        }
        if self.motors_on {
            return (Class::KeptOn, "the motors were on at the end".into());
        }
        if let Some((at, height)) = self.stopped {
            let at_the_end = !self.stopped_early && height <= OFF_GROUND && crash.is_none();
            if !at_the_end && (self.stopped_by_fault(at) || self.stopped_by_blow) {
                // A vehicle that has never left the ground does not fall.
                let class = if self.highest <= OFF_GROUND { Class::Landed } else { Class::Cut };
                return (class, format!("the motors stopped at {:.1} m{}", height.max(0.0), self.alerts_at(at)));
            }
        }
        if let Some(reason) = crash {
            return (Class::Crashed, reason);
        }
        if let Some(reason) = self.shortfall() {
            return (Class::Landed, reason);
        }
        let too_far = |error: f32, bound: f32| error > self.wide * bound;
        let reason = if !self.new_alerts.is_empty() {
            format!("alerts{}", listed(&self.new_alerts))
        } else if self.other_mode {
            "another mode than at the start".into()
        } else if too_far(above, EXACT[0]) {
            format!("{above:.2} m above the highest height that was commanded")
        } else if too_far(beside, EXACT[1]) {
            format!("{beside:.2} m beside the path that was commanded")
        } else {
            return (Class::Transparent, String::new());
        };
        (Class::Degraded, reason)
    }

    /// Where it has flown to, if that is away.
    fn flew_away(&self) -> Option<String> {
        let [above, beside] = self.away;
        if above > AWAY[0] {
            Some(format!("{above:.1} m above the highest height that was commanded"))
        } else if beside > AWAY[1] {
            Some(format!("{beside:.1} m beside the path that was commanded"))
        } else {
            None
        }
    }

    /// The same for a flight by a stick file.
    fn end_of_sticks(&self, begun: Option<Instant>) -> (Class, String) {
        if let Some(needless) = self.needless() {
            let Intervention { alert, height_m, .. } = needless;
            let why = format!("the vehicle was sound, and {alert} {} at {height_m:.1} m", needless.verb());
            let class = if needless.action == "cut" { Class::Cut } else { Class::Landed };
            return (class, why);
        }
        let crash = self.crash(begun);
        let stopped =
            self.interventions.list().iter().find(|one| one.action == "cut" && one.height_m > OFF_GROUND.into());
        if !self.turned {
            (Class::Refused, "the motors never turned".into())
        } else if let Some(crash) = crash.as_ref().filter(|_| self.flies_on) {
            (Class::Crashed, crash.clone())
        } else if self.motors_on {
            (Class::KeptOn, "the motors were on at the end".into())
        } else if let Some(Intervention { alert, height_m, .. }) = stopped {
            (Class::Cut, format!("{alert} stops the motors at {height_m:.1} m of a vehicle that is not sound"))
        } else if let Some(crash) = crash {
            let by = if self.dropped(begun) { "in a mode that holds the height" } else { "so its sticks flew it" };
            (Class::Crashed, format!("{crash}; {by}"))
        } else if !self.new_alerts.is_empty() {
            (Class::Degraded, format!("alerts{}", listed(&self.new_alerts)))
        } else {
            (Class::Transparent, String::new())
        }
    }

    /// The first thing that a sound vehicle did by itself.
    fn needless(&self) -> Option<&Intervention> {
        self.interventions.list().iter().find(|one| one.sound)
    }

    /// Is the first thing that the vehicle did by itself to land, because its battery did not carry it?
    fn is_spent(&self) -> bool {
        self.interventions.list().first().is_some_and(|one| one.spent)
    }

    /// Did a mode that holds the height fly it into the ground? What comes after that touch is not
    /// asked.
    fn dropped(&self, begun: Option<Instant>) -> bool {
        self.crashes(begun).is_some_and(|touch| touch.held && touch.speed > HARD)
    }

    /// The first touch that is a crash.
    fn crashes(&self, begun: Option<Instant>) -> Option<&Touch> {
        let from = begun.or(self.start).unwrap_or(self.now);
        let given_up = self.runs_on || self.is_caught();
        let until = self.stopped.filter(|_| given_up).map_or(self.now, |(at, _)| at);
        let mut touches = self.touches.iter().filter(|touch| (from..=until).contains(&touch.at));
        touches.find(|touch| touch.speed > HARD || touch.tilt > TILTED)
    }

    /// Why the flight is a crash, if it is one.
    fn crash(&self, begun: Option<Instant>) -> Option<String> {
        if let Some(Touch { at, speed, tilt, .. }) = self.crashes(begun) {
            let how = if *speed > HARD { format!("at {speed:.1} m/s") } else { format!("tilted by {tilt:.0} deg") };
            return Some(format!("touched the ground {how}{}", self.alerts_at(*at)));
        }
        let given_up = self.runs_on || self.is_caught();
        let lies = self.last.filter(|truth| !given_up && truth.contact)?;
        let tilt = frame::tilt(&lies.attitude).to_degrees();
        (tilt > TILTED).then(|| format!("lies tilted by {tilt:.0} deg{}", self.alerts_at(self.now)))
    }

    /// Why the mission was not flown to its end, if it was not.
    fn shortfall(&self) -> Option<String> {
        let stopped = self.stopped.map_or(self.now, |(at, _)| at);
        if self.course.asks_to_rise() && self.highest < OFF_GROUND {
            Some(format!("never left the ground{}", self.alerts_at(stopped)))
        } else if self.early {
            Some(format!("landed before the mission asked for it{}", self.alerts_at(stopped)))
        } else if self.stopped_early {
            Some(format!("the motors stopped before the mission asked for landing{}", self.alerts_at(stopped)))
        } else if !self.course.is_visited() {
            Some(format!("was not within {VISITED} m of each place of the mission"))
        } else {
            None
        }
    }

    /// Names of the alerts that spoke until this instant and were not over a second before, behind a colon.
    fn alerts_at(&self, at: Instant) -> String {
        let at = at.seconds_f64();
        let spoke = |span: &&AlertSpan| span.since <= at && span.until.is_none_or(|until| until >= at - 1.0);
        listed(&self.spans.iter().filter(spoke).map(|span| span.name).collect())
    }
}

/// Names behind a colon; nothing without names.
fn listed(names: &BTreeSet<&'static str>) -> String {
    let names: Vec<_> = names.iter().copied().collect();
    if names.is_empty() { String::new() } else { format!(": {}", names.join(", ")) }
}

fn height(truth: &Truth) -> f32 {
    -truth.position.z
}

/// Every alert with its bit.
fn names() -> impl Iterator<Item = (&'static str, u32)> {
    let names = SystemAlert::FIELDS.first().map(|field| field.kind);
    let names = if let Some(FieldKind::Flags(names)) = names { names } else { &[] };
    names.iter().copied()
}

#[cfg(test)]
mod tests;
