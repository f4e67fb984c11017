//! The ground station's server over the loopback network: raw bytes, and WebSocket clients.

use crate::connect::{message, page};
use serde_json::{Value, json};
use stampfly_board::simulation::StampFly;
use stampfly_board::topics::Id;
use stampfly_host::ground::{self, Event, Hub, Limits, LogSoFar, Reply, Server, VehicleCard, ask::NAMES};
use stampfly_sim::vehicle::Vehicle;
use stampfly_types::messages::FlightStatus;
use stampfly_types::{Instant, Message as _};
use std::io::{Cursor, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant as Wall};
use tungstenite::{Message, WebSocket};

const SOON: Duration = Duration::from_secs(10);

fn hub() -> Arc<Hub> {
    let card = |name| VehicleCard::of::<StampFly>(name, &StampFly::default_config()).offering(NAMES);
    Hub::new(vec![card("one"), card("two")])
}

pub fn server(hub: &Arc<Hub>) -> Server {
    let limits = Limits { head: Duration::from_millis(300), stall: Duration::from_millis(700), ..Limits::default() };
    Server::start(hub.clone(), "127.0.0.1:0".parse().expect("an address"), limits).expect("a free port")
}

pub fn connect(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).expect("the server listens");
    stream.set_read_timeout(Some(SOON)).expect("a timeout");
    stream
}

/// What the server says to these bytes, until it closes.
fn say(address: SocketAddr, text: &str) -> String {
    let mut stream = connect(address);
    stream.write_all(text.as_bytes()).expect("sent");
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).expect("an answer");
    String::from_utf8_lossy(&answer).into_owned()
}

/// What it says at first, where it does not close.
fn say_for(address: SocketAddr, text: &str, time: Duration) -> String {
    let mut stream = connect(address);
    stream.set_read_timeout(Some(time)).expect("a timeout");
    stream.write_all(text.as_bytes()).expect("sent");
    let mut answer = [0; 64];
    let length = stream.read(&mut answer).unwrap_or_default();
    String::from_utf8_lossy(&answer[..length]).into_owned()
}

pub fn get(address: SocketAddr, path: &str) -> String {
    say(address, &format!("GET {path} HTTP/1.1\r\nHost: {address}\r\n\r\n"))
}

pub fn socket(address: SocketAddr) -> WebSocket<TcpStream> {
    page(&address.to_string())
}

pub fn next(socket: &mut WebSocket<TcpStream>, kind: &str) -> Value {
    let until = Wall::now() + SOON;
    while Wall::now() < until {
        let Message::Text(text) = message(socket) else { continue };
        let value: Value = serde_json::from_str(&text).expect("JSON");
        if !value[kind].is_null() {
            return value[kind].clone();
        }
    }
    panic!("no {kind}");
}

pub fn send(socket: &mut WebSocket<TcpStream>, value: &Value) {
    socket.send(Message::text(value.to_string())).expect("sent");
}

#[test]
fn the_page_is_one_file_with_a_strict_policy() {
    let server = server(&hub());
    let page = get(server.address(), "/");
    let (head, body) = page.split_once("\r\n\r\n").expect("a head");
    assert!(head.starts_with("HTTP/1.1 200 OK\r\n"), "{head}");
    assert!(head.contains("Content-Security-Policy: default-src 'none'; script-src 'nonce-"), "{head}");
    assert!(head.contains(&format!("Content-Length: {}\r\n", body.len())), "{head}");
    assert!(body.starts_with("<!doctype html>") && body.trim_end().ends_with("</html>"));
}

#[test]
fn a_log_is_what_the_flight_provides() {
    let hub = hub();
    let server = server(&hub);
    assert!(get(server.address(), "/log/0").starts_with("HTTP/1.1 404"), "no log yet");
    let log: Vec<u8> = (0..=255).cycle().take(3_000_000).collect();
    let provided = log.clone();
    hub.provide_log(0, move || {
        Ok(LogSoFar { length: provided.len() as u64, bytes: Box::new(Cursor::new(provided.clone())) })
    });
    let mut stream = connect(server.address());
    write!(stream, "GET /log/0 HTTP/1.1\r\nHost: localhost\r\n\r\n").expect("sent");
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).expect("an answer");
    assert!(answer.ends_with(&log) && answer.starts_with(b"HTTP/1.1 200 OK\r\n"));
    assert!(get(server.address(), "/log/7").starts_with("HTTP/1.1 404"));
}

