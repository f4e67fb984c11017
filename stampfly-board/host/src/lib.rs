//! The StampFly flight stack on a PC: what was flown and recorded, and how to look at it.
//!
//! | module | what it is |
//! |---|---|
//! | [`flight`] | a flight as columns over time, with units and names |
//! | [`flight_log`] | a flight from a ULog file of any origin |
//! | [`dataset`] | recorded sensor data with or without a reference, from five public formats, in our conventions |
//! | [`report`] | one self-contained HTML page of a flight: path in space, plots, events, figures |
//!
//! This crate uses files, floats in `f64` and an allocator; nothing in it belongs on a vehicle.

pub mod dataset;
pub mod campaign;
pub mod flight;
pub mod flight_log;
<<<<<<< HEAD
pub mod ground_station;
pub mod metrics;
pub mod mission;
pub mod recorder;
pub mod replay;
pub mod simulate;
=======
pub mod report;
>>>>>>> log

pub use dataset::Recording;
pub use flight::Flight;
pub use report::Report;
