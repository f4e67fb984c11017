//! `stampfly campaign --faults`: many flights in which something goes wrong. Exit code 1 when one of them failed.

use crate::campaign::case::{Case, Cases, Plan, shell_line};
use crate::campaign::flight::fly_case;
use crate::campaign::row::Row;
use crate::campaign::shard::Shard;
use crate::campaign::shrink::shrink;
use crate::campaign::summary::{Cell, Summary};
use crate::campaign::{file, page, parallel};
use crate::command_line::arguments::{CampaignOptions, Engine};
use crate::command_line::engine::{self, Job};
use crate::command_line::failure::Failure;
use crate::command_line::terminal;
use indicatif::ProgressBar;
use serde_json::{Value, json};
use stampfly_sim::vehicle::Vehicle;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::hash::{DefaultHasher, Hasher as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant as WallInstant;

/// Of so many kinds of failures the smallest form is looked for.
const MOST_SHRUNK: usize = 12;
/// For each of them so much is flown, s: two or three seconds of a core.
const MOST_FLOWN: f64 = 600.0;
/// So many kinds of failures are printed; all are in the page.
const MOST_PRINTED: usize = 40;

/// The campaign of one vehicle.
pub fn run<V: Vehicle>(options: &CampaignOptions) -> Result<ExitCode, Failure> {
    if V::FAULTS.is_empty() {
        return Err(format!("--faults: nothing can go wrong in a flight of {}", V::NAME).into());
    }
    let campaign = Campaign::new::<V>(options)?;
    match (options.of_faults.shard, options.of_faults.engine) {
        (Some(shard), _) => campaign.fly_one::<V>(shard),
        (None, Engine::Slurm) => campaign.write_slurm::<V>(),
        (None, engine) => campaign.fly_all::<V>(engine),
    }
}

struct Campaign<'o> {
    options: &'o CampaignOptions,
    plan: Plan,
    cases: Cases,
    out: PathBuf,
    program: String,
}

impl<'o> Campaign<'o> {
    fn new<V: Vehicle>(options: &'o CampaignOptions) -> Result<Self, Failure> {
        let CampaignOptions { scene, flights, seed, of_faults, .. } = options;
        let (pairs, drawn, only) = (of_faults.pairs, of_faults.drawn, of_faults.only.clone());
        let plan = Plan { seed: *seed, flights: *flights, pairs, drawn, only, options: scene.options(scene.jitter) };
        let cases = Cases::new::<V>(&plan)?;
        // What is wrong with the options is wrong with the first flight, and each of `--only` has its turn in the first.
        for index in 0..plan.only.len().max(1) as u64 {
            let case = cases.case(index);
            V::setup(&case.options, case.seed)?;
        }
        let out = &of_faults.out;
        let io = |error| format!("--out {}: {error}", out.display());
        std::fs::create_dir_all(out).map_err(io)?;
        // Tasks of an engine may run elsewhere. Not the canonical path: on Windows that begins with
        // `\\?\`, and few programs take it.
        let out = std::path::absolute(out).map_err(io)?;
        Ok(Self { plan, cases, out, program: program()?, options })
    }

    fn path(&self, shard: Shard) -> PathBuf {
        self.out.join(shard.file_name())
    }

    fn identity<V: Vehicle>(&self, shard: Shard) -> String {
        shard.identity(V::NAME, &self.plan, &self.program)
    }

    fn bar(&self, flights: usize) -> ProgressBar {
        terminal::bar(flights as u64, "flying {wide_bar:.cyan} {pos}/{len} flights, {eta} left")
    }

    /// The flights of a shard whose file is there. One that is damaged is no file.
    fn kept<V: Vehicle>(&self, shard: Shard) -> Result<Option<Vec<Row>>, Failure> {
        if self.options.of_faults.again {
            return Ok(None);
        }
        let path = self.path(shard);
        match file::read(&path) {
            Ok(contents) if contents.identity == self.identity::<V>(shard) => Ok(Some(contents.rows)),
            Ok(contents) => Err(other_campaign(&path, &contents.identity, &self.identity::<V>(shard)).into()),
            Err(error) if error.is_missing() => Ok(None),
            Err(error) => {
                errln!("stampfly: {error}; its flights are flown again");
                Ok(None)
            }
        }
    }

