//! `stampfly connect`: the ground station of a real vehicle, at a serial port, behind TCP or in a
//! Wi-Fi network.
//!
//! | part | what it does |
//! |---|---|
//! | [`Place`] | where the line is, and how it is opened |
//! | [`RadioPlace`] | where a vehicle in a network is, and the sealed frames that go there |
//! | `way.rs` | one or the other |
//! | `crew.rs` | which page and which program commands |
//! | `talk.rs`, `budget.rs` | what pages are told, and how often |
//! | `translation.rs` | what a cable says and what those frames say |
//! | `questions.rs` | parameters and lines, asked until they are answered |
//! | `unanswered.rs` | commands of programs that wait for the vehicle's answer |
//! | [`station`] | what pages ask → frames; frames → samples and answers |
//! | [`Bridge`] | a thread between the line, the page's hub and MAVLink's ports |
//!
//! A line that is gone is opened again, for as long as it takes: vehicles are restarted, and cables
//! pulled out. Pages are told.

mod budget;
mod crew;
mod log;
mod orders;
mod place;
mod questions;
mod record;
mod sealed;
pub mod station;
mod talk;
mod translation;
mod unanswered;
mod way;

pub use place::{Line, Place, PlaceError};
pub use sealed::{RadioPlace, RadioPlaceError};

use crate::ground;
use crate::serve::OpenPorts;
use budget::Budget;
use crew::Crew;
use log::Log;
use record::Record;
use stampfly_bus::{Schedule, TopicInfo, TopicTable};
use stampfly_ground::ask::{Ask, Asked};
use stampfly_ground::{Client as PageClient, Event, Hub, Watch};
use stampfly_link::mavlink::dialects::common::{
    COMMAND_ACK_DATA, HEARTBEAT_DATA, MavMessage, MavResult, STATUSTEXT_DATA,
};
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkFrame, MavlinkVersion, MavlinkWriter, MessageData as _};
use stampfly_link::secure::Key;
use stampfly_services::mavlink::{Pulse, ends_a_flight};
use stampfly_services::{Asked as Done, CommandNotice, Requester};
use stampfly_sim::vehicle::{Client, Heard, PortSpec, Ports as _, Setting, Vehicle};
use stampfly_types::Message as _;
use stampfly_types::messages::{FlightStatus, GuidedCommand};
use station::{Said, Station};
use std::collections::{BTreeMap, HashMap};
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};
use talk::Talk;
use translation::VEHICLE;
use unanswered::{Unanswered, answer, command};
use way::{Open, Way};

/// Where other programs find the vehicle.
pub const PORTS: &[PortSpec] = &[
    PortSpec::PAGE,
    PortSpec::MAVLINK_UDP,
    // A port that every program of this machine can open is there when it is wanted.
    PortSpec { when_named: true, ..PortSpec::MAVLINK_TCP },
];
/// The vehicle's page and hub have one vehicle.
const ONLY: usize = 0;
/// A line that cannot be opened is tried again after this long.
const AGAIN: Duration = Duration::from_millis(500);
/// A vehicle that says nothing for this long is not there.
const SILENCE: Duration = Duration::from_secs(2);
/// What a program has said behind a network that held it up may be as old as this.
const HELD: Duration = Duration::from_secs(10);
/// Why an ask does not go to the vehicle.
const NOT_HEARD: &str = "nothing is heard of the vehicle: it was not sent";
/// How often it is looked what pages show.
const LOOK: Duration = Duration::from_millis(200);
/// What pages do not show any more is sent for so long still: they draw in bursts.
const SHOWN: Duration = Duration::from_secs(2);
/// How often the vehicle is told again what to send: it may have been restarted.
const TOLD: Duration = Duration::from_secs(1);
/// Of a topic, between two samples, ms.
const PERIOD: u16 = 40;
/// Bytes of the line read at once.
const PART: usize = 4096;
/// A vehicle starts anew once a second at most, and begins a file then: some at once, because a line
/// that was held up brings several starts together.
const STARTS: Budget = Budget::new(4, stampfly_types::Duration::from_secs(1));

