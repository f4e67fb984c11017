//! How a flight looks from beside the field, and which end it was: for vehicles that take off, land and are disarmed.
//!
//! [`Watched`] is a vehicle's `Outcome`, a [`Spectator`] looks for it. What a vehicle measures besides, and when that is too much, is its [`Measured`]. Not for vehicles with a judge of
//! their own, which looks at alerts and phases.

use crate::fault::{Class, FAULT_ACTED, Fault, Injector, Moment};
use crate::time::Clock;
use crate::vehicle::{Figure, Verdict};
use crate::{Truth, World};
use serde::Serialize;
use stampfly_types::{Duration, Instant, Message, frame};

/// Above this nothing touches the ground any more, m.
const CLEAR: f64 = 0.1;
/// Faster than this a touch is a crash, m/s.
const HARD: f32 = 2.5;
/// After its end a flight is watched for this long.
const TAIL: Duration = Duration::from_secs(1);
/// A vehicle that stands more tilted than this lies, rad.
const LIES: f32 = 0.5;
/// So long after its take-off it has flown for a while: [`Moment::Hover`].
const FLOWN: Duration = Duration::from_secs(1);

/// How a vehicle is at a look, beside the truth: what only it can say of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shown {
    /// It stands and may be armed.
    pub ready: bool,
    /// It is armed.
    pub armed: bool,
    /// Above where it stood, m.
    pub height: f64,
    /// It stays at a place, where a touch of the ground is no landing.
    pub stays: bool,
    /// It flies to another place.
    pub moves: bool,
    /// It sinks, in order to land.
    pub lands: bool,
}

/// What one kind of vehicle measures of its flights.
pub trait Measured {
    /// Was the mission flown with larger errors than a flight without faults has?
    fn is_degraded(&self) -> bool;

    /// How hard a touch of the ground is, m/s. Faster than 2.5 m/s it is a crash. By default the whole velocity; what rolls on wheels has another answer.
    #[must_use]
    fn touch(truth: &Truth) -> f32 {
        truth.velocity.norm()
    }

    /// The figures, the same names in the same order for every flight.
    fn figures(&self) -> Vec<Figure>;
}

/// How a flight went.
///
/// ```
/// use stampfly_sim::Truth;
/// use stampfly_sim::fault::{Class, Injector};
/// use stampfly_sim::vehicle::Figure;
/// use stampfly_sim::watched::{Measured, Shown, Watched};
/// use stampfly_types::Instant;
/// # #[derive(Default)]
/// struct Nothing;
/// impl Measured for Nothing {
///     fn is_degraded(&self) -> bool { false }
///     fn figures(&self) -> Vec<Figure> { Vec::new() }
/// }
/// let mut watched = Watched::<Nothing>::default();
/// let (air, ground) = (Truth::default(), Truth { contact: true, ..Truth::default() });
/// let injector = Injector::new(Instant::ZERO, &[]);
/// for (second, height, truth) in [(1, 0.0, &ground), (2, 1.5, &air), (9, 0.0, &ground)] {
///     let shown = Shown { armed: true, height, ..Shown::default() };
///     watched.look(Instant::from_secs(second), &shown, truth, &injector);
/// }
/// assert!(watched.has_flown());
/// watched.end(&[], None, ground, true);
/// assert_eq!(watched.class(), Class::KeptOn, "still armed");
/// ```
#[derive(Clone, Debug, Default)]
pub struct Watched<M> {
    /// Was the mission flown to its end?
    pub finished: bool,
    /// Legs flown, and how many there were.
    pub legs: [usize; 2],
    /// It has been armed.
    pub armed: bool,
    /// Is it disarmed in the end?
    pub disarmed: bool,
    /// It was disarmed in the air.
    pub cut: bool,
    /// Other programs flew it.
    pub live: bool,
    /// A stick file flew it: a person's sticks may fly a sound vehicle into the ground.
    pub by_sticks: bool,
    /// Speed at the hardest touch after flight, m/s: a bounce does not make it a soft one.
    pub touchdown: f32,
    /// Largest tilt, rad.
    pub tilt: f32,
    /// At the end.
    pub last: Truth,
    /// The faults, with how often each changed something.
    pub faults: Vec<(String, u64)>,
    /// The worst end that is acceptable with these faults; `None` without faults.
    pub expected: Option<Class>,
    /// What the vehicle measures besides.
    pub measured: M,
    /// When it left the ground for the first time.
    left: Option<Instant>,
    /// It touched the ground at the last look.
    touched: bool,
}

