//! Tests of buses, slots and clocks. `cargo test -p stampfly-driver-core --test driver-core slot`
//! runs one file.

#[cfg(feature = "embassy-time")]
mod embassy;
mod recovery;
mod slot;
