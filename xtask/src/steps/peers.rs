//! `peers`: a step of our estimator beside its peers', for the default target and for this machine's own.
//!
//! Runs the benchmark `estimators` twice and prints a table; `--fix` writes it into the estimator's README. Takes some
//! minutes with the builds. Not part of `ci`: a clock on a shared machine says nothing that could fail a build, and the
//! bar is the ratio, for people to read. Beside it stand figures of programs in C and C++, measured once elsewhere: the
//! two crates that were measured there, too, tell how the machines compare.

use crate::Failure;
use crate::arguments::Arguments;
use crate::repository::{Repository, capture};
use crate::steps::cortex_m4f::{self, Counted};
use std::fmt::Write;
use std::fs;

const README: &str = "stampfly-eskf/README.md";
const BEGIN: &str = "<!-- peers: cargo xtask peers --fix -->\n";
const END: &str = "<!-- end of peers -->";

/// Folder for the build, compiler flags.
const SETTINGS: [(&str, &str); 2] = [("default", ""), ("native", "-C target-cpu=native")];

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
    let fix = arguments.fix;
    let mut reports = Vec::new();
    for (folder, flags) in SETTINGS {
        let mut bench = repository.cargo();
        bench.args(["bench", "--quiet", "-p", "stampfly-benches", "--bench", "estimators", "--target-dir"]);
        bench.arg(repository.target("peers").join(folder)).args(["--", "medians"]).env("RUSTFLAGS", flags);
        reports.push(capture(&mut bench)?.0);
    }
    let [default, native] = reports.as_slice() else { return Err("two runs were expected".to_owned()) };
    let ours = table(&machine(repository)?, &measured(default)?, &measured(native)?)?;
    let text = format!("{ours}\n{}\n{}", on_target(&cortex_m4f::emulate(repository)?)?, elsewhere());
    print!("{text}");
    if fix { repository.fill(README, BEGIN, END, &text) } else { Ok(()) }
}

/// What one run found out about one contender.
#[derive(Debug, PartialEq)]
struct Line<'a> {
    group: &'a str,
    name: &'a str,
    nanoseconds: f64,
    ratio: f64,
}

/// The medians at the end of the benchmark's output.
fn measured(report: &str) -> Result<Vec<Line<'_>>, Failure> {
    let mut lines = Vec::new();
    let mut group = "";
    for line in report.lines() {
        if let Some((title, _)) = line.split_once(": median of ") {
            group = title;
        } else if let Some((left, ratio)) = line.split_once(" ns   this / first = ") {
            let (name, time) = left.rsplit_once(' ').ok_or_else(|| format!("no time in `{line}`"))?;
            let number = |text: &str| text.trim().parse().map_err(|e| format!("`{text}` in `{line}`: {e}"));
            lines.push(Line { group, name: name.trim(), nanoseconds: number(time)?, ratio: number(ratio)? });
        }
    }
    if lines.is_empty() { Err(format!("no medians in\n{report}")) } else { Ok(lines) }
}

fn table(machine: &str, default: &[Line], native: &[Line]) -> Result<String, Failure> {
    let mut text = format!("{machine}; `f32`, gates on in ours, medians of seven interleaved rounds.\n");
    let mut group = "";
    for line in default {
        let other = native.iter().find(|other| (other.group, other.name) == (line.group, line.name));
        let other = other.ok_or_else(|| format!("`{}` was measured once only", line.name))?;
        if line.group != group {
            group = line.group;
            let _ = write!(
                text,
                "\n| {group} | x86-64 | to first | `target-cpu=native` | to first |\n|---|---|---|---|---|\n"
            );
        }
        let Line { name, nanoseconds, ratio, .. } = line;
        let _ = writeln!(
            text,
            "| {name} | {nanoseconds:.0} ns | {ratio:.2} | {:.0} ns | {:.2} |",
            other.nanoseconds, other.ratio
        );
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

    #[test]
    fn reads_the_medians_and_nothing_else() {
        let report = "x was off by 0.1 at most\n\nstep: median of 7 interleaved rounds of 200 steps\n\
                      ours, fast       10.0 ns   this / first = 1.00\ntheirs          25.4 ns   this / first = 2.54\n";
        let line = |name, nanoseconds, ratio| Line { group: "step", name, nanoseconds, ratio };
        assert_eq!(measured(report), Ok(vec![line("ours, fast", 10.0, 1.0), line("theirs", 25.4, 2.54)]));
        assert!(measured("nothing").is_err());
        let lines = measured(report).expect("read");
        let table = table("a machine", &lines, &lines).expect("both");
        assert!(table.contains("| theirs | 25 ns | 2.54 | 25 ns | 2.54 |"), "{table}");
        assert!(super::table("a machine", &lines, &lines[..1]).is_err());
    }
}
