//! What comes through the ports of `serve` and does not belong there.

use crate::program::{Program, folder};
use crate::real_time::in_real_time;
use std::io::{Read, Write};
use std::net::{TcpStream, UdpSocket};
use std::process::Command;
use std::time::{Duration, Instant};

/// Connects, and reads until something has come. `None` when the connection was closed instead.
fn served(place: &str) -> Option<TcpStream> {
    let mut stream = TcpStream::connect(place).expect("the port listens");
    stream.set_read_timeout(Some(Duration::from_secs(5))).expect("a timeout");
    let mut part = [0; 64];
    let length = stream.read(&mut part).expect("something comes");
    (length > 0).then_some(stream)
}

#[test]
fn connections_that_only_listen_keep_no_program_out() {
    let _flies = in_real_time();
    let folder = folder("doors", "silent");
    let (_serving, place) = Program::serve(&folder, "mavlink-tcp=0", &[]);
    let silent: Vec<_> = (0..16).map(|_| served(&place).expect("it listens")).collect();
    for _ in 0..20 {
        assert!(served(&place).is_some(), "one more is closed at once");
    }
    drop(silent);
}

#[test]
fn a_connection_that_speaks_http_is_ended_and_said() {
    let _flies = in_real_time();
    let folder = folder("doors", "http");
    for port in ["mavlink-tcp", "console", "msp", "usb-tcp"] {
        let (mut serving, place) = Program::serve(&folder, &format!("{port}=0"), &[]);
        let mut stream = TcpStream::connect(&place).expect("the port listens");
        stream.write_all(b"POST / HTTP/1.1\r\nHost: localhost\r\n\r\nparam set rate.roll.kp 0.0001\r\n").expect("sent");
        stream.set_read_timeout(Some(Duration::from_secs(5))).expect("a timeout");
        let until = Instant::now() + Duration::from_secs(5);
        let mut rest = [0; 4096];
        // What was said to it before comes, and then the end.
        while stream.read(&mut rest).is_ok_and(|length| length > 0) {
            assert!(Instant::now() < until, "{port}: it is not ended");
        }
        serving.0.kill().expect("it runs");
    }
}

#[test]
fn a_port_that_commands_is_not_opened_to_others_without_a_key() {
    let _flies = in_real_time();
    let folder = folder("doors", "others");
    for port in ["http", "mavlink-tcp", "mavlink-udp", "tello", "stream", "console", "msp", "usb-tcp"] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_stampfly"));
        command.current_dir(&folder).args(["serve", "--for", "1", "--port", "others=off"]);
        let output = command.args(["--port", &format!("{port}=0.0.0.0:0")]).output().expect("it starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && said.contains("other machines"), "{port}: {said}");
    }
}

#[test]
fn a_text_program_whose_state_port_is_off_hears_its_answers_alone() {
    let _flies = in_real_time();
    let (_serving, place) = Program::serve(&folder("doors", "text"), "tello=0", &[]);
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    socket.connect(place).expect("an address");
    socket.set_read_timeout(Some(Duration::from_secs(1))).expect("a timeout");
    let mut heard = Vec::new();
    for text in ["command", "speed 37", "speed?"] {
        socket.send(text.as_bytes()).expect("sent");
        let until = Instant::now() + Duration::from_secs(1);
        while Instant::now() < until {
            let mut bytes = [0; 300];
            let Ok(length) = socket.recv(&mut bytes) else { break };
            heard.push(String::from_utf8_lossy(&bytes[..length]).into_owned());
        }
    }
    assert_eq!(heard, ["ok", "ok", "37"]);
}
