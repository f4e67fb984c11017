//! `stampfly connect`: a simulated vehicle at the other end of a line, a page's socket at this one.

#[cfg(unix)]
use crate::program::signal;
use crate::program::{Program, folder, interrupt};
use crate::real_time::in_real_time;
use serde_json::{Value, json};
use std::io::ErrorKind;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

const SOON: Duration = Duration::from_secs(20);
/// A vehicle whose line is that TCP port, and where it is.
fn vehicle(folder: &Path, number: u16) -> (Program, String) {
    Program::serve(folder, &format!("usb-tcp={number}"), &[])
}

pub fn connect(folder: &Path, place: &str, more: &[&str]) -> (Program, WebSocket<TcpStream>) {
    let ports = ["--port", "http=0", "--port", "others=off"];
    let arguments = [&["connect", place][..], &ports, more].concat();
    let mut program = Program::start(folder, &arguments);
    let socket = page(&program.said("http ", "http://"));
    (program, socket)
}

/// A page's socket at that address.
pub fn page(address: &str) -> WebSocket<TcpStream> {
    let stream = TcpStream::connect(address).expect("it listens");
    stream.set_read_timeout(Some(SOON)).expect("a timeout");
    tungstenite::client(format!("ws://{address}/ws"), stream).expect("a handshake").0
}

/// The next message, also on a machine that was held for a moment.
pub fn message(socket: &mut WebSocket<TcpStream>) -> Message {
    loop {
        match socket.read() {
            Err(tungstenite::Error::Io(error)) if error.kind() == ErrorKind::Interrupted => {}
            message => return message.expect("a message"),
        }
    }
}

/// The next text of this kind that is as wanted.
pub fn next(socket: &mut WebSocket<TcpStream>, kind: &str, is_wanted: impl Fn(&Value) -> bool) -> Value {
    let until = Instant::now() + SOON;
    while Instant::now() < until {
        let Message::Text(text) = message(socket) else { continue };
        let value: Value = serde_json::from_str(&text).expect("JSON");
        if !value[kind].is_null() && is_wanted(&value[kind]) {
            return value[kind].clone();
        }
    }
    panic!("no {kind}");
}

pub fn ask(socket: &mut WebSocket<TcpStream>, id: u32, mut what: Value) -> Value {
    what["vehicle"] = 0.into();
    what["id"] = id.into();
    let until = Instant::now() + SOON;
    loop {
        socket.send(Message::text(what.to_string())).expect("sent");
        let answer = next(socket, "reply", |reply| reply["id"] == id);
        let text = answer["text"].as_str().unwrap_or_default();
        // A machine that is busy with other tests may stop a vehicle for longer than its link allows. A person asks again then.
        let is_silent = text == "the vehicle does not answer"
            || text.starts_with("expired")
            || text.starts_with("nothing is heard");
        if !is_silent || Instant::now() > until {
            return answer;
        }
    }
}

/// The first answer.
pub fn ask_once(socket: &mut WebSocket<TcpStream>, id: u32, mut what: Value) -> Value {
    what["vehicle"] = 0.into();
    what["id"] = id.into();
    socket.send(Message::text(what.to_string())).expect("sent");
    next(socket, "reply", |reply| reply["id"] == id)
}

/// What the next state says of the one topic that is subscribed to: its place, samples so far, instant, numbers.
pub fn sample(socket: &mut WebSocket<TcpStream>) -> Value {
    let state = next(socket, "state", |state| state[0].as_array().is_some_and(|state| state.len() > 2));
    state[0][2].clone()
}

/// Samples in a second of the vehicle's time, over three of them: another second passes on a machine that has much to do.
pub fn rate(socket: &mut WebSocket<TcpStream>) -> f64 {
    let number = |sample: &Value, place: usize| sample[place].as_f64().expect("a number");
    let first = sample(socket);
    loop {
        let last = sample(socket);
        let [samples, seconds] = [1, 2].map(|place| number(&last, place) - number(&first, place));
        if seconds >= 3.0 {
            return samples / seconds;
        }
    }
}

pub fn is_up(up: bool) -> impl Fn(&Value) -> bool {
    move |event| event["kind"] == "link" && event["up"] == up
}

