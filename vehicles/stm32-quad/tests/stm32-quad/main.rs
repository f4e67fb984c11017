//! Components, tables and flights of the quadcopter. One binary, because each would link it again:
//! `cargo test -p stampfly-stm32-quad --test stm32-quad tables` runs one file.

mod board;
mod eeprom;
#[cfg(feature = "simulation")]
mod flight;
mod tables;
mod vectors;
