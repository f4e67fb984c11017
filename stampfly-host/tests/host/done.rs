//! A page receives the vehicle's own verdict of each command, on every path: at the page of
//! `serve`, over a cable and by radio.

use crate::connect::{alive, ask, connect, is_up, next, page};
use crate::connect_radio::key;
use crate::doorstep::Observer;
use crate::program::{Program, folder};
use crate::real_time::in_real_time;
use serde_json::{Value, json};
use std::net::TcpStream;
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

/// A vehicle on the ground, and pages on three paths to it.
struct Doors {
    _programs: Vec<Program>,
    observer: Observer,
    pages: [(&'static str, WebSocket<TcpStream>); 3],
}

impl Doors {
    fn new(name: &str) -> Self {
        let folder = folder("done", name);
        let key = key(&folder, "key", 1);
        let ports = ["--port", "others=off", "--port", "http=0", "--port", "usb-tcp=0", "--port", "sealed=0"];
        let mut serving = Program::start(&folder, &[&["serve", "--key", &key][..], &ports].concat());
        let places = ["usb-tcp", "sealed", "http "]
            .map(|port| serving.said(port, if port == "http " { "http://" } else { "listening on " }));
        let [cable, radio, address] = places;
        let observer = Observer::of(page(&address), address.clone());
        let mut near = page(&address);
        next(&mut near, "hello", |_| true);
        let (by_cable, mut cable) = connect(&folder, &format!("tcp:{cable}"), &[]);
        let (by_radio, mut radio) = connect(&folder, &format!("udp:{radio}"), &["--key", &key]);
        for socket in [&mut cable, &mut radio] {
            next(socket, "event", is_up(true));
        }
        let pages = [("serve", near), ("connect tcp:", cable), ("connect udp:", radio)];
        Self { _programs: vec![serving, by_cable, by_radio], observer, pages }
    }
}

/// These commands, asked for at once, are all refused with a reason.
fn are_refused(name: &str, socket: &mut WebSocket<TcpStream>, first: u32, commands: &[Value]) {
    let until = Instant::now() + Duration::from_secs(20);
    let mut left: Vec<(u32, &Value)> = (first..).zip(commands).collect();
    while !left.is_empty() {
        alive(socket);
        for (id, command) in &left {
            let mut ask = json!({ "vehicle": 0, "id": id, "do": "guided" });
            command.as_object().into_iter().flatten().for_each(|(name, value)| ask[name] = value.clone());
            socket.send(Message::text(ask.to_string())).expect("sent");
        }
        let (mut again, mut last) = (Vec::new(), String::new());
        for _ in 0..left.len() {
            let answer = next(socket, "reply", |reply| left.iter().any(|(id, _)| reply["id"] == *id));
            let (_, command) = left.iter().find(|(id, _)| answer["id"] == *id).expect("one of them");
            let text = answer["text"].as_str().unwrap_or_default();
            assert!(answer["ok"] == json!(false) && !text.is_empty(), "{name}: {command}: {answer}");
            // A machine that is busy with other tests loses the line for a moment.
            if ["expired", "nothing is heard", "the vehicle does not answer", "the vehicle has no room"]
                .iter()
                .any(|silent| text.starts_with(silent))
            {
                again.push(answer["id"].clone());
                last = text.to_owned();
            }
        }
        std::thread::sleep(Duration::from_millis(if again.is_empty() { 0 } else { 200 }));
        left.retain(|(id, _)| again.iter().any(|again| *again == *id));
        assert!(Instant::now() < until, "{name}: {left:?} are not answered by the vehicle: {last}");
    }
}

#[test]
fn on_the_ground_with_motors_off_nothing_that_moves_the_vehicle_is_called_done() {
    let _flies = in_real_time();
    let mut doors = Doors::new("ground");
    doors.observer.is_ready();
    let commands = [
        json!({ "kind": "take_off", "height": 0.5 }),
        // It stands on the ground already. That is no landing: a person who sees "done" would take
        // the vehicle for one that had flown.
        json!({ "kind": "land" }),
        json!({ "kind": "hold" }),
        json!({ "kind": "flip", "direction": "left" }),
        json!({ "kind": "go_to", "north": 1.0, "east": 0.0, "up": 0.5, "yaw": 0.0 }),
    ];
    for (name, socket) in &mut doors.pages {
        // One after the other, as a person clicks.
        for (place, command) in (0..).zip(&commands) {
            are_refused(name, socket, 20 + place, core::slice::from_ref(command));
        }
    }
    assert!(!doors.observer.was_armed());
}

#[test]
fn a_vehicle_that_a_kill_has_thrown_down_refuses_to_arm_on_every_path_also_six_times_at_once() {
    let _flies = in_real_time();
    let mut doors = Doors::new("killed");
    doors.observer.is_ready();
    let (_, radio) = &mut doors.pages[2];
    let take_off = json!({ "do": "guided", "kind": "take_off", "height": 0.5 });
    for (id, what) in [(20, json!({ "do": "guided", "kind": "arm" })), (21, take_off)] {
        alive(radio);
        let answer = ask(radio, id, what);
        assert_eq!(answer["ok"], json!(true), "{answer}");
    }
    let until = Instant::now() + Duration::from_secs(20);
    while !doors.observer.has_climbed() {
        alive(radio);
        std::thread::sleep(Duration::from_millis(200));
        assert!(Instant::now() < until, "it does not climb");
    }
    assert_eq!(ask(radio, 22, json!({ "do": "guided", "kind": "kill" }))["ok"], json!(true));
    assert!(doors.observer.has_landed_within(Duration::from_secs(20)));
    for (name, socket) in &mut doors.pages {
        are_refused(name, socket, 30, &[json!({ "kind": "arm" })]);
        // By radio one goes after the other, and four wait.
        let several = if *name == "connect udp:" { 4 } else { 6 };
        are_refused(name, socket, 40, &vec![json!({ "kind": "arm" }); several]);
    }
    assert!(doors.observer.is_armed(false));
}
