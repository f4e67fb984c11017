//! What campaigns found: the file, and its tables in `docs/explain/safety.md`.

pub mod page;
pub mod results;
