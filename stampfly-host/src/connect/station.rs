//! The station's end of a vehicle's line: what pages ask becomes frames, frames become samples and answers. No port, no clock.
//!
//! The vehicle's end is `stampfly-services`' [`Cable`](stampfly_services::cable::Cable). Every question has a number, and is answered once, by the vehicle or,
//! when that takes too long, here.

use super::translation::is_newer;
use stampfly_bus::TopicInfo;
use stampfly_ground::Client;
use stampfly_ground::ask::{Ask, Asked, Guided, Reply};
use stampfly_link::mavlink::dialects::common::{COMMAND_LONG_DATA, MavCmd, MavMessage, MavResult};
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkFrame, MavlinkVersion, MavlinkWriter, Tunnel};
use stampfly_link::secure::Payload;
use stampfly_param::{ParameterError, ParameterInfo, Parameters};
use stampfly_services::cable::{Assembly, Envelope, Part, Split, TYPE, fingerprint};
use stampfly_services::requests;
use stampfly_sim::vehicle::Setting;
use stampfly_types::messages::{GuidedCommand, GuidedKind};
use std::collections::{HashMap, VecDeque};
use std::time::{Duration, Instant};

/// Its system in MAVLink: not that of QGroundControl (255), whose commands are another's.
pub(super) const SYSTEM: u8 = 245;
/// `MAV_COMP_ID_MISSIONPLANNER`, what ground stations call themselves.
const COMPONENT: u8 = 190;
/// What is not answered by then will not be: the longest answer of the console comes in a second, and begins at once.
const PATIENCE: Duration = Duration::from_secs(3);
/// An answer that has not ended by then does not end: by radio, where parts are lost, the longest takes some ten seconds.
const ENDED: Duration = Duration::from_secs(30);
/// Bytes of an answer: as many as by radio, where two bytes say how many have come.
const LONGEST_ANSWER: usize = u16::MAX as usize;
const ENDLESS: &str = "the vehicle's answer does not end";
/// Parameters that are asked for and not there yet: as many as the vehicle's desk has room for, less what a page may ask.
const AHEAD: usize = 6;
/// Lines of the console that wait for the one before.
const LINES: usize = 16;
/// A topic that no vehicle has: to end watching it does nothing.
const NO_TOPIC: u16 = u16::MAX;
/// What was asked within this time of something before it needs no time of its own.
const NEAR: Duration = Duration::from_millis(50);
/// Characters of a line of text from the vehicle.
const LONGEST_TEXT: usize = 500;

/// What has come from the vehicle.
#[derive(Debug)]
pub enum Said<'s> {
    /// A sample: topic, instant, words.
    Sample(usize, stampfly_types::Instant, &'s [u32]),
    /// The answer to a page.
    Answer(Client, Asked, Result<Reply, String>),
    /// A parameter's value: its place.
    Parameter(usize, f32),
    /// A chunk of the flight record.
    Chunk(&'s [u8]),
    /// A whole frame of MAVLink, for other programs.
    Frame(&'s MavlinkFrame<'s>),
    /// A line of text that nobody asked for.
    Text(String),
    /// The vehicle's tables are others: its firmware is not of this program's version.
    Foreign,
}

/// Where what has come goes.
pub type Tell<'t> = &'t mut dyn FnMut(Said<'_>);

/// Why something was asked.
#[derive(Debug)]
enum Why {
    /// A page wants to know.
    Page(Client, Asked),
    /// For the list of all parameters.
    List(usize),
}

/// A line on its way.
#[derive(Debug)]
struct Typed {
    number: u16,
    client: Client,
    asked: Asked,
    since: Instant,
    answer: String,
}

/// The parameters' names, as the vehicle has them.
struct Names<'n>(&'n [Setting]);

impl Parameters for Names<'_> {
    fn describe(&self, index: usize) -> Option<ParameterInfo<'_>> {
        let Setting { name, unit, meaning, .. } = self.0.get(index)?;
        Some(ParameterInfo { name, unit, min: f32::MIN, max: f32::MAX, meaning, in_flight: false })
    }
    fn get(&self, index: usize) -> Option<f32> {
        self.0.get(index).map(|setting| setting.value as f32)
    }
    fn set(&mut self, _: usize, _: f32) -> Result<(), ParameterError> {
        Err(ParameterError::Unknown)
    }
}