/// How the line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Not open.
    Away,
    /// Open, and silent.
    Silent,
    /// The vehicle is heard.
    Up,
}

/// A program at MAVLink's ports.
struct Program {
    /// The frame that it is in the middle of.
    decoder: MavlinkDecoder<MavMessage>,
    /// Whether what it says was held up on its way here.
    pulse: Pulse,
    unanswered: Unanswered,
}

impl Program {
    /// One that has come now.
    fn new(now: stampfly_types::Instant) -> Self {
        Self { decoder: MavlinkDecoder::new(), pulse: Pulse::new(now), unanswered: Unanswered::default() }
    }
}

/// What is made of what the vehicle says.
struct Ends<V: Vehicle> {
    hub: Arc<Hub>,
    watch: Watch,
    ports: Arc<OpenPorts>,
    /// Who is connected at MAVLink's ports.
    programs: HashMap<Client, Program>,
    /// As the vehicle says, as far as it has.
    settings: Vec<Setting>,
    known: Vec<bool>,
    folder: PathBuf,
    log: Option<Log<V>>,
    logs: usize,
    crew: Crew,
    /// Answers programs that another keeps out.
    answers: MavlinkWriter,
    talk: Talk,
    may_log: Budget,
    /// The place of `flight_status` among the topics.
    status: Option<usize>,
    /// The flight record, if it is wanted.
    record: Option<Record>,
    /// Time since it began.
    now: stampfly_types::Instant,
    /// The vehicle's newest instant.
    clock: stampfly_types::Instant,
    /// It has started anew.
    restarted: bool,
}

/// What there was.
#[derive(Debug)]
pub struct Carried {
    /// Was the vehicle ever heard?
    pub was_heard: bool,
    /// Chunks of the flight record that have come, and that are missing between them, if it was
    /// wanted; or why it is not in the file.
    pub record: Option<std::io::Result<[u64; 2]>>,
}

/// Between a line, pages and programs.
pub struct Bridge<V: Vehicle> {
    way: Way,
    station: Station,
    ends: Ends<V>,
    state: State,
    begun: Instant,
    /// The topics that are shown, and when they were last.
    shown: BTreeMap<usize, Instant>,
}

fn topics<V: Vehicle>() -> &'static [TopicInfo] {
    <<V::Runnables as Schedule>::Topics as TopicTable>::TOPICS
}

/// The vehicle is started anew when its clock goes back by more than samples may pass each other.
const BACK: stampfly_types::Duration = stampfly_types::Duration::from_millis(500);

impl<V: Vehicle> Ends<V> {
    fn take(&mut self, said: Said<'_>) {
        match said {
            Said::Sample(topic, at, words) => self.sample(topic, at, words),
            Said::Answer(client, asked, answer) => {
                // What is said again and again needs no answer.
                if !matches!(asked.ask, Ask::Sticks(_) | Ask::Alive {}) {
                    self.hub.answer(client, &asked, answer);
                }
            }
            Said::Parameter(index, value) => self.parameter(index, value),
            Said::Chunk(chunk) => self.chunk(chunk),
            Said::Frame(frame) => {
                if frame.id == COMMAND_ACK_DATA::ID
                    && let Ok(MavMessage::COMMAND_ACK(ack)) = frame.message()
                {
                    self.programs.values_mut().for_each(|program| program.unanswered.hears(&ack));
                }
                self.programs.keys().for_each(|client| self.ports.send(client, frame.bytes()));
                if let Some(text) = told(frame) {
                    self.talk.text(self.now, text);
                }
            }
            Said::Text(text) => self.talk.text(self.now, text),
            Said::Foreign => {
                let text =
                    "its firmware is not of this program's version: it can be killed from here, and nothing else";
                self.hub.tell_all(ONLY, &Event::Link { up: false, text: text.into() });
            }
        }
    }