#[test]
fn a_page_sees_asks_and_changes_a_vehicle_over_its_line_and_is_told_when_it_is_gone() {
    let _flies = in_real_time();
    let folder = folder("connect", "page");
    let (serving, place) = vehicle(&folder, 0);
    let (mut connected, mut socket) = connect(&folder, &format!("tcp:{place}"), &[]);
    let hello = next(&mut socket, "hello", |_| true);
    let card = &hello["vehicles"][0];
    assert_eq!((&card["faults"], &card["missions"]), (&json!([]), &json!([])));
    next(&mut socket, "event", is_up(true));

    socket
        .send(Message::text(
            json!({ "id": 1, "do": "subscribe", "topics": ["estimate_state"], "rate": 50 }).to_string(),
        ))
        .expect("sent");
    let rate = rate(&mut socket);
    assert!(rate > 18.0, "{rate} Hz");

    let set = ask(&mut socket, 2, json!({ "do": "param_set", "name": "eskf.gate", "value": 3.5 }));
    assert_eq!((&set["ok"], &set["value"]), (&json!(true), &json!(3.5)));
    assert_eq!(ask(&mut socket, 3, json!({ "do": "param_get", "name": "eskf.gate" }))["value"], json!(3.5));
    assert_eq!(
        ask(&mut socket, 4, json!({ "do": "param_set", "name": "eskf.gate", "value": 1e9 }))["ok"],
        json!(false)
    );
    let list = ask(&mut socket, 5, json!({ "do": "console", "line": "param list" }));
    assert!(
        list["text"].as_str().is_some_and(|text| text.lines().count() > 100 && text.contains("eskf.gate")),
        "{list}"
    );
    for (id, what) in
        [(6, json!({ "do": "fault", "text": "flow-lost@0" })), (7, json!({ "do": "speed", "factor": 2.0 }))]
    {
        assert_eq!(ask(&mut socket, id, what)["ok"], json!(false));
    }
    assert_eq!(ask(&mut socket, 8, json!({ "do": "motor_test", "motor": 9, "duty": 0.1 }))["ok"], json!(false));
    assert_eq!(ask(&mut socket, 9, json!({ "do": "motor_test", "motor": 1, "duty": 0.1 }))["ok"], json!(true));
    assert_eq!(ask(&mut socket, 10, json!({ "do": "motor_stop" }))["ok"], json!(true));

    drop(serving);
    let gone = next(&mut socket, "event", is_up(false));
    assert!(gone["text"].as_str().is_some_and(|text| text.contains("is gone")), "{gone}");
    assert_eq!(ask(&mut socket, 11, json!({ "do": "guided", "kind": "arm" }))["ok"], json!(false));
    assert!(connected.0.try_wait().expect("a process").is_none(), "it waits for the vehicle");
    // It comes again, as another start of the vehicle.
    let number = place.parse::<SocketAddr>().expect("an address").port();
    let (_serving, _) = vehicle(&folder, number);
    next(&mut socket, "event", is_up(true));
    assert_eq!(ask(&mut socket, 12, json!({ "do": "param_get", "name": "eskf.gate" }))["value"], json!(4.0));
}

/// Waits until the console's answer is as wanted.
pub fn is_done(socket: &mut WebSocket<TcpStream>, id: u32, line: &str, wanted: &str) {
    let until = Instant::now() + SOON;
    loop {
        let answer = ask(socket, id, json!({ "do": "console", "line": line }));
        if answer["text"].as_str().is_some_and(|text| text.contains(wanted)) {
            return;
        }
        assert!(Instant::now() < until, "{wanted}: {answer}");
        std::thread::sleep(Duration::from_millis(200));
    }
}

pub fn alive(socket: &mut WebSocket<TcpStream>) {
    socket.send(Message::text(json!({ "vehicle": 0, "id": 0, "do": "alive" }).to_string())).expect("sent");
}

/// Time passes, and the page is there.
pub fn passes(socket: &mut WebSocket<TcpStream>, seconds: u32) {
    for _ in 0..5 * seconds {
        alive(socket);
        std::thread::sleep(Duration::from_millis(200));
    }
}

#[test]
fn a_flight_is_recorded_over_the_line_and_replays_bit_for_bit_around_parameters_that_change_between_hops() {
    let _flies = in_real_time();
    let folder = folder("connect", "record");
    let (_serving, place) = vehicle(&folder, 0);
    recorded(&folder, &format!("tcp:{place}"), &[]);
}

