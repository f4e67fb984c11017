//! The flight loop: runs what is due, in table order, and reports it to an observer.
//!
//! One loop for every executor. On a microcontroller the task that the bus's hook wakes calls it; on a host the virtual
//! clock does; a replay and the golden flight call it with what was recorded. It reads no clock: the caller says what
//! time it is.

use core::mem::MaybeUninit;
use stampfly_bus::{
    Activation, ActivationState, AnyTopic, Band, Hook, PublishWords, Schedule, Scheduler, Split, TopicTable, VisitLines,
};
use stampfly_types::{ActivationRecord, Instant};

/// Where each line of the activation table is between two activations.
pub trait Positions {
    /// How far a line has read each of its inputs.
    fn inputs(&mut self, line: usize) -> ActivationRecord;

    /// What the scheduler keeps of it. `None` for a line that does not exist.
    fn state(&self, line: usize) -> Option<ActivationState>;
}

/// How a pass ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// Every line of the band that was due has published.
    Band,
    /// This line has published.
    Line(usize),
    /// This line has read its inputs, and will [resume](Observer::resumes).
    HasRead(usize),
}

/// Is told of activations: a log, a profiler.
pub trait Observer {
    /// This band is about to look what is due at `clock`.
    fn pass_begins(&mut self, _band: Band, _clock: Instant) {}

    /// It has looked, and something ran.
    fn pass_ends(&mut self, _band: Band, _ended: Ended, _positions: &mut dyn Positions) {}

    /// What had read its inputs is about to run.
    fn resumes(&mut self, _index: usize) {}

    /// A runnable is about to read its inputs.
    fn starts(&mut self, _index: usize) {}

    /// A runnable has read its inputs. A replay repeats activations in the order of these calls.
    fn has_read(&mut self, _activation: &Activation) {}

    /// A runnable has published. Only now it is known what a full queue has refused.
    fn finished(&mut self, _activation: &Activation) {}

    /// Between two passes, a runnable [began again](FlightLoop::renew) or took [other parameters](crate::live): a record goes on from a key frame.
    fn renewed(&mut self) {}
}

/// Nothing to report to.
impl Observer for () {}

/// Two observers.
impl<A: Observer, B: Observer> Observer for (A, B) {
    fn pass_begins(&mut self, band: Band, clock: Instant) {
        self.0.pass_begins(band, clock);
        self.1.pass_begins(band, clock);
    }

    fn pass_ends(&mut self, band: Band, ended: Ended, positions: &mut dyn Positions) {
        self.0.pass_ends(band, ended, positions);
        self.1.pass_ends(band, ended, positions);
    }

    fn resumes(&mut self, index: usize) {
        self.0.resumes(index);
        self.1.resumes(index);
    }

    fn starts(&mut self, index: usize) {
        self.0.starts(index);
        self.1.starts(index);
    }

    fn has_read(&mut self, activation: &Activation) {
        self.0.has_read(activation);
        self.1.has_read(activation);
    }

    fn finished(&mut self, activation: &Activation) {
        // The other way round, so that the inner one of two profilers does not time the outer one.
        self.1.finished(activation);
        self.0.finished(activation);
    }

    fn renewed(&mut self) {
        self.0.renewed();
        self.1.renewed();
    }
}

/// An observer, if there is one.
impl<O: Observer> Observer for Option<O> {
    fn pass_begins(&mut self, band: Band, clock: Instant) {
        if let Some(observer) = self {
            observer.pass_begins(band, clock);
        }
    }

    fn pass_ends(&mut self, band: Band, ended: Ended, positions: &mut dyn Positions) {
        if let Some(observer) = self {
            observer.pass_ends(band, ended, positions);
        }
    }

    fn resumes(&mut self, index: usize) {
        if let Some(observer) = self {
            observer.resumes(index);
        }
    }

    fn starts(&mut self, index: usize) {
        if let Some(observer) = self {
            observer.starts(index);
        }
    }

    fn has_read(&mut self, activation: &Activation) {
        if let Some(observer) = self {
            observer.has_read(activation);
        }
    }

    fn finished(&mut self, activation: &Activation) {
        if let Some(observer) = self {
            observer.finished(activation);
        }
    }

    fn renewed(&mut self) {
        if let Some(observer) = self {
            observer.renewed();
        }
    }
}

impl<O: Observer + ?Sized> Observer for &mut O {
    fn pass_begins(&mut self, band: Band, clock: Instant) {
        (**self).pass_begins(band, clock);
    }

    fn pass_ends(&mut self, band: Band, ended: Ended, positions: &mut dyn Positions) {
        (**self).pass_ends(band, ended, positions);
    }

