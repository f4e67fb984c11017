//! MSP, the MultiWii serial protocol: questions of a configurator, answers of a flight controller.
//!
//! | version | frame | checked by |
//! |---|---|---|
//! | 1 | `$` `M` direction, length (1 byte), id (1), payload | exclusive or of all after the direction |
//! | 1, "jumbo" | the same with a length of 255, and the real one (2 bytes) after the id | the same |
//! | 2 | `$` `X` direction, flag (1), id (2), length (2), payload | CRC-8/DVB-S2 of all after the direction |
//!
//! Directions are `<` to the flight controller, `>` from it, and `!` for "I will not". Numbers are little-endian. An answer has the version of its
//! question. What payloads mean differs between MultiWii, Betaflight and INAV, and is not here. Nothing is authenticated: a port that speaks MSP belongs to
//! a cable, and is closed while motors are armed.
//!
//! Questions come several in one piece, so a decoder is fed byte by byte and asked after each. From the protocol's description in the
//! MultiWii and Betaflight wikis.

use crate::crc8::crc8;
use crate::heard::Heard;

const START: u8 = b'$';
const VERSION_1: u8 = b'M';
const VERSION_2: u8 = b'X';
/// Start, version, direction.
const PREAMBLE: usize = 3;
/// A length of version 1 that says that the real one follows.
const JUMBO: u8 = 255;

/// Of the protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// Ids of eight bits. 255 says that a frame of version 2 is in the payload; it is not taken out here.
    One,
    /// Ids of 16 bits, and a flag.
    Two,
}

/// Who says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// A configurator asks.
    Request,
    /// A flight controller answers.
    Reply,
    /// A flight controller does not know the question, or does not do it.
    Error,
}

impl Direction {
    const fn of(byte: u8) -> Option<Self> {
        match byte {
            b'<' => Some(Self::Request),
            b'>' => Some(Self::Reply),
            b'!' => Some(Self::Error),
            _ => None,
        }
    }

    const fn byte(self) -> u8 {
        match self {
            Self::Request => b'<',
            Self::Reply => b'>',
            Self::Error => b'!',
        }
    }
}

/// A frame.
///
/// ```
/// use stampfly_link::msp::{Direction, MspDecoder, MspFrame};
/// let mut decoder = MspDecoder::<64>::new();
/// // "What is your attitude?"
/// let asked = b"$M<\0ll".iter().find_map(|byte| decoder.feed(*byte).map(|frame| frame.answer(Direction::Reply, &[0; 6]).id));
/// assert_eq!(asked, Some(108));
/// let mut bytes = [0; 16];
/// let length = MspFrame::request(108).write(&mut bytes);
/// assert_eq!(bytes.get(..length.unwrap_or(0)), Some(&b"$M<\0ll"[..]));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MspFrame<'f> {
    /// Which of the two it is written in.
    pub version: Version,
    /// Who says it.
    pub direction: Direction,
    /// Of version 2, which gives it no meaning yet; zero in version 1.
    pub flag: u8,
    /// What is asked or answered.
    pub id: u16,
    /// The rest.
    pub payload: &'f [u8],
}

/// What the bytes so far are.
enum Parsed {
    /// The beginning of a frame, or nothing yet. With fewer bytes than these there is nothing more to be said.
    Incomplete(usize),
    /// No frame begins here.
    Nothing,
    /// A sound frame.
    Frame(Outline),
}

/// A frame but for its payload.
#[derive(Clone, Copy)]
struct Outline {
    version: Version,
    direction: Direction,
    flag: u8,
    id: u16,
    /// Where its payload begins and ends. A byte follows.
    payload: (usize, usize),
}

impl Outline {
    const fn size(&self) -> usize {
        self.payload.1 + 1
    }

