//! A mode that runs: the one place that enters, executes and leaves stages.
//!
//! It is also a stage of the mode above it: what a vehicle does is a mode whose stages are modes. So there is one runner for
//! both levels, and no level knows how many there are.

use super::traits::{Failure, HandOver, Input, Limit, Memory, Mode, Output, Stage, Stages, Step};
use core::fmt;
use stampfly_types::Instant;

/// Hand-overs in one cycle on one level; more are a circle. A chain of stages that have nothing to do is shorter.
const HAND_OVERS: u8 = 8;

/// A mode that has been entered and not been left, in its current stage. Only a [`Selector`](super::Selector), or an active
/// mode above it, can make one.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(bound(
        serialize = "M: serde::Serialize, Memory<M>: serde::Serialize",
        deserialize = "M: serde::Deserialize<'de>, Memory<M>: serde::Deserialize<'de>"
    ))
)]
pub struct Active<M: Mode> {
    mode: M,
    stage: Memory<M>,
    since: Instant,
}

/// How a cycle of a mode has ended.
pub(super) enum Ran<M: Mode> {
    /// With a demand.
    Output(Output<M>),
    /// With the mode.
    End(M::End),
    /// With nothing.
    Failed(Failure),
}

impl<M: Mode> Active<M> {
    /// Enters the mode, and this stage of it.
    pub(super) fn begin(first: M::Stage, now: Instant, input: &Input<'_, M>) -> Self {
        let mut mode = M::enter(now, input);
        let stage = first.enter(&mut mode, now, input);
        Self { mode, stage, since: now }
    }

    /// Leaves the current stage and enters another one, or the same one anew.
    pub(super) fn change(&mut self, next: M::Stage, now: Instant, input: &Input<'_, M>) {
        M::Stage::exit(&mut self.stage, &mut self.mode, now, input);
        self.stage = next.enter(&mut self.mode, now, input);
        self.since = now;
    }

    /// One cycle.
    pub(super) fn run(&mut self, now: Instant, input: &Input<'_, M>) -> Ran<M> {
        let age = now.since(self.since);
        let mut step = match M::Stage::limit(&self.stage, &self.mode) {
            Limit::Stage(time, next) if age >= time => Step::Stage(next),
            Limit::End(time, end) if age >= time => Step::End(end),
            Limit::Stage(..) | Limit::End(..) | Limit::Unlimited(_) => self.execute(now, input),
        };
        let mut left = HAND_OVERS;
        loop {
            match step {
                Step::Stage(_) if left == 0 => return Ran::Failed(Failure::Circle),
                Step::Stage(next) => {
                    left -= 1;
                    self.change(next, now, input);
                    step = self.execute(now, input);
                }
                Step::Stay(output) => return Ran::Output(output),
                Step::End(end) => return Ran::End(end),
                Step::Fail(failure) => return Ran::Failed(failure),
            }
        }
    }

    fn execute(&mut self, now: Instant, input: &Input<'_, M>) -> Step<M> {
        M::Stage::execute(&mut self.stage, &mut self.mode, now, input)
    }

    /// Leaves the current stage and the mode.
    pub(super) fn end(&mut self, now: Instant, input: &Input<'_, M>) {
        M::Stage::exit(&mut self.stage, &mut self.mode, now, input);
        self.mode.exit(now, input);
    }

    /// What its stages share.
    #[must_use]
    pub const fn mode(&self) -> &M {
        &self.mode
    }

    /// The name of the current stage.
    #[must_use]
    pub fn stage(&self) -> M::Stage {
        M::Stage::name(&self.stage)
    }

    /// The current stage, with what it remembers.
    #[must_use]
    pub const fn memory(&self) -> &Memory<M> {
        &self.stage
    }

    /// When the current stage was entered.
    #[must_use]
    pub const fn since(&self) -> Instant {
        self.since
    }
}

/// The name of the current stage, and of the stages within it: `Landing/Flare`.
impl<M: Mode> fmt::Display for Active<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.stage())?;
        M::Stage::describe(&self.stage, f)
    }
}

/// A mode is a stage of the mode above it.
impl<P, M> Stage<P> for Active<M>
where
    P: HandOver<M>,
    M: Mode<Vehicle = P::Vehicle>,
{
    fn enter(_: &mut P, now: Instant, input: &Input<'_, P>) -> Self {
        Self::begin(M::FIRST, now, input)
    }

    fn limit(&self, _: &P) -> Limit<P> {
        Limit::Unlimited("its stages have limits")
    }

    fn execute(&mut self, above: &mut P, now: Instant, input: &Input<'_, P>) -> Step<P> {
        match self.run(now, input) {
            Ran::Output(output) => Step::Stay(output),
            Ran::End(end) => Step::Stage(above.after(end)),
            Ran::Failed(failure) => Step::Fail(failure),
        }
    }

    fn exit(&mut self, _: &mut P, now: Instant, input: &Input<'_, P>) {
        self.end(now, input);
    }

    fn describe(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "/{self}")
    }
}
