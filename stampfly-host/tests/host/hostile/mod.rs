//! A hostile vehicle at the other end of `stampfly connect`: whatever it says, the program goes on,
//! its page answers, and its memory stays within a bound.

mod vehicle;

use crate::connect::{message, next, page};
use crate::ground::get;
use crate::program::{Program, folder};
use crate::real_time::in_real_time;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde_json::{Value, json};
use stampfly_board::simulation::StampFly;
use stampfly_flight::compact::Chunk;
use stampfly_host::connect::station::{Said, Station};
use stampfly_host::ground::Client;
use stampfly_host::ground::ask::Asked;
use stampfly_link::secure::Payload;
use stampfly_sim::vehicle::Vehicle as _;
use stampfly_types::Instant as At;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};
use vehicle::{Vehicle, frames, question, topics};

/// Each kind of nonsense is said for so long.
const SAID: Duration = Duration::from_millis(150);
/// What a page asks reaches the vehicle within this time, also while it speaks.
const REACHED: Duration = Duration::from_secs(2);
const SOON: Duration = Duration::from_secs(10);
/// Resident memory of the program, KiB: 16 MiB by itself, and for each of two pages 4 MiB that wait
/// to be written and 512 texts of up to 3 KiB.
const MEMORY: u64 = 32 << 10;

struct Scene {
    connected: Program,
    address: SocketAddr,
    page: WebSocket<TcpStream>,
    vehicle: Vehicle,
    folder: PathBuf,
}

impl Scene {
    fn new(name: &str, more: &[&str]) -> Self {
        let folder = folder("hostile", name);
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let place = format!("tcp:{}", listener.local_addr().expect("an address"));
        let ports = ["--port", "http=0", "--port", "others=off"];
        let mut connected = Program::start(&folder, &[&["connect", &place], &ports[..], more].concat());
        let address = connected.said("http ", "http://");
        let page = page(&address);
        let vehicle = Vehicle::new(listener.accept().expect("the station").0);
        Self { connected, address: address.parse().expect("an address"), page, vehicle, folder }
    }

    /// The program runs, within its memory, and shows its page to those who come now.
    fn stands(&mut self, after: &str) {
        assert!(self.connected.0.try_wait().expect("a process").is_none(), "it has ended: {after}");
        assert!(get(self.address, "/").starts_with("HTTP/1.1 200 "), "{after}");
        next(&mut page(&self.address.to_string()), "hello", |_| true);
        if let Some(memory) = self.memory() {
            assert!(memory < MEMORY, "{memory} KiB: {after}");
        }
    }

    /// Its resident memory, KiB, where the system says it.
    fn memory(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.connected.0.id())).ok()?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
        line.split_whitespace().next()?.parse().ok()
    }

    /// The page kills the vehicle, and reads what comes meanwhile. How long it took until the
    /// vehicle was told.
    fn kills(&mut self) -> Duration {
        while self.vehicle.heard.try_recv().is_ok() {}
        let begun = Instant::now();
        let kill = json!({ "vehicle": 0, "id": 1, "do": "guided", "kind": "kill" });
        self.page.send(Message::text(kill.to_string())).expect("the page is connected");
        loop {
            if self.vehicle.heard.try_iter().any(|heard| heard.what == "Kill") {
                return begun.elapsed();
            }
            assert!(begun.elapsed() < SOON, "the vehicle is not told");
            self.reads();
        }
    }

    /// Reads one text, which is JSON.
    fn reads(&mut self) {
        if let Message::Text(text) = message(&mut self.page) {
            let text: Result<Value, _> = serde_json::from_str(&text);
            assert!(text.is_ok(), "{text:?}");
        }
    }

    /// Asks something that the vehicle answers, from this question.
    fn asks(&mut self, what: Value, question: &str, answer: &Payload<'_>) -> Value {
        let until = Instant::now() + SOON;
        let mut what = what;
        (what["vehicle"], what["id"]) = (0.into(), 2.into());
        loop {
            assert!(Instant::now() < until, "no answer");
            // It is heard, and its clock is known.
            let words = vec![0; topics()[0].words];
            let sample = self.vehicle.sample(0, At::from_secs(1), &words);
            self.vehicle.say(&sample);
            self.page.send(Message::text(what.to_string())).expect("the page is connected");
            let once_more = Instant::now() + Duration::from_millis(200);
            while Instant::now() < once_more {
                for heard in self.vehicle.heard.try_iter().collect::<Vec<_>>() {
                    if heard.what.starts_with(question) {
                        let answer = self.vehicle.answer(heard.number, answer);
                        self.vehicle.say(&answer);
                    }
                }
                let Message::Text(text) = message(&mut self.page) else { continue };
                let text: Value = serde_json::from_str(&text).expect("JSON");
                if text["reply"]["id"] == 2 && text["reply"]["ok"] == true {
                    return text["reply"].clone();
                }
            }
        }
    }
}