    fn fly_shard<V: Vehicle>(&self, shard: Shard, bar: &ProgressBar) -> Result<Vec<Row>, Failure> {
        let flights: Vec<u64> = shard.flights(self.plan.flights).collect();
        let threads = parallel::workers(flights.len(), self.options.of_faults.threads);
        let rows = parallel::each(flights.len(), threads, &|place| {
            let row = flights.get(place).map(|index| fly_case::<V>(&self.cases.case(*index)));
            bar.inc(1);
            row
        });
        let rows: Vec<Row> = rows.into_iter().flatten().collect::<Result<_, _>>()?;
        file::write(&self.path(shard), &self.identity::<V>(shard), &rows)?;
        Ok(rows)
    }

    /// A task of a cluster: flies a shard, and judges nothing.
    fn fly_one<V: Vehicle>(&self, shard: Shard) -> Result<ExitCode, Failure> {
        let kept = self.kept::<V>(shard)?;
        let (rows, word) = match kept {
            Some(rows) => (rows, "were there"),
            None => {
                let bar = self.bar(shard.flights(self.plan.flights).count());
                let rows = self.fly_shard::<V>(shard, &bar)?;
                bar.finish_and_clear();
                (rows, "flown")
            }
        };
        let failed = rows.iter().filter(|row| row.failed()).count();
        let path = self.path(shard);
        if self.options.scene.json {
            outln!("{}", json!({ "file": path, "flights": rows.len(), "failed": failed }));
        } else {
            outln!("shard {shard}: {} flights {word}, {failed} failed; {}", rows.len(), path.display());
        }
        Ok(ExitCode::SUCCESS)
    }

