//! Assesses a flight from its true motion and gives it an outcome class.
//!
//! For vehicles that take off, land and are disarmed. [`Watched`] is the vehicle's `Outcome`, and a
//! [`Spectator`] samples the truth for it. Quantities particular to a vehicle, and the limits at
//! which they degrade the outcome, go into its [`Measured`]. Not for vehicles with their own judge
//! that evaluates alerts and phases.

use crate::fault::{Class, FAULT_ACTED, Fault, Injector, Moment};
use crate::time::Clock;
use crate::vehicle::{Figure, Verdict};
use crate::{Truth, World};
use serde::Serialize;
use stampfly_types::{Duration, Instant, Message, frame};

/// Height above which nothing touches the ground, m.
const CLEAR: f64 = 0.1;
/// Speed at a touch above which it is a crash, m/s.
const HARD: f32 = 2.5;
/// Time for which a flight is observed after its end.
const TAIL: Duration = Duration::from_secs(1);
/// Tilt above which a vehicle on the ground counts as tipped over, rad.
const LIES: f32 = 0.5;
/// Time after take-off at which [`Moment::Hover`] comes.
const FLOWN: Duration = Duration::from_secs(1);

/// State of the vehicle at a look, as far as the true motion does not show it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shown {
    /// On the ground and ready to arm.
    pub ready: bool,
    /// Armed.
    pub armed: bool,
    /// Height above the place of take-off, m.
    pub height: f64,
    /// Holds a position; touching the ground there is not a landing.
    pub stays: bool,
    /// Flies to another position.
    pub moves: bool,
    /// Descends in order to land.
    pub lands: bool,
    /// Its motors are commanded to turn.
    pub turns: bool,
    /// Steps so far in which a part that does not carry the vehicle touched the ground, see
    /// [`Body::scrapes`](crate::plant::Body::scrapes).
    pub scrapes: u64,
    /// Distance from the intended position, m.
    pub beside: f64,
}

/// Quantities that one kind of vehicle measures in its flights.
pub trait Measured {
    /// Distance from the intended position above which the vehicle has flown away, m. Unlimited by
    /// default.
    const AWAY: f64 = f64::INFINITY;

    /// True if the mission was flown with larger errors than a flight without faults has.
    fn is_degraded(&self) -> bool;

    /// Impact speed of a touch, m/s; above 2.5 m/s it is a crash. By default the magnitude of the
    /// velocity. A vehicle on wheels overrides it, because rolling is not an impact.
    #[must_use]
    fn touch(truth: &Truth) -> f32 {
        truth.velocity.norm()
    }

    /// The figures: the same names in the same order for every flight.
    fn figures(&self) -> Vec<Figure>;
}

/// Course and outcome of a flight.
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
    /// The mission was flown to its end.
    pub finished: bool,
    /// Legs flown, and legs of the mission.
    pub legs: [usize; 2],
    /// Has been armed.
    pub armed: bool,
    /// Disarmed at the end.
    pub disarmed: bool,
    /// Disarmed in the air.
    pub cut: bool,
    /// Flown by other programs.
    pub live: bool,
    /// Flown by a stick file: recorded sticks may fly a sound vehicle into the ground.
    pub by_sticks: bool,
    /// Speed at the hardest touch after flight, m/s. A soft bounce does not lower it.
    pub touchdown: f32,
    /// The first crash.
    pub crash: Option<Crash>,
    /// Largest distance from the intended position while armed, m.
    pub farthest: f64,
    /// Largest tilt, rad.
    pub tilt: f32,
    /// True state at the end.
    pub last: Truth,
    /// The faults, each with the number of samples or commands that it changed.
    pub faults: Vec<(String, u64)>,
    /// The worst acceptable class with these faults; `None` without faults.
    pub expected: Option<Class>,
    /// Further quantities of the vehicle.
    pub measured: M,
    /// When it left the ground for the first time.
    left: Option<Instant>,
    /// Contact at the previous look.
    touched: bool,
    speed: f32,
    scrapes: u64,
    is_armed: bool,
}

