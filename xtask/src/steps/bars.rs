//! `bars`: do a hundred flights keep every bar, and are they simulated fast enough?
//!
//! The bars of the flights stand in `stampfly-host/bars.rs`, where the tests find them, too; the reference mission has
//! to keep its own both over models of the sensors and through the real drivers. The bars of speed are for one core and
//! depend on the machine: they are less than half of what a PC of 2024 does. Processor time counts, and the best of the short
//! runs of a minute: what shares a machine with others was seen to slow down by 1.7 for some seconds, without a sign of it in
//! its own times. What a step costs, whatever the machine does, is counted by `budget`.

use super::program::released;
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture, json};
use serde_json::Value;
use std::fs;
use std::time::{Duration, Instant};

/// Mission, figure, statistic, bar.
const BARS: [(&str, &str, &str, f64); 7] = include!("../../../stampfly-host/bars.rs");
/// Mission, and arguments besides.
const CAMPAIGNS: [(&str, &[&str]); 3] = [("square", &[]), ("square", &["--chips"]), ("hover", &[])];
const FLIGHTS: &str = "100";
/// Arguments, and times real time that a core has to simulate at least.
const SPEEDS: [(&[&str], f64); 2] = [(&[], 300.0), (&["--chips"], 100.0)];
/// Flights of a run that is timed, and for how long such runs are begun.
const TIMED: &str = "8";
const PATIENCE: Duration = Duration::from_secs(60);

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let program = released(repository)?.display().to_string();
    let mut failures = Vec::new();
    for (mission, arguments) in CAMPAIGNS {
        let title = [&[mission], arguments].concat().join(" ");
        let mut campaign = repository.command(&program);
        campaign.args(["campaign", "--json", "--flights", FLIGHTS, "--mission", mission]).args(arguments);
        // It fails by itself when a flight does not land or disarm.
        let report = match capture(&mut campaign) {
            Ok((report, _)) => report,
            Err(said) => {
                failures.push(format!("{title}: {said}"));
                continue;
            }
        };
        for (bar, kept) in check(mission, &json(&report)?)? {
            println!("{title}: {bar}");
            failures.extend((!kept).then(|| format!("{title}: {bar}")));
        }
    }
    for (arguments, least) in SPEEDS {
        let speed = speed(repository, &program, arguments, least)?;
        let said =
            format!("one core simulates {speed:.0} times as fast as real time {arguments:?}; {least} is the least");
        println!("{said}");
        failures.extend((speed < least).then_some(said));
    }
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n  ")) }
}

/// Every bar of a mission in words, and whether the campaign's report keeps it.
fn check(mission: &str, report: &Value) -> Result<Vec<(String, bool)>, Failure> {
    let of_mission = BARS.iter().filter(|(of, ..)| *of == mission);
    of_mission
        .map(|(_, figure, statistic, bar)| {
            // A figure that no flight has is `null`, and so is whatever is asked of it.
            let measured = report[figure][statistic].as_f64().ok_or_else(|| format!("no {statistic} of {figure}"))?;
            Ok((format!("{figure} {statistic} {measured:.3}; the bar is {bar}"), measured <= *bar))
        })
        .collect()
}

/// The best of some runs on one core. Stops as soon as the bar is reached.
fn speed(repository: &Repository, program: &str, arguments: &[&str], least: f64) -> Result<f64, Failure> {
    let status = fs::read_to_string("/proc/self/status").map_err(|e| format!("/proc/self/status: {e}"))?;
    let core = first_core(&status).ok_or("no Cpus_allowed_list")?;
    let (mut best, begun) = (0.0_f64, Instant::now());
    while best < least && begun.elapsed() < PATIENCE {
        let mut timed = repository.command("bash");
        timed.env("LC_ALL", "C").args(["-c", "TIMEFORMAT='%R %U %S'; time \"$@\"", "time"]);
        timed.args(["taskset", "-c", core, program, "campaign", "--json", "--flights", TIMED]);
        let (report, times) = capture(timed.args(arguments))?;
        let factor = json(&report)?["realtime_factor"].as_f64().ok_or("no `realtime_factor`")?;
        let share = processor_share(&times).ok_or_else(|| format!("no times in `{times}`"))?;
        best = best.max(factor / share);
    }
    Ok(best)
}

/// Processor time, as a part of the time that passed, from `real user system`.
fn processor_share(times: &str) -> Option<f64> {
    let numbers: Vec<f64> = times.lines().last()?.split(' ').map(|word| word.parse().ok()).collect::<Option<_>>()?;
    let [real, user, system] = numbers[..] else { return None };
    (real > 0.0 && user > 0.0).then_some((user + system) / real)
}

/// The first core that we may use.
fn first_core(status: &str) -> Option<&str> {
    let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"))?;
    list.trim().split([',', '-']).next()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn report(overshoot: f64) -> Value {
        let figures = BARS.iter().filter(|(mission, ..)| *mission == "square").map(|(_, figure, ..)| {
            let worst = if *figure == "takeoff_overshoot_m" { overshoot } else { 0.01 };
            (figure.to_string(), json!({ "max": worst, "p50": 0.0, "p95": 9.0 }))
        });
        Value::Object(figures.collect())
    }

    #[test]
    fn a_bar_is_kept_or_not() {
        let broken =
            |report: &Value| check("square", report).expect("complete").iter().filter(|(_, kept)| !kept).count();
        assert_eq!(check("square", &report(0.1)).map(|bars| bars.len()), Ok(6));
        assert_eq!((broken(&report(0.1)), broken(&report(0.1001))), (0, 1));
        let mut without = report(0.1);
        without["takeoff_overshoot_m"] = Value::Null;
        assert!(check("square", &without).is_err());
        assert!(check("square", &json!({})).is_err());
    }

    #[test]
    fn the_hover_is_judged_by_most_flights() {
        let keeps = |most: f64| {
            let report = json!({ "hover_drift_m": { "max": 0.4, "p50": 0.1, "p95": most } });
            check("hover", &report).is_ok_and(|bars| bars.len() == 1 && bars[0].1)
        };
        assert!(keeps(0.15) && !keeps(0.1501));
    }

    #[test]
    fn reads_times_and_cores() {
        assert_eq!(first_core("Name: x\nCpus_allowed_list:\t2-3,7\n"), Some("2"));
        assert_eq!(first_core("Name: x\n"), None);
        assert_eq!(processor_share("noise\n4.000 0.900 0.100\n"), Some(0.25));
        assert_eq!(processor_share("4.000 0.900"), None);
    }
}