    /// Flies what is not there yet, and sums up.
    fn fly_all<V: Vehicle>(&self, engine: Engine) -> Result<ExitCode, Failure> {
        let begun = WallInstant::now();
        let count = self.options.of_faults.shards;
        let (mut rows, mut missing) = (Vec::new(), Vec::new());
        for shard in Shard::all(count) {
            match self.kept::<V>(shard)? {
                Some(kept) => rows.extend(kept),
                None => missing.push(shard),
            }
        }
        let kept = rows.len();
        let bar = self.bar(missing.iter().map(|shard| shard.flights(self.plan.flights).count()).sum());
        if engine == Engine::Hq && !missing.is_empty() {
            for shard in &missing {
                // Its appearance says that a shard is done.
                let _ = std::fs::remove_file(self.path(*shard));
            }
            let flights = |shard: Shard| shard.flights(self.plan.flights).count() as u64;
            engine::hq(&self.job::<V>(), &missing, &|done| {
                bar.set_position(done.iter().map(|shard| flights(*shard)).sum());
            })?;
            for shard in missing {
                let contents = file::read(&self.path(shard))?;
                rows.extend(contents.rows);
            }
        } else {
            for shard in missing {
                rows.extend(self.fly_shard::<V>(shard, &bar)?);
            }
        }
        bar.finish_and_clear();
        rows.sort_by_key(|row| row.index);
        let mut summary = Summary::of(&rows);
        let wall = begun.elapsed().as_secs_f64();
        let shrunk = self.shrink::<V>(&rows, &mut summary);
        let write = |name: &str, text: String| -> Result<PathBuf, Failure> {
            let path = self.out.join(name);
            std::fs::write(&path, text).map_err(|error| format!("{}: {error}", path.display()))?;
            Ok(path)
        };
        let table = write("campaign.csv", summary.csv(V::FAULTS))?;
        let title = format!("Campaign of faults, {}", V::NAME);
        let subtitle = format!("{}, version {}", self.sentence(), env!("CARGO_PKG_VERSION"));
        let page = write("campaign.html", page::html(&summary, V::FAULTS, &title, &subtitle))?;
        if self.options.scene.json {
            self.print_json(&summary, kept, wall);
        } else {
            self.print(&summary, kept, shrunk, wall);
            outln!("\ntables   {}, {}", page.display(), table.display());
            outln!("flights  {}", self.out.join("*.parquet").display());
        }
        Ok(if summary.all.failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    /// What was flown.
    fn sentence(&self) -> String {
        let Plan { seed, flights, pairs, .. } = self.plan;
        let pairs = if pairs { ", pairs of faults among them" } else { "" };
        let which = match self.cases.cells() {
            0 => "all drawn".to_owned(),
            cells => format!("{cells} cells of fault, moment and mode"),
        };
        format!("{flights} flights from seed {seed}, {which}{pairs}")
    }

    /// Looks for the smallest form of the most frequent failures. Returns how many it has looked at.
    fn shrink<V: Vehicle>(&self, rows: &[Row], summary: &mut Summary) -> usize {
        let count = summary.failures.len().min(MOST_SHRUNK);
        let bar = terminal::bar(count as u64, "shrinking {wide_bar:.cyan} {pos}/{len} failures, {eta} left");
        let failures = &summary.failures;
        let lines = parallel::each(count, parallel::workers(count, self.options.of_faults.threads), &|place| {
            let row = rows.get(failures.get(place)?.first)?;
            let case = row.case().ok()?;
            let mut flown = 0.0;
            let mut fails = |case: &Case| {
                let smaller = if flown < MOST_FLOWN { fly_case::<V>(case).ok() } else { None };
                flown += smaller.as_ref().map_or(0.0, |smaller| smaller.duration_s);
                smaller.is_some_and(|smaller| smaller.failed_like(row))
            };
            let line = shrink::<V>(&case, &mut fails).line();
            bar.inc(1);
            Some(line)
        });
        for (failure, line) in summary.failures.iter_mut().zip(lines) {
            failure.line = line.unwrap_or_else(|| failure.line.clone());
        }
        bar.finish_and_clear();
        count
    }

    fn print_json(&self, summary: &Summary, kept: usize, wall: f64) {
        let Summary { all, faulted, nominal, cuts, never_began, outcomes, violations, failures, duration_s, .. } =
            summary;
        let failures: Vec<_> = failures
            .iter()
            .map(|failure| {
                json!({
                    "fault": failure.fault, "phase": failure.phase, "verdict": failure.verdict,
                    "flights": failure.flights, "reason": failure.reason, "line": failure.line, "flown": failure.flown,
                })
            })
            .collect();
        let part = |cell: &Cell| {
            let mut part = serde_json::Map::new();
            part.insert("flights".into(), json!(cell.flights));
            part.insert("idle".into(), json!(cell.idle));
            part.extend(cell.rates().map(|(name, rate)| (name.replace(' ', "_"), json!(rate))));
            part.insert("needless_cuts".into(), json!(cell.needless_cuts()));
            Value::Object(part)
        };
        let cuts: BTreeMap<_, _> = cuts.iter().map(|(name, cell)| (name, json!(cell.needless_cuts()))).collect();
        outln!(
            "{}",
            json!({
                "flights": all.flights, "passed": all.passed(), "idle": all.idle,
                "failed": all.failed, "wrong_class": all.wrong, "violated": all.violated, "violations": violations,
                "right_cuts": all.cuts - all.needless, "needless_cuts": all.needless, "cuts": cuts,
                "faulted": part(faulted), "nominal": part(nominal), "never_began": never_began,
                "needless_by_fault": summary.needless_by_fault(),
                "outcomes": outcomes, "cells": self.cases.cells(), "cells_flown": summary.cells.len(),
                "kept": kept, "failures": failures, "simulated_s": duration_s, "wall_s": wall, "out": self.out,
            })
        );
    }

    fn print(&self, summary: &Summary, kept: usize, shrunk: usize, wall: f64) {
        let Summary { all, failures, duration_s, .. } = summary;
        outln!("{}", self.sentence());
        print_rates(summary);
        if all.failed > 0 {
            outln!("\n{:<16} {:<11} {:<22} {:>7}  repeat it", "fault", "moment", "verdict", "flights");
            for failure in failures.iter().take(MOST_PRINTED) {
                let (fault, phase, verdict) = (&failure.fault, &failure.phase, &failure.verdict);
                outln!("{fault:<16} {phase:<11} {verdict:<22} {:>7}  {}", failure.flights, failure.line);
            }
            if failures.len() > MOST_PRINTED {
                outln!("and {} more kinds of failures; the page has all of them", failures.len() - MOST_PRINTED);
            }
            if failures.len() > shrunk {
                outln!("the first {shrunk} in their smallest form, the others as they were flown");
            }
        }
        let flown = all.flights - kept;
        if kept > 0 {
            outln!("\n{kept} flights were there already (--again flies them again)");
        }
        if flown > 0 && kept == 0 {
            outln!("\n{:.1} s, {:.1} flights/s, {:.0} × real time", wall, flown as f64 / wall, duration_s / wall);
        }
    }

    /// What an engine's tasks run, but for the shard.
    fn job<V: Vehicle>(&self) -> Job {
        let Plan { seed, flights, pairs, drawn, only, options } = &self.plan;
        let common = Case { vehicle: V::NAME.to_owned(), index: 0, seed: *seed, options: options.clone() };
        let mut arguments = vec!["campaign".to_owned(), "--faults".into()];
        // After the name of the command.
        arguments.extend(common.arguments().into_iter().skip(1));
        arguments.extend(["--flights".into(), flights.to_string()]);
        arguments.extend(pairs.then(|| "--pairs".into()));
        arguments.extend(drawn.then(|| "--drawn".into()));
        if !only.is_empty() {
            arguments.extend(["--only".into(), only.join(",")]);
        }
        arguments.extend(["--out".into(), self.out.display().to_string()]);
        arguments.extend(self.options.of_faults.again.then(|| "--again".into()));
        Job { arguments, out: self.out.clone() }
    }

    /// Writes the script of a Slurm array, and says what to do with it.
    fn write_slurm<V: Vehicle>(&self) -> Result<ExitCode, Failure> {
        let job = self.job::<V>();
        let count = self.options.of_faults.shards;
        let path = self.out.join("campaign.sbatch");
        std::fs::write(&path, engine::slurm_script(&job, count)?)
            .map_err(|error| format!("{}: {error}", path.display()))?;
        let path = path.display().to_string();
        let sum_up = shell_line(&job.with(&["--shards", &count.to_string()])?);
        if self.options.scene.json {
            outln!("{}", json!({ "script": path, "submit": ["sbatch", path], "sum_up": sum_up }));
        } else {
            let mut text = String::new();
            let _ = writeln!(text, "written  {path}\nsubmit   sbatch {path}\nsum up   {sum_up}");
            if count > engine::SLURM_ARRAY {
                let _ = writeln!(
                    text,
                    "\nAn array of {count} tasks needs MaxArraySize above {count} in slurm.conf; {} are usual.",
                    engine::SLURM_ARRAY
                );
            }
            terminal::print(&text);
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// What came of the flights, and how often.
fn print_rates(summary: &Summary) {
    let Summary { all, faulted, nominal, cuts, never_began, outcomes, violations, .. } = summary;
    let counts = |counts: &BTreeMap<String, usize>| {
        counts.iter().map(|(name, count)| format!("{name} {count}")).collect::<Vec<_>>().join(", ")
    };
    for (name, cell) in [("with a fault", faulted), ("without a fault", nominal)] {
        if cell.flights == 0 {
            continue;
        }
        let idle = if cell.idle > 0 { format!(", in {} the fault changed nothing", cell.idle) } else { String::new() };
        outln!("\n{} {name}: {} passed, {} failed{idle}", cell.flights, cell.passed(), cell.failed);
        cell.rates().iter().for_each(|(what, rate)| outln!("  {what:<20} {:>6}  {rate}", rate.count));
    }
    outln!("\nends: {}", counts(outcomes));
    if !violations.is_empty() {
        outln!("invariants violated: {}", counts(violations));
    }
    if !never_began.is_empty() {
        outln!("moments that NEVER CAME, with how many flights waited for them: {}", counts(never_began));
    }
    if all.cuts > 0 {
        let right = all.cuts - all.needless;
        outln!("\nmotors stopped in the air in {} flights: {right} rightly, {} needlessly", all.cuts, all.needless);
        for (name, cell) in cuts {
            outln!("  {name:<20} {:>6}  needless {:>4}  {}", cell.cuts, cell.needless, cell.needless_cuts());
        }
    }
}

/// Why a file cannot be kept.
fn other_campaign(path: &Path, found: &str, wanted: &str) -> String {
    let parsed = |text: &str| serde_json::from_str(text).unwrap_or(Value::Null);
    let (found, wanted) = (parsed(found), parsed(wanted));
    let different = |name: &&str| found[*name] != wanted[*name];
    let what = ["vehicle", "plan", "shard", "shards", "version", "program"].into_iter().find(different);
    let what = match what {
        Some("program" | "version") | None => "was flown by another build of this program".to_owned(),
        Some(name) => format!("is of another campaign: {name} {}, not {}", found[name], wanted[name]),
    };
    format!("{} {what}; take another --out, or fly again with --again", path.display())
}

/// Hash over this program: flights of another build are not this campaign's. The standard library's hash is fast in a
/// debug build, too, whose program is large and is read by every task. It may change with the compiler, and then the
/// build is another one anyway.
fn program() -> Result<String, Failure> {
    let bytes = std::env::current_exe().and_then(std::fs::read).map_err(|error| format!("this program: {error}"))?;
    let mut hash = DefaultHasher::new();
    hash.write(&bytes);
    Ok(format!("{:016x}", hash.finish()))
}
