//! Writing a log, message by message, to a sink.
//!
//! A log has two parts: definitions (facts, parameters, formats) and data. [`Definitions`] writes
//! the first and turns into a [`Writer`] for the second, so that late definitions do not compile.
//!
//! The writer neither allocates nor blocks. A sink that cannot keep up refuses whole messages. The
//! writer counts them and writes a dropout mark before the next message that the sink accepts, so
//! that a reader sees the gap and its length. When no loss is acceptable, stop at the first error.

use super::Schema;
use super::cursor::Cursor;
use super::topic::WordsError;
use super::{
    FlagBits, HEADER, Level, MAGIC, MAX_MESSAGE, NAMES_PREFIX, ParameterValue, SYNC_MAGIC, Sample, Sink, UNITS_PREFIX,
    VERSION, WriteError, put_u16,
};
use crate::trace::{self, TOPIC_PREFIX};
use core::fmt::{self, Write};
use stampfly_types::{ActivationRecord, FieldKind, Instant, leaves};

/// Length of the size and the type before each payload.
const MESSAGE_HEAD: usize = 3;

/// Bytes of a blob in one message; the rest of [`MAX_MESSAGE`] is for its key.
const BLOB_PART: usize = MAX_MESSAGE - 256;

/// Builds messages in its buffer and passes them to the sink.
struct Output<S> {
    sink: S,
    buffer: [u8; MAX_MESSAGE],
}

