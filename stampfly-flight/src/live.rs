//! Applying changed parameters to a running vehicle: which lines of the activation table take them,
//! and when.
//!
//! Consoles and radio links change a configuration; a [`ChangeDetector`] finds out what is new in
//! it. [`Change::detect`] makes a [`Change`] of that, for the owner of the flight loop, which
//! applies it between two passes, with nothing pending, in one of two ways:
//!
//! | the parameter | when | what happens |
//! |---|---|---|
//! | may change [in flight](ParameterInfo::in_flight) | at once, armed or not | [`Adjust`]: the runnables that hold it take it and keep their state |
//! | any other | as soon as the vehicle is disarmed | the lines that hold it begin again, with a new state |
//!
//! Lines that hold no changed parameter keep their state. Either way the observer is told, so that
//! a record takes a key frame and is bit for bit from there.

use crate::flight_loop::{FlightLoop, Observer};
use stampfly_bus::{Schedule, VisitLines};
#[cfg(doc)]
use stampfly_param::ParameterInfo;
use stampfly_param::{ChangeDetector, Parameters};

/// Lines of the activation table, one bit each.
type Lines = u64;

/// Beyond the last bit there are no lines.
#[inline(always)]
const fn bit(line: usize) -> Lines {
    if line < Lines::BITS as usize { 1 << line } else { 0 }
}

/// Runnables that take the parameters that may change [in flight](ParameterInfo::in_flight).
pub trait Adjust: Schedule {
    /// Takes those of this configuration, and none of the others: they wait, and their values are there already. In bounded time, with every state kept. Values
    /// that have not changed change nothing, bit for bit.
    fn adjust(&mut self, config: &Self::Config);

    /// Has a bit for each line of the activation table that [begins again in its place](Self::begin_again), because there is no room on the stack for a second state.
    const IN_PLACE: u64 = 0;

    /// Puts such a line back to power-on, with this configuration: what a new one would be. The others are made anew.
    fn begin_again(&mut self, _line: usize, _config: &Self::Config) {}
}

/// A configuration on its way to whoever has the flight loop.
#[derive(Clone, Debug)]
pub struct Change<C> {
    lines: Lines,
    adjusts: bool,
    config: C,
}

impl<C: Parameters + Clone + PartialEq> Change<C> {
    /// What is new in this configuration since the detector's last comparison. Passes the number
    /// and the value of each changed parameter to `tell`, to publish them. `holders` says which
    /// lines hold the parameter of a name. `None` when nothing has changed that a line holds.
    pub fn detect<I: IntoIterator<Item = usize>>(
        detector: &mut ChangeDetector<C>,
        config: &C,
        holders: impl Fn(&str) -> I,
        tell: &mut dyn FnMut(usize, f32),
    ) -> Option<Self> {
        let (mut lines, mut adjusts) = (0, false);
        detector.detect(config, &mut |index, info, value| {
            tell(index, value);
            if info.in_flight {
                adjusts = true;
            } else {
                holders(info.name).into_iter().for_each(|line| lines |= bit(line));
            }
        });
        (lines != 0 || adjusts).then(|| Self { lines, adjusts, config: config.clone() })
    }
}

impl<C> Change<C> {
    /// The same, with what is left to do of one that is older.
    #[must_use]
    pub fn after(self, earlier: &Self) -> Self {
        Self { lines: self.lines | earlier.lines, adjusts: self.adjusts | earlier.adjusts, ..self }
    }

    /// The same in its place.
    pub const fn follow(&mut self, earlier: &Self) {
        self.lines |= earlier.lines;
        self.adjusts |= earlier.adjusts;
    }

    /// Is there something to do for a vehicle that is armed, or is not?
    #[must_use]
    pub const fn is_due(&self, is_armed: bool) -> bool {
        self.adjusts || !is_armed && self.lines != 0
    }

    /// Does what may be done now, between two passes and with nothing pending: on an armed vehicle what may change in flight, on another one everything.
    /// `observer` is told, so that a record takes a key frame. Returns whether anything was done; what is left [is due](Self::is_due) later.
    ///
    /// A new state is made on the stack, one after the other, or [in its place](Adjust::IN_PLACE).
    pub fn apply<R: Adjust<Config = C>>(
        &mut self,
        is_armed: bool,
        flight_loop: &mut FlightLoop<'_, R>,
        observer: &mut (impl Observer + ?Sized),
    ) -> bool {
        let begins = !is_armed && self.lines != 0;
        if begins {
            R::visit(&mut Renewal { change: self, flight_loop });
            self.lines = 0;
        }
        let adjusts = core::mem::take(&mut self.adjusts);
        if adjusts {
            adjust(flight_loop, &self.config);
        }
        if begins || adjusts {
            observer.renewed();
        }
        begins || adjusts
    }
}

// By itself: no pass needs it.
#[inline(never)]
fn adjust<R: Adjust>(flight_loop: &mut FlightLoop<'_, R>, config: &R::Config) {
    flight_loop.runnables_mut().adjust(config);
}

struct Renewal<'a, 'b, R: Schedule> {
    change: &'a Change<R::Config>,
    flight_loop: &'a mut FlightLoop<'b, R>,
}

impl<R: Adjust> VisitLines for Renewal<'_, '_, R> {
    fn line<const INDEX: usize>(&mut self) {
        let Self { change: Change { lines, config, .. }, flight_loop } = self;
        if lines & bit(INDEX) == 0 {
            return;
        }
        // Known while compiling: no code is made for the other way.
        if R::IN_PLACE & bit(INDEX) != 0 {
            flight_loop.runnables_mut().begin_again(INDEX, config);
        } else {
            flight_loop.renew_line::<INDEX>(config);
        }
    }
}
