//! The newest sample of every topic as words, and how to show one without knowing its type.
//!
//! For a console and other tools that may ask for any topic. Fed by the task that drains the log's
//! [taps](stampfly_bus::Taps). Not for runnables: they read the topics that the topic table gives them.

use core::fmt;
use stampfly_bus::TopicInfo;
use stampfly_types::{Duration, FieldInfo, Instant, Message, leaves};

/// Most words of a message that the black box and the golden flight take.
pub const MAX_MESSAGE: usize = 64;

/// Words of the longest message in a topic table.
#[must_use]
pub const fn longest_message(topics: &[TopicInfo]) -> usize {
    let (mut longest, mut index) = (0, 0);
    while index < topics.len() {
        if topics[index].words > longest {
            longest = topics[index].words;
        }
        index += 1;
    }
    longest
}

/// The newest sample of every topic.
///
/// `TOPICS` is the length of the topic table, `WORDS` its [`longest_message`].
///
/// ```
/// mod topics {
///     use stampfly_types::messages::TofData;
///     stampfly_bus::topics! {
///         outside tof, display;
///         /// Range to the ground.
///         sensor_tof: TofData = latest @ 30 Hz from tof => [display];
///     }
/// }
/// use stampfly_flight::newest::{NewestSamples, longest_message};
/// use stampfly_types::{Instant, Message, messages::TofData};
///
/// # fn main() {
/// let mut newest = NewestSamples::<{ topics::COUNT }, { longest_message(&topics::TOPICS) }>::new();
/// let tof = topics::Id::sensor_tof;
/// let range = TofData { distance: 0.31, valid: true, ..Default::default() };
/// newest.note(tof as usize, Instant::from_millis(1), &range.to_words());
///
/// assert_eq!(newest.get(tof as usize), Some((Instant::from_millis(1), range)));
/// let text = newest.show(tof as usize, tof.info(), Instant::from_millis(3)).unwrap().to_string();
/// assert!(text.starts_with("2 ms old") && text.contains("distance 0.31 m"));
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct NewestSamples<const TOPICS: usize, const WORDS: usize> {
    /// Instant, number of words, words.
    samples: [Option<(Instant, usize, [u32; WORDS])>; TOPICS],
}

impl<const TOPICS: usize, const WORDS: usize> NewestSamples<TOPICS, WORDS> {
    /// No sample yet.
    #[must_use]
    #[allow(clippy::new_without_default, reason = "`const`, for a static in firmware")]
    pub const fn new() -> Self {
        Self { samples: [None; TOPICS] }
    }

    /// Takes a sample of the topic at this place in the table. One longer than `WORDS` is ignored.
    pub fn note(&mut self, topic: usize, at: Instant, words: &[u32]) {
        let Some(place) = self.samples.get_mut(topic) else { return };
        let mut copy = [0; WORDS];
        if words.len() > WORDS {
            return;
        }
        copy.iter_mut().zip(words).for_each(|(to, from)| *to = *from);
        *place = Some((at, words.len(), copy));
    }

    /// The newest sample's instant and words; `None` before the first.
    #[must_use]
    pub fn words(&self, topic: usize) -> Option<(Instant, &[u32])> {
        let (at, length, words) = self.samples.get(topic)?.as_ref()?;
        Some((*at, words.get(..*length)?))
    }

    /// The newest sample's instant and message; `None` before the first, and when the topic has another message.
    #[must_use]
    pub fn get<M: Message>(&self, topic: usize) -> Option<(Instant, M)> {
        let (at, words) = self.words(topic)?;
        Some((at, message(words)?))
    }

    /// The newest sample, to be displayed; `None` before the first. `info` is the topic's line of the table.
    #[must_use]
    pub fn show(&self, topic: usize, info: &TopicInfo, now: Instant) -> Option<ShownSample<'_>> {
        let (at, words) = self.words(topic)?;
        Some(ShownSample::new(info, at, words, now))
    }
}

/// The message in these words; `None` when they are none of its.
pub fn message<M: Message>(words: &[u32]) -> Option<M> {
    let mut copy = M::ZERO;
    if copy.as_ref().len() != words.len() {
        return None;
    }
    copy.as_mut().iter_mut().zip(words).for_each(|(to, from)| *to = *from);
    M::from_words(&copy)
}

/// A sample in words, to be displayed: its age, then one line a leaf field with name, values and unit.
#[derive(Clone, Copy, Debug)]
pub struct ShownSample<'w> {
    age: Duration,
    fields: &'static [FieldInfo],
    words: &'w [u32],
}

impl<'w> ShownSample<'w> {
    /// A sample of this topic.
    #[must_use]
    pub const fn new(info: &TopicInfo, at: Instant, words: &'w [u32], now: Instant) -> Self {
        Self { age: now.since(at), fields: info.fields, words }
    }
}

impl fmt::Display for ShownSample<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ms old", self.age.as_millis())?;
        for leaf in leaves(self.fields) {
            write!(f, "\r\n  {}", leaf.name)?;
            let values = (0..leaf.count).map_while(|element| leaf.value(self.words, element));
            for value in values {
                write!(f, " {value}")?;
            }
            if !leaf.unit.is_empty() {
                write!(f, " {}", leaf.unit)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rover::topics::{COUNT, Id, TOPICS};
    use stampfly_types::messages::{ArmBlocks, FlightPhase, FlightStatus, MotorOutput, TofData};
    use std::string::ToString;

    #[test]
    fn every_kind_of_field_is_shown() {
        let mut newest = NewestSamples::<COUNT, { longest_message(&TOPICS) }>::new();
        let blocks = ArmBlocks::LOW_BATTERY | ArmBlocks::THROTTLE;
        let mode = FlightStatus { phase: FlightPhase::Landing, blocks, ..Default::default() };
        newest.note(Id::flight_status as usize, Instant::from_millis(4), &mode.to_words());
        let show = |newest: &NewestSamples<_, _>, topic: Id| {
            newest.show(topic as usize, topic.info(), Instant::from_millis(9)).map(|shown| shown.to_string())
        };
        let text = show(&newest, Id::flight_status).expect("noted");
        for part in ["5 ms old", "phase Landing", "armed false", "blocks LOW_BATTERY THROTTLE"] {
            assert!(text.contains(part), "{part} is missing:\n{text}");
        }
        assert_eq!(show(&newest, Id::actuator_motor), None);
        let motors = MotorOutput { duty: [0.5; 8], ..Default::default() };
        newest.note(Id::actuator_motor as usize, Instant::ZERO, &motors.to_words());
        let text = show(&newest, Id::actuator_motor).expect("noted");
        assert!(text.contains("duty 0.5 0.5 0.5 0.5 0.5 0.5 0.5 0.5"), "{text}");
    }

    #[test]
    fn what_is_no_sample_is_ignored() {
        let mut newest = NewestSamples::<COUNT, 4>::new();
        newest.note(COUNT, Instant::ZERO, &[1]);
        newest.note(0, Instant::ZERO, &[1; 5]);
        assert!((0..=COUNT).all(|topic| newest.words(topic).is_none()));
        newest.note(0, Instant::ZERO, &TofData::default().to_words());
        assert_eq!(newest.get::<TofData>(0), Some((Instant::ZERO, TofData::default())));
        assert_eq!(newest.get::<MotorOutput>(0), None, "another message");
    }
}