/// One vehicle's station.
#[derive(Debug)]
pub struct Station {
    settings: Vec<Setting>,
    table: u16,
    split: Split,
    decoder: MavlinkDecoder<MavMessage>,
    assembly: Assembly,
    writer: MavlinkWriter,
    begun: Instant,
    number: u16,
    waiting: HashMap<u16, (Why, Instant)>,
    line: Option<(Typed, Instant)>,
    /// With when each was asked.
    lines: VecDeque<(Client, Asked, String, Instant)>,
    motor: VecDeque<(Client, Asked, Instant)>,
    /// The next parameter of the list.
    next: usize,
    text: Vec<u8>,
    is_foreign: bool,
    words: Vec<u32>,
    /// When a sound frame came.
    heard: Option<Instant>,
    /// The vehicle's clock, ms, in its newest sample, and when that came. With it the station says when it asks something.
    clock: Option<(u32, Instant)>,
    /// When what was said last with a time was asked.
    dated: Option<Instant>,
}

impl Station {
    /// For a vehicle with these topics and parameters.
    #[must_use]
    pub fn new(now: Instant, topics: &[TopicInfo], settings: Vec<Setting>) -> Self {
        let table = fingerprint(topics, &Names(&settings));
        Self {
            next: settings.len(),
            settings,
            table,
            split: Split::new(),
            decoder: MavlinkDecoder::new(),
            assembly: Assembly::default(),
            writer: MavlinkWriter::new(SYSTEM, COMPONENT),
            begun: now,
            number: 0,
            waiting: HashMap::new(),
            line: None,
            lines: VecDeque::new(),
            motor: VecDeque::new(),
            text: Vec::new(),
            is_foreign: false,
            words: Vec::new(),
            heard: None,
            clock: None,
            dated: None,
        }
    }

    /// When a sound frame came last.
    #[must_use]
    pub const fn heard(&self) -> Option<Instant> {
        self.heard
    }

    /// From now on all parameters are asked for.
    pub const fn list(&mut self) {
        self.next = 0;
    }

    /// The line is gone: whoever waits is told so.
    pub fn lost(&mut self, tell: Tell<'_>) {
        self.expire(None, tell);
        (self.split, self.decoder, self.assembly) = (Split::new(), MavlinkDecoder::new(), Assembly::default());
        (self.heard, self.clock, self.dated, self.is_foreign) = (None, None, None, false);
        self.next = self.settings.len();
        self.text.clear();
    }

    /// Takes what has come.
    pub fn hear(&mut self, now: Instant, bytes: &[u8], tell: Tell<'_>) {
        let clock = stampfly_types::Instant::from_micros(now.duration_since(self.begun).as_micros() as u64);
        for byte in bytes {
            match self.split.feed(clock, *byte) {
                Part::Text => self.read(*byte, tell),
                Part::Frame => self.frame(now, *byte, tell),
            }
        }
    }

    /// A line of text ends.
    fn read(&mut self, byte: u8, tell: Tell<'_>) {
        match byte {
            b'\r' | b'\n' => {
                let text = String::from_utf8_lossy(&core::mem::take(&mut self.text))
                    .trim_start_matches("> ")
                    .trim()
                    .to_owned();
                if !text.is_empty() {
                    tell(Said::Text(text));
                }
            }
            _ if self.text.len() < LONGEST_TEXT => self.text.push(byte),
            _ => {}
        }
    }

