//! What comes through the ports of `serve` and does not belong there.

use crate::connect::{ask, page};
use crate::connect_radio::key;
use crate::doorstep::{MavlinkProgram, Observer, Speaker};
use crate::program::{Program, folder, interrupt};
use crate::real_time::in_real_time;
use serde_json::json;
use stampfly_host::serve::Key;
use stampfly_link::mavlink::dialects::common::{HEARTBEAT_DATA, MavMessage, PARAM_REQUEST_READ_DATA};
use stampfly_link::mavlink::signing::{Signer, SigningKey};
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter};
use std::io::{Read, Write};
use std::net::{TcpStream, UdpSocket};
use std::process::{Command, Stdio};
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
        let named = format!("{port}=0");
        let mut command = Command::new(env!("CARGO_BIN_EXE_stampfly"));
        let ports = ["serve", "--port", "others=off", "--port", "http=0", "--port", &named];
        let command = command.current_dir(&folder).args(ports).stdin(Stdio::null());
        let started = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let mut serving = Program(started.expect("the program starts"));
        let place = serving.place(port);
        let mut beside = page(&serving.said("http ", "http://"));
        let get = json!({ "do": "param_get", "name": "rate.roll.kp" });
        let before = ask(&mut beside, 1, get.clone())["value"].clone();
        assert!(before.as_f64().is_some_and(|value| value > 0.0001), "{before}");
        let mut stream = TcpStream::connect(&place).expect("the port listens");
        stream.write_all(b"POST / HTTP/1.1\r\nHost: localhost\r\n\r\nparam set rate.roll.kp 0.0001\r\n").expect("sent");
        stream.set_read_timeout(Some(Duration::from_secs(5))).expect("a timeout");
        let until = Instant::now() + Duration::from_secs(5);
        let mut rest = [0; 4096];
        // What was said to it before comes, and then the end.
        while stream.read(&mut rest).is_ok_and(|length| length > 0) {
            assert!(Instant::now() < until, "{port}: it is not ended");
        }
        assert_eq!(ask(&mut beside, 2, get)["value"], before, "{port}: something of it was obeyed");
        interrupt(&serving.0);
        #[cfg(not(unix))]
        serving.0.kill().expect("it runs");
        let mut said = String::new();
        serving.0.stderr.as_mut().expect("a pipe").read_to_string(&mut said).expect("text");
        let wanted = format!("port '{port}': a connection that speaks HTTP was ended, and nothing of it obeyed");
        assert!(said.contains(&wanted), "{port}: {said}");
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

/// What this command line prints before it ends, which is an error.
fn refused(folder: &std::path::Path, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stampfly"));
    let output = command.current_dir(folder).args(arguments).output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success(), "{arguments:?}: {said}");
    said
}

#[test]
fn what_connect_opens_to_other_machines_wants_a_key_or_stays_closed() {
    let _flies = in_real_time();
    let folder = folder("doors", "connect");
    for port in ["http", "mavlink-tcp", "mavlink-udp"] {
        let named = format!("{port}=0.0.0.0:0");
        let arguments = ["connect", "tcp:127.0.0.1:9", "--for", "1", "--port", "others=off", "--port", &named];
        let said = refused(&folder, &arguments);
        assert!(said.contains("programs on this machine alone may command it"), "{port}: {said}");
    }
}