    fn resumes(&mut self, index: usize) {
        (**self).resumes(index);
    }

    fn starts(&mut self, index: usize) {
        (**self).starts(index);
    }

    fn has_read(&mut self, activation: &Activation) {
        (**self).has_read(activation);
    }

    fn finished(&mut self, activation: &Activation) {
        (**self).finished(activation);
    }

    fn renewed(&mut self) {
        (**self).renewed();
    }
}

/// A background activation that has read its inputs and not yet run.
#[derive(Debug)]
pub struct Pending(Activation);

/// A vehicle's runnables with their ends and the scheduler that drives them.
///
/// Large: borrow it where the stack is small.
pub struct FlightLoop<'b, R: Schedule> {
    lines: Lines<'b, R>,
    /// Of the band that runs: to make a new one takes longer than many a runnable.
    activation: Activation,
}

/// The lines of the activation table: what runs, on what, when.
struct Lines<'b, R: Schedule> {
    runnables: R,
    ends: <R::Topics as TopicTable>::Ends<'b>,
    scheduler: Scheduler<R>,
    heads: <R::Topics as TopicTable>::Heads<'b>,
}

/// A vehicle at power-on.
pub struct Assembled<'b, R: Schedule> {
    /// Every runnable, with the scheduler.
    pub flight_loop: FlightLoop<'b, R>,
    /// The ends of everybody outside.
    pub outside: <R::Topics as TopicTable>::Outside<'b>,
    /// The log's cursors.
    pub taps: <R::Topics as TopicTable>::Taps<'b>,
}

/// A vehicle at power-on, whose flight loop lies elsewhere.
pub struct InPlace<'b, R: Schedule> {
    /// Every runnable, with the scheduler.
    pub flight_loop: &'b mut FlightLoop<'b, R>,
    /// The ends of everybody outside.
    pub outside: <R::Topics as TopicTable>::Outside<'b>,
    /// The log's cursors.
    pub taps: <R::Topics as TopicTable>::Taps<'b>,
}

impl<'b, R: Schedule> Assembled<'b, R> {
    /// Connects runnables to a fresh bus. `hook` is called after every publish, the scheduler counts from `start`.
    ///
    /// Never inlined: what it needs on the stack beside its result is free again when the vehicle flies.
    #[inline(never)]
    #[must_use]
    pub fn new(bus: &'b mut R::Topics, hook: Option<Hook>, config: &R::Config, start: Instant) -> Self {
        let Split { runnables: ends, outside, taps, heads } = bus.split(hook);
        let scheduler = Scheduler::new(start);
        let lines = Lines { runnables: R::new(config), ends, scheduler, heads };
        Self { flight_loop: FlightLoop { lines, activation: Activation::live(0, start) }, outside, taps }
    }

    /// As [`new`](Self::new), for a stack that has no room for a copy of the flight loop: it is made in `slot`.
    #[inline(never)]
    #[must_use]
    pub fn in_place(
        slot: &'b mut MaybeUninit<FlightLoop<'b, R>>,
        bus: &'b mut R::Topics,
        hook: Option<Hook>,
        config: &R::Config,
        start: Instant,
    ) -> InPlace<'b, R> {
        let Split { runnables: ends, outside, taps, heads } = bus.split(hook);
        let scheduler = Scheduler::new(start);
        // Nothing large has a name here: it would be made on the stack, and copied.
        let flight_loop = slot.write(FlightLoop {
            lines: Lines { runnables: R::new(config), ends, scheduler, heads },
            activation: Activation::live(0, start),
        });
        InPlace { flight_loop, outside, taps }
    }
}

impl<'b, R: Schedule> FlightLoop<'b, R> {
    /// The runnables: the state of the vehicle.
    #[must_use]
    pub const fn runnables(&self) -> &R {
        &self.lines.runnables
    }

    /// Puts another state in the place of the present one, as a key frame does.
    pub fn set_runnables(&mut self, runnables: R) {
        self.lines.runnables = runnables;
    }

    /// Puts one runnable back to power-on, with this configuration: between two passes, and only where nothing depends on what it
    /// has learned, as on a vehicle that is disarmed. A log has to say so: mark a loss, and take a key frame.
    // By itself: no pass needs it.
    #[inline(never)]
    pub fn renew(&mut self, index: usize, config: &R::Config) {
        self.lines.runnables.renew(index, config);
    }

    /// The same for a line that is known here: no other's new state takes stack.
    #[inline(never)]
    pub(crate) fn renew_line<const INDEX: usize>(&mut self, config: &R::Config) {
        self.lines.runnables.renew(INDEX, config);
    }

