//! CSV logs: a header with the names of the fields, then one line per message of one type.
//!
//! For tools and people, and accurate enough for a replay: every number reads back as the same
//! bits. Enumerations are written as numbers, truth values as 0 or 1, times as microseconds. A file
//! holds one type of message; for a log of several topics use [`ulog`](crate::ulog). Messages with
//! vectors or other fields of several elements cannot be written as CSV.
//!
//! ```
//! use stampfly_log::csv;
//! use stampfly_types::messages::PowerData;
//! let power = PowerData { voltage: 3.9, current: 0.1, power: 0.39 };
//! let mut log = String::new();
//! csv::write(&[power], &mut log)?;
//! assert_eq!(log, "voltage,current,power\n3.9,0.1,0.39\n");
//! assert_eq!(csv::read(&log).expect("the header").collect::<Result<Vec<PowerData>, _>>(), Ok(vec![power]));
//! # Ok::<(), core::fmt::Error>(())
//! ```

use core::fmt::{Result as Written, Write};
use stampfly_types::{Message, text};

/// Reason why a line is not a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CsvError {
    /// Too few or too many columns.
    Columns,
    /// A text that is not a value of its column, or a number that is not finite.
    Value,
}

impl core::fmt::Display for CsvError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> Written {
        f.write_str(match self {
            Self::Columns => "not the columns of this log",
            Self::Value => "no value of its column",
        })
    }
}

impl core::error::Error for CsvError {}

/// Writes the header and a line feed.
///
/// # Errors
/// When `out` fails.
pub fn write_header<M: Message>(out: &mut impl Write) -> Written {
    for (column, field) in M::FIELDS.iter().enumerate() {
        out.write_str(if column == 0 { "" } else { "," })?;
        out.write_str(field.name)?;
    }
    out.write_str("\n")
}

/// Writes one message and a line feed.
///
/// # Errors
/// When `out` fails, or a field has several elements.
pub fn write_line<M: Message>(message: &M, out: &mut impl Write) -> Written {
    for (column, (field, words)) in text::fields::<M>(&message.to_words()).enumerate() {
        out.write_str(if column == 0 { "" } else { "," })?;
        text::write(field, words, text::Style::Numbers, out)?;
    }
    out.write_str("\n")
}

/// Writes a whole log: the header, and one line for each message.
///
/// # Errors
/// Those of [`write_line`].
pub fn write<'m, M: Message>(messages: impl IntoIterator<Item = &'m M>, out: &mut impl Write) -> Written {
    write_header::<M>(out)?;
    messages.into_iter().try_for_each(|message| write_line(message, out))
}

/// Reads a whole log. `None` when it does not begin with the header of this type of message.
pub fn read<M: Message>(text: &str) -> Option<impl Iterator<Item = Result<M, CsvError>>> {
    let mut lines = text.lines();
    lines.next().is_some_and(is_header::<M>).then(|| lines.map(read_line))
}

/// Whether the line is the header of this type of message, with or without a line feed.
#[must_use]
pub fn is_header<M: Message>(line: &str) -> bool {
    line.trim_end().split(',').eq(M::FIELDS.iter().map(|field| field.name))
}

/// Reads one line, with or without a line feed.
///
/// # Errors
/// When the columns are not those of this type of message, or a value is invalid.
pub fn read_line<M: Message>(line: &str) -> Result<M, CsvError> {
    let mut columns = line.trim_end().split(',');
    let message: Option<M> = text::read(|_| columns.next().ok_or(CsvError::Columns))?;
    // `f32::from_str` accepts "inf" and "NaN", which no message may contain.
    let message = message.filter(text::is_finite).ok_or(CsvError::Value)?;
    if columns.next().is_none() { Ok(message) } else { Err(CsvError::Columns) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use stampfly_types::messages::{ImuData, PowerData};
    use std::string::String;

    proptest! {
        #[test]
        fn every_finite_number_reads_back_as_the_same_bits(voltage: u32, current: u32, power: u32) {
            let [voltage, current, power] = [voltage, current, power].map(f32::from_bits);
            let written = PowerData { voltage, current, power };
            let mut line = String::new();
            write_line(&written, &mut line).expect("a string takes everything");
            let read = read_line::<PowerData>(&line).map(|read| read.to_words());
            if text::is_finite(&written) {
                prop_assert_eq!(read, Ok(written.to_words()));
            } else {
                prop_assert_eq!(read, Err(CsvError::Value));
            }
        }

        #[test]
        fn no_line_is_a_panic(line in "[-0-9a-z.,\r\n]{0,40}") {
            let _ = read_line::<PowerData>(&line);
        }
    }

    #[test]
    fn wrong_columns_are_refused() {
        assert_eq!(read_line::<PowerData>("1,2"), Err(CsvError::Columns));
        assert_eq!(read_line::<PowerData>("1,2,3,4"), Err(CsvError::Columns));
        assert_eq!(read_line::<PowerData>("1,2,x"), Err(CsvError::Value));
        assert!(is_header::<PowerData>("voltage,current,power\r\n") && !is_header::<PowerData>("voltage,current"));
        assert!(write_line(&ImuData::default(), &mut String::new()).is_err(), "vectors");
    }
}
