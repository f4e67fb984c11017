//! A Cortex-M4F: QEMU's board mps2-an386, with `-icount shift=7`.
//!
//! QEMU is told that an instruction takes 128 ns of its time ([`INSTRUCTION`]), so the core's timer counts instructions.

use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
pub use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use panic_semihosting as _;

/// What an instruction takes of the emulator's time, ns.
const INSTRUCTION: u64 = 128;
/// A tick of the core's timer: the board runs at 25 MHz, ns.
const TICK: u64 = 40;
/// The timer counts down from here.
const RELOAD: u32 = 0x00ff_ffff;

/// A reading of the timer.
#[derive(Clone, Copy)]
pub struct Ticks(u32);

impl Ticks {
    /// Ticks from this reading to a later one, less than 5 million instructions later.
    pub fn until(self, later: Self) -> u64 {
        u64::from(self.0.wrapping_sub(later.0) & RELOAD)
    }
}

/// Reads the timer.
#[inline(always)]
pub fn ticks() -> Ticks {
    Ticks(SYST::get_current())
}

/// How many instructions so many ticks are.
pub fn instructions(ticks: u64) -> u64 {
    (ticks * TICK + INSTRUCTION / 2) / INSTRUCTION
}

/// Writes a line.
pub fn line(text: core::fmt::Arguments<'_>) {
    hprintln!("{}", text);
}

/// Starts the timer.
pub fn start() {
    if let Some(peripherals) = Peripherals::take() {
        let mut timer = peripherals.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(RELOAD);
        timer.clear_current();
        timer.enable_counter();
    }
}

/// Ends the emulation, in success or not.
pub fn end(success: bool) -> ! {
    debug::exit(if success { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi();
    }
}
