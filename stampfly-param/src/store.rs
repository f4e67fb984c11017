//! Values with names in NOR flash.

use crate::pages::Pages;
use crate::value::{Item, LONGEST, LONGEST_NAME};
use crate::{AnyValue, Disarmed, EraseError, LoadError, OpenError, SaveError, Storable};
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

/// Buffer for a key, a kind, a value and a name: a whole number of words, aligned to words.
#[repr(align(4))]
struct Scratch([u8; 4 + 4 + LONGEST + LONGEST_NAME]);

impl Scratch {
    const fn new() -> Self {
        Self([0; 4 + 4 + LONGEST + LONGEST_NAME])
    }
}

type NoCache = Cache<Uncached, Uncached, Uncached, u32>;

/// Values with names, in flash. On a flash that blocks:
/// [`blocking::ParameterStore`](crate::blocking::ParameterStore).
///
/// ```
/// use stampfly_param::{Disarmed, Kind, LoadError, ParameterStore, RamFlash};
/// use stampfly_param::types::messages::FlightStatus;
///
/// # fn block_on<T>(future: impl Future<Output = T>) -> T {
/// #     let mut context = core::task::Context::from_waker(core::task::Waker::noop());
/// #     let mut future = core::pin::pin!(future);
/// #     loop {
/// #         if let core::task::Poll::Ready(done) = future.as_mut().poll(&mut context) { return done; }
/// #     }
/// # }
/// // `block_on` is that of any executor.
/// let disarmed = || Disarmed::proven_by(&FlightStatus::default()).unwrap();
/// block_on(async {
///     let mut store = ParameterStore::open(RamFlash::<0x4000>::new(), 0..0x4000).await.unwrap();
///     assert_eq!(store.load::<u32>("serial").await, Ok(None));
///     assert!(store.save(disarmed(), "serial", 16_777_217_u32).await.is_ok());
///     assert_eq!(store.load("serial").await, Ok(Some(16_777_217_u32)));
///     assert_eq!(store.load::<f32>("serial").await, Err(LoadError::OtherKind { stored: Kind::U32 }));
///
///     assert!(store.save_within(disarmed(), "hover.thrust", 0.36_f32, 0.1..=0.6).await.is_ok());
///     assert!(store.save_within(disarmed(), "hover.thrust", f32::NAN, 0.1..=0.6).await.is_err());
///     assert_eq!(store.load_within("hover.thrust", 0.1..=0.6).await, Ok(Some(0.36_f32)));
///
///     assert!(store.save(disarmed(), "link.peer", [2, 0, 0, 0, 0, 7]).await.is_ok());
///     let mut listed = Vec::new();
///     store.for_each(|name, value| listed.push(format!("{name} = {value}"))).await.unwrap();
///     listed.sort();
///     assert_eq!(listed, ["hover.thrust = 0.36", "link.peer = 020000000007", "serial = 16777217"]);
/// });
/// ```
pub struct ParameterStore<F: NorFlash> {
    map: MapStorage<u32, F, NoCache>,
    pages: Pages,
}

impl<F: NorFlash> ParameterStore<F> {
    /// Opens the store in these bytes of the flash, which it uses alone. If they are not a store of
    /// this version and size they are erased first, about 50 ms a page; after a power cut in
    /// between, the next start repeats it.
    ///
    /// Call it at power-on, before there is a mode machine: it is the only function that writes
    /// without a [`Disarmed`], and it takes the driver of the flash.
    ///
    /// # Errors
    /// When the range is not at least three whole pages, or the flash fails. Use the defaults.
    pub async fn open(mut flash: F, range: Range<u32>) -> Result<Self, OpenError<F::Error>> {
        let pages = Pages::of::<F>(range).ok_or(OpenError::NoRoom)?;
        let config = MapConfig::try_new(pages.values.clone()).map_err(|_| OpenError::NoRoom)?;
        if !pages.are_ours(&mut flash).await.map_err(OpenError::Flash)? {
            pages.format(&mut flash).await?;
        }
        Ok(Self { map: MapStorage::new(flash, config, Cache::new_uncached()), pages })
    }

    /// The value of this name, or `None` if none was saved.
    ///
    /// # Errors
    /// When the stored value is damaged or has another type. Use the default.
    pub async fn load<T: Storable>(&mut self, name: &str) -> Result<Option<T>, LoadError<F::Error>> {
        let Some(stored) = self.stored(name).await? else { return Ok(None) };
        // A boolean that is neither 0 nor 1.
        let other = if stored.kind() == T::KIND {
            LoadError::Corrupted
        } else {
            LoadError::OtherKind { stored: stored.kind() }
        };
        stored.get().map(Some).ok_or(other)
    }

