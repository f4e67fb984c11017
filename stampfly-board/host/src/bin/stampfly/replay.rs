//! `stampfly replay`: the flight again. Exit code 0 when it is the same, 1 when it differs or cannot be replayed.

use crate::Failure;
use crate::arguments::ReplayOptions;
use serde_json::json;
use stampfly_host::replay::replay;
use std::process::ExitCode;

pub fn run(options: &ReplayOptions) -> Result<ExitCode, Failure> {
    let path = options.file.display();
    let bytes = std::fs::read(&options.file).map_err(|error| format!("{path}: {error}"))?;
    let result = replay(&bytes).map_err(|error| format!("{path}: {error}"))?;
    if options.json {
        let difference = result.difference.as_ref().map(|difference| {
            json!({
                "activation": difference.activation, "now_us": difference.now.as_micros(), "topic": difference.topic,
                "generation": difference.generation, "field": difference.field,
                "recorded": difference.recorded, "replayed": difference.replayed,
            })
        });
        outln!(
            "{}",
            json!({
                "identical": result.difference.is_none(), "activations": result.activations,
                "samples": result.samples, "difference": difference,
            })
        );
    } else {
        match &result.difference {
            None => outln!(
                "{path}: identical: {} activations repeated, {} samples compared bit for bit",
                result.activations,
                result.samples
            ),
            Some(difference) => outln!("{path}: differs: {difference}"),
        }
    }
    Ok(if result.difference.is_none() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
