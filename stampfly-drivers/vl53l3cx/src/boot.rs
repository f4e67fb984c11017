//! Who may start at the address that all chips of the family start at.
//!
//! Two of them on a bus answer at 0x29 after every start and are moved elsewhere one by one, the others in reset. That
//! holds for the first start and for every later one: after a brown-out both may be back at once. So whoever wakes a
//! chip holds the address until it has moved on; and before it lets its own chip out of reset it asks whether somebody
//! answers there already. A chip without a pin ([`NoXshut`](crate::NoXshut)) is at that address from power-on until its driver has moved it.

use crate::xshut::Xshut;
use core::sync::atomic::{AtomicBool, Ordering};

/// The boot address of a bus: one for all sensors on it, lent to each. It may be a `static`. On cores without an atomic exchange
/// (Cortex-M0, RISC-V without `A`) the drivers of one bus belong into tasks that do not interrupt each other.
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
    /// A bus with every sensor in reset.
    #[must_use]
    pub const fn new() -> Self {
        Self { taken: AtomicBool::new(false) }
    }

    /// Is a sensor waking up right now?
    #[must_use]
    pub fn is_taken(&self) -> bool {
        self.taken.load(Ordering::Acquire)
    }

    /// The address, with the pin of the chip that is to wake there; `None` while another has it.
    pub(super) fn take<'a, X: Xshut>(&'a self, xshut: &'a mut X) -> Option<Waking<'a, X>> {
        if self.exchange() { None } else { Some(Waking { boot: self, xshut, awake: false }) }
    }

    /// Takes the address, and says whether it was taken before.
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

/// A chip that wakes up. Dropped before it has moved on, whatever the reason, it is back in reset.
pub(super) struct Waking<'a, X: Xshut> {
    boot: &'a BootAddress,
    xshut: &'a mut X,
    awake: bool,
}

impl<X: Xshut> Waking<'_, X> {
    /// Out of reset.
    pub(super) fn release(&mut self) -> Result<(), X::Error> {
        self.xshut.release()
    }

    /// It answers at its own address: the boot address is free again.
    pub(super) fn moved(mut self) {
        self.awake = true;
    }
}

impl<X: Xshut> Drop for Waking<'_, X> {
    fn drop(&mut self) {
        if !self.awake {
            // A pin that refuses is reported at the next start, which sets it low first.
            let _ = self.xshut.hold();
        }
        self.boot.taken.store(false, Ordering::Release);
    }
}
