//! The store: a name, a number, a place in flash.

use crate::{Disarmed, EraseError, LoadError, NoRoom, SaveError};
use core::ops::{Range, RangeInclusive};
use embedded_storage_async::nor_flash::NorFlash;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

/// A name's number in flash: its 32-bit FNV-1a hash.
///
/// ```
/// // The published test vectors of the hash.
/// assert_eq!(stampfly_param::key(""), 0x811C_9DC5);
/// assert_eq!(stampfly_param::key("foobar"), 0xBF9C_F968);
/// ```
#[must_use]
pub const fn key(name: &str) -> u32 {
    let mut rest = name.as_bytes();
    let mut hash: u32 = 0x811C_9DC5;
    while let [byte, tail @ ..] = rest {
        hash = (hash ^ *byte as u32).wrapping_mul(0x0100_0193);
        rest = tail;
    }
    hash
}

/// Room for one key and one value, aligned as flash likes it.
#[repr(align(4))]
struct Scratch([u8; 32]);

type NoCache = Cache<Uncached, Uncached, Uncached, u32>;

/// Numbers with names, in flash.
///
/// ```
/// # #[path = "../tests/flash/mod.rs"] mod flash;
/// # use flash::Flash;
/// use embassy_futures::block_on;
/// use stampfly_param::{Disarmed, ParameterStore};
/// use stampfly_types::messages::SystemMode;
///
/// let disarmed = || Disarmed::proven_by(&SystemMode::default()).unwrap();
/// let mut store = ParameterStore::new(Flash::new(), 0..1024).unwrap();
/// block_on(async {
///     assert_eq!(store.load("hover.thrust", 0.1..=0.6).await, Ok(None));
///     assert!(store.save(disarmed(), "hover.thrust", 0.36, 0.1..=0.6).await.is_ok());
///     assert_eq!(store.load("hover.thrust", 0.1..=0.6).await, Ok(Some(0.36)));
///     assert!(store.save(disarmed(), "hover.thrust", f32::NAN, 0.1..=0.6).await.is_err());
/// });
/// ```
pub struct ParameterStore<F: NorFlash> {
    map: MapStorage<u32, F, NoCache>,
}

impl<F: NorFlash> ParameterStore<F> {
    /// A store in these bytes of the flash, which belong to it alone.
    ///
    /// # Errors
    /// When they are not at least two whole pages.
    pub fn new(flash: F, range: Range<u32>) -> Result<Self, NoRoom> {
        let config = MapConfig::try_new(range).map_err(|_| NoRoom)?;
        Ok(Self { map: MapStorage::new(flash, config, Cache::new_uncached()) })
    }

    /// The value of this name, or `None` when none was ever saved. Reads flash only.
    ///
    /// # Errors
    /// When there is a value nobody may use; the default applies then.
    pub async fn load(&mut self, name: &str, range: RangeInclusive<f32>) -> Result<Option<f32>, LoadError<F::Error>> {
        let mut scratch = Scratch([0; 32]);
        let Some(bits) = self.map.fetch_item::<u32>(&mut scratch.0, &key(name)).await? else { return Ok(None) };
        let stored = f32::from_bits(bits);
        if range.contains(&stored) { Ok(Some(stored)) } else { Err(LoadError::OutOfRange { stored }) }
    }

    /// Saves the value of this name. Up to 200 ms on an ESP32, when a page has to be erased.
    ///
    /// # Errors
    /// When the value is out of range, or the flash does not take it. What was stored before still is.
    pub async fn save(
        &mut self,
        _: Disarmed,
        name: &str,
        value: f32,
        range: RangeInclusive<f32>,
    ) -> Result<(), SaveError<F::Error>> {
        if !range.contains(&value) {
            return Err(SaveError::OutOfRange);
        }
        // By bits, so that −0 is not taken for 0.
        let present = self.load(name, range).await;
        if present.is_ok_and(|stored| stored.map(f32::to_bits) == Some(value.to_bits())) {
            return Ok(());
        }
        let mut scratch = Scratch([0; 32]);
        Ok(self.map.store_item(&mut scratch.0, &key(name), &value.to_bits()).await?)
    }

    /// Forgets every value: all defaults apply again.
    ///
    /// # Errors
    /// When the flash does not obey.
    pub async fn erase(&mut self, _: Disarmed) -> Result<(), EraseError<F::Error>> {
        let range = self.map.flash_range();
        self.map.flash().erase(range.start, range.end).await.map_err(EraseError::Flash)
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.map.destroy().0
    }
}
