//! An Xtensa core with an FPU: QEMU's board sim, with `-icount shift=7`.
//!
//! QEMU is told that an instruction takes 128 ns of its time ([`INSTRUCTION`]), so the core's cycle counter, at 40 MHz,
//! counts instructions. The core is no LX7 and the compiler not Espressif's (see `xtensa/link.py`): its bits say something
//! about an ESP32-S3, its counts hardly.
#![allow(unsafe_code, reason = "the emulator's services and the core's counter are reached through assembly")]

use core::fmt::{self, Write};

/// What an instruction takes of the emulator's time, ns.
const INSTRUCTION: u64 = 128;
/// A tick of the counter, ns.
const TICK: u64 = 25;

/// Services of the emulator.
const EXIT: usize = 1;
const WRITE: usize = 4;
/// Where text goes.
const STDOUT: usize = 1;

unsafe extern "C" {
    // In xtensa/start.S.
    fn simcall(number: usize, a: usize, b: usize, c: usize) -> usize;
    fn cycle_count() -> u32;
}

/// A reading of the counter.
#[derive(Clone, Copy)]
pub struct Ticks(u32);

impl Ticks {
    /// Ticks from this reading to a later one, less than 800 million instructions later.
    pub fn until(self, later: Self) -> u64 {
        u64::from(later.0.wrapping_sub(self.0))
    }
}

/// Reads the counter.
#[inline(always)]
pub fn ticks() -> Ticks {
    // SAFETY: reads a register and nothing else.
    Ticks(unsafe { cycle_count() })
}

/// How many instructions so many ticks are.
pub fn instructions(ticks: u64) -> u64 {
    (ticks * TICK + INSTRUCTION / 2) / INSTRUCTION
}

struct Output;

impl Write for Output {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        // SAFETY: the emulator reads the text and keeps nothing of it.
        unsafe { simcall(WRITE, STDOUT, text.as_ptr() as usize, text.len()) };
        Ok(())
    }
}

/// Writes a line.
pub fn line(text: fmt::Arguments<'_>) {
    let _ = writeln!(Output, "{text}");
}

/// Nothing has to be started.
pub fn start() {}

/// Ends the emulation, in success or not.
pub fn end(success: bool) -> ! {
    exit(usize::from(!success))
}

fn exit(code: usize) -> ! {
    loop {
        // SAFETY: ends the emulation.
        unsafe { simcall(EXIT, code, 0, 0) };
    }
}

/// Where compiled code goes that should not be reached.
#[unsafe(no_mangle)]
extern "C" fn abort() -> ! {
    exit(102)
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    line(format_args!("{info}"));
    exit(101)
}
