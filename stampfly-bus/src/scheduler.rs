//! Which activation is due: the one decision that firmware, simulation and replay share.

use crate::activation_state::ActivationState;
use crate::line::{ActivationInfo, Band};
use crate::schedule::Schedule;
use crate::topic::AnyTopic;
use stampfly_types::Instant;

/// Decides which activation of a table is due. Holds no clock and runs nothing: executors on a microcontroller, on a host and in a
/// replay share it, so they agree on `now`.
///
/// `now` of an activation is the newest stamp of its topics for `on`, the predecessor's `now` for `after`, and the
/// scheduled tick for `every` and `or at latest`; it never goes back.
///
/// `or at latest` counts from when the activation last ran, by the clock, not from its `now`: a stamp is as old as the
/// sensor's delay, and a deadline that counted from it would pass while everything is in order.
pub struct Scheduler<R: Schedule> {
    states: R::States,
}

impl<R: Schedule> Scheduler<R> {
    /// A scheduler at power-on.
    #[must_use]
    pub fn new(start: Instant) -> Self {
        Self { states: R::states(start) }
    }

    /// The `now` of this line, if it is due at `clock`. `heads` are the topics in the topic table's order.
    #[inline]
    #[must_use]
    pub fn due(&self, index: usize, clock: Instant, heads: &[&dyn AnyTopic]) -> Option<Instant> {
        let info = R::ACTIVATIONS.get(index)?;
        self.states.as_ref().get(index)?.due(info, self.before(info), clock, heads)
    }

    /// As [`due`](Self::due), and notes that the activation is about to read its inputs.
    ///
    /// Inlined where the line is known while compiling, it is as short as the line: what its trigger is, is then no question.
    #[inline(always)]
    pub fn start(&mut self, index: usize, clock: Instant, heads: &[&dyn AnyTopic]) -> Option<Instant> {
        let info = R::ACTIVATIONS.get(index)?;
        let before = self.before(info);
        let state = self.states.as_mut().get_mut(index)?;
        let now = state.due(info, before, clock, heads)?;
        state.start(info, before, now, clock, heads);
        Some(now)
    }

    /// The first activation of this band that is due at `clock`, which starts: its line and its `now`.
    ///
    /// An executor that starts each line once, in the table's order, runs a whole chain of `after`s in one pass, because `after`
    /// only names lines above.
    #[must_use]
    pub fn start_first(&mut self, band: Band, clock: Instant, heads: &[&dyn AnyTopic]) -> Option<(usize, Instant)> {
        let mut lines = R::ACTIVATIONS.iter().enumerate().filter(|(_, info)| info.band == band);
        lines.find_map(|(index, _)| Some((index, self.start(index, clock, heads)?)))
    }

    /// Notes that an activation has published: releases the ones that run after it.
    #[inline]
    pub fn finished(&mut self, index: usize) {
        if let Some(state) = self.states.as_mut().get_mut(index) {
            state.finish();
        }
    }

    /// What it keeps of this line.
    #[must_use]
    pub fn state(&self, index: usize) -> Option<&ActivationState> {
        self.states.as_ref().get(index)
    }

    /// Goes on with this line where another scheduler was. A line that does not exist is ignored.
    pub fn set_state(&mut self, index: usize, state: ActivationState) {
        if let Some(place) = self.states.as_mut().get_mut(index) {
            *place = state;
        }
    }

    /// The next instant at which a period or a deadline makes something due.
    #[must_use]
    pub fn next_tick(&self) -> Option<Instant> {
        R::ACTIVATIONS.iter().zip(self.states.as_ref()).filter_map(|(info, state)| state.tick(info)).min()
    }

    /// Of the line that this one runs after.
    #[inline(always)]
    fn before(&self, info: &ActivationInfo) -> Option<(u32, Instant)> {
        info.trigger.before().and_then(|before| self.states.as_ref().get(before)).map(ActivationState::ended)
    }
}
