//! The store: a name, a number, a place in flash.

use crate::pages::Pages;
use crate::{Disarmed, EraseError, LoadError, OpenError, SaveError};
use core::ops::{Range, RangeInclusive};
use embedded_storage_async::nor_flash::NorFlash;
use sequential_storage::Error;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage, Value};

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

/// The longest value, bytes.
const LONGEST: usize = 16;

type NoCache = Cache<Uncached, Uncached, Uncached, u32>;

/// Values with names, in flash.
///
/// ```
/// # #[path = "../tests/flash/mod.rs"] mod flash;
/// # use flash::Flash;
/// use embassy_futures::block_on;
/// use stampfly_param::{Disarmed, ParameterStore};
/// use stampfly_types::messages::FlightStatus;
///
/// let disarmed = || Disarmed::proven_by(&FlightStatus::default()).unwrap();
/// block_on(async {
///     let mut store = ParameterStore::open(Flash::new(), 0..1280).await.unwrap();
///     assert_eq!(store.load("hover.thrust", 0.1..=0.6).await, Ok(None));
///     assert!(store.save(disarmed(), "hover.thrust", 0.36, 0.1..=0.6).await.is_ok());
///     assert_eq!(store.load("hover.thrust", 0.1..=0.6).await, Ok(Some(0.36)));
///     assert!(store.save(disarmed(), "hover.thrust", f32::NAN, 0.1..=0.6).await.is_err());
///     assert!(store.save_bytes(disarmed(), "link.peer", [2, 0, 0, 0, 0, 7]).await.is_ok());
///     assert_eq!(store.load_bytes("link.peer").await, Ok(Some([2, 0, 0, 0, 0, 7])));
/// });
/// ```
pub struct ParameterStore<F: NorFlash> {
    map: MapStorage<u32, F, NoCache>,
    pages: Pages,
}

impl<F: NorFlash> ParameterStore<F> {
    /// The store in these bytes of the flash, which belong to it alone. When they hold anything but a store of this
    /// version and size they are erased first, some 50 ms a page; a power cut in between, and the next start does it
    /// again.
    ///
    /// For power-on, before there is a mode machine to ask: this is the one thing that writes without a [`Disarmed`]. It
    /// can be done only by who holds the driver of the flash, and gives it away with that.
    ///
    /// # Errors
    /// When the range is not at least three whole pages, or the flash does not obey. Defaults apply.
    pub async fn open(mut flash: F, range: Range<u32>) -> Result<Self, OpenError<F::Error>> {
        let pages = Pages::of::<F>(range).ok_or(OpenError::NoRoom)?;
        let config = MapConfig::try_new(pages.values.clone()).map_err(|_| OpenError::NoRoom)?;
        if !pages.are_ours(&mut flash).await.map_err(OpenError::Flash)? {
            pages.format(&mut flash).await?;
        }
        Ok(Self { map: MapStorage::new(flash, config, Cache::new_uncached()), pages })
    }

    /// The value of this name, or `None` when none was ever saved. Reads flash only.
    ///
    /// # Errors
    /// When there is a value nobody may use; the default applies then.
    pub async fn load(&mut self, name: &str, range: RangeInclusive<f32>) -> Result<Option<f32>, LoadError<F::Error>> {
        let Some(bits) = self.stored::<u32>(name).await? else { return Ok(None) };
        let stored = f32::from_bits(bits);
        if range.contains(&stored) { Ok(Some(stored)) } else { Err(LoadError::OutOfRange { stored }) }
    }

    /// The bytes of this name, or `None` when none were ever saved. Reads flash only.
    ///
    /// # Errors
    /// When there is something else than so many bytes.
    pub async fn load_bytes<const N: usize>(&mut self, name: &str) -> Result<Option<[u8; N]>, LoadError<F::Error>> {
        Ok(self.stored(name).await?)
    }

    /// Saves the value of this name, and looks whether it is there. Up to 200 ms on an ESP32, when a page has to be
    /// erased.
    ///
    /// # Errors
    /// When the value is out of range, or the flash does not take it. What was stored before still is.
    pub async fn save(
        &mut self,
        disarmed: Disarmed,
        name: &str,
        value: f32,
        range: RangeInclusive<f32>,
    ) -> Result<(), SaveError<F::Error>> {
        if !range.contains(&value) {
            return Err(SaveError::OutOfRange);
        }
        // By bits, so that −0 is not taken for 0.
        self.keep(disarmed, name, value.to_bits()).await
    }

    /// Saves the bytes of this name, 16 at most, as [`save`](Self::save) saves a number: all of them or none, whatever
    /// happens to the power. For what is no number, such as an address.
    ///
    /// # Errors
    /// When the flash does not take them. What was stored before still is.
    pub async fn save_bytes<const N: usize>(
        &mut self,
        disarmed: Disarmed,
        name: &str,
        bytes: [u8; N],
    ) -> Result<(), SaveError<F::Error>> {
        const { assert!(N <= LONGEST, "too long for a value") }
        self.keep(disarmed, name, bytes).await
    }

    async fn keep<V>(&mut self, _: Disarmed, name: &str, value: V) -> Result<(), SaveError<F::Error>>
    where
        V: for<'d> Value<'d> + PartialEq,
    {
        if self.stored(name).await.is_ok_and(|stored| stored.as_ref() == Some(&value)) {
            return Ok(());
        }
        let mut scratch = Scratch([0; 32]);
        self.map.store_item(&mut scratch.0, &key(name), &value).await?;
        if self.stored(name).await?.as_ref() == Some(&value) { Ok(()) } else { Err(SaveError::NotKept) }
    }

    async fn stored<V: for<'d> Value<'d>>(&mut self, name: &str) -> Result<Option<V>, Error<F::Error>> {
        let mut scratch = Scratch([0; 32]);
        self.map.fetch_item(&mut scratch.0, &key(name)).await
    }

    /// Forgets every value: all defaults apply again. Should the power fail in between, the next start finishes it.
    ///
    /// # Errors
    /// When the flash does not obey.
    pub async fn erase(&mut self, _: Disarmed) -> Result<(), EraseError<F::Error>> {
        self.pages.format(self.map.flash()).await
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.map.destroy().0
    }
}
