//! What the benchmarks in `benches/` share.

pub mod acceptance;
pub mod flight;
pub mod stream;
