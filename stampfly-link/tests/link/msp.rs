//! Frames of MSP from the protocol's description: read, written again bit for bit, and refused when they are broken.

use crate::hex::hex;
use serde_json::Value;
use stampfly_link::msp::{Direction, MspDecoder, MspFrame, Version};

fn vectors() -> Value {
    serde_json::from_str(include_str!("../vectors/msp.json")).expect("well-formed")
}

/// The one frame in these bytes, checked to be the same when it is written.
fn read(bytes: &[u8], check: impl FnOnce(MspFrame<'_>)) {
    let mut decoder = MspDecoder::<512>::new();
    let (last, before) = bytes.split_last().expect("not empty");
    assert!(before.iter().all(|byte| decoder.feed(*byte).is_none()));
    let frame = decoder.feed(*last).expect("a frame");
    let mut again = vec![0; bytes.len()];
    assert_eq!(frame.write(&mut again), Some(bytes.len()));
    assert_eq!(again, bytes);
    check(frame);
}

#[test]
fn requests() {
    let vectors = vectors();
    let requests = vectors["requests"].as_object().expect("requests");
    assert!(requests.len() >= 20);
    for (id, bytes) in requests {
        read(&hex(bytes), |frame| {
            assert_eq!(frame, MspFrame::request(id.parse().expect("an id")));
        });
    }
}

#[test]
fn replies() {
    let vectors = vectors();
    for reply in vectors["responses"].as_array().expect("replies") {
        read(&hex(&reply["hex"]), |frame| {
            let error = reply["name"].as_str().is_some_and(|name| name.starts_with("error"));
            let direction = if error { Direction::Error } else { Direction::Reply };
            assert_eq!((frame.version, frame.direction), (Version::One, direction), "{reply}");
        });
    }
    let attitude = &vectors["responses"][5];
    assert!(attitude["name"].as_str().is_some_and(|name| name.starts_with("ATTITUDE roll -12.3")));
    read(&hex(&attitude["hex"]), |frame| {
        let angles: Vec<_> = frame.payload.chunks(2).map(|pair| i16::from_le_bytes([pair[0], pair[1]])).collect();
        assert_eq!((frame.id, angles), (108, vec![-123, 45, 180]));
    });
}

#[test]
fn version_2() {
    let vectors = vectors();
    let frames = vectors["v2"].as_array().expect("frames");
    assert_eq!(frames.len(), 3);
    let ids = [1, 0x2002, 100];
    for (frame, id) in frames.iter().zip(ids) {
        read(&hex(&frame["hex"]), |read| assert_eq!((read.version, read.id), (Version::Two, id), "{frame}"));
    }
}

#[test]
fn jumbo() {
    let jumbo = &vectors()["jumbo"];
    let bytes =
        [hex(&jumbo["hex_of_300_zero_bytes_reply_cmd_70_head"]), vec![0; 300], hex(&jumbo["checksum"])].concat();
    read(&bytes, |frame| assert_eq!((frame.id, frame.payload), (70, &[0; 300][..])));
}

#[test]
fn what_is_broken_is_refused_and_what_follows_is_read() {
    let vectors = vectors();
    let found = |bytes: &[u8]| {
        let mut decoder = MspDecoder::<512>::new();
        bytes.iter().filter_map(|byte| decoder.feed(*byte).map(|frame| frame.id)).collect::<Vec<_>>()
    };
    let bad = |index: usize| hex(&vectors["bad"][index]["hex"]);
    assert_eq!((found(&bad(0)), found(&bad(1))), (vec![], vec![]));
    assert_eq!(found(&bad(2)), [101], "garbage, then a frame");
    // Several questions in one piece, as MultiWiiConf sends them.
    let ids = [116, 111, 112, 113, 114, 100, 115];
    let piece: Vec<u8> = ids.iter().flat_map(|id: &u16| hex(&vectors["requests"][id.to_string()])).collect();
    assert_eq!(found(&piece), ids);
    assert_eq!(found(&[bad(0), piece.clone()].concat()), ids);
    // The stream that stops takes the first question for its own rest.
    assert_eq!(found(&[bad(1), piece].concat()), ids);
}
