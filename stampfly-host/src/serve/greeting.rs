//! The first bytes of a connection: are they the port's language?
//!
//! A web page can make a browser connect to any port of its computer, and choose the bytes behind
//! the head of the request. A decoder that searches for the next frame would find one there. So the
//! reader hands nothing over before a first frame, or a first line, has shown the port's language,
//! and ends a connection that begins with anything else. Later noise between frames is skipped, as
//! on any line.

use stampfly_link::mavlink::MavlinkDecoder;
use stampfly_link::mavlink::dialects::common::MavMessage;
use stampfly_link::msp::MspDecoder;
use stampfly_sim::vehicle::Speech;
use std::fmt;

/// Bytes that wait for the end of a first frame or line: more than the longest frame of MAVLink
/// has.
const LONGEST: usize = 512;
/// Payload of a first question in MSP: configurators begin with one that has none.
const QUESTION: usize = 256;
/// Lines with this in them are the first of a request in HTTP, whichever its method.
const HTTP: &[u8] = b" HTTP/";
/// First byte of a greeting in TLS. At a terminal it is Ctrl-V.
const TLS: u8 = 0x16;
/// First bytes that programs for terminals send: line ends, keys that are none of text, and the
/// beginning of a telnet command.
const KEYS: &[u8] = b"\r\n\t\x03\x04\x08\x0c\x15\x17\x1b\x7f\xff";

/// The language of a connection that does not speak its port's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foreign {
    /// HTTP: a browser, most likely with a web page that does what it must not.
    Http,
    /// TLS.
    Tls,
    /// Something else.
    Other,
}

impl fmt::Display for Foreign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Http => "HTTP",
            Self::Tls => "TLS",
            Self::Other => "another language",
        })
    }
}

impl Foreign {
    /// The language of bytes that are not a frame, judged by those received so far.
    fn of(bytes: &[u8]) -> Self {
        match bytes {
            [TLS, ..] => Self::Tls,
            _ if matches!(method(bytes), (1.., None | Some(b' '))) => Self::Http,
            _ => Self::Other,
        }
    }
}

/// Capitals that bytes begin with, as a method of HTTP does, and the byte behind them.
fn method(bytes: &[u8]) -> (usize, Option<u8>) {
    let length = bytes.iter().take_while(|byte| byte.is_ascii_uppercase()).count();
    (length, bytes.get(length).copied())
}

/// The proof that a connection speaks its port's language.
enum Proof {
    Mavlink(Box<MavlinkDecoder<MavMessage>>),
    Msp(Box<MspDecoder<QUESTION>>),
    Line,
    /// A frame of MAVLink or a line: the first byte tells which.
    Either,
    Shown,
}

/// The beginning of one connection.
pub(super) struct Greeting {
    proof: Proof,
    /// The bytes of the first frame or line so far.
    begun: Vec<u8>,
}

impl Greeting {
    /// Of a connection to a port with this language.
    pub fn new(speech: Speech) -> Self {
        let proof = match speech {
            Speech::Mavlink => Proof::Mavlink(Box::default()),
            Speech::Msp => Proof::Msp(Box::default()),
            Speech::Text => Proof::Line,
            Speech::Cable => Proof::Either,
            Speech::Http | Speech::Datagrams => Proof::Shown,
        };
        Self { proof, begun: Vec::new() }
    }

    /// Has it shown the port's language?
    pub const fn is_shown(&self) -> bool {
        matches!(self.proof, Proof::Shown)
    }

    /// Takes the next bytes, and hands over those that may be obeyed: a first frame when it is
    /// whole, a first line key by key, and then everything.
    ///
    /// # Errors
    /// When they are not the port's language. The connection is to be ended.
    pub fn hear(&mut self, bytes: &[u8]) -> Result<Vec<u8>, Foreign> {
        if matches!(self.proof, Proof::Shown) {
            return Ok(bytes.to_vec());
        }
        self.begun.extend_from_slice(bytes);
        let Some(first) = self.begun.first().copied() else { return Ok(Vec::new()) };
        if matches!(self.proof, Proof::Either) {
            self.proof = if matches!(first, 0xFD | 0xFE) { Proof::Mavlink(Box::default()) } else { Proof::Line };
        }
        let (is_whole, discarded) = match &mut self.proof {
            Proof::Mavlink(decoder) => (bytes.iter().any(|byte| decoder.feed(*byte).is_some()), decoder.discarded()),
            Proof::Msp(decoder) => (bytes.iter().any(|byte| decoder.feed(*byte).is_some()), decoder.discarded()),
            Proof::Line | Proof::Either | Proof::Shown => return self.line(first, bytes),
        };
        if discarded > 0 || (!is_whole && self.begun.len() > LONGEST) {
            return Err(Foreign::of(&self.begun));
        }
        if is_whole {
            self.proof = Proof::Shown;
            return Ok(core::mem::take(&mut self.begun));
        }
        Ok(Vec::new())
    }

