//! ULog, the log format of PX4: self-describing, append-only, opened by `pyulog`, PlotJuggler, Foxglove and
//! Flight Review. Layout after the public file format description of PX4, version 1.
//!
//! A file is a 16-byte header and then messages, each `u16` payload size, `u8` type, payload, little-endian:
//!
//! | type | [`Message`] | what |
//! |---|---|---|
//! | `B` | [`FlagBits`](Message::FlagBits) | compatibility flags, places of appended data; first message |
//! | `F` | [`Format`](Message::Format) | `name:type field;type field;…` |
//! | `I` `M` | [`Info`](Message::Info) [`MultiInfo`](Message::MultiInfo) | key and value |
//! | `P` `Q` | [`Parameter`](Message::Parameter) [`ParameterDefault`](Message::ParameterDefault) | `float` or `int32_t` |
//! | `A` `R` | [`Subscription`](Message::Subscription) [`Unsubscription`](Message::Unsubscription) | number of a topic; the first `A` ends the definitions |
//! | `D` | [`Data`](Message::Data) | topic number and one sample |
//! | `L` `C` | [`Text`](Message::Text) | a line of text, tagged or not |
//! | `S` `O` | [`Sync`](Message::Sync) [`Dropout`](Message::Dropout) | a mark to find the way back; milliseconds lost |
//!
//! # What our logs look like
//! * A topic's format is `uint64_t timestamp; uint32_t generation;` and then the message's fields in order: `f32`
//!   as `float`, `u8`, `bool` as `uint8_t`, an enumeration as the smallest unsigned type that holds it, flags as
//!   `uint32_t`, arrays and vectors as `float[3]`. Fields are packed: there is no padding.
//! * Units are one text info per topic, `units/estimate_state` = `position=m velocity=m/s …`; dimensionless fields
//!   are left out.
//! * Names of enumeration values and flags are one text info per field, `names/flight_status/state` =
//!   `Init=0 IdleGround=1 …`; for flags the number is the bit mask.
//! * Each activation of a runnable is a topic `activation_…`, see [`crate::trace`].
//!
//! Use [`Definitions`] and [`Writer`] to write, [`Reader`] to read. Reading takes logs of any
//! origin. A format whose fields are formats again is unfolded by [`Format::unfolded`].

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
/// The format version written. The reader takes any.
const VERSION: u8 = 1;
/// Magic, version, start time.
const HEADER: usize = 16;
/// Payload of a sync message.
const SYNC_MAGIC: [u8; 8] = [0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12];
/// Two timestamp fields every topic of ours begins with.
const TOPIC_HEAD: &str = "uint64_t timestamp;uint32_t generation;";
/// Bytes of those.
const TOPIC_HEAD_SIZE: usize = 12;
/// Info keys of units begin with this.
pub const UNITS_PREFIX: &str = "units/";
/// Info keys of names of values and flags begin with this.
pub const NAMES_PREFIX: &str = "names/";
/// The largest message the writer makes, header included. It keeps a buffer of this size.
pub const MAX_MESSAGE: usize = 2048;
