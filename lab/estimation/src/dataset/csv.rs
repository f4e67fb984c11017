//! Comma-separated numbers with a line of names on top.

use super::error::DatasetErrorKind;

/// A table whose columns have names.
pub(super) struct Table<'a> {
    header: Vec<&'a str>,
    bytes: &'a [u8],
}

/// Where some columns are.
pub(super) struct Columns<const N: usize> {
    names: [&'static str; N],
    pub(super) places: [usize; N],
}

/// One line, split.
pub(super) struct Row<'a> {
    /// Line number in the file, from one.
    pub(super) line: usize,
    /// The cells.
    pub(super) cells: Vec<&'a str>,
}

/// The lines of a text with their numbers, empty ones left out.
pub(super) fn rows(bytes: &[u8]) -> impl Iterator<Item = Result<Row<'_>, DatasetErrorKind>> {
    let lines = bytes.split(|byte| *byte == b'\n').zip(1..);
    lines.filter(|(text, _)| !text.trim_ascii().is_empty()).map(|(text, line)| match std::str::from_utf8(text) {
        Ok(text) => Ok(Row { line, cells: text.split(',').map(str::trim).collect() }),
        Err(_) => Err(broken(line, "text", "not UTF-8")),
    })
}

/// The names in the first line of a text; none where it is no text.
pub(super) fn header(bytes: &[u8]) -> Vec<&str> {
    let first = bytes.split(|byte| *byte == b'\n').next().unwrap_or_default();
    std::str::from_utf8(first).map(|text| text.split(',').map(str::trim).collect()).unwrap_or_default()
}

fn broken(line: usize, field: &str, problem: impl Into<String>) -> DatasetErrorKind {
    DatasetErrorKind::Line { line, field: field.to_owned(), problem: problem.into() }
}

impl<'a> Table<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Result<Self, DatasetErrorKind> {
        let header = rows(bytes).next().ok_or(DatasetErrorKind::Empty)??.cells;
        Ok(Self { header, bytes })
    }

    /// The lines below the names. Each has as many cells as there are names.
    pub(super) fn rows(&self) -> impl Iterator<Item = Result<Row<'a>, DatasetErrorKind>> {
        let columns = self.header.len();
        rows(self.bytes).skip(1).map(move |row| {
            let row = row?;
            if row.cells.len() == columns {
                Ok(row)
            } else {
                let problem = format!("{} cells where the header has {columns}", row.cells.len());
                Err(broken(row.line, "line", problem))
            }
        })
    }

    /// Finds columns that must be there.
    pub(super) fn columns<const N: usize>(&self, names: [&'static str; N]) -> Result<Columns<N>, DatasetErrorKind> {
        let mut places = [0; N];
        for (place, name) in places.iter_mut().zip(names) {
            let found = self.header.iter().position(|known| *known == name);
            *place = found.ok_or_else(|| broken(1, name, "no such column"))?;
        }
        Ok(Columns { names, places })
    }

    /// Finds columns that are all there or none of them.
    pub(super) fn maybe<const N: usize>(
        &self,
        names: [&'static str; N],
    ) -> Result<Option<Columns<N>>, DatasetErrorKind> {
        if names.iter().any(|name| self.header.contains(name)) { self.columns(names).map(Some) } else { Ok(None) }
    }
}

impl<const N: usize> Columns<N> {
    /// The numbers of a row.
    pub(super) fn read(&self, row: &Row<'_>) -> Result<[f64; N], DatasetErrorKind> {
        let mut values = [0.0; N];
        for ((value, name), place) in values.iter_mut().zip(self.names).zip(self.places) {
            *value = row.number(place, name)?;
        }
        Ok(values)
    }
}

impl Row<'_> {
    /// The number in a cell.
    pub(super) fn number(&self, place: usize, name: &str) -> Result<f64, DatasetErrorKind> {
        let cell = self.cells.get(place).ok_or_else(|| broken(self.line, name, "missing"))?;
        cell.parse().map_err(|_| broken(self.line, name, format!("`{cell}` is not a number")))
    }

    /// An instant, from a cell in this many microseconds.
    pub(super) fn micros(
        &self,
        place: usize,
        name: &str,
        unit: f64,
    ) -> Result<stampfly_types::Instant, DatasetErrorKind> {
        let value = self.number(place, name)?;
        // Ten years; beyond that a stamp is damage, and a calculation with it might overflow.
        if (0.0..3.2e8).contains(&(value * unit * 1e-6)) {
            Ok(stampfly_types::Instant::from_micros((value * unit + 0.5) as u64))
        } else {
            Err(broken(self.line, name, format!("{value} is not a time")))
        }
    }
}
