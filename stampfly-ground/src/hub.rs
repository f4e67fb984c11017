//! What flights and sockets share: cards, newest samples, asks on their way to a vehicle, answers
//! on their way to a page.
//!
//! A flight's thread uses [`Hub::witness`], [`Hub::asks`], [`Hub::answer`], [`Hub::tell_all`] and
//! [`Hub::provide_log`]; none of them waits for a socket. Time is the server's clock, an argument:
//! a browser has another than a computer. Every queue is bounded: a vehicle that does not look is
//! sent no more asks, a client that does not read its answers is cut off.
//!
//! ```
//! use stampfly_board::simulation::StampFly;
//! use stampfly_ground::{Hub, Reply, VehicleCard, ask::Asked};
//! use stampfly_sim::vehicle::Vehicle;
//!
//! let hub = Hub::new(vec![VehicleCard::of::<StampFly>("StampFly 1", &StampFly::default_config()).offering(&["guided"])]);
//! // A socket:
//! let page = hub.connect();
//! let asked = Asked::parse(r#"{"vehicle":0,"id":1,"do":"guided","kind":"arm"}"#).unwrap();
//! let now = std::time::Duration::from_secs(1);
//! hub.ask(page.client(), asked, now).unwrap();
//! // The flight's thread:
//! for (client, asked) in hub.asks(0, now) {
//!     hub.answer(client, &asked, Ok(Reply::text("on its way")));
//! }
//! assert!(page.take()[0].contains("on its way"));
//! ```

use crate::ask::{Ask, Asked, Guided, Reply, reply_text};
use crate::card::{self, TopicCard, VehicleCard};
use crate::newest::{Newest, Watch};
use serde::Serialize;
use serde_json::{Value, json};
use stampfly_types::Instant;
use std::collections::VecDeque;
use std::fmt;
use std::io::{self, Read};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Asks that wait for one vehicle.
const ASKS: usize = 192;
/// More of them, for those that stop motors.
const ROOM_TO_STOP: usize = 64;
/// Most sessions that the hub remembers. A page whose session was dropped for newer ones starts a
/// new session.
const SESSIONS: usize = 64;
/// Most clients that have left and that a vehicle has not been told of.
const CLIENTS: usize = 256;
/// Texts that wait for one client.
const TEXTS: usize = 512;
/// Events that a page which comes later is told.
const EVENTS: usize = 64;

/// Greatest age of an ask when the vehicle takes it; the hub refuses an older one, because the
/// person who clicked has seen by then that nothing happened. Half of it is for a slow network, half
/// for a slow simulation.
pub const FRESH: Duration = Duration::from_secs(1);
/// A page whose clock is ahead of the server's by more counts wrongly.
const AHEAD: Duration = Duration::from_millis(100);

/// Who asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Client(u64);

impl Client {
    /// Its number: no two clients of a hub have the same.
    #[must_use]
    pub const fn number(self) -> u64 {
        self.0
    }

    /// The client of this number.
    #[must_use]
    pub const fn of(number: u64) -> Self {
        Self(number)
    }
}

/// What all pages are told.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Event {
    /// Something to read.
    Text {
        /// A sentence.
        text: String,
    },
    /// A parameter has changed.
    Parameter {
        /// Its name.
        name: String,
        /// Its value now.
        value: f64,
    },
    /// The vehicle is heard, or is not any more. Nothing is over: it may come again.
    Link {
        /// Is it heard?
        up: bool,
        /// What has happened.
        text: String,
    },
    /// Who commands has changed. Pages that come later are told with the first text.
    Commander {
        /// In words; empty when no program does.
        who: String,
        /// The number of its page, if it is one.
        page: Option<u64>,
    },
    /// Virtual time runs this much faster than the wall's.
    Speed {
        /// 0 while it stands.
        factor: f32,
    },
    /// The flight is over; nothing more will come of this vehicle.
    Ended {
        /// How it went.
        text: String,
    },
}

