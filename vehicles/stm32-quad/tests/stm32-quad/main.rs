//! Components, tables and flights of the quadcopter. One binary, because each would link it again:
//! `cargo test -p stampfly-stm32-quad --test stm32-quad tables` runs one file.

mod board;
#[cfg(feature = "simulation")]
mod crashes;
mod eeprom;
#[cfg(feature = "simulation")]
mod envelope;
#[cfg(feature = "simulation")]
mod flight;
mod protection;
#[cfg(feature = "simulation")]
mod recorded;
mod tables;
mod vectors;