    fn chunk(&mut self, chunk: &[u8]) {
        if let Some(record) = &mut self.record
            && let Err(error) = record.take(self.now, chunk)
        {
            self.talk.text(self.now, format!("the flight record: {error}"));
        }
    }

    fn sample(&mut self, topic: usize, at: stampfly_types::Instant, words: &[u32]) {
        if topics::<V>().get(topic).is_none_or(|info| info.words != words.len()) {
            return;
        }
        if at + BACK < self.clock {
            self.log.take().into_iter().for_each(Log::end);
            self.watch.restarted();
            self.known.fill(false);
            (self.clock, self.restarted) = (at, true);
        }
        self.clock = self.clock.max(at);
        self.watch.note(topic, at, words);
        let status = || words.try_into().ok().and_then(FlightStatus::from_words);
        if Some(topic) == self.status
            && let Some(status) = status()
        {
            self.crew.see(status);
        }
        if let Some(log) = &mut self.log {
            log.note(topic, at, words);
        }
    }

    fn parameter(&mut self, index: usize, value: f32) {
        let value = f64::from(value);
        let Some((setting, known)) = self.settings.get_mut(index).zip(self.known.get_mut(index)) else { return };
        let is_news = !*known || setting.value != value;
        (setting.value, *known) = (value, true);
        if is_news {
            self.talk.parameter(self.now, index, &self.settings);
        }
    }

    /// Begins a log, when there is none and all parameters are known: the log says how it flew.
    fn begin_log(&mut self) {
        if self.log.is_none() && self.known.iter().all(|known| *known) && self.may_log.takes(self.now) {
            match Log::begin(&self.folder, self.logs, &self.settings, topics::<V>().len()) {
                Ok(log) => {
                    let file = log.file.clone();
                    self.hub.provide_log(ONLY, move || file.so_far());
                    (self.log, self.logs) = (Some(log), self.logs + 1);
                }
                Err(text) => self.talk.text(self.now, text),
            }
        }
    }

    /// Passes on what programs say in MAVLink, frame by frame, so that none lies within another. An
    /// order goes with the time at which it was said, as far as this end knows. Without a line an
    /// order is refused.
    fn programs(&mut self, now: stampfly_types::Instant, station: &mut Station, mut line: Option<&mut Vec<u8>>) {
        let Self { ports, programs, crew, answers, .. } = self;
        ports.receive(None, &mut |client, heard| match heard {
            Heard::Opened => drop(programs.insert(client, Program::new(now))),
            Heard::Closed => drop(programs.remove(&client)),
            Heard::Bytes(bytes) | Heard::Late(bytes) => {
                let program = programs.entry(client).or_insert_with(|| Program::new(now));
                let Program { decoder, pulse, unanswered } = program;
                pulse.lies(matches!(heard, Heard::Late(_)));
                for byte in bytes {
                    let Some(frame) = decoder.feed(*byte) else { continue };
                    pulse.hear(now, frame.id == HEARTBEAT_DATA::ID);
                    let numbers = [frame.system, frame.component];
                    let order = Crew::is_order(frame.id).then(|| frame.message().ok()).flatten();
                    let ends = ends_a_flight(&frame);
                    let may = crew.may(now, client, numbers, frame.id) || ends;
                    let is_marked = Crew::is_order(frame.id) && !ends;
                    // An order without a time would be done whenever a line that is held up lets it through.
                    let line = line.as_mut().filter(|_| may && (!is_marked || station.knows_time()));
                    let Some(put) = line else {
                        let why = if may {
                            MavResult::MAV_RESULT_TEMPORARILY_REJECTED
                        } else {
                            MavResult::MAV_RESULT_NOT_IN_CONTROL
                        };
                        let mut room = [0; LONGEST];
                        let answer = order.and_then(|order| refusal(&order, why, numbers));
                        let answer = answer.and_then(|ack| answers.write(MavlinkVersion::V2, &ack, &mut room));
                        answer.into_iter().for_each(|answer| ports.send(&client, answer));
                        continue;
                    };
                    if let Some(command) = order.as_ref().and_then(command) {
                        unanswered.asks(command, numbers);
                    }
                    if is_marked {
                        let said = Instant::now();
                        let said = if pulse.is_held() { said.checked_sub(HELD) } else { Some(said) };
                        station.mark(said, put);
                    }
                    put.extend(frame.bytes());
                }
            }
        });
    }

