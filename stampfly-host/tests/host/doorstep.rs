//! Who stands before a vehicle's doors: pages and programs that ask for one thing and say that they
//! are there, and one that only looks.

use serde_json::{Value, json};
use stampfly_link::mavlink::dialects::common::*;
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter};
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::sync::{Arc, Condvar, Mutex};
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

/// Between two looks at what has come.
const LOOK: Duration = Duration::from_millis(20);

/// A page or a program.
pub trait Speaker: Send {
    /// Says that it is there, once.
    fn is_there(&mut self);

    /// Says this, `arm`, `take_off`, `hold` or `kill`.
    fn say(&mut self, what: &str);

    /// The answer to what it has said last, if it is there: was it done?
    fn heard(&mut self) -> Option<bool>;

    /// Between two signs of life.
    fn period(&self) -> Duration;

    /// Does it say when it asks? Otherwise only what comes behind its signs of life shows that it
    /// was held up.
    fn says_time(&self) -> bool;

    /// Time passes, and it is there.
    fn lives(&mut self, time: Duration) {
        let until = Instant::now() + time;
        let mut due = Instant::now();
        while Instant::now() < until {
            if Instant::now() >= due {
                due += self.period();
                self.is_there();
            }
            self.heard();
            std::thread::sleep(LOOK);
        }
    }

    /// Asks for something, while that time passes.
    fn asks(&mut self, what: &str, meanwhile: Duration) {
        self.heard();
        if self.says_time() {
            self.say(what);
        }
        self.live_on(meanwhile);
        if !self.says_time() {
            self.say(what);
        }
    }

    /// Time passes; what has come is not looked at.
    fn live_on(&mut self, time: Duration) {
        let until = Instant::now() + time;
        while Instant::now() < until {
            self.is_there();
            std::thread::sleep(self.period().min(until.saturating_duration_since(Instant::now())));
        }
    }

    /// The answer, within this time.
    fn answer(&mut self, within: Duration) -> Option<bool> {
        let until = Instant::now() + within;
        let mut due = Instant::now() + self.period();
        while Instant::now() < until {
            if let Some(answer) = self.heard() {
                return Some(answer);
            }
            if Instant::now() >= due {
                due += self.period();
                self.is_there();
            }
            std::thread::sleep(LOOK);
        }
        None
    }
}

/// A page, or a program that does what pages do.
pub struct WebProgram {
    socket: WebSocket<TcpStream>,
    says_time: bool,
    /// The server's clock, ms, as it was told, and when.
    clock: (f64, Instant),
    id: u32,
}

impl WebProgram {
    pub fn new(mut socket: WebSocket<TcpStream>, says_time: bool) -> Self {
        let hello = next(&mut socket, "hello");
        socket.get_ref().set_read_timeout(Some(LOOK)).expect("a timeout");
        let now = hello["now"].as_f64().expect("the server's clock");
        Self { socket, says_time, clock: (now, Instant::now()), id: 1 }
    }

    fn send(&mut self, mut what: Value) {
        what["vehicle"] = 0.into();
        if self.says_time {
            let (now, here) = self.clock;
            what["at"] = (now + 1e3 * here.elapsed().as_secs_f64()).round().into();
        }
        // Whose server is gone is told by what it does not hear.
        _ = self.socket.send(Message::text(what.to_string()));
    }
}

impl Speaker for WebProgram {
    fn is_there(&mut self) {
        self.send(json!({ "id": 0, "do": "alive" }));
    }

    fn say(&mut self, what: &str) {
        self.id += 1;
        let mut ask = json!({ "id": self.id, "do": "guided", "kind": what });
        if what == "take_off" {
            ask["height"] = 0.5.into();
        }
        self.send(ask);
    }

    fn heard(&mut self) -> Option<bool> {
        let id = self.id;
        let mut answer = None;
        // All that has come.
        for _ in 0..500 {
            let text = match self.socket.read() {
                Ok(Message::Text(text)) => text,
                Ok(_) => continue,
                Err(_) => break,
            };
            let text: Value = serde_json::from_str(&text).expect("JSON");
            if text["reply"]["id"] == id {
                answer = text["reply"]["ok"].as_bool();
                break;
            }
        }
        answer
    }

    fn period(&self) -> Duration {
        Duration::from_millis(400)
    }

    fn says_time(&self) -> bool {
        self.says_time
    }
}

/// The next text of this kind.
fn next(socket: &mut WebSocket<TcpStream>, kind: &str) -> Value {
    loop {
        if let Message::Text(text) = crate::connect::message(socket) {
            let value: Value = serde_json::from_str(&text).expect("JSON");
            if !value[kind].is_null() {
                return value[kind].clone();
            }
        }
    }
}

enum Way {
    Tcp(TcpStream),
    Udp(UdpSocket, Option<SocketAddr>),
}

