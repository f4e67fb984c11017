//! NumPy archives: a zip of arrays. Only what the data sets use: little-endian numbers and fixed-width text, one or
//! two dimensions, either order.

use super::error::DatasetErrorKind;
use std::collections::BTreeMap;
use std::io::{Cursor, Read};

/// Bytes of all arrays of a recording, unpacked; a damaged or hostile archive may claim to have
/// more. BROAD's have 8 million.
const MAX_BYTES: u64 = 1 << 25;
/// Numbers in all arrays. BROAD's have one million.
const MAX_NUMBERS: usize = 1 << 22;
/// Texts in all arrays: names of columns.
const MAX_TEXTS: usize = 1 << 14;

/// What may still be read of a file.
pub(super) struct Budget {
    bytes: u64,
    numbers: usize,
    texts: usize,
}

impl Default for Budget {
    fn default() -> Self {
        Self { bytes: MAX_BYTES, numbers: MAX_NUMBERS, texts: MAX_TEXTS }
    }
}

impl Budget {
    /// Unpacks all of it.
    pub(super) fn read(&mut self, from: impl Read) -> Result<Vec<u8>, String> {
        let mut content = Vec::new();
        from.take(self.bytes + 1).read_to_end(&mut content).map_err(|error| error.to_string())?;
        self.bytes = self.bytes.checked_sub(content.len() as u64).ok_or("larger than any recording")?;
        Ok(content)
    }

    /// So many numbers will be read.
    pub(super) fn elements(&mut self, count: usize) -> Result<(), &'static str> {
        self.numbers = self.numbers.checked_sub(count).ok_or("larger than any recording")?;
        Ok(())
    }

    fn texts(&mut self, count: usize) -> Result<(), &'static str> {
        self.texts = self.texts.checked_sub(count).ok_or("larger than any recording")?;
        Ok(())
    }
}

/// The elements of an array, first row first.
pub(super) enum Elements {
    /// Numbers of any type.
    Numbers(Vec<f64>),
    /// Text.
    Text(Vec<String>),
}

/// One array.
pub(super) struct Array {
    /// Number of rows: the first dimension, one for a scalar.
    pub(super) rows: usize,
    /// Number of columns: the second dimension, one where there is none.
    pub(super) columns: usize,
    /// `rows × columns` elements.
    pub(super) elements: Elements,
}

pub(super) type Arrays = BTreeMap<String, Array>;

pub(super) fn broken(field: &str, problem: impl ToString) -> DatasetErrorKind {
    DatasetErrorKind::Array { field: field.to_owned(), problem: problem.to_string() }
}

/// Reads every array of an archive.
pub(super) fn read(bytes: &[u8]) -> Result<Arrays, DatasetErrorKind> {
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|error| broken("archive", error))?;
    let mut arrays = BTreeMap::new();
    let mut budget = Budget::default();
    for index in 0..archive.len() {
        let entry = archive.by_index(index).map_err(|error| broken("archive", error))?;
        let name = entry.name().map_err(|error| broken("archive", error))?.into_owned();
        let name = name.strip_suffix(".npy").unwrap_or(&name).to_owned();
        let content = budget.read(entry).map_err(|problem| broken(&name, problem))?;
        let array = parse(&content, &mut budget).map_err(|problem| broken(&name, problem))?;
        arrays.insert(name, array);
    }
    Ok(arrays)
}

