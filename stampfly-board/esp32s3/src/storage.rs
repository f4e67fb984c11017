//! What survives a power cut: parameters and the transmitter the vehicle belongs to, in the partition `nvs`.
//!
//! A write stops both cores for up to 200 ms. It takes the mode machine's word that the vehicle is disarmed, and from
//! before that word is asked for until the write is done the motors stay still, whatever happens in between.

use crate::flash::Flash;
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_embedded_hal::adapter::BlockingAsync;
use embassy_time::{Duration, Timer};
use esp_bootloader_esp_idf::partitions::{
    DataPartitionSubType, PARTITION_TABLE_MAX_LEN, PartitionType, read_partition_table,
};
use esp_hal::peripherals::FLASH;
use esp_storage::{FlashStorage, FlashStorageError};
use stampfly_board::VehicleConfig;
use stampfly_board::parameters::PARAMETERS;
use stampfly_link::Address;
use stampfly_param::{Disarmed, EraseError, LoadError, ParameterStore, SaveError};
use stampfly_types::messages::SystemMode;

/// Half of an address is a number of 24 bits, which single precision holds exactly.
const PEER: [&str; 2] = ["link.peer.first", "link.peer.last"];
const HALVES: core::ops::RangeInclusive<f32> = 0.0..=16_777_215.0;

/// Several periods of the motors' duties and of the cut-off.
const NOTICE: Duration = Duration::from_millis(20);

static WRITING: AtomicBool = AtomicBool::new(false);

/// Is flash being written? Then no motor turns.
pub fn is_writing() -> bool {
    WRITING.load(Ordering::Acquire)
}

/// True while it lives.
struct Writing;

impl Writing {
    /// Returns when the motors and the cut-off have taken notice.
    async fn begin() -> Self {
        WRITING.store(true, Ordering::Release);
        let writing = Self;
        Timer::after(NOTICE).await;
        writing
    }
}

impl Drop for Writing {
    fn drop(&mut self) {
        WRITING.store(false, Ordering::Release);
    }
}

/// Why nothing was kept, or not all of it.
#[derive(Debug)]
pub enum StorageError {
    /// The vehicle is armed.
    Armed,
    /// There is no partition `nvs`.
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
            Self::NoPartition => f.write_str("there is no partition nvs"),
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
    /// Looks for the partition.
    pub fn open(flash: FLASH<'static>) -> Self {
        Self { store: find(FlashStorage::new(flash)) }
    }

    /// Overlays the defaults with what was kept. Returns how many values were kept but cannot be used.
    pub async fn load(&mut self, config: &mut VehicleConfig) -> usize {
        let Some(store) = &mut self.store else { return 0 };
        let mut unusable = 0;
        for parameter in PARAMETERS {
            match store.load(parameter.name, parameter.min..=parameter.max).await {
                Ok(None) => {}
                Ok(Some(value)) => unusable += usize::from(parameter.set(config, value).is_err()),
                Err(_) => unusable += 1,
            }
        }
        unusable
    }

    /// The transmitter the vehicle belongs to, if it has one.
    pub async fn load_peer(&mut self) -> Option<Address> {
        let store = self.store.as_mut()?;
        let mut halves = [0; 2];
        for (half, name) in halves.iter_mut().zip(PEER) {
            let value: Result<Option<f32>, LoadError<_>> = store.load(name, HALVES).await;
            *half = value.ok().flatten()? as u32;
        }
        let [[_, a, b, c], [_, d, e, f]] = halves.map(u32::to_be_bytes);
        Some(Address([a, b, c, d, e, f])).filter(|address| address.is_station())
    }

    /// Keeps the parameters. `mode` tells the newest decision of the mode machine; it is asked before every value.
    pub async fn save(
        &mut self,
        config: &VehicleConfig,
        mut mode: impl FnMut() -> Option<SystemMode>,
    ) -> Result<(), StorageError> {
        let _still = Writing::begin().await;
        let store = self.store.as_mut().ok_or(StorageError::NoPartition)?;
        for parameter in PARAMETERS {
            let disarmed = proven(&mut mode)?;
            let (name, value) = (parameter.name, parameter.get(config));
            store.save(disarmed, name, value, parameter.min..=parameter.max).await.map_err(StorageError::Save)?;
        }
        Ok(())
    }

    /// Keeps the transmitter the vehicle belongs to.
    pub async fn save_peer(
        &mut self,
        peer: Address,
        mut mode: impl FnMut() -> Option<SystemMode>,
    ) -> Result<(), StorageError> {
        let _still = Writing::begin().await;
        let store = self.store.as_mut().ok_or(StorageError::NoPartition)?;
        let [a, b, c, d, e, f] = peer.0;
        let halves = [[0, a, b, c], [0, d, e, f]].map(u32::from_be_bytes);
        for (half, name) in halves.into_iter().zip(PEER) {
            store.save(proven(&mut mode)?, name, half as f32, HALVES).await.map_err(StorageError::Save)?;
        }
        Ok(())
    }

    /// Forgets everything that was kept, the transmitter included.
    pub async fn reset(&mut self, mut mode: impl FnMut() -> Option<SystemMode>) -> Result<(), StorageError> {
        let _still = Writing::begin().await;
        let store = self.store.as_mut().ok_or(StorageError::NoPartition)?;
        store.erase(proven(&mut mode)?).await.map_err(StorageError::Erase)
    }
}

/// A vehicle nobody knows to be disarmed counts as armed.
fn proven(mode: &mut impl FnMut() -> Option<SystemMode>) -> Result<Disarmed, StorageError> {
    mode().and_then(|mode| Disarmed::proven_by(&mode)).ok_or(StorageError::Armed)
}

fn find(mut flash: FlashStorage<'static>) -> Option<ParameterStore<BlockingAsync<Flash>>> {
    let mut table = [0; PARTITION_TABLE_MAX_LEN];
    let table = read_partition_table(&mut flash, &mut table).ok()?;
    let nvs = table.find_partition(PartitionType::Data(DataPartitionSubType::Nvs)).ok()??;
    let range = nvs.offset()..nvs.offset() + nvs.len();
    ParameterStore::new(BlockingAsync::new(Flash::new(flash)), range).ok()
}
