//! `stampfly campaign`: many flights. Exit code 1 when one of them did not end as it should.

use crate::campaign::parallel::workers;
use crate::campaign::rate::Rate;
use crate::campaign::{self, Flight, spreads};
use crate::command_line::arguments::CampaignOptions;
use crate::command_line::failure::Failure;
use crate::command_line::fault_campaign;
use crate::command_line::fly::add_findings;
use crate::command_line::stick_campaign;
use crate::command_line::terminal;
use crate::vehicles::{self, ForVehicle};
use serde_json::{Map, Value, json};
use stampfly_sim::vehicle::{Vehicle, Verdict};
use std::collections::BTreeMap;
use std::process::ExitCode;
use std::time::Instant;

/// Largest number of failed flights whose reason is printed.
const MOST_TOLD: usize = 20;

pub fn run(options: &CampaignOptions) -> Result<ExitCode, Failure> {
    vehicles::with(&options.scene.vehicle.name, Campaign(options))?
}

struct Campaign<'o>(&'o CampaignOptions);

impl ForVehicle for Campaign<'_> {
    type Output = Result<ExitCode, Failure>;

    fn run<V: Vehicle>(self) -> Self::Output {
        let options = self.0;
        if options.scene.list {
            options.scene.print_list::<V>(options.seed)?;
            return Ok(ExitCode::SUCCESS);
        }
        if options.envelope || !options.sticks.is_empty() {
            return stick_campaign::run::<V>(options);
        }
        if options.faults {
            return fault_campaign::run::<V>(options);
        }
        let (flights, factor) = fly_all::<V>(options)?;
        print(options, &flights, factor);
        Ok(if flights.iter().all(Flight::succeeded) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

/// Flies all of them, each with a seed of its own. Also returns simulated over wall time.
fn fly_all<V: Vehicle>(options: &CampaignOptions) -> Result<(Vec<Flight<V, ()>>, f64), Failure> {
    let setups: Result<Vec<_>, Failure> = (0..options.flights)
        .map(|index| {
            let nth = |name: &str, seed: u64| {
                seed.checked_add(index)
                    .ok_or_else(|| format!("{name} {seed} leaves no seeds for {} flights", options.flights))
            };
            let seed = nth("--seed", options.seed)?;
            // Every flight has its own delays, too.
            let jitter = options.scene.jitter.map(|seed| nth("--jitter", seed)).transpose()?;
            Ok((seed, options.scene.setup::<V>(seed, jitter, None)?))
        })
        .collect();
    let bar = terminal::bar(options.flights, "flying {wide_bar:.cyan} {pos}/{len} flights, {eta} left");
    let begun = Instant::now();
    let flights = campaign::run::<V, ()>(&setups?, &|_, _| (), &|_| bar.inc(1));
    bar.finish_and_clear();
    let simulated: f64 = flights.iter().map(|flight| flight.flown.duration.seconds_f64()).sum();
    Ok((flights, simulated / begun.elapsed().as_secs_f64()))
}

fn print<V: Vehicle>(options: &CampaignOptions, flights: &[Flight<V, ()>], factor: f64) {
    let failed: Vec<u64> = flights.iter().filter(|flight| !flight.succeeded()).map(|flight| flight.seed).collect();
    let (all, succeeded) = (flights.len(), flights.len() - failed.len());
    if options.scene.json {
        let mut object = Map::new();
        object.insert("flights".into(), json!(all));
        object.insert("succeeded".into(), json!(succeeded));
        object.insert("success".into(), json!(Rate::of(succeeded, all)));
        // Such as `landed`: in how many flights it held.
        for (fact, held) in facts(flights) {
            object.insert(fact.into(), json!(held));
        }
        object.insert("failed_seeds".into(), json!(failed));
        for (name, _, spread) in spreads(flights) {
            object.insert(name.into(), json!(spread));
        }
        object.insert("each".into(), flights.iter().map(each).collect());
        object.insert("realtime_factor".into(), json!(factor));
        outln!("{}", Value::Object(object));
        return;
    }
    outln!("{:<22} {:>9} {:>9} {:>9}", "", "median", "95 %", "worst");
    for (name, unit, spread) in spreads(flights) {
        match spread {
            Some(s) => outln!("{name:<22} {:>9.3} {:>9.3} {:>9.3} {unit}", s.p50, s.p95, s.max),
            None => outln!("{name:<22} {:>9} {:>9} {:>9} {unit}", "–", "–", "–"),
        }
    }
    let cores = workers(all, None);
    let plural = if cores == 1 { "" } else { "s" };
    let rate = Rate::of(succeeded, all);
    outln!("\n{succeeded} of {all} flights succeeded, {rate}; {factor:.0} × real time on {cores} core{plural}");
    let failures = || flights.iter().filter(|flight| !flight.succeeded());
    for flight in failures().take(MOST_TOLD) {
        outln!("  seed {:<12} {}", flight.seed, flight.flown.outcome.sentence());
    }
    if failed.len() > MOST_TOLD {
        outln!("  and {} more; --json has all of them", failed.len() - MOST_TOLD);
    }
}

/// One flight, for scripts.
fn each<V: Vehicle>(flight: &Flight<V, ()>) -> Value {
    let mut object = Map::new();
    object.insert("seed".into(), json!(flight.seed));
    object.insert("succeeded".into(), json!(flight.succeeded()));
    add_findings(&mut object, &flight.flown.outcome);
    Value::Object(object)
}

/// How many flights each of the vehicle's yes-or-no results held in.
fn facts<V: Vehicle>(flights: &[Flight<V, ()>]) -> BTreeMap<&'static str, usize> {
    let mut counts = BTreeMap::new();
    for (fact, holds) in flights.iter().flat_map(|flight| flight.flown.outcome.facts()) {
        *counts.entry(fact).or_default() += usize::from(holds);
    }
    counts
}
