//! The words of a compact record, taken apart into entries.

use super::contents::ReadError;
use super::entry::{Kind, LINE, VERSION};
use alloc::vec::Vec;
use stampfly_bus::{ActivationState, Band, Schedule, TopicTable};
use stampfly_types::{ActivationRecord, InputRecord, Instant};

/// An entry of a record.
pub(super) enum Entry<'w> {
    Sample { topic: usize, line: usize, generation: u32, at: u32, words: &'w [u32] },
    Pass { band: Band, since: u32 },
    LatePass { band: Band, clock: Instant },
    Started { band: Band, clock: Instant },
    Resumed(usize),
    Refused { line: usize, refused: u32 },
    Kept { topic: usize, at: Instant, generation: u32, words: &'w [u32] },
    Part { lost: u32 },
    Position(ActivationRecord, ActivationState),
    Frame(Vec<u8>),
}

/// The words of a part, and those behind it up to a gap.
pub(super) struct Words<'w> {
    all: &'w [u32],
    place: usize,
}

impl<'w> Words<'w> {
    pub(super) const fn new(all: &'w [u32]) -> Self {
        Self { all, place: 0 }
    }

    pub(super) const fn damaged(&self) -> ReadError {
        ReadError::Damaged(self.place)
    }

    pub(super) const fn place(&self) -> usize {
        self.place
    }

    /// Reads from here on once more.
    pub(super) const fn go_to(&mut self, place: usize) {
        self.place = place;
    }

    fn take(&mut self, count: usize) -> Option<&'w [u32]> {
        let words = self.all.get(self.place..)?.get(..count)?;
        self.place += count;
        Some(words)
    }

    fn array<const N: usize>(&mut self) -> Option<[u32; N]> {
        self.take(N)?.first_chunk().copied()
    }

    fn instant(&mut self) -> Option<Instant> {
        let [low, high] = self.array()?;
        Some(Instant::from_micros(u64::from(low) | u64::from(high) << 32))
    }

    /// The next entry. `None` at the end, and when it is cut off.
    pub(super) fn entry<R: Schedule>(&mut self) -> Result<Option<Entry<'w>>, ReadError> {
        let begun = self.place;
        let entry = self.whole_entry::<R>();
        if matches!(entry, Ok(None)) {
            self.place = begun;
        }
        entry
    }

    fn whole_entry<R: Schedule>(&mut self) -> Result<Option<Entry<'w>>, ReadError> {
        let damaged = self.damaged();
        let Some([first]) = self.array() else { return Ok(None) };
        let (kind, a, b) = Kind::read(first).ok_or(damaged)?;
        let topic = |place: usize| <R::Topics as TopicTable>::TOPICS.get(place).map(|info| info.words).ok_or(damaged);
        let line = |line: usize| if line < R::ACTIVATIONS.len() { Ok(line) } else { Err(damaged) };
        let band = || match a {
            0 => Ok(Band::Flight),
            1 => Ok(Band::Background),
            _ => Err(damaged),
        };
        let entry = match kind {
            Kind::Sample => {
                let words = topic(a)?;
                self.array().zip(self.take(words)).map(|([at], words)| Entry::Sample {
                    topic: a,
                    line: (b & ((1 << LINE) - 1)) as usize,
                    generation: b >> LINE,
                    at,
                    words,
                })
            }
            Kind::Pass => Some(Entry::Pass { band: band()?, since: b }),
            Kind::LatePass => {
                let band = band()?;
                self.instant().map(|clock| Entry::LatePass { band, clock })
            }
            Kind::Started => {
                let band = band()?;
                self.instant().map(|clock| Entry::Started { band, clock })
            }
            Kind::Resumed => Some(Entry::Resumed(line(a)?)),
            Kind::Refused => {
                let line = line(a)?;
                self.array().map(|[refused]| Entry::Refused { line, refused })
            }
            Kind::Kept => {
                let words = topic(a)?;
                let head = self.array().zip(self.instant());
                head.zip(self.take(words)).map(|(([generation], at), words)| Entry::Kept {
                    topic: a,
                    at,
                    generation,
                    words,
                })
            }
            Kind::Part => {
                if a != VERSION as usize {
                    return Err(damaged);
                }
                self.array().zip(self.take((b as usize).div_ceil(4))).map(|([lost], _)| Entry::Part { lost })
            }
            Kind::Position => {
                let (line, inputs) = (line(a)?, b as usize);
                if R::INPUTS.get(line) != Some(&inputs) {
                    return Err(damaged);
                }
                let both = self.array().zip(self.take(inputs));
                let Some((state, generations)) = both else { return Ok(None) };
                let mut record = ActivationRecord::new(line as u8, Instant::ZERO);
                for generation in generations {
                    let input = InputRecord { generation: *generation, taken: 0 };
                    record.push(input).map_err(|_| damaged)?;
                }
                Some(Entry::Position(record, ActivationState::from_words(state)))
            }
            Kind::Frame => self.take((b as usize).div_ceil(4)).map(|words| {
                let mut bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
                bytes.truncate(b as usize);
                Entry::Frame(bytes)
            }),
        };
        Ok(entry)
    }
}
