//! The store on a blocking flash, for programs without `async`.
//!
//! It is [`ParameterStore`](crate::ParameterStore), whose futures never wait on such a flash and
//! complete at their first poll. Not for a task of an executor that has other work: an erasure
//! blocks it for 50 ms.

use crate::{AnyValue, Disarmed, EraseError, LoadError, OpenError, SaveError, Storable};
use core::future::Future;
use core::ops::{Range, RangeInclusive};
use core::pin::pin;
use core::task::{Context, Poll, Waker};
use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use embedded_storage_async::nor_flash::{self as asynchronous, ErrorType};

/// Values with names, in flash. Each function does what the one of
/// [`ParameterStore`](crate::ParameterStore) does, with the same errors.
///
/// ```
/// use stampfly_param::{Disarmed, RamFlash, blocking::ParameterStore, types::messages::FlightStatus};
///
/// let mut store = ParameterStore::open(RamFlash::<0x4000>::new(), 0..0x4000)?;
/// let disarmed = Disarmed::proven_by(&FlightStatus::default()).expect("nobody has armed it");
/// store.save_within(disarmed, "hover.thrust", 0.36_f32, 0.1..=0.6).expect("memory keeps everything");
/// assert_eq!(store.load::<f32>("hover.thrust"), Ok(Some(0.36)));
/// # Ok::<(), stampfly_param::OpenError<stampfly_param::embedded_storage_async::nor_flash::NorFlashErrorKind>>(())
/// ```
pub struct ParameterStore<F: NorFlash> {
    store: crate::ParameterStore<Blocking<F>>,
}

impl<F: NorFlash> ParameterStore<F> {
    /// Opens the store in these bytes of the flash, which it uses alone.
    ///
    /// # Errors
    /// When the range is not at least three whole pages, or the flash fails.
    pub fn open(flash: F, range: Range<u32>) -> Result<Self, OpenError<F::Error>> {
        let store = finish(crate::ParameterStore::open(Blocking(flash), range))?;
        Ok(Self { store })
    }

    /// The value of this name, or `None` when none was ever saved.
    ///
    /// # Errors
    /// When the stored value cannot be used.
    pub fn load<T: Storable>(&mut self, name: &str) -> Result<Option<T>, LoadError<F::Error>> {
        finish(self.store.load(name))
    }

    /// The same, if the value is within the range.
    ///
    /// # Errors
    /// When the stored value cannot be used.
    pub fn load_within<T: Storable + PartialOrd>(
        &mut self,
        name: &str,
        range: RangeInclusive<T>,
    ) -> Result<Option<T>, LoadError<F::Error>> {
        finish(self.store.load_within(name, range))
    }

    /// Saves the value of this name and reads it back.
    ///
    /// # Errors
    /// When it was not saved. The previous value is still stored.
    pub fn save<T: Storable>(&mut self, disarmed: Disarmed, name: &str, value: T) -> Result<(), SaveError<F::Error>> {
        finish(self.store.save(disarmed, name, value))
    }

    /// The same, if the value is within the range.
    ///
    /// # Errors
    /// When it was not saved, or is out of range.
    pub fn save_within<T: Storable + PartialOrd>(
        &mut self,
        disarmed: Disarmed,
        name: &str,
        value: T,
        range: RangeInclusive<T>,
    ) -> Result<(), SaveError<F::Error>> {
        finish(self.store.save_within(disarmed, name, value, range))
    }

    /// Passes every name with its newest value to `show`.
    ///
    /// # Errors
    /// When the pages are damaged or the flash fails.
    pub fn for_each(&mut self, show: impl FnMut(&str, AnyValue)) -> Result<(), LoadError<F::Error>> {
        finish(self.store.for_each(show))
    }

    /// Erases every value.
    ///
    /// # Errors
    /// When the flash fails.
    pub fn erase(&mut self, disarmed: Disarmed) -> Result<(), EraseError<F::Error>> {
        finish(self.store.erase(disarmed))
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.store.into_flash().0
    }
}

/// Runs a future to its end. On a flash that blocks none ever waits.
fn finish<T>(future: impl Future<Output = T>) -> T {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    loop {
        if let Poll::Ready(value) = future.as_mut().poll(&mut context) {
            return value;
        }
    }
}

/// A flash that blocks, as one that could wait.
struct Blocking<F>(F);

impl<F: NorFlash> ErrorType for Blocking<F> {
    type Error = F::Error;
}

impl<F: NorFlash> asynchronous::ReadNorFlash for Blocking<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), F::Error> {
        ReadNorFlash::read(&mut self.0, offset, bytes)
    }

    fn capacity(&self) -> usize {
        ReadNorFlash::capacity(&self.0)
    }
}

impl<F: NorFlash> asynchronous::NorFlash for Blocking<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), F::Error> {
        self.0.erase(from, to)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), F::Error> {
        self.0.write(offset, bytes)
    }
}
