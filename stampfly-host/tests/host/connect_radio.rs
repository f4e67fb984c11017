//! `stampfly connect` with a vehicle in a network: sealed frames between a simulated vehicle's port and a page's socket, and what a radio does to them.

use crate::connect::{alive, ask, ask_once, connect, is_done, is_up, next, page, passes, rate, recorded, sample};
use crate::program::{Program, folder, interrupt};
use crate::real_time::in_real_time;
use serde_json::{Value, json};
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

const SOON: Duration = Duration::from_secs(20);

/// A file with a key, whose first byte is this.
pub fn key(folder: &Path, name: &str, first: u8) -> String {
    let file = folder.join(name);
    std::fs::write(&file, format!("{first:02x}{}\n", "5a".repeat(31))).expect("the folder can be written");
    #[cfg(unix)]
    std::fs::set_permissions(&file, std::os::unix::fs::PermissionsExt::from_mode(0o600)).expect("it is ours");
    file.display().to_string()
}

/// Subscribes to the estimate, and returns where its height is in a sample: that of the position down.
fn see(socket: &mut WebSocket<TcpStream>, hello: &Value) -> usize {
    let topics = json!({ "id": 1, "do": "subscribe", "topics": ["estimate_state"], "rate": 50 });
    socket.send(Message::text(topics.to_string())).expect("sent");
    let topics = hello["vehicles"][0]["topics"].as_array().expect("topics");
    let estimate = topics.iter().find(|topic| topic["name"] == "estimate_state").expect("the estimate");
    let fields = estimate["fields"].as_array().expect("fields");
    let before = fields.iter().take_while(|field| field["name"] != "position");
    // Behind place, number and instant.
    3 + before.map(|field| field["count"].as_u64().expect("a number") as usize).sum::<usize>() + 2
}

/// Waits until its height above the ground, in m, is there. `false` when that takes longer.
fn is_at(socket: &mut WebSocket<TcpStream>, down: usize, height: Range<f64>, within: Duration) -> bool {
    let until = Instant::now() + within;
    while Instant::now() < until {
        alive(socket);
        if sample(socket)[down].as_f64().is_some_and(|down| height.contains(&-down)) {
            return true;
        }
    }
    false
}

/// What a page asks once is done, whatever the radio loses.
fn guided(socket: &mut WebSocket<TcpStream>, id: u32, mut what: Value) {
    what["do"] = "guided".into();
    let answer = ask(socket, id, what);
    assert_eq!(answer["ok"], json!(true), "{answer}");
}

/// Takes off, and returns when it is in the air.
fn fly(socket: &mut WebSocket<TcpStream>, down: usize) {
    guided(socket, 21, json!({ "kind": "take_off", "height": 0.3 }));
    assert!(is_at(socket, down, 0.2..0.4, SOON), "it does not fly");
}