#[test]
fn nonsense_ends_neither_the_program_nor_its_page_and_costs_no_memory() {
    let _flies = in_real_time();
    let mut scene = Scene::new("nonsense", &[]);
    let names: Vec<_> = topics().iter().map(|topic| topic.name).take(60).collect();
    let subscribe = json!({ "id": 9, "do": "subscribe", "topics": names, "rate": 50 });
    scene.page.send(Message::text(subscribe.to_string())).expect("sent");
    let mut random = ChaCha8Rng::seed_from_u64(1);
    scene.stands("nothing");
    for (name, bytes) in scene.vehicle.nonsense(&mut random) {
        eprintln!("{name}");
        let before = scene.memory();
        let says = scene.vehicle.says(bytes, SAID);
        let took = scene.kills();
        assert!(took < REACHED, "a kill took {took:?}: {name}");
        while !says.is_finished() {
            scene.reads();
        }
        let said = says.join().expect(name) as u64 >> 10;
        scene.stands(name);
        // Of what the vehicle has said nothing stays; the rest is what a page or a log takes.
        if let Some((before, after)) = before.zip(scene.memory()) {
            eprintln!("{said} KiB, a kill took {took:?}; {after} KiB of memory");
            assert!(after < before + said / 4 + 2_048, "{before}, then {after} KiB: {name}");
        }
    }
    // And then a vehicle that means well.
    let value = Payload::Parameter { index: 3, value: 2.5, taken: true };
    let read = scene.asks(json!({ "do": "param_get", "name": "eskf.gate" }), "ReadParameter", &value);
    assert_eq!(read["value"], json!(2.5));
    // A log for each start of the vehicle, of which there is none within a second.
    let files = std::fs::read_dir(&scene.folder).expect("a folder").count();
    assert!(files < 20, "{files} files");
}

