//! What is inside a frame, for whom it is for.
//!
//! | kind | from | body, little-endian |
//! |---|---|---|
//! | 10 sticks | station | roll, pitch, yaw, throttle as 4 × f32 from −1 to 1; u8 flight mode; u8 switches: 0 arm, 1 kill |
//! | 11 guided | station | u8 what; goal 3 × f32 to ±10 km; f32 heading to ±2π; f32 speed to 100 m/s; f32 dwell to an hour |
//! | 12 kill | station | nothing |
//! | 13 numbered | station | u32 number of the command; the command, as in 11 |
//! | 20 read parameter | station | u16 place in the vehicle's table |
//! | 21 write parameter | station | u16 place; f32 value, finite |
//! | 30 line | station | text |
//! | 31 question | station | u32 number of the line; u16 bytes of its answer that have come; text of the line |
//! | 40 watch | station | u16 topic; u16 period, ms; 0 ends it |
//! | 41 record | station | u8 whether the flight record is wanted; said again every second |
//! | 90 telemetry | vehicle | a [`TelemetryPacket`], with its checksum |
//! | A0 parameter | vehicle | u16 place; f32 value; u8 whether a write was taken |
//! | B0 reply | vehicle | u8 whether it is the last; text |
//! | B1 part | vehicle | u32 number of the line; u16 bytes of its answer before this; u8 whether it is the last; text |
//! | C0 sample | vehicle | u16 topic; u64 instant, µs; the words of the message, u32 each |
//! | C1 chunk | vehicle | a chunk of the flight record, with its number and check sum |
//! | C2 tables | vehicle | u16 fingerprint of its tables of topics and parameters |
//! | D0 acknowledgement | vehicle | u32 counter of a frame of the station, of a numbered command its number; u8 whether it was taken, and a command done |
//! | D1 refusal | vehicle | u32 as in D0; text: why it was not taken or not done, such as who commands. It is not to be said again |
//! | D2 notice | vehicle | u32 number of the notice, the same when it comes again; text: what was asked of the vehicle, and by whom |
//!
//! Numbers of kinds are hexadecimal. A body has exactly the length of its kind. Numbers are finite and in their range; −0 and
//! subnormal numbers are refused, so that a value has one form; they are sent as zero. Text is UTF-8 without control
//! characters other than line ends and tabulators. Words of a sample are not looked at: what they are, the topic's message says.

use super::frame::Kind;
use super::refused::SealError;
use super::values::{Reader, Writer};
use crate::TelemetryPacket;
use core::f32::consts::TAU;
use stampfly_types::messages::{FlightMode, GuidedCommand, GuidedKind, PilotInput};
use stampfly_types::{Instant, Vec3};

const ARM: u8 = 1;
const KILL: u8 = 1 << 1;
/// What a goal may be off the origin, m: farther than any such radio reaches.
const FARTHEST: f32 = 10_000.0;
/// What may be asked for as speed, m/s.
const FASTEST: f32 = 100.0;
/// What may be asked for as a stay, s.
const LONGEST: f32 = 3_600.0;

