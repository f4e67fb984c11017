//! Datagrams and their JSON lines: both round trip, and nothing that is not exactly a datagram is taken for one.

use proptest::prelude::*;
use stampfly_link::datagram::{Body, length};
use stampfly_link::{Datagram, DatagramError, SequenceFilter, datagrams, json};
use stampfly_types::{Duration, Instant, message, message_enum};

message_enum! {
    /// A gear.
    pub enum Gear {
        /// Backwards.
        #[default]
        Reverse = 2,
        /// None.
        Neutral = 0,
        /// Forwards.
        Drive = 1,
    }
}

message! {
    /// A lever.
    pub struct Lever {
        /// Where it is.
        position: f32,
        /// What it has chosen.
        gear: Gear,
        /// Is it locked?
        locked: bool,
    }
}

message! {
    /// A clock.
    pub struct Clock {
        /// Its time.
        reading: Instant ["us"],
        /// How often it was set.
        settings: u32,
    }
}

datagrams! {
    /// The table of these tests.
    pub enum Table, magic b"TEST";

    /// A lever.
    Lever = 1, valid if |lever| (-1.0..=1.0).contains(&lever.position);
    /// A clock.
    Clock = 9, valid if |_| true;
}

type Any = Datagram<Table>;

fn bytes(datagram: &Any) -> Vec<u8> {
    datagram.write(&mut [0; 64]).expect("valid").to_vec()
}

fn line(datagram: &Any) -> String {
    let mut line = String::new();
    json::write(datagram, &mut line).expect("valid");
    line
}

/// CRC-32 by another way than the code under test: polynomial division, most significant bit first.
fn crc32(bytes: &[u8]) -> u32 {
    let mut remainder = u32::MAX;
    for byte in bytes {
        remainder ^= u32::from(byte.reverse_bits()) << 24;
        for _ in 0..8 {
            remainder = (remainder << 1) ^ if remainder >> 31 == 1 { 0x04C1_1DB7 } else { 0 };
        }
    }
    !remainder.reverse_bits()
}

fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let end = bytes.len() - 4;
    let checksum = crc32(&bytes[..end]).to_le_bytes();
    bytes[end..].copy_from_slice(&checksum);
    bytes
}

fn lever() -> Any {
    let body = Lever { position: 0.5, gear: Gear::Drive, locked: true }.into();
    Datagram { sequence: 0x0403_0201, time: Instant::from_micros(0x0807_0605_0403_0201), body }
}

#[test]
fn a_datagram_has_the_bytes_of_the_table() {
    assert_eq!(crc32(b"123456789"), 0xCBF4_3926, "the check value of CRC-32/ISO-HDLC");
    let mut expected = b"TEST\x01\x01\x0C\x00\x01\x02\x03\x04\x01\x02\x03\x04\x05\x06\x07\x08".to_vec();
    expected.extend([0x00, 0x00, 0x00, 0x3F, 1, 0, 0, 0, 1, 0, 0, 0]);
    expected.extend(crc32(&expected).to_le_bytes());
    assert_eq!(bytes(&lever()), expected);
    assert_eq!(expected.len(), length::<Lever>());
    let json = r#"{"@kind":"Lever","@format":1,"@sequence":67305985,"@time":578437695752307201,"position":0.5,"gear":"Drive","locked":true}"#;
    assert_eq!(line(&lever()), format!("{json}\n"));
}

fn any_datagram() -> impl Strategy<Value = Any> {
    let lever = (-1.0f32..=1.0, 0u32..3, any::<bool>()).prop_map(|(position, gear, locked)| {
        let gear = Gear::from_number(gear).expect("three gears");
        Table::from(Lever { position, gear, locked })
    });
    let clock = (any::<u64>(), any::<u32>())
        .prop_map(|(reading, settings)| Table::from(Clock { reading: Instant::from_micros(reading), settings }));
    (any::<u32>(), any::<u64>(), prop_oneof![lever, clock]).prop_map(|(sequence, time, body)| Datagram {
        sequence,
        time: Instant::from_micros(time),
        body,
    })
}

proptest! {
    #[test]
    fn both_forms_round_trip(datagram in any_datagram()) {
        prop_assert_eq!(Any::read(&bytes(&datagram)), Ok(datagram));
        prop_assert_eq!(json::read(&line(&datagram)), Ok(datagram));
    }

    #[test]
    fn any_one_damaged_bit_is_noticed(datagram in any_datagram(), place: usize, bit in 0u8..8) {
        let mut bytes = bytes(&datagram);
        let place = place % bytes.len();
        bytes[place] ^= 1 << bit;
        prop_assert!(Any::read(&bytes).is_err());
    }

    #[test]
    fn any_other_length_is_noticed(datagram in any_datagram(), length in 0usize..80) {
        let mut bytes = bytes(&datagram);
        prop_assume!(length != bytes.len());
        bytes.resize(length, 0);
        prop_assert!(Any::read(&bytes).is_err());
    }

    #[test]
    fn strangers_are_no_panic(noise: Vec<u8>, text in "\\PC{0,80}", json in "[{}\":,a-z0-9 ]{0,80}") {
        prop_assert!(Any::read(&noise).is_err());
        prop_assert!(json::read::<Table>(&text).is_err());
        prop_assert!(json::read::<Table>(&json).is_err());
    }

    #[test]
    fn a_json_line_cut_short_or_with_a_member_changed_is_refused(datagram in any_datagram(), cut: usize) {
        let line = line(&datagram);
        let cut = cut % (line.len() - 1);
        prop_assert!(json::read::<Table>(&line[..cut]).is_err());
    }
}