    /// The line is lost: programs that wait for an answer get one.
    fn lost(&mut self) {
        let Self { ports, programs, answers, .. } = self;
        for (client, program) in programs {
            for ack in program.unanswered.lost() {
                let mut room = [0; LONGEST];
                let bytes = answers.write(MavlinkVersion::V2, &ack, &mut room);
                bytes.into_iter().for_each(|bytes| ports.send(client, bytes));
            }
        }
    }

    /// Time has passed: tells pages what is due, and begins a log.
    fn pass(&mut self, now: stampfly_types::Instant) {
        self.crew.keep(now);
        self.talk.commander(now, self.crew.commander(now));
        self.talk.poll(now, &self.settings);
        self.begin_log();
    }

    /// What of this goes to the vehicle. The page is told why nothing does.
    fn passed(
        &mut self,
        now: stampfly_types::Instant,
        is_heard: bool,
        client: PageClient,
        asked: Asked,
    ) -> Option<Asked> {
        let why = match self.crew.ask(now, client.number(), &asked.ask) {
            _ if !is_heard && !asked.ask.is_never_late() => NOT_HEARD.to_owned(),
            Ok(Some(ask)) => {
                if let Ask::Guided(guided) = ask {
                    let what = Done::Command(GuidedCommand::from(guided).kind);
                    let text = CommandNotice { requester: Requester::Page(client.number() as u32), what }.to_string();
                    self.hub.tell_all(ONLY, &Event::Text { text });
                }
                return Some(Asked { ask, ..asked });
            }
            Ok(None) => return None,
            Err(refusal) => refusal.to_string(),
        };
        self.take(Said::Answer(client, asked, Err(why)));
        None
    }
}

/// The answer to a command of a program of these numbers that is not passed on.
fn refusal(order: &MavMessage, result: MavResult, numbers: [u8; 2]) -> Option<MavMessage> {
    Some(answer(command(order)?, result, numbers))
}

/// What the vehicle says of what others have asked it, at this line and elsewhere. Of this station it
/// is known here.
fn told(frame: &MavlinkFrame<'_>) -> Option<String> {
    if frame.id != STATUSTEXT_DATA::ID {
        return None;
    }
    let Ok(MavMessage::STATUSTEXT(said)) = frame.message::<MavMessage>() else { return None };
    let text = said.text.to_str().ok()?;
    let ours = format!("MAVLink {}/", station::SYSTEM);
    let is_told = ["MAVLink ", "page ", "a Tello program", "the console:", "the station with"];
    (!text.starts_with(&ours) && is_told.iter().any(|begin| text.starts_with(begin))).then(|| text.to_owned())
}

impl<V: Vehicle> Bridge<V> {
    /// Of a vehicle whose line is there, for this hub of one vehicle and these open [`PORTS`]. Logs
    /// go into the folder.
    #[must_use]
    pub fn new(place: Place, baud: u32, hub: Arc<Hub>, ports: Arc<OpenPorts>, folder: PathBuf) -> Option<Self> {
        Self::by(Way::Line(place, baud), hub, ports, folder)
    }

    /// The same of a vehicle that is there in a network and has this key.
    #[must_use]
    pub fn by_radio(
        place: RadioPlace,
        key: Key,
        hub: Arc<Hub>,
        ports: Arc<OpenPorts>,
        folder: PathBuf,
    ) -> Option<Self> {
        Self::by(Way::Radio(place, key), hub, ports, folder)
    }

