//! Requests of one station over the secure link: [`StationRequests`], and the topics that it watches.
//!
//! For ESP-NOW, for datagrams in a network, and for a simulated vehicle's port of sealed frames. A
//! station gets the fingerprint of the tables once a second while it watches topics, and must renew
//! its request every few seconds, because a radio does not report that a station has gone. For a
//! cable use [`Cable`](crate::cable::Cable), whose envelopes carry the number of a question and the
//! fingerprint.

use crate::requests::StationRequests;
use crate::view::Samples;
use crate::watches::Watches;
use stampfly_link::secure::{Payload, Sample};
use stampfly_types::{Duration, Instant};

/// Topics that are watched at once.
const WATCHED: usize = 24;
/// A station that has not asked for a topic for this long is sent none any more.
const SILENCE: Duration = Duration::from_secs(5);
/// Between two tellings of the fingerprint.
const PERIOD: Duration = Duration::from_secs(1);

/// Samples in a turn of a radio of 20 ms, a frame each. ESP-NOW sends a megabit a second: two of the longest are a quarter of the air's time, and leave the rest to
/// the pilot's packets.
pub const RADIO_SAMPLES: usize = 2;
/// The same for a station in a Wi-Fi network, which is faster: with what else is said, as many frames as a [`Stack`](crate::network) has room for.
pub const NETWORK_SAMPLES: usize = 5;

/// Room for the words of a sample.
pub type Words = [[u8; 4]; Sample::MAX_WORDS];

/// Questions and topics of one station.
///
/// ```
/// use stampfly_link::secure::{Payload, Sample};
/// use stampfly_services::{RadioRequests, Samples};
/// use stampfly_types::Instant;
/// struct One;
/// impl Samples for One {
///     fn words(&self, topic: usize) -> Option<(Instant, &[u32])> {
///         (topic == 7).then_some((Instant::from_millis(1), &[42]))
///     }
/// }
/// let (mut requests, now, mut room) = (RadioRequests::new(0xF1F5), Instant::from_secs(1), [[0; 4]; Sample::MAX_WORDS]);
/// assert_eq!(requests.next(now, &One, &mut room), None);
/// assert!(requests.ask(now, &Payload::Watch { topic: 7, period: 100 }));
/// assert_eq!(requests.next(now, &One, &mut room), Some(Payload::Tables { fingerprint: 0xF1F5 }));
/// let Some(Payload::Sample(sample)) = requests.next(now, &One, &mut room) else { panic!() };
/// assert_eq!((sample.topic, sample.words().next()), (7, Some(42)));
/// assert_eq!(requests.next(now, &One, &mut room), None);
/// ```
#[derive(Clone, Debug)]
pub struct RadioRequests {
    /// Its questions. Without numbers: an answer says what it answers.
    pub questions: StationRequests,
    watches: Watches<WATCHED>,
    fingerprint: u16,
    /// When it has asked for a topic.
    asked: Option<Instant>,
    tell_at: Instant,
}

impl RadioRequests {
    /// Of a vehicle whose tables have this fingerprint.
    #[must_use]
    pub const fn new(fingerprint: u16) -> Self {
        Self {
            questions: StationRequests::new(),
            watches: Watches::new(),
            fingerprint,
            asked: None,
            tell_at: Instant::ZERO,
        }
    }

    /// Takes what is no command. `false` when it is none of what is answered here, or as many wait as there is room for.
    pub fn ask(&mut self, now: Instant, payload: &Payload<'_>) -> bool {
        match *payload {
            Payload::Watch { topic, period } => {
                if self.asked.is_none() {
                    self.tell_at = now;
                }
                self.asked = Some(now);
                self.watches.watch(now, topic, period)
            }
            _ => self.questions.ask(0, payload),
        }
    }

    /// What is due to be sent of the topics, in `room`. `None` when nothing is.
    pub fn next<'r>(&mut self, now: Instant, samples: &dyn Samples, room: &'r mut Words) -> Option<Payload<'r>> {
        if now.since(self.asked?) >= SILENCE {
            self.asked = None;
            self.watches.clear();
            return None;
        }
        if now >= self.tell_at {
            self.tell_at = now + PERIOD;
            return Some(Payload::Tables { fingerprint: self.fingerprint });
        }
        let (topic, at, words) = loop {
            let next = self.watches.next(now, samples)?;
            // Longer ones than a frame has room for are not sent.
            if next.2.len() <= Sample::MAX_WORDS {
                break next;
            }
        };
        let room = room.get_mut(..words.len())?;
        room.iter_mut().zip(words).for_each(|(to, word)| *to = word.to_le_bytes());
        Some(Payload::Sample(Sample::new(topic, at, room)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Topics 0 to 9 have a sample a millisecond, topic 5 is too long for a frame.
    struct Table(Instant, Vec<u32>);

    impl Samples for Table {
        fn words(&self, topic: usize) -> Option<(Instant, &[u32])> {
            let length = if topic == 5 { Sample::MAX_WORDS + 1 } else { topic + 1 };
            (topic < 10).then(|| (self.0, self.1.get(..length).unwrap_or_default()))
        }
    }

    fn sent(requests: &mut RadioRequests, now: Instant) -> Vec<Option<u16>> {
        let table = Table(now, (0..100).collect());
        let mut room = [[0; 4]; Sample::MAX_WORDS];
        let mut all = Vec::new();
        for _ in 0..RADIO_SAMPLES {
            match requests.next(now, &table, &mut room) {
                Some(Payload::Tables { .. }) => all.push(None),
                Some(Payload::Sample(sample)) => all.push(Some(sample.topic)),
                _ => {}
            }
        }
        all
    }

    #[test]
    fn every_topic_has_its_turn_and_a_station_that_asks_no_more_is_sent_nothing() {
        let mut requests = RadioRequests::new(1);
        for topic in 0..10 {
            assert!(requests.ask(Instant::ZERO, &Payload::Watch { topic, period: 40 }));
        }
        let (mut counts, mut tables) = ([0; 10], 0);
        for turn in 0..400 {
            for what in sent(&mut requests, Instant::from_millis(20 * turn)) {
                match what {
                    Some(topic) => counts[usize::from(topic)] += 1,
                    None => tables += 1,
                }
            }
        }
        // 5 s of 50 turns a second, two of ten topics each; one of them never fits.
        assert_eq!((tables, counts[5]), (5, 0));
        assert!(counts.iter().enumerate().all(|(topic, count)| topic == 5 || (45..=60).contains(count)), "{counts:?}");
    }

    #[test]
    fn questions_are_the_desks() {
        let mut requests = RadioRequests::new(1);
        assert!(requests.ask(Instant::ZERO, &Payload::Record { wanted: true }));
        assert_eq!(requests.questions.record(), Some(true));
        assert!(!requests.ask(Instant::ZERO, &Payload::Kill));
        assert!((0..WATCHED as u16).all(|topic| requests.ask(Instant::ZERO, &Payload::Watch { topic, period: 40 })));
        assert!(!requests.ask(Instant::ZERO, &Payload::Watch { topic: 99, period: 40 }));
    }
}
