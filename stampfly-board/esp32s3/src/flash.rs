//! The flash chip, written to while another core runs.
//!
//! A write parks the other core wherever it is, perhaps with a scheduler's lock in its hand. An interrupt on this core that
//! came before it is let go again would wait for that lock for ever. So no interrupt does: this core takes none from
//! before the other is parked until it runs on. Reading disturbs nobody.

use embassy_sync::blocking_mutex::raw::{CriticalSectionRawMutex, RawMutex};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use esp_storage::{FlashStorage, FlashStorageError};

/// The flash chip. Each write and each erase stops everything, for up to 200 ms.
pub struct Flash(FlashStorage<'static>);

impl Flash {
    /// The whole chip.
    pub fn new(flash: FlashStorage<'static>) -> Self {
        #[cfg(feature = "esp32s3")]
        let flash = flash.multicore_auto_park();
        Self(flash)
    }
}

fn undisturbed<R>(work: impl FnOnce() -> R) -> R {
    CriticalSectionRawMutex::new().lock(work)
}

impl ErrorType for Flash {
    type Error = FlashStorageError;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = <FlashStorage<'_> as ReadNorFlash>::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashStorageError> {
        ReadNorFlash::read(&mut self.0, offset, bytes)
    }

    fn capacity(&self) -> usize {
        ReadNorFlash::capacity(&self.0)
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = <FlashStorage<'_> as NorFlash>::WRITE_SIZE;
    const ERASE_SIZE: usize = <FlashStorage<'_> as NorFlash>::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashStorageError> {
        undisturbed(|| NorFlash::erase(&mut self.0, from, to))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashStorageError> {
        undisturbed(|| NorFlash::write(&mut self.0, offset, bytes))
    }
}
