//! ULog, the log format of PX4: self-describing, append-only, readable with `pyulog`, PlotJuggler,
//! Foxglove and Flight Review. Implemented from PX4's public description of the file format,
//! version 1.
//!
//! A file is a 16-byte header followed by messages. Each message is `u16` payload size, `u8` type,
//! payload, all little-endian:
//!
//! | type | [`Message`] | contents |
//! |---|---|---|
//! | `B` | [`FlagBits`](Message::FlagBits) | compatibility flags, places of appended data; first message |
//! | `F` | [`Format`](Message::Format) | `name:type field;type field;…` |
//! | `I` `M` | [`Info`](Message::Info) [`MultiInfo`](Message::MultiInfo) | key and value |
//! | `P` `Q` | [`Parameter`](Message::Parameter) [`ParameterDefault`](Message::ParameterDefault) | `float` or `int32_t` |
//! | `A` `R` | [`Subscription`](Message::Subscription) [`Unsubscription`](Message::Unsubscription) | number of a topic; the first `A` ends the definitions |
//! | `D` | [`Data`](Message::Data) | topic number and one sample |
//! | `L` `C` | [`Text`](Message::Text) | a line of text, tagged or not |
//! | `S` `O` | [`Sync`](Message::Sync) [`Dropout`](Message::Dropout) | resynchronisation mark; gap in milliseconds |
//!
//! # Layout of the stack's logs
//! * A topic's format is `uint64_t timestamp; uint32_t generation;` followed by the fields of the
//!   message: `f32` as `float`, `u8` and `bool` as `uint8_t`, an enumeration as the smallest
//!   unsigned type that holds all its numbers, flags as `uint32_t`, arrays and vectors as
//!   `float[3]`. Fields are packed without padding.
//! * Units are one text info per topic, `units/estimate_state` = `position=m velocity=m/s …`,
//!   without the dimensionless fields.
//! * Names of enumeration values and flags are one text info per field, `names/flight_status/phase`
//!   = `Init=0 IdleGround=1 …`. The number of a flag is its bit mask.
//! * The activations of each runnable are a topic `activation_…`, see [`crate::trace`].
//!
//! Use [`Definitions`] and [`Writer`] to write, [`Reader`] to read. The reader accepts logs of any
//! origin; [`Format::unfolded`] expands formats that contain other formats.

mod cursor;
mod end;
mod format;
mod message;
mod reader;
mod schema;
mod sink;
mod topic;
mod unfold;
mod writer;

pub use end::End;
pub use format::{Column, Columns, Declaration, FieldError, Format, Scalar};
pub use message::{FlagBits, Level, Message, ParameterValue};
pub use reader::{ReadError, ReadErrorKind, Reader};
pub use schema::Schema;
pub use sink::{Full, Ram, Sink, WriteError};
pub use topic::{Sample, Stamp, Topic};
pub use unfold::{Path, Unfolded, UnfoldedColumn};
pub use writer::{Definitions, Writer};

pub(crate) use cursor::{Take, put_u16};

/// First seven bytes of every ULog; the version follows.
const MAGIC: [u8; 7] = [0x55, 0x4c, 0x6f, 0x67, 0x01, 0x12, 0x35];
/// The format version that the writer sets. The reader accepts all versions.
const VERSION: u8 = 1;
/// Length of the header: magic, version, start time.
const HEADER: usize = 16;
/// Payload of a sync message.
const SYNC_MAGIC: [u8; 8] = [0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12];
/// The two fields with which every topic of the stack begins: its stamp and its generation.
const TOPIC_HEAD: &str = "uint64_t timestamp;uint32_t generation;";
/// Length of these two fields.
const TOPIC_HEAD_SIZE: usize = 12;
/// Prefix of the info keys of units.
pub const UNITS_PREFIX: &str = "units/";
/// Prefix of the info keys of names of values and flags.
pub const NAMES_PREFIX: &str = "names/";
/// Length of the largest message that the writer makes, header included. The writer has a buffer of
/// this size.
pub const MAX_MESSAGE: usize = 2048;