#[test]
fn a_page_sees_asks_and_flies_a_vehicle_with_its_key_and_not_with_another() {
    let _flies = in_real_time();
    let folder = folder("connect", "sealed");
    let (ours, others) = (key(&folder, "ours", 1), key(&folder, "others", 2));
    let (serving, place) = Program::serve(&folder, "sealed=0", &["--key", &ours]);
    let (mut connected, mut socket) = connect(&folder, &format!("udp:{place}"), &["--key", &ours]);
    let hello = next(&mut socket, "hello", |_| true);
    let offers = hello["vehicles"][0]["offers"].to_string();
    assert!(offers.contains("param_set") && !offers.contains("motor_test"), "{offers}");
    next(&mut socket, "event", is_up(true));

    let down = see(&mut socket, &hello);
    let rate = rate(&mut socket);
    assert!(rate > 8.0, "{rate} Hz");

    let set = ask(&mut socket, 2, json!({ "do": "param_set", "name": "eskf.gate", "value": 3.5 }));
    assert_eq!((&set["ok"], &set["value"]), (&json!(true), &json!(3.5)));
    assert_eq!(ask(&mut socket, 3, json!({ "do": "param_get", "name": "eskf.gate" }))["value"], json!(3.5));
    let wrong = json!({ "do": "param_set", "name": "eskf.gate", "value": 1e9 });
    assert_eq!(ask(&mut socket, 4, wrong)["ok"], json!(false));
    let list = ask(&mut socket, 5, json!({ "do": "console", "line": "param list" }));
    let is_whole = |text: &str| text.lines().count() > 100 && text.contains("eskf.gate");
    assert!(list["text"].as_str().is_some_and(is_whole), "{list}");
    let motor = json!({ "do": "motor_test", "motor": 1, "duty": 0.1 });
    assert_eq!(ask(&mut socket, 6, motor)["ok"], json!(false));

    is_done(&mut socket, 7, "status", "blocks   NO_LINK\n");
    passes(&mut socket, 2);
    guided(&mut socket, 8, json!({ "kind": "arm" }));
    // What is no flying is refused while it is armed, and the page is told so at once.
    let what =
        [json!({ "do": "console", "line": "status" }), json!({ "do": "param_set", "name": "eskf.gate", "value": 3.0 })];
    for (id, what) in (9..).zip(what) {
        let refused = ask(&mut socket, id, what);
        assert!(refused["text"].as_str().is_some_and(|text| text.contains("only while it is disarmed")), "{refused}");
    }

    fly(&mut socket, down);
    guided(&mut socket, 10, json!({ "kind": "kill" }));
    // It falls.
    is_done(&mut socket, 11, "status", "CRASHED");

    // Whoever has another key is not heard, and hears nothing.
    let (mut stranger, mut page) = connect(&folder, &format!("udp:{place}"), &["--key", &others, "--for", "10"]);
    next(&mut page, "event", is_up(false));
    assert_eq!(ask_once(&mut page, 1, json!({ "do": "guided", "kind": "kill" }))["ok"], json!(false));
    interrupt(&stranger.0);
    assert_eq!(stranger.0.wait().expect("it ends").code(), Some(1));

    drop(serving);
    next(&mut socket, "event", is_up(false));
    assert_eq!(ask(&mut socket, 12, json!({ "do": "guided", "kind": "arm" }))["ok"], json!(false));
    assert!(connected.0.try_wait().expect("a process").is_none(), "it waits for the vehicle");
    let port = format!("sealed={}", place.parse::<SocketAddr>().expect("an address").port());
    let (_serving, _) = Program::serve(&folder, &port, &["--key", &ours]);
    next(&mut socket, "event", is_up(true));
    assert_eq!(ask(&mut socket, 13, json!({ "do": "param_get", "name": "eskf.gate" }))["value"], json!(4.0));
}

#[test]
fn a_flight_is_recorded_by_radio_and_replays_bit_for_bit() {
    let _flies = in_real_time();
    let folder = folder("connect", "sealed_record");
    let ours = key(&folder, "ours", 1);
    let (_serving, place) = Program::serve(&folder, "sealed=0", &["--key", &ours]);
    recorded(&folder, &format!("udp:{place}"), &["--key", &ours]);
}

/// Between a station and its vehicle: of a hundred datagrams each way 30 are lost, five are spoilt in one bit and five come twice.
struct Relay {
    place: SocketAddr,
    is_over: Arc<AtomicBool>,
}

