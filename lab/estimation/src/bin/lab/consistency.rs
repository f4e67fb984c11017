//! `lab consistency`: errors and innovations of the StampFly's estimator over many simulated flights, against its covariance.

use clap::Args;
use serde_json::json;
use stampfly_board::simulation::StampFly;
use stampfly_host::campaign::{self, Flight};
use stampfly_host::command_line::{Failure, SceneOptions, terminal};
use stampfly_lab::consistency::{ABOVE, INSIDE, Line, Observation, Summary};
use stampfly_sim::vehicle::Vehicle;
use std::fmt::Write as _;
use std::process::ExitCode;

/// Options of `consistency`. Meant for `--mission random --flights 500`.
#[derive(Clone, Debug, Args)]
pub struct ConsistencyOptions {
    #[command(flatten)]
    scene: SceneOptions,
    /// Number of flights.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    flights: u64,
    /// Seed of the first flight; the others count up from there.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Flies them and prints the summary. Exit code 1 if a flight failed or a judged quantity is outside its bars.
pub fn run(options: &ConsistencyOptions) -> Result<ExitCode, Failure> {
    if options.scene.vehicle.name != StampFly::NAME {
        return Err(format!("only the estimator of {} is compared", StampFly::NAME).into());
    }
    let setups: Result<Vec<_>, Failure> = (0..options.flights).map(|index| setup(options, index)).collect();
    let bar = terminal::bar(options.flights, "flying {wide_bar:.cyan} {pos}/{len} flights, {eta} left");
    let observe = |seed: u64, setup: &<StampFly as Vehicle>::Setup| Observation::new(setup.vehicle.eskf, seed);
    let flights = campaign::run::<StampFly, Observation>(&setups?, &observe, &|_| bar.inc(1));
    bar.finish_and_clear();

    let failed: Vec<u64> = flights.iter().filter(|flight| !flight.succeeded()).map(|flight| flight.seed).collect();
    let seen: Vec<_> = flights.into_iter().map(|Flight { witness, .. }| witness.finish()).collect();
    let summary = Summary::of(&seen);
    if options.scene.json {
        let object = json!({ "flights": seen.len(), "failed_seeds": failed, "consistency": summary });
        terminal::print(&format!("{object}\n"));
    } else {
        terminal::print(&text(&summary, seen.len(), &failed));
    }
    Ok(if failed.is_empty() && summary.is_good() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Seed and setup of one flight. Each flight has its own delays, too.
fn setup(options: &ConsistencyOptions, index: u64) -> Result<(u64, <StampFly as Vehicle>::Setup), Failure> {
    let nth = |name: &str, first: u64| {
        first
            .checked_add(index)
            .ok_or_else(|| format!("{name} {first} leaves no seeds for {} flights", options.flights))
    };
    let seed = nth("--seed", options.seed)?;
    let jitter = options.scene.jitter.map(|first| nth("--jitter", first)).transpose()?;
    Ok((seed, options.scene.setup::<StampFly>(seed, jitter, None)?))
}

/// The summary as a table.
fn text(summary: &Summary, flights: usize, failed: &[u64]) -> String {
    let mut text = String::new();
    let head = ("error squared (NEES)", "dof", "mean", "95 % band", "inside", "above");
    let _ = writeln!(text, "{:<26} {:>3} {:>8}   {:^16} {:>10} {:>8}", head.0, head.1, head.2, head.3, head.4, head.5);
    summary.errors.iter().for_each(|line| text += &row(line));
    let _ = writeln!(text, "innovation squared (NIS)");
    summary.innovations.iter().for_each(|line| text += &row(line));
    let _ = writeln!(
        text,
        "\nmean: over flights; inside, above: share of flights at one random instant, at least {:.0} %, at most {:.0} %",
        INSIDE * 100.0,
        ABOVE * 100.0
    );
    let _ = writeln!(
        text,
        "{} resets after a lock-out, {} neither recovered nor reported, {} flights reported lost",
        summary.resets, summary.unresolved, summary.diverged
    );
    let _ = match summary.different {
        0 => writeln!(text, "a second estimator repeated the estimates bit for bit in every flight"),
        different => {
            writeln!(text, "a second estimator did NOT repeat the estimates of {different} flights bit for bit")
        }
    };
    let _ = writeln!(text, "{} of {flights} flights succeeded", flights - failed.len());
    if !failed.is_empty() {
        let _ = writeln!(text, "failed seeds: {failed:?}");
    }
    text
}

fn row(line: &Line) -> String {
    let [low, high] = line.band;
    let mark = if line.is_good() { "" } else { "  OUTSIDE" };
    let (name, freedom, mean) = (line.name, line.freedom, line.mean);
    let [inside, above] = [line.inside, line.above].map(|share| 100.0 * share);
    format!("{name:<26} {freedom:>3} {mean:>8.2}   {low:>6.3} to {high:>6.2} {inside:>8.1} % {above:>6.1} %{mark}\n")
}