/// A ground station that speaks MAVLink, of the number that all of them have.
pub struct MavlinkProgram {
    way: Way,
    writer: MavlinkWriter,
    decoder: MavlinkDecoder<MavMessage>,
    says_time: bool,
    /// What was asked last, until it is answered.
    asked: Option<MavCmd>,
}

impl MavlinkProgram {
    fn new(way: Way) -> Self {
        let (writer, decoder) = (MavlinkWriter::new(255, 190), MavlinkDecoder::new());
        Self { way, writer, decoder, says_time: false, asked: None }
    }

    pub fn tcp(place: &str) -> Self {
        let stream = TcpStream::connect(place).expect("the port listens");
        stream.set_nodelay(true).expect("a stream");
        stream.set_nonblocking(true).expect("a stream");
        Self::new(Way::Tcp(stream))
    }

    /// At this socket, to whoever sends there.
    pub fn udp(socket: UdpSocket) -> Self {
        socket.set_nonblocking(true).expect("a socket");
        Self::new(Way::Udp(socket, None))
    }

    /// To that vehicle, whether or not it sends there.
    pub fn udp_to(vehicle: SocketAddr) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
        socket.set_nonblocking(true).expect("a socket");
        Self::new(Way::Udp(socket, Some(vehicle)))
    }

    /// Where the vehicle is whose datagrams come here.
    pub fn vehicle(&mut self) -> SocketAddr {
        loop {
            self.heard();
            if let Way::Udp(_, Some(vehicle)) = self.way {
                return vehicle;
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Another end of its way says when it asks.
    pub fn timed(mut self) -> Self {
        self.says_time = true;
        self
    }

    fn send(&mut self, message: &MavMessage) {
        let mut room = [0; LONGEST];
        let frame = self.writer.write(MavlinkVersion::V2, message, &mut room).expect("there is room");
        match &mut self.way {
            Way::Tcp(stream) => _ = stream.write_all(frame),
            Way::Udp(socket, Some(vehicle)) => _ = socket.send_to(frame, *vehicle),
            Way::Udp(_, None) => {}
        }
    }
}

impl Speaker for MavlinkProgram {
    fn is_there(&mut self) {
        self.send(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
    }

    fn say(&mut self, what: &str) {
        use MavCmd::{MAV_CMD_COMPONENT_ARM_DISARM, MAV_CMD_NAV_LOITER_UNLIM, MAV_CMD_NAV_TAKEOFF};
        let (command, [param1, param2, param7]) = match what {
            "arm" => (MAV_CMD_COMPONENT_ARM_DISARM, [1.0, 0.0, 0.0]),
            "kill" => (MAV_CMD_COMPONENT_ARM_DISARM, [0.0, 21_196.0, 0.0]),
            "take_off" => (MAV_CMD_NAV_TAKEOFF, [0.0, 0.0, 0.5]),
            _ => (MAV_CMD_NAV_LOITER_UNLIM, [0.0; 3]),
        };
        self.asked = Some(command);
        let data = COMMAND_LONG_DATA { param1, param2, param7, command, ..COMMAND_LONG_DATA::default() };
        self.send(&MavMessage::COMMAND_LONG(COMMAND_LONG_DATA { target_system: 1, target_component: 1, ..data }));
    }

    fn heard(&mut self) -> Option<bool> {
        let (mut part, mut answer) = ([0; 4096], None);
        loop {
            let read = match &mut self.way {
                Way::Tcp(stream) => stream.read(&mut part),
                Way::Udp(socket, vehicle) => socket.recv_from(&mut part).map(|(length, from)| {
                    *vehicle = vehicle.or(Some(from));
                    length
                }),
            };
            let length = match read {
                Ok(0) => return answer,
                Ok(length) => length,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(_) => return answer,
            };
            for byte in &part[..length] {
                let Some(frame) = self.decoder.feed(*byte) else { continue };
                if let Ok(MavMessage::COMMAND_ACK(ack)) = frame.message::<MavMessage>()
                    && Some(ack.command) == self.asked
                    && ack.result != MavResult::MAV_RESULT_IN_PROGRESS
                {
                    self.asked = None;
                    answer = Some(ack.result == MavResult::MAV_RESULT_ACCEPTED);
                }
            }
        }
    }

    fn period(&self) -> Duration {
        Duration::from_secs(1)
    }

    fn says_time(&self) -> bool {
        self.says_time
    }
}

/// What a page has seen that asks for nothing and gives no sign of life.
#[derive(Default)]
struct Seen {
    is_ready: bool,
    armed: bool,
    was_armed: bool,
    has_no_link: bool,
    height: f64,
}

/// Looks at a vehicle through the page of its own program.
pub struct Observer {
    address: String,
    seen: Arc<(Mutex<Seen>, Condvar)>,
}

/// The vehicle is ready, has climbed or has landed by then.
const SOON: Duration = Duration::from_secs(60);

impl Observer {
    pub fn of(mut socket: WebSocket<TcpStream>, address: String) -> Self {
        let hello = next(&mut socket, "hello");
        let topics = ["flight_status", "system_alert", "estimate_state"];
        let ask = json!({ "id": 1, "do": "subscribe", "topics": topics, "rate": 20 });
        socket.send(Message::text(ask.to_string())).expect("sent");
        let seen = Arc::new((Mutex::new(Seen::default()), Condvar::new()));
        let of_thread = seen.clone();
        let [status, alert, estimate] = topics.map(|name| Topic::of(&hello, name));
        std::thread::spawn(move || {
            while let Ok(message) = socket.read() {
                let Message::Text(text) = message else { continue };
                let text: Value = serde_json::from_str(&text).expect("JSON");
                let mut seen = of_thread.0.lock().expect("it does not panic");
                for sample in text["state"][0].as_array().into_iter().flatten().skip(2) {
                    if let Some(armed) = status.number(sample, "armed", 0) {
                        seen.armed = armed > 0.0;
                        seen.was_armed |= seen.armed;
                        let others = status.flags(sample, "blocks") & !status.mask("blocks", "NO_LINK");
                        let on_ground = status.number(sample, "phase", 0) == Some(status.value("phase", "IdleGround"));
                        seen.is_ready = others == 0 && on_ground;
                    }
                    if alert.number(sample, "active", 0).is_some() {
                        seen.has_no_link = alert.flags(sample, "active") & alert.mask("active", "COMM_LOST") != 0;
                    }
                    if let Some(down) = estimate.number(sample, "position", 2) {
                        seen.height = -down;
                    }
                }
                of_thread.1.notify_all();
            }
        });
        Self { address, seen }
    }

    /// Where its page is.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// Waits until that is seen. `false` when it is not within this time.
    fn sees(&self, within: Duration, what: impl Fn(&Seen) -> bool) -> bool {
        let seen = self.seen.0.lock().expect("it does not panic");
        let looked = self.seen.1.wait_timeout_while(seen, within, |seen| !what(seen)).expect("it does not panic");
        !looked.1.timed_out()
    }

    /// Waits until nothing but a link is missing for it to be armed.
    pub fn is_ready(&self) {
        assert!(self.sees(SOON, |seen| seen.is_ready), "it is not ready");
    }

    /// Has it been armed?
    pub fn was_armed(&self) -> bool {
        self.sees(Duration::ZERO, |seen| seen.was_armed)
    }

    /// Waits until it is armed, or is not.
    pub fn is_armed(&self, armed: bool) -> bool {
        self.sees(Duration::from_secs(10), |seen| seen.armed == armed)
    }

    /// Waits until it flies.
    pub fn flies(&self) -> bool {
        self.sees(SOON, |seen| seen.armed && seen.height > 0.3)
    }

    /// Is it more than 0.3 m above the ground now?
    pub fn has_climbed(&self) -> bool {
        self.sees(Duration::ZERO, |seen| seen.armed && seen.height > 0.3)
    }

    /// Has it taken its link for lost?
    pub fn has_no_link(&self, within: Duration) -> bool {
        self.sees(within, |seen| seen.has_no_link)
    }

    /// Waits until its motors may turn.
    pub fn is_flown(&self) -> bool {
        self.is_armed(true)
    }

    /// Does it stand with its motors off, within this time?
    pub fn has_landed_within(&self, time: Duration) -> bool {
        self.sees(time, |seen| !seen.armed && seen.height < 0.2)
    }
}

/// A topic, as its card says.
struct Topic {
    place: u64,
    fields: Vec<Value>,
}

impl Topic {
    fn of(hello: &Value, name: &str) -> Self {
        let topics = hello["vehicles"][0]["topics"].as_array().expect("topics");
        let place = topics.iter().position(|topic| topic["name"] == name).expect("the topic");
        let fields = topics[place]["fields"].as_array().expect("fields").clone();
        Self { place: place as u64, fields }
    }

    fn field(&self, name: &str) -> &Value {
        self.fields.iter().find(|field| field["name"] == name).expect("the field")
    }

    /// A number of a field, if the sample is of this topic.
    fn number(&self, sample: &Value, name: &str, index: usize) -> Option<f64> {
        let before = self.fields.iter().take_while(|field| field["name"] != name);
        let before: u64 = before.map(|field| field["count"].as_u64().expect("a number")).sum();
        // Behind place, number and instant.
        (sample[0] == self.place).then(|| sample[3 + before as usize + index].as_f64())?
    }

    fn flags(&self, sample: &Value, name: &str) -> u64 {
        self.number(sample, name, 0).unwrap_or_default() as u64
    }

    /// The number of a name.
    fn mask(&self, field: &str, name: &str) -> u64 {
        let names = self.field(field)["names"].as_array().expect("names");
        let found = names.iter().find(|pair| pair[0] == name).unwrap_or_else(|| panic!("no {name} in {names:?}"));
        found[1].as_u64().expect("a number")
    }

    fn value(&self, field: &str, name: &str) -> f64 {
        self.mask(field, name) as f64
    }
}
