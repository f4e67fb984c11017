//! The selector: the one call behind which the current mode is hidden.

use super::active::{Active, Ran};
use super::traits::{Failure, Input, Mode, Output};
use core::convert::Infallible;
use core::fmt;
use stampfly_types::Instant;

/// How the last cycle ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Cycle {
    /// There has been none since power-on, a switch or an abort.
    #[default]
    None,
    /// With a demand.
    Completed,
    /// Without one.
    Failed(Failure),
}

/// Runs a vehicle: a mode whose stages are its modes. A mode alone can be run, too.
///
/// It begins with the first stage at the first [`execute`](Self::execute), and again after an [`abort`](Self::abort). Before it
/// is thrown away in flight, abort it: a stage that is dropped is not left.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(bound(serialize = "Active<M>: serde::Serialize", deserialize = "Active<M>: serde::Deserialize<'de>"))
)]
pub struct Selector<M: Mode<End = Infallible>> {
    active: Option<Active<M>>,
    cycle: Cycle,
}

impl<M: Mode<End = Infallible>> Default for Selector<M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M: Mode<End = Infallible>> Selector<M> {
    /// Nothing runs yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { active: None, cycle: Cycle::None }
    }

    /// One cycle of whatever mode is current.
    ///
    /// # Errors
    /// [`Failure::Stage`] when the current stage cannot do its work, [`Failure::Circle`] when stages or modes hand over to each
    /// other without end. The stage stays current, and is executed again in the next cycle.
    pub fn execute(&mut self, now: Instant, input: &Input<'_, M>) -> Result<Output<M>, Failure> {
        let active = self.active.get_or_insert_with(|| Active::begin(M::FIRST, now, input));
        match active.run(now, input) {
            Ran::Output(output) => {
                self.cycle = Cycle::Completed;
                Ok(output)
            }
            Ran::Failed(failure) => {
                self.cycle = Cycle::Failed(failure);
                Err(failure)
            }
            Ran::End(never) => match never {},
        }
    }

    /// Leaves the current mode and enters this one, in its first stage; the same one begins anew. It is executed in the next
    /// [`execute`](Self::execute).
    pub fn switch(&mut self, mode: M::Stage, now: Instant, input: &Input<'_, M>) {
        match &mut self.active {
            Some(active) => active.change(mode, now, input),
            None => self.active = Some(Active::begin(mode, now, input)),
        }
        self.cycle = Cycle::None;
    }

    /// Leaves the current stage and the current mode. Nothing runs until the next [`execute`](Self::execute) or
    /// [`switch`](Self::switch).
    pub fn abort(&mut self, now: Instant, input: &Input<'_, M>) {
        if let Some(mut active) = self.active.take() {
            active.end(now, input);
        }
        self.cycle = Cycle::None;
    }

    /// The current mode; `None` while nothing runs.
    #[must_use]
    pub fn mode(&self) -> Option<M::Stage> {
        self.active.as_ref().map(Active::stage)
    }

    /// What runs, with all that it remembers.
    #[must_use]
    pub const fn active(&self) -> Option<&Active<M>> {
        self.active.as_ref()
    }

    /// How the last cycle ended.
    #[must_use]
    pub const fn cycle(&self) -> Cycle {
        self.cycle
    }

    /// Has the last cycle failed?
    #[must_use]
    pub const fn is_error(&self) -> bool {
        matches!(self.cycle, Cycle::Failed(_))
    }
}

/// The current mode and its stage: `Landing/Flare`. A dash while nothing runs.
impl<M: Mode<End = Infallible>> fmt::Display for Selector<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.active {
            Some(active) => active.fmt(f),
            None => f.write_str("-"),
        }
    }
}
