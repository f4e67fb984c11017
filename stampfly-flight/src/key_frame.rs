//! Key frames: the whole state of a vehicle as bytes, so that a replay can start in the middle of a log.
//!
//! A key frame holds the state of every runnable and the samples on the bus that a runnable may still read. It is made
//! between two passes of the flight loop, when nothing is half done; from there on the log's samples and activations say
//! the rest.
//!
//! | part | bytes |
//! |---|---|
//! | magic | 4, `SFK1` |
//! | length | 4, of everything, so that a part of a key frame is none |
//! | tables | 8, [`tables`] of the program that made it |
//! | clock | 8, µs |
//! | per topic | newest generation 4, number of samples 2, then each: generation 4, instant 8, words |
//! | runnables | [postcard](https://postcard.jamesmunns.com) of the struct that `schedule!` generates |
//!
//! All numbers are little-endian. Derive `Serialize` and `Deserialize` on the struct of all runnables to use this. Not an
//! interface between versions: another program's key frame is refused.

use crate::flight_loop::FlightLoop;
use crate::golden::tables;
use serde::{Serialize, de::DeserializeOwned};
use stampfly_bus::{PublishWords, Schedule, TopicTable};
use stampfly_types::Instant;

const MAGIC: [u8; 4] = *b"SFK1";
/// Bytes of the length.
const LENGTH: usize = 4;

/// Why a key frame cannot be made or used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum KeyFrameError {
    /// The buffer is too small.
    NoRoom,
    /// These bytes are something else, or damaged.
    NotAKeyFrame,
    /// It was made with other tables: by another vehicle or version.
    OtherTables,
}

impl core::fmt::Display for KeyFrameError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NoRoom => "the buffer is too small for a key frame",
            Self::NotAKeyFrame => "not a key frame, or a damaged one",
            Self::OtherTables => "the key frame was made with other tables",
        })
    }
}

impl core::error::Error for KeyFrameError {}

/// Writes from the front of a buffer.
struct Put<'a> {
    rest: &'a mut [u8],
    written: usize,
}

impl Put<'_> {
    fn bytes(&mut self, bytes: &[u8]) -> Result<(), KeyFrameError> {
        let (place, rest) =
            core::mem::take(&mut self.rest).split_at_mut_checked(bytes.len()).ok_or(KeyFrameError::NoRoom)?;
        place.copy_from_slice(bytes);
        self.rest = rest;
        self.written += bytes.len();
        Ok(())
    }
}

/// Makes a key frame of a vehicle at rest between two passes, `clock` on its executor's clock. Returns its length.
///
/// # Errors
/// [`KeyFrameError::NoRoom`].
pub fn encode<R: Schedule + Serialize>(
    flight_loop: &FlightLoop<'_, R>,
    clock: Instant,
    buffer: &mut [u8],
) -> Result<usize, KeyFrameError> {
    let mut put = Put { rest: &mut *buffer, written: 0 };
    put.bytes(&MAGIC)?;
    put.bytes(&[0; LENGTH])?;
    put.bytes(&tables::<R>().to_le_bytes())?;
    put.bytes(&clock.as_micros().to_le_bytes())?;
    for topic in flight_loop.heads() {
        let head = topic.head();
        let oldest = head.saturating_sub(topic.depth() as u32);
        put.bytes(&head.to_le_bytes())?;
        put.bytes(&((head - oldest) as u16).to_le_bytes())?;
        for generation in oldest + 1..=head {
            let mut outcome = Err(KeyFrameError::NotAKeyFrame);
            topic.copy(generation, &mut |at, words| {
                outcome = put
                    .bytes(&generation.to_le_bytes())
                    .and_then(|()| put.bytes(&at.as_micros().to_le_bytes()))
                    .and_then(|()| words.iter().try_for_each(|word| put.bytes(&word.to_le_bytes())));
            });
            outcome?;
        }
    }
    let Put { rest, written } = put;
    let state = postcard::to_slice(flight_loop.runnables(), rest).map_err(|_| KeyFrameError::NoRoom)?;
    let length = written + state.len();
    // Known only now.
    if let Some(place) = buffer.get_mut(MAGIC.len()..MAGIC.len() + LENGTH) {
        place.copy_from_slice(&(length as u32).to_le_bytes());
    }
    Ok(length)
}

/// Reads from the front of a slice.
struct Take<'a>(&'a [u8]);

impl Take<'_> {
    fn array<const N: usize>(&mut self) -> Result<[u8; N], KeyFrameError> {
        let (head, rest) = self.0.split_first_chunk().ok_or(KeyFrameError::NotAKeyFrame)?;
        self.0 = rest;
        Ok(*head)
    }
}

/// Are these all the bytes of a key frame, and not a part of one?
#[must_use]
pub fn is_whole(frame: &[u8]) -> bool {
    let mut take = Take(frame);
    take.array() == Ok(MAGIC) && take.array().is_ok_and(|length| u32::from_le_bytes(length) as usize == frame.len())
}

/// The instant a key frame was made.
///
/// # Errors
/// When it is none, or was made with other tables.
pub fn clock_of<R: Schedule>(frame: &[u8]) -> Result<Instant, KeyFrameError> {
    let mut take = Take(frame);
    begin::<R>(&mut take)
}

fn begin<R: Schedule>(take: &mut Take<'_>) -> Result<Instant, KeyFrameError> {
    let size = take.0.len();
    if take.array()? != MAGIC || u32::from_le_bytes(take.array()?) as usize != size {
        return Err(KeyFrameError::NotAKeyFrame);
    }
    if u64::from_le_bytes(take.array()?) != tables::<R>() {
        return Err(KeyFrameError::OtherTables);
    }
    Ok(Instant::from_micros(u64::from_le_bytes(take.array()?)))
}

/// Brings a vehicle on a fresh bus into the state of a key frame. Returns the key frame's instant.
///
/// # Errors
/// When it is none, is damaged, or was made with other tables. The vehicle is then in no usable state.
pub fn restore<R: Schedule + DeserializeOwned>(
    frame: &[u8],
    flight_loop: &mut FlightLoop<'_, R>,
    outside: &mut <R::Topics as TopicTable>::Outside<'_>,
) -> Result<Instant, KeyFrameError> {
    let mut take = Take(frame);
    let clock = begin::<R>(&mut take)?;
    for (place, topic) in <R::Topics as TopicTable>::TOPICS.iter().enumerate() {
        let _head = u32::from_le_bytes(take.array()?);
        let samples = u16::from_le_bytes(take.array()?);
        for _ in 0..samples {
            let generation = u32::from_le_bytes(take.array()?);
            let at = Instant::from_micros(u64::from_le_bytes(take.array()?));
            let mut words = [0; MAX_WORDS];
            let words = words.get_mut(..topic.words).ok_or(KeyFrameError::OtherTables)?;
            for word in &mut *words {
                *word = u32::from_le_bytes(take.array()?);
            }
            let restored = if topic.is_outside {
                outside.restore_words(place, at, generation, words)
            } else {
                flight_loop.restore_words(place, at, generation, words)
            };
            restored.ok_or(KeyFrameError::NotAKeyFrame)?;
        }
    }
    let (runnables, rest) = postcard::take_from_bytes(take.0).map_err(|_| KeyFrameError::NotAKeyFrame)?;
    if !rest.is_empty() {
        return Err(KeyFrameError::NotAKeyFrame);
    }
    flight_loop.set_runnables(runnables);
    Ok(clock)
}

/// Words of the largest message that fits into a key frame: 1 kB, more than any message of a control loop.
pub const MAX_WORDS: usize = 256;
