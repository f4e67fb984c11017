//! What campaigns found: the file, and its tables in `docs/safety.md`.

pub mod page;
pub mod results;
