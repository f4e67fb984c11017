//! An RV32IMAFC core, with floating point in hardware: QEMU's board virt, with `-icount shift=0`, under which the core's
//! own count of retired instructions is exact.

use riscv::register::minstret;
pub use riscv_rt::entry;
use semihosting::{print, process};

/// A reading of the counter.
#[derive(Clone, Copy)]
pub struct Ticks(usize);

impl Ticks {
    /// Instructions from this reading to a later one, less than 2³² later.
    pub fn until(self, later: Self) -> u64 {
        later.0.wrapping_sub(self.0) as u64
    }
}

/// Reads the counter.
#[inline(always)]
pub fn ticks() -> Ticks {
    Ticks(minstret::read())
}

/// How many instructions so many ticks are.
pub fn instructions(ticks: u64) -> u64 {
    ticks
}

/// Writes a line.
pub fn line(text: core::fmt::Arguments<'_>) {
    print!("{text}\n");
}

/// Nothing has to be started.
pub fn start() {}

/// Ends the emulation, in success or not.
pub fn end(success: bool) -> ! {
    process::exit(if success { 0 } else { 1 })
}
