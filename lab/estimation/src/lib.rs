//! Recorded flights and what estimators make of them.
//!
//! | module | what it is |
//! |---|---|
//! | [`dataset`] | recorded sensor data with or without a reference, from five public formats, in our conventions |
//! | [`estimate`] | an estimator over recorded data, and how good it is |
//! | [`consistency`] | is the estimator as good as it says? |
//! | [`chart`] | charts for documents, as SVG |
//!
//! For multirotors: the estimator under test is the StampFly's. Uses files, floats in `f64` and an allocator.

pub mod chart;
pub mod consistency;
pub mod dataset;
pub mod estimate;

pub use dataset::Recording;
