//! Path manager and modes. One binary, because each would link them again:
//! `cargo test -p stampfly-fixed-wing --test fixed-wing modes` runs one file.

mod anything;
mod bench;
mod modes;
mod path_manager;
mod vectors;
