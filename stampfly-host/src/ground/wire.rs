//! A client's stream, in which the lengths of frames are written as RFC 6455 has it.
//!
//! The library of WebSockets takes a length that has more bytes than it needs, and takes a length
//! whose top bit is set for a large one; section 5.2 forbids both. Where such a frame begins, the
//! stream ends with an error. The library looks at what is in frames, and at their order.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;

/// Of the first byte: this is a control frame. Its length has one byte (section 5.5).
const CONTROL: u8 = 0x08;
/// Of the second byte: four bytes of a mask follow the length.
const MASKED: u8 = 0x80;

/// The stream.
#[derive(Debug)]
pub(super) struct Wire {
    pub stream: TcpStream,
    /// What came behind the handshake.
    rest: VecDeque<u8>,
    lengths: Lengths,
    is_broken: bool,
}

impl Wire {
    /// `rest` has come before what the stream still gives.
    pub fn new(stream: TcpStream, rest: Vec<u8>) -> Self {
        Self { stream, rest: rest.into(), lengths: Lengths::default(), is_broken: false }
    }

    /// Does this error say that a length is wrong?
    pub fn is_breach(error: &io::Error) -> bool {
        error.kind() == ErrorKind::InvalidData
    }
}

impl Read for Wire {
    fn read(&mut self, room: &mut [u8]) -> io::Result<usize> {
        let read = match () {
            () if self.is_broken => 0,
            () if self.rest.is_empty() => self.stream.read(room)?,
            () => self.rest.read(room)?,
        };
        let sound = self.lengths.sound(room.get(..read).unwrap_or_default());
        self.is_broken |= sound < read;
        // The frames before it are heard first.
        if self.is_broken && sound == 0 { Err(ErrorKind::InvalidData.into()) } else { Ok(sound) }
    }
}

impl Write for Wire {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// Where a client's frames begin.
#[derive(Debug, Default)]
struct Lengths {
    /// As much of a frame's header as has come, without its mask.
    header: Vec<u8>,
    /// Bytes of a frame that are still to come.
    left: u64,
}

impl Lengths {
    /// How many of these bytes come before a frame whose length is wrong: all, when there is none.
    fn sound(&mut self, bytes: &[u8]) -> usize {
        let mut begins = 0;
        for (at, byte) in bytes.iter().enumerate() {
            if self.left > 0 {
                self.left -= 1;
                continue;
            }
            if self.header.is_empty() {
                begins = at;
            }
            self.header.push(*byte);
            match behind(&self.header) {
                None => {}
                Some(None) => return begins,
                Some(Some(left)) => {
                    self.left = left;
                    self.header.clear();
                }
            }
        }
        bytes.len()
    }
}

/// Bytes of a frame behind this header. `None` while the header is not whole; `Some(None)` when its
/// length is wrong.
fn behind(header: &[u8]) -> Option<Option<u64>> {
    let (&[first, second], more) = header.split_first_chunk()?;
    let mask = if second & MASKED == 0 { 0 } else { 4 };
    let (length, least) = match second & !MASKED {
        126 => (u16::from_be_bytes(*more.first_chunk()?).into(), 126),
        127 => (u64::from_be_bytes(*more.first_chunk()?), 1 << 16),
        length => (length.into(), 0),
    };
    let is_right = length >= least && length >> 63 == 0 && (first & CONTROL == 0 || least == 0);
    Some(is_right.then(|| length + mask))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A header with this length field, and as many bytes behind it as the length says.
    fn frame(first: u8, field: &[u8], length: usize) -> Vec<u8> {
        let mut frame = [&[first], field, &[0; 4][..], &vec![0xFF; length]].concat();
        frame[1] |= MASKED;
        frame
    }

    fn two(length: u16) -> Vec<u8> {
        [&[126][..], &length.to_be_bytes()].concat()
    }

    fn eight(length: u64) -> Vec<u8> {
        [&[127][..], &length.to_be_bytes()].concat()
    }

    fn sound_frames() -> Vec<u8> {
        let long = frame(0x82, &eight(65_536), 65_536);
        [
            frame(0x81, &[125], 125),
            frame(0x89, &[0], 0),
            frame(0x01, &two(126), 126),
            frame(0x81, &two(u16::MAX), 65_535),
            long,
        ]
        .concat()
    }

    #[test]
    fn a_length_has_as_many_bytes_as_it_needs() {
        assert_eq!(Lengths::default().sound(&sound_frames()), sound_frames().len());
        for (first, field) in [
            (0x81, two(0)),
            (0x81, two(125)),
            (0x81, eight(126)),
            (0x82, eight(65_535)),
            (0x81, eight(1 << 63)),
            (0x00, eight(u64::MAX)),
            (0x89, two(126)),
            (0x88, eight(65_536)),
        ] {
            let wrong = frame(first, &field, 0);
            assert_eq!(Lengths::default().sound(&wrong), 0, "{wrong:x?}");
            let before = frame(0x81, &[2], 2);
            let both = [before.clone(), wrong].concat();
            assert_eq!(Lengths::default().sound(&both), before.len());
        }
    }

    proptest! {
        #[test]
        fn pieces_are_of_the_same_kind_as_the_whole(cuts in prop::collection::vec(1..9_000_usize, 1..40)) {
            let (bytes, mut lengths) = ([sound_frames(), frame(0x81, &two(5), 5)].concat(), Lengths::default());
            let (mut rest, mut cuts) = (bytes.as_slice(), cuts.iter().cycle());
            let mut sound = 0;
            while !rest.is_empty() {
                let (piece, more) = rest.split_at((*cuts.next().expect("a cut")).min(rest.len()));
                let of_piece = lengths.sound(piece);
                sound += of_piece;
                if of_piece < piece.len() {
                    break;
                }
                rest = more;
            }
            // A header that is cut is passed on as far as it has come.
            let begins = sound_frames().len();
            prop_assert!((begins..begins + 4).contains(&sound), "{sound} of {begins}");
        }
    }
}
