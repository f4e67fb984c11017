//! `stampfly topics`: the topic table.

use crate::command_line::arguments::TopicsOptions;
use crate::command_line::failure::Failure;
use crate::vehicles::{self, ForVehicle};
use serde_json::json;
use stampfly_bus::{Schedule, TopicInfo, TopicTable};
use stampfly_sim::vehicle::Vehicle;
use stampfly_types::leaves;
use std::process::ExitCode;

pub fn run(options: &TopicsOptions) -> Result<ExitCode, Failure> {
    vehicles::with(&options.vehicle.name, Topics(options))?
}

struct Topics<'o>(&'o TopicsOptions);

impl ForVehicle for Topics<'_> {
    type Output = Result<ExitCode, Failure>;

    fn run<V: Vehicle>(self) -> Self::Output {
        print(self.0, <<V::Runnables as Schedule>::Topics as TopicTable>::TOPICS)
    }
}

fn print(options: &TopicsOptions, table: &[TopicInfo]) -> Result<ExitCode, Failure> {
    if options.json {
        let rows: Vec<_> = table
            .iter()
            .map(|topic| {
                json!({
                    "name": topic.name, "type": topic.message, "policy": topic.policy, "depth": topic.depth,
                    "rate": topic.rate, "publisher": topic.publisher, "readers": topic.readers,
                    "doc": topic.doc.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" "),
                    "fields": leaves(topic.fields).map(|leaf| json!({
                        "name": leaf.name.to_string(), "unit": leaf.unit, "count": leaf.count,
                    })).collect::<Vec<_>>(),
                })
            })
            .collect();
        outln!("{}", json!({ "topics": rows }));
    } else if options.markdown {
        outln!("| topic | message | policy | rate | publisher | readers | what |\n|---|---|---|---|---|---|---|");
        for topic in table {
            let doc: Vec<_> = topic.doc.iter().map(|line| line.trim()).collect();
            outln!(
                "| `{}` | `{}` | {} ({}) | {} | {} | {} | {} |",
                topic.name,
                topic.message,
                topic.policy,
                topic.depth,
                topic.rate,
                topic.publisher,
                topic.readers.join(", "),
                doc.join(" ")
            );
        }
    } else {
        outln!("{:<18} {:<18} {:<11} {:<9} {:<13} readers", "topic", "type", "policy", "rate", "publisher");
        for topic in table {
            let policy = format!("{}({})", topic.policy, topic.depth);
            outln!(
                "{:<18} {:<18} {policy:<11} {:<9} {:<13} {}",
                topic.name,
                topic.message,
                topic.rate,
                topic.publisher,
                topic.readers.join(", ")
            );
        }
        outln!("\n{} topics; the log reads all of them.", table.len());
    }
    Ok(ExitCode::SUCCESS)
}
