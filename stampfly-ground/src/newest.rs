//! The newest sample of every topic of one vehicle: written by its flight, read by the sockets.
//!
//! A flight publishes some forty thousand samples a second, so noting one costs a lock that is hardly ever held and a copy of
//! its words. A socket that reads holds one topic's lock while it copies that topic's words, nothing else. Not for the log:
//! what lies between two looks is not kept.

use stampfly_bus::Schedule;
use stampfly_flight::Observer;
use stampfly_sim::vehicle::Witness;
use stampfly_types::Instant;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// A topic's newest sample.
#[derive(Debug, Default)]
struct Slot {
    at: Instant,
    /// Samples so far; zero before the first.
    count: u64,
    words: Vec<u32>,
}

/// See the module.
#[derive(Debug)]
pub struct Newest {
    slots: Vec<Mutex<Slot>>,
    /// Of each topic: has somebody looked for a new sample?
    looked: Vec<AtomicBool>,
    /// Topics of the bus: those beside it come after them.
    bus: usize,
    /// The vehicle's clock, µs.
    clock: AtomicU64,
}

impl Newest {
    /// Nothing yet, for topics of so many words, of which so many are on the bus.
    pub fn new(words: impl Iterator<Item = usize>, bus: usize) -> Self {
        let slots: Vec<_> = words.map(|words| Mutex::new(Slot { words: vec![0; words], ..Slot::default() })).collect();
        let looked = slots.iter().map(|_| AtomicBool::new(false)).collect();
        Self { slots, looked, bus, clock: AtomicU64::new(0) }
    }

    fn note(&self, topic: usize, at: Instant, words: &[u32]) {
        let Some(slot) = self.slots.get(topic) else { return };
        let mut slot = slot.lock().unwrap_or_else(PoisonError::into_inner);
        slot.at = at;
        slot.count += 1;
        slot.words.iter_mut().zip(words).for_each(|(to, from)| *to = *from);
    }

    /// The topics for which somebody has looked since the last call.
    pub fn looked(&self) -> Vec<usize> {
        let all = self.looked.iter().enumerate();
        all.filter(|(_, looked)| looked.swap(false, Ordering::Relaxed)).map(|(topic, _)| topic).collect()
    }

    pub fn clock(&self) -> Instant {
        Instant::from_micros(self.clock.load(Ordering::Relaxed))
    }

    /// The newest sample of a topic, if more than `seen` have come: its instant and number. Its words are put into `words`.
    pub fn after(&self, topic: usize, seen: u64, words: &mut Vec<u32>) -> Option<(Instant, u64)> {
        self.looked.get(topic)?.store(true, Ordering::Relaxed);
        let slot = self.slots.get(topic)?.lock().unwrap_or_else(PoisonError::into_inner);
        if slot.count == seen {
            return None;
        }
        words.clone_from(&slot.words);
        Some((slot.at, slot.count))
    }
}

/// Keeps the newest samples of one vehicle for the pages: a [`Witness`] of its flight, to be paired with a recorder.
#[derive(Clone, Debug)]
pub struct Watch(pub Arc<Newest>);

impl Watch {
    /// The vehicle has started anew, and its clock with it.
    pub fn restarted(&self) {
        self.0.clock.store(0, Ordering::Relaxed);
    }

    /// Takes a sample from elsewhere than a flight, such as a log: the topic's place in the card.
    pub fn note(&self, topic: usize, at: Instant, words: &[u32]) {
        self.0.clock.fetch_max(at.as_micros(), Ordering::Relaxed);
        self.0.note(topic, at, words);
    }
}

impl Observer for Watch {}

impl<R: Schedule> Witness<R> for Watch {
    fn turn(&mut self, clock: Instant) {
        self.0.clock.store(clock.as_micros(), Ordering::Relaxed);
    }

    fn published(&mut self, topic: usize, at: Instant, _generation: u32, words: &[u32]) {
        self.0.note(topic, at, words);
    }

    fn beside(&mut self, place: usize, at: Instant, _generation: u32, words: &[u32]) {
        self.0.note(self.0.bus + place, at, words);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_look_gives_what_is_new_and_nothing_twice() {
        let newest = Arc::new(Newest::new([2, 1].into_iter(), 1));
        let watch = Watch(newest.clone());
        let mut words = Vec::new();
        assert_eq!(newest.after(0, 0, &mut words), None, "nothing yet");
        watch.note(0, Instant::from_millis(1), &[1, 2]);
        watch.note(0, Instant::from_millis(2), &[3, 4]);
        assert_eq!(newest.after(0, 0, &mut words), Some((Instant::from_millis(2), 2)));
        assert_eq!((words.as_slice(), newest.clock()), (&[3, 4][..], Instant::from_millis(2)));
        assert_eq!(newest.after(0, 2, &mut words), None);
        watch.note(1, Instant::from_millis(3), &[9, 9, 9]);
        assert_eq!(newest.after(1, 0, &mut words), Some((Instant::from_millis(3), 1)));
        assert_eq!(words, [9], "as long as the topic's samples are");
        watch.note(7, Instant::ZERO, &[1]);
        assert_eq!(newest.after(7, 0, &mut words), None, "no such topic");
    }
}
