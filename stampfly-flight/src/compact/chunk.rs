//! Chunks of a compact record for a carrier: a datagram each, or one behind the other in a file or a connection.
//!
//! | bytes | what |
//! |---|---|
//! | 2 | `SF` |
//! | 1 | version, 1 |
//! | 1 | 1 when a part of the record begins with this chunk, else 0 |
//! | 4 | number of the chunk, from zero |
//! | any | words of the record |
//! | 4 | CRC-32 of all before this |
//!
//! A carrier that keeps no borders, a file or a connection, has [`MAGIC`] first and the length of each chunk in two bytes before
//! it. Numbers are little-endian. What a carrier has lost shows in the numbers; whoever reads goes on where the next part begins.

use super::ring::RingReader;
use crate::crc::Crc;
use core::fmt;

/// First in a file or a connection.
pub const MAGIC: [u8; 8] = *b"SFRECORD";
/// Bytes of a chunk beside its words.
pub const OVERHEAD: usize = HEAD + CRC;
const HEAD: usize = 8;
const CRC: usize = 4;
const MARK: [u8; 3] = [b'S', b'F', 1];
/// Two bytes hold a chunk's length.
const LONGEST: usize = u16::MAX as usize;

fn crc(bytes: &[u8]) -> u32 {
    let mut crc = Crc::START;
    bytes.iter().for_each(|byte| crc.add(*byte));
    crc.finish()
}

/// Makes chunks of what is in a ring.
///
/// ```
/// use stampfly_flight::compact::{Chunk, Ring, Streamer};
/// let mut ring = Ring::<16>::new();
/// let (mut writer, reader) = ring.split();
/// let mut streamer = Streamer::new(reader);
/// let mut room = [0; 64];
/// assert_eq!(streamer.chunk(&mut room, 1), None);
/// writer.word(7);
/// writer.commit();
/// let length = streamer.chunk(&mut room, 1).expect("there is something");
/// let chunk = Chunk::read(&room[..length])?;
/// assert_eq!((chunk.number, chunk.words), (0, &[7, 0, 0, 0][..]));
/// # Ok::<(), stampfly_flight::compact::ChunkError>(())
/// ```
#[derive(Debug)]
pub struct Streamer<'r, const WORDS: usize> {
    ring: RingReader<'r, WORDS>,
    number: u32,
}

impl<'r, const WORDS: usize> Streamer<'r, WORDS> {
    /// The first chunk has number zero.
    pub const fn new(ring: RingReader<'r, WORDS>) -> Self {
        Self { ring, number: 0 }
    }

    /// From now on a record is wanted, or none any more. What is in the ring by then stays to be taken.
    pub fn want(&mut self, wanted: bool) {
        self.ring.want(wanted);
    }

    /// The next chunk, as long as `room` and no longer than 65,535 bytes. `None` when there are less than `least` bytes, or there is no
    /// room for a word.
    pub fn chunk(&mut self, room: &mut [u8], least: usize) -> Option<usize> {
        let (words, part) = self.ring.available();
        let most = room.len().min(LONGEST).checked_sub(OVERHEAD)? / 4;
        if words == 0 || most == 0 || (words as usize) * 4 < least {
            return None;
        }
        let count = part.filter(|part| *part > 0).map_or(words as usize, |part| part as usize).min(most);
        let end = HEAD + 4 * count;
        for place in room.get_mut(HEAD..end)?.as_chunks_mut::<4>().0 {
            *place = self.ring.next().unwrap_or_default().to_le_bytes();
        }
        let length = close(room, end, self.number, part == Some(0));
        self.number = self.number.wrapping_add(1);
        length
    }
}

/// What makes chunks, whatever its ring's size.
pub trait Chunks {
    /// From now on a record is wanted, or none any more.
    fn want(&mut self, wanted: bool);

    /// The next chunk; see [`Streamer::chunk`].
    fn next(&mut self, room: &mut [u8], least: usize) -> Option<usize>;
}

impl<const WORDS: usize> Chunks for Streamer<'_, WORDS> {
    fn want(&mut self, wanted: bool) {
        self.want(wanted);
    }

    fn next(&mut self, room: &mut [u8], least: usize) -> Option<usize> {
        self.chunk(room, least)
    }
}

/// Writes what is around words that end there. Returns the chunk's length.
fn close(room: &mut [u8], end: usize, number: u32, begins: bool) -> Option<usize> {
    let [a, b, version] = MARK;
    room.first_chunk_mut::<4>()?.copy_from_slice(&[a, b, version, u8::from(begins)]);
    room.get_mut(4..HEAD)?.copy_from_slice(&number.to_le_bytes());
    let crc = crc(room.get(..end)?);
    room.get_mut(end..end + CRC)?.copy_from_slice(&crc.to_le_bytes());
    Some(end + CRC)
}

/// A chunk that has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chunk<'c> {
    /// Its number: the one after the chunk before it, unless something is missing between them.
    pub number: u32,
    /// Does a part of the record begin with it?
    pub begins: bool,
    /// Words, little-endian.
    pub words: &'c [u8],
}

/// Why bytes are no chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ChunkError {
    /// They are something else, or a part of a chunk.
    NotAChunk,
    /// Their check sum is another one.
    Damaged,
    /// A later one has come before.
    Late,
}

impl fmt::Display for ChunkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotAChunk => "no chunk of a flight record",
            Self::Damaged => "a damaged chunk of a flight record",
            Self::Late => "a chunk of a flight record that a later one has overtaken",
        })
    }
}

