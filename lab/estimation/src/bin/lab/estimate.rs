//! `lab estimate`: an estimator over recorded data. Exit code 2 if a file could not be read.

use crate::UNUSABLE;
use crate::options::EstimateOptions;
use serde::Serialize;
use stampfly_host::Report;
use stampfly_host::command_line::{Failure, terminal};
use stampfly_host::report::Metric;
use stampfly_lab::Recording;
use stampfly_lab::dataset::{self, Kind};
use stampfly_lab::estimate::{self, Estimated, Figures};
use std::path::Path;
use std::process::ExitCode;

/// What is printed for one file.
#[derive(Serialize)]
struct Row {
    file: String,
    #[serde(flatten)]
    figures: Figures,
}

pub fn run(options: &EstimateOptions) -> Result<ExitCode, Failure> {
    // A wrong option is an error for every file: report it once, before any work.
    options.suite(Kind::StampFlyLog)?;
    if let Some(folder) = &options.out {
        std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    let bar = terminal::bar(options.files.len() as u64, "{wide_bar:.cyan} {pos}/{len} recordings");
    let mut rows = Vec::new();
    let mut failed = false;
    for file in &options.files {
        match one(file, options) {
            Ok(figures) => rows.push(Row { file: file.display().to_string(), figures }),
            Err(failure) => {
                failed = true;
                bar.suspend(|| terminal::print_error(&format!("lab: {failure}\n")));
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if options.json {
        terminal::print(&format!("{}\n", serde_json::json!({ "files": rows })));
    } else if !rows.is_empty() {
        terminal::print(&format!("{}\n", table(&rows)));
    }
    Ok(if failed { ExitCode::from(UNUSABLE) } else { ExitCode::SUCCESS })
}

fn one(file: &Path, options: &EstimateOptions) -> Result<Figures, Failure> {
    let recording = dataset::load(file)?;
    let estimated = estimate::run(&recording, &options.suite(recording.kind)?);
    if let Some(folder) = &options.out {
        let page = folder.join(format!("estimate_{}.html", recording.name));
        let flight = estimated.to_flight(&recording);
        let report = Report {
            title: recording.name.clone(),
            subtitle: format!("estimate over a recording: {}", recording.kind),
            metrics: metrics(&recording, &estimated),
            page: &stampfly_board::simulation::PAGE,
            flight: &flight,
        };
        report.write(&page).map_err(|error| format!("{}: {error}", page.display()))?;
    }
    Ok(estimated.figures)
}

/// A figure, if there is one.
type Value = fn(&Figures) -> Option<f64>;

/// Name, unit, decimals and value of every figure that may be missing.
const COLUMNS: [(&str, &str, usize, Value); 11] = [
    ("end", "m", 4, |f| f.end_xy_m),
    ("max", "m", 3, |f| f.max_xy_m),
    ("flow end", "m", 3, |f| f.flow_dead_reckoning_end_xy_m),
    ("flow max", "m", 3, |f| f.flow_dead_reckoning_max_xy_m),
    ("position", "m", 3, |f| f.position_rmse_m),
    ("tilt", "deg", 2, |f| f.tilt_rmse_deg),
    ("aligned", "deg", 2, |f| f.tilt_rmse_aligned_deg),
    ("heading", "deg", 2, |f| f.heading_rmse_deg),
    ("total", "deg", 2, |f| f.total_rmse_deg),
    ("gnss pos", "m", 3, |f| f.receiver.as_ref()?.position_m),
    ("gnss vel", "m/s", 3, |f| f.receiver.as_ref()?.velocity_mps),
];

/// A line a file.
fn table(rows: &[Row]) -> String {
    let name = |row: &Row| Path::new(&row.file).file_name().unwrap_or_default().to_string_lossy().into_owned();
    let width = rows.iter().map(|row| name(row).len()).max().unwrap_or(0).max(4);
    let mut text = format!("{:<width$} {:<15} {:>7}", "file", "kind", "s");
    COLUMNS.iter().for_each(|(column, ..)| text += &format!(" {column:>9}"));
    text += &format!(" {:>9}  rejected\n", "updates/s");
    for row in rows {
        let figures = &row.figures;
        text += &format!("{:<width$} {:<15} {:>7.1}", name(row), figures.kind, figures.duration_s);
        for (_, _, decimals, value) in COLUMNS {
            match value(figures) {
                Some(value) => text += &format!(" {value:>9.decimals$}"),
                None => text += &format!(" {:>9}", "–"),
            }
        }
        text += &format!(" {:>8.2}M ", figures.updates_per_s / 1e6);
        for (sensor, share) in &figures.rejected {
            text += &format!(" {sensor} {:.1} %", share * 100.0);
        }
        if figures.truth_gaps > 0 {
            text += &format!("  {} gaps in the reference", figures.truth_gaps);
        }
        text += if figures.diverged { "  DIVERGED\n" } else { "\n" };
    }
    text += "\nend, max: horizontal distance from the start; flow: the same by flow alone; RMS errors against the reference; \
             gnss: RMS difference to a satellite receiver";
    for row in rows.iter().filter(|row| row.figures.clock_back > 0) {
        text += &format!(
            "\n{}: the clock goes back: {} inertial samples were left out, and the figures are of the others",
            name(row),
            row.figures.clock_back
        );
    }
    text
}

/// The summary of the page.
fn metrics(recording: &Recording, estimated: &Estimated) -> Vec<Metric> {
    let figures = &estimated.figures;
    let mut metrics = vec![
        Metric::new("Recording", recording.kind, ""),
        Metric::new("Duration", format!("{:.1}", figures.duration_s), "s"),
        Metric::new("Diverged", if figures.diverged { "yes" } else { "no" }, "").judged(!figures.diverged),
    ];
    for (name, unit, decimals, value) in COLUMNS {
        if let Some(value) = value(figures) {
            metrics.push(Metric::new(name, format!("{value:.decimals$}"), unit));
        }
    }
    if figures.clock_back > 0 {
        let metric = Metric::new("Left out, clock goes back", figures.clock_back.to_string(), "samples");
        metrics.push(metric.judged(false));
    }
    for (sensor, share) in &figures.rejected {
        metrics.push(Metric::new(format!("Rejected, {sensor}"), format!("{:.1}", share * 100.0), "%"));
    }
    metrics
}
