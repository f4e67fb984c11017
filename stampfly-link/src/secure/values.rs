//! Bytes of a body, written and read value by value. A number that must not be used is not written and not read.

use super::refused::SealError;

/// Reads values off the front of bytes.
pub struct Reader<'b>(pub &'b [u8]);

impl<'b> Reader<'b> {
    pub fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*taken)
    }

    pub fn byte(&mut self) -> Option<u8> {
        self.bytes().map(|[byte]| byte)
    }

    pub fn truth(&mut self) -> Option<bool> {
        match self.byte()? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }

    /// A number of this size at most, or of any if there is none. One value has one form: −0 and subnormal numbers are none.
    pub fn number(&mut self, size: f32) -> Option<f32> {
        let number = f32::from_le_bytes(self.bytes()?);
        let is_one = number.is_normal() || number.to_bits() == 0;
        (is_one && number.abs() <= size).then_some(number)
    }

    /// One from zero to this.
    pub fn positive(&mut self, most: f32) -> Option<f32> {
        self.number(most).filter(|number| *number >= 0.0)
    }

    /// All the rest, as text for people: no control characters but line ends and tabulators.
    pub fn text(&mut self) -> Option<&'b str> {
        let rest = core::mem::take(&mut self.0);
        core::str::from_utf8(rest).ok().filter(|text| is_text(text))
    }

    /// Nothing may be left over.
    pub fn end<T>(self, value: T) -> Option<T> {
        self.0.is_empty().then_some(value)
    }
}

fn is_text(text: &str) -> bool {
    text.chars().all(|character| !character.is_control() || matches!(character, '\n' | '\t'))
}

/// Writes values to the front of a place.
pub struct Writer<'b> {
    place: &'b mut [u8],
    length: usize,
}

impl<'b> Writer<'b> {
    pub const fn new(place: &'b mut [u8]) -> Self {
        Self { place, length: 0 }
    }

    pub const fn length(&self) -> usize {
        self.length
    }

    pub fn bytes(&mut self, bytes: &[u8]) -> Result<(), SealError> {
        let place = self.place.get_mut(self.length..).and_then(|rest| rest.get_mut(..bytes.len()));
        let place = place.ok_or(SealError::Length)?;
        place.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        self.length += bytes.len();
        Ok(())
    }

    pub fn truth(&mut self, truth: bool) -> Result<(), SealError> {
        self.bytes(&[u8::from(truth)])
    }

    /// A number as [`Reader::number`] takes it; what is too small for a form of its own is zero.
    pub fn number(&mut self, number: f32, size: f32) -> Result<(), SealError> {
        if !(number.is_finite() && number.abs() <= size) {
            return Err(SealError::Value);
        }
        self.bytes(&if number.is_normal() { number } else { 0.0 }.to_le_bytes())
    }

    pub fn positive(&mut self, number: f32, most: f32) -> Result<(), SealError> {
        if number < 0.0 { Err(SealError::Value) } else { self.number(number, most) }
    }

    pub fn text(&mut self, text: &str) -> Result<(), SealError> {
        if is_text(text) { self.bytes(text.as_bytes()) } else { Err(SealError::Value) }
    }
}