impl core::error::Error for ChunkError {}

impl<'c> Chunk<'c> {
    /// Writes it. Returns its length; `None` when there is no room, or it has no whole number of words.
    pub fn write(&self, room: &mut [u8]) -> Option<usize> {
        let end = HEAD + self.words.len();
        if !self.words.len().is_multiple_of(4) || end + CRC > LONGEST {
            return None;
        }
        room.get_mut(HEAD..end)?.copy_from_slice(self.words);
        close(room, end, self.number, self.begins)
    }

    /// Reads one.
    ///
    /// # Errors
    /// When it is none, or damaged.
    pub fn read(bytes: &'c [u8]) -> Result<Self, ChunkError> {
        let (all, sum) = bytes.split_last_chunk::<CRC>().ok_or(ChunkError::NotAChunk)?;
        let (head, words) = all.split_first_chunk::<HEAD>().ok_or(ChunkError::NotAChunk)?;
        let [a, b, version, begins, number @ ..] = *head;
        if [a, b, version] != MARK || !words.len().is_multiple_of(4) {
            return Err(ChunkError::NotAChunk);
        }
        if crc(all) != u32::from_le_bytes(*sum) || begins > 1 {
            return Err(ChunkError::Damaged);
        }
        Ok(Self { number: u32::from_le_bytes(number), begins: begins == 1, words })
    }
}

/// Counts what arrives, and what does not. What is left of a record is written to a file as it came: whoever reads that finds the
/// gaps by the numbers.
///
/// ```
/// use stampfly_flight::compact::{Receiver, Ring, Streamer};
/// let mut ring = Ring::<16>::new();
/// let (mut writer, reader) = ring.split();
/// let (mut streamer, mut receiver, mut room) = (Streamer::new(reader), Receiver::default(), [0; 64]);
/// for number in 0..3 {
///     writer.word(number);
///     writer.commit();
///     let length = streamer.chunk(&mut room, 1).expect("there is something");
///     // The second one gets lost.
///     if number != 1 {
///         receiver.take(&room[..length])?;
///     }
/// }
/// assert_eq!((receiver.chunks(), receiver.missing()), (2, 1));
/// # Ok::<(), stampfly_flight::compact::ChunkError>(())
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct Receiver {
    expected: Option<u32>,
    chunks: u64,
    missing: u64,
}

impl Receiver {
    /// Takes what has arrived.
    ///
    /// # Errors
    /// When it is no chunk, is damaged, or comes after one with a higher number: then it has been counted as missing.
    pub fn take<'c>(&mut self, bytes: &'c [u8]) -> Result<Chunk<'c>, ChunkError> {
        let chunk = Chunk::read(bytes)?;
        let ahead = chunk.number.wrapping_sub(self.expected.unwrap_or(chunk.number));
        if ahead > u32::MAX / 2 {
            return Err(ChunkError::Late);
        }
        self.expected = Some(chunk.number.wrapping_add(1));
        self.chunks += 1;
        self.missing += u64::from(ahead);
        Ok(chunk)
    }

    /// Chunks that have arrived.
    #[must_use]
    pub const fn chunks(&self) -> u64 {
        self.chunks
    }

    /// Chunks that are missing between those.
    #[must_use]
    pub const fn missing(&self) -> u64 {
        self.missing
    }
}

#[cfg(test)]
mod tests {
    use super::super::ring::Ring;
    use super::*;
    use proptest::prelude::*;
    use std::vec;
    use std::vec::Vec;

    proptest! {
        /// However long the chunks are, their words are those of the ring; a part begins a chunk.
        #[test]
        fn chunks_hold_the_words_of_the_ring(runs in prop::collection::vec((1u32..20, any::<bool>()), 1..20), most in 16usize..60) {
            let mut ring = Ring::<32>::new();
            let (mut writer, reader) = ring.split();
            let mut streamer = Streamer::new(reader);
            let (mut count, mut got, mut parts, mut begun) = (0u32, Vec::new(), Vec::new(), Vec::new());
            let mut room = vec![0; most];
            for (number, (words, is_part)) in runs.into_iter().enumerate() {
                writer.begin_part();
                let begin = count;
                (0..words).for_each(|_| { writer.word(count); count += 1; });
                if is_part {
                    parts.push(begin);
                    writer.commit_part();
                } else {
                    writer.commit();
                }
                let mut chunks = 0;
                while let Some(length) = streamer.chunk(&mut room, 1) {
                    prop_assert!(length <= most);
                    let chunk = Chunk::read(&room[..length]).expect("whole");
                    if chunk.begins {
                        begun.push(got.len() as u32);
                    }
                    got.extend(chunk.words.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)));
                    chunks += 1;
                    prop_assert!(chunks <= words, "{number}");
                }
            }
            prop_assert_eq!(got, (0..count).collect::<Vec<_>>());
            prop_assert_eq!(begun, parts);
        }

        #[test]
        fn a_flipped_bit_is_seen(place in 0usize..16 * 8) {
            let mut ring = Ring::<8>::new();
            let (mut writer, reader) = ring.split();
            writer.word(0x1234_5678);
            writer.commit();
            let mut room = [0; 16];
            prop_assert_eq!(Streamer::new(reader).chunk(&mut room, 4), Some(16));
            room[place / 8] ^= 1 << (place % 8);
            prop_assert!(Chunk::read(&room).is_err());
        }
    }
}
