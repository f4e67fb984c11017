//! What holds for every driver. One binary, because each would link the drivers again:
//! `cargo test -p stampfly-drivers --test drivers limits` runs one file.

mod blocking;
mod limits;
mod send;
mod standstill;
