//! `stampfly faults`: what can go wrong in a flight.

use crate::command_line::arguments::TopicsOptions;
use crate::command_line::failure::Failure;
use crate::vehicles::{self, ForVehicle};
use serde_json::json;
use stampfly_sim::fault::{FaultKind, FaultValue};
use stampfly_sim::vehicle::Vehicle;
use std::process::ExitCode;

/// What stands before the table of sizes.
const SIZES: &str =
    "## Sizes\n\nThe random flights of a campaign draw the size of a fault evenly in its logarithm, from these:";

pub fn run(options: &TopicsOptions) -> Result<ExitCode, Failure> {
    vehicles::with(&options.vehicle.name, Faults(options))?
}

struct Faults<'o>(&'o TopicsOptions);

impl ForVehicle for Faults<'_> {
    type Output = Result<ExitCode, Failure>;

    fn run<V: Vehicle>(self) -> Self::Output {
        print(self.0, V::FAULTS);
        Ok(ExitCode::SUCCESS)
    }
}

fn print(options: &TopicsOptions, table: &[FaultKind]) {
    if options.json {
        let rows: Vec<_> = table
            .iter()
            .map(|kind| {
                let above = kind.above.map(|(value, expected)| json!({ "value": value, "expected": expected.name() }));
                json!({
                    "name": kind.name, "unit": kind.value.unit(), "default": kind.value.default(),
                    "range": kind.value.range(), "takes_value": kind.value.range().is_some(),
                    "expected": kind.expected.name(), "above": above, "meaning": kind.meaning,
                    "sizes": kind.sizes.map(|sizes| json!({ "range": sizes.range, "shown": sizes.to_string(), "reason": sizes.reason })),
                })
            })
            .collect();
        outln!("{}", json!({ "faults": rows }));
    } else if options.markdown {
        outln!("| fault | value | range | acceptable up to | what |\n|---|---|---|---|---|");
        for kind in table {
            let [value, range] = texts(kind);
            outln!("| `{}` | {value} | {range} | {} | {} |", kind.name, expected(kind), kind.meaning);
        }
        let sized: Vec<_> = table.iter().filter_map(|kind| Some((kind, kind.sizes?))).collect();
        if !sized.is_empty() {
            outln!("\n{SIZES}\n\n| fault | sizes | from what to what |\n|---|---|---|");
        }
        for (kind, sizes) in sized {
            outln!("| `{}` | {} | {} |", kind.name, format!("{sizes} {}", kind.value.unit()).trim_end(), sizes.reason);
        }
    } else {
        outln!("{:<15} {:<12} {:<26} meaning", "fault", "value", "acceptable up to");
        for kind in table {
            let [value, _] = texts(kind);
            outln!("{:<15} {value:<12} {:<26} {}", kind.name, expected(kind), kind.meaning);
        }
        outln!("\n{} faults; --fault NAME[=VALUE]@WHEN[+SECONDS] of `fly` and `campaign`.", table.len());
    }
}

/// The value when none is given, and the range.
fn texts(kind: &FaultKind) -> [String; 2] {
    let unit = kind.value.unit();
    let default = match kind.value {
        FaultValue::None => String::new(),
        FaultValue::Number { default, .. } => format!("{default} {unit}").trim_end().into(),
        FaultValue::OrLast { .. } => "the last".into(),
    };
    let range = kind.value.range().map(|[low, high]| format!("{low} to {high} {unit}").trim_end().to_owned());
    [default, range.unwrap_or_default()]
}

fn expected(kind: &FaultKind) -> String {
    match kind.above {
        Some((value, class)) => format!("{}; {class} above {value}", kind.expected),
        None => kind.expected.to_string(),
    }
}
