//! The topics that a station wants to see, and when each is due.
//!
//! The newest sample of a topic is sent when it is newer than the one before and the station's period has passed: a slow line sees fewer, and none
//! twice. Not for a log: what lies between two samples is not sent.

use crate::view::Samples;
use heapless::Vec;
use stampfly_types::{Duration, Instant};

/// Samples that are sent at once. Polled at 100 Hz, that is forty topics at 20 Hz.
const AT_ONCE: usize = 8;

#[derive(Clone, Copy, Debug)]
struct Watch {
    topic: u16,
    /// ms. In the numbers of the wire: a board has two of these for each topic.
    period: u16,
    next: Instant,
    /// Instant of the sample that was sent last, or [`NEVER`].
    told: Instant,
}

/// No sample is of this instant.
const NEVER: Instant = Instant::from_micros(u64::MAX);

/// Up to `N` of them.
#[derive(Clone, Debug, Default)]
pub struct Watches<const N: usize> {
    all: Vec<Watch, N>,
    /// Where the next look begins, so that none is left out for ever.
    first: usize,
    count: u16,
}

impl<const N: usize> Watches<N> {
    /// None.
    #[must_use]
    pub const fn new() -> Self {
        Self { all: Vec::new(), first: 0, count: 0 }
    }

    /// From now on this topic every `period` ms, or with zero not any more. `false` when there is no room.
    pub fn watch(&mut self, now: Instant, topic: u16, period: u16) -> bool {
        let known = self.all.iter().position(|watch| watch.topic == topic);
        match (known, period) {
            (Some(place), 0) => {
                self.all.swap_remove(place);
                true
            }
            (None, 0) => true,
            (Some(place), _) => {
                self.all.get_mut(place).into_iter().for_each(|watch| watch.period = period);
                true
            }
            (None, _) => self.all.push(Watch { topic, period, next: now, told: NEVER }).is_ok(),
        }
    }

    /// Nothing any more.
    pub fn clear(&mut self) {
        self.all.clear();
    }

    /// Hands out what is due: topic, number of the sample, instant and words.
    pub fn poll(&mut self, now: Instant, samples: &dyn Samples, put: &mut dyn FnMut(u16, u16, Instant, &[u32])) {
        for _ in 0..AT_ONCE {
            let Some((topic, at, words)) = self.next(now, samples) else { return };
            put(topic, self.count, at, words);
        }
    }

    /// One that is due: topic, instant and words.
    pub fn next<'s>(&mut self, now: Instant, samples: &'s dyn Samples) -> Option<(u16, Instant, &'s [u32])> {
        let length = self.all.len();
        for step in 0..length {
            let place = (self.first + step) % length.max(1);
            let Some(watch) = self.all.get_mut(place).filter(|watch| now >= watch.next) else { continue };
            let Some((at, words)) = samples.words(watch.topic.into()).filter(|(at, _)| *at != watch.told) else {
                continue;
            };
            watch.told = at;
            // From the plan, so that late calls do not add up; but never two at once.
            let period = Duration::from_millis(watch.period.into());
            let planned = watch.next + period;
            watch.next = if planned > now { planned } else { now + period };
            self.first = place + 1;
            self.count = self.count.wrapping_add(1);
            return Some((watch.topic, at, words));
        }
        None
    }
}
