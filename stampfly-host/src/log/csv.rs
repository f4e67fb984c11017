//! A table a topic: time stamps in microseconds, then every number, with names as pyulog's `ulog2csv` writes them.

use super::shown;
use crate::flight::{Column, Series};
use stampfly_log::plain;
use std::collections::BTreeMap;
use std::io::{self, Write};

/// Letters of a log's name, and of a topic's, in the name of a table.
const MAX_LETTERS: usize = 80;

/// Names of the files of a log's tables, as pyulog gives them: log, topic, instance. A topic's name
/// comes from the log, which may say anything: of it only letters, digits, `_` and `-` are kept,
/// and no two files have one name, on no file system.
///
/// ```
/// use stampfly_host::log::csv::FileNames;
/// let mut names = FileNames::new("flight");
/// assert_eq!(names.next("esc_status"), "flight_esc_status_0.csv");
/// assert_eq!(names.next("esc_status[2]"), "flight_esc_status_2.csv");
/// assert_eq!(names.next("../../etc/x"), "flight_______etc_x_0.csv");
/// assert_eq!(names.next("ESC_status"), "flight_ESC_status_0-2.csv");
/// ```
#[derive(Clone, Debug)]
pub struct FileNames {
    log: String,
    /// How many files have a name, in small letters.
    used: BTreeMap<String, usize>,
}

impl FileNames {
    /// For the tables of the log with this name.
    #[must_use]
    pub fn new(log: &str) -> Self {
        Self { log: log.chars().take(MAX_LETTERS).collect(), used: BTreeMap::new() }
    }

    /// The name of this topic's file.
    pub fn next(&mut self, topic: &str) -> String {
        let numbered = topic.strip_suffix(']').and_then(|rest| rest.rsplit_once('['));
        let numbered = numbered.and_then(|(name, instance)| Some((name, instance.parse::<u8>().ok()?)));
        let (name, instance) = numbered.unwrap_or((topic, 0));
        let keeps = |letter: char| letter.is_ascii_alphanumeric() || letter == '_' || letter == '-';
        let safe: String = name.chars().map(|c| if keeps(c) { c } else { '_' }).take(MAX_LETTERS).collect();
        let name = format!("{}_{safe}_{instance}", self.log);
        let count = self.used.entry(name.to_lowercase()).or_default();
        *count += 1;
        // What is added cannot be the end of another's name: that is its instance.
        if *count == 1 { format!("{name}.csv") } else { format!("{name}-{count}.csv") }
    }
}

/// Writes a topic as a table. Its header is one line, whatever names the log's fields have: those
/// with commas or quotes in them are quoted as RFC 4180 says, and control characters are shown as
/// [`plain`] shows them.
///
/// ```
/// use stampfly_host::log::csv;
/// use stampfly_host::flight::Series;
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
    let mut columns = series.columns.iter().map(Heading::of);
    columns.try_for_each(|column| write!(out, ",{}", column.name))?;
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

/// What stands above a column.
struct Heading {
    name: String,
}

impl Heading {
    /// The column's name, in quotes where it would be more than one name, or would not begin or end
    /// where it does.
    fn of(column: &Column) -> Self {
        let name = plain(&column.name).to_string();
        let is_bare = !name.contains([',', '"']) && name.trim() == name;
        Self { name: if is_bare { name } else { format!("\"{}\"", name.replace('"', "\"\"")) } }
    }
}