impl Relay {
    fn to(vehicle: &str) -> Self {
        let (near, far) = (UdpSocket::bind("127.0.0.1:0"), UdpSocket::bind("127.0.0.1:0"));
        let (near, far) = (near.expect("a port"), far.expect("a port"));
        far.connect(vehicle).expect("an address");
        let relay = Self { place: near.local_addr().expect("an address"), is_over: Arc::new(AtomicBool::new(false)) };
        let is_over = relay.is_over.clone();
        for socket in [&near, &far] {
            socket.set_nonblocking(true).expect("a socket");
        }
        std::thread::spawn(move || {
            let (mut random, mut station, mut room) = (1_u64, None, [0; 512]);
            while !is_over.load(Ordering::Relaxed) {
                // All that is there: a relay that is slower than what is said would be a queue.
                while let Ok((length, from)) = near.recv_from(&mut room) {
                    station = Some(from);
                    pass(&mut random, &mut room[..length], |bytes| drop(far.send(bytes)));
                }
                while let Ok(length) = far.recv(&mut room) {
                    pass(&mut random, &mut room[..length], |bytes| {
                        station.into_iter().for_each(|station| drop(near.send_to(bytes, station)));
                    });
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        relay
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
    }
}

fn pass(random: &mut u64, bytes: &mut [u8], send: impl Fn(&[u8])) {
    let mut below = |limit: u64| {
        // Knuth's generator, in its upper bits.
        *random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*random >> 33) % limit
    };
    match below(100) {
        0..30 => {}
        30..35 if !bytes.is_empty() => {
            let place = below(bytes.len() as u64) as usize;
            bytes[place] ^= 1 << below(8);
            send(bytes);
        }
        35..40 => (0..2).for_each(|_| send(bytes)),
        _ => send(bytes),
    }
}

#[test]
fn a_page_flies_and_kills_a_vehicle_over_a_radio_that_loses_a_third() {
    let _flies = in_real_time();
    let folder = folder("connect", "sealed_lossy");
    let ours = key(&folder, "ours", 1);
    let (_serving, vehicle) = Program::serve(&folder, "sealed=0", &["--key", &ours]);
    let relay = Relay::to(&vehicle);
    let (_connected, mut socket) = connect(&folder, &format!("udp:{}", relay.place), &["--key", &ours]);
    let hello = next(&mut socket, "hello", |_| true);
    next(&mut socket, "event", is_up(true));
    let down = see(&mut socket, &hello);
    is_done(&mut socket, 7, "status", "blocks   NO_LINK\n");
    passes(&mut socket, 2);
    // A question for a parameter is asked again, too.
    let set = ask(&mut socket, 8, json!({ "do": "param_set", "name": "eskf.gate", "value": 3.5 }));
    assert_eq!((&set["ok"], &set["value"]), (&json!(true), &json!(3.5)));
    guided(&mut socket, 9, json!({ "kind": "arm" }));
    fly(&mut socket, down);
    guided(&mut socket, 10, json!({ "kind": "kill" }));
    // It falls, and is there for its page.
    assert!(is_at(&mut socket, down, -0.1..0.1, SOON));
    is_done(&mut socket, 11, "status", "CRASHED");
}

#[test]
fn a_radio_that_a_fault_silences_is_silent_for_a_station_with_the_key() {
    let _flies = in_real_time();
    let folder = folder("connect", "sealed_silent");
    let ours = key(&folder, "ours", 1);
    let ports = ["serve", "--port", "others=off", "--port", "http=0", "--port", "sealed=0", "--key", &ours];
    let mut serving = Program::start(&folder, &ports);
    let vehicle = serving.said("sealed", "listening on ");
    let mut beside = page(&serving.said("http ", "http://"));
    let (_connected, mut socket) = connect(&folder, &format!("udp:{vehicle}"), &["--key", &ours]);
    next(&mut socket, "event", is_up(true));
    let fault = ask(&mut beside, 1, json!({ "do": "fault", "text": "link-lost@0+4" }));
    assert_eq!(fault["ok"], json!(true), "{fault}");
    next(&mut socket, "event", is_up(false));
    next(&mut socket, "event", is_up(true));
    passes(&mut socket, 2);
}

/// A vehicle with a page of its own, and another page behind a station by radio.
struct Shared {
    serving: Program,
    connected: Program,
    beside: WebSocket<TcpStream>,
    radio: WebSocket<TcpStream>,
    /// Where the height is in a sample, for each page.
    down: [usize; 2],
}

impl Shared {
    fn new(name: &str) -> Self {
        let folder = folder("connect", name);
        let ours = key(&folder, "ours", 1);
        let ports = ["serve", "--port", "others=off", "--port", "http=0", "--port", "sealed=0", "--key", &ours];
        let mut serving = Program::start(&folder, &ports);
        let vehicle = serving.said("sealed", "listening on ");
        let mut beside = page(&serving.said("http ", "http://"));
        let (connected, mut radio) = connect(&folder, &format!("udp:{vehicle}"), &["--key", &ours]);
        let hellos = [next(&mut beside, "hello", |_| true), next(&mut radio, "hello", |_| true)];
        next(&mut radio, "event", is_up(true));
        let down = [see(&mut beside, &hellos[0]), see(&mut radio, &hellos[1])];
        is_done(&mut radio, 7, "status", "blocks   NO_LINK\n");
        Self { serving, connected, beside, radio, down }
    }
}

fn told(socket: &mut WebSocket<TcpStream>, what: &str) {
    next(socket, "event", |event| event["text"].as_str().is_some_and(|text| text.contains(what)));
}

fn refused(answer: &Value, holder: &str) {
    let text = answer["text"].as_str().unwrap_or_default();
    assert!(answer["ok"] == json!(false) && text.contains(holder) && text.contains("commands"), "{answer}");
}

#[test]
fn a_page_commands_and_a_station_by_radio_is_refused_and_told_who_does_and_may_kill() {
    let _flies = in_real_time();
    let Shared { serving: _serving, connected: _connected, mut beside, mut radio, down } = Shared::new("page_first");
    passes(&mut beside, 1);
    guided(&mut beside, 8, json!({ "kind": "arm" }));
    fly(&mut beside, down[0]);
    told(&mut radio, ": take off");
    alive(&mut beside);
    let go = json!({ "do": "guided", "kind": "go_to", "north": 1.0, "east": 0.0, "up": 0.5, "yaw": 0.0 });
    refused(&ask_once(&mut radio, 9, go), "page ");
    alive(&mut beside);
    // The page still commands.
    guided(&mut beside, 10, json!({ "kind": "hold" }));
    guided(&mut radio, 11, json!({ "kind": "kill" }));
    told(&mut beside, "the station with the key, line 1: KILL");
    is_done(&mut beside, 12, "status", "CRASHED");
}

#[test]
fn a_station_by_radio_commands_and_a_page_is_refused_and_keeps_nothing_in_the_air_when_the_station_has_left() {
    let _flies = in_real_time();
    let Shared { serving: _serving, connected, mut beside, mut radio, down } = Shared::new("radio_first");
    passes(&mut radio, 1);
    guided(&mut radio, 8, json!({ "kind": "arm" }));
    fly(&mut radio, down[1]);
    told(&mut beside, "the station with the key, line 1: take off");
    alive(&mut radio);
    refused(&ask_once(&mut beside, 9, json!({ "do": "guided", "kind": "hold" })), "the station with the key");
    // Its signs of life are half a second apart, as a page's are.
    for _ in 0..8 {
        alive(&mut radio);
        std::thread::sleep(Duration::from_millis(500));
        assert!(is_at(&mut beside, down[0], 0.2..0.4, SOON), "it stays in the air");
    }
    drop((connected, radio));
    let left = Instant::now();
    // The page chatters on.
    let sticks = json!({ "vehicle": 0, "id": 0, "do": "sticks", "roll": 0, "pitch": 0, "yaw": 0, "throttle": 0,
        "mode": "poshold", "arm": true, "kill": false });
    let mut height = 1.0;
    while height > 0.1 {
        alive(&mut beside);
        beside.send(Message::text(sticks.to_string())).expect("sent");
        height = -sample(&mut beside)[down[0]].as_f64().expect("a number");
        assert!(left.elapsed() < SOON, "it is still at {height} m");
    }
    assert!(left.elapsed() > Duration::from_secs(3), "{:?}", left.elapsed());
    let until = Instant::now() + SOON;
    // It has landed, and the page may fly it.
    loop {
        alive(&mut beside);
        let status = ask(&mut beside, 11, json!({ "do": "console", "line": "status" }));
        let text = status["text"].as_str().unwrap_or_default();
        if text.contains("blocks   -") || text.contains("blocks   \n") || text.contains("blocks   none") {
            break;
        }
        assert!(Instant::now() < until && !text.contains("CRASHED"), "{text}");
        std::thread::sleep(Duration::from_millis(200));
    }
    guided(&mut beside, 12, json!({ "kind": "arm" }));
}

#[test]
fn strangers_that_ask_all_the_time_do_not_keep_the_station_out() {
    let _flies = in_real_time();
    let folder = folder("connect", "sealed_flood");
    let ours = key(&folder, "ours", 1);
    let (_serving, vehicle) = Program::serve(&folder, "sealed=0", &["--key", &ours]);
    let is_over = Arc::new(AtomicBool::new(false));
    let flood = {
        let (vehicle, is_over) = (vehicle.clone(), is_over.clone());
        std::thread::spawn(move || {
            let sockets: Vec<_> = (0..4).map(|_| UdpSocket::bind("127.0.0.1:0").expect("a port")).collect();
            // An empty datagram asks for an offer; what is as long as a frame has to be looked at.
            for bytes in [&[][..], &[1; 40]].iter().cycle().take_while(|_| !is_over.load(Ordering::Relaxed)) {
                sockets.iter().for_each(|socket| _ = socket.send_to(bytes, &vehicle));
                std::thread::sleep(Duration::from_millis(5));
            }
        })
    };
    let begun = Instant::now();
    let (_connected, mut socket) = connect(&folder, &format!("udp:{vehicle}"), &["--key", &ours]);
    next(&mut socket, "event", is_up(true));
    let joined = begun.elapsed();
    assert!(joined < Duration::from_secs(10), "{joined:?}");
    let read = ask(&mut socket, 1, json!({ "do": "param_get", "name": "eskf.gate" }));
    assert_eq!((&read["ok"], &read["value"]), (&json!(true), &json!(4.0)));
    is_over.store(true, Ordering::Relaxed);
    flood.join().expect("a thread");
}

#[test]
fn a_key_is_for_the_radio_and_the_radio_wants_one() {
    let _flies = in_real_time();
    let folder = folder("connect", "keys");
    let ours = key(&folder, "ours", 1);
    for arguments in [&["connect", "udp:127.0.0.1"][..], &["connect", "tcp:127.0.0.1:5763", "--key", &ours]] {
        let mut program = Program::start(&folder, arguments);
        assert_eq!(program.0.wait().expect("it ends").code(), Some(2), "{arguments:?}");
    }
}
