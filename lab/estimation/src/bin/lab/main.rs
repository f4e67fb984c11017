//! `lab`: estimators over recorded data, and whether their covariances agree with their errors.
//!
//! ```sh
//! cd lab && cargo run --release -- estimate FILE…
//! cd lab && cargo run --release -- consistency --mission random --flights 500
//! ```

mod consistency;
mod estimate;
mod options;

use clap::{Parser, Subcommand};
use stampfly_host::command_line::terminal;
use std::process::ExitCode;

/// Exit code of a wrong command line, value or file; clap's own, too.
const UNUSABLE: u8 = 2;

/// Evaluates the estimators of the StampFly flight stack.
#[derive(Debug, Parser)]
#[command(
    name = "lab",
    version,
    after_help = "Exit code: 0 on success, 1 if the consistency is outside its bars or a flight failed, 2 if the command line, a value or a file is wrong."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
enum Command {
    /// Run an estimator over recorded sensor data and print its errors.
    Estimate(options::EstimateOptions),
    /// Fly many simulated flights and compare the estimator's errors and innovations with its covariance (NEES, NIS).
    Consistency(consistency::ConsistencyOptions),
}

fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Estimate(options) => estimate::run(&options),
        Command::Consistency(options) => consistency::run(&options),
    };
    result.unwrap_or_else(|failure| {
        terminal::print_error(&format!("lab: {failure}\n"));
        ExitCode::from(UNUSABLE)
    })
}
