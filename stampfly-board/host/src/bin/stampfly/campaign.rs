//! `stampfly campaign`: many flights. Exit code 1 when one of them did not land disarmed.

use crate::Failure;
use crate::arguments::CampaignOptions;
use crate::terminal;
use serde_json::{Map, json};
use stampfly_host::campaign::{run as fly_all, spreads};
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
    let flights = fly_all(&configs, &|_| bar.inc(1));
    bar.finish_and_clear();
    let wall = started.elapsed().as_secs_f64();
    let simulated: f64 = flights.iter().map(|flight| flight.outcome.duration.seconds_f64()).sum();
    let landed = flights.iter().filter(|flight| flight.succeeded()).count();
    let failed: Vec<u64> = flights.iter().filter(|flight| !flight.succeeded()).map(|flight| flight.seed).collect();

    if options.scene.json {
        let mut object = Map::new();
        object.insert("flights".into(), json!(flights.len()));
        object.insert("landed".into(), json!(landed));
        object.insert("failed_seeds".into(), json!(failed));
        for (name, _, spread) in spreads(&flights) {
            object.insert(name.into(), json!(spread));
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
        outln!("\n{landed} of {} flights landed and disarmed; {:.0} × real time", flights.len(), simulated / wall);
        if !failed.is_empty() {
            outln!("seeds that did not: {failed:?}");
        }
    }
    Ok(if failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
