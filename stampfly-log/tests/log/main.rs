//! Logs, written, read and damaged. One binary, because each would link writer and reader again:
//! `cargo test -p stampfly-log --test log hostile` runs one file.

mod common;
mod hostile;
mod words;
