//! A NOR flash in memory whose power can fail at any word.

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// Bytes of a page.
pub const PAGE: usize = 256;
/// Bytes of a word.
const WORD: usize = 4;

/// Why the flash did not obey.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashError {
    /// The power has failed.
    Power,
    /// Outside, or not aligned.
    Kind(NorFlashErrorKind),
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Power => NorFlashErrorKind::Other,
            Self::Kind(kind) => *kind,
        }
    }
}

impl From<NorFlashErrorKind> for FlashError {
    fn from(kind: NorFlashErrorKind) -> Self {
        Self::Kind(kind)
    }
}

/// The flash.
#[derive(Clone, Debug)]
pub struct Flash {
    bytes: Vec<u8>,
    /// Words that can be written or erased before the power fails.
    pub words_left: Option<u32>,
}

impl Flash {
    /// With this content.
    pub fn new(bytes: Vec<u8>) -> Self {
        Self { bytes, words_left: None }
    }

    /// Its content.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Changes one word, or half of its bits when the power fails meanwhile.
    fn change(&mut self, offset: usize, new: impl Fn(u8, usize) -> u8) -> Result<(), FlashError> {
        let word = self.bytes.get_mut(offset..offset + WORD).ok_or(NorFlashErrorKind::OutOfBounds)?;
        let mask = match &mut self.words_left {
            Some(0) => return Err(FlashError::Power),
            Some(left) => {
                *left -= 1;
                if *left == 0 { 0xAA } else { 0xFF }
            }
            None => 0xFF,
        };
        for (index, byte) in word.iter_mut().enumerate() {
            *byte = (*byte & !mask) | (new(*byte, index) & mask);
        }
        if mask == 0xFF { Ok(()) } else { Err(FlashError::Power) }
    }
}

fn aligned(to: usize, offset: u32, length: usize) -> Result<(), FlashError> {
    let is_aligned = (offset as usize).is_multiple_of(to) && length.is_multiple_of(to);
    if is_aligned { Ok(()) } else { Err(NorFlashErrorKind::NotAligned.into()) }
}

impl ErrorType for Flash {
    type Error = FlashError;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = WORD;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        aligned(WORD, offset, bytes.len())?;
        let from = self.bytes.get(offset as usize..).and_then(|rest| rest.get(..bytes.len()));
        bytes.copy_from_slice(from.ok_or(NorFlashErrorKind::OutOfBounds)?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        aligned(PAGE, from, to as usize)?;
        (from as usize..to as usize).step_by(WORD).try_for_each(|offset| self.change(offset, |_, _| 0xFF))
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        aligned(WORD, offset, bytes.len())?;
        for (index, word) in bytes.chunks_exact(WORD).enumerate() {
            // Writing can only clear bits.
            self.change(offset as usize + WORD * index, |old, place| old & word[place])?;
        }
        Ok(())
    }
}