    fn frame<'f>(&self, bytes: &'f [u8]) -> Option<MspFrame<'f>> {
        let Self { version, direction, flag, id, payload: (start, end) } = *self;
        Some(MspFrame { version, direction, flag, id, payload: bytes.get(start..end)? })
    }

    /// Reads the beginning of a frame up to its payload.
    fn begin(bytes: &[u8]) -> Result<Self, Parsed> {
        let version = match bytes {
            [] => return Err(Parsed::Incomplete(1)),
            [START] => return Err(Parsed::Incomplete(2)),
            [START, VERSION_1, ..] => Version::One,
            [START, VERSION_2, ..] => Version::Two,
            _ => return Err(Parsed::Nothing),
        };
        let Some(direction) = bytes.get(2) else { return Err(Parsed::Incomplete(PREAMBLE)) };
        let Some(direction) = Direction::of(*direction) else { return Err(Parsed::Nothing) };
        let rest = bytes.get(PREAMBLE..).unwrap_or_default();
        let (flag, id, length, header) = match (version, rest) {
            (Version::One, [JUMBO, id, l0, l1, ..]) => (0, u16::from(*id), u16::from_le_bytes([*l0, *l1]), 4),
            (Version::One, [length, id, ..]) if *length != JUMBO => (0, u16::from(*id), u16::from(*length), 2),
            (Version::Two, [flag, i0, i1, l0, l1, ..]) => {
                (*flag, u16::from_le_bytes([*i0, *i1]), u16::from_le_bytes([*l0, *l1]), 5)
            }
            (Version::One, [JUMBO, ..]) => return Err(Parsed::Incomplete(PREAMBLE + 4)),
            (Version::One, _) => return Err(Parsed::Incomplete(PREAMBLE + 2)),
            (Version::Two, _) => return Err(Parsed::Incomplete(PREAMBLE + 5)),
        };
        let start = PREAMBLE + header;
        Ok(Self { version, direction, flag, id, payload: (start, start + usize::from(length)) })
    }

    /// Reads the frame that begins at the first byte.
    fn parse(bytes: &[u8]) -> Parsed {
        let outline = match Self::begin(bytes) {
            Ok(outline) => outline,
            Err(parsed) => return parsed,
        };
        let (_, end) = outline.payload;
        let (Some(checked), Some(last)) = (bytes.get(PREAMBLE..end), bytes.get(end)) else {
            return Parsed::Incomplete(outline.size());
        };
        if outline.version.check(checked) != *last {
            return Parsed::Nothing;
        }
        Parsed::Frame(outline)
    }
}

impl MspFrame<'_> {
    /// A question without a payload, in version 1 where its id allows that.
    #[must_use]
    pub const fn request(id: u16) -> MspFrame<'static> {
        let version = if id < JUMBO as u16 { Version::One } else { Version::Two };
        MspFrame { version, direction: Direction::Request, flag: 0, id, payload: &[] }
    }

    /// The answer to this question.
    #[must_use]
    pub const fn answer<'a>(&self, direction: Direction, payload: &'a [u8]) -> MspFrame<'a> {
        MspFrame { version: self.version, direction, flag: self.flag, id: self.id, payload }
    }

    /// Writes it as it travels and returns how long it is; `None` when `out` is too short, or the version has no such id or no such length.
    #[must_use]
    pub fn write(&self, out: &mut [u8]) -> Option<usize> {
        let long = u16::try_from(self.payload.len()).ok()?;
        let ([l0, l1], [i0, i1]) = (long.to_le_bytes(), self.id.to_le_bytes());
        let (mark, header): (u8, &[u8]) = match (self.version, u8::try_from(self.id)) {
            (Version::One, Err(_)) => return None,
            (Version::One, Ok(id)) if long >= u16::from(JUMBO) => (VERSION_1, &[JUMBO, id, l0, l1]),
            (Version::One, Ok(id)) => (VERSION_1, &[l0, id]),
            (Version::Two, _) => (VERSION_2, &[self.flag, i0, i1, l0, l1]),
        };
        let size = PREAMBLE + header.len() + self.payload.len() + 1;
        let (preamble, rest) = out.get_mut(..size)?.split_first_chunk_mut()?;
        *preamble = [START, mark, self.direction.byte()];
        let (last, checked) = rest.split_last_mut()?;
        for (place, byte) in checked.iter_mut().zip(header.iter().chain(self.payload)) {
            *place = *byte;
        }
        *last = self.version.check(checked);
        Some(size)
    }
}

impl Version {
    fn check(self, bytes: &[u8]) -> u8 {
        match self {
            Self::One => bytes.iter().fold(0, |all, byte| all ^ byte),
            Self::Two => crc8(bytes),
        }
    }

    /// The same of bytes whose check is `before`, and one more.
    fn check_on(self, before: u8, byte: u8) -> u8 {
        match self {
            Self::One => before ^ byte,
            Self::Two => crc8(&[before ^ byte]),
        }
    }
}

/// A frame that there is no room for, while it passes.
#[derive(Clone, Copy, Debug)]
struct Passing {
    /// Without its payload.
    frame: MspFrame<'static>,
    /// Bytes that are still to come, the last included.
    left: usize,
    /// Of those that have come.
    check: u8,
}

/// Finds frames in what a port hands over; `N` bytes are the longest frame that it can take.
///
/// 64 are enough for what a small flight controller is asked, 262 for every frame of version 1 that
/// is not "jumbo". A longer one is passed over, and [`too_long`](Self::too_long) says which it was.
/// A frame that is cut short costs itself alone: the next one is found in what seemed to be the
/// rest of it, as soon as enough bytes
/// have come to show that it is not. For a byte that shows it, the work grows with `N`²; for others it does not depend on `N`.
#[derive(Clone, Debug)]
pub struct MspDecoder<const N: usize> {
    heard: Heard<N>,
    /// With fewer bytes there is nothing to be found.
    need: usize,
    /// Bytes of the frame that was returned last.
    taken: usize,
    passing: Option<Passing>,
}

