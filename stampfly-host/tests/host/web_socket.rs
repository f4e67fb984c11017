//! What breaks the WebSocket protocol at the ground station's server: every kind of it ends with
//! the close code that RFC 6455 names in section 7.4.1, and other pages are served on.

use crate::ground::{connect, get, handshake, next, send, server, socket};
use serde_json::json;
use stampfly_host::ground::Hub;
use std::io::{BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

const SOON: Duration = Duration::from_secs(5);
const NORMAL: u16 = 1000;
const GOING_AWAY: u16 = 1001;
const PROTOCOL: u16 = 1002;
const UNSUPPORTED: u16 = 1003;
const NOT_UTF8: u16 = 1007;
const TOO_LARGE: u16 = 1009;

/// The first byte of a frame: its opcode, and whether it is the last of its message.
const FIN: u8 = 0x80;
const MORE: u8 = 0;
const TEXT: u8 = 1;
const BINARY: u8 = 2;
const CLOSE: u8 = 8;
const PING: u8 = 9;
const PONG: u8 = 10;
/// The first bit of the second byte: what follows is masked, as clients have to do it.
const MASKED: u8 = 0x80;

/// A client that sends bytes, and reads frames.
struct Client {
    stream: TcpStream,
    reader: BufReader<TcpStream>,
}

impl Client {
    /// Its WebSocket is open. `more` has come in one piece with its handshake.
    fn open(address: SocketAddr, more: &[u8]) -> Self {
        let mut stream = connect(address);
        stream.write_all(&[handshake().as_bytes(), more].concat()).expect("sent");
        let mut reader = BufReader::new(stream.try_clone().expect("a handle"));
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            reader.read_exact(&mut byte).expect("an answer");
            head.extend(byte);
        }
        assert!(head.starts_with(b"HTTP/1.1 101 "), "{}", String::from_utf8_lossy(&head));
        Self { stream, reader }
    }

    /// What the server has closed is not sent.
    fn send(&mut self, bytes: &[u8]) {
        _ = self.stream.write_all(bytes);
    }

    /// The next frame: its opcode and its payload. `None` at the end of the connection.
    fn next(&mut self) -> Option<(u8, Vec<u8>)> {
        let mut first = [0];
        // One that was reset is an error: what was said last may be lost then.
        if self.reader.read(&mut first).expect("no reset") == 0 {
            return None;
        }
        let short = u64::from(self.bytes::<1>()[0]);
        let length = match short {
            126 => u64::from(u16::from_be_bytes(self.bytes())),
            127 => u64::from_be_bytes(self.bytes()),
            short => short,
        };
        let mut payload = vec![0; length as usize];
        self.reader.read_exact(&mut payload).expect("a whole frame");
        Some((first[0] & 0x0F, payload))
    }

    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let mut bytes = [0; N];
        self.reader.read_exact(&mut bytes).expect("a whole frame");
        bytes
    }

    /// The payload of the next frame of this kind that is as wanted.
    fn next_of(&mut self, kind: u8, is_wanted: impl Fn(&[u8]) -> bool) -> Vec<u8> {
        let until = Instant::now() + SOON;
        while Instant::now() < until {
            let (opcode, payload) = self.next().expect("the connection is open");
            if opcode == kind && is_wanted(&payload) {
                return payload;
            }
        }
        panic!("no frame {kind}");
    }

    /// The next reply.
    fn reply(&mut self) -> String {
        String::from_utf8(self.next_of(TEXT, |text| text.starts_with(b"{\"reply\""))).expect("text")
    }

    /// The body of the server's close frame, behind which the connection ends without a reset.
    fn closed(&mut self) -> Vec<u8> {
        let body = self.next_of(CLOSE, |_| true);
        assert_eq!(self.next(), None, "nothing follows a close frame");
        body
    }
}

/// A frame of a client.
fn frame(first: u8, payload: &[u8]) -> Vec<u8> {
    let length = payload.len();
    match length {
        0..126 => framed(first, &[length as u8], payload),
        126..65_536 => framed(first, &two(length as u16), payload),
        _ => framed(first, &eight(length as u64), payload),
    }
}

/// The same, whose length is said by these bytes.
fn framed(first: u8, length: &[u8], payload: &[u8]) -> Vec<u8> {
    let mask = [0x12, 0x34, 0x56, 0x78];
    let masked = payload.iter().zip(mask.iter().cycle()).map(|(byte, mask)| byte ^ mask);
    let mut bytes = [&[first], length, &mask].concat();
    bytes[1] |= MASKED;
    bytes.extend(masked);
    bytes
}

/// A length in two bytes, and in eight.
fn two(length: u16) -> Vec<u8> {
    [&[126][..], &length.to_be_bytes()].concat()
}

