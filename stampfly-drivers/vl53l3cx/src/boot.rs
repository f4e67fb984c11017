//! Access to the common boot address of several chips on one bus.
//!
//! Every chip of the family answers at 0x29 after a start. The drivers wake their chips one by one,
//! with the others held in reset, and move each to its own address. This applies to every later
//! start as well: after a brown-out two chips may be back at 0x29 at the same time. A driver
//! therefore holds the boot address until its chip has moved, and checks that no chip answers there
//! before it releases its own from reset. A chip without a pin ([`NoXshut`](crate::NoXshut)) is at
//! 0x29 from power-on until its driver has moved it.

use crate::xshut::Xshut;
use core::sync::atomic::{AtomicBool, Ordering};

/// The boot address of a bus, shared by all drivers on it. It may be a `static`. On cores without
/// an atomic exchange (Cortex-M0, RISC-V without `A`) the drivers of one bus must be in tasks that
/// do not preempt each other.
///
/// ```
/// use stampfly_vl53l3cx::BootAddress;
/// let boot = BootAddress::new();
/// assert!(!boot.is_taken());
/// static OF_THE_SECOND_BUS: BootAddress = BootAddress::new();
/// ```
#[derive(Debug, Default)]
pub struct BootAddress {
    taken: AtomicBool,
}

impl BootAddress {
    /// The boot address of a bus with every sensor in reset.
    #[must_use]
    pub const fn new() -> Self {
        Self { taken: AtomicBool::new(false) }
    }

    /// Whether a sensor is being woken.
    #[must_use]
    pub fn is_taken(&self) -> bool {
        self.taken.load(Ordering::Acquire)
    }

    /// Acquires the address for the chip with this pin; `None` while another driver holds it.
    pub(super) fn take<'a, X: Xshut>(&'a self, xshut: &'a mut X) -> Option<Waking<'a, X>> {
        if self.exchange() { None } else { Some(Waking { boot: self, xshut, awake: false }) }
    }

    /// Marks the address as taken, and returns whether it was taken before.
    fn exchange(&self) -> bool {
        #[cfg(target_has_atomic = "8")]
        return self.taken.swap(true, Ordering::AcqRel);
        #[cfg(not(target_has_atomic = "8"))]
        {
            let before = self.is_taken();
            self.taken.store(true, Ordering::Release);
            before
        }
    }
}

/// A chip that is being woken. If it is dropped before the chip has moved, the chip is reset.
pub(super) struct Waking<'a, X: Xshut> {
    boot: &'a BootAddress,
    xshut: &'a mut X,
    awake: bool,
}

impl<X: Xshut> Waking<'_, X> {
    /// Releases the chip from reset.
    pub(super) fn release(&mut self) -> Result<(), X::Error> {
        self.xshut.release()
    }

    /// Frees the boot address, because the chip now answers at its own address.
    pub(super) fn moved(mut self) {
        self.awake = true;
    }
}

impl<X: Xshut> Drop for Waking<'_, X> {
    fn drop(&mut self) {
        if !self.awake {
            // The next start reports a pin that refuses, because it sets the pin low first.
            let _ = self.xshut.hold();
        }
        self.boot.taken.store(false, Ordering::Release);
    }
}