#[test]
fn with_sign_all_nothing_unsigned_commands() {
    let _flies = in_real_time();
    let folder = folder("doors", "sign_all");
    let file = key(&folder, "key", 1);
    let station = UdpSocket::bind("127.0.0.1:0").expect("a port");
    let udp = format!("mavlink-udp={}", station.local_addr().expect("an address").port());
    let mut command = Command::new(env!("CARGO_BIN_EXE_stampfly"));
    command.current_dir(&folder).args(["serve", "--key", &file, "--sign-all", "--port", "tello-state=off"]);
    command.args(["--port", "telemetry=off", "--port", "http=0", "--port", "mavlink-tcp=0", "--port", &udp]);
    let closed = ["console", "msp", "usb-tcp", "tello", "stream"];
    command.args(closed.iter().flat_map(|port| ["--port".to_owned(), format!("{port}=0")]));
    let command = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut serving = Program(command.spawn().expect("the program starts"));
    let tcp = serving.place("mavlink-tcp");
    let address = serving.said("http ", "http://");
    let (address, secret) = address.split_once("/#").expect("a secret");

    // The page's socket wants the secret.
    let socket = |end: &str| {
        let stream = TcpStream::connect(address).expect("it listens");
        tungstenite::client(format!("ws://{address}/ws{end}"), stream).map_err(Box::new)
    };
    for end in ["", "?secret=0", &format!("?secret={}", "0".repeat(secret.len()))] {
        let error = *socket(end).expect_err("no secret");
        let tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer)) = error else {
            panic!("{end}: {error}");
        };
        assert_eq!(answer.status().as_u16(), 403, "{end}");
    }
    let (near, answer) = socket(&format!("?secret={secret}")).expect("a handshake");
    assert_eq!(answer.status().as_u16(), 101);
    let observer = Observer::of(near, address.to_owned());
    observer.is_ready();

    // It would arm, and does not for programs that do not sign.
    for mut program in [MavlinkProgram::tcp(&tcp), MavlinkProgram::udp(station)] {
        program.lives(Duration::from_secs(2));
        program.asks("arm", Duration::ZERO);
        assert_eq!(program.answer(Duration::from_secs(3)), None);
    }
    assert!(!observer.was_armed());

    interrupt(&serving.0);
    #[cfg(not(unix))]
    serving.0.kill().expect("it runs");
    let (mut listens, mut said) = (String::new(), String::new());
    serving.0.stdout.as_mut().expect("a pipe").read_to_string(&mut listens).expect("text");
    serving.0.stderr.as_mut().expect("a pipe").read_to_string(&mut said).expect("text");
    for port in closed {
        assert!(!listens.lines().any(|line| line.starts_with(port) && line.contains("listening")), "{listens}");
        let line = said.lines().find(|line| line.contains(&format!("port '{port}'")));
        assert!(line.is_some_and(|line| line.contains("stays closed")), "{port}: {said}");
    }
}

/// A heartbeat of a station, signed if it has a key.
fn heartbeat(signer: Option<&mut Signer>) -> Vec<u8> {
    let (mut room, mut writer) = ([0; LONGEST], MavlinkWriter::new(254, 190));
    let message = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
    let frame = match signer {
        Some(signer) => writer.write_signed(stampfly_types::Instant::ZERO, &message, signer, &mut room),
        None => writer.write(MavlinkVersion::V2, &message, &mut room),
    };
    frame.expect("there is room").to_vec()
}

#[test]
fn strangers_that_speak_without_the_key_keep_no_station_out() {
    let _flies = in_real_time();
    let folder = folder("doors", "strangers");
    let file = key(&folder, "key", 1);
    let (_serving, place) = Program::serve(&folder, "mavlink-tcp=0", &["--key", &file, "--sign-all"]);
    let mut strangers = Vec::new();
    for _ in 0..16 {
        let mut stranger = served(&place).expect("it listens");
        stranger.write_all(&heartbeat(None)).expect("sent");
        strangers.push(stranger);
    }
    // They have been heard.
    std::thread::sleep(Duration::from_secs(1));

    let began = Instant::now();
    let mut station = served(&place).expect("a place");
    let signing = Key::read(file.as_ref()).expect("a key").signing();
    let mut signer = Signer::new(SigningKey::from_passphrase(&signing.phrase), 0, signing.time);
    station.write_all(&heartbeat(Some(&mut signer))).expect("sent");
    let read = PARAM_REQUEST_READ_DATA { target_system: 1, target_component: 1, ..Default::default() };
    let (mut room, mut writer) = ([0; LONGEST], MavlinkWriter::new(254, 190));
    let read = MavMessage::PARAM_REQUEST_READ(read);
    let frame = writer.write_signed(stampfly_types::Instant::ZERO, &read, &mut signer, &mut room);
    station.write_all(frame.expect("there is room")).expect("sent");
    let (mut decoder, mut part) = (MavlinkDecoder::<MavMessage>::new(), [0; 2048]);
    let mut is_answered = false;
    while !is_answered {
        let length = station.read(&mut part).expect("it is answered");
        assert!(length > 0 && began.elapsed() < Duration::from_secs(10), "{:?}", began.elapsed());
        for byte in &part[..length] {
            let message = decoder.feed(*byte).and_then(|frame| frame.message::<MavMessage>().ok());
            is_answered |= matches!(message, Some(MavMessage::PARAM_VALUE(_)));
        }
    }
    // It keeps its place, however many come.
    for _ in 0..20 {
        drop(served(&place));
    }
    station.write_all(&heartbeat(Some(&mut signer))).expect("it has its place");
    let until = Instant::now() + Duration::from_secs(2);
    while Instant::now() < until {
        assert!(station.read(&mut part).expect("it is told the state") > 0, "it has lost its place");
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
