//! NOR flash in memory, for desktop programs, simulators and tests.
//!
//! As in a real flash, bits can only be cleared, whole pages are erased, and misaligned access is
//! refused. It never fails; the crate's tests have a flash that loses its power.

use embedded_storage_async::nor_flash as asynchronous;
use embedded_storage_async::nor_flash::{ErrorType, NorFlashErrorKind};

/// Memory as a flash of pages of 4 KiB and words of four bytes, as the ESP32's is.
///
/// ```
/// use stampfly_param::{RamFlash, blocking::ParameterStore};
/// let store = ParameterStore::open(RamFlash::<0x3000>::new(), 0..0x3000).expect("three pages");
/// assert!(store.into_flash().bytes().starts_with(b"StampFly parameters"));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RamFlash<const SIZE: usize> {
    bytes: [u8; SIZE],
}

impl<const SIZE: usize> RamFlash<SIZE> {
    const PAGE: usize = 4_096;
    const WORD: usize = 4;

    /// Erased.
    #[must_use]
    pub const fn new() -> Self {
        Self { bytes: [0xFF; SIZE] }
    }

    /// What is in it: to keep it in a file, say.
    #[must_use]
    pub const fn bytes(&self) -> &[u8; SIZE] {
        &self.bytes
    }

    fn part(&mut self, offset: u32, length: usize, unit: usize) -> Result<&mut [u8], NorFlashErrorKind> {
        let offset = usize::try_from(offset).map_err(|_| NorFlashErrorKind::OutOfBounds)?;
        if !offset.is_multiple_of(unit) || !length.is_multiple_of(unit) {
            return Err(NorFlashErrorKind::NotAligned);
        }
        self.bytes.get_mut(offset..).and_then(|rest| rest.get_mut(..length)).ok_or(NorFlashErrorKind::OutOfBounds)
    }
}

impl<const SIZE: usize> Default for RamFlash<SIZE> {
    fn default() -> Self {
        Self::new()
    }
}

/// With what is in it.
impl<const SIZE: usize> From<[u8; SIZE]> for RamFlash<SIZE> {
    fn from(bytes: [u8; SIZE]) -> Self {
        Self { bytes }
    }
}

impl<const SIZE: usize> ErrorType for RamFlash<SIZE> {
    type Error = NorFlashErrorKind;
}

impl<const SIZE: usize> embedded_storage::nor_flash::ReadNorFlash for RamFlash<SIZE> {
    const READ_SIZE: usize = Self::WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let from = self.part(offset, bytes.len(), Self::WORD)?;
        bytes.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl<const SIZE: usize> embedded_storage::nor_flash::NorFlash for RamFlash<SIZE> {
    const WRITE_SIZE: usize = Self::WORD;
    const ERASE_SIZE: usize = Self::PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        let length = to.checked_sub(from).and_then(|length| usize::try_from(length).ok());
        self.part(from, length.ok_or(NorFlashErrorKind::OutOfBounds)?, Self::PAGE)?.fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        // Bits of a flash only fall.
        self.part(offset, bytes.len(), Self::WORD)?.iter_mut().zip(bytes).for_each(|(to, from)| *to &= from);
        Ok(())
    }
}

impl<const SIZE: usize> asynchronous::ReadNorFlash for RamFlash<SIZE> {
    const READ_SIZE: usize = Self::WORD;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        embedded_storage::nor_flash::ReadNorFlash::read(self, offset, bytes)
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl<const SIZE: usize> asynchronous::NorFlash for RamFlash<SIZE> {
    const WRITE_SIZE: usize = Self::WORD;
    const ERASE_SIZE: usize = Self::PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        embedded_storage::nor_flash::NorFlash::erase(self, from, to)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        embedded_storage::nor_flash::NorFlash::write(self, offset, bytes)
    }
}
