//! The rover's datagrams against `vectors/datagrams.json`, which the Python package is tested against too.
//!
//! After a change that is meant to change datagrams, write the file again: `cargo xtask vectors --fix`.

#[path = "../vectors/datagrams.rs"]
mod vectors;

use serde_json::Value;
use stampfly_link::datagram::Body as _;
use stampfly_link::{Datagram, DatagramError, json as line};
use stampfly_rover::com::{Body, MAX};
use stampfly_rover::messages::*;
use stampfly_types::Instant;
use vectors::{REFUSED_LINES, bytes, datagrams, hex, refused, vectors};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/vectors/datagrams.json");

#[test]
fn the_vectors_are_what_this_crate_writes() {
    let committed = std::fs::read_to_string(FILE).expect("the file is committed");
    assert!(vectors() == committed, "changed on purpose? cargo xtask vectors --fix");
}

#[test]
fn every_datagram_reads_back_from_bytes_and_from_its_line() {
    let mut seen = Vec::new();
    for datagram in datagrams() {
        assert_eq!(Datagram::read(&bytes(&datagram)), Ok(datagram));
        let mut text = String::new();
        line::write(&datagram, &mut text).expect("valid");
        assert_eq!(line::read(&text), Ok(datagram));
        assert!(serde_json::from_str::<Value>(&text).is_ok_and(|value| value.is_object()), "JSON for others too");
        seen.push(bytes(&datagram)[5]);
    }
    assert!(Body::KINDS.iter().all(|(kind, _)| seen.contains(kind)), "one of every kind");
}

#[test]
fn what_is_no_datagram_is_refused_for_its_reason() {
    for (bytes, error) in refused() {
        assert_eq!(Datagram::<Body>::read(&bytes), Err(error), "{}", hex(&bytes));
    }
    for (text, error) in REFUSED_LINES {
        assert_eq!(line::read::<Body>(text), Err(error), "{text}");
    }
}

#[test]
fn values_out_of_range_are_not_sent() {
    let bodies: [Body; 5] = [
        OperatorCommand { throttle: 1.01, ..OperatorCommand::default() }.into(),
        OperatorCommand { steer: f32::NAN, ..OperatorCommand::default() }.into(),
        DriveCommand { acceleration: -0.1 }.into(),
        DriverInput { brake: -0.1, ..DriverInput::default() }.into(),
        LogRecord { v: -0.1, ..LogRecord::default() }.into(),
    ];
    for body in bodies {
        let datagram = Datagram { sequence: 0, time: Instant::ZERO, body };
        assert_eq!(datagram.write(&mut [0; MAX]), Err(DatagramError::Range), "{body:?}");
    }
}

#[test]
fn the_longest_datagram_has_room() {
    let longest = datagrams().iter().map(|datagram| bytes(datagram).len()).max();
    assert_eq!(longest, Some(MAX));
}