impl<const N: usize> Default for MspDecoder<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> MspDecoder<N> {
    /// Has heard nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { heard: Heard::new(), need: 0, taken: 0, passing: None }
    }

    /// Bytes so far that were part of no frame. Wraps around.
    #[must_use]
    pub const fn discarded(&self) -> u32 {
        self.heard.discarded()
    }

    /// Nothing has come for a while: what seemed to begin a frame is none. A configurator that gets no answer asks again, and its question would be
    /// taken for the rest of the one that was cut short.
    pub fn silence(&mut self) {
        self.forget();
        self.heard.discard(self.heard.len());
        self.need = 0;
        self.passing = None;
    }

    /// The frame that the last byte has ended and that there was no room for, without its payload;
    /// once. What its payload looks like is taken for frames all the same. Ask after a
    /// [`feed`](Self::feed) that returned none: a configurator waits for an answer.
    ///
    /// ```
    /// use stampfly_link::msp::{MspDecoder, MspFrame}; let (mut decoder, mut long) =
    /// (MspDecoder::<64>::new(), [0; 128]); let length = MspFrame { payload: &[7; 100],
    /// ..MspFrame::request(200) }.write(&mut long).unwrap_or(0); let ids: Vec<_> = long[..length]
    ///     .iter()
    ///     .filter_map(|byte| match decoder.feed(*byte) {
    ///         Some(frame) => Some(frame.id),
    ///         None => decoder.too_long().map(|frame| frame.id),
    ///     })
    ///     .collect();
    /// assert_eq!(ids, [200]);
    /// ```
    pub fn too_long(&mut self) -> Option<MspFrame<'static>> {
        let ended = self.passing.take_if(|passing| passing.left == 0);
        ended.filter(|passing| passing.check == 0).map(|passing| passing.frame)
    }

    /// One more byte of a frame that there is no room for. The last makes its check zero, if it is
    /// sound.
    #[inline]
    fn pass(&mut self, byte: u8) {
        let Some(passing) = &mut self.passing else { return };
        if passing.left == 0 {
            self.passing = None;
            return;
        }
        passing.left -= 1;
        passing.check = match passing.left {
            0 => passing.check ^ byte,
            _ => passing.frame.version.check_on(passing.check, byte),
        };
    }

    /// What begins here is a frame that there is no room for.
    #[cold]
    fn begin_passing(&mut self) {
        let bytes = self.heard.bytes();
        let (Ok(outline), Some(checked)) = (Outline::begin(bytes), bytes.get(PREAMBLE..)) else { return };
        let Outline { version, direction, flag, id, .. } = outline;
        let frame = MspFrame { version, direction, flag, id, payload: &[] };
        let left = outline.size().saturating_sub(bytes.len());
        self.passing = Some(Passing { frame, left, check: version.check(checked) });
    }

    /// Takes a byte. Returns the frame that it ends.
    #[inline]
    pub fn feed(&mut self, byte: u8) -> Option<MspFrame<'_>> {
        self.forget();
        self.pass(byte);
        if self.heard.is_full() {
            // Longer than there is room for.
            self.discard();
        }
        self.heard.push(byte);
        if self.heard.len() < self.need { None } else { self.look() }
    }

    /// The frame that was returned last is not needed any more.
    fn forget(&mut self) {
        if self.taken > 0 {
            self.heard.take(core::mem::take(&mut self.taken));
            self.need = 0;
        }
    }

    fn look(&mut self) -> Option<MspFrame<'_>> {
        loop {
            match Outline::parse(self.heard.bytes()) {
                Parsed::Incomplete(need) => {
                    self.need = need;
                    if need > N && self.passing.is_none() {
                        self.begin_passing();
                    }
                    return None;
                }
                Parsed::Nothing => self.discard(),
                Parsed::Frame(outline) => {
                    self.taken = outline.size();
                    return outline.frame(self.heard.bytes());
                }
            }
        }
    }

    /// Gives up the oldest byte, and all up to where a frame may begin.
    fn discard(&mut self) {
        let later = self.heard.bytes().iter().skip(1).position(|byte| *byte == START);
        self.heard.discard(later.map_or(self.heard.len(), |later| later + 1));
        self.need = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn heard<const N: usize>(decoder: &mut MspDecoder<N>, bytes: &[u8]) -> Vec<(u16, Vec<u8>)> {
        let mut found = Vec::new();
        for byte in bytes {
            found.extend(decoder.feed(*byte).map(|frame| (frame.id, frame.payload.to_vec())));
        }
        found
    }

    fn written(frame: MspFrame<'_>) -> Vec<u8> {
        let mut bytes = std::vec![0; frame.payload.len() + 16];
        let length = frame.write(&mut bytes).expect("there is room");
        bytes.truncate(length);
        bytes
    }

    #[test]
    fn version_1_has_ids_of_eight_bits() {
        assert_eq!(MspFrame { version: Version::One, ..MspFrame::request(256) }.write(&mut [0; 64]), None);
        assert_eq!(MspFrame::request(254).version, Version::One);
        assert_eq!(MspFrame::request(255).version, Version::Two);
        let carrier = written(MspFrame { version: Version::One, ..MspFrame::request(255) });
        assert_eq!(heard(&mut MspDecoder::<64>::new(), &carrier), [(255, Vec::new())]);
    }

    #[test]
    fn a_short_payload_may_come_as_jumbo() {
        let bytes = [b'$', b'M', b'>', 255, 108, 1, 0, 7, 255 ^ 108 ^ 1 ^ 7];
        assert_eq!(heard(&mut MspDecoder::<64>::new(), &bytes), [(108, std::vec![7])]);
    }

    #[test]
    fn a_payload_of_255_bytes_is_jumbo_and_one_of_254_is_not() {
        for (length, overhead) in [(254, 6), (255, 8), (300, 8)] {
            let payload = std::vec![7; length];
            let frame = MspFrame { payload: &payload, ..MspFrame::request(70) };
            let bytes = written(frame);
            assert_eq!(bytes.len(), length + overhead);
            assert_eq!(heard(&mut MspDecoder::<400>::new(), &bytes), [(70, payload.clone())]);
        }
    }

    #[test]
    fn a_frame_that_does_not_fit_is_passed_over() {
        let long = written(MspFrame { payload: &[b'$'; 60], ..MspFrame::request(70) });
        let mut decoder = MspDecoder::<32>::new();
        let bytes = [long, written(MspFrame::request(108))].concat();
        assert_eq!(heard(&mut decoder, &bytes), [(108, Vec::new())]);
        assert_eq!(decoder.discarded(), 66);
    }

    #[test]
    fn a_question_that_was_cut_short_does_not_cost_the_next_after_a_silence() {
        let mut decoder = MspDecoder::<64>::new();
        assert_eq!(heard(&mut decoder, b"$M<\x05\xCA\x01"), []);
        decoder.silence();
        assert_eq!(heard(&mut decoder, &written(MspFrame::request(108))), [(108, Vec::new())]);
        assert_eq!(decoder.discarded(), 6);
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(two: bool, flag: u8, id in 0..255_u16, payload in prop::collection::vec(any::<u8>(), 0..400)) {
            let version = if two { Version::Two } else { Version::One };
            let frame = MspFrame { version, direction: Direction::Reply, flag: if two { flag } else { 0 }, id, payload: &payload };
            let bytes = written(frame);
            let mut decoder = MspDecoder::<512>::new();
            let (last, before) = bytes.split_last().expect("not empty");
            prop_assert!(before.iter().all(|byte| decoder.feed(*byte).is_none()));
            prop_assert_eq!(decoder.feed(*last), Some(frame));
        }

        #[test]
        fn one_wrong_bit_costs_the_frame(two: bool, payload in prop::collection::vec(any::<u8>(), 0..40), place: prop::sample::Index, bit in 0..8) {
            let version = if two { Version::Two } else { Version::One };
            let mut bytes = written(MspFrame { version, payload: &payload, ..MspFrame::request(108) });
            // The direction is not checked, nor is which version it is.
            let place = PREAMBLE + place.index(bytes.len() - PREAMBLE);
            bytes[place] ^= 1_u8 << bit;
            let found = heard(&mut MspDecoder::<512>::new(), &bytes);
            prop_assert!(!found.contains(&(108, payload)), "{:?}", found);
        }

        #[test]
        fn every_byte_is_in_a_frame_or_discarded_or_waits(bytes in prop::collection::vec(prop_oneof![Just(b'$'), Just(b'M'), Just(b'<'), Just(0), any::<u8>()], 0..300)) {
            let mut decoder = MspDecoder::<64>::new();
            let mut in_frames = 0;
            for byte in &bytes {
                in_frames += if decoder.feed(*byte).is_some() { decoder.taken } else { 0 };
            }
            prop_assert_eq!(in_frames + decoder.discarded() as usize + decoder.heard.len() - decoder.taken, bytes.len());
        }
    }
}
