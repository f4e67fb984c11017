//! Models, components and the assembled rover. One binary, because each would link the rover again:
//! `cargo test -p stampfly-rover --test rover acceptance` runs one file.

mod acceptance;
mod com;
mod common;
mod components;
mod models;
mod rules;
mod runnables;