    /// As [`load`](Self::load), if the value is within the range: another version of the program
    /// may have saved it with a wider one.
    ///
    /// # Errors
    /// As [`load`](Self::load), and when the value is out of range or not a number.
    pub async fn load_within<T: Storable + PartialOrd>(
        &mut self,
        name: &str,
        range: RangeInclusive<T>,
    ) -> Result<Option<T>, LoadError<F::Error>> {
        match self.load(name).await? {
            Some(stored) if !range.contains(&stored) => Err(LoadError::OutOfRange { stored: stored.into() }),
            found => Ok(found),
        }
    }

    /// Saves the value of this name and reads it back. Takes up to 200 ms on an ESP32, when a page
    /// has to be erased. A value that is stored already is not written again; a value of another
    /// type is replaced.
    ///
    /// # Errors
    /// When the flash fails, or the name is too long or has the number of another. The previous
    /// value is still stored.
    pub async fn save<T: Storable>(&mut self, _: Disarmed, name: &str, value: T) -> Result<(), SaveError<F::Error>> {
        if name.len() > LONGEST_NAME {
            return Err(SaveError::NameTooLong);
        }
        let value = value.into();
        match self.stored(name).await {
            Ok(stored) if stored == Some(value) => return Ok(()),
            Err(LoadError::NameTaken) => return Err(SaveError::NameTaken),
            // Anything else is replaced, damage included.
            _ => {}
        }
        let mut scratch = Scratch::new();
        self.map.store_item(&mut scratch.0, &key(name), &Item { name, value }).await?;
        match self.stored(name).await {
            Ok(stored) if stored == Some(value) => Ok(()),
            Err(LoadError::Flash(error)) => Err(SaveError::Flash(error)),
            Err(LoadError::Corrupted) => Err(SaveError::Corrupted),
            _ => Err(SaveError::NotKept),
        }
    }

    /// As [`save`](Self::save), if the value is within the range.
    ///
    /// # Errors
    /// As [`save`](Self::save), and when the value is out of range or not a number.
    pub async fn save_within<T: Storable + PartialOrd>(
        &mut self,
        disarmed: Disarmed,
        name: &str,
        value: T,
        range: RangeInclusive<T>,
    ) -> Result<(), SaveError<F::Error>> {
        if !range.contains(&value) {
            return Err(SaveError::OutOfRange);
        }
        self.save(disarmed, name, value).await
    }

    /// Passes every name with its newest value to `show`, in the order of their numbers in flash.
    /// Reads all pages once per name: for a console, not for a control loop.
    ///
    /// # Errors
    /// When the pages are damaged or the flash fails. What was shown before is valid.
    pub async fn for_each(&mut self, mut show: impl FnMut(&str, AnyValue)) -> Result<(), LoadError<F::Error>> {
        let mut shown: Option<u32> = None;
        loop {
            let mut next: Option<u32> = None;
            let mut scratch = Scratch::new();
            let mut items = self.map.fetch_all_items(&mut scratch.0).await?;
            while let Some((key, _)) = items.next::<Item<'_>>(&mut scratch.0).await? {
                if shown.is_none_or(|shown| key > shown) && next.is_none_or(|next| key < next) {
                    next = Some(key);
                }
            }
            let Some(key) = next else { return Ok(()) };
            // Items of a name are in the order they were saved; this finds the last one.
            if let Some(Item { name, value }) = self.map.fetch_item(&mut scratch.0, &key).await? {
                show(name, value);
            }
            shown = next;
        }
    }

    async fn stored(&mut self, name: &str) -> Result<Option<AnyValue>, LoadError<F::Error>> {
        let mut scratch = Scratch::new();
        match self.map.fetch_item::<Item<'_>>(&mut scratch.0, &key(name)).await? {
            Some(item) if item.name != name => Err(LoadError::NameTaken),
            found => Ok(found.map(|item| item.value)),
        }
    }

    /// Erases every value, so all defaults apply again. After a power cut in between, the next
    /// start completes it.
    ///
    /// # Errors
    /// When the flash fails.
    pub async fn erase(&mut self, _: Disarmed) -> Result<(), EraseError<F::Error>> {
        self.pages.format(self.map.flash()).await
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.map.destroy().0
    }
}