    /// A line has no effect before its end, and a terminal must echo each key: keys are handed over
    /// as they come.
    fn line(&mut self, first: u8, bytes: &[u8]) -> Result<Vec<u8>, Foreign> {
        let is_text = first == b' ' || first.is_ascii_graphic() || KEYS.contains(&first);
        let end = self.begun.iter().position(|byte| matches!(byte, b'\r' | b'\n'));
        let line = self.begun.get(..end.unwrap_or(self.begun.len())).unwrap_or_default();
        let is_http = line.windows(HTTP.len()).any(|part| part == HTTP) || matches!(method(line), (3.., Some(b' ')));
        if !is_text || is_http || (end.is_none() && self.begun.len() > LONGEST) {
            return Err(if is_http { Foreign::Http } else { Foreign::of(&self.begun) });
        }
        if end.is_some() {
            self.proof = Proof::Shown;
            self.begun.clear();
        }
        Ok(bytes.to_vec())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_link::mavlink::dialects::common::HEARTBEAT_DATA;
    use stampfly_link::mavlink::{LONGEST as FRAME, MavlinkVersion, MavlinkWriter};
    use stampfly_link::msp::MspFrame;

    const STREAMS: [Speech; 4] = [Speech::Mavlink, Speech::Msp, Speech::Text, Speech::Cable];

    fn heartbeat() -> Vec<u8> {
        let mut room = [0; FRAME];
        let message = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
        MavlinkWriter::new(255, 190).write(MavlinkVersion::V2, &message, &mut room).expect("there is room").to_vec()
    }

    fn question() -> Vec<u8> {
        let mut room = [0; 16];
        let length = MspFrame::request(1).write(&mut room).expect("there is room");
        room[..length].to_vec()
    }

    /// What is handed over when these bytes come in pieces of this length.
    fn heard(speech: Speech, bytes: &[u8], piece: usize) -> Result<Vec<u8>, Foreign> {
        let mut greeting = Greeting::new(speech);
        let parts = bytes.chunks(piece).map(|part| greeting.hear(part));
        Ok(parts.collect::<Result<Vec<_>, _>>()?.concat())
    }

    #[test]
    fn every_language_is_handed_over_whole_in_pieces_of_any_length() {
        let text = b"status\r\nPOST is no method in a second line HTTP/1.1\r\n".to_vec();
        let noise = |begin: Vec<u8>| [begin.as_slice(), b"noise", &begin].concat();
        let languages = [
            (Speech::Mavlink, noise(heartbeat())),
            (Speech::Msp, noise(question())),
            (Speech::Text, text.clone()),
            (Speech::Cable, text),
            (Speech::Cable, noise(heartbeat())),
            (Speech::Http, b"GET / HTTP/1.1\r\n".to_vec()),
        ];
        for (speech, bytes) in languages {
            for piece in [1, 2, 7, 1000] {
                assert_eq!(heard(speech, &bytes, piece), Ok(bytes.clone()), "{speech:?} in pieces of {piece}");
            }
        }
    }

    #[test]
    fn what_a_browser_can_say_is_never_handed_over_with_a_line_end_or_a_frame() {
        let smuggled = [heartbeat(), question(), b"\r\nparam set rate.roll.kp 0\r\n".to_vec()].concat();
        let heads: [(&[u8], Foreign); 7] = [
            (b"POST / HTTP/1.1\r\nHost: localhost:5760\r\n\r\n", Foreign::Http),
            (b"GET /\xfd HTTP/1.1\r\n\r\n", Foreign::Http),
            (b"OPTIONS * HTTP/1.1\r\n\r\n", Foreign::Http),
            (b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", Foreign::Http),
            // The first bytes of TLS, and of STUN over TCP, which WebRTC uses.
            (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", Foreign::Tls),
            (b"\x00\x01\x00\x00\x21\x12\xa4\x42", Foreign::Other),
            (b"\x80\x2e\x01\x03\x01", Foreign::Other),
        ];
        for speech in STREAMS {
            for (head, foreign) in heads {
                for piece in [1, 3, 1000] {
                    let bytes = [head, &smuggled].concat();
                    assert_eq!(heard(speech, &bytes, piece), Err(foreign), "{speech:?}: {head:?}");
                }
            }
        }
    }

    #[test]
    fn a_frame_behind_other_bytes_ends_the_connection() {
        for begin in [&b"noise"[..], b"\xfd", b"\xfe\x09", b"$M", &heartbeat()[..5]] {
            let bytes = [begin, &heartbeat()].concat();
            assert!(heard(Speech::Mavlink, &bytes, 1).is_err(), "{begin:?}");
            let bytes = [begin, &question()].concat();
            assert!(heard(Speech::Msp, &bytes, 1).is_err(), "{begin:?}");
        }
        assert_eq!(heard(Speech::Mavlink, &[0xFD; 2], 1), Ok(Vec::new()), "it may still become a frame");
        assert!(heard(Speech::Text, &[b'x'; LONGEST + 1], 100).is_err(), "no line is so long");
    }
}
