//! Data sets, evaluation and logs. One binary, because each would build the estimators again:
//! `cargo test -p stampfly-lab --test lab recorded` runs one file.

mod attitude;
mod calibration;
mod consistency;
mod damaged_files;
mod estimate;
mod flight_log;
mod foreign_log;
mod hostile_recordings;
mod pressure;
mod receiver;
mod recorded;
