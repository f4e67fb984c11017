//! MATLAB files of version 5, as BROAD publishes its trials: matrices of numbers, compressed with
//! zlib or not.
//!
//! Only what is needed: little-endian, two dimensions, real numbers. Text, structures and cells are
//! passed over. Version 7.3 is HDF5, and another format. Layout after "MAT-File Format" of The
//! MathWorks, chapter 1.

use super::error::DatasetErrorKind;
use super::npz::{Array, Arrays, Budget, Elements, broken, ordered};

/// Text, version, and in which order bytes are.
const HEADER: usize = 128;
/// A data element that is a matrix.
const MATRIX: u32 = 14;
/// A data element that is another one, compressed.
const COMPRESSED: u32 = 15;

pub(super) fn is(bytes: &[u8]) -> bool {
    bytes.starts_with(b"MATLAB 5.0 MAT-file")
}

/// Reads every matrix of numbers.
pub(super) fn read(bytes: &[u8]) -> Result<Arrays, DatasetErrorKind> {
    if bytes.get(HEADER - 4..HEADER) != Some(b"\x00\x01IM") {
        return Err(broken("file", "not of version 5, or not little-endian"));
    }
    let mut rest = bytes.get(HEADER..).unwrap_or_default();
    let mut arrays = Arrays::new();
    let mut budget = Budget::default();
    while !rest.is_empty() {
        let cut_off = || broken("file", "cut off");
        let (kind, data) = element(&mut rest).ok_or_else(cut_off)?;
        let inflated;
        let (kind, data) = if kind == COMPRESSED {
            inflated = budget.read(flate2::read::ZlibDecoder::new(data)).map_err(|problem| broken("file", problem))?;
            element(&mut &inflated[..]).ok_or_else(cut_off)?
        } else {
            (kind, data)
        };
        if kind == MATRIX
            && let Some((name, array)) = matrix(data, &mut budget).map_err(|problem| broken("file", problem))?
        {
            arrays.insert(name, array);
        }
    }
    Ok(arrays)
}

/// The next data element: its type and its bytes. What is short lies in the tag itself; all others
/// but compressed ones end on a multiple of eight bytes.
fn element<'a>(rest: &mut &'a [u8]) -> Option<(u32, &'a [u8])> {
    let (kind, behind) = rest.split_first_chunk().map(|(kind, behind)| (u32::from_le_bytes(*kind), behind))?;
    if kind > 0xffff {
        let (data, behind) = behind.split_at_checked(4)?;
        *rest = behind;
        return Some((kind & 0xffff, data.get(..(kind >> 16) as usize)?));
    }
    let (length, behind) = behind.split_first_chunk()?;
    let (data, behind) = behind.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    let padding = if kind == COMPRESSED { 0 } else { data.len().wrapping_neg() % 8 };
    *rest = behind.get(padding..).unwrap_or_default();
    Some((kind, data))
}

/// A matrix with its name; `None` when it is not one of numbers.
fn matrix(mut data: &[u8], budget: &mut Budget) -> Result<Option<(String, Array)>, &'static str> {
    const CUT_OFF: &str = "a matrix is cut off";
    let mut part = || element(&mut data).ok_or(CUT_OFF);
    let ((_, flags), (_, shape), (_, name)) = (part()?, part()?, part()?);
    let name = String::from_utf8_lossy(name).into_owned();
    // Double to 64-bit unsigned.
    if !matches!(flags.first().ok_or(CUT_OFF)?, 6..=15) {
        return Ok(None);
    }
    let (kind, values) = part()?;
    let [rows, columns] = shape.as_chunks::<4>().0 else { return Err("a matrix has not two dimensions") };
    let [rows, columns] = [rows, columns].map(|size| u32::from_le_bytes(*size) as usize);
    let count = rows.checked_mul(columns).ok_or("a matrix is too large")?;
    budget.elements(count)?;
    let values = numbers(kind, values).ok_or("a matrix has elements of an unknown type")?.take(count).collect();
    let elements = Elements::Numbers(ordered(values, rows, columns, true)?);
    Ok(Some((name, Array { rows, columns, elements })))
}

/// The numbers of a data element of this type.
fn numbers(kind: u32, data: &[u8]) -> Option<Box<dyn Iterator<Item = f64> + '_>> {
    fn of<'a, const N: usize, T: 'a>(
        data: &'a [u8],
        read: fn([u8; N]) -> T,
        to: fn(T) -> f64,
    ) -> Box<dyn Iterator<Item = f64> + 'a> {
        Box::new(data.as_chunks::<N>().0.iter().map(move |bytes| to(read(*bytes))))
    }
    Some(match kind {
        1 => of(data, i8::from_le_bytes, f64::from),
        2 => of(data, u8::from_le_bytes, f64::from),
        3 => of(data, i16::from_le_bytes, f64::from),
        4 => of(data, u16::from_le_bytes, f64::from),
        5 => of(data, i32::from_le_bytes, f64::from),
        6 => of(data, u32::from_le_bytes, f64::from),
        7 => of(data, f32::from_le_bytes, f64::from),
        9 => of(data, f64::from_le_bytes, |number| number),
        12 => of(data, i64::from_le_bytes, |number| number as f64),
        13 => of(data, u64::from_le_bytes, |number| number as f64),
        _ => return None,
    })
}
