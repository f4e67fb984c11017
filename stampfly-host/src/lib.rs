//! The StampFly flight stack on a PC: what was flown and recorded, and how to look at it.
//!
//! | module | what it is |
//! |---|---|
//! | [`simulate`] | one simulated vehicle with its whole flight stack, on virtual time |
//! | [`sensing`] | what feeds its bus: models of the sensors, or the drivers over emulated chips |
//! | [`mission`], [`ground_station`] | what to fly, and who asks the vehicle for it |
//! | [`metrics`] | how good a flight was |
//! | [`campaign`] | many flights in parallel |
//! | [`consistency`] | is the estimator as good as it says? |
//! | [`recorder`], [`replay`] | the log of a flight, and the flight again from its log |
//! | [`golden`] | a short flight to ask other machines whether they compute the same |
//! | [`flight`] | a flight as columns over time, with units and names |
//! | [`flight_log`] | a flight from a ULog file of any origin |
//! | [`dataset`] | recorded sensor data with or without a reference, from five public formats, in our conventions |
//! | [`estimate`] | an estimator over recorded data, and how good it is |
//! | [`chart`] | charts for documents, as SVG |
//! | [`report`] | one self-contained HTML page of a flight: path in space, plots, events, figures |
//!
//! This crate uses files, floats in `f64` and an allocator; nothing in it belongs on a vehicle.

pub mod campaign;
pub mod chart;
pub mod consistency;
pub mod dataset;
pub mod estimate;
pub mod flight;
pub mod flight_log;
pub mod golden;
pub mod ground_station;
pub mod metrics;
pub mod mission;
pub mod recorder;
pub mod replay;
pub mod report;
pub mod sensing;
pub mod simulate;

pub use dataset::Recording;
pub use flight::Flight;
pub use report::Report;