    fn frame(&mut self, now: Instant, byte: u8, tell: Tell<'_>) {
        let Some(frame) = self.decoder.feed(byte) else { return };
        self.heard = Some(now);
        if frame.id != Tunnel::ID {
            tell(Said::Frame(&frame));
            if let Ok(MavMessage::COMMAND_ACK(ack)) = frame.message::<MavMessage>()
                && ack.command == MavCmd::MAV_CMD_DO_MOTOR_TEST
                // Zero is everybody.
                && matches!(ack.target_system, 0 | SYSTEM)
                && let Some((client, asked, _)) = self.motor.pop_front()
            {
                let answer = match ack.result {
                    MavResult::MAV_RESULT_ACCEPTED => Ok(Reply::text("")),
                    MavResult::MAV_RESULT_DENIED => Err("the vehicle is armed, or a number is out of range".into()),
                    _ => Err("the vehicle does not do that now".into()),
                };
                tell(Said::Answer(client, asked, answer));
            }
            return;
        }
        let Some(tunnel) = Tunnel::read(frame.payload).filter(|tunnel| tunnel.kind == TYPE) else { return };
        let Some((envelope, payload)) = self.assembly.feed(&tunnel.bytes) else { return };
        let Envelope { table, number, .. } = envelope;
        if table != self.table {
            if !core::mem::replace(&mut self.is_foreign, true) {
                tell(Said::Foreign);
            }
            return;
        }
        match payload {
            Payload::Sample(sample) => {
                let at = (sample.at.as_micros() / 1_000) as u32;
                if self.clock.is_none_or(|(before, _)| is_newer(at, before)) {
                    self.clock = Some((at, now));
                }
                self.words.clear();
                self.words.extend(sample.words());
                tell(Said::Sample(sample.topic.into(), sample.at, &self.words));
            }
            Payload::Parameter { index, value, taken } => {
                let index = usize::from(index);
                tell(Said::Parameter(index, value));
                if let Some((Why::Page(client, asked), _)) = self.waiting.remove(&number) {
                    let answer = match (&asked.ask, taken) {
                        (Ask::ParamSet { .. }, false) => Err("not taken: out of range, or the vehicle is armed".into()),
                        _ => Ok(Reply::value(value.into())),
                    };
                    tell(Said::Answer(client, asked, answer));
                }
            }
            Payload::Reply { text, last } => match &mut self.line {
                Some((typed, heard)) if typed.number == number => {
                    typed.answer.push_str(text);
                    *heard = now;
                    let is_endless = typed.answer.len() > LONGEST_ANSWER || now.duration_since(typed.since) > ENDED;
                    if let Some((Typed { client, asked, .. }, _)) = self.line.take_if(|_| is_endless) {
                        return tell(Said::Answer(client, asked, Err(ENDLESS.into())));
                    }
                    if let Some((Typed { client, asked, answer, .. }, _)) = self.line.take_if(|_| last) {
                        if answer.starts_with("one question after the other") {
                            // Of a station before this one, which was in the middle of something.
                            return tell(Said::Answer(client, asked, Err("the vehicle answers somebody else".into())));
                        }
                        tell(Said::Answer(client, asked, Ok(Reply::text(answer.trim()))));
                    }
                }
                _ => {
                    // What was refused.
                    if let Some((Why::Page(client, asked), _)) = self.waiting.remove(&number) {
                        tell(Said::Answer(client, asked, Err(text.into())));
                    }
                }
            },
            Payload::Chunk(chunk) => tell(Said::Chunk(chunk)),
            Payload::Notice { text, .. } => tell(Said::Text(text.to_owned())),
            Payload::Acknowledgement { taken, .. } => {
                let line = self.line.take_if(|(typed, _)| typed.number == number);
                let line = line.map(|(Typed { client, asked, .. }, _)| (client, asked));
                let asked = line.or_else(|| match self.waiting.remove(&number)?.0 {
                    Why::Page(client, asked) => Some((client, asked)),
                    Why::List(_) => None,
                });
                let Some((client, asked)) = asked else { return };
                let answer = match (taken, &asked.ask) {
                    (true, _) => Ok(Reply::text("")),
                    (false, Ask::Guided(_)) => Err("the vehicle has no room for it".into()),
                    (false, _) => Err("by radio the vehicle does this only while it is disarmed".into()),
                };
                tell(Said::Answer(client, asked, answer));
            }
            _ => {}
        }
    }

    /// Can it say when something was asked? Not before the vehicle has told its time: what is held
    /// up on the line would be done whenever it comes.
    #[must_use]
    pub const fn knows_time(&self) -> bool {
        self.clock.is_some()
    }

