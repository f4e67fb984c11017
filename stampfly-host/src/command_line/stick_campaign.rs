//! `stampfly campaign --sticks`: stick files, each in every mode that makes sense; and
//! `stampfly campaign --envelope`: flights of sound vehicles. Exit code 1 when a flight did not end
//! well.

use crate::campaign::envelope::Envelope;
use crate::campaign::parallel;
use crate::campaign::rate::Rate;
use crate::campaign::sticks::{Cell, Flight, Sum, cells, files, fly_one, sums};
use crate::command_line::arguments::CampaignOptions;
use crate::command_line::failure::Failure;
use crate::command_line::terminal;
use serde_json::json;
use stampfly_sim::vehicle::Vehicle;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

/// Largest number of flights that ended badly whose reason is printed.
const MOST_TOLD: usize = 30;
/// The mode of a file that is flown as it is.
const AS_IT_IS: &str = "–";

pub fn run<V: Vehicle>(options: &CampaignOptions) -> Result<ExitCode, Failure> {
    let planned = if options.envelope { envelope::<V>(options)? } else { each_in_every_mode::<V>(options)? };
    let bar = terminal::bar(planned.len() as u64, "flying {wide_bar:.cyan} {pos}/{len} flights, {eta} left");
    let begun = Instant::now();
    let flights = parallel::each(planned.len(), parallel::workers(planned.len(), None), &|place| {
        let (cell, seed) = planned.get(place)?;
        let flight = fly_one::<V>(cell, *seed);
        bar.inc(1);
        Some(flight)
    });
    bar.finish_and_clear();
    let flights: Vec<Flight> = flights.into_iter().flatten().collect::<Result<_, _>>()?;
    let sums = sums(&flights);
    if options.scene.json {
        print_json(&flights, &sums);
    } else {
        print(&flights, &sums, begun.elapsed().as_secs_f64());
    }
    Ok(if flights.iter().all(|flight| flight.ended_well) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Cells with the seeds of their flights, those of a cell together.
type Planned = Vec<(Cell, u64)>;

/// Every file in every mode, with each of the seeds.
fn each_in_every_mode<V: Vehicle>(options: &CampaignOptions) -> Result<Planned, Failure> {
    let flown = options.scene.options(options.scene.jitter);
    let mut planned = Vec::new();
    for file in files(&options.sticks)? {
        let sticks = options.with_sticks.options(&file, options.scene.mode.clone());
        for cell in cells::<V>(&file, &sticks, &flown)? {
            planned.extend((0..options.flights).map(|nth| {
                let mut cell = cell.clone();
                // Every flight has its own delays, too.
                cell.options.jitter = cell.options.jitter.map(|seed| seed.wrapping_add(nth));
                (cell, options.seed.wrapping_add(nth))
            }));
        }
    }
    Ok(planned)
}

/// Flights of the envelope, those of a mission or a file in a mode together.
fn envelope<V: Vehicle>(options: &CampaignOptions) -> Result<Planned, Failure> {
    let files = if options.sticks.is_empty() { Vec::new() } else { files(&options.sticks)? };
    let sticks = files.iter().map(|file| options.with_sticks.options(file, None)).collect();
    let envelope = Envelope { seed: options.seed, sticks, options: options.scene.options(options.scene.jitter) };
    let flights = (0..options.flights).map(|index| envelope.flight::<V>(index));
    let mut planned = flights.collect::<Result<Planned, _>>()?;
    planned.sort_by(|(one, _), (other, _)| (&one.file, &one.mode).cmp(&(&other.file, &other.mode)));
    Ok(planned)
}

fn print_json(flights: &[Flight], sums: &[Sum]) {
    outln!(
        "{}",
        json!({
            "flights": flights.len(), "ended_well": flights.iter().filter(|flight| flight.ended_well).count(),
            "well": rate(flights), "unhindered": unhindered(flights),
            "while_sound": total(sums, |sum| &sum.while_sound), "cells": sums, "each": flights,
        })
    );
}

fn print(flights: &[Flight], sums: &[Sum], wall: f64) {
    let name = |file: &str| Path::new(file).file_name().map_or_else(String::new, |name| name.display().to_string());
    let widest = sums.iter().map(|sum| name(&sum.file).chars().count()).max().unwrap_or_default().max(4);
    outln!("{:<widest$} {:<10} {:>7} {:>5}  {:<34} by itself while sound", "file", "mode", "flights", "well", "ends");
    for sum in sums {
        let Sum { file, mode, flights, ended_well, outcomes, while_sound, .. } = sum;
        let mode = mode.as_deref().unwrap_or(AS_IT_IS);
        let (ends, sound) = (counts(outcomes), counts(while_sound));
        outln!("{:<widest$} {mode:<10} {flights:>7} {ended_well:>5}  {ends:<34} {sound}", name(file));
    }
    let (well, unhindered) = (rate(flights), unhindered(flights));
    outln!("\n{} of {} flights ended well, {well}", well.count, well.of);
    outln!("{} without anything done to a sound vehicle, {unhindered}", unhindered.count);
    for (who, total) in [
        ("sound vehicles", total(sums, |sum| &sum.while_sound)),
        ("vehicles that were not sound", total(sums, |sum| &sum.while_not_sound)),
    ] {
        let total = if total.is_empty() { "nothing".into() } else { counts(&total) };
        outln!("{who} did by themselves: {total}");
    }
    let failed: Vec<_> = flights.iter().filter(|flight| !flight.ended_well).collect();
    for flight in failed.iter().take(MOST_TOLD) {
        let broken = if flight.violations.is_empty() {
            String::new()
        } else {
            format!(", VIOLATED {}", flight.violations.join(" "))
        };
        outln!("  {}: {}{broken}\n    {}", flight.outcome, flight.reason, flight.line);
    }
    if failed.len() > MOST_TOLD {
        outln!("  and {} more; --json has all of them", failed.len() - MOST_TOLD);
    }
    let simulated: f64 = flights.iter().map(|flight| flight.duration_s).sum();
    outln!("\n{simulated:.0} s flown in {wall:.1} s");
}

/// How many ended well.
fn rate(flights: &[Flight]) -> Rate {
    Rate::of(flights.iter().filter(|flight| flight.ended_well).count(), flights.len())
}

/// In how many the vehicle did nothing by itself while it was sound.
fn unhindered(flights: &[Flight]) -> Rate {
    let is_unhindered = |flight: &&Flight| !flight.interventions.iter().any(|one| one.sound);
    Rate::of(flights.iter().filter(is_unhindered).count(), flights.len())
}

fn counts(counts: &BTreeMap<String, usize>) -> String {
    counts.iter().map(|(name, count)| format!("{name} {count}")).collect::<Vec<_>>().join(", ")
}

fn total(sums: &[Sum], of: fn(&Sum) -> &BTreeMap<String, usize>) -> BTreeMap<String, usize> {
    let mut total = BTreeMap::new();
    for (name, count) in sums.iter().flat_map(of) {
        *total.entry(name.clone()).or_default() += count;
    }
    total
}
