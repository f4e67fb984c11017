//! `figures`: prints the campaigns of `docs/reference/figures.md`, each from its command, and writes them there.
//!
//! Takes some minutes. Not part of `ci`: figures are read by people, and the bars they must meet are tests.

use super::program::released;
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture};
use std::fmt::Write;

/// The document the tables are written into, and where.
const DOCUMENT: &str = "docs/reference/figures.md";
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
        let _ =
            write!(text, "{title}: `stampfly {}`\n\n```text\n{}```\n\n", arguments.join(" "), without_speed(&table));
    }
    print!("{text}");
    repository.fill(DOCUMENT, BEGIN, END, &text)
}

/// A table without its speed, which depends on the machine; `cargo xtask bars` measures that.
fn without_speed(table: &str) -> String {
    let kept = |line: &str| {
        line.strip_suffix(" cores")
            .and_then(|line| line.rsplit_once("; "))
            .map_or(line.to_owned(), |(kept, _)| kept.to_owned())
    };
    table.lines().map(|line| kept(line) + "\n").collect()
}

#[cfg(test)]
mod tests {
    use super::without_speed;

    #[test]
    fn only_the_speed_is_left_out() {
        let table = "a 1; b\n\n9 of 9 flights succeeded; 70 × real time on 2 cores\n";
        assert_eq!(without_speed(table), "a 1; b\n\n9 of 9 flights succeeded\n");
    }
}
