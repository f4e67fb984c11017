//! `stampfly schedule`: the activation table, with the response times that follow from it.

use crate::command_line::arguments::TopicsOptions;
use crate::command_line::failure::Failure;
use crate::vehicles::{self, ForVehicle};
use serde_json::json;
use stampfly_bus::{ActivationInfo, Band, Schedule, TopicInfo, TopicTable, Trigger, response_time};
use stampfly_sim::vehicle::Vehicle;
use stampfly_types::Duration;
use std::process::ExitCode;

/// Names of the columns.
const COLUMNS: [&str; 6] = ["runnable", "activated", "band", "budget, us", "response, us", "what"];

pub fn run(options: &TopicsOptions) -> Result<ExitCode, Failure> {
    vehicles::with(&options.vehicle.name, Lines(options))?
}

struct Lines<'o>(&'o TopicsOptions);

impl ForVehicle for Lines<'_> {
    type Output = Result<ExitCode, Failure>;

    fn run<V: Vehicle>(self) -> Self::Output {
        print(self.0, V::Runnables::ACTIVATIONS, <<V::Runnables as Schedule>::Topics as TopicTable>::TOPICS)
    }
}

fn print(options: &TopicsOptions, table: &[ActivationInfo], topics: &[TopicInfo]) -> Result<ExitCode, Failure> {
    // A table whose lines have no bounds does not compile.
    let times: Vec<Duration> = (0..table.len()).filter_map(|line| response_time(table, topics, line).ok()).collect();
    let lines = || table.iter().zip(&times);
    let rows: Vec<[String; 6]> = lines().map(|(info, time)| row(info, time.as_micros(), table, topics)).collect();
    if options.json {
        let rows: Vec<_> = lines()
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

fn row(info: &ActivationInfo, response: u64, table: &[ActivationInfo], all: &[TopicInfo]) -> [String; 6] {
    let mut activated = match info.trigger {
        Trigger::On(topics) => {
            let names: Vec<&str> = topics.iter().filter_map(|topic| Some(all.get(*topic)?.name)).collect();
            format!("on {}", names.join(" or "))
        }
        Trigger::Every(period) => format!("every {} ms", period.as_micros() / 1_000),
        Trigger::After(before) => format!("after {}", table.get(before).map_or("", |info| info.name)),
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
