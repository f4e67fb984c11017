//! A table a topic: time stamps in microseconds, then every number, with names as pyulog's `ulog2csv` writes them.

use super::shown;
use stampfly_lab::flight::Series;
use std::io::{self, Write};

/// Writes a topic as a table.
///
/// ```
/// use stampfly_host::log::csv;
/// use stampfly_lab::flight::Series;
/// use stampfly_types::{Instant, Message, messages::PowerData};
///
/// let mut series = Series::of_fields(PowerData::FIELDS);
/// let sample = PowerData { voltage: 3.5, current: 2.0, power: 7.25 };
/// series.push_words(Instant::from_micros(10), PowerData::FIELDS, &sample.to_words());
/// let mut table = Vec::new();
/// csv::write(&series, &mut table).unwrap();
/// assert_eq!(table, b"timestamp,voltage,current,power\n10,3.5,2,7.25\n");
/// ```
///
/// # Errors
/// When `out` does not take it.
pub fn write(series: &Series, out: &mut impl Write) -> io::Result<()> {
    write!(out, "timestamp")?;
    series.columns.iter().try_for_each(|column| write!(out, ",{}", column.name))?;
    writeln!(out)?;
    for (row, at) in series.at.iter().enumerate() {
        write!(out, "{}", at.as_micros())?;
        for column in &series.columns {
            write!(out, ",{}", column.values.get(row).map_or_else(String::new, |value| shown(*value)))?;
        }
        writeln!(out)?;
    }
    Ok(())
}