/// The first crash of a flight. Ground contact after the motors stopped in the air is not one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crash {
    /// Instant of the crash.
    pub at: Instant,
    /// Speed at the touch, m/s.
    pub speed: f32,
    /// A part that does not carry the vehicle touched the ground: neither wheel nor foot.
    pub scraped: bool,
    /// Time from the crash to the last look at which the motors were commanded to turn.
    pub turned: Duration,
}

/// Samples the truth at a fixed period, records it, and detects the end of the flight.
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
    /// Looks once per `every`.
    #[must_use]
    pub fn new(clock: &Clock, world: &World, every: Duration) -> Self {
        Self { clock: clock.clone(), world: world.clone(), every, looked: None, looks: 0, ended: None }
    }

    /// Returns the truth and its instant if a look is due. Hands it to `record` as the first topic
    /// of [`Vehicle::BESIDE`](crate::vehicle::Vehicle::BESIDE).
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

    /// True one second after the first of: the mission has reached its `end`; a vehicle that was
    /// `cut` in the air has touched the ground; the first fault has lasted longer than `patience`.
    pub fn is_over(&mut self, now: Instant, end: bool, cut: bool, injector: &Injector, patience: Duration) -> bool {
        let ended = end || cut && self.world.truth_at(now).contact;
        let given_up = injector.first_begun(now).is_some_and(|begun| now.since(begun) > patience);
        (ended || given_up) && now.since(*self.ended.get_or_insert(now)) >= TAIL
    }

    /// The true state now.
    #[must_use]
    pub fn truth(&self) -> Truth {
        self.world.truth_at(self.clock.now())
    }
}

/// Findings for scripts: fields of the JSON object that describes the flight.
#[derive(Debug, Serialize)]
struct Findings {
    outcome: &'static str,
    reason: String,
    expected: &'static str,
    as_expected: bool,
    violations: Vec<&'static str>,
    faults: Vec<String>,
}

impl<M: Measured + Default> Watched<M> {
    /// Before a flight of `legs` legs.
    #[must_use]
    pub fn new(legs: usize) -> Self {
        Self { legs: [0, legs], ..Self::default() }
    }
}

