//! A program that was stopped for seconds and goes on: what lay in its sockets meanwhile is late.
//!
//! Only where a test can stop a program.

use crate::program::{Program, folder, signal};
use crate::real_time::in_real_time;
use stampfly_link::mavlink::dialects::common::*;
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter};
use std::io::{Read as _, Write as _};
use std::net::{TcpStream, UdpSocket};
use std::time::{Duration, Instant};

/// It stands still for so long.
const STOPPED: Duration = Duration::from_millis(2_500);
const SOON: Duration = Duration::from_secs(10);

/// Stops it, says something meanwhile, and lets it go on.
fn stopped(program: &Program, says: impl FnOnce()) {
    signal(&program.0, "-STOP");
    // What is heard already is carried out.
    std::thread::sleep(Duration::from_millis(50));
    says();
    std::thread::sleep(STOPPED);
    signal(&program.0, "-CONT");
}

/// What is said without a pause behind that may be as old.
fn pause() {
    std::thread::sleep(Duration::from_millis(100));
}

fn tello(folder: &str) -> (Program, UdpSocket) {
    let (program, place) = Program::serve(&self::folder("stopped", folder), "tello=0", &[]);
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    socket.connect(place).expect("an address");
    socket.set_read_timeout(Some(SOON)).expect("a timeout");
    (program, socket)
}

fn answer(socket: &UdpSocket) -> String {
    let mut bytes = [0; 100];
    let length = socket.recv(&mut bytes).expect("an answer");
    String::from_utf8_lossy(&bytes[..length]).into_owned()
}

fn ask(socket: &UdpSocket, text: &str) -> String {
    socket.send(text.as_bytes()).expect("sent");
    answer(socket)
}

#[test]
fn text_commands_that_came_while_it_was_stopped_are_expired_and_what_ends_a_flight_is_done() {
    let _flies = in_real_time();
    let (program, socket) = tello("tello");
    assert_eq!(ask(&socket, "command"), "ok");
    let said = ["takeoff", "speed 80", "rc 50 0 0 0", "rc 50 0 0 0", "speed?", "forward 50", "emergency", "land"];
    stopped(&program, || said.iter().for_each(|text| _ = socket.send(text.as_bytes()).expect("sent")));
    let answers: Vec<_> = (0..6).map(|_| answer(&socket)).collect();
    assert_eq!(answers, ["error expired", "error expired", "50", "error expired", "ok", "ok"]);
    pause();
    assert_eq!(ask(&socket, "speed 80"), "ok");
    assert_eq!(ask(&socket, "speed?"), "80");
}

#[test]
fn gains_that_came_while_it_was_stopped_are_not_changed() {
    let _flies = in_real_time();
    let framed = |id: u8, payload: &[u8]| {
        let mut bytes = vec![b'$', b'M', b'<', payload.len() as u8, id];
        bytes.extend(payload);
        bytes.push(bytes[3..].iter().fold(0, |all, byte| all ^ byte));
        bytes
    };
    let (program, place) = Program::serve(&folder("stopped", "msp"), "msp=0", &[]);
    let mut stream = TcpStream::connect(place).expect("it listens");
    stream.set_read_timeout(Some(SOON)).expect("a timeout");
    let read = |stream: &mut TcpStream| {
        let mut head = [0; 5];
        stream.read_exact(&mut head).expect("a head");
        let mut rest = vec![0; usize::from(head[3]) + 1];
        stream.read_exact(&mut rest).expect("a payload");
        rest.pop();
        (head[2], head[4], rest)
    };
    stream.write_all(&framed(112, &[])).expect("sent");
    let (kind, _, gains) = read(&mut stream);
    assert_eq!(kind, b'>');
    let mut other = gains.clone();
    other[0] += 5;
    stopped(&program, || {
        stream.write_all(&framed(202, &other)).expect("sent");
        stream.write_all(&framed(112, &[])).expect("sent");
    });
    assert_eq!(read(&mut stream), (b'!', 202, vec![]));
    assert_eq!(read(&mut stream), (b'>', 112, gains));
    pause();
    stream.write_all(&framed(202, &other)).expect("sent");
    assert_eq!(read(&mut stream), (b'>', 202, vec![]));
}