impl<S: Sink> Output<S> {
    /// Builds one message and writes it.
    #[inline]
    fn message(&mut self, kind: u8, body: impl FnOnce(&mut Cursor<'_>)) -> Result<(), WriteError<S::Error>> {
        self.try_message(kind, |out| {
            body(out);
            Ok(())
        })
    }

    /// Builds one message and writes it, unless building fails.
    #[inline]
    fn try_message(
        &mut self,
        kind: u8,
        body: impl FnOnce(&mut Cursor<'_>) -> Result<(), WordsError>,
    ) -> Result<(), WriteError<S::Error>> {
        let mut cursor = Cursor::new(&mut self.buffer);
        cursor.put(&[0, 0, kind]);
        body(&mut cursor).map_err(|error| match error {
            WordsError::Count => WriteError::WordCount,
            WordsError::Range(field) => WriteError::OutOfRange(field),
        })?;
        let length = cursor.finish().ok_or(WriteError::TooLong)?;
        // The size is known only after the body has been written; `MAX_MESSAGE` fits into 16 bits.
        put_u16(&mut self.buffer, (length - MESSAGE_HEAD) as u16);
        self.sink.write(self.buffer.get(..length).unwrap_or_default()).map_err(WriteError::Sink)
    }

    /// Writes an info with this key. `text` writes the value, once for its length and once for
    /// real.
    fn info(
        &mut self,
        key: fmt::Arguments<'_>,
        text: impl Fn(&mut dyn Write) -> fmt::Result,
    ) -> Result<(), WriteError<S::Error>> {
        let mut length = Count(0);
        let mut key_length = Count(0);
        // `Count` and `Cursor` never fail. An overflow is reported when the message is finished.
        let _ = text(&mut length);
        let _ = write!(key_length, "char[{}] {key}", length.0);
        let key_length = u8::try_from(key_length.0).map_err(|_| WriteError::TooLong)?;
        self.message(b'I', |out| {
            out.put(&[key_length]);
            let _ = write!(out, "char[{}] {key}", length.0);
            let _ = text(out);
        })
    }

    fn parameter(&mut self, name: &str, value: ParameterValue) -> Result<(), WriteError<S::Error>> {
        let (type_name, bytes) = match value {
            ParameterValue::Float(value) => ("float", value.to_le_bytes()),
            ParameterValue::Int32(value) => ("int32_t", value.to_le_bytes()),
        };
        let length = u8::try_from(type_name.len() + 1 + name.len()).map_err(|_| WriteError::TooLong)?;
        self.message(b'P', |out| {
            out.put(&[length]);
            let _ = write!(out, "{type_name} {name}");
            out.put(&bytes);
        })
    }
}

/// The first part of a log: facts and parameters.
///
/// ```
/// use stampfly_log::ulog::{Definitions, Ram, Topic};
/// use stampfly_types::{Instant, Message, messages::ImuData};
///
/// const TOPICS: &[Topic] = &[Topic { name: "sensor_imu", fields: ImuData::FIELDS }];
/// let mut memory = [0; 4096];
/// let mut log = Definitions::start(Ram::new(&mut memory), Instant::ZERO)?;
/// log.info("sys_name", "StampFly")?;
/// log.parameter("rate_roll_p", 0.6.into())?;
/// let log = log.data(TOPICS)?;
/// assert_eq!(log.sink().written()[..4], *b"ULog");
/// # Ok::<(), stampfly_log::ulog::WriteError<stampfly_log::ulog::Full>>(())
/// ```
pub struct Definitions<S>(Output<S>);

impl<S: Sink> Definitions<S> {
    /// Starts a log at the instant `at`.
    ///
    /// # Errors
    /// When the sink refuses the first bytes.
    pub fn start(mut sink: S, at: Instant) -> Result<Self, WriteError<S::Error>> {
        let mut header = [0; HEADER];
        let mut cursor = Cursor::new(&mut header);
        cursor.put(&MAGIC);
        cursor.put(&[VERSION]);
        cursor.put(&at.as_micros().to_le_bytes());
        sink.write(&header).map_err(WriteError::Sink)?;
        let mut output = Output { sink, buffer: [0; MAX_MESSAGE] };
        output.message(b'B', |out| {
            let flags = FlagBits::default();
            out.put(&flags.compatible);
            out.put(&flags.incompatible);
            flags.appended.iter().for_each(|offset| out.put(&offset.to_le_bytes()));
        })?;
        Ok(Self(output))
    }

    /// Writes a fact. Viewers display `sys_name`, `ver_hw`, `ver_sw` and `ver_sw_branch`.
    ///
    /// # Errors
    /// When the sink refuses, or key and text together are too long.
    pub fn info(&mut self, key: &str, text: &str) -> Result<(), WriteError<S::Error>> {
        self.0.info(format_args!("{key}"), |out| out.write_str(text))
    }

    /// Writes the value of a parameter at the start.
    ///
    /// # Errors
    /// When the sink refuses, or the name is longer than about 245 bytes.
    pub fn parameter(&mut self, name: &str, value: ParameterValue) -> Result<(), WriteError<S::Error>> {
        self.0.parameter(name, value)
    }

    /// Writes the descriptions of the topics and starts the data part.
    ///
    /// The number of a topic, for [`Writer::sample`], is its index in the schema. Topics with the
    /// same name, such as those of two range finders, are instances: the first is instance 0, and
    /// viewers group them.
    ///
    /// # Errors
    /// When the sink refuses, when a sample or a description is longer than [`MAX_MESSAGE`], when
    /// two topics with the same name have different fields, or with more than 65 536 topics or 256
    /// of one name.
    pub fn data<T: Schema>(mut self, schema: T) -> Result<Writer<S, T>, WriteError<S::Error>> {
        let output = &mut self.0;
        let topics = || (0..).map_while(|index| schema.topic(index));
        let activations = || (0..).map_while(|index| schema.activation(index));
        // Number of topics with the same name before this one.
        let before =
            |index: usize, name: &str| topics().take(index).filter(move |earlier| earlier.name == name).count();
        for (index, topic) in topics().enumerate() {
            // Two bytes for the topic's number.
            if topic.size() + MESSAGE_HEAD + 2 > MAX_MESSAGE {
                return Err(WriteError::TooLong);
            }
            if let Some(first) = topics().take(index).find(|first| first.name == topic.name) {
                // Another instance: it uses the descriptions of the first one.
                if !first.is_stored_as(&topic) {
                    return Err(WriteError::TwoFormats(topic.name));
                }
                continue;
            }
            output.message(b'F', |out| {
                let _ = write!(out, "{}:", topic.name);
                let _ = topic.write_fields(out);
            })?;
            let with_unit = || leaves(topic.fields).filter(|leaf| !leaf.unit.is_empty());
            if with_unit().next().is_some() {
                let units = |out: &mut dyn Write| separated(with_unit().map(|leaf| (leaf.name, leaf.unit)), out);
                output.info(format_args!("{UNITS_PREFIX}{}", topic.name), units)?;
            }
            for leaf in leaves(topic.fields) {
                if let FieldKind::Enum(names) | FieldKind::Flags(names) = leaf.kind {
                    let key = format_args!("{NAMES_PREFIX}{}/{}", topic.name, leaf.name);
                    output.info(key, |out| separated(names.iter().copied(), out))?;
                }
            }
        }
        for activation in activations() {
            output.message(b'F', |out| {
                let _ = write!(out, "{TOPIC_PREFIX}{}:", activation.name);
                let _ = activation.write_fields(out);
            })?;
        }
        let names = topics().map(|topic| ("", topic.name));
        let names = names.chain(activations().map(|activation| (TOPIC_PREFIX, activation.name)));
        for (index, (prefix, name)) in names.enumerate() {
            let id = u16::try_from(index).map_err(|_| WriteError::TooManyTopics)?;
            let instance = if prefix.is_empty() { before(index, name) } else { 0 };
            let instance = u8::try_from(instance).map_err(|_| WriteError::TooManyTopics)?;
            output.message(b'A', |out| {
                out.put(&[instance]);
                out.put(&id.to_le_bytes());
                let _ = write!(out, "{prefix}{name}");
            })?;
        }
        let count = topics().count();
        Ok(Writer { output: self.0, schema, topics: count, losing_since: None, lost: 0 })
    }
}

/// The second part of a log: its data.
///
/// Made by [`Definitions::data`]. The [crate documentation](crate) contains an example.
pub struct Writer<S, T> {
    output: Output<S>,
    schema: T,
    /// Number of topics. The numbers of activations follow.
    topics: usize,
    losing_since: Option<Instant>,
    lost: u32,
}

impl<S: Sink, T: Schema> Writer<S, T> {
    /// Writes one sample of the topic with this index in the schema.
    ///
    /// # Errors
    /// When the sink refuses (counted as lost), when there is no such topic, or when the words are
    /// not a sample of this topic.
    pub fn sample(&mut self, topic: usize, sample: &Sample<'_>) -> Result<(), WriteError<S::Error>> {
        let schema = self.schema.topic(topic).ok_or(WriteError::UnknownTopic)?;
        self.record(sample.at, b'D', |out| {
            out.put(&(topic as u16).to_le_bytes());
            schema.encode(sample, out)
        })
    }

    /// Writes one activation.
    ///
    /// # Errors
    /// When the sink refuses (counted as lost), when no activation topic has this index, or when
    /// the number of inputs differs.
    pub fn activation(&mut self, record: &ActivationRecord) -> Result<(), WriteError<S::Error>> {
        let mut topics = (0..).map_while(|index| self.schema.activation(index)).enumerate();
        let (place, topic) = topics.find(|(_, topic)| topic.index == record.index).ok_or(WriteError::UnknownTopic)?;
        if topic.inputs != record.inputs().len() {
            return Err(WriteError::WordCount);
        }
        // `data` has numbered all topics and activations with 16 bits.
        let id = (self.topics + place) as u16;
        self.record(record.now, b'D', |out| {
            out.put(&id.to_le_bytes());
            trace::encode(record, &mut |bytes| out.put(bytes));
            Ok(())
        })
    }

    /// Writes a line of text.
    ///
    /// # Errors
    /// When the sink refuses (counted as lost) or the line is too long.
    pub fn text(&mut self, level: Level, at: Instant, line: &str) -> Result<(), WriteError<S::Error>> {
        self.record(at, b'L', |out| {
            out.put(&[level.to_char()]);
            out.put(&at.as_micros().to_le_bytes());
            out.put(line.as_bytes());
            Ok(())
        })
    }

    /// Writes the new value of a parameter, in force from here on.
    ///
    /// # Errors
    /// When the sink refuses, or the name is longer than about 245 bytes.
    pub fn parameter(&mut self, name: &str, value: ParameterValue) -> Result<(), WriteError<S::Error>> {
        self.output.parameter(name, value)
    }

    /// Writes bytes of any length under a key, in several messages: an image, a state. Other
    /// programs ignore them.
    ///
    /// # Errors
    /// When the sink refuses (counted as lost) or the key is longer than about 200 bytes. The parts
    /// before the error have been written.
    pub fn blob(&mut self, at: Instant, key: &str, bytes: &[u8]) -> Result<(), WriteError<S::Error>> {
        for (index, part) in bytes.chunks(BLOB_PART).enumerate() {
            let mut length = Count(0);
            let _ = write!(length, "uint8_t[{}] {key}", part.len());
            let key_length = u8::try_from(length.0).map_err(|_| WriteError::TooLong)?;
            self.record(at, b'M', |out| {
                out.put(&[u8::from(index > 0), key_length]);
                let _ = write!(out, "uint8_t[{}] {key}", part.len());
                out.put(part);
                Ok(())
            })?;
        }
        Ok(())
    }

    /// Records a loss upstream of this writer. A dropout mark precedes the next message.
    pub fn mark_loss(&mut self, at: Instant) {
        self.losing_since.get_or_insert(at);
    }

    /// Writes a mark at which a reader resynchronises after damage. Once a second is sufficient.
    ///
    /// # Errors
    /// When the sink refuses.
    pub fn sync(&mut self) -> Result<(), WriteError<S::Error>> {
        self.output.message(b'S', |out| out.put(&SYNC_MAGIC))
    }

    /// Number of messages that the sink has refused.
    #[must_use]
    pub const fn lost(&self) -> u32 {
        self.lost
    }

    /// The sink.
    #[must_use]
    pub const fn sink(&self) -> &S {
        &self.output.sink
    }

    /// Ends the log and returns the sink. Writes nothing, because the log is complete at any time.
    #[must_use]
    pub fn into_sink(self) -> S {
        self.output.sink
    }

    /// Writes a message with the stamp `at`, preceded by a dropout mark if messages were lost.
    #[inline]
    fn record(
        &mut self,
        at: Instant,
        kind: u8,
        body: impl FnOnce(&mut Cursor<'_>) -> Result<(), WordsError>,
    ) -> Result<(), WriteError<S::Error>> {
        let mut result = Ok(());
        if let Some(since) = self.losing_since {
            // At least a millisecond: a dropout of zero would not show as a gap.
            let millis = u16::try_from(at.since(since).as_micros() / 1_000).unwrap_or(u16::MAX).max(1);
            result = self.output.message(b'O', |out| out.put(&millis.to_le_bytes()));
            if result.is_ok() {
                self.losing_since = None;
            }
        }
        if result.is_ok() {
            result = self.output.try_message(kind, body);
        }
        // Other errors are mistakes of the caller, not losses.
        if let Err(WriteError::Sink(_)) = result {
            self.lost = self.lost.saturating_add(1);
            self.losing_since.get_or_insert(at);
        }
        result
    }
}

/// Counts the bytes written to it.
struct Count(usize);

impl Write for Count {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0 += text.len();
        Ok(())
    }
}

/// Writes `key=value key=value …`.
fn separated<K: fmt::Display, V: fmt::Display>(
    pairs: impl Iterator<Item = (K, V)>,
    out: &mut dyn Write,
) -> fmt::Result {
    for (index, (key, value)) in pairs.enumerate() {
        let space = if index == 0 { "" } else { " " };
        write!(out, "{space}{key}={value}")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ulog::{Message, Reader};
    use std::vec::Vec;

    struct Bytes(Vec<u8>);
    impl Sink for Bytes {
        type Error = core::convert::Infallible;
        fn write(&mut self, bytes: &[u8]) -> Result<(), Self::Error> {
            self.0.extend_from_slice(bytes);
            Ok(())
        }
    }

    /// A file that `pyulog` 1.3.0 reads without errors, made manually from the format description.
    /// Its topic has no generation and is therefore not one of the stack's, so format and data are
    /// read as messages.
    #[test]
    fn a_hand_built_log_is_written_byte_for_byte() {
        let mut log = Definitions::start(Bytes(Vec::new()), Instant::from_micros(1_000)).unwrap();
        log.0
            .message(b'F', |out| {
                out.put(b"attitude:uint64_t timestamp;float[4] q;float roll;uint8_t mode;uint8_t[3] _padding0;");
            })
            .unwrap();
        log.info("sys_name", "xcopt").unwrap();
        log.info("ver_hw", "SITL").unwrap();
        log.parameter("RATE_P", 0.2.into()).unwrap();
        log.parameter("CTL_FREQ", 4_000.into()).unwrap();
        log.0.message(b'A', |out| out.put(b"\0\0\0attitude")).unwrap();
        let mut log = log.data(&[][..]).unwrap();
        for (at, roll) in [(1_000u64, 0.0f32), (3_500, 0.1), (6_000, 0.2)] {
            if at == 3_500 {
                log.sync().unwrap();
            }
            log.record(Instant::from_micros(at), b'D', |out| {
                out.put(&[0, 0]);
                out.put(&at.to_le_bytes());
                [1.0f32, 0.0, 0.0, 0.0, roll].iter().for_each(|value| out.put(&value.to_le_bytes()));
                out.put(&[2]);
                Ok(())
            })
            .unwrap();
        }
        log.text(Level::Info, Instant::from_micros(3_000), "armed").unwrap();
        log.output.message(b'O', |out| out.put(&12u16.to_le_bytes())).unwrap();
        log.parameter("RATE_P", 0.3.into()).unwrap();
        let written = log.into_sink().0;
        let expected = include_bytes!("../../tests/hand_built.ulog");
        assert_eq!(written, expected);
        assert!(Reader::new(&written).unwrap().all(|message| !matches!(message, Err(_) | Ok(Message::Unknown { .. }))));
    }
}
