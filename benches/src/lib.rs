//! What the benchmarks in `benches/` share.

pub mod flight;
pub mod stream;