#[test]
fn a_command_that_came_while_it_was_stopped_is_refused_and_one_that_ends_a_flight_is_not() {
    let _flies = in_real_time();
    let command = |command, param1| {
        let (target_system, target_component) = (1, 1);
        let command = COMMAND_LONG_DATA { command, param1, target_system, target_component, ..Default::default() };
        let mut bytes = [0; LONGEST];
        let frame =
            MavlinkWriter::new(255, 190).write(MavlinkVersion::V2, &MavMessage::COMMAND_LONG(command), &mut bytes);
        frame.expect("a frame").to_vec()
    };
    let (program, place) = Program::serve(&folder("stopped", "mavlink"), "mavlink-tcp=0", &[]);
    let mut stream = TcpStream::connect(place).expect("it listens");
    stream.set_read_timeout(Some(SOON)).expect("a timeout");
    let arm = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
    // One command alone: no heartbeats tell that it was held up.
    stream.write_all(&command(MavCmd::MAV_CMD_REQUEST_MESSAGE, 148.0)).expect("sent");
    let mut decoder = MavlinkDecoder::<MavMessage>::new();
    let mut acknowledged = |stream: &mut TcpStream| {
        let (until, mut byte) = (Instant::now() + SOON, [0]);
        while Instant::now() < until {
            stream.read_exact(&mut byte).expect("it speaks");
            if let Some(Ok(MavMessage::COMMAND_ACK(ack))) = decoder.feed(byte[0]).map(|frame| frame.message()) {
                return (ack.command, ack.result);
            }
        }
        panic!("no acknowledgement");
    };
    assert_eq!(acknowledged(&mut stream).1, MavResult::MAV_RESULT_ACCEPTED);
    // Flight termination is never late: acknowledged as on any vehicle that stands.
    let ends = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;
    stopped(&program, || {
        stream.write_all(&command(MavCmd::MAV_CMD_NAV_LOITER_UNLIM, 0.0)).expect("sent");
        stream.write_all(&command(arm, 1.0)).expect("sent");
        stream.write_all(&command(ends, 1.0)).expect("sent");
    });
    let refused = MavResult::MAV_RESULT_TEMPORARILY_REJECTED;
    assert_eq!(acknowledged(&mut stream), (MavCmd::MAV_CMD_NAV_LOITER_UNLIM, refused));
    assert_eq!(acknowledged(&mut stream), (arm, refused));
    let (ended, result) = acknowledged(&mut stream);
    assert!(ended == ends && result != refused, "{result:?}");
    pause();
    stream.write_all(&command(MavCmd::MAV_CMD_REQUEST_MESSAGE, 148.0)).expect("sent");
    assert_eq!(acknowledged(&mut stream).1, MavResult::MAV_RESULT_ACCEPTED);
}

#[test]
fn a_line_that_was_typed_while_it_was_stopped_is_expired_at_the_console_and_on_the_cable() {
    let _flies = in_real_time();
    for port in ["console", "usb-tcp"] {
        let (program, place) = Program::serve(&folder("stopped", port), &format!("{port}=0"), &[]);
        let mut stream = TcpStream::connect(place).expect("it listens");
        stream.set_read_timeout(Some(SOON)).expect("a timeout");
        let until = |stream: &mut TcpStream, wanted: &str| {
            let (mut said, mut byte) = (String::new(), [0]);
            while !said.contains(wanted) {
                stream.read_exact(&mut byte).unwrap_or_else(|error| panic!("{port}, {wanted}: {error}: {said}"));
                said.push(char::from(byte[0]));
            }
            said
        };
        stream.write_all(b"param get navigator.height.max\r").expect("sent");
        until(&mut stream, "  3            0.5 to");
        stopped(&program, || stream.write_all(b"param set navigator.height.max 2\r").expect("sent"));
        let said = until(&mut stream, "was not done");
        assert!(said.contains("expired"), "{port}: {said}");
        pause();
        stream.write_all(b"param get navigator.height.max\r").expect("sent");
        until(&mut stream, "  3            0.5 to");
    }
}
