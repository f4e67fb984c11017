//! What the console has of the network.

use crate::wifi::{Network, Ports};
use core::cell::RefCell;
use stampfly_services::network::Reserved;

/// Programs in the network.
pub(super) struct Served {
    pub(super) network: &'static RefCell<Network>,
    /// As soon as the vehicle has a key, a network and times of signatures that are not used twice.
    pub(super) ports: Option<Ports>,
    pub(super) reserved: Reserved,
}

impl Served {
    pub(super) fn new((network, reserved): (&'static RefCell<Network>, Option<u64>)) -> Self {
        Self { network, ports: None, reserved: Reserved::new(reserved) }
    }

    /// Flash has been erased.
    pub(super) fn forget(&mut self, is_erased: bool) {
        if is_erased {
            self.network.borrow_mut().want(None);
            self.ports = None;
            // The key is another after the next start: nothing that was signed with this one is believed then.
        }
    }
}