/// Why an ask did not reach a vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NotAsked {
    /// There is no such vehicle.
    NoVehicle,
    /// It does not carry this out.
    NotOffered,
    /// It has not looked at those before.
    Busy,
    /// It was asked more than a second ago, and is not done.
    Late,
    /// It was asked in the future.
    Early,
}

impl fmt::Display for NotAsked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoVehicle => "there is no such vehicle",
            Self::NotOffered => "this vehicle does not offer it",
            Self::Busy => "the vehicle does not answer",
            Self::Late => "expired: it came more than a second late, and was not done",
            Self::Early => "its time is in the future",
        })
    }
}

impl std::error::Error for NotAsked {}

/// A log as far as it is written.
pub struct LogSoFar {
    /// Bytes.
    pub length: u64,
    /// All of them.
    pub bytes: Box<dyn Read + Send>,
}

impl fmt::Debug for LogSoFar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LogSoFar").field("length", &self.length).finish_non_exhaustive()
    }
}

type LogSource = Box<dyn Fn() -> io::Result<LogSoFar> + Send + Sync>;

/// An ask on its way, and since when.
struct Waiting {
    client: Client,
    asked: Asked,
    since: Duration,
}

impl Waiting {
    fn is_late(&self, now: Duration) -> bool {
        !self.asked.ask.is_never_late() && now.saturating_sub(self.since) > FRESH
    }
}

struct Shared {
    card: Mutex<VehicleCard>,
    topics: Arc<[TopicCard]>,
    newest: Arc<Newest>,
    asks: Mutex<VecDeque<Waiting>>,
    log: Mutex<Option<Arc<LogSource>>>,
    /// Who commands, as pages were told last.
    commander: Mutex<Value>,
    /// Card and commander as a text, until one of them changes. To make it anew for each page takes
    /// a megabyte for a moment, in every page's thread.
    introduction: Mutex<Option<Arc<str>>>,
    /// Clients that have gone, and that the vehicle was not told of.
    gone: Mutex<Vec<Client>>,
    /// Sticks that found the queue full.
    sticks_lost: AtomicU64,
}

impl Shared {
    fn introduction(&self, number: usize) -> Arc<str> {
        let mut text = lock(&self.introduction);
        let made = text.get_or_insert_with(|| {
            let mut card = lock(&self.card).json(number);
            card["commander"] = lock(&self.commander).clone();
            card.to_string().into()
        });
        made.clone()
    }
}

/// See the module.
pub struct Hub {
    vehicles: Vec<Shared>,
    clients: Mutex<Vec<Arc<Outbox>>>,
    events: Mutex<VecDeque<Arc<str>>>,
    next: AtomicU64,
    /// Sessions of clients, newest last.
    sessions: Mutex<VecDeque<(Arc<str>, Client)>>,
}

impl fmt::Debug for Hub {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Hub").field("vehicles", &self.vehicles.len()).finish_non_exhaustive()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // What is in them is whole at any time.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Hub {
    /// For these vehicles, numbered from 0.
    #[must_use]
    pub fn new(cards: Vec<VehicleCard>) -> Arc<Self> {
        let vehicles = cards.into_iter().map(|card| {
            let newest = Newest::new(card.topics.iter().map(|topic| topic.words), card.on_bus);
            Shared {
                topics: card.topics.clone().into(),
                newest: Arc::new(newest),
                card: Mutex::new(card),
                asks: Mutex::default(),
                log: Mutex::default(),
                commander: Mutex::new(json!({ "who": "", "page": null })),
                introduction: Mutex::default(),
                gone: Mutex::default(),
                sticks_lost: AtomicU64::new(0),
            }
        });
        Arc::new(Self {
            vehicles: vehicles.collect(),
            clients: Mutex::default(),
            events: Mutex::default(),
            next: AtomicU64::new(1),
            sessions: Mutex::default(),
        })
    }

    /// How many vehicles there are.
    #[must_use]
    pub fn vehicles(&self) -> usize {
        self.vehicles.len()
    }

    /// Keeps the newest samples of this vehicle for the pages; `None` when there is no such
    /// vehicle.
    #[must_use]
    pub fn witness(&self, vehicle: usize) -> Option<Watch> {
        Some(Watch(self.vehicles.get(vehicle)?.newest.clone()))
    }

