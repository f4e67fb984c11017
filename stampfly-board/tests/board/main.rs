//! The vehicle's flight stack, joined as the firmware joins it. One binary, because each would build the stack again:
//! `cargo test -p stampfly-board --test board pairing` runs one file.

#[cfg(feature = "simulation")]
mod accepted;
#[cfg(feature = "simulation")]
mod air;
#[cfg(feature = "simulation")]
mod asked;
mod bench;
mod configuration;
mod console;
mod exchange;
mod golden;
mod pairing;
mod rules;
mod secured;
mod self_test;
#[cfg(feature = "simulation")]
mod software_time;
mod state;
