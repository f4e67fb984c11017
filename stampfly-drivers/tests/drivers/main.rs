//! Tests for all drivers. They are one binary, because each binary would link the drivers again;
//! `cargo test -p stampfly-drivers --test drivers limits` runs one file.

mod blocking;
mod limits;
mod send;
mod standstill;
