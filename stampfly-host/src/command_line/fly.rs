//! `stampfly fly`: one flight, its log and its report, and one screen about it.

use crate::campaign;
use crate::campaign::row::Row;
use crate::command_line::arguments::FlyOptions;
use crate::command_line::failure::Failure;
use crate::command_line::terminal;
use crate::flight_log;
use crate::flown::{Flown, fly};
use crate::log::refly;
use crate::recorder::{Recorder, Timing};
use crate::report::{Metric, Report};
use crate::vehicles::{self, ForVehicle};
use serde_json::{Map, Value, json};
use stampfly_bus::Schedule;
use stampfly_sim::vehicle::{Options, Vehicle, Verdict};
use std::path::Path;
use std::process::ExitCode;

/// What is written.
const LOG: &str = "flight.ulg";
const PAGE: &str = "flight.html";

pub fn run(options: &FlyOptions) -> Result<ExitCode, Failure> {
    if let Some((file, row)) = options.from.as_ref().zip(options.row) {
        return again(options, file, row);
    }
    vehicles::with(&options.scene.vehicle.name, Fly(options))?
}

/// A flight of a campaign, from its row.
fn again(options: &FlyOptions, file: &Path, row: usize) -> Result<ExitCode, Failure> {
    let contents = campaign::file::read(file)?;
    let rows = contents.rows.len();
    let row = contents.rows.into_iter().nth(row);
    let row = row.ok_or_else(|| format!("{} has rows 0 to {}", file.display(), rows.saturating_sub(1)))?;
    let vehicle = row.vehicle.clone();
    vehicles::with(&vehicle, Again(options, row))?
}

struct Again<'o>(&'o FlyOptions, Row);