/// What is inside a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Payload<'f> {
    /// Sticks and switches, from the station.
    Sticks(PilotInput),
    /// A program's command, from the station.
    Guided(GuidedCommand),
    /// Motors off now, from the station.
    Kill,
    /// A program's command that is said until it is acknowledged, and taken once, from the station: see [`Commands`](super::Commands).
    Numbered {
        /// Another than that of the command before.
        number: u32,
        /// The command.
        command: GuidedCommand,
    },
    /// The value of a parameter is asked for, from the station.
    ReadParameter {
        /// Place in the vehicle's table.
        index: u16,
    },
    /// A parameter is to have another value, from the station. Not with motors armed. Its range is the vehicle's to check.
    WriteParameter {
        /// Place in the vehicle's table.
        index: u16,
        /// In the parameter's unit.
        value: f32,
    },
    /// A line for the console, from the station. Not with motors armed.
    Line(&'f str),
    /// A line for the console that is said until its whole answer has come, in [parts](Self::Part), from the station. Not with motors armed. It is done once.
    Question {
        /// Another than that of the line before.
        number: u32,
        /// Bytes of the answer that have come: it goes on behind them.
        from: u16,
        /// The line.
        line: &'f str,
    },
    /// Messages of a topic are to be sent as [samples](Self::Sample), the newest of them, from the station.
    Watch {
        /// Place in the vehicle's topic table.
        topic: u16,
        /// Between two of them, at least, ms. Zero: none any more.
        period: u16,
    },
    /// The flight record is wanted as [chunks](Self::Chunk), or not any more, from the station. It is said again as long as that is so.
    Record {
        /// Is it?
        wanted: bool,
    },
    /// The vehicle's state.
    Telemetry(TelemetryPacket),
    /// The value of a parameter, from the vehicle.
    Parameter {
        /// Place in the vehicle's table.
        index: u16,
        /// In the parameter's unit.
        value: f32,
        /// Was it changed as it was asked for? `true` where nothing was.
        taken: bool,
    },
    /// A part of the console's answer, from the vehicle.
    Reply {
        /// The part.
        text: &'f str,
        /// Is it the last?
        last: bool,
    },
    /// A part of the answer to a [question](Self::Question), from the vehicle.
    Part {
        /// The number of the line.
        number: u32,
        /// Bytes of the answer before this part.
        from: u16,
        /// The part.
        text: &'f str,
        /// Is it the last?
        last: bool,
    },
    /// A message of one of the vehicle's topics.
    Sample(Sample<'f>),
    /// A chunk of the flight record, from the vehicle.
    Chunk(&'f [u8]),
    /// The fingerprint of the vehicle's tables, from the vehicle: a station whose own is another knows other topics and parameters by the same places.
    Tables {
        /// Of both tables.
        fingerprint: u16,
    },
    /// What became of a frame of the station, from the vehicle.
    Acknowledgement {
        /// The frame's counter; of a [numbered](Self::Numbered) command, its number.
        counter: u32,
        /// Was it taken?
        taken: bool,
    },
    /// A frame of the station was refused, from the vehicle: a command or sticks while another commands. Stations of before this kind do not know it, and say a
    /// command again until they give it up.
    Refusal {
        /// As in an [acknowledgement](Self::Acknowledgement).
        counter: u32,
        /// The reason, for people.
        why: &'f str,
    },
    /// What was asked of the vehicle, and by whom, from the vehicle. It is said several times, because frames are lost.
    Notice {
        /// Another than that of the notice before.
        number: u32,
        /// For people.
        text: &'f str,
    },
}

impl<'f> Payload<'f> {
    /// Its kind.
    #[must_use]
    pub const fn kind(&self) -> Kind {
        match self {
            Self::Sticks(_) => Kind::Sticks,
            Self::Guided(_) => Kind::Guided,
            Self::Kill => Kind::Kill,
            Self::Numbered { .. } => Kind::Numbered,
            Self::ReadParameter { .. } => Kind::ReadParameter,
            Self::WriteParameter { .. } => Kind::WriteParameter,
            Self::Line(_) => Kind::Line,
            Self::Question { .. } => Kind::Question,
            Self::Watch { .. } => Kind::Watch,
            Self::Record { .. } => Kind::Record,
            Self::Telemetry(_) => Kind::Telemetry,
            Self::Parameter { .. } => Kind::Parameter,
            Self::Reply { .. } => Kind::Reply,
            Self::Part { .. } => Kind::Part,
            Self::Sample(_) => Kind::Sample,
            Self::Chunk(_) => Kind::Chunk,
            Self::Tables { .. } => Kind::Tables,
            Self::Acknowledgement { .. } => Kind::Acknowledgement,
            Self::Refusal { .. } => Kind::Refusal,
            Self::Notice { .. } => Kind::Notice,
        }
    }

    /// Are the motors to be off, whatever else it says?
    ///
    /// ```
    /// use stampfly_link::secure::Payload;
    /// use stampfly_link::types::messages::PilotInput;
    /// assert!(Payload::Kill.is_kill());
    /// assert!(Payload::Sticks(PilotInput { kill: true, ..Default::default() }).is_kill());
    /// assert!(!Payload::Line("reboot").is_kill());
    /// ```
    #[must_use]
    pub const fn is_kill(&self) -> bool {
        match self {
            Self::Kill => true,
            Self::Sticks(input) => input.kill,
            Self::Guided(command) | Self::Numbered { command, .. } => matches!(command.kind, GuidedKind::Kill),
            _ => false,
        }
    }

    /// The command that it is, of a program or to kill.
    #[must_use]
    pub fn command(&self) -> Option<GuidedCommand> {
        match *self {
            Self::Guided(command) | Self::Numbered { command, .. } => Some(command),
            Self::Kill => Some(GuidedCommand { kind: GuidedKind::Kill, ..GuidedCommand::default() }),
            _ => None,
        }
    }

    /// Writes the body, and returns its length.
    ///
    /// # Errors
    /// When a value must not be used, or there is no room for it.
    pub fn encode(&self, place: &mut [u8]) -> Result<usize, SealError> {
        let mut to = Writer::new(place);
        match self {
            Self::Sticks(input) => {
                let PilotInput { roll, pitch, yaw, throttle, mode, arm, kill } = *input;
                [roll, pitch, yaw, throttle].into_iter().try_for_each(|stick| to.number(stick, 1.0))?;
                to.bytes(&[mode as u8, (u8::from(arm) * ARM) | (u8::from(kill) * KILL)])?;
            }
            Self::Guided(command) => write(&mut to, command)?,
            Self::Kill => {}
            Self::Numbered { number, command } => {
                to.bytes(&number.to_le_bytes())?;
                write(&mut to, command)?;
            }
            Self::ReadParameter { index } => to.bytes(&index.to_le_bytes())?,
            Self::WriteParameter { index, value } => {
                to.bytes(&index.to_le_bytes())?;
                to.number(*value, f32::MAX)?;
            }
            Self::Line(text) => to.text(text)?,
            Self::Question { number, from, line } => {
                to.bytes(&number.to_le_bytes())?;
                to.bytes(&from.to_le_bytes())?;
                to.text(line)?;
            }
            Self::Watch { topic, period } => {
                to.bytes(&topic.to_le_bytes())?;
                to.bytes(&period.to_le_bytes())?;
            }
            Self::Record { wanted } => to.truth(*wanted)?,
            Self::Chunk(chunk) => to.bytes(chunk)?,
            Self::Tables { fingerprint } => to.bytes(&fingerprint.to_le_bytes())?,
            Self::Telemetry(packet) => to.bytes(&packet.to_bytes())?,
            Self::Parameter { index, value, taken } => {
                to.bytes(&index.to_le_bytes())?;
                to.number(*value, f32::MAX)?;
                to.truth(*taken)?;
            }
            Self::Reply { text, last } => {
                to.truth(*last)?;
                to.text(text)?;
            }
            Self::Part { number, from, text, last } => {
                to.bytes(&number.to_le_bytes())?;
                to.bytes(&from.to_le_bytes())?;
                to.truth(*last)?;
                to.text(text)?;
            }
            Self::Sample(sample) => {
                to.bytes(&sample.topic.to_le_bytes())?;
                to.bytes(&sample.at.as_micros().to_le_bytes())?;
                sample.words().try_for_each(|word| to.bytes(&word.to_le_bytes()))?;
            }
            Self::Acknowledgement { counter, taken } => {
                to.bytes(&counter.to_le_bytes())?;
                to.truth(*taken)?;
            }
            Self::Refusal { counter: number, why: text } | Self::Notice { number, text } => {
                to.bytes(&number.to_le_bytes())?;
                to.text(text)?;
            }
        }
        Ok(to.length())
    }

    /// Reads the body of a frame of this kind. `None` when it is none; nothing of it may be used then.
    #[must_use]
    pub fn decode(kind: Kind, body: &'f [u8]) -> Option<Self> {
        let mut from = Reader(body);
        let payload = match kind {
            Kind::Sticks => {
                let mut stick = || from.number(1.0);
                let (roll, pitch, yaw, throttle) = (stick()?, stick()?, stick()?, stick()?);
                let (mode, switches) = (FlightMode::from_number(from.byte()?.into())?, from.byte()?);
                if switches & !(ARM | KILL) != 0 {
                    return None;
                }
                let (arm, kill) = (switches & ARM != 0, switches & KILL != 0);
                Self::Sticks(PilotInput { roll, pitch, yaw, throttle, mode, arm, kill })
            }
            Kind::Guided => Self::Guided(read(&mut from)?),
            Kind::Kill => Self::Kill,
            Kind::Numbered => {
                let number = u32::from_le_bytes(from.bytes()?);
                Self::Numbered { number, command: read(&mut from)? }
            }
            Kind::ReadParameter => Self::ReadParameter { index: u16::from_le_bytes(from.bytes()?) },
            Kind::WriteParameter => {
                let (index, value) = (u16::from_le_bytes(from.bytes()?), from.number(f32::MAX)?);
                Self::WriteParameter { index, value }
            }
            Kind::Line => Self::Line(from.text()?),
            Kind::Question => {
                let (number, had) = (u32::from_le_bytes(from.bytes()?), u16::from_le_bytes(from.bytes()?));
                Self::Question { number, from: had, line: from.text()? }
            }
            Kind::Watch => {
                let topic = u16::from_le_bytes(from.bytes()?);
                Self::Watch { topic, period: u16::from_le_bytes(from.bytes()?) }
            }
            Kind::Record => Self::Record { wanted: from.truth()? },
            Kind::Chunk => Self::Chunk(core::mem::take(&mut from.0)),
            Kind::Tables => Self::Tables { fingerprint: u16::from_le_bytes(from.bytes()?) },
            Kind::Telemetry => Self::Telemetry(TelemetryPacket::decode(&from.bytes::<22>()?).ok()?),
            Kind::Parameter => {
                let (index, value) = (u16::from_le_bytes(from.bytes()?), from.number(f32::MAX)?);
                Self::Parameter { index, value, taken: from.truth()? }
            }
            Kind::Reply => {
                let last = from.truth()?;
                Self::Reply { text: from.text()?, last }
            }
            Kind::Part => {
                let (number, before) = (u32::from_le_bytes(from.bytes()?), u16::from_le_bytes(from.bytes()?));
                let last = from.truth()?;
                Self::Part { number, from: before, text: from.text()?, last }
            }
            Kind::Sample => {
                let topic = u16::from_le_bytes(from.bytes()?);
                let at = Instant::from_micros(u64::from_le_bytes(from.bytes()?));
                let (words, rest) = from.0.as_chunks::<4>();
                from.0 = rest;
                Self::Sample(Sample { topic, at, words })
            }
            Kind::Acknowledgement => {
                let counter = u32::from_le_bytes(from.bytes()?);
                Self::Acknowledgement { counter, taken: from.truth()? }
            }
            Kind::Refusal => {
                let counter = u32::from_le_bytes(from.bytes()?);
                Self::Refusal { counter, why: from.text()? }
            }
            Kind::Notice => {
                let number = u32::from_le_bytes(from.bytes()?);
                Self::Notice { number, text: from.text()? }
            }
            Kind::Join | Kind::Ready | Kind::Announcement | Kind::Welcome => return None,
        };
        from.end(payload)
    }
}

fn write(to: &mut Writer<'_>, command: &GuidedCommand) -> Result<(), SealError> {
    let GuidedCommand { kind, position, yaw, speed, dwell } = *command;
    to.bytes(&[kind as u8])?;
    position.iter().try_for_each(|axis| to.number(*axis, FARTHEST))?;
    to.number(yaw, TAU)?;
    to.positive(speed, FASTEST)?;
    to.positive(dwell, LONGEST)
}

fn read(from: &mut Reader<'_>) -> Option<GuidedCommand> {
    let kind = GuidedKind::from_number(from.byte()?.into())?;
    let mut axis = || from.number(FARTHEST);
    let position = Vec3::new(axis()?, axis()?, axis()?);
    let (yaw, speed, dwell) = (from.number(TAU)?, from.positive(FASTEST)?, from.positive(LONGEST)?);
    Some(GuidedCommand { kind, position, yaw, speed, dwell })
}

/// A message of a topic, as words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample<'f> {
    /// Place in the vehicle's topic table.
    pub topic: u16,
    /// When it was published.
    pub at: Instant,
    words: &'f [[u8; 4]],
}

impl<'f> Sample<'f> {
    /// The most words that fit.
    pub const MAX_WORDS: usize = (super::frame::MAX_BODY - 10) / 4;

    /// A message whose words lie here as bytes, each little-endian.
    #[must_use]
    pub const fn new(topic: u16, at: Instant, words: &'f [[u8; 4]]) -> Self {
        Self { topic, at, words }
    }

    /// The words of the message.
    pub fn words(&self) -> impl ExactSizeIterator<Item = u32> + use<'f> {
        self.words.iter().map(|bytes| u32::from_le_bytes(*bytes))
    }
}
