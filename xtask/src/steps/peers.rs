//! `peers`: a step of our estimator beside other crates', for the default target and for this machine's own.
//!
//! Runs the benchmark `estimators`, reads the medians that criterion writes as JSON, and prints a table; `--fix` writes it into
//! the estimator's README. Takes some minutes with the builds. Not part of `ci`: a clock on a shared machine says nothing
//! that could fail a build. Beside it stand figures of programs in C and C++, measured once elsewhere: the two crates that
//! were measured there as well show how the machines compare.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture, json, run as run_program};
use crate::steps::cortex_m4f::{self, Counted};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

const README: &str = "stampfly-eskf/README.md";
const BEGIN: &str = "<!-- peers: cargo xtask peers --fix -->\n";
const END: &str = "<!-- end of peers -->";

/// Folder for the build, compiler flags.
const SETTINGS: [(&str, &str); 2] = [("default", ""), ("native", "-C target-cpu=native")];
/// Runs of the benchmark for each setting. The least of their medians counts: criterion measures one contender after the
/// other, and other programs on the machine can only slow one of them down.
const ROUNDS: usize = 3;
/// Groups of the benchmark, and whom the others of the group are compared with.
const GROUPS: [(&str, &str); 2] = [("400 Hz step", "stampfly-eskf"), ("400 Hz step, attitude only", "AttitudeFilter")];

/// Name, nanoseconds for the x86-64 baseline and for the machine's own instructions: the better of gcc 12.2 -O2 or -O3
/// and clang 14, rustc 1.95 for the crates. Medians.
const ELSEWHERE: &[(&str, u32, u32)] = &[
    ("StampFly firmware (M5Fly-kanazawa/stampfly_ecosystem 2598fb3), 15 states", 398, 299),
    ("the same with its accelerometer attitude at every step, as it flies", 1330, 809),
    ("StampFly firmware (myamazum/stampfly_ecosystem a87205e), 15 states", 465, 384),
    ("the same with its accelerometer attitude at every step, as it flies", 1486, 1008),
    ("PX4 EKF2 (264b8fe), 24 states, prediction and fusion only", 1281, 970),
    ("PX4 EKF2 (264b8fe), 16 states, magnetometer as heading only", 638, 381),
    ("Crazyflie kalman_core (2a18fc2), 9 states, no magnetometer", 1009, 985),
    ("for scale: the crate `eskf` 0.2", 1477, 950),
    ("for scale: the crate `kfilter` 0.5", 676, 661),
];

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    // A sample that a contender refuses costs it less, so its time says nothing.
    run_program(repository.cargo().args(["test", "--quiet", "-p", "stampfly-benches", "--lib"]))?;
    let mut medians = Vec::new();
    for (folder, flags) in SETTINGS {
        let target = repository.target("peers").join(folder);
        let home = target.join("criterion");
        let mut rounds = Vec::new();
        for _ in 0..ROUNDS {
            // What an earlier run left there would count, too.
            let _ = fs::remove_dir_all(&home);
            let mut bench = repository.cargo();
            bench.args(["bench", "--quiet", "-p", "stampfly-benches", "--bench", "estimators", "--target-dir"]);
            bench.arg(&target).env("CRITERION_HOME", &home).env("RUSTFLAGS", flags);
            run_program(&mut bench)?;
            rounds.push(measured(&home)?);
        }
        medians.push(least(&rounds)?);
    }
    let [default, native] = medians.as_slice() else { return Err("two settings were expected".to_owned()) };
    let ours = table(&machine(repository)?, default, native)?;
    let text = format!("{ours}\n{}\n{}", on_target(&cortex_m4f::emulate(repository)?)?, elsewhere());
    print!("{text}");
    if arguments.fix { repository.fill(README, BEGIN, END, &text) } else { Ok(()) }
}

/// Nanoseconds of a step, by group and contender.
type Times = BTreeMap<(String, String), f64>;

/// Criterion's medians: `GROUP/CONTENDER/new/estimates.json` beside a `benchmark.json` with the names.
fn measured(home: &Path) -> Result<Times, Failure> {
    let mut times = Times::new();
    for contender in folders(home)?.iter().flat_map(|group| folders(group).unwrap_or_default()) {
        let new = contender.join("new");
        if !new.is_dir() {
            continue;
        }
        let read = |name: &str| {
            let path = new.join(name);
            json(&fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?)
        };
        let (benchmark, estimates) = (read("benchmark.json")?, read("estimates.json")?);
        let name = |key: &str| benchmark[key].as_str().map(str::to_owned);
        let median = estimates["median"]["point_estimate"].as_f64();
        let (Some(group), Some(name), Some(median)) = (name("group_id"), name("function_id"), median) else {
            return Err(format!("{}: no names or no median", new.display()));
        };
        times.insert((group, name), median);
    }
    if times.is_empty() { Err(format!("criterion left no medians in {}", home.display())) } else { Ok(times) }
}

fn folders(path: &Path) -> Result<Vec<std::path::PathBuf>, Failure> {
    let entries = fs::read_dir(path).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.is_dir()).collect())
}

/// The least of some runs, contender by contender.
fn least(rounds: &[Times]) -> Result<Times, Failure> {
    let mut fastest = Times::new();
    for key in rounds.iter().flat_map(BTreeMap::keys) {
        let times: Option<Vec<f64>> = rounds.iter().map(|round| round.get(key).copied()).collect();
        let times = times.ok_or_else(|| format!("{key:?} was not measured in every run"))?;
        fastest.insert(key.clone(), times.into_iter().fold(f64::INFINITY, f64::min));
    }
    Ok(fastest)
}

