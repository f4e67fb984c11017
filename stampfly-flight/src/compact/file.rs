//! A compact record in a file: the words of its chunks, and the gaps between them.

use super::chunk::{Chunk, MAGIC};
use super::entry::{Kind, VERSION};
use core::fmt;

/// Reads a file. Iterates over its chunks; `None` in the place of what is missing or damaged, once for each gap.
#[derive(Clone, Debug)]
pub struct File<'f> {
    rest: &'f [u8],
    expected: Option<u32>,
    /// Comes next, behind a gap.
    next: Option<Chunk<'f>>,
}

/// Why a file cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FileError {
    /// It does not begin as a compact record does.
    NotARecord,
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("no compact flight record")
    }
}

impl core::error::Error for FileError {}

impl<'f> File<'f> {
    /// Begins to read.
    ///
    /// # Errors
    /// When it does not begin with [`MAGIC`].
    pub fn new(bytes: &'f [u8]) -> Result<Self, FileError> {
        let rest = bytes.strip_prefix(&MAGIC).ok_or(FileError::NotARecord)?;
        Ok(Self { rest, expected: None, next: None })
    }

    /// Is this a compact record?
    #[must_use]
    pub fn is_one(bytes: &[u8]) -> bool {
        bytes.starts_with(&MAGIC)
    }

    /// The next bytes between two lengths. `None` at the end; what is cut off is no chunk.
    fn bytes(&mut self) -> Option<&'f [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let cut = (&[][..], &[][..]);
        let split = self.rest.split_first_chunk::<2>();
        let split = split.and_then(|(length, rest)| rest.split_at_checked(u16::from_le_bytes(*length).into()));
        let (bytes, rest) = split.unwrap_or(cut);
        self.rest = rest;
        Some(bytes)
    }
}

impl<'f> Iterator for File<'f> {
    type Item = Option<Chunk<'f>>;

    fn next(&mut self) -> Option<Self::Item> {
        if let Some(chunk) = self.next.take() {
            return Some(Some(chunk));
        }
        match Chunk::read(self.bytes()?) {
            Ok(chunk) => {
                let expected = self.expected.replace(chunk.number.wrapping_add(1));
                if expected.is_none_or(|expected| expected == chunk.number) {
                    return Some(Some(chunk));
                }
                self.next = Some(chunk);
                Some(None)
            }
            // The number of the next one does not match either; one gap is enough.
            Err(_) => {
                self.expected = None;
                Some(None)
            }
        }
    }
}

/// The vehicle that a compact record is of. `None` when it is none or does not say.
#[must_use]
pub fn vehicle_name(file: &[u8]) -> Option<&str> {
    let begun = File::new(file).ok()?.flatten().find(|chunk| chunk.begins)?;
    let (words, _) = begun.words.as_chunks::<4>();
    let (kind, version, length) = Kind::read(u32::from_le_bytes(*words.first()?))?;
    let name = begun.words.get(8..8 + length as usize)?;
    (kind == Kind::Part && version == VERSION as usize).then_some(())?;
    core::str::from_utf8(name).ok()
}