/// Flies a hop that is recorded over the line to that place, and replays it.
pub fn recorded(folder: &Path, place: &str, more: &[&str]) {
    let arguments = [&["--record", "flight.sfr", "--for", "120"], more].concat();
    let (mut connected, mut socket) = connect(folder, place, &arguments);
    next(&mut socket, "event", is_up(true));
    // Calibrated, and nobody has asked for anything yet.
    is_done(&mut socket, 1, "status", "blocks   NO_LINK\n");
    // The record begins when it is asked for, with a key frame.
    passes(&mut socket, 2);
    let set = json!({ "do": "param_set", "name": "eskf.gate", "value": 3.5 });
    assert_eq!(ask(&mut socket, 2, set)["ok"], json!(true));
    passes(&mut socket, 2);
    let whats = [
        (json!({ "do": "guided", "kind": "arm" }), 1),
        (json!({ "do": "guided", "kind": "take_off", "height": 0.3 }), 3),
        (json!({ "do": "guided", "kind": "land" }), 0),
    ];
    for (id, (what, seconds)) in (3..).zip(whats) {
        let answer = ask(&mut socket, id, what.clone());
        assert_eq!(answer["ok"], json!(true), "{what}: {answer}");
        passes(&mut socket, seconds);
    }
    // It has landed, and its motors are off.
    is_done(&mut socket, 6, "status", "blocks   NO_LINK\n");
    interrupt(&connected.0);
    let said = connected.said("flight.sfr: ", "flight.sfr: ");
    assert!(said.parse().is_ok_and(|chunks: u32| chunks > 1_000), "{said} chunks");
    let replay = Command::new(env!("CARGO_BIN_EXE_stampfly"))
        .current_dir(folder)
        .args(["replay", "flight.sfr", "--json"])
        .output();
    let replay = replay.expect("the program starts");
    let (said, error) = (String::from_utf8_lossy(&replay.stdout), String::from_utf8_lossy(&replay.stderr));
    assert!(replay.status.success(), "{said}{error}");
    let replay: Value = serde_json::from_str(&said).expect("JSON");
    assert!(replay["activations"].as_u64().is_some_and(|count| count > 20_000), "{said}");
    // The gap is where the estimator began again with another gate.
    assert_eq!((&replay["identical"], &replay["gaps"]), (&json!(true), &json!(1)), "{said}");
}

#[test]
fn a_place_where_nobody_is_is_waited_for_and_ends_with_one_and_one_that_is_none_with_two() {
    let _flies = in_real_time();
    let folder = folder("connect", "codes");
    let code = |arguments: &[&str]| {
        let ports = ["--port", "http=0", "--port", "mavlink-udp=off", "--port", "mavlink-tcp=off", "--for", "1"];
        let all = [&["connect"][..], arguments, &ports].concat();
        let mut command = Command::new(env!("CARGO_BIN_EXE_stampfly"));
        command.current_dir(&folder).args(all).output().expect("the program starts").status.code()
    };
    // One that listens and is no vehicle.
    let silent = TcpListener::bind("127.0.0.1:0").expect("a port");
    let place = format!("tcp:{}", silent.local_addr().expect("an address"));
    assert_eq!(code(&[&place]), Some(1));
    assert_eq!(code(&["/dev/there-is-none"]), Some(1));
    assert_eq!(code(&["tcp:nowhere"]), Some(2));
    assert_eq!(code(&["/dev/null", "--baud", "12"]), Some(2));
    assert_eq!(code(&["/dev/null", "--port", "tello=1"]), Some(2), "as of serve");
}

#[test]
#[cfg(unix)]
fn a_computer_that_sleeps_for_a_moment_loses_neither_the_line_nor_the_page() {
    let _flies = in_real_time();
    let folder = folder("connect", "sleep");
    let (serving, place) = vehicle(&folder, 0);
    let (connected, mut socket) = connect(&folder, &format!("tcp:{place}"), &[]);
    next(&mut socket, "event", is_up(true));
    for _ in 0..3 {
        for name in ["-STOP", "-CONT"] {
            signal(&serving.0, name);
            signal(&connected.0, name);
            std::thread::sleep(Duration::from_millis(200));
        }
    }
    let read = ask(&mut socket, 2, json!({ "do": "param_get", "name": "eskf.gate" }));
    assert_eq!((&read["ok"], &read["value"]), (&json!(true), &json!(4.0)));
}