    /// The topics of this vehicle, by their places in its card, that pages have looked for since
    /// the last call.
    #[must_use]
    pub fn looked_at(&self, vehicle: usize) -> Vec<usize> {
        self.vehicles.get(vehicle).map(|shared| shared.newest.looked()).unwrap_or_default()
    }

    /// What this vehicle has been asked since the last call, oldest first, with who asked. Of a
    /// client's sticks only the newest are left where nothing else came between. What has become
    /// [late](FRESH) meanwhile is refused here, and is not among them.
    #[must_use]
    pub fn asks(&self, vehicle: usize, now: Duration) -> Vec<(Client, Asked)> {
        let Some(shared) = self.vehicles.get(vehicle) else { return Vec::new() };
        let waiting = core::mem::take(&mut *lock(&shared.asks));
        let (late, fresh): (Vec<_>, Vec<_>) = waiting.into_iter().partition(|waiting| waiting.is_late(now));
        for Waiting { client, asked, .. } in late.iter().filter(|waiting| !waiting.asked.ask.is_repeated()) {
            self.answer(*client, asked, Err(NotAsked::Late.to_string()));
        }
        fresh.into_iter().map(|Waiting { client, asked, .. }| (client, asked)).collect()
    }

    /// Clients that have gone since the last call. What they have asked before is among the asks of
    /// a call before this one.
    #[must_use]
    pub fn gone(&self, vehicle: usize) -> Vec<Client> {
        self.vehicles.get(vehicle).map(|shared| core::mem::take(&mut *lock(&shared.gone))).unwrap_or_default()
    }

    /// Answers an ask. A client that has gone gets nothing.
    pub fn answer(&self, client: Client, asked: &Asked, answer: Result<Reply, String>) {
        self.answer_to(client, Some(asked.vehicle), asked.id, answer);
    }

    /// Answers what came with this id; without a vehicle, whoever connects the page answers.
    pub fn answer_to(&self, client: Client, vehicle: Option<usize>, id: u32, answer: Result<Reply, String>) {
        self.send(client, &reply_text(vehicle, id, answer));
    }

    /// Sends a client a text that is JSON already, such as [`Asked::answered`]. One that has gone
    /// gets nothing.
    pub fn send(&self, client: Client, text: &str) {
        let clients = lock(&self.clients);
        if let Some(outbox) = clients.iter().find(|outbox| outbox.client() == client) {
            outbox.put(text.into());
        }
    }

    /// Tells all pages, and those that come later as far as it is among the last sixty-four events.
    /// A parameter's new value is on the card from now on, and so is who commands.
    pub fn tell_all(&self, vehicle: usize, event: &Event) {
        let Some(shared) = self.vehicles.get(vehicle) else { return };
        if let Event::Parameter { name, value } = event {
            let mut card = lock(&shared.card);
            if let Some(row) = card.parameters.iter_mut().find(|row| row.setting.name == name) {
                row.value = *value;
            }
        }
        if let Event::Commander { who, page } = event {
            *lock(&shared.commander) = json!({ "who": who, "page": page });
        }
        if matches!(event, Event::Parameter { .. } | Event::Commander { .. }) {
            *lock(&shared.introduction) = None;
        }
        let mut body = serde_json::to_value(event).unwrap_or_default();
        body["vehicle"] = vehicle.into();
        body["at"] = seconds(shared.newest.clock()).into();
        let text: Arc<str> = json!({ "event": body }).to_string().into();
        if !matches!(event, Event::Parameter { .. } | Event::Commander { .. }) {
            let mut events = lock(&self.events);
            if events.len() >= EVENTS {
                events.pop_front();
            }
            events.push_back(text.clone());
        }
        lock(&self.clients).iter().for_each(|outbox| outbox.put(text.clone()));
    }

    /// Where the log of this vehicle so far comes from: a ULog file.
    pub fn provide_log(&self, vehicle: usize, source: impl Fn() -> io::Result<LogSoFar> + Send + Sync + 'static) {
        if let Some(shared) = self.vehicles.get(vehicle) {
            *lock(&shared.log) = Some(Arc::new(Box::new(source)));
        }
    }