#[test]
fn what_is_foreign_slow_or_too_much_is_refused() {
    let server = server(&hub());
    let address = server.address();
    let cases = [
        ("POST / HTTP/1.1\r\nHost: localhost\r\n\r\n", "405"),
        ("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n", "403"),
        ("GET / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example\r\n\r\n", "403"),
        ("GET /favicon.ico HTTP/1.1\r\nHost: localhost\r\n\r\n", "404"),
        ("GET /ws HTTP/1.1\r\nHost: localhost\r\n\r\n", "426"),
        ("nonsense\r\n\r\n", "400"),
        ("GET / HTTP/1.1\r\nHost: loc", "408"),
    ];
    for (text, status) in cases {
        let answer = say(address, text);
        assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{text}: {answer}");
    }
    let long = format!("GET / HTTP/1.1\r\nHost: localhost\r\nX: {}\r\n\r\n", "x".repeat(20_000));
    assert!(say(address, &long).starts_with("HTTP/1.1 431 "));

    let open: Vec<_> = (0..Limits::default().sockets).map(|_| socket(address)).collect();
    assert!(say(address, &handshake()).starts_with("HTTP/1.1 503 "), "one more is refused");
    assert!(get(address, "/").starts_with("HTTP/1.1 200 "), "the page is shown");
    drop(open);
    let until = Wall::now() + SOON;
    while say_for(address, &handshake(), Duration::from_millis(100)).starts_with("HTTP/1.1 503 ") {
        assert!(Wall::now() < until, "places are free again");
    }
}

/// A request for a WebSocket, as RFC 6455 has it.
pub fn handshake() -> String {
    let key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
    let asks = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13";
    format!("GET /ws HTTP/1.1\r\nHost: localhost\r\n{asks}\r\n{key}\r\n\r\n")
}

#[test]
fn half_requests_and_logs_that_are_read_slowly_do_not_keep_a_person_out() {
    let hub = hub();
    let limits = Limits { stall: Duration::from_secs(2), slowest: 10_000_000, ..Limits::default() };
    let server = Server::start(hub.clone(), "127.0.0.1:0".parse().expect("an address"), limits).expect("a free port");
    let length = 50_000_000;
    hub.provide_log(0, move || Ok(LogSoFar { length, bytes: Box::new(std::io::repeat(7).take(length)) }));
    let address = server.address();
    let ask = |text: &str| {
        let mut stream = connect(address);
        stream.write_all(text.as_bytes()).expect("sent");
        stream
    };
    let mut slow: Vec<_> = (0..limits.logs).map(|_| ask("GET /log/0 HTTP/1.1\r\nHost: localhost\r\n\r\n")).collect();
    let until = Wall::now() + SOON;
    let first = |address| say_for(address, "GET /log/0 HTTP/1.1\r\nHost: localhost\r\n\r\n", SOON);
    while !first(address).starts_with("HTTP/1.1 503 ") {
        assert!(Wall::now() < until, "as many logs as there are places");
    }
    let _half: Vec<_> = (0..5 * limits.requests).map(|_| ask("GET / HTTP/1.1\r\nHost: loc")).collect();
    for _ in 0..3 {
        assert!(get(address, "/").starts_with("HTTP/1.1 200 "));
        next(&mut socket(address), "state");
    }
    // Who reads a little now and then keeps no place either.
    let until = Wall::now() + SOON;
    let mut part = [0; 4096];
    while first(address).starts_with("HTTP/1.1 503 ") {
        assert!(Wall::now() < until, "they keep their places");
        slow.iter_mut().for_each(|stream| assert!(stream.read(&mut part).is_ok()));
        std::thread::sleep(Duration::from_millis(100));
    }
}

#[test]
fn a_page_with_a_secret_is_for_those_who_know_it() {
    let (hub, limits) = (hub(), Limits::default());
    hub.provide_log(0, || Ok(LogSoFar { length: 4, bytes: Box::new(Cursor::new(*b"ULog")) }));
    let listen = "127.0.0.1:0".parse().expect("an address");
    let server = Server::with_secret(hub, listen, limits, Some("aB3".into())).expect("a free port");
    let address = server.address();
    assert!(get(address, "/").starts_with("HTTP/1.1 200 "), "it shows nothing by itself");
    for wrong in ["", "?secret=aB4", "?secret=aB", "?secret=aB33"] {
        assert!(get(address, &format!("/log/0{wrong}")).starts_with("HTTP/1.1 403 "), "{wrong}");
        let handshake = handshake().replace("/ws", &format!("/ws{wrong}"));
        assert!(say(address, &handshake).starts_with("HTTP/1.1 403 "), "{wrong}");
    }
    assert!(get(address, "/log/0?secret=aB3").ends_with("ULog"));
    let handshake = handshake().replace("/ws", "/ws?secret=aB3");
    assert!(say_for(address, &handshake, Duration::from_millis(500)).starts_with("HTTP/1.1 101 "));
}

