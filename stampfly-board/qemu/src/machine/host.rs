//! A PC, for the bits the others are compared with. It counts nothing.

use std::process::ExitCode;

/// A reading of a counter that stands still.
#[derive(Clone, Copy)]
pub struct Ticks;

impl Ticks {
    /// Ticks from this reading to a later one.
    pub fn until(self, _: Self) -> u64 {
        0
    }
}

/// Reads the counter.
pub fn ticks() -> Ticks {
    Ticks
}

/// How many instructions so many ticks are.
pub fn instructions(ticks: u64) -> u64 {
    ticks
}

/// Writes a line.
pub fn line(text: core::fmt::Arguments<'_>) {
    println!("{text}");
}

pub(crate) fn main() -> ExitCode {
    if crate::run() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
