//! Reads a compact record, on a PC, as the log that a recorder would have written of the same.

use super::model::{ACTIVATION, FRAME, INPUTS, LINE, LOST, Line, NOW, Now, PASS, REFUSED, Topic, unzigzag};
use crate::flight_loop::Observer;
use crate::log_schema::LogSchema;
use crate::recorder::Recorder;
use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;
use core::fmt;
use stampfly_bus::{Activation, Schedule, TopicTable};
use stampfly_log::ulog::{Definitions, Sink};
use stampfly_types::activation::MAX_INPUTS;
use stampfly_types::{ActivationRecord, InputRecord, Instant};

/// Why a compact record cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReadError {
    /// It ends, or makes no sense, at this byte.
    Damaged(usize),
    /// The log took no more.
    Full,
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Damaged(place) => write!(f, "the record is damaged at byte {place}"),
            Self::Full => f.write_str("the log took no more"),
        }
    }
}

impl core::error::Error for ReadError {}

struct Take<'r> {
    rest: &'r [u8],
    whole: usize,
}

impl<'r> Take<'r> {
    fn damaged(&self) -> ReadError {
        ReadError::Damaged(self.whole - self.rest.len())
    }

    fn byte(&mut self) -> Result<u8, ReadError> {
        let (byte, rest) = self.rest.split_first().ok_or(self.damaged())?;
        self.rest = rest;
        Ok(*byte)
    }

    fn bytes(&mut self, length: usize) -> Result<&'r [u8], ReadError> {
        let (bytes, rest) = self.rest.split_at_checked(length).ok_or(self.damaged())?;
        self.rest = rest;
        Ok(bytes)
    }

    fn number(&mut self) -> Result<u64, ReadError> {
        let mut number = 0;
        for shift in (0..70).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f).checked_shl(shift).unwrap_or_default();
            if byte & 0x80 == 0 {
                return Ok(number);
            }
        }
        Err(self.damaged())
    }
}

struct Sample {
    topic: usize,
    at: Instant,
    generation: u32,
    words: Vec<u32>,
}

/// Writes what a compact record of this vehicle holds into a log, whose head the caller has written.
///
/// In the log, what a pass read stands before its activations, and what they published after them. Samples of runnables
/// are there as far as they were kept: replay it with [`ReplayOptions::is_thinned`](crate::ReplayOptions::is_thinned).
///
/// # Errors
/// When the record is damaged, or the log takes no more. What came before is in the log.
pub fn read<R: Schedule, S: Sink>(record: &[u8], log: &mut Recorder<R, S>) -> Result<(), ReadError> {
    decode(record, log, &mut |_, _| {})
}

/// How many bytes of a record each topic, each line of the activation table, and key frames take, by their names.
#[must_use]
pub fn shares<R: Schedule>(record: &[u8]) -> Vec<(&'static str, usize)> {
    struct Nowhere;
    impl Sink for Nowhere {
        type Error = core::convert::Infallible;
        fn write(&mut self, _: &[u8]) -> Result<(), Self::Error> {
            Ok(())
        }
    }
    let mut shares = BTreeMap::new();
    let head = Definitions::start(Nowhere, Instant::ZERO).and_then(|head| head.data(LogSchema::<R>::new(&[])));
    if let Ok(log) = head {
        // What comes before damage counts.
        let _ = decode::<R, _>(record, &mut Recorder::new(log), &mut |tag, bytes| {
            let line = R::ACTIVATIONS.get(usize::from(tag & LINE)).map(|info| info.name);
            let topic = <R::Topics as TopicTable>::TOPICS.get(usize::from(tag)).map(|info| info.name);
            let name = match tag {
                FRAME => Some("key frames"),
                PASS | REFUSED | LOST => Some("marks"),
                _ if tag & ACTIVATION != 0 => line,
                _ => topic,
            };
            *shares.entry(name.unwrap_or("unknown")).or_default() += bytes;
        });
    }
    shares.into_iter().collect()
}

