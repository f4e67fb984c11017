//! `figures`: prints the README's figures, each from the command that measures it, and writes them there.
//!
//! Takes some minutes. Not part of `ci`: figures are read by people, and the bars they must meet are tests.

use super::program::released;
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture};
use std::fmt::Write;

const BEGIN: &str = "<!-- figures: cargo xtask figures -->\n";
const END: &str = "<!-- end of figures -->";

/// Title, arguments of `stampfly`, and what the reader should know.
const CAMPAIGNS: &[(&str, &[&str])] = &[
    ("Reference mission, 100 seeds, gusts of 0.5 m/s", &["campaign", "--flights", "100"]),
    (
        "The same through the real drivers and emulated chips on simulated buses",
        &["campaign", "--flights", "100", "--chips"],
    ),
    ("A minute of hovering, 100 seeds", &["campaign", "--flights", "100", "--mission", "hover"]),
    ("Four times the recorded vibration, 100 seeds", &["campaign", "--flights", "100", "--vibration", "4"]),
];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let program = released(repository)?;
    let mut text = String::new();
    for (title, arguments) in CAMPAIGNS {
        let (table, _) = capture(repository.command(&program.to_string_lossy()).args(*arguments))?;
        let _ = write!(text, "{title}: `stampfly {}`\n\n```text\n{table}```\n\n", arguments.join(" "));
    }
    print!("{text}");
    repository.fill("README.md", BEGIN, END, &text)
}
