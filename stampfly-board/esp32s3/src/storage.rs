//! What survives a power cut: parameters, the transmitter the vehicle belongs to and the vehicle's key, in the partition `nvs`.
//!
//! A write stops both cores for up to 200 ms. It needs the mode machine's word that the vehicle is disarmed. From before
//! that word is asked for until the write is done, `storage_busy` keeps the motors still, even if the vehicle is armed in
//! between.

use crate::clock::Clock;
use crate::flash::Flash;
use embassy_embedded_hal::adapter::BlockingAsync;
use embassy_futures::block_on;
use embassy_time::{Duration, Timer};
use esp_bootloader_esp_idf::partitions::{
    DataPartitionSubType, PARTITION_TABLE_MAX_LEN, PartitionType, read_partition_table,
};
use esp_hal::peripherals::FLASH;
use esp_storage::{FlashStorage, FlashStorageError};
use stampfly_board::VehicleConfig;
use stampfly_board::messages::StorageBusy;
use stampfly_board::parameters::{self, KEY, PEER};
use stampfly_board::topics::StorageBusyTx;
use stampfly_drivers::Timebase;
use stampfly_link::Address;
use stampfly_link::secure::Key;
use stampfly_param::parameters::settle;
use stampfly_param::{Disarmed, EraseError, ParameterStore, Parameters, SaveError};
#[cfg(feature = "wifi")]
use stampfly_services::association::{Credentials, NAMES, RECORD};
#[cfg(feature = "wifi")]
use stampfly_services::network::Reserved;
use stampfly_types::messages::FlightStatus;

/// Several periods of the motors' duties.
const NOTICE: Duration = Duration::from_millis(20);

/// The number of the vehicle's key: it has one.
pub const KEY_ID: u8 = 1;

/// Flash is being written as long as this lives, and the bus knows.
struct Writing<'t>(&'t mut StorageBusyTx<'static>);

impl<'t> Writing<'t> {
    /// Returns when the motors are still. On an armed vehicle nothing begins.
    async fn begin(
        busy: &'t mut StorageBusyTx<'static>,
        mode: &mut impl FnMut() -> Option<FlightStatus>,
    ) -> Result<Self, StorageError> {
        let _ = proven(mode)?;
        busy.publish(Clock.now(), &StorageBusy { busy: true });
        let writing = Self(busy);
        Timer::after(NOTICE).await;
        Ok(writing)
    }
}

impl Drop for Writing<'_> {
    fn drop(&mut self) {
        self.0.publish(Clock.now(), &StorageBusy { busy: false });
    }
}

/// Why nothing was kept, or not all of it.
#[derive(Debug)]
pub enum StorageError {
    /// The vehicle is armed.
    Armed,
    /// There is no partition `nvs`, or it could not be opened.
    NoPartition,
    /// A value was not written.
    Save(SaveError<FlashStorageError>),
    /// Not erased.
    Erase(EraseError<FlashStorageError>),
}

impl core::fmt::Display for StorageError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Armed => f.write_str("the vehicle is armed"),
            Self::NoPartition => f.write_str("there is no partition nvs, or its flash does not obey"),
            Self::Save(error) => error.fmt(f),
            Self::Erase(error) => error.fmt(f),
        }
    }
}

/// Flash, or none: a vehicle without one flies with its defaults.
pub struct Storage {
    store: Option<ParameterStore<BlockingAsync<Flash>>>,
}

impl Storage {
    /// Looks for the partition, and erases what earlier firmware has left in it. Before the vehicle is assembled: nobody
    /// can arm what is not there.
    pub fn open(flash: FLASH<'static>) -> Self {
        Self { store: find(FlashStorage::new(flash)) }
    }

    /// Overlays the defaults with what was kept. Returns how many values were kept but cannot be used. Two that cannot fly together, which an
    /// earlier version may have kept, both get their defaults, as a value out of its range does; flash still has them.
    pub async fn load(&mut self, config: &mut VehicleConfig) -> usize {
        let Some(store) = &mut self.store else { return 0 };
        let mut unusable = 0;
        for (index, info) in parameters::all().enumerate() {
            match store.load_within(info.name, info.min..=info.max).await {
                Ok(None) => {}
                Ok(Some(value)) => unusable += usize::from(config.set(index, value).is_err()),
                Err(_) => unusable += 1,
            }
        }
        unusable + 2 * settle(config, &VehicleConfig::default(), &mut |conflict| esp_println::println!("{conflict}"))
    }

    /// The transmitter the vehicle belongs to, if it has one.
    pub async fn load_peer(&mut self) -> Option<Address> {
        let stored = self.store.as_mut()?.load(PEER).await.ok()?;
        stored.map(Address).filter(|address| address.is_station())
    }

    /// The vehicle's key, if it has one. All of it is one record, which no power cut can halve.
    pub async fn load_key(&mut self) -> Option<Key> {
        let bytes = self.store.as_mut()?.load(KEY).await.ok()??;
        Key::generate(KEY_ID, bytes).ok()
    }

