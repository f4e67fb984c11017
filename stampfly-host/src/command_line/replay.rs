//! `stampfly replay`: the flight again. Exit code 0 when it is the same as far as the log is whole,
//! which is said, 1 when it differs or cannot be replayed.

use crate::command_line::arguments::ReplayOptions;
use crate::command_line::failure::Failure;
use crate::command_line::log::told;
use crate::log::record;
use crate::vehicles::{self, ForVehicle};
use serde_json::json;
use stampfly_flight::compact::Samples;
use stampfly_flight::{Replay, replay};
use stampfly_sim::vehicle::Vehicle;
use stampfly_types::Instant;
use std::process::ExitCode;

pub fn run(options: &ReplayOptions) -> Result<ExitCode, Failure> {
    let path = options.file.display();
    let mut bytes = std::fs::read(&options.file).map_err(|error| format!("{path}: {error}"))?;
    let mut from = options.from.map(|seconds| Instant::from_micros((seconds.max(0.0) * 1e6) as u64));
    let contents = if record::is_record(&bytes) {
        let again = record::run_again(&bytes, options.vehicle.as_deref(), Samples::Recorded);
        let (log, contents) = again.map_err(|error| format!("{path}: {error}"))?;
        // It begins with a key frame, not at power-on.
        (bytes, from) = (log, from.or(Some(Instant::ZERO)));
        Some(contents)
    } else {
        None
    };
    if let Some(since) = contents.as_ref().and_then(|contents| contents.idle_since) {
        return Err(
            format!("{path}: another program's record: nothing is due here at {since}, when something ran").into()
        );
    }
    let named = options.vehicle.as_deref().or_else(|| replay::vehicle_name(&bytes)).unwrap_or(vehicles::DEFAULT);
    let task = Again { bytes: &bytes, options: replay::ReplayOptions { from, is_thinned: contents.is_some() } };
    let result = vehicles::with(named, task)?.map_err(|error| format!("{path}: {error}"))?;
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
                "vehicle": named, "identical": result.difference.is_none(), "activations": result.activations,
                "samples": result.samples, "key_frames": result.key_frames, "gaps": result.gaps,
                "skipped": result.skipped, "whole": result.end.is_whole(), "end": result.end.to_string(),
                "difference": difference,
            })
        );
    } else {
        match &result.difference {
            None => outln!(
                "{path}: identical: {} activations repeated, {} samples and {} key frames compared bit for bit",
                result.activations,
                result.samples,
                result.key_frames
            ),
            Some(difference) => outln!("{path}: differs: {difference}"),
        }
        if let Some(contents) = contents {
            outln!("a compact record: {}", told(&contents));
        }
        if result.skipped > 0 {
            outln!("{} activations were not repeated: before the start, or in {} gaps", result.skipped, result.gaps);
        }
        if !result.end.is_whole() {
            outln!("the log is {}", result.end);
        }
    }
    Ok(if result.difference.is_none() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

struct Again<'b> {
    bytes: &'b [u8],
    options: replay::ReplayOptions,
}

impl ForVehicle for Again<'_> {
    type Output = Result<Replay, replay::ReplayError>;

    fn run<V: Vehicle>(self) -> Self::Output {
        let set = |config: &mut _, name: &str, value| V::set_parameter(config, name, value).is_ok();
        replay::replay::<V::Runnables>(self.bytes, V::default_config(), set, self.options)
    }
}
