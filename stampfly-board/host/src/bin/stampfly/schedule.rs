//! `stampfly schedule`: the activation table, with the response times that follow from it.

use crate::Failure;
use crate::arguments::TopicsOptions;
use serde_json::json;
use stampfly_board::plan::{ACTIVATIONS, RESPONSE_TIMES};
use stampfly_board::wiring::TOPICS;
use stampfly_bus::{ActivationInfo, Band, Trigger};
use std::process::ExitCode;

/// Names of the columns.
const COLUMNS: [&str; 6] = ["runnable", "activated", "band", "budget, us", "response, us", "what"];

pub fn run(options: &TopicsOptions) -> Result<ExitCode, Failure> {
    let rows: Vec<[String; 6]> =
        ACTIVATIONS.iter().zip(RESPONSE_TIMES).map(|(info, time)| row(info, time.as_micros())).collect();
    if options.json {
        let rows: Vec<_> = ACTIVATIONS
            .iter()
            .zip(RESPONSE_TIMES)
            .zip(&rows)
            .map(|((info, time), [name, activated, band, _, _, doc])| {
                json!({
                    "name": name, "activated": activated, "band": band, "budget_us": info.budget.as_micros(),
                    "response_us": time.as_micros(), "doc": doc,
                })
            })
            .collect();
        outln!("{}", json!({ "activations": rows }));
    } else if options.markdown {
        outln!("| {} |\n|{}", COLUMNS.join(" | "), "---|".repeat(COLUMNS.len()));
        for [name, rest @ ..] in &rows {
            outln!("| `{name}` | {} |", rest.join(" | "));
        }
    } else {
        let [name, activated, band, budget, response, what] = COLUMNS;
        outln!("{name:<13} {activated:<36} {band:<11} {budget:>10} {response:>12}  {what}");
        for [name, activated, band, budget, response, what] in &rows {
            outln!("{name:<13} {activated:<36} {band:<11} {budget:>10} {response:>12}  {what}");
        }
        outln!(
            "\nBudget: what an activation may take. Response: from its trigger until it has published, at the latest."
        );
    }
    Ok(ExitCode::SUCCESS)
}

fn row(info: &ActivationInfo, response: u64) -> [String; 6] {
    let mut activated = match info.trigger {
        Trigger::On(topics) => {
            let names: Vec<&str> = topics.iter().filter_map(|topic| Some(TOPICS.get(*topic)?.name)).collect();
            format!("on {}", names.join(" or "))
        }
        Trigger::Every(period) => format!("every {} ms", period.as_micros() / 1_000),
        Trigger::After(before) => format!("after {}", ACTIVATIONS.get(before).map_or("", |info| info.name)),
        _ => String::new(),
    };
    if let Some(late) = info.at_latest {
        activated += &format!(" or at latest {} ms", late.as_micros() / 1_000);
    }
    let band = match info.band {
        Band::Flight => "flight",
        _ => "background",
    };
    let doc: Vec<&str> = info.doc.iter().map(|line| line.trim()).collect();
    [info.name.into(), activated, band.into(), info.budget.as_micros().to_string(), response.to_string(), doc.join(" ")]
}