    /// Keeps the vehicle's key.
    pub async fn save_key(
        &mut self,
        key: &Key,
        busy: &mut StorageBusyTx<'static>,
        mut mode: impl FnMut() -> Option<FlightStatus>,
    ) -> Result<(), StorageError> {
        let _still = Writing::begin(busy, &mut mode).await?;
        let store = self.store.as_mut().ok_or(StorageError::NoPartition)?;
        store.save(proven(&mut mode)?, KEY, *key.bytes()).await.map_err(StorageError::Save)
    }

    /// Keeps the parameters. `mode` tells the newest decision of the mode machine; it is asked before every value.
    pub async fn save(
        &mut self,
        config: &VehicleConfig,
        busy: &mut StorageBusyTx<'static>,
        mut mode: impl FnMut() -> Option<FlightStatus>,
    ) -> Result<(), StorageError> {
        let _still = Writing::begin(busy, &mut mode).await?;
        let store = self.store.as_mut().ok_or(StorageError::NoPartition)?;
        for (index, info) in parameters::all().enumerate() {
            let disarmed = proven(&mut mode)?;
            let Some(value) = config.get(index) else { break };
            store.save_within(disarmed, info.name, value, info.min..=info.max).await.map_err(StorageError::Save)?;
        }
        Ok(())
    }

    /// Keeps the transmitter the vehicle belongs to.
    pub async fn save_peer(
        &mut self,
        peer: Address,
        busy: &mut StorageBusyTx<'static>,
        mut mode: impl FnMut() -> Option<FlightStatus>,
    ) -> Result<(), StorageError> {
        let _still = Writing::begin(busy, &mut mode).await?;
        let store = self.store.as_mut().ok_or(StorageError::NoPartition)?;
        store.save(proven(&mut mode)?, PEER, peer.0).await.map_err(StorageError::Save)
    }

    /// The network that the vehicle joins, and the time up to which signatures are reserved.
    #[cfg(feature = "wifi")]
    pub async fn load_network(&mut self) -> (Option<Credentials>, Option<u64>) {
        let Some(store) = &mut self.store else { return (None, None) };
        let mut records = [[0; RECORD]; NAMES.len()];
        for (record, name) in records.iter_mut().zip(NAMES) {
            *record = store.load(name).await.ok().flatten().unwrap_or_default();
        }
        (Credentials::from_records(&records), store.load(Reserved::NAME).await.ok().flatten())
    }

    /// Keeps the network that the vehicle joins, or none.
    #[cfg(feature = "wifi")]
    pub async fn save_network(
        &mut self,
        known: Option<&Credentials>,
        busy: &mut StorageBusyTx<'static>,
        mut mode: impl FnMut() -> Option<FlightStatus>,
    ) -> Result<(), StorageError> {
        let _still = Writing::begin(busy, &mut mode).await?;
        let store = self.store.as_mut().ok_or(StorageError::NoPartition)?;
        let [name, first, second] = known.map(Credentials::to_records).unwrap_or_default();
        let [of_name, of_first, of_second] = NAMES;
        // The name over nothing, and last: a power cut leaves no name with another network's pass-phrase.
        for (of, record) in [(of_name, [0; RECORD]), (of_first, first), (of_second, second), (of_name, name)] {
            store.save(proven(&mut mode)?, of, record).await.map_err(StorageError::Save)?;
        }
        Ok(())
    }

    /// Keeps the time up to which signatures are reserved.
    #[cfg(feature = "wifi")]
    pub async fn save_reserved(
        &mut self,
        until: u64,
        busy: &mut StorageBusyTx<'static>,
        mut mode: impl FnMut() -> Option<FlightStatus>,
    ) -> Result<(), StorageError> {
        let _still = Writing::begin(busy, &mut mode).await?;
        let store = self.store.as_mut().ok_or(StorageError::NoPartition)?;
        store.save(proven(&mut mode)?, Reserved::NAME, until).await.map_err(StorageError::Save)
    }

    /// Forgets everything that was kept, transmitter and key included.
    pub async fn reset(
        &mut self,
        busy: &mut StorageBusyTx<'static>,
        mut mode: impl FnMut() -> Option<FlightStatus>,
    ) -> Result<(), StorageError> {
        let _still = Writing::begin(busy, &mut mode).await?;
        let store = self.store.as_mut().ok_or(StorageError::NoPartition)?;
        store.erase(proven(&mut mode)?).await.map_err(StorageError::Erase)
    }
}

/// A vehicle nobody knows to be disarmed counts as armed.
fn proven(mode: &mut impl FnMut() -> Option<FlightStatus>) -> Result<Disarmed, StorageError> {
    mode().and_then(|mode| Disarmed::proven_by(&mode)).ok_or(StorageError::Armed)
}

fn find(mut flash: FlashStorage<'static>) -> Option<ParameterStore<BlockingAsync<Flash>>> {
    let mut table = [0; PARTITION_TABLE_MAX_LEN];
    let table = read_partition_table(&mut flash, &mut table).ok()?;
    let nvs = table.find_partition(PartitionType::Data(DataPartitionSubType::Nvs)).ok()??;
    let range = nvs.offset()..nvs.offset() + nvs.len();
    block_on(ParameterStore::open(BlockingAsync::new(Flash::new(flash)), range)).ok()
}