    /// The runnables, to give them other parameters.
    pub(crate) const fn runnables_mut(&mut self) -> &mut R {
        &mut self.lines.runnables
    }

    /// Every topic without its type, in the table's order.
    #[must_use]
    pub fn heads(&self) -> &[&'b dyn AnyTopic] {
        self.lines.heads.as_ref()
    }

    /// Is anything due in this band?
    // One copy for both bands: what is fetched for the second is there already.
    #[inline(never)]
    #[must_use]
    pub fn is_due(&self, band: Band, clock: Instant) -> bool {
        let mut lines = R::ACTIVATIONS.iter().enumerate().filter(|(_, info)| info.band == band);
        lines.any(|(index, _)| self.lines.scheduler.due(index, clock, self.heads()).is_some())
    }

    /// Runs everything that is due in this band, in one pass through the table. Returns whether anything ran.
    // By itself, so that firmware can keep it in RAM: every pass goes through all of it once.
    #[inline(never)]
    pub fn run_band(&mut self, band: Band, clock: Instant, observer: &mut (impl Observer + ?Sized)) -> bool {
        observer.pass_begins(band, clock);
        let mut pass = Pass { flight_loop: &mut *self, band, clock, observer: &mut *observer, ran: false };
        R::visit(&mut pass);
        let ran = pass.ran;
        if ran {
            observer.pass_ends(band, Ended::Band, &mut self.lines);
        }
        ran
    }

    /// Runs the first line of this band that is due. Returns whether there was one.
    pub fn run_next(&mut self, band: Band, clock: Instant, observer: &mut (impl Observer + ?Sized)) -> bool {
        observer.pass_begins(band, clock);
        let Self { lines, activation } = self;
        let Some((index, now)) = lines.start_first(band, clock) else { return false };
        lines.run(index, now, activation, observer);
        observer.pass_ends(band, Ended::Line(index), lines);
        true
    }

    /// Lets the next due activation of this band read its inputs. What is published before [`finish`](Self::finish)
    /// belongs to its next activation, as if it had been interrupted.
    pub fn start_next(
        &mut self,
        band: Band,
        clock: Instant,
        observer: &mut (impl Observer + ?Sized),
    ) -> Option<Pending> {
        observer.pass_begins(band, clock);
        let (index, now) = self.lines.start_first(band, clock)?;
        let mut activation = Activation::live(index as u8, now);
        self.lines.read(index, &mut activation, observer);
        observer.pass_ends(band, Ended::HasRead(index), &mut self.lines);
        Some(Pending(activation))
    }

    /// Runs what has read its inputs.
    pub fn finish(&mut self, Pending(mut activation): Pending, observer: &mut (impl Observer + ?Sized)) {
        let index = usize::from(activation.record().index);
        observer.resumes(index);
        self.lines.complete(index, &mut activation, observer);
    }

    /// Lets one line read its inputs if it is due, for a replay that decides again what is.
    #[cfg(feature = "replay")]
    pub(crate) fn start_line(&mut self, index: usize, clock: Instant, observer: &mut impl Observer) -> Option<Pending> {
        let now = self.lines.scheduler.start(index, clock, self.lines.heads.as_ref())?;
        let mut activation = Activation::live(index as u8, now);
        self.lines.read(index, &mut activation, observer);
        Some(Pending(activation))
    }

    /// The first line of this band that is due.
    #[cfg(feature = "replay")]
    pub(crate) fn first_due(&self, band: Band, clock: Instant) -> Option<usize> {
        let mut lines = R::ACTIVATIONS.iter().enumerate().filter(|(_, info)| info.band == band);
        let due = |index| self.lines.scheduler.due(index, clock, self.lines.heads.as_ref()).is_some();
        lines.find_map(|(index, _)| due(index).then_some(index))
    }

    /// Runs what has read its inputs, with what queues refused it when it was recorded.
    #[cfg(feature = "replay")]
    pub(crate) fn finish_with(&mut self, Pending(activation): Pending, refused: u32, observer: &mut impl Observer) {
        self.finish(Pending(activation.with_refusals(refused)), observer);
    }

    /// Puts a line where it was. `false` when it cannot have been there.
    #[cfg(feature = "replay")]
    pub(crate) fn set_position(&mut self, record: ActivationRecord, state: ActivationState) -> bool {
        let index = usize::from(record.index);
        let mut sought = Activation::seek(record);
        R::read(&mut self.lines.ends, index, &mut sought);
        self.lines.scheduler.set_state(index, state);
        !sought.is_missing_input()
    }