/// Takes one `.npy` file apart.
fn parse(content: &[u8], budget: &mut Budget) -> Result<Array, &'static str> {
    let rest = content.strip_prefix(b"\x93NUMPY").ok_or("not a NumPy array")?;
    let (version, rest) = rest.split_first_chunk::<2>().ok_or("cut off")?;
    let (length, rest) = match version[0] {
        1 => rest.split_first_chunk().map(|(length, rest)| (usize::from(u16::from_le_bytes(*length)), rest)),
        _ => rest.split_first_chunk().map(|(length, rest)| (u32::from_le_bytes(*length) as usize, rest)),
    }
    .ok_or("cut off")?;
    let (header, data) = rest.split_at_checked(length).ok_or("cut off")?;
    let header = std::str::from_utf8(header).map_err(|_| "header is not text")?;

    let kind =
        value_of(header, "descr").and_then(|text| text.strip_prefix('\'')?.split('\'').next()).ok_or("no type")?;
    let by_columns = value_of(header, "fortran_order").ok_or("no order")?.starts_with("True");
    let shape =
        value_of(header, "shape").and_then(|text| text.strip_prefix('(')?.split(')').next()).ok_or("no shape")?;
    let shape = shape.split(',').map(str::trim).filter(|text| !text.is_empty()).map(str::parse);
    let shape: Vec<usize> = shape.collect::<Result<_, _>>().map_err(|_| "shape is not numbers")?;
    let (rows, columns) = match shape[..] {
        [] => (1, 1),
        [rows] => (rows, 1),
        [rows, columns] => (rows, columns),
        _ => return Err("more than two dimensions"),
    };
    let count = rows.checked_mul(columns).ok_or("shape is too large")?;

    let mut number = |size: usize, read: fn(&[u8]) -> Option<f64>| -> Result<Elements, &'static str> {
        if data.len() / size < count {
            return Err(SHORT);
        }
        budget.elements(count)?;
        let values = data.chunks_exact(size).take(count).map_while(read).collect();
        Ok(Elements::Numbers(ordered(values, rows, columns, by_columns)?))
    };
    let elements = match kind {
        "<f8" => number(8, |b| b.first_chunk().map(|b| f64::from_le_bytes(*b))),
        "<f4" => number(4, |b| b.first_chunk().map(|b| f64::from(f32::from_le_bytes(*b)))),
        "<i8" => number(8, |b| b.first_chunk().map(|b| i64::from_le_bytes(*b) as f64)),
        "<i4" => number(4, |b| b.first_chunk().map(|b| f64::from(i32::from_le_bytes(*b)))),
        "|u1" | "|b1" => number(1, |b| b.first().map(|b| f64::from(*b))),
        _ => {
            let width: usize = kind.strip_prefix("<U").and_then(|width| width.parse().ok()).ok_or("unknown type")?;
            let size = width.checked_mul(4).filter(|size| *size > 0).ok_or("unknown type")?;
            if data.len() / size < count {
                return Err(SHORT);
            }
            budget.texts(count)?;
            let texts = data.chunks_exact(size).take(count).map(|text| {
                let characters = text.chunks_exact(4).filter_map(|c| c.first_chunk().map(|c| u32::from_le_bytes(*c)));
                characters.take_while(|c| *c != 0).map(|c| char::from_u32(c).unwrap_or('\u{fffd}')).collect()
            });
            Ok(Elements::Text(ordered(texts.collect(), rows, columns, by_columns)?))
        }
    }?;
    Ok(Array { rows, columns, elements })
}

/// The text after `'key':` in a header, which is a Python dictionary.
fn value_of<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = header.split_once(&format!("'{key}'"))?;
    Some(rest.trim_start().strip_prefix(':')?.trim_start())
}

/// Why an array is refused whose bytes end early.
const SHORT: &str = "fewer elements than its shape says";

/// Row after row, from either order.
pub(super) fn ordered<T: Clone>(
    values: Vec<T>,
    rows: usize,
    columns: usize,
    by_columns: bool,
) -> Result<Vec<T>, &'static str> {
    if Some(values.len()) != rows.checked_mul(columns) {
        return Err(SHORT);
    }
    if !by_columns || columns <= 1 {
        return Ok(values);
    }
    Ok((0..rows).flat_map(|row| values.iter().skip(row).step_by(rows).cloned()).collect())
}

/// The numbers of an array with this many columns, row by row.
pub(super) fn numbers<'a, const N: usize>(arrays: &'a Arrays, name: &str) -> Result<&'a [[f64; N]], DatasetErrorKind> {
    let array = arrays.get(name).ok_or_else(|| broken(name, "missing"))?;
    match &array.elements {
        Elements::Numbers(values) if array.columns == N => Ok(values.as_chunks().0),
        Elements::Numbers(_) => Err(broken(name, format!("{} columns, not {N}", array.columns))),
        Elements::Text(_) => Err(broken(name, "text, not numbers")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn npy(header: &str, data: &[u8]) -> Vec<u8> {
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend((header.len() as u16).to_le_bytes());
        file.extend(header.as_bytes());
        file.extend(data);
        file
    }

    #[test]
    fn both_orders_give_the_same_rows() {
        let bytes = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>();
        let c = npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }", &bytes(&[1., 2., 3., 4., 5., 6.]));
        let f = npy("{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3), }", &bytes(&[1., 4., 2., 5., 3., 6.]));
        for file in [c, f] {
            let arrays = BTreeMap::from([("a".to_owned(), parse(&file, &mut Budget::default()).unwrap())]);
            assert_eq!(numbers::<3>(&arrays, "a").unwrap(), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        }
    }

    #[test]
    fn lies_are_found() {
        let short = npy("{'descr': '<f4', 'fortran_order': False, 'shape': (9,), }", &[0; 35]);
        assert_eq!(parse(&short, &mut Budget::default()).err(), Some("fewer elements than its shape says"));
        let huge = npy("{'descr': '<f4', 'fortran_order': True, 'shape': (99999999999, 99999999999), }", &[]);
        assert_eq!(parse(&huge, &mut Budget::default()).err(), Some("shape is too large"));
        let kind = npy("{'descr': '>c16', 'fortran_order': False, 'shape': (1,), }", &[0; 16]);
        assert_eq!(parse(&kind, &mut Budget::default()).err(), Some("unknown type"));
        assert_eq!(parse(b"\x93NUMPY\x01", &mut Budget::default()).err(), Some("cut off"));
    }
}
