//! The table of a stick file: parsing with line numbers in errors, and writing.

use super::error::{StickError, StickErrorKind, clipped};
use core::fmt;
use stampfly_types::Duration;
use stampfly_types::messages::{FlightMode, PilotInput};
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

/// Largest size of a file, bytes: an hour at 50 Hz with 90 bytes per line, rounded up.
pub const MOST_BYTES: usize = 16 << 20;
/// Largest number of rows: an hour at 50 Hz plus a tenth.
pub const MOST_ROWS: usize = 200_000;
/// Largest length of a line, bytes. Ten columns with all digits of a double need 250.
pub const LONGEST_LINE: usize = 1_000;
/// Largest time of a row, s.
pub const LATEST: f64 = 3_600.0;

/// Names of the flight modes in a file.
pub const MODES: [(&str, FlightMode); 4] = [
    ("stabilize", FlightMode::Stabilize),
    ("acro", FlightMode::Acro),
    ("althold", FlightMode::AltHold),
    ("poshold", FlightMode::PosHold),
];

/// The flight mode with this name.
#[must_use]
pub fn mode_named(name: &str) -> Option<FlightMode> {
    MODES.iter().find(|(known, _)| *known == name).map(|(_, mode)| *mode)
}

/// The name of a flight mode in a file.
pub(super) fn name_of(mode: FlightMode) -> &'static str {
    MODES.iter().find(|(_, known)| *known == mode).map_or("", |(name, _)| name)
}

/// All columns: required ones first, then optional ones.
const COLUMNS: [&str; 10] = ["t", "throttle", "roll", "pitch", "yaw", "mode", "arm", "flip", "kill", "land"];
const REQUIRED: usize = 7;
/// Index of the mode in [`COLUMNS`].
const MODE: usize = 5;

/// Stick and switch positions from an instant on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Time since the beginning of the file.
    pub at: Duration,
    /// Sticks, mode, arm switch and kill switch.
    pub input: PilotInput,
    /// Requests a flip on its rising edge.
    pub flip: bool,
    /// Requests a landing on its rising edge.
    pub land: bool,
}

/// A stick file: at least one row, in order of time. Rows that repeat the previous one are dropped,
/// except for the last, which defines the length.
///
/// ```
/// use stampfly_sim::sticks::{StickErrorKind, StickFile};
/// let text = "t,mode,arm,throttle,roll,pitch,yaw\n0,acro,1,-1,0,0,0\n0.5,acro,1,0.25,0,0,1\n";
/// let file = StickFile::parse(text.as_bytes())?;
/// assert_eq!((file.rows().len(), file.rows()[1].input.yaw), (2, 1.0));
/// assert_eq!(StickFile::parse(file.to_string().as_bytes())?, file);
/// let error = StickFile::parse(b"t,throttle\n0,0").unwrap_err();
/// assert_eq!((error.line, error.kind), (1, StickErrorKind::MissingColumn("roll")));
/// # Ok::<(), stampfly_sim::sticks::StickError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct StickFile {
    rows: Vec<Row>,
}

impl StickFile {
    /// Reads a file.
    ///
    /// # Errors
    /// If the file cannot be read or is not a stick file.
    pub fn read(path: &Path) -> Result<Self, StickError> {
        let unreadable = |error: std::io::Error| StickErrorKind::Unreadable(error.to_string()).at(0);
        let mut bytes = Vec::new();
        // Reading one byte more than allowed shows whether the file is too large.
        let most = MOST_BYTES as u64 + 1;
        File::open(path).map_err(unreadable)?.take(most).read_to_end(&mut bytes).map_err(unreadable)?;
        Self::parse(&bytes)
    }

