//! Key frames: the whole state of a vehicle as bytes, so that a replay can start in the middle of a log.
//!
//! A key frame holds the state of every runnable and the samples on the bus that a runnable may still read: of a topic whose
//! readers see the newest alone, that one. It is made
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
use stampfly_bus::{AnyTopic, PublishWords, Schedule, TopicTable};
use stampfly_types::Instant;

const MAGIC: [u8; 4] = *b"SFK1";
/// The policy of topics of which readers see the newest sample alone, as the topic table says it.
const LATEST: &str = "latest";
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

/// Where the bytes of a key frame go.
pub(crate) trait Place {
    /// Adds bytes, if there is room for all of them.
    fn put(&mut self, bytes: &[u8]) -> Result<(), KeyFrameError>;

    /// Bytes so far.
    fn length(&self) -> usize;

    /// Writes the length behind the magic, once it is known.
    fn set_length(&mut self, length: u32);
}

/// Writes from the front of a buffer.
struct Buffer<'a> {
    bytes: &'a mut [u8],
    written: usize,
}

impl Place for Buffer<'_> {
    #[inline]
    fn put(&mut self, bytes: &[u8]) -> Result<(), KeyFrameError> {
        let end = self.written + bytes.len();
        self.bytes.get_mut(self.written..end).ok_or(KeyFrameError::NoRoom)?.copy_from_slice(bytes);
        self.written = end;
        Ok(())
    }

    fn length(&self) -> usize {
        self.written
    }

    fn set_length(&mut self, length: u32) {
        if let Some(place) = self.bytes.get_mut(MAGIC.len()..MAGIC.len() + LENGTH) {
            place.copy_from_slice(&length.to_le_bytes());
        }
    }
}

/// What serde writes of the runnables goes there.
struct Through<'p, P>(&'p mut P);

impl<P: Place> postcard::ser_flavors::Flavor for Through<'_, P> {
    type Output = ();

    #[inline]
    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        self.0.put(bytes).map_err(|_| postcard::Error::SerializeBufferFull)
    }

    #[inline]
    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.try_extend(&[byte])
    }

    fn finalize(self) -> postcard::Result<()> {
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
    encode_up_to(flight_loop, clock, |_, topic| topic.head(), &mut Buffer { bytes: buffer, written: 0 })
}

/// The same to any place, where `head` says of each topic up to which generation: what was published since is none of the key frame's.
pub(crate) fn encode_up_to<R: Schedule + Serialize>(
    flight_loop: &FlightLoop<'_, R>,
    clock: Instant,
    head: impl Fn(usize, &dyn AnyTopic) -> u32,
    to: &mut impl Place,
) -> Result<usize, KeyFrameError> {
    let table = <R::Topics as TopicTable>::TOPICS;
    to.put(&MAGIC)?;
    to.put(&[0; LENGTH])?;
    to.put(&tables::<R>().to_le_bytes())?;
    to.put(&clock.as_micros().to_le_bytes())?;
    for (place, topic) in flight_loop.heads().iter().enumerate() {
        let head = head(place, *topic);
        // Of a topic of which readers see the newest sample alone, the others will never be read.
        let is_latest = table.get(place).is_some_and(|info| info.policy == LATEST);
        let oldest = head.saturating_sub(if is_latest { 1 } else { topic.depth() as u32 });
        to.put(&head.to_le_bytes())?;
        to.put(&((head - oldest) as u16).to_le_bytes())?;
        for generation in oldest + 1..=head {
            let sample = topic.in_place(generation).ok_or(KeyFrameError::NotAKeyFrame)?;
            let words = sample.words();
            let [low, high] = sample.at();
            let mut all = [generation, low, high].into_iter().chain(words);
            all.try_for_each(|word| to.put(&word.to_le_bytes()))?;
            if !sample.is_whole() {
                return Err(KeyFrameError::NotAKeyFrame);
            }
        }
    }
    postcard::serialize_with_flavor(flight_loop.runnables(), Through(to)).map_err(|_| KeyFrameError::NoRoom)?;
    let length = to.length();
    to.set_length(length as u32);
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