    /// The log of this vehicle so far. `None` when there is none.
    ///
    /// # Errors
    /// When it cannot be read.
    #[must_use]
    pub fn log(&self, vehicle: usize) -> Option<io::Result<LogSoFar>> {
        let source = lock(&self.vehicles.get(vehicle)?.log).clone()?;
        Some(source())
    }

    /// Sticks that this vehicle has lost because it did not look.
    #[must_use]
    pub fn sticks_lost(&self, vehicle: usize) -> u64 {
        self.vehicles.get(vehicle).map_or(0, |shared| shared.sticks_lost.load(Ordering::Relaxed))
    }

    /// A client has come that can come again: who knows this session, which is random, is the same
    /// client.
    pub fn connect_as(self: &Arc<Self>, session: &str) -> Connection {
        let connection = self.connect();
        let mut sessions = lock(&self.sessions);
        if sessions.len() >= SESSIONS {
            sessions.pop_front();
        }
        sessions.push_back((session.into(), connection.client()));
        drop(sessions);
        connection
    }

    /// The client of this session has come again, by this connection. Its connection before, if
    /// there still is one, is cut off. `false` when no such session is known.
    pub fn resume(&self, connection: &Connection, session: &str) -> bool {
        let sessions = lock(&self.sessions);
        let Some((_, client)) = sessions.iter().find(|(known, _)| **known == *session) else { return false };
        let clients = lock(&self.clients);
        for outbox in clients.iter().filter(|outbox| outbox.client() == *client) {
            outbox.number.store(0, Ordering::Relaxed);
            outbox.overflown.store(true, Ordering::Relaxed);
        }
        connection.outbox.number.store(client.0, Ordering::Relaxed);
        true
    }

    /// A client has come. It is told the events so far.
    pub fn connect(self: &Arc<Self>) -> Connection {
        let client = Client(self.next.fetch_add(1, Ordering::Relaxed));
        let texts = lock(&self.events).iter().cloned().collect();
        let number = AtomicU64::new(client.0);
        let outbox = Arc::new(Outbox { number, texts: Mutex::new(texts), overflown: AtomicBool::new(false) });
        lock(&self.clients).push(outbox.clone());
        Connection { hub: self.clone(), outbox }
    }

    /// Puts an ask into the vehicle's queue.
    ///
    /// # Errors
    /// [`NotAsked`].
    pub fn ask(&self, client: Client, asked: Asked, now: Duration) -> Result<(), NotAsked> {
        let since = asked.at.map_or(now, |ms| Duration::from_secs_f64(ms / 1e3));
        self.ask_since(client, asked, since, now)
    }

    /// The same for one that was asked then, whatever it says itself.
    ///
    /// # Errors
    /// [`NotAsked`].
    pub fn ask_since(&self, client: Client, asked: Asked, since: Duration, now: Duration) -> Result<(), NotAsked> {
        let shared = self.vehicles.get(asked.vehicle).ok_or(NotAsked::NoVehicle)?;
        if !lock(&shared.card).does_offer(&asked.ask) {
            return Err(NotAsked::NotOffered);
        }
        let stops = asked.ask.is_never_late() || matches!(asked.ask, Ask::Guided(Guided::Disarm {}));
        let is_sticks = matches!(asked.ask, Ask::Sticks(_));
        let waiting = Waiting { client, asked, since };
        if waiting.is_late(now) {
            return Err(NotAsked::Late);
        }
        if since > now + AHEAD && !stops {
            return Err(NotAsked::Early);
        }
        let mut asks = lock(&shared.asks);
        if let Ask::Sticks(new) = waiting.asked.ask
            && let Some(Waiting { client: last, asked: Asked { ask: Ask::Sticks(before), .. }, since: before_since }) =
                asks.back_mut()
            && *last == client
            && !before.kill
            // A switch that was thrown is to be seen in both positions.
            && (before.arm, before.mode) == (new.arm, new.mode)
        {
            (*before, *before_since) = (new, since);
            return Ok(());
        }
        let room = ASKS + if stops { ROOM_TO_STOP } else { 0 };
        if asks.len() < room {
            asks.push_back(waiting);
            return Ok(());
        }
        if is_sticks {
            shared.sticks_lost.fetch_add(1, Ordering::Relaxed);
        }
        Err(NotAsked::Busy)
    }

