//! Programs that fly vehicles on a PC: one flight, many flights, a flight again, a page about it.
//!
//! | module | what it is |
//! |---|---|
//! | [`command_line`] | the commands of the program `stampfly`, which has nothing else inside |
//! | [`vehicles`] | the list of vehicles: the only place that names one |
//! | [`flown`] | one simulated flight, with its figures |
//! | [`campaign`] | many flights in parallel |
//! | [`golden`] | a short flight to ask other machines whether they compute the same |
//! | [`hil`] | hardware in the loop: a vehicle at the other end of a line flies the simulated world |
//! | [`flight`] | a flight as columns over time, with units and names |
//! | [`flight_log`] | a flight from a ULog file, of this stack or another one |
//! | [`log`] | tools for logs: info, tables, MCAP, a part of one |
//! | [`log_file`] | a log that grows while others read it |
//! | [`serve`] | the ports at which other programs fly a simulated vehicle |
//! | [`doctor`] | walks a newcomer through a vehicle before its first flight |
//! | [`connect`] | the ground station of a real vehicle, at a serial port or behind TCP |
//! | [`ground`] | a page that shows vehicles as they fly, and asks them for things |
//! | [`report`] | one self-contained HTML page of a flight: path in space, plots, events, figures |
//!
//! The executor is `stampfly-sim`'s, replay and golden flight are `stampfly-flight`'s; everything here is generic over
//! [`Vehicle`](stampfly_sim::vehicle::Vehicle).

pub mod campaign;
pub mod command_line;
pub mod connect;
pub mod doctor;
pub mod flight;
pub mod flight_log;
pub mod flown;
pub mod golden;
pub mod ground;
pub mod hil;
pub mod log;
pub mod log_file;
mod page;
pub mod report;
pub mod serve;
pub mod vehicles;
mod waited;

pub use flight::Flight;
pub use report::Report;
/// The log of a flight.
pub use stampfly_sim::recorder;
