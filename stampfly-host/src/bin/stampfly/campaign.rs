//! `stampfly campaign`: many flights. Exit code 1 when one of them did not land disarmed, or when the estimator's
//! consistency was asked for and is outside its bars.

use crate::Failure;
use crate::arguments::CampaignOptions;
use crate::terminal;
use serde_json::{Map, json};
use stampfly_host::campaign::{run_recorded, spreads, workers};
use stampfly_lab::consistency::{ABOVE, INSIDE, Line, Summary};
use stampfly_host::recorder::Recorder;
use stampfly_host::simulate::FlightConfig;
use std::process::ExitCode;
use std::time::Instant;

pub fn run(options: &CampaignOptions) -> Result<ExitCode, Failure> {
    if options.scene.list {
        options.scene.print_list(options.seed)?;
        return Ok(ExitCode::SUCCESS);
    }
    let configs: Result<Vec<FlightConfig>, Failure> = (0..options.flights)
        .map(|index| {
            let nth = |name: &str, seed: u64| {
                seed.checked_add(index)
                    .ok_or_else(|| format!("{name} {seed} leaves no seeds for {} flights", options.flights))
            };
            let mut config = options.scene.config(nth("--seed", options.seed)?)?;
            // Every flight has its own delays, too.
            config.jitter = config.jitter.map(|seed| nth("--jitter", seed)).transpose()?;
            Ok(config)
        })
        .collect();
    let configs = configs?;
    let bar = terminal::bar(options.flights, "flying {wide_bar:.cyan} {pos}/{len} flights, {eta} left");
    let started = Instant::now();
    let recorder = |config: &FlightConfig| {
        let recorder = Recorder::hash_only();
        if options.consistency { recorder.with_consistency(config.simulation.seed) } else { recorder }
    };
    let flights = run_recorded(&configs, &recorder, &|_| bar.inc(1));
    bar.finish_and_clear();
    let wall = started.elapsed().as_secs_f64();
    let simulated: f64 = flights.iter().map(|flight| flight.outcome.duration.seconds_f64()).sum();
    let landed = flights.iter().filter(|flight| flight.succeeded()).count();
    let failed: Vec<u64> = flights.iter().filter(|flight| !flight.succeeded()).map(|flight| flight.seed).collect();
    let looked_at: Vec<_> = flights.iter().filter_map(|flight| flight.consistency.clone()).collect();
    let consistency = options.consistency.then(|| Summary::of(&looked_at));

    if options.scene.json {
        let mut object = Map::new();
        object.insert("flights".into(), json!(flights.len()));
        object.insert("landed".into(), json!(landed));
        object.insert("failed_seeds".into(), json!(failed));
        for (name, _, spread) in spreads(&flights) {
            object.insert(name.into(), json!(spread));
        }
        if let Some(summary) = &consistency {
            object.insert("consistency".into(), json!(summary));
        }
        object.insert("realtime_factor".into(), json!(simulated / wall));
        outln!("{}", serde_json::Value::Object(object));
    } else {
        outln!("{:<22} {:>9} {:>9} {:>9}", "", "median", "95 %", "worst");
        for (name, unit, spread) in spreads(&flights) {
            match spread {
                Some(s) => outln!("{name:<22} {:>9.3} {:>9.3} {:>9.3} {unit}", s.p50, s.p95, s.max),
                None => outln!("{name:<22} {:>9} {:>9} {:>9} {unit}", "–", "–", "–"),
            }
        }
        let (all, cores) = (flights.len(), workers(flights.len()));
        let plural = if cores == 1 { "" } else { "s" };
        let factor = simulated / wall;
        outln!("\n{landed} of {all} flights landed and disarmed; {factor:.0} × real time on {cores} core{plural}");
        if !failed.is_empty() {
            outln!("seeds that did not: {failed:?}");
        }
        if let Some(summary) = &consistency {
            print_consistency(summary);
        }
    }
    let consistent = consistency.as_ref().is_none_or(Summary::is_good);
    Ok(if failed.is_empty() && consistent { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn print_consistency(summary: &Summary) {
    let print = |line: &Line| {
        let [low, high] = line.band;
        let mark = if line.is_good() { "" } else { "  OUTSIDE" };
        let (name, freedom, mean) = (line.name, line.freedom, line.mean);
        let [inside, above] = [line.inside, line.above].map(|share| 100.0 * share);
        outln!("{name:<26} {freedom:>3} {mean:>8.2}   {low:>6.3} to {high:>6.2} {inside:>8.1} % {above:>6.1} %{mark}");
    };
    let head = ("error squared (NEES)", "dof", "mean", "95 % band", "inside", "above");
    outln!("\n{:<26} {:>3} {:>8}   {:^16} {:>10} {:>8}", head.0, head.1, head.2, head.3, head.4, head.5);
    summary.errors.iter().for_each(print);
    outln!("{:<26}", "innovation squared (NIS)");
    summary.innovations.iter().for_each(print);
    outln!(
        "\nmean: over flights; inside, above: share of flights at one random instant, at least {:.0} %, at most {:.0} %",
        INSIDE * 100.0,
        ABOVE * 100.0
    );
    outln!(
        "{} resets after a lock-out, {} neither recovered nor reported, {} flights reported lost",
        summary.resets,
        summary.unresolved,
        summary.diverged
    );
    match summary.different {
        0 => outln!("estimates repeated bit for bit by a second estimator in every flight"),
        different => outln!("{different} flights NOT repeated bit for bit by a second estimator"),
    }
}