    /// The first thing a page is told.
    #[must_use]
    pub fn hello(&self, page: Client, session: &str, now: Duration) -> String {
        static WORDS: LazyLock<String> = LazyLock::new(|| card::words().to_string());
        let vehicles: Vec<_> =
            self.vehicles.iter().enumerate().map(|(number, shared)| shared.introduction(number)).collect();
        let (vehicles, words, version) = (vehicles.join(","), &*WORDS, env!("CARGO_PKG_VERSION"));
        let page = json!({ "number": page.number(), "session": session });
        let now = json!(now.as_secs_f64() * 1e3);
        format!(
            r#"{{"hello":{{"version":"{version}","page":{page},"now":{now},"vehicles":[{vehicles}],"words":{words}}}}}"#
        )
    }

    /// Of each vehicle: its newest samples, and what their words mean.
    pub fn samples(&self) -> impl Iterator<Item = (&Newest, &[TopicCard])> {
        self.vehicles.iter().map(|shared| (&*shared.newest, &*shared.topics))
    }
}

fn seconds(at: Instant) -> f64 {
    at.as_micros() as f64 * 1e-6
}

/// Texts on their way to one client.
#[derive(Debug)]
struct Outbox {
    /// Who it is; 0 once another connection is.
    number: AtomicU64,
    texts: Mutex<VecDeque<Arc<str>>>,
    overflown: AtomicBool,
}

impl Outbox {
    fn client(&self) -> Client {
        Client(self.number.load(Ordering::Relaxed))
    }

    fn put(&self, text: Arc<str>) {
        let mut texts = lock(&self.texts);
        if texts.len() < TEXTS {
            texts.push_back(text);
        } else {
            self.overflown.store(true, Ordering::Relaxed);
        }
    }
}

/// A client that is connected; dropped, it has gone.
#[derive(Debug)]
pub struct Connection {
    hub: Arc<Hub>,
    outbox: Arc<Outbox>,
}

impl Connection {
    /// Who it is.
    #[must_use]
    pub fn client(&self) -> Client {
        self.outbox.client()
    }

    /// What it is to be sent.
    #[must_use]
    pub fn take(&self) -> Vec<Arc<str>> {
        lock(&self.outbox.texts).drain(..).collect()
    }