impl<M: Measured> Watched<M> {
    /// Evaluates the truth and the vehicle's state, and reports reached moments to the injector.
    /// Call it at every look.
    pub fn look(&mut self, now: Instant, shown: &Shown, truth: &Truth, injector: &Injector) {
        let Shown { ready, armed, height, stays, moves, lands, turns, scrapes, beside } = *shown;
        // Compression and small hops on the feet stay below this height and do not count as flight.
        let is_clear = height > CLEAR;
        self.armed |= armed;
        self.is_armed = armed;
        if armed && is_clear {
            self.left.get_or_insert(now);
        }
        // Disarmed before the first take-off is not a cut, even if a person lifts the vehicle.
        self.cut |= !armed && is_clear && self.has_flown();
        // Only the first look of a contact counts, and none while a position is held on purpose.
        let touches = truth.contact && !self.touched && self.has_flown() && !is_clear && !stays;
        // Contact decelerates the vehicle within one look: the speed before it counts, too.
        let speed = self.speed.max(M::touch(truth));
        self.look_for_crash(now, truth, speed, scrapes, turns);
        (self.touched, self.speed) = (truth.contact, M::touch(truth));
        if touches {
            self.touchdown = self.touchdown.max(speed);
        }
        if armed {
            self.farthest = self.farthest.max(beside);
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

    fn look_for_crash(&mut self, now: Instant, truth: &Truth, speed: f32, scrapes: u64, turns: bool) {
        // Tipping over slowly with the motors already off causes no damage.
        let scraped = scrapes > self.scrapes && self.armed && (turns || truth.velocity.norm() > HARD);
        let hit = truth.contact && !self.touched && self.has_flown() && speed > HARD;
        self.scrapes = scrapes;
        // A vehicle cut in the air falls; its impact is a consequence of the cut, not a crash of
        // its own.
        if (scraped || hit) && !self.cut {
            self.crash.get_or_insert(Crash { at: now, speed, scraped, turned: Duration::ZERO });
        }
        // Updated as long as the motors turn, so that it ends at the last look at which they did.
        if let Some(crash) = self.crash.as_mut().filter(|_| turns) {
            crash.turned = now.since(crash.at);
        }
    }

    /// True when nothing more can happen: the vehicle was cut in the air, or has crashed and is
    /// disarmed.
    #[must_use]
    pub const fn is_out(&self) -> bool {
        self.cut || self.crash.is_some() && !self.is_armed
    }

    /// Ends the flight. `faults` are those given at its start; faults that a user injects during the
    /// flight do not change the acceptable class. `injector` supplies how often each fault acted;
    /// without it the counts are 0.
    pub fn end(&mut self, faults: &[Fault], injector: Option<&Injector>, last: Truth, armed: bool) {
        self.last = last;
        self.disarmed = self.armed && !armed;
        self.expected = faults.iter().map(Fault::expected).max();
        let changes = |place| injector.map_or(0, |injector| injector.changes(place));
        self.faults = faults.iter().enumerate().map(|(place, fault)| (fault.to_string(), changes(place))).collect();
    }

    /// True once it has left the ground.
    #[must_use]
    pub const fn has_flown(&self) -> bool {
        self.left.is_some()
    }

    fn stands(&self) -> bool {
        self.last.contact && frame::tilt(&self.last.attitude) < LIES
    }
}

impl<M: Measured> Watched<M> {
    /// The class of the outcome.
    #[must_use]
    pub fn class(&self) -> Class {
        // The first condition that applies decides. A cut vehicle falls and may end on its back, so
        // a cut is checked before the final attitude.
        if !self.armed {
            Class::Refused
        } else if self.farthest > M::AWAY {
            Class::FlownAway
        } else if !self.disarmed {
            Class::KeptOn
        } else if self.crash.is_some() {
            Class::Crashed
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

    /// Why the outcome is not better: a sentence without a capital letter, empty when the mission
    /// was flown without degradation.
    #[must_use]
    pub fn reason(&self) -> String {
        let crashed = self.crash.map(|crash| {
            let Crash { speed, scraped, turned, .. } = crash;
            let what =
                if scraped { "something touched the ground that does not carry it" } else { "it touched the ground" };
            format!("{what}, at {speed:.1} m/s; its motors turned for {:.2} s more", turned.seconds_f64())
        });
        let tilt = frame::tilt(&self.last.attitude).to_degrees();
        match self.class() {
            Class::Refused => "it was never armed".into(),
            Class::FlownAway => format!("{:.0} m from where it was to be", self.farthest),
            Class::KeptOn => match crashed {
                Some(crashed) => format!("armed at the end; {crashed}"),
                None => "armed at the end".into(),
            },
            Class::Cut => "its motors stopped in the air".into(),
            Class::Crashed => match crashed {
                Some(crashed) => crashed,
                None if self.touchdown > HARD => format!("it touched the ground at {:.1} m/s", self.touchdown),
                None => format!("it lies at {tilt:.0}\u{b0}"),
            },
            Class::Landed => "it landed before the mission was over".into(),
            Class::Degraded => "its errors were larger than without a fault".into(),
            Class::Transparent => String::new(),
        }
    }

    /// The worst acceptable class. Without faults the mission has to be flown to its end; a stick
    /// file may end in any class up to a crash.
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
        // With faults the class alone decides: a vehicle may rightly land before its mission is
        // finished.
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
            reason: self.reason(),
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
            // Sticks may end in the air or on the ground upside down.
            facts.remove(0);
        }
        facts
    }

    fn figures(&self) -> Vec<Figure> {
        let mut figures = self.measured.figures();
        figures.push(Figure { name: "touchdown_speed_mps", unit: "m/s", value: Some(self.touchdown.into()) });
        figures.push(Figure { name: "largest_tilt_deg", unit: "deg", value: Some(f64::from(self.tilt).to_degrees()) });
        let turned = self.crash.map(|crash| crash.turned.seconds_f64());
        figures.push(Figure { name: "motors_off_after_crash_s", unit: "s", value: turned });
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
        let reason = self.reason();
        match (self.expected, self.succeeded()) {
            (None, true) if self.by_sticks => format!("flown to the end of its sticks: {}", self.class()),
            (None, true) => "landed and disarmed".into(),
            (None, false) => format!("{}: {reason}", self.class().name().to_uppercase()),
            (Some(_), true) => format!("{}, as expected", self.class()),
            (Some(worst), false) => format!("{}, NOT ACCEPTABLE: {worst} at worst; {reason}", self.class()),
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

    /// Flies a take-off and one look per pair of height and sink rate, disarms, and returns the
    /// class.
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

    /// A vehicle that hits the ground at the third look, and whose motors turn until it is disarmed
    /// at look `disarmed`.
    fn crashed(disarmed: u64) -> Watched<Nothing> {
        let (mut watched, injector) = (Watched::<Nothing>::new(0), Injector::new(Instant::ZERO, &[]));
        let mut last = Truth::default();
        for look in 1..=9 {
            let height = if look < 3 { 2.0 } else { 0.0 };
            last =
                Truth { velocity: Vec3::new(0.0, 0.0, if look < 3 { 4.0 } else { 0.0 }), contact: look >= 3, ..last };
            let armed = look < disarmed;
            let shown = Shown { armed, turns: armed, height, ..Shown::default() };
            watched.look(Instant::from_secs(look), &shown, &last, &injector);
            assert_eq!(watched.is_out(), look >= 3 && !armed, "look {look}");
        }
        watched.finished = true;
        watched.end(&[], None, last, disarmed > 9);
        watched
    }

    #[test]
    fn a_crash_is_one_and_says_how_long_the_motors_turned() {
        let watched = crashed(5);
        assert_eq!((watched.class(), watched.succeeded()), (Class::Crashed, false));
        assert!(watched.sentence().starts_with("CRASHED: it touched the ground, at 4.0 m/s"), "{}", watched.sentence());
        let figure =
            |name: &str| watched.figures().into_iter().find(|figure| figure.name == name).map(|found| found.value);
        assert_eq!(figure("motors_off_after_crash_s"), Some(Some(1.0)));
        let watched = crashed(20);
        assert_eq!(watched.class(), Class::KeptOn);
        assert!(watched.reason().contains("armed at the end; it touched the ground"), "{}", watched.reason());
    }

    #[test]
    fn a_part_that_carries_nothing_is_a_crash_and_what_was_stopped_in_the_air_is_none() {
        let injector = Injector::new(Instant::ZERO, &[]);
        let flown = |cut: bool, scrapes: u64| {
            let (mut watched, standing) = (Watched::<Nothing>::new(0), Truth { contact: true, ..Truth::default() });
            let looks = [(true, 0.0, 0), (true, 2.0, 0), (!cut, 2.0, 0), (!cut, 0.0, scrapes), (false, 0.0, scrapes)];
            for (second, (armed, height, scrapes)) in (1..).zip(looks) {
                let truth = Truth { contact: height == 0.0, ..standing };
                let shown = Shown { armed, turns: armed, height, scrapes, ..Shown::default() };
                watched.look(Instant::from_secs(second), &shown, &truth, &injector);
            }
            watched.finished = true;
            watched.end(&[], None, standing, false);
            watched.class()
        };
        assert_eq!(flown(false, 0), Class::Transparent);
        assert_eq!(flown(false, 3), Class::Crashed);
        assert_eq!(flown(true, 3), Class::Cut);
    }

    #[derive(Default)]
    struct Tethered;

    impl Measured for Tethered {
        const AWAY: f64 = 10.0;

        fn is_degraded(&self) -> bool {
            false
        }

        fn figures(&self) -> Vec<Figure> {
            Vec::new()
        }
    }

    #[test]
    fn what_is_far_from_where_it_was_to_be_has_flown_away() {
        let mut watched = Watched::<Tethered>::new(0);
        let injector = Injector::new(Instant::ZERO, &[]);
        for (second, armed, beside) in [(1, true, 2.0), (2, true, 12.0), (3, false, 50.0)] {
            let shown = Shown { armed, beside, ..Shown::default() };
            watched.look(Instant::from_secs(second), &shown, &Truth::default(), &injector);
        }
        watched.end(&[], None, Truth { contact: true, ..Truth::default() }, false);
        assert_eq!((watched.class(), watched.reason().as_str()), (Class::FlownAway, "12 m from where it was to be"));
    }

    #[test]
    fn who_was_never_armed_was_refused() {
        let mut watched = Watched::<Nothing>::new(1);
        watched.end(&[], None, Truth { contact: true, ..Truth::default() }, false);
        assert_eq!(watched.class(), Class::Refused);
    }
}
