//! What the scheduler keeps of one line of the table, and when that line is due.

use crate::line::{ActivationInfo, MAX_TRIGGERS, Trigger};
use crate::topic::AnyTopic;
use stampfly_types::Instant;

/// What the scheduler keeps of one line of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActivationState {
    /// Heads of its triggers when it last started.
    seen: [u32; MAX_TRIGGERS],
    /// The `now` of its last run.
    last: Instant,
    /// What the clock showed at its last run.
    ran: Instant,
    /// How often it has finished.
    runs: u32,
    /// How often the line it follows had finished when it last started.
    followed: u32,
}

impl ActivationState {
    /// A line that has not run since power-on at `start`.
    #[must_use]
    pub const fn new(start: Instant) -> Self {
        Self { seen: [0; MAX_TRIGGERS], last: start, ran: start, runs: 0, followed: 0 }
    }

    /// Words of [`to_words`](Self::to_words).
    pub const WORDS: usize = MAX_TRIGGERS + 6;

    /// Everything, for a record of a flight.
    #[must_use]
    pub fn to_words(&self) -> [u32; Self::WORDS] {
        let [a, b, c, d] = self.seen;
        let [last, ran] = [self.last, self.ran].map(Instant::as_micros);
        [a, b, c, d, last as u32, (last >> 32) as u32, ran as u32, (ran >> 32) as u32, self.runs, self.followed]
    }

    /// The way back.
    #[must_use]
    pub fn from_words(words: [u32; Self::WORDS]) -> Self {
        let [a, b, c, d, last, last_high, ran, ran_high, runs, followed] = words;
        let instant = |low: u32, high: u32| Instant::from_micros(u64::from(low) | u64::from(high) << 32);
        Self { seen: [a, b, c, d], last: instant(last, last_high), ran: instant(ran, ran_high), runs, followed }
    }

    /// When the line is due even if nothing triggers it.
    #[inline]
    pub(crate) fn tick(&self, info: &ActivationInfo) -> Option<Instant> {
        match info.trigger {
            Trigger::Every(period) => Some(self.last + period),
            _ => Some(self.ran + info.at_latest?),
        }
    }

    /// How often it has finished, and with which `now`: what those that run after it have to know.
    #[inline]
    pub(crate) const fn ended(&self) -> (u32, Instant) {
        (self.runs, self.last)
    }

    /// Its `now`, if it is due at `clock`. `before`: of the line that it runs after.
    #[inline(always)]
    pub(crate) fn due(
        &self,
        info: &ActivationInfo,
        before: Option<(u32, Instant)>,
        clock: Instant,
        heads: &[&dyn AnyTopic],
    ) -> Option<Instant> {
        let by_trigger = match info.trigger {
            Trigger::On(topics) => {
                let new = topics.iter().zip(&self.seen).filter_map(|(topic, seen)| {
                    let topic = heads.get(*topic)?;
                    (topic.head() != *seen).then(|| topic.newest_at()).flatten()
                });
                new.max()
            }
            Trigger::After(_) => before.filter(|(runs, _)| *runs != self.followed).map(|(_, last)| last),
            Trigger::Every(_) => None,
        };
        // A deadline that has passed may have been later than the stamp that comes after it.
        by_trigger
            .map(|now| now.max(self.last))
            .or_else(|| self.tick(info).filter(|tick| clock >= *tick).map(|tick| tick.max(self.last)))
    }

    /// It is about to read its inputs.
    #[inline(always)]
    pub(crate) fn start(
        &mut self,
        info: &ActivationInfo,
        before: Option<(u32, Instant)>,
        now: Instant,
        clock: Instant,
        heads: &[&dyn AnyTopic],
    ) {
        if let Trigger::On(topics) = info.trigger {
            for (topic, seen) in topics.iter().zip(&mut self.seen) {
                *seen = heads.get(*topic).map_or(0, |topic| topic.head());
            }
        }
        self.followed = before.map_or(self.followed, |(runs, _)| runs);
        // A tick is on time by definition, so that ticks do not drift with an executor that is late.
        self.ran = if self.tick(info) == Some(now) { now } else { clock };
        self.last = now;
    }

    /// It has published.
    #[inline]
    pub(crate) const fn finish(&mut self) {
        self.runs = self.runs.wrapping_add(1);
    }
}