    /// Has something been lost, because nobody took it? Then it has to be cut off: an answer must
    /// not be missing unnoticed.
    #[must_use]
    pub fn has_overflown(&self) -> bool {
        self.outbox.overflown.load(Ordering::Relaxed)
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        lock(&self.hub.clients).retain(|outbox| !Arc::ptr_eq(outbox, &self.outbox));
        let client = self.outbox.client();
        if client.0 == 0 {
            return;
        }
        for vehicle in &self.hub.vehicles {
            let mut gone = lock(&vehicle.gone);
            // A vehicle that does not look forgets the first.
            if gone.len() >= CLIENTS {
                gone.remove(0);
            }
            gone.push(client);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ask::NAMES;
    use stampfly_board::simulation::StampFly;
    use stampfly_sim::vehicle::Vehicle;

    fn hub() -> Arc<Hub> {
        let card = |name| VehicleCard::of::<StampFly>(name, &StampFly::default_config()).offering(NAMES);
        Hub::new(vec![card("one"), card("two")])
    }

    const NOW: Duration = Duration::from_secs(100);

    fn asked(vehicle: usize, rest: &str) -> Asked {
        Asked::parse(&format!(r#"{{"vehicle":{vehicle},"id":5,{rest}}}"#)).expect("an ask")
    }

    const STICKS: &str =
        r#""do":"sticks","roll":0,"pitch":0,"yaw":0,"throttle":0,"mode":"poshold","arm":false,"kill":false"#;

    #[test]
    fn asks_reach_their_vehicle_and_answers_their_client() {
        let hub = hub();
        let (first, second) = (hub.connect(), hub.connect());
        hub.ask(second.client(), asked(1, r#""do":"param_save""#), NOW).expect("room");
        assert_eq!(hub.asks(0, NOW), []);
        let asks = hub.asks(1, NOW);
        assert_eq!(asks, [(second.client(), asked(1, r#""do":"param_save""#))]);
        hub.answer(asks[0].0, &asks[0].1, Err("no flash".into()));
        assert!(first.take().is_empty());
        let texts = second.take();
        let reply: Value = serde_json::from_str(&texts[0]).expect("JSON");
        assert_eq!(reply["reply"], json!({ "vehicle": 1, "id": 5, "ok": false, "text": "no flash", "value": null }));
        assert_eq!(hub.ask(first.client(), asked(2, r#""do":"param_save""#), NOW), Err(NotAsked::NoVehicle));
    }

    #[test]
    fn a_page_that_comes_again_is_the_same_client_and_no_other_can_be() {
        let hub = hub();
        let first = hub.connect_as("a secret");
        let number = first.client();
        let again = hub.connect_as("another");
        assert!(!hub.resume(&again, "a guess") && again.client() != number);
        assert!(hub.resume(&again, "a secret") && again.client() == number);
        assert!(first.has_overflown(), "it is cut off");
        drop(first);
        assert_eq!(hub.gone(0), [], "the client is there");
        hub.send(number, "{}");
        assert_eq!(again.take().len(), 1);
        drop(again);
        assert_eq!(hub.gone(0), [number]);
    }

    #[test]
    fn what_was_held_up_is_refused_and_what_stops_a_vehicle_is_not() {
        let hub = hub();
        let page = hub.connect();
        let second = Duration::from_secs(1);
        let arm = r#""do":"guided","kind":"arm""#;
        let since = |rest, age: Duration| hub.ask_since(page.client(), asked(0, rest), NOW - age, NOW);
        let kill = STICKS.replace(r#""kill":false"#, r#""kill":true"#);
        let stops = [r#""do":"guided","kind":"kill""#, r#""do":"guided","kind":"land""#, r#""do":"motor_stop""#, &kill];
        for age in [3 * second / 2, 5 * second, 20 * second] {
            for rest in [arm, STICKS, r#""do":"alive""#, r#""do":"console","line":"reboot""#] {
                assert_eq!(since(rest, age), Err(NotAsked::Late), "{rest} after {age:?}");
            }
            for rest in stops {
                assert_eq!(since(rest, age), Ok(()), "{rest} after {age:?}");
            }
        }
        assert_eq!(since(arm, second / 2), Ok(()));
        assert_eq!(hub.ask(page.client(), Asked { at: Some(100_500.0), ..asked(0, arm) }, NOW), Err(NotAsked::Early));
        assert_eq!(hub.ask(page.client(), Asked { at: Some(99_500.0), ..asked(1, arm) }, NOW), Ok(()));
        assert_eq!(hub.asks(1, NOW).len(), 1);

        // A vehicle that has not looked for too long.
        hub.ask(page.client(), asked(1, arm), NOW - 3 * second).expect("fresh then");
        assert_eq!(hub.asks(1, NOW), []);
        let text = page.take().pop().expect("an answer");
        assert!(text.contains("expired") && text.contains("\"ok\":false"), "{text}");
    }

    #[test]
    fn what_a_card_does_not_offer_is_refused() {
        let hub = Hub::new(vec![VehicleCard::of::<StampFly>("one", &StampFly::default_config()).offering(&["guided"])]);
        let page = hub.connect();
        assert_eq!(hub.ask(page.client(), asked(0, r#""do":"param_save""#), NOW), Err(NotAsked::NotOffered));
        hub.ask(page.client(), asked(0, r#""do":"guided","kind":"arm""#), NOW).expect("offered");
    }

    #[test]
    fn a_full_queue_still_takes_what_stops_motors() {
        let hub = hub();
        let page = hub.connect();
        let ask = |rest| hub.ask(page.client(), asked(0, rest), NOW);
        while ask(r#""do":"param_save""#).is_ok() {}
        assert_eq!(ask(STICKS), Err(NotAsked::Busy));
        assert_eq!(hub.sticks_lost(0), 1);
        ask(r#""do":"guided","kind":"kill""#).expect("room to stop");
        assert_eq!(hub.asks(0, NOW).len(), ASKS + 1);
        ask(STICKS).expect("room again");
    }

    #[test]
    fn only_the_newest_sticks_wait_but_a_kill_stays() {
        let hub = hub();
        let page = hub.connect();
        let kill = STICKS.replace(r#""kill":false"#, r#""kill":true"#);
        for rest in [STICKS, STICKS, &kill, STICKS, STICKS] {
            hub.ask(page.client(), asked(0, rest), NOW).expect("room");
        }
        let kills: Vec<bool> =
            hub.asks(0, NOW).iter().map(|(_, asked)| matches!(asked.ask, Ask::Sticks(sticks) if sticks.kill)).collect();
        assert_eq!(kills, [true, false]);
    }

    #[test]
    fn an_arm_switch_that_was_thrown_is_seen_in_both_positions() {
        let hub = hub();
        let page = hub.connect();
        let armed = STICKS.replace(r#""arm":false"#, r#""arm":true"#);
        for rest in [STICKS, STICKS, &armed, &armed, STICKS] {
            hub.ask(page.client(), asked(0, rest), NOW).expect("room");
        }
        let switch: Vec<bool> =
            hub.asks(0, NOW).iter().map(|(_, asked)| matches!(asked.ask, Ask::Sticks(sticks) if sticks.arm)).collect();
        assert_eq!(switch, [false, true, false]);
    }

    #[test]
    fn a_client_that_takes_nothing_overflows_and_stops_nobody() {
        let hub = hub();
        let (deaf, well) = (hub.connect(), hub.connect());
        for _ in 0..=TEXTS {
            hub.tell_all(0, &Event::Text { text: "gust".into() });
            let _ = well.take();
        }
        assert!(deaf.has_overflown() && !well.has_overflown());
        drop(deaf);
        assert_eq!(lock(&hub.clients).len(), 1);
        assert_eq!(hub.connect().take().len(), EVENTS, "the newest events of the past");
    }

    #[test]
    fn a_page_that_comes_later_is_told_who_commands() {
        let hub = hub();
        let (first, told) = (hub.connect(), |hub: &Hub| {
            let hello: Value = serde_json::from_str(&hub.hello(Client::of(1), "", NOW)).expect("JSON");
            hello["hello"]["vehicles"][1]["commander"].clone()
        });
        assert_eq!(told(&hub), json!({ "who": "", "page": null }));
        hub.tell_all(1, &Event::Commander { who: "page 7".into(), page: Some(7) });
        assert!(first.take()[0].contains(r#""kind":"commander""#));
        assert_eq!(told(&hub), json!({ "who": "page 7", "page": 7 }));
        assert!(hub.connect().take().is_empty(), "no event of the past");
        hub.tell_all(1, &Event::Commander { who: String::new(), page: None });
        assert_eq!(told(&hub), json!({ "who": "", "page": null }));
    }

    #[test]
    fn a_changed_parameter_is_on_the_card() {
        let hub = hub();
        hub.tell_all(1, &Event::Parameter { name: "eskf.gate".into(), value: 3.5 });
        let hello: Value = serde_json::from_str(&hub.hello(Client::of(1), "", NOW)).expect("JSON");
        let value = |vehicle: usize| {
            let rows = hello["hello"]["vehicles"][vehicle]["parameters"].as_array().expect("rows");
            rows.iter().find(|row| row["name"] == "eskf.gate").map(|row| row["value"].clone())
        };
        assert_ne!(value(0), value(1));
        assert_eq!(value(1), Some(json!(3.5)));
        assert!(hub.connect().take().is_empty(), "no event of the past");
    }
}
