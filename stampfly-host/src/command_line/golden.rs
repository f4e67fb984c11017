//! `stampfly golden`: the golden flight, played or recorded. Exit code 0 when every bit is as recorded.

use crate::command_line::arguments::GoldenOptions;
use crate::command_line::failure::Failure;
use crate::golden::record;
use crate::vehicles::{self, ForVehicle};
use serde_json::json;
use stampfly_bus::TopicTable;
use stampfly_flight::golden::{Verdict, play};
use stampfly_sim::vehicle::Vehicle;
use std::process::ExitCode;

pub fn run(options: &GoldenOptions) -> Result<ExitCode, Failure> {
    vehicles::with(&options.vehicle.name, Golden(options))?
}

struct Golden<'o>(&'o GoldenOptions);

impl ForVehicle for Golden<'_> {
    type Output = Result<ExitCode, Failure>;

    fn run<V: Vehicle>(self) -> Self::Output {
        let options = self.0;
        let golden = V::golden().ok_or_else(|| format!("{} has no golden flight", V::NAME))?;
        let recorded = options.record.as_ref().map(|_| record::<V>(&golden)).transpose()?;
        let flight = recorded.as_deref().unwrap_or(golden.record);
        let report =
            play::<V::Runnables>(&mut TopicTable::new(), flight, &V::default_config(), golden.tolerance, &mut ())?;
        if let (Some(path), Some(bytes)) = (&options.record, &recorded) {
            std::fs::write(path, bytes).map_err(|error| format!("{}: {error}", path.display()))?;
        }
        let (verdict, worst) = match report.verdict {
            Verdict::Identical => ("identical", 0.0),
            Verdict::WithinTolerance { worst } => ("within tolerance", worst),
            Verdict::Beyond { worst, .. } => ("beyond tolerance", worst),
        };
        let hash = format!("{:016x}", report.hash);
        let (duration, bytes, messages) = (report.duration, flight.len(), report.messages);
        if options.json {
            let seconds = duration.seconds_f64();
            outln!(
                "{}",
                json!({
                    "verdict": verdict, "worst_duty_deviation": worst, "hash": hash, "messages": messages,
                    "duration_s": seconds, "bytes": bytes,
                })
            );
        } else {
            outln!("golden flight of {duration}, {bytes} bytes, {messages} messages: hash {hash}");
            outln!("{verdict}; the output deviates by at most {worst}");
        }
        Ok(if report.verdict == Verdict::Identical { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}
