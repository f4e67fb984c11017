//! The newest sample of every topic, as words, and how to read them without their types.

use crate::black_box::LONGEST;
use crate::wiring;
use core::fmt;
use stampfly_types::{Duration, FieldInfo, FieldKind, Instant, Message};

/// The newest sample of every topic.
///
/// Fed by whoever drains the log's taps; asked by the console.
///
/// ```
/// use stampfly_board::{console::Newest, wiring};
/// use stampfly_types::{Instant, Message, messages::TofData};
/// let mut newest = Newest::new();
/// let range = TofData { distance: 0.31, valid: true, ..Default::default() };
/// newest.note(wiring::Id::sensor_tof, Instant::from_micros(1_000), &range.to_words());
/// assert_eq!(newest.get(wiring::Id::sensor_tof), Some((Instant::from_micros(1_000), range)));
/// let text = newest.show(wiring::Id::sensor_tof as usize, Instant::from_micros(3_000)).unwrap().to_string();
/// assert!(text.contains("distance 0.31 m") && text.contains("valid true"), "{text}");
/// ```
#[derive(Clone, Debug)]
pub struct Newest {
    samples: [Option<(Instant, [u32; LONGEST])>; wiring::COUNT],
}

impl Newest {
    /// Nothing seen yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { samples: [None; wiring::COUNT] }
    }

    /// Takes a sample.
    pub fn note(&mut self, topic: wiring::Id, at: Instant, words: &[u32]) {
        let Some(place) = self.samples.get_mut(topic as usize) else { return };
        let mut copy = [0; LONGEST];
        for (to, from) in copy.iter_mut().zip(words) {
            *to = *from;
        }
        *place = Some((at, copy));
    }

    /// The newest sample of a topic of this message, and its instant; `None` before the first.
    #[must_use]
    pub fn get<M: Message>(&self, topic: wiring::Id) -> Option<(Instant, M)> {
        let (at, words) = self.samples.get(topic as usize)?.as_ref()?;
        let mut copy = M::ZERO;
        for (to, from) in copy.as_mut().iter_mut().zip(words) {
            *to = *from;
        }
        Some((*at, M::from_words(&copy)?))
    }

    /// The newest sample of the topic in this line of the table, to be displayed; `None` before the first.
    #[must_use]
    pub fn show(&self, topic: usize, now: Instant) -> Option<impl fmt::Display> {
        let (at, words) = self.samples.get(topic)?.as_ref()?;
        let fields = wiring::TOPICS.get(topic)?.fields;
        Some(Shown { age: now.since(*at), fields, words })
    }
}

impl Default for Newest {
    fn default() -> Self {
        Self::new()
    }
}

struct Shown<'n> {
    age: Duration,
    fields: &'static [FieldInfo],
    words: &'n [u32],
}

/// One line a field: name, values, unit.
impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ms old", self.age.as_micros() / 1_000)?;
        let mut rest = self.words;
        for field in self.fields {
            let (words, after) = rest.split_at_checked(field.words).unwrap_or_default();
            rest = after;
            write!(f, "\r\n  {}", field.name)?;
            let each = field.words.checked_div(field.count).unwrap_or(1).max(1);
            words.chunks(each).try_for_each(|value| show(f, field.kind, value))?;
            if field.unit != "1" {
                write!(f, " {}", field.unit)?;
            }
        }
        Ok(())
    }
}

fn show(f: &mut fmt::Formatter<'_>, kind: FieldKind, words: &[u32]) -> fmt::Result {
    let word = words.first().copied().unwrap_or_default();
    let name = |names: &[(&'static str, u32)]| names.iter().find(|(_, number)| *number == word).map(|(name, _)| *name);
    match kind {
        FieldKind::F32 => write!(f, " {}", f32::from_bits(word)),
        FieldKind::I32 | FieldKind::I16 => write!(f, " {}", word.cast_signed()),
        FieldKind::Bool => write!(f, " {}", word != 0),
        FieldKind::Enum(names) => write!(f, " {}", name(names).unwrap_or("?")),
        FieldKind::Flags(names) => {
            let mut set = names.iter().filter(|(_, bit)| word & bit != 0);
            match set.next() {
                None => f.write_str(" none"),
                Some((first, _)) => {
                    write!(f, " {first}")?;
                    set.try_for_each(|(name, _)| write!(f, " {name}"))
                }
            }
        }
        FieldKind::U64 => {
            let high = words.get(1).copied().unwrap_or_default();
            write!(f, " {}", u64::from(word) | u64::from(high) << 32)
        }
        _ => write!(f, " {word}"),
    }
}
