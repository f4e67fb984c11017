//! What the board says of itself at `doctor`: why it started, how it reads its flash, what was stored, what memory is left.

use core::fmt::{self, Display};
use esp_hal::peripherals::SPI0;
use stampfly_flight::doctor::{Fact, FlashAccess, Restart, Verdict};

/// The radio needs no more than this once it runs, bytes.
const SPARE: usize = 4 * 1024;

/// What the board says of itself.
pub struct Facts {
    restart: Restart,
    flash: FlashAccess,
    stored: Stored,
    heap: Heap,
}

impl Facts {
    /// Reads the registers. `unusable` stored values were left out at power-on.
    pub fn read(unusable: usize) -> Self {
        let controller = SPI0::regs();
        let (control, clock) = (controller.ctrl().read().bits(), controller.clock().read().bits());
        let code = esp_hal::system::reset_reason().map_or(0, |reason| reason as u32);
        Self {
            restart: Restart::from_register(code),
            flash: FlashAccess::from_registers(control, clock),
            stored: Stored(unusable),
            heap: Heap,
        }
    }

    /// All of them, judged.
    pub fn all(&self) -> [Fact<'_>; 4] {
        let stored = match self.stored {
            Stored(0) => (Verdict::Pass, ""),
            Stored(_) => (Verdict::Look, "defaults apply: param save, or param reset"),
        };
        let heap = if esp_alloc::HEAP.free() > SPARE { (Verdict::Pass, "") } else { (Verdict::Look, "report it") };
        let fact = |name, value, (verdict, advice)| Fact { name, verdict, value, advice };
        [
            fact("restart", &self.restart as &dyn Display, self.restart.judge()),
            fact("flash", &self.flash, self.flash.judge()),
            fact("settings", &self.stored, stored),
            fact("heap", &self.heap, heap),
        ]
    }
}

/// Values that were stored and cannot be used.
struct Stored(usize);

impl Display for Stored {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} stored values cannot be used", self.0)
    }
}

/// The heap, which only the radio uses.
struct Heap;

impl Display for Heap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} bytes free", esp_alloc::HEAP.free())
    }
}