fn decode<R: Schedule, S: Sink>(
    record: &[u8],
    log: &mut Recorder<R, S>,
    took: &mut dyn FnMut(u8, usize),
) -> Result<(), ReadError> {
    let topics = <R::Topics as TopicTable>::TOPICS;
    let mut take = Take { rest: record, whole: record.len() };
    let (mut seen, mut lines) = (vec![Topic::NEW; topics.len()], vec![Line::NEW; R::ACTIVATIONS.len()]);
    let (mut now, mut losses) = (Now::NEW, 0);
    let (mut activations, mut samples): (Vec<ActivationRecord>, Vec<Sample>) = (Vec::new(), Vec::new());
    while !take.rest.is_empty() {
        let damaged = take.damaged();
        let (tag, before) = (take.byte()?, take.rest.len() + 1);
        match tag {
            PASS => {
                let mut write = |sample: &Sample| log.sample(sample.topic, sample.at, sample.generation, &sample.words);
                let is_outside = |sample: &&Sample| topics.get(sample.topic).is_some_and(|info| info.is_outside);
                samples.iter().filter(is_outside).for_each(&mut write);
                activations.drain(..).for_each(|record| log.has_read(&Activation::replay(record)));
                samples.iter().filter(|sample| !is_outside(sample)).for_each(|sample| {
                    log.sample(sample.topic, sample.at, sample.generation, &sample.words);
                });
                samples.clear();
            }
            FRAME => {
                let length = take.number()?;
                let frame = take.bytes(usize::try_from(length).map_err(|_| damaged)?)?;
                let at = frame.get(16..24).and_then(|clock| clock.first_chunk()).ok_or(damaged)?;
                let at = Instant::from_micros(u64::from_le_bytes(*at));
                log.key_frame(at, frame).map_err(|_| ReadError::Full)?;
                seen.fill(Topic::NEW);
                lines.fill(Line::NEW);
                now = Now::NEW;
            }
            LOST => {
                losses += 1;
                log.taps_lost(Instant::from_micros(now.last()), losses);
                activations.clear();
                samples.clear();
            }
            REFUSED => {
                let (index, refused) = (take.byte()?, take.number()?);
                let last = activations.iter().rev().find(|record| record.index == index).ok_or(damaged)?;
                let mut again = *last;
                again.refused = u32::try_from(refused).map_err(|_| damaged)?;
                activations.push(again);
            }
            _ if tag & ACTIVATION != 0 => {
                let index = tag & LINE;
                let line = lines.get_mut(usize::from(index)).ok_or(damaged)?;
                let count = *R::INPUTS.get(usize::from(index)).ok_or(damaged)?;
                if tag & NOW != 0 {
                    now.set(Instant::from_micros(now.expected().wrapping_add(unzigzag(take.number()?))));
                }
                let unexpected = if tag & INPUTS != 0 { take.number()? } else { 0 };
                let mut record = ActivationRecord::new(index, Instant::from_micros(now.last()));
                for place in 0..count.min(MAX_INPUTS) {
                    let mut input = line.expected(place);
                    if unexpected >> place & 1 == 1 {
                        let generation = input.generation.wrapping_add(unzigzag(take.number()?) as u32);
                        input = InputRecord { generation, taken: u16::try_from(take.number()?).map_err(|_| damaged)? };
                    }
                    record.push(input).map_err(|_| damaged)?;
                }
                line.set(&record, &mut [0; MAX_INPUTS]);
                activations.push(record);
            }
            _ => {
                let topic = usize::from(tag);
                let (seen, info) = seen.get_mut(topic).zip(topics.get(topic)).ok_or(damaged)?;
                let at = seen.expected().wrapping_add(unzigzag(take.number()?));
                let generation = seen.generation.wrapping_add(take.number()? as u32).wrapping_add(1);
                seen.set(at, generation);
                let mut words = vec![0; info.words];
                for (pair, words) in words.chunks_mut(2).enumerate() {
                    let widths = take.byte()?;
                    for (index, (word, width)) in words.iter_mut().zip([widths & 15, widths >> 4]).enumerate() {
                        let bytes = take.bytes(usize::from(width))?;
                        // Its sign goes on in the bytes that were left out.
                        let fill = if bytes.last().is_some_and(|last| last & 0x80 != 0) { 0xff } else { 0 };
                        let mut difference = [fill; 4];
                        difference.get_mut(..bytes.len()).ok_or(damaged)?.copy_from_slice(bytes);
                        *word = seen.word(2 * pair + index).wrapping_add(u32::from_le_bytes(difference));
                        seen.set_word(2 * pair + index, *word);
                    }
                }
                samples.push(Sample { topic, at: Instant::from_micros(at), generation, words });
            }
        }
        took(tag, before - take.rest.len());
    }
    Ok(())
}
