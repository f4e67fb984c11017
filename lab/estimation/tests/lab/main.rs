//! Data sets and evaluation, in one program, because each program would link the estimators again.
//! `cargo test --test lab recorded` runs one file.

mod attitude;
mod calibration;
mod command;
mod consistency;
#[path = "../../../../stampfly-host/tests/host/damage.rs"]
mod damage;
mod damaged_files;
mod estimate;
mod hostile_recordings;
mod pressure;
mod receiver;
mod recorded;