    /// Asks the vehicle what a page has asked for at this time. Answers at once what no vehicle needs to be asked.
    pub fn ask(
        &mut self,
        (now, since): (Instant, Instant),
        client: Client,
        asked: Asked,
        put: &mut Vec<u8>,
        tell: Tell<'_>,
    ) {
        let guided = |kind| Payload::Guided(GuidedCommand { kind, ..GuidedCommand::default() });
        let (payload, asked) = match asked.ask.clone() {
            Ask::Guided(Guided::Kill {}) => (Payload::Kill, asked),
            // A click on the map says where to be, not where to be after everything else.
            Ask::Guided(go_to @ Guided::GoTo { .. }) => {
                _ = self.say(since, &guided(GuidedKind::Hold), put);
                (Payload::Guided(go_to.into()), asked)
            }
            Ask::Guided(other) => (Payload::Guided(other.into()), asked),
            Ask::Sticks(sticks) => {
                _ = self.say(since, &Payload::Sticks(sticks.into()), put);
                return;
            }
            Ask::Alive {} => {
                _ = self.say(since, &guided(GuidedKind::None), put);
                return;
            }
            Ask::ParamGet { name } | Ask::ParamSet { name, .. } => {
                let Some(index) = self.settings.iter().position(|setting| setting.name == name) else {
                    return tell(Said::Answer(client, asked, Err("there is no such parameter".into())));
                };
                let index = index as u16;
                match asked.ask {
                    Ask::ParamSet { value, .. } => (Payload::WriteParameter { index, value }, asked),
                    _ => (Payload::ReadParameter { index }, asked),
                }
            }
            Ask::ParamSave {} => return self.queue(since, client, asked, "param save".into(), tell),
            Ask::Console { line } => return self.queue(since, client, asked, line, tell),
            Ask::MotorTest { motor, duty } => return self.turn((now, Some(since)), client, asked, (motor, duty), put),
            Ask::MotorStop {} => return self.turn((now, None), client, asked, (0, 0.0), put),
            _ => return tell(Said::Answer(client, asked, Err("this vehicle does not do that".into()))),
        };
        match self.say(since, &payload, put) {
            Some(number) => drop(self.waiting.insert(number, (Why::Page(client, asked), now))),
            None => tell(Said::Answer(client, asked, Err("a number is out of range".into()))),
        }
    }

    /// A line that is typed when those before are answered.
    fn queue(&mut self, since: Instant, client: Client, asked: Asked, line: String, tell: Tell<'_>) {
        if line.len() > requests::LINE {
            tell(Said::Answer(client, asked, Err(format!("longer than {} characters", requests::LINE))));
        } else if self.lines.len() >= LINES {
            tell(Said::Answer(client, asked, Err("one line after the other".into())));
        } else {
            self.lines.push_back((client, asked, line, since));
        }
    }

    /// One motor, in MAVLink's own words: they wait for no line. What stops it is right at any time, and has none.
    fn turn(
        &mut self,
        (now, since): (Instant, Option<Instant>),
        client: Client,
        asked: Asked,
        (motor, duty): (u8, f32),
        put: &mut Vec<u8>,
    ) {
        self.mark(since, put);
        let data = COMMAND_LONG_DATA {
            param1: motor.into(),
            param3: 100.0 * duty,
            command: MavCmd::MAV_CMD_DO_MOTOR_TEST,
            target_system: 0,
            target_component: 0,
            ..COMMAND_LONG_DATA::default()
        };
        let mut room = [0; LONGEST];
        put.extend(
            self.writer.write(MavlinkVersion::V2, &MavMessage::COMMAND_LONG(data), &mut room).unwrap_or_default(),
        );
        self.motor.push_back((client, asked, now));
    }

    /// Wants to see a topic every `period` ms; zero for not any more.
    pub fn watch(&mut self, topic: usize, period: u16, put: &mut Vec<u8>) {
        if let Ok(topic) = u16::try_from(topic) {
            _ = self.say_at(None, &Payload::Watch { topic, period }, put);
        }
    }

    /// Says when what follows in MAVLink's own words was asked, which have no room for a time; the
    /// vehicle does nothing that was held up. Without a time it does what follows whenever it comes.
    pub fn mark(&mut self, since: Option<Instant>, put: &mut Vec<u8>) {
        let is_near = |dated: Instant| since.is_some_and(|at| at >= dated && at.duration_since(dated) < NEAR);
        if !self.dated.is_some_and(is_near) {
            _ = self.say_at(since, &Payload::Watch { topic: NO_TOPIC, period: 0 }, put);
        }
    }

