//! A gain is changed and the battery falls out. What is the gain afterwards?

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use stampfly_param::{Disarmed, ParameterStore};
use stampfly_types::messages::FlightStatus;

const PAGE: usize = 256;
const NAME: &str = "rate.roll.kp";

/// Flash in memory, with a battery that can fall out.
struct Flash {
    bytes: Vec<u8>,
    writes_left: usize,
}

#[derive(Debug)]
struct NoPower;

impl NorFlashError for NoPower {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for Flash {
    type Error = NoPower;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 4;
    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NoPower> {
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }
    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE;
    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NoPower> {
        self.bytes[from as usize..to as usize].fill(0xFF);
        Ok(())
    }
    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NoPower> {
        self.writes_left = self.writes_left.checked_sub(1).ok_or(NoPower)?;
        // Bits of a flash only fall.
        self.bytes[offset as usize..].iter_mut().zip(bytes).for_each(|(to, from)| *to &= from);
        Ok(())
    }
}

async fn life(mut writes: usize) -> bool {
    let flash = Flash { bytes: vec![0xFF; 4 * PAGE], writes_left: usize::MAX };
    let mut store = ParameterStore::open(flash, 0..4 * PAGE as u32).await.expect("four pages");
    let mode = FlightStatus::default();
    let disarmed = || Disarmed::proven_by(&mode).expect("standing on a table");
    store.save_within(disarmed(), NAME, 0.0012, 0.0..=0.01).await.expect("power");

    let mut flash = store.into_flash();
    core::mem::swap(&mut flash.writes_left, &mut writes);
    let mut store = ParameterStore::open(flash, 0..4 * PAGE as u32).await.expect("four pages");
    let saved = store.save_within(disarmed(), NAME, 0.0018, 0.0..=0.01).await.is_ok();

    let mut flash = store.into_flash();
    flash.writes_left = usize::MAX;
    let mut store = ParameterStore::open(flash, 0..4 * PAGE as u32).await.expect("four pages");
    let gain = store.load_within(NAME, 0.0..=0.01).await.expect("readable").expect("one of the two");
    println!("{:<32} {NAME} = {gain}", if saved { "saved" } else { "power lost while saving" });
    assert!(gain == 0.0012 || gain == 0.0018, "never anything else");
    saved
}

fn main() {
    let mut writes = 0;
    while !block_on(life(writes)) {
        writes += 1;
    }
    println!("an armed vehicle: {:?}", Disarmed::proven_by(&FlightStatus { armed: true, ..Default::default() }));
}
