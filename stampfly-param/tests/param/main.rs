//! Parameters, and the flash that they are kept in. One binary, because each would link the store
//! again: `cargo test -p stampfly-param --test param store` runs one file.

mod flash;
mod foreign;
mod power_cuts;
mod requested;
mod set;
mod store;