/// Somebody beside the field: looks at the truth at regular times, writes it down, and sees when a flight is over.
///
/// ```
/// use stampfly_sim::watched::Spectator;
/// use stampfly_sim::{Simulation, SimulationConfig, time::Tasks};
/// use stampfly_types::{Duration, Instant};
/// let Simulation { clock, world, .. } = Simulation::new(&SimulationConfig::example());
/// let mut spectator = Spectator::new(&clock, &world, Duration::from_millis(10));
/// let mut looks = 0;
/// let mut tasks = Tasks::new(clock.clone());
/// for millis in [0, 5, 10, 12, 30] {
///     tasks.run_until(Instant::from_millis(millis));
///     looks += usize::from(spectator.look(&mut |_, _, _, _| {}).is_some());
/// }
/// assert_eq!(looks, 3);
/// ```
#[derive(Debug)]
pub struct Spectator {
    clock: Clock,
    world: World,
    every: Duration,
    looked: Option<Instant>,
    looks: u32,
    ended: Option<Instant>,
}

impl Spectator {
    /// Who looks so often.
    #[must_use]
    pub fn new(clock: &Clock, world: &World, every: Duration) -> Self {
        Self { clock: clock.clone(), world: world.clone(), every, looked: None, looks: 0, ended: None }
    }

    /// The truth, and when it was, if it is time to look. It is recorded as the first topic beside the vehicle's.
    pub fn look(&mut self, record: &mut dyn FnMut(usize, Instant, u32, &[u32])) -> Option<(Instant, Truth)> {
        let now = self.clock.now();
        if self.looked.is_some_and(|looked| now.since(looked) < self.every) {
            return None;
        }
        self.looked = Some(now);
        self.looks += 1;
        let truth = self.world.truth_at(now);
        record(0, now, self.looks, truth.to_words().as_ref());
        Some((now, truth))
    }

    /// Is a flight over? A second after the mission was flown to its `end`; as long after a vehicle that was `cut` in the air has come to rest; when a fault has
    /// lasted longer than anybody waits.
    pub fn is_over(&mut self, now: Instant, end: bool, cut: bool, injector: &Injector, patience: Duration) -> bool {
        let ended = end || cut && self.world.truth_at(now).contact;
        let given_up = injector.first_begun(now).is_some_and(|begun| now.since(begun) > patience);
        (ended || given_up) && now.since(*self.ended.get_or_insert(now)) >= TAIL
    }

    /// The truth now.
    #[must_use]
    pub fn truth(&self) -> Truth {
        self.world.truth_at(self.clock.now())
    }
}

/// What scripts want to know besides.
#[derive(Debug, Serialize)]
struct Findings {
    outcome: &'static str,
    expected: &'static str,
    as_expected: bool,
    violations: Vec<&'static str>,
    faults: Vec<String>,
}

impl<M: Measured + Default> Watched<M> {
    /// Before a flight of so many legs.
    #[must_use]
    pub fn new(legs: usize) -> Self {
        Self { legs: [0, legs], ..Self::default() }
    }
}

impl<M: Measured> Watched<M> {
    /// Looks at the truth and at what the vehicle shows, and tells the injector which moments have come.
    pub fn look(&mut self, now: Instant, shown: &Shown, truth: &Truth, injector: &Injector) {
        let Shown { ready, armed, height, stays, moves, lands } = *shown;
        let is_clear = height > CLEAR;
        self.armed |= armed;
        if armed && is_clear {
            self.left.get_or_insert(now);
        }
        self.cut |= !armed && is_clear && self.has_flown();
        let touches = truth.contact && !self.touched && self.has_flown() && !is_clear && !stays;
        self.touched = truth.contact;
        if touches {
            self.touchdown = self.touchdown.max(M::touch(truth));
        }
        self.tilt = self.tilt.max(frame::tilt(&truth.attitude));
        let flies = self.left.is_some_and(|left| now.since(left) >= FLOWN);
        let moments = [
            (Moment::Ground, ready && !armed),
            (Moment::Spool, armed),
            (Moment::TakeOff, self.has_flown()),
            (Moment::Hover, flies),
            (Moment::Move, flies && moves),
            (Moment::Landing, flies && lands),
            (Moment::Touch, touches),
        ];
        for (moment, _) in moments.iter().filter(|(_, has_come)| *has_come) {
            injector.reached(*moment, now);
        }
    }

    /// The flight is over: with these faults, of which the injector knows what each has changed. What people break on purpose is not judged.
    pub fn end(&mut self, faults: &[Fault], injector: Option<&Injector>, last: Truth, armed: bool) {
        self.last = last;
        self.disarmed = self.armed && !armed;
        self.expected = faults.iter().map(Fault::expected).max();
        let changes = |place| injector.map_or(0, |injector| injector.changes(place));
        self.faults = faults.iter().enumerate().map(|(place, fault)| (fault.to_string(), changes(place))).collect();
    }

    /// Has it left the ground?
    #[must_use]
    pub const fn has_flown(&self) -> bool {
        self.left.is_some()
    }

    fn stands(&self) -> bool {
        self.last.contact && frame::tilt(&self.last.attitude) < LIES
    }
}

