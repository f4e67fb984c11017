//! A vehicle's end of every conversation. One binary, because each would link the crate `mavlink` again:
//! `cargo test -p stampfly-services --test services mission` runs one file.

mod arbiter;
mod cable;
mod common;
#[cfg(feature = "mavlink")]
mod mavlink;
#[cfg(feature = "mavlink")]
mod mission;
#[cfg(feature = "mavlink")]
mod mission_line;
mod msp;
#[cfg(feature = "network")]
mod network;
#[cfg(feature = "mavlink")]
mod orders;
mod requests;
mod streams;
#[cfg(feature = "mavlink")]
mod targets;
mod tello;
