//! The contract: what a vehicle, a mode and a stage are, and how a stage says what comes next.
//!
//! Implement [`Vehicle`] once, [`Mode`] once for each mode, [`Stage`] once for each stage; [`stages!`](crate::stages) writes
//! [`Stages`]. Nothing here calls anything: [`Selector`](super::Selector) does.

use core::fmt;
use stampfly_types::{Duration, Instant};

/// What all modes of a vehicle are told, and what each of them answers.
pub trait Vehicle {
    /// Everything a mode may look at in one cycle: telemetry, estimate, settings.
    type Input<'a>;
    /// Everything a mode demands in one cycle.
    type Output;
}

/// What a mode looks at in one cycle.
pub type Input<'a, M> = <<M as Mode>::Vehicle as Vehicle>::Input<'a>;
/// What a mode demands in one cycle.
pub type Output<M> = <<M as Mode>::Vehicle as Vehicle>::Output;
/// The current stage of a mode, with all that it remembers.
pub type Memory<M> = <<M as Mode>::Stage as Stages<M>>::Memory;

/// A mode: what a vehicle does from one decision to the next, in stages. The value is what its stages share.
///
/// A mode knows neither the modes before it nor those after it; it says how it has ended.
pub trait Mode: Clone + fmt::Debug + PartialEq {
    /// Whose mode it is.
    type Vehicle: Vehicle;
    /// The names of its stages, made by [`stages!`](crate::stages).
    type Stage: Stages<Self>;
    /// How it can end; [`Infallible`](core::convert::Infallible) for a mode that does not end by itself.
    type End;
    /// The stage that it begins with, every time it is entered.
    const FIRST: Self::Stage;

    /// Begins, without any memory of the last time. The first stage is entered next.
    fn enter(now: Instant, input: &Input<'_, Self>) -> Self;

    /// Ends, after the exit of its current stage.
    fn exit(&mut self, _now: Instant, _input: &Input<'_, Self>) {}
}

/// A stage of the mode `M`. It exists from its entry to its exit, so that nothing is left of the last time.
pub trait Stage<M: Mode>: Sized {
    /// Begins.
    fn enter(mode: &mut M, now: Instant, input: &Input<'_, M>) -> Self;

    /// How long it may last, and what follows then; or why it has no limit.
    fn limit(&self, mode: &M) -> Limit<M>;

    /// One cycle: either what it demands, or what comes next. Then the successor makes the demand of this cycle.
    fn execute(&mut self, mode: &mut M, now: Instant, input: &Input<'_, M>) -> Step<M>;

    /// Ends: its successor is entered next, or its mode ends.
    fn exit(&mut self, _mode: &mut M, _now: Instant, _input: &Input<'_, M>) {}

    /// What is printed after its name. A mode as a stage adds the stage that it is in.
    ///
    /// # Errors
    /// Those of the formatter.
    fn describe(&self, _: &mut fmt::Formatter<'_>) -> fmt::Result {
        Ok(())
    }
}

/// What a stage says in one cycle.
pub enum Step<M: Mode> {
    /// It goes on and demands this.
    Stay(Output<M>),
    /// This stage of the same mode takes over at once.
    Stage(M::Stage),
    /// Its mode has ended.
    End(M::End),
    /// It cannot go on with this input. It stays the current stage, and is executed again in the next cycle.
    Fail(Failure),
}

/// How long a stage may last, counted from its entry.
pub enum Limit<M: Mode> {
    /// After this time, this stage takes over.
    Stage(Duration, M::Stage),
    /// After this time, the mode has ended in this way.
    End(Duration, M::End),
    /// It lasts as long as it has to; here is why that is right.
    Unlimited(&'static str),
}

/// Why a cycle has no output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Failure {
    /// A stage cannot do its work.
    Stage,
    /// Stages or modes handed over to each other in a circle.
    Circle,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Stage => "a stage cannot do its work",
            Self::Circle => "stages hand over in a circle",
        })
    }
}

impl core::error::Error for Failure {}

/// The names of a mode's stages. Made by [`stages!`](crate::stages), called by the runner; not for use by hand.
pub trait Stages<M: Mode>: Copy + Eq + fmt::Debug {
    /// One of the stages, with all that it remembers.
    type Memory: Clone + fmt::Debug + PartialEq;

    /// Which stage it is.
    fn name(memory: &Self::Memory) -> Self;
    /// [`Stage::enter`].
    fn enter(self, mode: &mut M, now: Instant, input: &Input<'_, M>) -> Self::Memory;
    /// [`Stage::limit`].
    fn limit(memory: &Self::Memory, mode: &M) -> Limit<M>;
    /// [`Stage::execute`].
    fn execute(memory: &mut Self::Memory, mode: &mut M, now: Instant, input: &Input<'_, M>) -> Step<M>;
    /// [`Stage::exit`].
    fn exit(memory: &mut Self::Memory, mode: &mut M, now: Instant, input: &Input<'_, M>);
    /// [`Stage::describe`].
    ///
    /// # Errors
    /// Those of the formatter.
    fn describe(memory: &Self::Memory, f: &mut fmt::Formatter<'_>) -> fmt::Result;
}

/// Which mode follows when the mode `M` has ended. A vehicle's implementations are its table of hand-overs.
pub trait HandOver<M: Mode>: Mode {
    /// The mode that follows.
    fn after(&mut self, end: M::End) -> Self::Stage;
}