fn eight(length: u64) -> Vec<u8> {
    [&[127][..], &length.to_be_bytes()].concat()
}

fn close(code: u16, reason: &[u8]) -> Vec<u8> {
    frame(FIN | CLOSE, &[&code.to_be_bytes(), reason].concat())
}

/// What breaks the protocol, one by one: in words, the code it has to end with, the bytes.
fn breaches() -> Vec<(String, u16, Vec<u8>)> {
    let mut all = Vec::new();
    let mut add = |name: &str, code, bytes: Vec<u8>| all.push((name.to_owned(), code, bytes));
    add("a frame without a mask", PROTOCOL, b"\x81\x02{}".to_vec());
    add("a ping without a mask", PROTOCOL, b"\x89\x00".to_vec());
    for reserved in [0x40, 0x20, 0x10] {
        for opcode in [TEXT, PING, CLOSE] {
            add(&format!("reserved bit {reserved:x} of {opcode}"), PROTOCOL, frame(FIN | reserved | opcode, b""));
        }
    }
    for opcode in (3..8).chain(11..16) {
        add(&format!("reserved opcode {opcode}"), PROTOCOL, frame(FIN | opcode, b"x"));
    }
    for opcode in [CLOSE, PING, PONG] {
        add(&format!("control frame {opcode} in fragments"), PROTOCOL, frame(opcode, &NORMAL.to_be_bytes()));
        add(&format!("control frame {opcode} of 126 bytes"), PROTOCOL, frame(FIN | opcode, &[3; 126]));
        add(&format!("control frame {opcode} of 1 MB"), PROTOCOL, framed(FIN | opcode, &eight(1 << 20), b""));
    }

    let begun = frame(TEXT, b"{");
    let after_begun = |next: &[u8]| [&begun, next].concat();
    add("the end of nothing", PROTOCOL, frame(FIN | MORE, b"x"));
    add("the middle of nothing", PROTOCOL, frame(MORE, b"x"));
    add("the end of a message that has ended", PROTOCOL, [frame(FIN | TEXT, b"{}"), frame(FIN | MORE, b"x")].concat());
    for first in [FIN | TEXT, TEXT, FIN | BINARY] {
        add(&format!("message {first:x} within another"), PROTOCOL, after_begun(&frame(first, b"{}")));
    }

    // Not begun, too long, a surrogate, behind the last character, not ended.
    for wrong in [&b"\xff\xfe"[..], b"\xc0\x80", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\"\xe2\x82"] {
        add(&format!("text {wrong:x?}"), NOT_UTF8, frame(FIN | TEXT, wrong));
        let (start, end) = wrong.split_at(1);
        let in_two = [frame(TEXT, start), frame(FIN | MORE, end)].concat();
        add(&format!("text {wrong:x?} in two parts"), NOT_UTF8, in_two);
        add(&format!("reason {wrong:x?}"), NOT_UTF8, close(NORMAL, wrong));
    }
    add("text that stops within a character", NOT_UTF8, [frame(TEXT, b"\xe2\x82"), frame(FIN | MORE, b"")].concat());

    add("20 MB announced", TOO_LARGE, framed(FIN | TEXT, &eight(20 << 20), b"x"));
    add("2^62 bytes announced", TOO_LARGE, framed(FIN | TEXT, &eight(1 << 62), b"x"));
    add("100 kB in one frame", TOO_LARGE, frame(FIN | TEXT, &[b' '; 100_000]));
    add("4 MB in one frame", TOO_LARGE, frame(FIN | TEXT, &vec![b' '; 4 << 20]));
    add("9 kB in fragments", TOO_LARGE, after_begun(&frame(MORE, &[b' '; 1_000]).repeat(9)));

    add("a close frame of one byte", PROTOCOL, frame(FIN | CLOSE, b"\x03"));
    // Not for a wire, for later versions of the protocol, or not a code at all.
    for code in [0, 999, 1004, 1005, 1006, 1015, 1016, 2999, 5000, u16::MAX] {
        add(&format!("close code {code}"), PROTOCOL, close(code, b""));
    }

    let long = [b' '; 300];
    for (name, length, payload) in [
        ("nothing in two bytes", two(0), &long[..0]),
        ("125 in two bytes", two(125), &long[..125]),
        ("125 in eight bytes", eight(125), &long[..125]),
        ("300 in eight bytes", eight(300), &long),
        ("a length with its top bit set", eight(1 << 63), &long),
        ("the largest length", eight(u64::MAX), &long),
    ] {
        for first in [FIN | TEXT, FIN | PING, TEXT] {
            add(&format!("{name}, frame {first:x}"), PROTOCOL, framed(first, &length, payload));
        }
    }
    add("a binary message", UNSUPPORTED, frame(FIN | BINARY, b"{}"));
    all
}