#[test]
fn text_of_a_vehicle_reaches_pages_as_text() {
    let _flies = in_real_time();
    let mut scene = Scene::new("text", &[]);
    let markup = "<img src=x onerror=alert(1)></script>\"'&amp;\u{202e}";
    // In its notices there are no control characters, and in MAVLink's texts few of any kind.
    let mut told = b"MAVLink 1/1: <b onclick=alert(1)>\"\x1b[2J".to_vec();
    told.insert(0, 6);
    let said = [
        (format!("{markup}\u{1b}]0;title\u{7}\u{0}"), format!("{markup}\u{1b}]0;title\u{7}\u{0}\n").into_bytes()),
        (markup.to_owned(), scene.vehicle.answer(0, &Payload::Notice { number: 1, text: markup })),
        (String::from_utf8_lossy(&told[1..]).into_owned(), scene.vehicle.message(253, &told)),
    ];
    for (text, bytes) in said {
        scene.vehicle.say(&bytes);
        // JSON has no control characters, and nothing in it ends the text before its end.
        let raw = loop {
            let Message::Text(raw) = message(&mut scene.page) else { continue };
            if raw.contains("alert(1)") {
                break raw;
            }
        };
        assert!(!raw.chars().any(char::is_control), "{raw:?}");
        let event: Value = serde_json::from_str(&raw).expect("JSON");
        assert_eq!((&event["event"]["kind"], &event["event"]["text"]), (&json!("text"), &json!(text)));
    }
    // What is said in words is shown in words: the page has no way to make elements of a text.
    let page = get(scene.address, "/");
    assert!(page.contains("require-trusted-types-for 'script'; trusted-types 'none'"));
    for way in ["innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "srcdoc", "DOMParser", "eval("] {
        assert!(!page.contains(way), "{way}");
    }
    assert!(!page.contains("alert(1)"), "what vehicles say is not in the file of the page");
}

#[test]
fn an_answer_that_does_not_end_is_given_up_and_the_next_line_is_answered() {
    let _flies = in_real_time();
    let mut scene = Scene::new("answer", &[]);
    let done = Payload::Reply { text: "done", last: true };
    let line = |text: &str| json!({ "do": "console", "line": text });
    assert_eq!(scene.asks(line("first"), "Line(\"first\")", &done)["text"], "done");
    let more = Payload::Reply { text: &"more".repeat(25), last: false };
    scene
        .page
        .send(Message::text(json!({ "vehicle": 0, "id": 3, "do": "console", "line": "log" }).to_string()))
        .expect("sent");
    let number = loop {
        let heard = scene.vehicle.heard.recv_timeout(SOON).expect("the line");
        if heard.what == "Line(\"log\")" {
            break heard.number;
        }
    };
    let part = scene.vehicle.answer(number, &more);
    let says = scene.vehicle.says(part.repeat(100), 2 * SAID);
    let answer = next(&mut scene.page, "reply", |reply| reply["id"] == 3);
    assert_eq!(answer["ok"], false, "{answer}");
    assert!(answer["text"].as_str().is_some_and(|text| text.contains("does not end")), "{answer}");
    assert!(says.join().is_ok());
    assert_eq!(scene.asks(line("last"), "Line(\"last\")", &done)["text"], "done");
    scene.stands("an answer that does not end");
}

#[test]
fn a_record_that_begins_again_and_again_does_not_fill_the_folder_with_files() {
    let _flies = in_real_time();
    let mut scene = Scene::new("record", &["--record", "flight.sfr"]);
    let chunks = [0, 1, 0, 7, u32::MAX, 3].map(|number| {
        let mut room = [0; 64];
        let length = Chunk { number, begins: number == 0, words: &[1, 2, 3, 4] }.write(&mut room).expect("room");
        scene.vehicle.answer(0, &Payload::Chunk(&room[..length]))
    });
    let says = scene.vehicle.says(chunks.concat(), SAID);
    scene.kills();
    assert!(says.join().is_ok());
    scene.stands("a record that begins again");
    let files = std::fs::read_dir(&scene.folder).expect("a folder").count();
    assert!(files < 10, "{files} files");
}

#[test]
fn a_line_that_is_answered_drop_by_drop_is_given_up() {
    let (ask, mut now) = (json!({ "vehicle": 0, "id": 1, "do": "console", "line": "log" }), Instant::now());
    let settings = StampFly::parameters(&StampFly::default_config());
    let (begun, mut station) = (now, Station::new(now, topics(), settings));
    let (mut put, mut answered) = (Vec::new(), None);
    let asked = Asked::parse(&ask.to_string()).expect("an ask");
    station.ask((now, now), Client::of(1), asked, &mut put, &mut |_| ());
    station.poll(now, &mut put, &mut |_| ());
    let (table, number) = question(&put);
    while answered.is_none() && now.duration_since(begun) < Duration::from_secs(600) {
        now += Duration::from_secs(1);
        let drop = frames(table, number, &Payload::Reply { text: "x", last: false });
        station.hear(now, &drop, &mut |said| {
            if let Said::Answer(_, _, answer) = said {
                answered = Some(answer);
            }
        });
    }
    let why = answered.expect("it is given up").expect_err("it is no answer");
    assert!(why.contains("does not end"), "{why}");
    // The longest of a vehicle that means well takes seconds.
    assert!(now.duration_since(begun) >= Duration::from_secs(10));
}