    /// Runs one line, due or not.
    pub(crate) fn activate(&mut self, index: usize, now: Instant) -> ActivationRecord {
        let mut activation = Activation::live(index as u8, now);
        self.lines.activate(index, &mut activation);
        *activation.record()
    }

    pub(crate) fn ends_mut(&mut self) -> &mut <R::Topics as TopicTable>::Ends<'b> {
        &mut self.lines.ends
    }

    /// Repeats a recorded activation. Returns it as it went this time.
    pub fn replay(&mut self, record: ActivationRecord) -> Activation {
        let index = usize::from(record.index);
        let mut activation = Activation::replay(record);
        self.lines.activate(index, &mut activation);
        activation
    }

    /// Reads the inputs of an activation that ran elsewhere, as it read them there, and runs nothing: this bus is then where
    /// that one is, as far as readers go. Returns it as it was.
    pub fn follow(&mut self, record: ActivationRecord) -> Activation {
        let mut activation = Activation::replay(record);
        R::read(&mut self.lines.ends, usize::from(record.index), &mut activation);
        activation
    }

    /// Publishes what a runnable published elsewhere, as [`publish_words`](PublishWords::publish_words) does.
    pub fn publish_words(&mut self, topic: usize, at: Instant, words: &[u32]) -> Option<u32> {
        self.lines.ends.publish_words(topic, at, words)
    }

    /// Puts a sample that a runnable published back on the bus, as
    /// [`restore_words`](PublishWords::restore_words) does.
    pub fn restore_words(&mut self, topic: usize, at: Instant, generation: u32, words: &[u32]) -> Option<()> {
        self.lines.ends.restore_words(topic, at, generation, words)
    }

    /// The next instant at which a period or a deadline makes something due.
    #[must_use]
    pub fn next_tick(&self) -> Option<Instant> {
        self.lines.scheduler.next_tick()
    }
}

impl<R: Schedule> Positions for Lines<'_, R> {
    fn inputs(&mut self, line: usize) -> ActivationRecord {
        let mut note = Activation::note(line as u8);
        R::read(&mut self.ends, line, &mut note);
        *note.record()
    }

    fn state(&self, line: usize) -> Option<ActivationState> {
        self.scheduler.state(line).copied()
    }
}

impl<R: Schedule> Lines<'_, R> {
    fn start_first(&mut self, band: Band, clock: Instant) -> Option<(usize, Instant)> {
        self.scheduler.start_first(band, clock, self.heads.as_ref())
    }

    /// Runs a line that has started.
    #[inline(always)]
    fn run(
        &mut self,
        index: usize,
        now: Instant,
        activation: &mut Activation,
        observer: &mut (impl Observer + ?Sized),
    ) {
        activation.begin(index as u8, now);
        self.read(index, activation, observer);
        self.complete(index, activation, observer);
    }

    #[inline(always)]
    fn read(&mut self, index: usize, activation: &mut Activation, observer: &mut (impl Observer + ?Sized)) {
        observer.starts(index);
        R::read(&mut self.ends, index, activation);
        observer.has_read(activation);
    }

    #[inline(always)]
    fn complete(&mut self, index: usize, activation: &mut Activation, observer: &mut (impl Observer + ?Sized)) {
        self.runnables.run(&mut self.ends, index, activation);
        self.scheduler.finished(index);
        observer.finished(activation);
    }

    /// Runs one line whether it is due or not, and tells nobody.
    fn activate(&mut self, index: usize, activation: &mut Activation) {
        R::read(&mut self.ends, index, activation);
        self.runnables.run(&mut self.ends, index, activation);
    }
}

/// One pass of a band through the table.
struct Pass<'p, 'b, R: Schedule, O: ?Sized> {
    flight_loop: &'p mut FlightLoop<'b, R>,
    band: Band,
    clock: Instant,
    observer: &'p mut O,
    /// Did anything run?
    ran: bool,
}

impl<R: Schedule, O: Observer + ?Sized> VisitLines for Pass<'_, '_, R, O> {
    #[inline(always)]
    fn line<const INDEX: usize>(&mut self) {
        let FlightLoop { lines, activation } = &mut *self.flight_loop;
        let is_of_band = R::ACTIVATIONS.get(INDEX).is_some_and(|info| info.band == self.band);
        if is_of_band && let Some(now) = lines.scheduler.start(INDEX, self.clock, lines.heads.as_ref()) {
            lines.run(INDEX, now, activation, self.observer);
            self.ran = true;
        }
    }
}