    /// Parses the content of a file.
    ///
    /// # Errors
    /// The line and the error in it.
    pub fn parse(bytes: &[u8]) -> Result<Self, StickError> {
        let mut lines = Lines { rest: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), number: 0, taken: 0 };
        let header = lines.next().transpose()?;
        let (number, header) = header.ok_or(StickErrorKind::Empty.at(0))?;
        let columns = columns(header).map_err(|kind| kind.at(number))?;
        let (mut rows, mut held) = (Vec::<Row>::new(), None::<Row>);
        for line in lines {
            let (number, line) = line?;
            let row = read_row(&columns, line).map_err(|kind| kind.at(number))?;
            if held.as_ref().or(rows.last()).is_some_and(|above| row.at < above.at) {
                let text = line.split(',').nth(place_of(&columns, 0)).unwrap_or_default();
                return Err(StickErrorKind::GoesBack(clipped(text.trim())).at(number));
            }
            // Held back: only the last repetition is kept, for the length of the file.
            if rows.last().is_some_and(|above| row.repeats(above)) {
                held = Some(row);
            } else if rows.len() == MOST_ROWS {
                return Err(StickErrorKind::TooManyRows.at(number));
            } else {
                rows.push(row);
                held = None;
            }
        }
        rows.extend(held);
        if rows.is_empty() { Err(StickErrorKind::NoRows.at(0)) } else { Ok(Self { rows }) }
    }

    /// Sticks drawn from a seed: any position and mode, for 5 to 25 s, with hover throttle at the
    /// centre.
    ///
    /// ```
    /// use stampfly_sim::sticks::StickFile;
    /// let drawn = StickFile::drawn(7);
    /// assert_eq!(StickFile::parse(drawn.to_string().as_bytes()), Ok(drawn));
    /// ```
    #[must_use]
    pub fn drawn(seed: u64) -> Self {
        Self { rows: super::drawn::rows(seed) }
    }

    /// The rows in order of time; at least one.
    #[must_use]
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// The first row.
    #[must_use]
    pub fn first(&self) -> Row {
        self.rows.first().copied().unwrap_or_default()
    }

    /// The last row.
    #[must_use]
    pub fn last(&self) -> Row {
        self.rows.last().copied().unwrap_or_default()
    }

    /// The modes of its rows, each once, in order of appearance.
    #[must_use]
    pub fn modes(&self) -> Vec<FlightMode> {
        let mut modes = Vec::new();
        for row in &self.rows {
            if !modes.contains(&row.input.mode) {
                modes.push(row.input.mode);
            }
        }
        modes
    }

    /// Each row with its duration; that of the last row is 0.
    pub(super) fn spans(&self) -> impl Iterator<Item = (&Row, Duration)> {
        let next = self.rows.iter().skip(1).map(|row| row.at).chain([self.last().at]);
        self.rows
            .iter()
            .zip(next)
            .map(|(row, next)| (row, Duration::from_micros(next.as_micros() - row.at.as_micros())))
    }
}

impl Row {
    /// True if it equals `above` except for the time.
    fn repeats(&self, above: &Self) -> bool {
        Self { at: above.at, ..*self } == *above
    }
}

/// Writes the table, without switch columns that are always 0.
impl fmt::Display for StickFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_used = |used: fn(&Row) -> bool| self.rows.iter().any(used);
        let switches: [(&str, fn(&Row) -> bool); 3] =
            [("flip", |row| row.flip), ("kill", |row| row.input.kill), ("land", |row| row.land)];
        let switches = switches.map(|(name, level)| (name, level, is_used(level)));
        f.write_str(&COLUMNS[..REQUIRED].join(","))?;
        for (name, ..) in switches.iter().filter(|(.., is_used)| *is_used) {
            write!(f, ",{name}")?;
        }
        for row in &self.rows {
            let Row { at, input: PilotInput { throttle, roll, pitch, yaw, mode, arm, .. }, .. } = row;
            let [seconds, rest] = [at.as_micros() / 1_000_000, at.as_micros() % 1_000_000];
            let time = if rest == 0 { seconds.to_string() } else { format!("{seconds}.{rest:06}") };
            let time = if rest == 0 { &time } else { time.trim_end_matches('0') };
            let mode = name_of(*mode);
            write!(f, "\n{time},{throttle},{roll},{pitch},{yaw},{mode},{}", u8::from(*arm))?;
            for (_, level, _) in switches.iter().filter(|(.., is_used)| *is_used) {
                write!(f, ",{}", u8::from(level(row)))?;
            }
        }
        writeln!(f)
    }
}

/// Iterator over lines that are not blank, with their numbers from 1.
struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
    taken: usize,
}

