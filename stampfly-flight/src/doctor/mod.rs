//! A vehicle examines itself: one line a check, for people to read and for programs to sort.
//!
//! ```text
//! check NAME pass|LOOK|FAIL VALUE [-- what to do]
//! ```
//!
//! `doctor` at the [console](crate::console) answers with [`examine`]: what the drivers say of themselves, how long
//! activations take, how the self test went, what refuses to arm, and the [`Fact`]s that only the board knows. A program
//! reads the lines with [`Finding::parse`]; it does the checks for which somebody has to tilt, look and listen. Not for
//! flight: it judges a vehicle that stands.

mod board;
mod examine;
mod finding;

pub use board::{FlashAccess, Restart};
pub use examine::examine;
pub use finding::{Fact, Finding, Verdict};
