//! `stampfly golden`: the golden flight, played or recorded. Exit code 0 when every bit is as recorded.

use crate::Failure;
use crate::arguments::GoldenOptions;
use serde_json::json;
use stampfly_board::golden::{FLIGHT, Verdict, play};
use stampfly_host::golden::record;
use std::process::ExitCode;

pub fn run(options: &GoldenOptions) -> Result<ExitCode, Failure> {
    let recorded = options.record.as_ref().map(|_| record()).transpose()?;
    let flight = recorded.as_deref().unwrap_or(FLIGHT);
    let report = play(flight, &mut ())?;
    if let (Some(path), Some(bytes)) = (&options.record, &recorded) {
        std::fs::write(path, bytes).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    let (verdict, worst) = match report.verdict {
        Verdict::Identical => ("identical", 0.0),
        Verdict::WithinTolerance { worst } => ("within tolerance", worst),
        Verdict::Beyond { worst, .. } => ("beyond tolerance", worst),
    };
    let hash = format!("{:016x}", report.hash);
    if options.json {
        outln!(
            "{}",
            json!({
                "verdict": verdict, "worst_duty_deviation": worst, "hash": hash, "messages": report.messages,
                "duration_s": report.duration.seconds_f64(), "bytes": flight.len(),
            })
        );
    } else {
        outln!(
            "golden flight of {}, {} bytes, {} messages: hash {hash}",
            report.duration,
            flight.len(),
            report.messages
        );
        outln!("{verdict}; duties deviate by at most {worst}");
    }
    Ok(if report.verdict == Verdict::Identical { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