/// One table per group: ours first, the others by their times.
fn table(machine: &str, default: &Times, native: &Times) -> Result<String, Failure> {
    let mut text = format!("{machine}; `f32`, gates on in ours, the least median of {ROUNDS} runs of the benchmark.\n");
    for (group, ours) in GROUPS {
        let time = |times: &Times, name: &str| {
            let time = times.get(&(group.to_owned(), name.to_owned())).copied();
            time.ok_or_else(|| format!("`{name}` of `{group}` was not measured"))
        };
        let (ours_default, ours_native) = (time(default, ours)?, time(native, ours)?);
        let mut rows: Vec<(&str, f64)> =
            default.iter().filter(|((of, _), _)| of == group).map(|((_, name), time)| (name.as_str(), *time)).collect();
        rows.sort_by(|(a, a_time), (b, b_time)| (*a != ours).cmp(&(*b != ours)).then(a_time.total_cmp(b_time)));
        let _ =
            write!(text, "\n| {group} | x86-64 | to first | `target-cpu=native` | to first |\n|---|---|---|---|---|\n");
        for (name, default) in rows {
            let native = time(native, name)?;
            let (ratio, native_ratio) = (default / ours_default, native / ours_native);
            let _ = writeln!(text, "| {name} | {default:.0} ns | {ratio:.2} | {native:.0} ns | {native_ratio:.2} |");
        }
    }
    Ok(text)
}

/// What the firmware counted.
fn on_target(said: &str) -> Result<String, Failure> {
    let mut text = String::from("| Cortex-M4F, `cargo xtask cortex-m4f` | mean of a step | most |\n|---|---|---|\n");
    for Counted { name, mean, most, .. } in cortex_m4f::read(said)? {
        let _ = writeln!(text, "| {name} | {mean:.0} instructions | {most} instructions |");
    }
    Ok(text)
}

fn elsewhere() -> String {
    let mut text = String::from(
        "Programs in C and C++ cannot be built from here. They were measured once, elsewhere: the same mix of steps, one `f32`\n\
         filter each, AMD EPYC (Zen 5) at 4.0 to 4.25 GHz, the better of gcc 12.2 and clang 14. Compare through the two\n\
         crates that were measured there as well, not directly.\n\n\
         | measured elsewhere | x86-64 | `-march=native` |\n|---|---|---|\n",
    );
    for (name, default, native) in ELSEWHERE {
        let _ = writeln!(text, "| {name} | {default} ns | {native} ns |");
    }
    text
}

/// Processor and compiler, in words.
fn machine(repository: &Repository) -> Result<String, Failure> {
    let processors = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = processors.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let model = model.map_or("unknown processor", |(_, name)| name.trim());
    let (compiler, _) = capture(repository.command("rustc").arg("--version"))?;
    let compiler: Vec<&str> = compiler.split_whitespace().take(2).collect();
    Ok(format!("{model}, {}", compiler.join(" ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(home: &Path, group: &str, name: &str, median: f64) {
        let new = home.join(group).join(name).join("new");
        fs::create_dir_all(&new).expect("a folder");
        let benchmark = serde_json::json!({ "group_id": group, "function_id": name });
        fs::write(new.join("benchmark.json"), benchmark.to_string()).expect("a file");
        let estimates =
            serde_json::json!({ "mean": { "point_estimate": 0.0 }, "median": { "point_estimate": median } });
        fs::write(new.join("estimates.json"), estimates.to_string()).expect("a file");
    }

    #[test]
    fn reads_what_criterion_writes() {
        let home = std::env::temp_dir().join(format!("peers-{}", std::process::id()));
        write(&home, "a", "x", 2.5);
        write(&home, "b", "x", 3.5);
        // Criterion's pages are beside the figures.
        fs::create_dir_all(home.join("report"))
            .and_then(|()| fs::create_dir_all(home.join("a/report")))
            .expect("folders");
        let times = measured(&home).expect("two medians");
        let key = |group: &str| (group.to_owned(), "x".to_owned());
        assert_eq!(times, [(key("a"), 2.5), (key("b"), 3.5)].into());
        fs::remove_dir_all(&home).expect("it is ours");
        assert!(measured(&home).is_err());
    }

    fn times(ours: f64) -> Times {
        let mut times = Times::new();
        for (group, name) in GROUPS {
            times.insert((group.to_owned(), name.to_owned()), ours);
            times.insert((group.to_owned(), "theirs".to_owned()), 5.0);
        }
        times
    }

    #[test]
    fn the_fastest_run_counts() {
        let rounds = [times(10.0), times(9.0), times(40.0)];
        assert_eq!(least(&rounds), Ok(times(9.0)));
        assert!(least(&[times(9.0), Times::new()]).is_err());
    }

    #[test]
    fn ours_is_first_and_the_measure_of_the_others() {
        let text = table("a machine", &times(10.0), &times(20.0)).expect("complete");
        assert!(
            text.contains("| stampfly-eskf | 10 ns | 1.00 | 20 ns | 1.00 |\n| theirs | 5 ns | 0.50 | 5 ns | 0.25 |"),
            "{text}"
        );
        assert!(table("a machine", &times(10.0), &Times::new()).is_err());
    }
}
