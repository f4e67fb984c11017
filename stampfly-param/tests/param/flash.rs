//! A NOR flash in memory that can lose its power at any word.

use embedded_storage_async::nor_flash::{
    ErrorType, MultiwriteNorFlash, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

const PAGE: usize = 256;
const PAGES: usize = 9;

/// The power was cut, or somebody asked for something a flash does not do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashError {
    /// Nothing works any more until [`Flash::switch_on`].
    PowerCut,
    /// Outside, not aligned, or a bit that would have to rise without an erasure.
    Impossible,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

#[derive(Clone)]
pub struct Flash {
    pub bytes: Vec<u8>,
    /// Words that can still be written or erased before the power fails.
    words_left: Option<usize>,
    /// What the word under way becomes when the power fails: none of its zeros, or some of them.
    torn: bool,
    /// Bytes of the word under way that are complete when the power fails.
    complete: usize,
    /// Says that it has written, and has not.
    pub deaf: bool,
    pub words_written: usize,
}

impl Flash {
    pub fn new() -> Self {
        Self::with(vec![0xFF; PAGE * PAGES])
    }

    /// What somebody else has left.
    pub fn with(bytes: Vec<u8>) -> Self {
        Self { bytes, words_left: None, torn: false, complete: 0, deaf: false, words_written: 0 }
    }

    /// Fails after so many words, in the middle of the next one if `torn`.
    pub fn cut_after(mut self, words: usize, torn: bool) -> Self {
        (self.words_left, self.torn) = (Some(words), torn);
        self
    }

    /// Fails after so many bytes, in the middle of the next one if `torn`.
    pub fn cut_after_bytes(mut self, bytes: usize, torn: bool) -> Self {
        (self.words_left, self.complete, self.torn) = (Some(bytes / 4), bytes % 4, torn);
        self
    }

    pub fn switch_on(mut self) -> Self {
        self.words_left = None;
        self
    }

    fn word(&mut self, offset: usize, change: impl Fn(u8, usize) -> u8) -> Result<(), FlashError> {
        let word = &mut self.bytes[offset..offset + 4];
        match &mut self.words_left {
            Some(0) => {
                let (complete, torn) = (core::mem::take(&mut self.complete), core::mem::take(&mut self.torn));
                for (index, byte) in word.iter_mut().enumerate() {
                    if index < complete {
                        *byte = change(*byte, index);
                    } else if torn {
                        // Some bits have changed and some have not.
                        *byte = (*byte & 0x55) | (change(*byte, index) & 0xAA);
                    }
                }
                return Err(FlashError::PowerCut);
            }
            Some(left) => *left -= 1,
            None => {}
        }
        self.words_written += 1;
        if self.deaf {
            return Ok(());
        }
        for (index, byte) in word.iter_mut().enumerate() {
            *byte = change(*byte, index);
        }
        Ok(())
    }
}

impl ErrorType for Flash {
    type Error = FlashError;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 4;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        if !(offset as usize).is_multiple_of(4) || !bytes.len().is_multiple_of(4) {
            return Err(FlashError::Impossible);
        }
        let from = self.bytes.get(offset as usize..).and_then(|rest| rest.get(..bytes.len()));
        bytes.copy_from_slice(from.ok_or(FlashError::Impossible)?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        let (from, to) = (from as usize, to as usize);
        if !from.is_multiple_of(PAGE) || !to.is_multiple_of(PAGE) || to > self.bytes.len() {
            return Err(FlashError::Impossible);
        }
        (from..to).step_by(4).try_for_each(|offset| self.word(offset, |_, _| 0xFF))
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let offset = offset as usize;
        if !offset.is_multiple_of(4) || !bytes.len().is_multiple_of(4) || offset + bytes.len() > self.bytes.len() {
            return Err(FlashError::Impossible);
        }
        for (index, word) in bytes.chunks_exact(4).enumerate() {
            self.word(offset + 4 * index, |before, byte| before & word[byte])?;
        }
        Ok(())
    }
}

impl MultiwriteNorFlash for Flash {}
