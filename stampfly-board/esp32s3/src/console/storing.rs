//! What is stored later, because nothing is while the vehicle is armed: a key that was made, a transmitter that was paired.

use super::{Console, newest_mode};
use crate::radio::MADE;
use crate::storage::StorageError;
use core::fmt::Write as _;
use heapless::String;
use stampfly_link::Address;

impl Console {
    /// Stores a key that was made, as soon as that may be.
    pub(super) async fn store_key(&mut self) {
        if let Some(made) = MADE.try_take() {
            self.unstored_key = Some(made);
        }
        let Some(key) = &self.unstored_key else { return };
        let memory = self.known.memory;
        let busy = &mut self.storage_ends.storage_busy;
        let outcome = self.storage.save_key(key, busy, || newest_mode(memory)).await;
        if !matches!(outcome, Err(StorageError::Armed)) {
            self.key = self.unstored_key.take().filter(|_| outcome.is_ok());
            self.report(outcome, "a key was made and stored: `key` shows it").await;
        }
    }

    /// Stores a transmitter that the vehicle was paired with. Nothing is stored on an armed vehicle; then it is for later.
    pub(super) async fn store_peer(&mut self) {
        if self.storage_ends.link_peer.has_new()
            && let Some(peer) = self.storage_ends.link_peer.latest()
        {
            let peer = Address::from(peer.data);
            let mut said = String::<96>::new();
            let _ = write!(said, "paired with {peer}\r\n");
            self.screen.show(&said).await;
            self.unstored = Some(peer);
        }
        let Some(peer) = self.unstored else { return };
        let memory = self.known.memory;
        let busy = &mut self.storage_ends.storage_busy;
        let outcome = self.storage.save_peer(peer, busy, || newest_mode(memory)).await;
        if !matches!(outcome, Err(StorageError::Armed)) {
            self.unstored = None;
            self.report(outcome, "transmitter stored").await;
        }
    }
}