#[test]
fn a_page_sees_state_and_gets_its_answers() {
    let hub = hub();
    let server = server(&hub);
    let mut page = socket(server.address());
    let hello = next(&mut page, "hello");
    assert_eq!(hello["vehicles"][1]["name"], "two");

    send(&mut page, &json!({ "id": 1, "do": "subscribe", "topics": ["flight_status"], "rate": 50 }));
    assert_eq!(next(&mut page, "reply")["id"], 1);
    let watch = hub.witness(1).expect("a vehicle");
    let status = FlightStatus { armed: true, ..Default::default() };
    watch.note(Id::flight_status as usize, Instant::from_millis(20), &status.to_words());
    let sample = loop {
        let state = next(&mut page, "state");
        if let Some(sample) = state[1].get(2) {
            break sample.clone();
        }
    };
    assert_eq!(sample, json!([Id::flight_status as usize, 1, 0.02, 0, 1, 1, 0, 0, 0, 0, 0, 0]));

    send(&mut page, &json!({ "vehicle": 1, "id": 2, "do": "guided", "kind": "arm" }));
    let until = Wall::now() + SOON;
    let asks = loop {
        let asks = hub.asks(1, ground::now());
        if !asks.is_empty() {
            break asks;
        }
        assert!(Wall::now() < until, "no ask");
        std::thread::sleep(Duration::from_millis(1));
    };
    hub.answer(asks[0].0, &asks[0].1, Ok(Reply::text("arming")));
    assert_eq!(next(&mut page, "reply"), json!({ "vehicle": 1, "id": 2, "ok": true, "text": "arming", "value": null }));
    hub.tell_all(1, &Event::Text { text: "a gust".into() });
    let event = next(&mut page, "event");
    assert_eq!(event, json!({ "kind": "text", "text": "a gust", "vehicle": 1, "at": 0.02 }));
    for nonsense in ["", "{}", "[1]", r#"{"vehicle":9,"id":3,"do":"param_save"}"#] {
        page.send(Message::text(nonsense)).expect("sent");
        assert_eq!(next(&mut page, "reply")["ok"], false, "{nonsense}");
    }
}

#[test]
fn state_comes_at_the_rate_that_is_asked_for() {
    let server = server(&hub());
    let mut page = socket(server.address());
    for (rate, low, high) in [(50, 40, 60), (10, 8, 12)] {
        send(&mut page, &json!({ "id": 1, "do": "subscribe", "topics": [], "rate": rate }));
        next(&mut page, "reply");
        let begun = Wall::now();
        let mut count = 0;
        while begun.elapsed() < Duration::from_secs(1) {
            next(&mut page, "state");
            count += 1;
        }
        // Machines that are busy are late; none is early.
        assert!((low / 2..=high).contains(&count), "{count} at {rate} Hz");
    }
}

#[test]
fn a_slow_page_is_left_out_and_then_cut_off_and_nobody_waits_for_it() {
    let hub = hub();
    let server = server(&hub);
    let (mut slow, mut well) = (socket(server.address()), socket(server.address()));
    next(&mut slow, "hello");
    next(&mut well, "hello");
    // Long texts fill what the system keeps for the slow one.
    let long = "x".repeat(200_000);
    let begun = Wall::now();
    for _ in 0..60 {
        hub.tell_all(0, &Event::Text { text: long.clone() });
        next(&mut well, "event");
    }
    assert!(begun.elapsed() < SOON, "{:?}", begun.elapsed());
    std::thread::sleep(Duration::from_millis(1500));
    // It reads what was on its way, and then the end: an error, or a close.
    let until = Wall::now() + SOON;
    while slow.read().is_ok() {
        assert!(Wall::now() < until, "it was not cut off");
    }
    next(&mut well, "state");
}

#[test]
fn a_message_that_is_too_long_ends_the_connection() {
    let server = server(&hub());
    let mut page = socket(server.address());
    next(&mut page, "hello");
    page.send(Message::text("x".repeat(100_000))).expect("sent");
    let until = Wall::now() + SOON;
    while page.read().is_ok() {
        assert!(Wall::now() < until, "it was not cut off");
    }
}

#[test]
fn a_server_that_is_dropped_lets_its_clients_go() {
    let hub = hub();
    let server = server(&hub);
    let mut page = socket(server.address());
    next(&mut page, "hello");
    let begun = Wall::now();
    drop(server);
    while page.read().is_ok() {
        assert!(begun.elapsed() < SOON, "it goes on");
    }
}
