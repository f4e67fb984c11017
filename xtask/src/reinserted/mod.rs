//! Field bugs that are put back into a copy of the flight code, to see whether the campaign of faults finds them.
//!
//! [`list`] reads `xtask/bugs.toml`, [`guard`] writes a bug into a text, [`tree`] makes the copy, [`flight`] flies it, and
//! [`page`] is the table in `docs/explain/safety.md`. The step `bugs` puts them together.

pub mod flight;
pub mod guard;
pub mod list;
pub mod page;
pub mod tree;
