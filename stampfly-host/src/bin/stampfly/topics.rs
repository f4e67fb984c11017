//! `stampfly topics`: the topic table.

use crate::Failure;
use crate::arguments::TopicsOptions;
use serde_json::json;
use stampfly_board::wiring::TOPICS;
use std::process::ExitCode;

pub fn run(options: &TopicsOptions) -> Result<ExitCode, Failure> {
    if options.json {
        let rows: Vec<_> = TOPICS
            .iter()
            .map(|topic| {
                json!({
                    "name": topic.name, "type": topic.message, "policy": topic.policy, "depth": topic.depth,
                    "rate": topic.rate, "publisher": topic.publisher, "readers": topic.readers,
                    "doc": topic.doc.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" "),
                    "fields": topic.fields.iter().map(|field| json!({
                        "name": field.name, "unit": field.unit, "count": field.count,
                    })).collect::<Vec<_>>(),
                })
            })
            .collect();
        outln!("{}", json!({ "topics": rows }));
    } else if options.markdown {
        outln!("| topic | message | policy | rate | publisher | readers | what |\n|---|---|---|---|---|---|---|");
        for topic in &TOPICS {
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
        for topic in &TOPICS {
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
        outln!("\n{} topics; the log reads all of them.", TOPICS.len());
    }
    Ok(ExitCode::SUCCESS)
}