    fn by(way: Way, hub: Arc<Hub>, ports: Arc<OpenPorts>, folder: PathBuf) -> Option<Self> {
        let settings = V::parameters(&V::default_config());
        let watch = hub.witness(ONLY)?;
        let known = vec![false; settings.len()];
        let station = Station::new(Instant::now(), topics::<V>(), settings.clone());
        let ends = Ends {
            talk: Talk::new(hub.clone()),
            may_log: STARTS,
            now: stampfly_types::Instant::ZERO,
            hub,
            watch,
            ports,
            programs: HashMap::new(),
            settings,
            known,
            folder,
            log: None,
            logs: 0,
            crew: Crew::default(),
            answers: MavlinkWriter::new(VEHICLE[0], VEHICLE[1]),
            status: topics::<V>().iter().position(|topic| topic.name == "flight_status"),
            record: None,
            clock: stampfly_types::Instant::ZERO,
            restarted: false,
        };
        Some(Self { way, station, ends, state: State::Up, begun: Instant::now(), shown: BTreeMap::new() })
    }

    /// The same, which asks the vehicle for its compact flight record and writes it into a file.
    ///
    /// # Errors
    /// When there is no such file to be made.
    pub fn recording(mut self, file: PathBuf) -> std::io::Result<Self> {
        self.ends.record = Some(Record::create(file)?);
        Ok(self)
    }

    /// Carries what is said, until the ports are closed or the time is over.
    pub fn run(mut self, until: Option<Instant>) -> Carried {
        let mut was_heard = false;
        while !self.ends.ports.are_closed() && until.is_none_or(|until| Instant::now() < until) {
            match self.way.open() {
                Ok(line) => {
                    let why = self.carry(line, until);
                    was_heard |= self.station.heard().is_some();
                    let Some(why) = why else { break };
                    let Self { station, ends, .. } = &mut self;
                    station.lost(&mut |said| ends.take(said));
                    ends.lost();
                    self.change(State::Away, format!("the line at {} is gone: {why}", self.way));
                }
                Err(error) => self.change(State::Away, format!("nothing at {}: {error}", self.way)),
            }
            self.wait();
        }
        self.ends.log.take().into_iter().for_each(Log::end);
        let record = self.ends.record.map(|mut record| record.flush().map(|()| record.counts()));
        Carried { was_heard, record }
    }

    /// Time since it began.
    fn now(&self) -> stampfly_types::Instant {
        stampfly_types::Instant::from_micros(self.begun.elapsed().as_micros() as u64)
    }

    /// Says how the line is, when that is new.
    fn change(&mut self, state: State, text: String) {
        if core::mem::replace(&mut self.state, state) != state {
            self.ends.hub.tell_all(ONLY, &Event::Link { up: state == State::Up, text });
        }
    }

    /// Without a line: what is asked is refused.
    fn wait(&mut self) {
        let until = Instant::now() + AGAIN;
        while Instant::now() < until && !self.ends.ports.are_closed() {
            for (client, asked) in self.ends.hub.asks(ONLY, ground::now()) {
                self.ends.take(Said::Answer(client, asked, Err("the line to the vehicle is gone".into())));
            }
            let now = self.now();
            self.ends.programs(now, &mut self.station, None);
            thread::sleep(place::LOOK);
        }
    }