#[test]
fn every_refusal_has_its_reason() {
    let good = bytes(&lever());
    let with = |place: usize, values: &[u8]| {
        let mut bytes = good.clone();
        bytes[place..place + values.len()].copy_from_slice(values);
        Any::read(&sealed(bytes)).expect_err("spoilt")
    };
    assert_eq!(with(0, b"REST"), DatagramError::Magic);
    assert_eq!(with(4, &[2]), DatagramError::Version);
    assert_eq!(with(5, &[7]), DatagramError::Kind);
    assert_eq!(with(6, &[8]), DatagramError::Length);
    assert_eq!(Any::read(&[&good[..good.len() - 4], &[0; 4]].concat()), Err(DatagramError::Checksum));
    assert_eq!(with(20, &1.5f32.to_le_bytes()), DatagramError::Range);
    assert_eq!(with(20, &f32::NAN.to_le_bytes()), DatagramError::Range);
    assert_eq!(with(24, &[3]), DatagramError::Value, "no such gear");
    assert_eq!(with(28, &[2]), DatagramError::Value, "a truth value of 2");
    let body = Lever { position: f32::INFINITY, ..Lever::default() }.into();
    assert_eq!(Datagram { body, ..lever() }.write(&mut [0; 64]), Err(DatagramError::Range), "nothing invalid is sent");
    assert!(json::write(&Datagram { body, ..lever() }, &mut String::new()).is_err());
    assert_eq!(lever().write(&mut [0; 35]), Err(DatagramError::Length), "the buffer is too short");
    assert!(!Table::from(Lever { position: -2.0, ..Lever::default() }).is_valid());
}

#[test]
fn json_accepts_spaces_and_any_order_and_nothing_else() {
    let read = json::read::<Table>;
    let good = r#" { "@time" : 5, "locked" : 0, "gear" : 2, "position" : -1, "@sequence" : 3, "@kind" : "Lever", "@format" : 1 } "#;
    let body = Lever { position: -1.0, gear: Gear::Reverse, locked: false }.into();
    assert_eq!(read(good), Ok(Datagram { sequence: 3, time: Instant::from_micros(5), body }));
    for (from, to, reason) in [
        ("{", "", DatagramError::Syntax),
        (":", "", DatagramError::Syntax),
        ("\"gear\" : 2, ", "", DatagramError::Member),
        ("\"gear\" : 2", "\"gear\" : 2, \"gear\" : 2", DatagramError::Member),
        ("\"gear\" : 2", "\"gear\" : 2, \"more\" : 2", DatagramError::Member),
        ("\"gear\" : 2", "\"rear\" : 2", DatagramError::Member),
        ("\"gear\" : 2", "\"gear\" : 4", DatagramError::Value),
        ("\"gear\" : 2", "\"gear\" : \"Up\"", DatagramError::Value),
        ("\"gear\" : 2", "\"gear\" : -2", DatagramError::Value),
        (": -1", ": -1.5", DatagramError::Range),
        (": -1", ": NaN", DatagramError::Range),
        (": -1", ": {}", DatagramError::Value),
        ("\"Lever\"", "\"Liver\"", DatagramError::Kind),
        ("\"Lever\"", "Lever", DatagramError::Kind),
        ("\"@format\" : 1", "\"@format\" : 2", DatagramError::Version),
        ("\"@sequence\" : 3", "\"@sequence\" : -3", DatagramError::Value),
    ] {
        assert_eq!(read(&good.replacen(from, to, 1)), Err(reason), "{from} replaced by {to}");
    }
}

proptest! {
    #[test]
    fn the_filter_accepts_each_number_once_and_in_order(start: u32, steps in proptest::collection::vec(0u32..5, 1..50)) {
        let mut filter = SequenceFilter::new(Duration::from_secs(1));
        let mut sequence = start;
        prop_assert!(filter.accept(Instant::ZERO, sequence));
        for step in steps {
            sequence = sequence.wrapping_add(step);
            prop_assert_eq!(filter.accept(Instant::ZERO, sequence), step != 0);
            prop_assert!(!filter.accept(Instant::ZERO, sequence.wrapping_sub(1)), "older");
        }
    }
}
