//! The table of re-inserted bugs in `docs/explain/safety.md`.

use super::list::Bug;
use std::fmt::Write;

/// The document, and what is before and after the table.
pub const PLACE: (&str, &str, &str) =
    ("docs/explain/safety.md", "<!-- bugs: cargo xtask docs --fix -->\n", "<!-- end of bugs -->");

/// The table.
pub fn table(bugs: &[Bug]) -> String {
    let (found, missed): (Vec<_>, Vec<_>) = bugs.iter().partition(|bug| bug.flight.is_some());
    let mut text = format!("\nFound: {} of {} tried.\n", found.len(), bugs.len());
    text += "\n| bug | met in | what is wrong | flight | ends |\n|---|---|---|---|---|\n";
    for Bug { name, source, what, flight, ends, .. } in found {
        let [flight, ends] = [flight, ends].map(|text| cell(text.as_deref().unwrap_or_default()));
        let flight = flight.trim_start_matches("stampfly fly ");
        let _ = writeln!(text, "| {name} | {} | {} | `{flight}` | {ends} |", cell(source), cell(what));
    }
    if !missed.is_empty() {
        text += "\nNot found:\n";
        text += "\n| bug | met in | what is wrong | flights |\n|---|---|---|---|\n";
        for Bug { name, source, what, missed, .. } in missed {
            let why = missed.as_deref().unwrap_or("not looked into");
            let _ = writeln!(text, "| {name} | {} | {} | {} |", cell(source), cell(what), cell(why));
        }
    }
    text + "\n"
}

fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bugs_that_were_found_have_their_flight_and_others_a_reason() {
        let [name, what] = ["sign", "a | b"].map(str::to_owned);
        let missed = Bug { name, what, ..Bug::default() };
        let flight = Some("stampfly fly --seed 7".to_owned());
        let found = Bug { flight, ends: Some("crashed".into()), ..missed.clone() };
        let table = table(&[found, missed]);
        assert!(table.contains("Found: 1 of 2 tried.") && table.contains("| `--seed 7` | crashed |"), "{table}");
        assert!(table.contains("a \\| b | not looked into |"));
    }
}
