//! What the vehicle tells a pilot over CRSF, judged by another crate that reads it, and by the bytes that flight controllers send.

use proptest::prelude::*;
use stampfly_link::serial::crsf::{Attitude, Battery, CrsfFrame, FlightModeName, Gps, Message, Vario};
use uf_crsf::CrsfParser;
use uf_crsf::packets::Packet;

fn written(message: Message) -> Vec<u8> {
    let mut bytes = [0; CrsfFrame::LONGEST];
    let length = message.write(&mut bytes).expect("there is room");
    bytes[..length].to_vec()
}

/// What the other crate reads.
fn judged(message: Message) -> Packet {
    let (bytes, mut parser) = (written(message), CrsfParser::new());
    let mut rest = bytes.as_slice();
    let packet = parser.next_packet(&mut rest).expect("a frame").expect("a sound one");
    assert!(rest.is_empty());
    packet
}

fn read(message: Message) -> Message {
    CrsfFrame::decode(&written(message)).expect("a frame").message()
}

#[test]
fn another_crate_reads_what_is_meant() {
    let Packet::Gps(gps) = judged(Message::Gps(Gps {
        latitude: 357_000_000,
        longitude: -1_397_000_001,
        speed: 10.0,
        course: -core::f32::consts::FRAC_PI_2,
        altitude: -12.4,
        satellites: 9,
    })) else {
        panic!("a position")
    };
    assert_eq!((gps.latitude, gps.longitude, gps.satellites), (357_000_000, -1_397_000_001, 9));
    // 36 km/h in tenths, 270° in hundredths, and a thousand metres up.
    assert_eq!((gps.groundspeed, gps.heading, gps.altitude), (360, 27_000, 988));

    let Packet::Vario(vario) = judged(Message::Vario(Vario { climb: -1.234 })) else { panic!("a climb") };
    assert_eq!(vario.v_speed, -123);
    let name = FlightModeName::new("POS HOLD").expect("short");
    let Packet::FlightMode(mode) = judged(Message::FlightMode(name)) else { panic!("a mode") };
    assert_eq!(mode.flight_mode(), "POS HOLD");
    let battery = Battery { voltage: 3.7, current: 4.2, used: 70_000, remaining: 55 };
    let Packet::Battery(battery) = judged(Message::Battery(battery)) else { panic!("a battery") };
    assert_eq!((battery.voltage, battery.current, battery.capacity_used, battery.remaining), (37, 42, 70_000, 55));
    let Packet::Attitude(attitude) = judged(Message::Attitude(Attitude { pitch: 0.1, roll: -0.2, yaw: 3.1 })) else {
        panic!("an attitude")
    };
    assert_eq!((attitude.pitch, attitude.roll, attitude.yaw), (1_000, -2_000, 31_000));
}

#[test]
fn what_does_not_fit_is_at_the_limit_and_no_number_is_zero() {
    let far = Gps { speed: 1e9, course: f32::NAN, altitude: 1e9, ..Gps::default() };
    let Message::Gps(read_back) = read(Message::Gps(far)) else { panic!("a position") };
    assert_eq!((read_back.course, read_back.altitude), (0.0, 64_535.0));
    assert!((read_back.speed - 1_820.4).abs() < 0.1);
    let Message::Gps(low) = read(Message::Gps(Gps { altitude: -1e9, speed: -1.0, ..far })) else {
        panic!("a position")
    };
    assert_eq!((low.altitude, low.speed), (-1_000.0, 0.0));
    assert_eq!(read(Message::Vario(Vario { climb: f32::INFINITY })), Message::Vario(Vario { climb: 327.67 }));
    assert_eq!(read(Message::Vario(Vario { climb: f32::NAN })), Message::Vario(Vario { climb: 0.0 }));
}

#[test]
fn names_of_flight_modes_have_limits() {
    let frame = |payload: &[u8]| {
        let mut bytes = [0; CrsfFrame::LONGEST];
        let length = CrsfFrame { address: 0xC8, kind: 0x21, payload }.write(&mut bytes).expect("there is room");
        CrsfFrame::decode(&bytes[..length]).expect("a frame").message()
    };
    let named = |name: &str| Message::FlightMode(FlightModeName::new(name).expect("a name"));
    assert_eq!(frame(b"ACRO\0"), named("ACRO"));
    assert_eq!(frame(b"ACRO"), named("ACRO"), "some leave the zero out");
    assert_eq!(frame(b"!ERR*\0rest"), named("!ERR*"), "what follows the zero is not looked at");
    assert_eq!(frame(b"\0"), named(""));
    assert_eq!(frame(b""), named(""));
    assert_eq!(frame(b"ABCDEFGHIJKLMNO\0"), named("ABCDEFGHIJKLMNO"));
    assert_eq!(frame(b"ABCDEFGHIJKLMNOP\0"), Message::Other);
    assert_eq!(frame(b"A\x80\0"), Message::Other);
    for bad in ["ABCDEFGHIJKLMNOP", "A\0B", "Ä", "A\n"] {
        assert_eq!(FlightModeName::new(bad), None, "{bad:?}");
    }
    assert_eq!(written(named("ACRO"))[..8], *b"\xC8\x07\x21ACRO\0");
}

proptest! {
    #[test]
    fn positions_and_climbs_keep_their_steps(bytes in prop::array::uniform15(any::<u8>()), climb in prop::array::uniform2(any::<u8>())) {
        for (kind, payload) in [(0x02, &bytes[..]), (0x07, &climb[..])] {
            let mut frame = [0; CrsfFrame::LONGEST];
            let length = CrsfFrame { address: 0xC8, kind, payload }.write(&mut frame).expect("there is room");
            let message = CrsfFrame::decode(&frame[..length]).expect("a frame").message();
            prop_assert_eq!(written(message), &frame[..length]);
        }
    }
}