impl<M: Measured> Watched<M> {
    /// Which end it is.
    #[must_use]
    pub fn class(&self) -> Class {
        if !self.armed {
            Class::Refused
        } else if !self.disarmed {
            Class::KeptOn
        } else if self.cut {
            Class::Cut
        } else if !self.stands() || self.touchdown > HARD {
            Class::Crashed
        } else if !self.finished {
            Class::Landed
        } else if self.measured.is_degraded() {
            Class::Degraded
        } else {
            Class::Transparent
        }
    }

    /// The worst end that is acceptable. Without faults the mission has to be flown to its end;
    /// sticks may end anywhere.
    fn worst(&self) -> Class {
        let worst = self.expected.unwrap_or(Class::Degraded);
        if self.by_sticks { worst.max(Class::Crashed) } else { worst }
    }
}

impl<M: Measured> Verdict for Watched<M> {
    fn succeeded(&self) -> bool {
        if self.live {
            return true;
        }
        let flown = self.facts().iter().all(|(_, holds)| *holds);
        let is_within =
            if self.by_sticks { self.class() <= self.worst() } else { self.class().is_within(self.worst()) };
        is_within && (flown || self.expected.is_some())
    }

    fn findings(&self) -> impl Serialize {
        let faults = self.faults.iter().map(|(fault, _)| fault.clone()).collect();
        let acted = self.faults.iter().all(|(_, changes)| *changes > 0);
        Findings {
            outcome: self.class().name(),
            expected: self.worst().name(),
            as_expected: self.succeeded(),
            violations: if acted { Vec::new() } else { vec![FAULT_ACTED] },
            faults,
        }
    }

    fn facts(&self) -> Vec<(&'static str, bool)> {
        let landed = self.finished && self.stands() && self.touchdown <= HARD;
        let mut facts = vec![("landed", landed), ("disarmed", self.disarmed), ("finished", self.finished)];
        if self.by_sticks {
            facts.remove(0);
        }
        facts
    }

    fn figures(&self) -> Vec<Figure> {
        let mut figures = self.measured.figures();
        figures.push(Figure { name: "touchdown_speed_mps", unit: "m/s", value: Some(self.touchdown.into()) });
        figures.push(Figure { name: "largest_tilt_deg", unit: "deg", value: Some(f64::from(self.tilt).to_degrees()) });
        figures
    }

    fn story(&self) -> Vec<String> {
        let [flown, of] = self.legs;
        let mut told = vec![format!("{flown} of {of} places flown to")];
        told.extend(self.faults.iter().map(|(fault, changes)| format!("fault {fault}, {changes} changes")));
        told
    }

    fn sentence(&self) -> String {
        if self.live {
            return "flown by other programs".into();
        }
        match (self.expected, self.succeeded()) {
            (None, true) if self.by_sticks => format!("flown to the end of its sticks: {}", self.class()),
            (None, true) => "landed and disarmed".into(),
            (None, false) => format!("FAILED: {}", self.class()),
            (Some(_), true) => format!("{}, as expected", self.class()),
            (Some(worst), false) => format!("{}, NOT ACCEPTABLE: {worst} at worst", self.class()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::Vec3;

    #[derive(Default)]
    struct Nothing;

    impl Measured for Nothing {
        fn is_degraded(&self) -> bool {
            false
        }

        fn figures(&self) -> Vec<Figure> {
            Vec::new()
        }
    }

    /// Height and rate of sink, a look each, from the take-off on, and when disarmed again: how did it end?
    fn flown(looks: &[(f64, f32)]) -> Class {
        let (mut watched, injector) = (Watched::<Nothing>::new(0), Injector::new(Instant::ZERO, &[]));
        let mut last = Truth::default();
        for (second, (height, sink)) in (1..).zip(looks) {
            last = Truth { velocity: Vec3::new(0.0, 0.0, *sink), contact: *height <= 0.0, ..Truth::default() };
            let shown = Shown { armed: true, height: *height, ..Shown::default() };
            watched.look(Instant::from_secs(second), &shown, &last, &injector);
        }
        watched.finished = true;
        watched.end(&[], None, last, false);
        watched.class()
    }

    #[test]
    fn a_bounce_does_not_make_a_hard_touch_a_soft_one() {
        assert_eq!(flown(&[(0.0, 0.0), (2.0, 1.0), (0.0, 1.0), (0.0, 0.0)]), Class::Transparent);
        assert_eq!(flown(&[(0.0, 0.0), (2.0, 9.0), (0.0, 9.0), (1.0, 0.5), (0.0, 0.5)]), Class::Crashed);
    }

    #[test]
    fn who_was_never_armed_was_refused() {
        let mut watched = Watched::<Nothing>::new(1);
        watched.end(&[], None, Truth { contact: true, ..Truth::default() }, false);
        assert_eq!(watched.class(), Class::Refused);
    }
}
