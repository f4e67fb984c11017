//! Recorded flights and what estimators make of them.
//!
//! | module | what it is |
//! |---|---|
//! | [`dataset`] | recorded sensor data with or without a reference, from five public formats, in our conventions |
//! | [`estimate`] | an estimator over recorded data, and how good it is |
//! | [`consistency`] | is the estimator as good as it says? |
//! | [`flight`] | a flight as columns over time, with units and names |
//! | [`flight_log`] | a flight from a ULog file of any origin |
//! | [`chart`] | charts for documents, as SVG |
//!
//! For multirotors: the estimator under test is the StampFly's. Uses files, floats in `f64` and an allocator.

pub mod chart;
pub mod consistency;
pub mod dataset;
pub mod estimate;
pub mod flight;
pub mod flight_log;

pub use dataset::Recording;
pub use flight::Flight;