    /// Carries what is said over an open line. Returns why it is gone; `None` when it is over.
    fn carry(&mut self, mut line: Open, until: Option<Instant>) -> Option<std::io::Error> {
        let opened = Instant::now();
        let (mut part, mut put) = (vec![0; PART], Vec::new());
        let (mut looked, mut told) = (opened - LOOK, opened - TOLD);
        // From now on it is not known what the vehicle does.
        self.state = State::Silent;
        while !self.ends.ports.are_closed() && until.is_none_or(|until| Instant::now() < until) {
            let length = match line.read(&mut part) {
                Ok(length) => length,
                Err(error) => return Some(error),
            };
            let now = Instant::now();
            let passed = self.now();
            let Self { station, ends, shown, .. } = self;
            ends.now = passed;
            station.hear(now, part.get(..length).unwrap_or_default(), &mut |said| ends.take(said));
            let is_heard = is_up(station, now) && station.knows_time();
            let wall = ground::now();
            for (client, asked) in ends.hub.asks(ONLY, wall) {
                let Some(asked) = ends.passed(passed, is_heard, client, asked) else { continue };
                // It may have changed them.
                if matches!(&asked.ask, Ask::Console { line } if line.starts_with("param") || line.starts_with("autotune"))
                {
                    ends.restarted = true;
                }
                let age = asked.at.map_or(Duration::ZERO, |at| wall.saturating_sub(Duration::from_secs_f64(at / 1e3)));
                let since = now.checked_sub(age).unwrap_or(now);
                station.ask((now, since), client, asked, &mut put, &mut |said| ends.take(said));
            }
            for page in ends.hub.gone(ONLY) {
                ends.crew.leave(page.number());
            }
            ends.pass(passed);
            ends.programs(passed, station, Some(&mut put));
            if now.duration_since(looked) >= LOOK {
                looked = now;
                let again = now.duration_since(told) >= TOLD;
                told = if again { now } else { told };
                watch::<V>(now, shown, ends, again, &mut |topic, period| station.watch(topic, period, &mut put));
                if let Some(record) = ends.record.as_mut().filter(|_| again) {
                    station.record(&mut put);
                    // What the disk does not take is said with the next chunk.
                    _ = record.flush();
                }
            }
            let is_up = is_up(station, now);
            if core::mem::take(&mut ends.restarted) || (is_up && self.state != State::Up) {
                station.list();
            }
            station.poll(now, &mut put, &mut |said| ends.take(said));
            if is_up {
                self.change(State::Up, format!("heard at {}", self.way));
            } else if self.state == State::Up || now.duration_since(opened) >= SILENCE {
                // Said once: a line that opens begins in this state.
                if core::mem::replace(&mut self.state, State::Away) != State::Away {
                    let text = format!("the line at {} is open, and no vehicle answers", self.way);
                    self.ends.hub.tell_all(ONLY, &Event::Link { up: false, text });
                }
            }
            if !put.is_empty() {
                if let Err(error) = line.write(&put) {
                    return Some(error);
                }
                put.clear();
            }
        }
        None
    }
}

/// Is the vehicle heard?
fn is_up(station: &Station, now: Instant) -> bool {
    station.heard().is_some_and(|heard| now.duration_since(heard) < SILENCE)
}

/// Tells the vehicle what to send: what pages show, and what every page shows of this vehicle.
fn watch<V: Vehicle>(
    now: Instant,
    shown: &mut BTreeMap<usize, Instant>,
    ends: &Ends<V>,
    again: bool,
    tell: &mut dyn FnMut(usize, u16),
) {
    let named = |name: &str| topics::<V>().iter().position(|topic| topic.name == name);
    let page = const { &V::PAGE };
    let always =
        page.observers.iter().map(|observer| observer.topic).chain(page.panels.iter().map(|panel| panel.topic));
    let always = always.chain(["flight_status"]).filter_map(named);
    let looked = ends.hub.looked_at(ONLY).into_iter().filter(|topic| *topic < topics::<V>().len());
    for topic in looked.chain(always) {
        if shown.insert(topic, now).is_none() || again {
            tell(topic, PERIOD);
        }
    }
    shown.retain(|topic, at| {
        let stays = now.duration_since(*at) < SHOWN;
        if !stays {
            tell(*topic, 0);
        }
        stays
    });
}