impl ForVehicle for Again<'_> {
    type Output = Result<ExitCode, Failure>;

    fn run<V: Vehicle>(self) -> Self::Output {
        let Self(options, row) = self;
        let case = row.case()?;
        let setup = V::setup(&case.options, case.seed)?;
        let (flown, recorder) = fly_and_write::<V>(options, &case.options, case.seed, &setup, here::<V>)?;
        let again = campaign::flight::finished(Row::of(&case), &flown, recorder.hash());
        let again = campaign::flight::with_cut_judged::<V>(again, &case);
        let digest = campaign::flight::digest::<V>(&setup);
        let same = again.log_hash == row.log_hash;
        if options.scene.json {
            let mut object = figures(&flown, recorder.hash());
            object.insert("verdict".into(), json!(again.verdict));
            object.insert("flown_on".into(), json!(again.flown_on));
            object.insert("recorded_hash".into(), json!(row.log_hash));
            object.insert("same".into(), json!(same));
            object.insert("line".into(), json!(case.line()));
            outln!("{}", Value::Object(object));
        } else {
            outln!("{}\n", case.line());
            flown.outcome.story().iter().for_each(|line| outln!("  {line}"));
            if let Some(end) = &again.flown_on {
                outln!("\nflown on where the motors were stopped in the air, by --fly-on, it ends as {end}");
            }
            outln!("\nverdict  {}, recorded {}", again.verdict, row.verdict);
            outln!("hash     {}, recorded {}", again.log_hash, row.log_hash);
            if !same {
                let version = env!("CARGO_PKG_VERSION");
                let why = if row.version != version {
                    format!("it was flown by version {}, this is {version}", row.version)
                } else if row.parameter_digest != digest {
                    "its parameters were others".into()
                } else {
                    "the flight stack or the simulator is another".into()
                };
                outln!("\nNOT the same flight: {why}");
            }
            let [log, page] = [LOG, PAGE].map(|name| options.out.join(name));
            outln!("log      {}\nreport   {}", log.display(), page.display());
        }
        Ok(if same { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

struct Fly<'o>(&'o FlyOptions);

impl ForVehicle for Fly<'_> {
    type Output = Result<ExitCode, Failure>;

    fn run<V: Vehicle>(self) -> Self::Output {
        let Self(options) = self;
        if options.scene.list {
            options.scene.print_list::<V>(options.seed)?;
            return Ok(ExitCode::SUCCESS);
        }
        let typed = options.options();
        let setup = V::setup(&typed, options.seed)?;
        let (flown, recorder) = fly_and_write::<V>(options, &typed, options.seed, &setup, here::<V>)?;
        if options.scene.json {
            outln!("{}", Value::Object(figures(&flown, recorder.hash())));
        } else {
            print_screen::<V>(&flown, &recorder, &options.out);
        }
        Ok(if flown.outcome.succeeded() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

/// What is told of progress.
pub(crate) type Progress<'p> = &'p mut dyn FnMut(f32, &'static str);

/// Flies it in this process.
fn here<V: Vehicle>(
    setup: &V::Setup,
    recorder: Recorder<V>,
    report: Progress<'_>,
) -> Result<(Flown<V::Outcome>, Recorder<V>), Failure> {
    let mut recorder = recorder.with_timing();
    Ok((fly::<V>(setup, &mut recorder, report), recorder))
}

/// Flies it, and writes log, report and whatever else belongs to the flight.
pub(crate) fn fly_and_write<V: Vehicle>(
    options: &FlyOptions,
    flight: &Options,
    seed: u64,
    setup: &V::Setup,
    fly: impl FnOnce(&V::Setup, Recorder<V>, Progress<'_>) -> Result<(Flown<V::Outcome>, Recorder<V>), Failure>,
) -> Result<(Flown<V::Outcome>, Recorder<V>), Failure> {
    std::fs::create_dir_all(&options.out).map_err(|error| format!("{}: {error}", options.out.display()))?;
    let facts = refly::facts::<V>(flight, seed)?;
    let recorder = Recorder::<V>::with_log(setup, &facts);
    let bar = terminal::bar(1000, "{msg:<11} {wide_bar:.cyan} {percent:>3} % of the mission");
    let flown = fly(setup, recorder, &mut |done, word| {
        bar.set_message(word);
        bar.set_position((done * 1000.0) as u64);
    });
    bar.finish_and_clear();
    let (flown, recorder) = flown?;

    let log = options.out.join(LOG);
    std::fs::write(&log, recorder.log()).map_err(|error| format!("{}: {error}", log.display()))?;
    write_report::<V>(
        &flown,
        (recorder.log(), recorder.hash()),
        refly::flown(flight).as_deref(),
        seed,
        &options.out.join(PAGE),
    )?;
    for (name, contents) in flown.outcome.files() {
        let path = options.out.join(name);
        std::fs::write(&path, contents).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok((flown, recorder))
}

/// The report is made from the log, so it shows what the log holds and nothing else.
pub(crate) fn write_report<V: Vehicle>(
    flown: &Flown<V::Outcome>,
    (log, hash): (&[u8], u64),
    flown_what: Option<&str>,
    seed: u64,
    page: &Path,
) -> Result<(), Failure> {
    let parsed = flight_log::parse(log)?;
    let outcome = &flown.outcome;
    let mut metrics = vec![Metric::new("verdict", outcome.sentence(), "").judged(outcome.succeeded())];
    let figures = outcome.figures();
    let figures = figures.iter().filter_map(|figure| Some((figure, figure.value?)));
    metrics.extend(figures.map(|(figure, value)| Metric::new(figure.title(), format!("{value:.3}"), figure.unit)));
    metrics.push(Metric::new("log hash", format!("{hash:016x}"), ""));
    let what = flown_what.map(|what| format!("{what}, ")).unwrap_or_default();
    let report = Report {
        title: format!("Flight of {}", V::NAME),
        subtitle: format!("simulated, {what}seed {seed}, {:.1} s", flown.duration.seconds_f64()),
        metrics,
        page: &V::PAGE,
        flight: &parsed.flight,
    };
    report.write(page).map_err(|error| format!("{}: {error}", page.display()).into())
}

/// The flight as a JSON object.
pub(crate) fn figures(flown: &Flown<impl Verdict>, hash: u64) -> Map<String, Value> {
    let mut object = Map::new();
    for (name, value) in flown.outcome.facts() {
        object.insert(name.into(), json!(value));
    }
    for figure in flown.outcome.figures() {
        object.insert(figure.name.into(), json!(figure.value));
    }
    add_findings(&mut object, &flown.outcome);
    object.insert("duration_s".into(), json!(flown.duration.seconds_f64()));
    object.insert("realtime_factor".into(), json!(flown.realtime_factor));
    object.insert("log_hash".into(), json!(format!("{hash:016x}")));
    object
}

/// Adds what came of faults.
pub(crate) fn add_findings(object: &mut Map<String, Value>, outcome: &impl Verdict) {
    if let Ok(Value::Object(findings)) = serde_json::to_value(outcome.findings()) {
        object.extend(findings);
    }
}

/// Everything about a flight. `folder` is where log and report are.
pub(crate) fn print_screen<V: Vehicle>(flown: &Flown<V::Outcome>, recorder: &Recorder<V>, folder: &Path) {
    let [log, page] = [LOG, PAGE].map(|name| folder.join(name));
    outln!("flight");
    flown.outcome.story().iter().for_each(|line| outln!("  {line}"));
    outln!("\nfigures");
    for figure in flown.outcome.figures() {
        match figure.value {
            Some(value) => outln!("  {:<22} {value:>8.3} {}", figure.name, figure.unit),
            None => outln!("  {:<22} {:>8}", figure.name, "–"),
        }
    }
    if !recorder.timing().is_empty() {
        outln!("\nrunnables, wall time on this machine         mean      longest");
    }
    for (info, row) in V::Runnables::ACTIVATIONS.iter().zip(recorder.timing()) {
        print_timing(info.name, row);
    }
    outln!(
        "\n{:.1} s flown at {:.0} × real time, log hash {:016x}",
        flown.duration.seconds_f64(),
        flown.realtime_factor,
        recorder.hash()
    );
    outln!("{}\n", flown.outcome.sentence());
    outln!("log     {}   (for example: ulog_info, PlotJuggler, stampfly replay)", log.display());
    outln!("report  {}   (open it in a browser)", page.display());
}

fn print_timing(name: &str, row: &Timing) {
    if row.count > 0 {
        let (mean, longest) = (row.total_ns as f64 / row.count as f64, row.longest_ns as f64 / 1e3);
        outln!("  {name:<14} {:>8} activations  {mean:>8.0} ns {longest:>8.1} us", row.count);
    }
}