impl<'a> Iterator for Lines<'a> {
    type Item = Result<(usize, &'a str), StickError>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.rest.is_empty() {
            self.number += 1;
            // The search is limited to the longest line, so that a line of megabytes is refused
            // without scanning all of it.
            let head = self.rest.get(..=LONGEST_LINE).unwrap_or(self.rest);
            let end = head.iter().position(|byte| *byte == b'\n');
            if end.is_none() && head.len() > LONGEST_LINE {
                return Some(Err(StickErrorKind::LineTooLong.at(self.number)));
            }
            let (line, rest) = self.rest.split_at(end.unwrap_or(head.len()));
            if self.taken + line.len() > MOST_BYTES {
                return Some(Err(StickErrorKind::TooLarge.at(self.number)));
            }
            self.rest = rest.strip_prefix(b"\n").unwrap_or(rest);
            self.taken += line.len() + 1;
            let line = line.strip_suffix(b"\r").unwrap_or(line);
            match core::str::from_utf8(line) {
                Ok(line) if line.trim().is_empty() => {}
                Ok(line) => return Some(Ok((self.number, line))),
                Err(_) => return Some(Err(StickErrorKind::NotText.at(self.number))),
            }
        }
        None
    }
}

/// For each field of a row, the index of its column in [`COLUMNS`].
fn columns(header: &str) -> Result<Vec<usize>, StickErrorKind> {
    let mut columns = Vec::new();
    for name in header.split(',').map(str::trim) {
        let known = COLUMNS.iter().position(|known| *known == name);
        let column = known.ok_or_else(|| StickErrorKind::UnknownColumn(clipped(name)))?;
        if columns.contains(&column) {
            return Err(StickErrorKind::RepeatedColumn(COLUMNS[column]));
        }
        columns.push(column);
    }
    match (0..REQUIRED).find(|column| !columns.contains(column)) {
        Some(column) => Err(StickErrorKind::MissingColumn(COLUMNS[column])),
        None => Ok(columns),
    }
}

/// Position of a column in a row.
fn place_of(columns: &[usize], column: usize) -> usize {
    columns.iter().position(|known| *known == column).unwrap_or_default()
}

fn read_row(columns: &[usize], line: &str) -> Result<Row, StickErrorKind> {
    let found = line.split(',').count();
    if found != columns.len() {
        return Err(StickErrorKind::FieldCount { found, wanted: columns.len() });
    }
    let mut row = Row::default();
    let Row { at, input, flip, land } = &mut row;
    for (column, text) in columns.iter().zip(line.split(',').map(str::trim)) {
        match *column {
            0 => *at = time(text)?,
            1 => input.throttle = stick(COLUMNS[1], text)?,
            2 => input.roll = stick(COLUMNS[2], text)?,
            3 => input.pitch = stick(COLUMNS[3], text)?,
            4 => input.yaw = stick(COLUMNS[4], text)?,
            MODE => input.mode = mode_named(text).ok_or_else(|| StickErrorKind::Mode(clipped(text)))?,
            6 => input.arm = level(COLUMNS[6], text)?,
            7 => *flip = level(COLUMNS[7], text)?,
            8 => input.kill = level(COLUMNS[8], text)?,
            _ => *land = level(COLUMNS[9], text)?,
        }
    }
    Ok(row)
}

fn time(text: &str) -> Result<Duration, StickErrorKind> {
    // NaN and infinity are in no range, so they are refused.
    let seconds = text.parse().ok().filter(|seconds: &f64| (0.0..=LATEST).contains(seconds));
    let seconds = seconds.ok_or_else(|| StickErrorKind::Number { column: COLUMNS[0], text: clipped(text) })?;
    Ok(Duration::from_micros((seconds * 1e6).round() as u64))
}

fn stick(column: &'static str, text: &str) -> Result<f32, StickErrorKind> {
    let value = text.parse().ok().filter(|value: &f32| (-1.0..=1.0).contains(value));
    value.ok_or_else(|| StickErrorKind::Number { column, text: clipped(text) })
}

fn level(column: &'static str, text: &str) -> Result<bool, StickErrorKind> {
    match text {
        "0" => Ok(false),
        "1" => Ok(true),
        _ => Err(StickErrorKind::Level { column, text: clipped(text) }),
    }
}

#[cfg(test)]
mod tests;
