//! What other programs send: datagrams as bytes or as JSON, and lines of a CSV log.

use crate::Input;
use stampfly_link::{Datagram, DatagramError, json};
use stampfly_log::csv;
use stampfly_rover::com::{Body, MAX};
use stampfly_rover::messages::LogRecord;

/// The first byte says what the rest is: a datagram, one whose length and checksum are put right, JSON, or CSV.
pub fn rover_datagrams(data: &[u8]) {
    let mut input = Input(data);
    let kind = input.byte() % 4;
    let rest = input.0;
    match (kind, std::str::from_utf8(rest)) {
        (0, _) => binary(rest),
        (1, _) => binary(&repaired(rest)),
        (2, Ok(text)) => {
            if let Ok(datagram) = json::read::<Body>(text) {
                sent_again(&datagram);
            }
        }
        (_, Ok(text)) => {
            for line in text.lines() {
                let Ok(record) = csv::read_line::<LogRecord>(line) else { continue };
                let mut again = String::new();
                csv::write_line(&record, &mut again).expect("a String takes everything");
                assert_eq!(csv::read_line::<LogRecord>(again.trim_end()), Ok(record), "{line:?}");
            }
        }
        (_, Err(_)) => {}
    }
}

fn binary(bytes: &[u8]) {
    match Datagram::<Body>::read(bytes) {
        Ok(datagram) => {
            let mut buffer = [0; MAX];
            assert_eq!(datagram.write(&mut buffer), Ok(bytes), "the same datagram");
            sent_again(&datagram);
        }
        Err(DatagramError::Syntax | DatagramError::Member) => panic!("errors of JSON"),
        Err(_) => {}
    }
}

/// Whatever was accepted is accepted again, as bytes and as text.
fn sent_again(datagram: &Datagram<Body>) {
    let mut buffer = [0; MAX];
    let bytes = datagram.write(&mut buffer).expect("it was valid");
    assert_eq!(Datagram::read(bytes).as_ref(), Ok(datagram));
    let mut text = String::new();
    json::write(datagram, &mut text).expect("a String takes everything");
    assert_eq!(json::read(&text).as_ref(), Ok(datagram), "{text}");
}

/// The input as the body of a datagram: magic, version, length and checksum are right.
fn repaired(bytes: &[u8]) -> Vec<u8> {
    let mut input = Input(bytes);
    let kind = input.byte();
    let stamp = input.bytes(12);
    let body = input.0;
    let mut datagram = b"RVR1\x01".to_vec();
    datagram.push(kind);
    datagram.extend(u16::try_from(body.len()).unwrap_or(u16::MAX).to_le_bytes());
    datagram.extend(stamp.iter().chain([0; 12].iter()).take(12));
    datagram.extend(body);
    let checksum = crc32(&datagram);
    datagram.extend(checksum.to_le_bytes());
    datagram
}

/// CRC-32 of IEEE 802.3, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    let bits = bytes.iter().flat_map(|byte| (0..8).map(move |bit| byte >> bit & 1));
    !bits.fold(!0, |crc, bit| (crc >> 1) ^ if (crc & 1) as u8 == bit { 0 } else { 0xEDB8_8320 })
}
