//! MAVLink against frames that pymavlink wrote: read, written again bit for bit, refused when one bit is wrong; signatures of
//! pymavlink believed once.

use crate::hex::hex;
use proptest::prelude::*;
use serde_json::Value;
use stampfly_link::mavlink::dialects::common::MavMessage;
use stampfly_link::mavlink::signing::{Signer, SigningKey, Untrusted, Verifier};
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkFrame, MavlinkVersion, MavlinkWriter};
use stampfly_types::Instant;

type Decoder = MavlinkDecoder<MavMessage>;

const PASSPHRASE: &str = "a long sentence that nobody guesses";

fn frames(vectors: &str, list: &str) -> Vec<Vec<u8>> {
    let vectors: Value = serde_json::from_str(vectors).expect("JSON");
    let frames = vectors[list].as_array().expect("a list");
    frames.iter().map(|frame| hex(&frame["hex"])).collect()
}

fn plain() -> Vec<Vec<u8>> {
    frames(include_str!("../vectors/mavlink.json"), "msg")
}

fn signed() -> Vec<Vec<u8>> {
    frames(include_str!("../vectors/mavlink_signed.json"), "frames")
}

/// What `look` says of every frame that is found.
fn found<T>(decoder: &mut Decoder, bytes: &[u8], mut look: impl FnMut(MavlinkFrame<'_>) -> T) -> Vec<T> {
    bytes.iter().filter_map(|byte| decoder.feed(*byte).map(&mut look)).collect()
}

#[test]
fn frames_of_pymavlink_are_read_and_written_again_bit_for_bit() {
    let frames = plain();
    assert!(frames.len() >= 18);
    for bytes in frames {
        let read = found(&mut Decoder::new(), &bytes, |frame| {
            let message: MavMessage = frame.message().expect("a message of the dialect");
            (frame.version, frame.system, frame.component, frame.sequence, message)
        });
        let [(version, system, component, 0, message)] = read.as_slice() else { panic!("{bytes:02x?}: {read:?}") };
        let mut buffer = [0; LONGEST];
        let written = MavlinkWriter::new(*system, *component).write(*version, message, &mut buffer);
        assert_eq!(written, Some(bytes.as_slice()));
    }
}

#[test]
fn every_single_wrong_bit_costs_the_frame() {
    for bytes in plain().into_iter().chain(signed()) {
        // Signatures are the verifier's.
        let checked = if bytes.get(2) == Some(&1) { bytes.len() - 13 } else { bytes.len() };
        for bit in 0..checked * 8 {
            let mut wrong = bytes.clone();
            wrong[bit / 8] ^= 1 << (bit % 8);
            // Whatever length it claims now: nothing else follows that could be a frame.
            wrong.extend([0; LONGEST]);
            assert_eq!(
                found(&mut Decoder::new(), &wrong, |frame| frame.bytes().to_vec()),
                Vec::<Vec<u8>>::new(),
                "bit {bit}"
            );
        }
    }
}

#[test]
fn frames_are_found_behind_whatever_is_none() {
    let all = plain();
    let mut stream = Vec::new();
    for (index, bytes) in all.iter().enumerate() {
        // A start, a start with a length, half a frame.
        stream.extend([&[0xFD][..], &[0xFE, 3], &bytes[..bytes.len() / 2], &[0xFD, 9, 4]][index % 4]);
        stream.extend(bytes);
    }
    // What follows shows that the last beginnings were none.
    stream.extend([0; LONGEST]);
    let mut decoder = Decoder::new();
    let read = found(&mut decoder, &stream, |frame| frame.bytes().to_vec());
    assert_eq!(read, all);
    assert!(decoder.discarded() > 0);
}

#[test]
fn a_flag_that_is_not_known_makes_it_no_frame() {
    let mut bytes = plain().into_iter().find(|bytes| bytes.first() == Some(&0xFD)).expect("one of version 2");
    bytes[2] = 0x80;
    assert_eq!(found(&mut Decoder::new(), &bytes, |_| ()), []);
}

#[test]
fn signatures_of_pymavlink_are_believed_once_and_ours_are_the_same() {
    let frames = signed();
    let (key, mut decoder) = (SigningKey::from_passphrase(PASSPHRASE), Decoder::new());
    let mut verifier = Verifier::new(key.clone(), 0);
    let all = frames.concat();
    assert_eq!(found(&mut decoder, &all, |frame| verifier.verify(&frame)), [Ok(()); 3]);
    assert_eq!(found(&mut decoder, &all, |frame| verifier.verify(&frame)), [Err(Untrusted::Old); 3]);

    // Signed again at the same times.
    let (mut signer, mut writer) = (Signer::new(key, 3, 123_456_788), MavlinkWriter::new(255, 190));
    for bytes in &frames {
        let message: MavMessage = found(&mut decoder, bytes, |frame| frame.message().expect("a message")).remove(0);
        let mut buffer = [0; LONGEST];
        assert_eq!(writer.write_signed(Instant::ZERO, &message, &mut signer, &mut buffer), Some(bytes.as_slice()));
    }
}

#[test]
fn nothing_that_was_changed_or_made_without_the_key_is_believed() {
    let judge = |bytes: &[u8]| {
        let mut verifier = Verifier::new(SigningKey::from_passphrase(PASSPHRASE), 0);
        found(&mut Decoder::new(), bytes, |frame| verifier.verify(&frame))
    };
    for bytes in signed() {
        assert_eq!(judge(&bytes), [Ok(())]);
        for bit in (bytes.len() - 13) * 8..bytes.len() * 8 {
            let mut wrong = bytes.clone();
            wrong[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(judge(&wrong), [Err(Untrusted::WrongSignature)], "bit {bit}");
        }
    }
    let mut verifier = Verifier::new(SigningKey::from_passphrase("another"), 0);
    let bytes = signed().concat();
    assert_eq!(
        found(&mut Decoder::new(), &bytes, |frame| verifier.verify(&frame)),
        [Err(Untrusted::WrongSignature); 3]
    );
    assert_eq!(verifier.time(), 0, "nothing is remembered");
    assert_eq!(found(&mut Decoder::new(), &plain()[12], |frame| verifier.verify(&frame)), [Err(Untrusted::Unsigned)]);
}

#[test]
fn a_frame_from_before_the_restart_is_not_believed_and_a_clock_that_stands_signs_on() {
    let key = SigningKey::from_passphrase(PASSPHRASE);
    let mut signer = Signer::new(key.clone(), 0, 1_000);
    let message = MavMessage::HEARTBEAT(Default::default());
    let mut times = Vec::new();
    let mut before = Vec::new();
    for _ in 0..3 {
        let mut buffer = [0; LONGEST];
        let sent = MavlinkWriter::new(1, 1).write_signed(Instant::ZERO, &message, &mut signer, &mut buffer);
        before.extend(sent.expect("there is room"));
        times.push(signer.time());
    }
    assert_eq!(times, [1_001, 1_002, 1_003]);
    // Six million units are a minute.
    let mut verifier = Verifier::new(key, 6_002_000);
    let judged = found(&mut Decoder::new(), &before, |frame| verifier.verify(&frame));
    assert_eq!(judged, [Err(Untrusted::Old); 3]);
}

#[test]
fn a_key_is_not_printed() {
    let key = SigningKey::new([0xAB; 32]);
    let text = format!("{key:?} {:?} {:?}", Signer::new(key.clone(), 0, 0), Verifier::new(key.clone(), 0));
    assert!(!text.contains("171") && !text.to_lowercase().contains("ab, "), "{text}");
}

proptest! {
    #[test]
    fn bytes_of_strangers_are_no_frame_that_is_not_one(bytes in prop::collection::vec(prop_oneof![Just(0xFD_u8), Just(0xFE), Just(0), any::<u8>()], 0..600)) {
        let mut decoder = Decoder::new();
        for (version, whole) in found(&mut decoder, &bytes, |frame| (frame.version, frame.bytes().to_vec())) {
            let start = if version == MavlinkVersion::V1 { 0xFE } else { 0xFD };
            prop_assert_eq!(whole.first(), Some(&start));
        }
    }
}

proptest! {
    /// However a stream is cut into buffers, whatever stands between its frames, and whichever of them are broken.
    #[test]
    fn a_buffer_has_the_frames_that_its_bytes_have(
        parts in prop::collection::vec((any::<prop::sample::Index>(), prop::collection::vec(prop_oneof![Just(0xFD), Just(0xFE), Just(0), any::<u8>()], 0..12), 0..4_u8), 0..12),
        cut in 1..80_usize,
    ) {
        let frames = plain();
        let mut bytes = Vec::new();
        for (which, noise, broken) in parts {
            let mut frame = which.get(&frames).clone();
            if broken == 0 {
                let middle = frame.len() / 2;
                frame.remove(middle);
            }
            bytes.extend(noise);
            bytes.extend(frame);
        }
        let (mut by_byte, mut by_buffer) = (Decoder::new(), Decoder::new());
        let mut read = Vec::new();
        for mut buffer in bytes.chunks(cut) {
            while let Some(frame) = by_buffer.read(&mut buffer) {
                read.push(frame.bytes().to_vec());
            }
            prop_assert!(buffer.is_empty());
        }
        let fed = found(&mut by_byte, &bytes, |frame| frame.bytes().to_vec());
        prop_assert_eq!(read, fed);
        prop_assert_eq!(by_buffer.discarded(), by_byte.discarded());
    }
}