    /// Wants the flight record. The vehicle is to be told so again and again.
    pub fn record(&mut self, put: &mut Vec<u8>) {
        _ = self.say_at(None, &Payload::Record { wanted: true }, put);
    }

    /// What is due: the next line, parameters of the list, an end to patience.
    pub fn poll(&mut self, now: Instant, put: &mut Vec<u8>, tell: Tell<'_>) {
        if self.line.is_none()
            && let Some((client, asked, line, since)) = self.lines.pop_front()
        {
            match self.say(since, &Payload::Line(&line), put) {
                Some(number) => {
                    self.line = Some((Typed { number, client, asked, since: now, answer: String::new() }, now));
                }
                None => tell(Said::Answer(client, asked, Err("that cannot be typed".into()))),
            }
        }
        let listed = |why: &(Why, Instant)| matches!(why.0, Why::List(_));
        while self.next < self.settings.len() && self.waiting.values().filter(|why| listed(why)).count() < AHEAD {
            let index = self.next;
            self.next += 1;
            if let Some(number) = self.say_at(None, &Payload::ReadParameter { index: index as u16 }, put) {
                self.waiting.insert(number, (Why::List(index), now));
            }
        }
        self.expire(Some(now), tell);
    }

    /// Answers what has waited too long, or without a time everything.
    fn expire(&mut self, now: Option<Instant>, tell: Tell<'_>) {
        let late = |since: Instant| now.is_none_or(|now| now.duration_since(since) > PATIENCE);
        let silent = || match now {
            None => Err("the line to the vehicle is gone".into()),
            Some(_) => Err("the vehicle does not answer".into()),
        };
        let numbers: Vec<u16> =
            self.waiting.iter().filter(|(_, (_, since))| late(*since)).map(|(number, _)| *number).collect();
        for number in numbers {
            match self.waiting.remove(&number) {
                Some((Why::Page(client, asked), _)) => {
                    tell(Said::Answer(client, asked, silent()));
                }
                // Once more, if it is still wanted.
                Some((Why::List(index), _)) if now.is_some() => self.next = self.next.min(index),
                _ => {}
            }
        }
        if let Some((Typed { client, asked, .. }, _)) = self.line.take_if(|(_, since)| late(*since)) {
            tell(Said::Answer(client, asked, silent()));
        }
        while self.motor.front().is_some_and(|(_, _, since)| late(*since)) {
            if let Some((client, asked, _)) = self.motor.pop_front() {
                tell(Said::Answer(client, asked, silent()));
            }
        }
        if now.is_none() {
            for (client, asked, ..) in self.lines.drain(..) {
                tell(Said::Answer(client, asked, Err("the line to the vehicle is gone".into())));
            }
        }
    }

    /// Puts a payload that was asked for then into frames. Returns its number; `None` when a value in it must not be used.
    fn say(&mut self, since: Instant, payload: &Payload<'_>, put: &mut Vec<u8>) -> Option<u16> {
        self.say_at(Some(since), payload, put)
    }

    /// The same. Without a time the vehicle does it whenever it comes.
    fn say_at(&mut self, since: Option<Instant>, payload: &Payload<'_>, put: &mut Vec<u8>) -> Option<u16> {
        self.number = self.number.wrapping_add(1);
        let said = self.clock.zip(since).map(|((at, heard), since)| {
            let [after, before] = [since.duration_since(heard), heard.duration_since(since)];
            at.wrapping_add(after.as_millis() as u32).wrapping_sub(before.as_millis() as u32)
        });
        self.dated = since.filter(|_| said.is_some());
        let Self { table, number, writer, .. } = self;
        let sound = Envelope::write(*table, *number, said, payload, &mut |part| {
            let Some(tunnel) = Tunnel::new(TYPE, [0; 2], part) else { return };
            let mut room = [0; LONGEST];
            let frame = writer.write_payload::<MavMessage>(Tunnel::ID, &tunnel.payload(), &mut room);
            put.extend(frame.unwrap_or_default());
        });
        sound.then_some(*number)
    }
}
