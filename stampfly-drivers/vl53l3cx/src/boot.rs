//! Who may start at the address that all chips of the family start at.
//!
//! Two of them on a bus answer at 0x29 after every start and are moved elsewhere one by one, the others in reset. That
//! holds for the first start and for every later one: after a brown-out both may be back at once. So whoever wakes a
//! chip holds the address until it has moved on; and before it lets its own chip out of reset it asks whether somebody
//! answers there already. Not for a lone sensor without a reset pin: it has nothing to share.

use core::cell::Cell;
use embedded_hal::digital::OutputPin;

/// The boot address of a bus: one for all sensors on it, lent to each.
///
/// ```
/// use stampfly_vl53l3cx::BootAddress;
/// let boot = BootAddress::new();
/// assert!(!boot.is_taken());
/// ```
#[derive(Debug, Default)]
pub struct BootAddress {
    taken: Cell<bool>,
}

impl BootAddress {
    /// A bus with every sensor in reset.
    #[must_use]
    pub const fn new() -> Self {
        Self { taken: Cell::new(false) }
    }

    /// Is a sensor waking up right now?
    #[must_use]
    pub fn is_taken(&self) -> bool {
        self.taken.get()
    }

    /// The address, with the pin of the chip that is to wake there; `None` while another has it.
    pub(super) fn take<'a, X: OutputPin>(&'a self, xshut: &'a mut X) -> Option<Waking<'a, X>> {
        if self.taken.replace(true) { None } else { Some(Waking { boot: self, xshut, awake: false }) }
    }
}

/// A chip that wakes up. Dropped before it has moved on, whatever the reason, it is back in reset.
pub(super) struct Waking<'a, X: OutputPin> {
    boot: &'a BootAddress,
    xshut: &'a mut X,
    awake: bool,
}

impl<X: OutputPin> Waking<'_, X> {
    /// Out of reset.
    pub(super) fn release(&mut self) -> Result<(), X::Error> {
        self.xshut.set_high()
    }

    /// It answers at its own address: the boot address is free again.
    pub(super) fn moved(mut self) {
        self.awake = true;
    }
}

impl<X: OutputPin> Drop for Waking<'_, X> {
    fn drop(&mut self) {
        if !self.awake {
            // A pin that refuses is reported at the next start, which sets it low first.
            let _ = self.xshut.set_low();
        }
        self.boot.taken.set(false);
    }
}
