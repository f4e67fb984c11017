//! Frames of radio receivers, from other people's tests and from the formats' descriptions: read, written again bit for bit, and refused when
//! a bit is wrong.

use crate::hex::hex;
use serde_json::Value;
use stampfly_link::serial::Channels;
use stampfly_link::serial::crsf::{CrsfDecoder, CrsfFrame, LinkStatistics, Message};
use stampfly_link::serial::ibus::{IbusDecoder, IbusFrame};
use stampfly_link::serial::sbus::{SbusDecoder, SbusFrame};
use stampfly_link::types::{Duration, Instant};

/// The frames of a protocol, with their bytes.
fn frames(protocol: &str) -> Vec<(Value, Vec<u8>)> {
    let vectors: Value = serde_json::from_str(include_str!("../vectors/rc_serial.json")).expect("well-formed");
    let frames = vectors[protocol]["frames"].as_array().expect("frames").clone();
    let found: Vec<_> = frames.into_iter().map(|frame| (hex(&frame["hex"]), frame)).collect();
    assert!(found.len() >= 4, "{protocol}");
    found.into_iter().map(|(bytes, frame)| (frame, bytes)).collect()
}

fn numbers(value: &Value) -> Vec<u16> {
    value.as_array().into_iter().flatten().map(|number| number.as_u64().expect("a number") as u16).collect()
}

#[test]
fn sbus_frames_are_read_and_written() {
    for (frame, bytes) in frames("sbus") {
        let read = SbusFrame::decode(bytes.as_slice().try_into().expect("25 bytes")).expect("a frame");
        assert_eq!(read.channels.0.to_vec(), numbers(&frame["channels"]), "{frame}");
        let flags = [read.channel_17, read.channel_18, read.frame_lost, read.failsafe];
        let expected = frame["flags"].as_u64().expect("flags");
        assert_eq!(flags.into_iter().rev().fold(0, |all, flag| all << 1 | u64::from(flag)), expected, "{frame}");
        assert_eq!(read.to_bytes().to_vec(), bytes, "{frame}");
    }
}

#[test]
fn crsf_frames_are_read_and_written_and_no_bit_may_be_wrong() {
    for (frame, bytes) in frames("crsf") {
        let read = CrsfFrame::decode(&bytes).expect("a frame");
        let mut again = [0; CrsfFrame::LONGEST];
        let length = read.write(&mut again).expect("there is room");
        assert_eq!(again[..length], bytes, "{frame}");
        if let Message::Channels(channels) = read.message() {
            assert_eq!(channels.0.to_vec(), numbers(&frame["channels"]), "{frame}");
        }
        // What is understood is also written from its meaning.
        if read.message() != Message::Other && read.address == 0xC8 {
            let length = read.message().write(&mut again).expect("there is room");
            assert_eq!(again[..length], bytes, "{frame}");
        }
        // The address, which says whom a frame is for, is not part of the CRC.
        for bit in 8..bytes.len() * 8 {
            let mut wrong = bytes.clone();
            wrong[bit / 8] ^= 1 << (bit % 8);
            assert!(CrsfFrame::decode(&wrong).is_err(), "{frame}: bit {bit}");
        }
    }
}

#[test]
fn crsf_telemetry_means_what_the_vectors_say() {
    let said = |kind: u8| {
        let (_, bytes) = frames("crsf").into_iter().find(|(_, bytes)| bytes[2] == kind).expect("such a frame");
        CrsfFrame::decode(&bytes).expect("a frame").message()
    };
    let statistics = LinkStatistics {
        up_strength: [40, 41],
        up_quality: 100,
        up_noise: 5,
        antenna: 0,
        mode: 4,
        power: 3,
        down_strength: 50,
        down_quality: 99,
        down_noise: -2,
    };
    assert_eq!(said(0x14), Message::LinkStatistics(statistics));
    let Message::Attitude(attitude) = said(0x1E) else { panic!("an attitude") };
    assert_eq!((attitude.pitch, attitude.roll, attitude.yaw), (0.1, -0.2, 0.3));
    let Message::Battery(battery) = said(0x08) else { panic!("a battery") };
    assert_eq!((battery.voltage, battery.current, battery.used, battery.remaining), (3.7, 0.5, 120, 55));
    assert_eq!(said(0x32), Message::Other);
}

#[test]
fn ibus_frames_are_read_and_written_and_no_bit_may_be_wrong() {
    for (frame, bytes) in frames("ibus") {
        let whole: &[u8; IbusFrame::LENGTH] = bytes.as_slice().try_into().expect("32 bytes");
        let read = IbusFrame::decode(whole).expect("a frame");
        for key in ["channels", "low12"] {
            if frame[key].is_array() {
                assert_eq!(read.channels.to_vec(), numbers(&frame[key]), "{frame}");
            }
        }
        let more = numbers(&frame["ch15_18"]);
        assert_eq!(read.more.to_vec(), if more.is_empty() { vec![0; 4] } else { more }, "{frame}");
        assert_eq!(read.to_bytes().to_vec(), bytes, "{frame}");
        for bit in 0..bytes.len() * 8 {
            let mut wrong = *whole;
            wrong[bit / 8] ^= 1 << (bit % 8);
            assert!(IbusFrame::decode(&wrong).is_err(), "{frame}: bit {bit}");
        }
    }
}

/// All frames of a protocol one after the other, with a stray byte before each.
#[test]
fn decoders_find_every_frame_between_stray_bytes() {
    let mut at = Instant::from_secs(1);
    let mut sbus = SbusDecoder::new();
    let mut found = 0;
    for (_, bytes) in frames("sbus") {
        at += Duration::from_millis(7);
        for byte in [0x55].into_iter().chain(bytes) {
            at += Duration::from_micros(120);
            found += usize::from(sbus.feed(at, byte).is_some());
        }
    }
    assert_eq!((found, sbus.discarded()), (frames("sbus").len(), 7));

    let mut ibus = IbusDecoder::new();
    let stray = |bytes: Vec<u8>| [0x11].into_iter().chain(bytes);
    let heard = frames("ibus").into_iter().flat_map(|(_, bytes)| stray(bytes));
    assert_eq!(heard.filter(|byte| ibus.feed(*byte).is_some()).count(), frames("ibus").len());
    assert_eq!(ibus.discarded(), 4);

    let mut crsf = CrsfDecoder::new();
    // A stray byte before a frame takes the address for a length, which no frame has.
    let heard = frames("crsf").into_iter().filter(|(_, bytes)| bytes[0] != 0).flat_map(|(_, bytes)| stray(bytes));
    assert_eq!(heard.filter(|byte| crsf.feed(*byte).is_some()).count(), 9);
    assert_eq!(crsf.discarded(), 9);
}

#[test]
fn a_stick_means_the_same_pulse_in_all_three() {
    let sbus = Channels([992; 16]).microseconds(0);
    assert_eq!(sbus, Some(1500.0));
    assert_eq!(Channels([172; 16]).microseconds(3), Some(987.5));
    assert_eq!(Channels([1811; 16]).microseconds(3), Some(2011.875));
}