#[test]
fn what_breaks_the_protocol_ends_with_the_code_that_the_rfc_names_and_others_are_served_on() {
    let server = server(&Hub::new(Vec::new()));
    let address = server.address();
    let mut other = socket(address);
    for (id, (name, code, bytes)) in breaches().into_iter().enumerate() {
        let mut client = Client::open(address, b"");
        client.send(&bytes);
        let body = client.closed();
        assert_eq!(body.first_chunk().map(|code| u16::from_be_bytes(*code)), Some(code), "{name}: {body:x?}");
        drop(client);
        send(&mut other, &json!({ "id": id, "do": "subscribe", "topics": [], "rate": 50 }));
        assert_eq!(next(&mut other, "reply")["id"], id, "after {name}");
    }
    next(&mut socket(address), "hello");
    assert!(get(address, "/").starts_with("HTTP/1.1 200 "));
}

/// A connection that is reset may lose what was said last: the code.
#[test]
fn a_client_that_is_still_sending_is_not_reset() {
    let server = server(&Hub::new(Vec::new()));
    let is_left_alone = || {
        let mut client = Client::open(server.address(), b"");
        client.send(&frame(FIN | TEXT, &[b' '; 100_000]));
        assert_eq!(client.closed(), TOO_LARGE.to_be_bytes());
        // The answer to what comes after an end comes with the next one.
        (0..3).all(|_| {
            std::thread::sleep(Duration::from_millis(10));
            client.stream.write_all(b"more").is_ok()
        })
    };
    // The server waits for a second; a busy machine may hold a test for longer.
    assert!((0..3).any(|_| is_left_alone()));
}

#[test]
fn what_comes_with_the_handshake_is_looked_at_like_what_comes_later() {
    let server = server(&Hub::new(Vec::new()));
    let subscribe = frame(FIN | TEXT, br#"{"id":7,"do":"subscribe","topics":[],"rate":1}"#);
    for (breach, code) in [
        (framed(FIN | TEXT, &two(2), b"{}"), PROTOCOL),
        (frame(FIN | TEXT, b"\xff"), NOT_UTF8),
        (frame(FIN | BINARY, b""), UNSUPPORTED),
    ] {
        // What was said before it is answered.
        let mut client = Client::open(server.address(), &[subscribe.clone(), breach].concat());
        assert!(client.reply().contains("\"id\":7"));
        assert_eq!(client.closed(), code.to_be_bytes());
    }
}

#[test]
fn a_client_that_closes_is_told_its_own_code() {
    let server = server(&Hub::new(Vec::new()));
    for body in [&b""[..], b"\x03\xe8", b"\x03\xe9away", b"\x03\xf3\xc3\xbc", b"\x0b\xb8", b"\x13\x87"] {
        let mut client = Client::open(server.address(), b"");
        client.send(&frame(FIN | CLOSE, body));
        let closed = client.closed();
        assert_eq!(closed.get(..2), body.get(..2), "{body:x?}");
    }
}

#[test]
fn what_keeps_to_the_protocol_is_answered() {
    let server = server(&Hub::new(Vec::new()));
    let mut client = Client::open(server.address(), b"");
    client.send(&frame(FIN | PING, &[7; 125]));
    assert_eq!(client.next_of(PONG, |_| true), [7; 125]);
    client.send(&frame(FIN | PONG, b"without a ping"));
    // In parts, with a ping between them, one of nothing, and a character of which each has a half.
    let text = "{\"id\":8,\"do\":\"subscribe\",\"topics\":[\"ü\"],\"rate\":1}".as_bytes();
    let (start, end) = text.split_at(text.iter().position(|byte| *byte == 0xBC).expect("the second half"));
    let parts = [frame(TEXT, start), frame(FIN | PING, b"!"), frame(MORE, b""), frame(FIN | MORE, end)];
    client.send(&parts.concat());
    assert_eq!(client.next_of(PONG, |_| true), b"!");
    assert!(client.reply().contains("\"id\":8,\"ok\":true"));
    // Lengths of one, two and three bytes, whatever the text says.
    for length in [0, 125, 126, 127, 8_192] {
        client.send(&frame(FIN | TEXT, &vec![b' '; length]));
        assert!(client.reply().contains("\"ok\":false"), "{length}");
    }
    client.send(&close(NORMAL, b""));
    assert_eq!(client.closed(), NORMAL.to_be_bytes());
}

#[test]
fn a_server_that_goes_says_so() {
    let server = server(&Hub::new(Vec::new()));
    let mut client = Client::open(server.address(), b"");
    drop(server);
    assert_eq!(client.closed(), GOING_AWAY.to_be_bytes());
}
