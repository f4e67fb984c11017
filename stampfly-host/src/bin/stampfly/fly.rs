//! `stampfly fly`: one flight, its log and its report, and one screen about how it went.

use crate::Failure;
use crate::arguments::FlyOptions;
use crate::terminal;
use serde_json::{Map, json};
use stampfly_board::plan;
use stampfly_lab::flight_log;
use stampfly_host::metrics::FIGURES;
use stampfly_host::recorder::Recorder;
use stampfly_host::report::{Metric, Report};
use stampfly_host::simulate::{Outcome, fly};
use std::path::Path;
use std::process::ExitCode;

pub fn run(options: &FlyOptions) -> Result<ExitCode, Failure> {
    if options.scene.list {
        options.scene.print_list(options.seed)?;
        return Ok(ExitCode::SUCCESS);
    }
    let config = options.scene.config(options.seed)?;
    std::fs::create_dir_all(&options.out).map_err(|error| format!("{}: {error}", options.out.display()))?;
    let facts = vec![
        ("ver_sw".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("seed".to_owned(), options.seed.to_string()),
        ("mission".to_owned(), options.scene.mission.clone()),
    ];
    let mut recorder = Recorder::with_log(facts).with_timing();
    let bar = terminal::bar(1000, "{msg:<11} {wide_bar:.cyan} {percent:>3} % of the mission");
    let outcome = fly(&config, &mut recorder, &mut |done, state| {
        bar.set_message(state.name());
        bar.set_position((done * 1000.0) as u64);
    });
    bar.finish_and_clear();

    let log = options.out.join("flight.ulg");
    std::fs::write(&log, recorder.log()).map_err(|error| format!("{}: {error}", log.display()))?;

    let page = options.out.join("flight.html");
    write_report(&outcome, recorder.log(), options, &page)?;

    if options.scene.json {
        print_json(&outcome);
    } else {
        print_screen(&outcome, &recorder, &log, &page);
    }
    let good = outcome.metrics.landed && outcome.metrics.disarmed && outcome.finished;
    Ok(if good { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The report is made from the log, so it shows what the log holds and nothing else.
fn write_report(outcome: &Outcome, log: &[u8], options: &FlyOptions, page: &Path) -> Result<(), Failure> {
    let parsed = flight_log::parse(log)?;
    let mut metrics: Vec<Metric> = FIGURES
        .iter()
        .filter_map(|(name, unit, figure)| Some((name, unit, figure(&outcome.metrics)?)))
        .map(|(name, unit, value)| Metric::new(*name, format!("{value:.3}"), *unit))
        .collect();
    let done = outcome.metrics.landed && outcome.metrics.disarmed;
    metrics.insert(0, Metric::new("landed, disarmed", if done { "yes" } else { "no" }, "").judged(done));
    metrics.push(Metric::new("log hash", format!("{:016x}", outcome.log_hash), ""));
    let report = Report {
        title: "StampFly flight".into(),
        subtitle: format!(
            "simulated, mission {}, seed {}, vibration {}, {:.1} s",
            options.scene.mission,
            options.seed,
            options.scene.vibration,
            outcome.duration.seconds_f64()
        ),
        metrics,
        flight: &parsed.flight,
    };
    report.write(page).map_err(|error| format!("{}: {error}", page.display()).into())
}

fn print_json(outcome: &Outcome) {
    let mut object = Map::new();
    object.insert("landed".into(), json!(outcome.metrics.landed));
    object.insert("disarmed".into(), json!(outcome.metrics.disarmed));
    for (name, _, figure) in FIGURES {
        object.insert(name.into(), json!(figure(&outcome.metrics)));
    }
    object.insert("finished".into(), json!(outcome.finished));
    object.insert("duration_s".into(), json!(outcome.duration.seconds_f64()));
    object.insert("realtime_factor".into(), json!(outcome.realtime_factor));
    object.insert("log_hash".into(), json!(format!("{:016x}", outcome.log_hash)));
    outln!("{}", serde_json::Value::Object(object));
}

fn print_screen(outcome: &Outcome, recorder: &Recorder, log: &Path, page: &Path) {
    outln!("phases");
    for phase in &outcome.phases {
        let mode = if phase.state.name() == "Flying" { format!(" {:?}", phase.mode) } else { String::new() };
        outln!("  {:>9.3} s  {}{mode}", phase.since.seconds_f64(), phase.state.name());
    }
    outln!("\nfigures");
    for (name, unit, figure) in FIGURES {
        match figure(&outcome.metrics) {
            Some(value) => outln!("  {name:<22} {value:>8.3} {unit}"),
            None => outln!("  {name:<22} {:>8}", "–"),
        }
    }
    outln!("  {:<22} {:>8.3} deg", "worst tilt", outcome.worst_tilt_deg);
    let [first, last] = outcome.battery;
    outln!("  {:<22} {first:>8.2} V at the start, {last:.2} V at the end", "battery");
    outln!("\nrunnables, wall time on this machine         mean      longest");
    for (info, row) in plan::ACTIVATIONS.iter().zip(recorder.timing()) {
        if row.count > 0 {
            let mean = row.total_ns as f64 / row.count as f64;
            outln!(
                "  {:<14} {:>8} activations  {mean:>8.0} ns {:>8.1} us",
                info.name,
                row.count,
                row.longest_ns as f64 / 1e3
            );
        }
    }
    outln!(
        "\n{:.1} s flown at {:.0} × real time, log hash {:016x}",
        outcome.duration.seconds_f64(),
        outcome.realtime_factor,
        outcome.log_hash
    );
    let verdict = match (outcome.metrics.landed, outcome.metrics.disarmed) {
        (true, true) => "landed and disarmed",
        (true, false) => "landed, still armed",
        (false, _) => "DID NOT LAND",
    };
    outln!("{verdict}\n\nlog     {}   (for example: ulog_info, PlotJuggler, stampfly replay)", log.display());
    outln!("report  {}   (open it in a browser)", page.display());
}
