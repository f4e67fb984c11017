//! The tables of `docs/explain/safety.md` that come from campaigns.

use super::results::{Found, Results};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fmt::Write;

/// Where a table stands: the document, and what is before and after it.
pub type Place = (&'static str, &'static str, &'static str);

/// Rates of the campaigns of faults, and whether cuts were right.
pub const RATES: Place =
    ("docs/explain/safety.md", "<!-- rates: cargo xtask docs --fix -->\n", "<!-- end of rates -->");
/// Flights of the first campaign that end wrong.
pub const WRONG: Place =
    ("docs/explain/safety.md", "<!-- wrong: cargo xtask docs --fix -->\n", "<!-- end of wrong -->");
/// Sticks of people.
pub const STICKS: Place =
    ("docs/explain/safety.md", "<!-- sticks: cargo xtask docs --fix -->\n", "<!-- end of sticks -->");

/// What each hypothesis of the monitor is worth.
pub const ABLATION: Place =
    ("docs/explain/safety.md", "<!-- ablation: cargo xtask docs --fix -->\n", "<!-- end of ablation -->");

/// The campaign with all hypotheses of the monitor, and the beginning of the names of those without one.
pub const ALL: &str = "monitor: all hypotheses";
pub const WITHOUT: &str = "monitor: without ";

/// The verdict of a flight whose only mistake was to stop its motors.
const NEEDLESS: &str = "needless-cut";

/// Every table with its place.
pub fn tables(results: &Results) -> [(Place, String); 4] {
    let ablation = (ABLATION, ablation(results));
    [(RATES, rates(results)), (WRONG, wrong(results)), (STICKS, sticks(results)), ablation]
}

/// Is it one of the campaigns about the monitor's hypotheses?
fn ablates(result: &Found) -> bool {
    result.name == ALL || result.name.starts_with(WITHOUT)
}

fn ablation(results: &Results) -> String {
    let Some(all) = results.of(ALL) else { return "\n".into() };
    let wrong = |found: &Found| found.report["faulted"]["wrong_end"]["count"].as_u64().unwrap_or(0);
    let needless = |found: &Found| found.report["needless_cuts"].as_u64().unwrap_or(0);
    let flights = all.report["faulted"]["wrong_end"]["of"].as_u64().unwrap_or(0);
    let mut text = format!(
        "\nFlown by {}:\n\n```console\n$ {}\n```\n\n| without | wrong ends of {} | more than with all | of these flights | needless cuts |\n\
         |---|---|---|---|---|\n| none | {} | | | {} |\n",
        all.program.flown_by,
        all.line,
        thousands(flights),
        wrong(all),
        needless(all)
    );
    // Another program's flights are other flights.
    let compared = |found: &&Found| found.name.starts_with(WITHOUT) && found.program == all.program;
    for found in results.results.iter().filter(compared) {
        let name = found.name.strip_prefix(WITHOUT).unwrap_or_default();
        let more = wrong(found).cast_signed() - wrong(all).cast_signed();
        let share = 100.0 * more as f64 / flights.max(1) as f64;
        let _ = writeln!(text, "| {} | {} | {more} | {share:.2} % | {} |", code(name), wrong(found), needless(found));
    }
    text + "\n"
}

fn rates(results: &Results) -> String {
    let faults: Vec<_> =
        results.results.iter().filter(|result| result.report.get("faulted").is_some() && !ablates(result)).collect();
    let mut text = "\n```console\n".to_owned();
    for result in &faults {
        let _ = writeln!(text, "$ {}", result.line);
    }
    text += "```\n\nFlights with a fault that changed something:\n\n\
             | campaign | flown by | flights | wrong end | invariant violated |\n|---|---|---|---|---|\n";
    for Found { name, program, report, .. } in &faults {
        let part = |what: &str| rate(&report["faulted"][what]);
        let (by, flights) = (&program.flown_by, whole(&report["faulted"]["failed"]["of"]));
        let [wrong, violated] = ["wrong_end", "invariant_violated"].map(part);
        let _ = writeln!(text, "| {name} | {by} | {flights} | {wrong} | {violated} |");
    }
    text += "\nFlights without a fault:\n\n| campaign | flights | failed |\n|---|---|---|\n";
    for Found { name, report, .. } in &faults {
        let nominal = &report["nominal"];
        if nominal["flights"] != 0 {
            let _ = writeln!(text, "| {name} | {} | {} |", whole(&nominal["flights"]), rate(&nominal["failed"]));
        }
    }
    text += "\nFlights whose motors a protection stopped in the air, and what flying on would have done:\n\n\
             | stopped by |";
    faults.iter().for_each(|result| text += &format!(" {}: needless |", result.name));
    text += "\n|---|";
    faults.iter().for_each(|_| text += "---|");
    let names = |result: &Found| result.report["cuts"].as_object().cloned().unwrap_or_default();
    let protections: BTreeSet<String> =
        faults.iter().flat_map(|result| names(result).into_iter().map(|(name, _)| name)).collect();
    for protection in protections {
        let _ = write!(text, "\n| {} |", protection.split('+').map(code).collect::<Vec<_>>().join(", "));
        faults.iter().for_each(|result| text += &format!(" {} |", rate(&result.report["cuts"][&protection])));
    }
    text + "\n\n"
}

fn wrong(results: &Results) -> String {
    let Some(Found { report, .. }) = results.results.first() else { return "\n".into() };
    let mut text = "\n| fault | flight | ends | why |\n|---|---|---|---|\n".to_owned();
    let mut none = true;
    for failure in report["failures"].as_array().into_iter().flatten() {
        let said = |name: &str| failure[name].as_str().unwrap_or_default();
        if said("verdict") == NEEDLESS {
            continue;
        }
        none = false;
        let word = |option: &str| said("flown").split(option).nth(1)?.split_whitespace().next();
        let mode = word("--mode ").map_or_else(|| "by a program".to_owned(), |mode| mode.to_uppercase());
        let seed = word("--seed ").unwrap_or("?");
        let more = match failure["flights"].as_u64() {
            Some(flights) if flights > 1 => format!(", and {} more", flights - 1),
            _ => String::new(),
        };
        let (fault, phase) = (said("fault"), said("phase"));
        let ends = said("verdict").split(' ').collect::<Vec<_>>().join(", ");
        let _ = writeln!(text, "| `{fault}@{phase}` | {mode}, seed {seed}{more} | {ends} | {} |", cell(said("reason")));
    }
    if none {
        text += "| none | | | |\n";
    }
    text += "\nNeedless cuts by fault:\n\n| fault | motors stopped in the air | of those needlessly |\n|---|---|---|\n";
    for (fault, of) in report["needless_by_fault"].as_object().into_iter().flatten() {
        let _ = writeln!(text, "| `{fault}` | {} | {} |", whole(&of["of"]), whole(&of["count"]));
    }
    text + "\n"
}

fn sticks(results: &Results) -> String {
    let mut text = "\n```console\n".to_owned();
    let files: Vec<_> = results.results.iter().filter(|result| result.report.get("well").is_some()).collect();
    for result in &files {
        let _ = writeln!(text, "$ {}", result.line);
    }
    text += "```\n\n| files | flown by | flights | without an intervention while sound | interventions while sound |\n\
             |---|---|---|---|---|\n";
    for Found { name, program, report, .. } in &files {
        let named = interventions(&report["while_sound"]);
        let named = if named.is_empty() { "none".into() } else { named };
        let _ = writeln!(
            text,
            "| {name} | {} | {} | {} | {named} |",
            program.flown_by,
            whole(&report["flights"]),
            rate(&report["unhindered"])
        );
    }
    text += "\nThe files among them in which a sound vehicle did something by itself:\n\n\
             | files | file | mode | flights | what it did |\n|---|---|---|---|---|\n";
    for Found { name, report, .. } in &files {
        for cell in report["hindered"].as_array().into_iter().flatten() {
            let word = |key: &str| cell[key].as_str();
            let (file, mode) = (word("file").unwrap_or("?"), word("mode").unwrap_or("its own"));
            let did = interventions(&cell["while_sound"]);
            let _ = writeln!(text, "| {name} | `{file}` | {mode} | {} | {did} |", whole(&cell["flights"]));
        }
    }
    text + "\n"
}

/// Counts of interventions by alert and action, the most frequent first.
fn interventions(counts: &Value) -> String {
    let counts = counts.as_object().into_iter().flatten();
    let mut counts: Vec<_> = counts.filter_map(|(what, count)| Some((what, count.as_u64()?))).collect();
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let named = counts.iter().map(|(what, count)| {
        let (alert, action) = what.split_once(' ').unwrap_or((what, ""));
        let does = match action {
            "cut" => "cuts",
            "land" => "lands",
            "mode" => "changes the mode in",
            other => other,
        };
        format!("{} {does} {count}", code(alert))
    });
    named.collect::<Vec<_>>().join(", ")
}

/// How many, and the interval in per cent; a dash where there were none to count among.
fn rate(rate: &Value) -> String {
    let number = |name: &str| rate[name].as_f64();
    match (rate["count"].as_u64(), rate["of"].as_u64(), number("rate"), number("low"), number("high")) {
        (Some(count), Some(of), Some(share), Some(low), Some(high)) => {
            let [share, low, high] = [share, low, high].map(|share| 100.0 * share);
            format!("{} of {}, {share:.2} % ({low:.2} to {high:.2} %)", thousands(count), thousands(of))
        }
        _ => "–".into(),
    }
}

fn whole(number: &Value) -> String {
    number.as_u64().map_or_else(|| "–".into(), thousands)
}

/// With a comma between thousands.
fn thousands(number: u64) -> String {
    let digits = number.to_string();
    let first = digits.len() % 3;
    let mut groups: Vec<_> = (first..digits.len()).step_by(3).filter_map(|at| digits.get(at..at + 3)).collect();
    groups.splice(0..0, digits.get(..first).filter(|group| !group.is_empty()));
    groups.join(",")
}

fn code(name: &str) -> String {
    format!("`{name}`")
}

fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::safety::results::Program;
    use serde_json::json;

    fn program(commit: &str) -> Program {
        Program { flown_by: commit.into(), golden: String::new() }
    }

    fn results() -> Results {
        let rate = |count: u64, of: u64| json!({ "count": count, "of": of, "rate": 0.01, "low": 0.005, "high": 0.02 });
        let failure = |verdict: &str, flights: u64| {
            json!({
                "fault": "tof-stuck", "phase": "hover", "verdict": verdict, "flights": flights,
                "reason": "1.2 m above | the highest height", "line": "smaller",
                "flown": "stampfly fly --seed 17 --fault tof-stuck@hover --mode acro --pilot",
            })
        };
        let part = json!({
            "flights": 2_900, "failed": rate(9, 2_900), "wrong_end": rate(29, 2_900), "invariant_violated": rate(0, 2_900),
        });
        let mut results = Results::default();
        results.put(
            "usual sizes",
            "stampfly campaign --faults",
            &program("1a"),
            &json!({
                "flights": 3_000, "faulted": part, "nominal": { "flights": 0 },
                "cuts": { "IMPACT": rate(3, 40), "IMPACT+TUMBLED": rate(0, 2) },
                "needless_by_fault": { "wall": { "count": 3, "of": 40 } },
                "failures": [failure("flown-away", 2), failure("needless-cut", 3)],
            }),
        );
        results.put(
            "recordings",
            "stampfly campaign --sticks",
            &program("2b"),
            &json!({
                "flights": 156, "well": rate(1, 156), "unhindered": rate(133, 156),
                "while_sound": { "FLOW_IMPLAUSIBLE mode": 1, "IMU_FAULTY cut": 16 },
                "cells": [{
                    "file": "/data/15.csv", "mode": "acro", "flights": 3, "while_sound": { "IMU_FAULTY cut": 2 },
                }],
            }),
        );
        results
    }

    #[test]
    fn rates_have_their_intervals_and_needless_cuts_stand_apart() {
        let results = results();
        let rates = rates(&results);
        assert!(rates.contains("$ stampfly campaign --faults\n") && !rates.contains("--sticks"), "{rates}");
        assert!(
            rates.contains("| usual sizes | 1a | 2,900 | 29 of 2,900, 1.00 % (0.50 to 2.00 %) | 0 of 2,900"),
            "{rates}"
        );
        assert!(rates.contains("| `IMPACT`, `TUMBLED` | 0 of 2,"), "{rates}");
        let wrong = wrong(&results);
        let row = "| `tof-stuck@hover` | ACRO, seed 17, and 1 more | flown-away | 1.2 m above \\| the highest height |";
        assert!(wrong.contains(row) && wrong.contains("| `wall` | 40 | 3 |"), "{wrong}");
        assert_eq!(wrong.matches("tof-stuck").count(), 1, "{wrong}");
    }

    #[test]
    fn sticks_have_the_most_frequent_intervention_first() {
        let sticks = sticks(&results());
        let row = "| recordings | 2b | 156 | 133 of 156, 1.00 % (0.50 to 2.00 %) | `IMU_FAULTY` cuts 16, `FLOW_IMPLAUSIBLE` changes the mode in 1 |";
        assert!(sticks.contains(row) && !sticks.contains("usual sizes"), "{sticks}");
        assert!(sticks.contains("| recordings | `15` | acro | 3 | `IMU_FAULTY` cuts 2 |"), "{sticks}");
    }

    #[test]
    fn what_a_hypothesis_is_worth_is_what_ends_wrong_without_it() {
        let mut results = results();
        let report = |wrong: u64| {
            let end = json!({ "count": wrong, "of": 3_000, "rate": 0.01, "low": 0.005, "high": 0.02 });
            json!({ "flights": 3_000, "needless_cuts": 4, "faulted": { "flights": 3_000, "failed": end, "wrong_end": end } })
        };
        results.put(ALL, "stampfly campaign --only tof-stuck", &program("1a"), &report(40));
        results.put(&format!("{WITHOUT}range_stuck"), "stampfly campaign", &program("1a"), &report(55));
        let table = ablation(&results);
        assert!(table.contains("| none | 40 | | | 4 |\n| `range_stuck` | 55 | 15 | 0.50 % | 4 |"), "{table}");
        assert!(!rates(&results).contains("monitor:"));
    }

    #[test]
    fn thousands_are_told_apart() {
        let text = |number| thousands(number);
        assert_eq!([0, 999, 1_000, 50_000, 1_234_567].map(text), ["0", "999", "1,000", "50,000", "1,234,567"]);
    }
}
