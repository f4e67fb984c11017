//! Flight loop, records, console and golden flights. One binary, because each would link the loop again:
//! `cargo test -p stampfly-flight --test flight console` runs one file.

mod common;
#[cfg(feature = "replay")]
mod compact;
mod console;
mod dump;
mod golden;
mod hil;
#[cfg(feature = "replay")]
mod replay;
mod task;
