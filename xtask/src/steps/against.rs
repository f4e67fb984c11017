//! `against`: how fast are chain, control and simulation beside the commit at which outsiders measured them?
//!
//! | row | what is timed |
//! |---|---|
//! | chain | inertial sample to motor duty, by the benchmark `chain` of either commit |
//! | control | rate loops, mixer, duty: `xtask/against/rate.rs`, with the interface of either commit before it |
//! | simulation | twenty-four missions on one core, by the program of either commit |
//!
//! Either commit in turn, several rounds, the least of each: other programs on the machine can only slow one of them down. Not part of
//! `ci`: a clock on a shared machine says nothing that could fail a build.

use crate::arguments::Arguments;
use crate::commit::sources;
use crate::repository::{Failure, Repository, capture, run as run_program};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// The commit of the outsiders' figures.
const THEN: &str = "57a2326c46553d2951288427ffd54fea9ab8a2cd";
const ROUNDS: usize = 5;
const FLIGHTS: &str = "24";

/// The sources of one commit, where it is built, and how its control interface is called.
struct Side {
    sources: PathBuf,
    target: PathBuf,
    interface: &'static str,
}

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let side =
        |sources, name: &str, interface| Side { sources, target: repository.target("against").join(name), interface };
    let sides = [
        side(repository.root.clone(), "now", include_str!("../../against/now.rs")),
        side(sources(repository, THEN)?, "then", include_str!("../../against/then.rs")),
    ];
    for side in &sides {
        build(repository, side)?;
    }
    println!("{:<12} {:>12} {:>12} {:>8}", "", "now", &THEN[..7], "ratio");
    for (row, unit, measure) in ROWS {
        let mut least = [f64::INFINITY; 2];
        for _ in 0..ROUNDS {
            for (least, side) in least.iter_mut().zip(&sides) {
                *least = least.min(measure(repository, side)?);
            }
        }
        let [now, then] = least;
        println!("{row:<12} {now:>9.1} {unit:<2} {then:>9.1} {unit:<2} {:>8.2}", then / now);
    }
    Ok(())
}

/// What is measured: name, unit, how.
type Row = (&'static str, &'static str, fn(&Repository, &Side) -> Result<f64, Failure>);
const ROWS: [Row; 3] = [("chain", "ns", chain), ("control", "ns", control), ("simulation", "s", simulation)];

/// A cargo that builds this commit to be fast.
fn cargo(repository: &Repository, side: &Side) -> Command {
    let mut cargo = repository.cargo();
    cargo.current_dir(&side.sources).env("CARGO_TARGET_DIR", &side.target).env("CARGO_INCREMENTAL", "0");
    cargo
}

fn build(repository: &Repository, side: &Side) -> Result<(), Failure> {
    run_program(cargo(repository, side).args(["build", "--quiet", "--release", "--bin", "stampfly"]))?;
    run_program(cargo(repository, side).args([
        "bench",
        "--quiet",
        "-p",
        "stampfly-benches",
        "--bench",
        "chain",
        "--no-run",
    ]))?;
    let package = package(side);
    let path = |name: &str| side.sources.join(name).display().to_string();
    let manifest = format!(
        "[package]\nname = \"rate\"\nversion = \"0.0.0\"\nedition = \"2024\"\n[workspace]\n[dependencies]\n\
         stampfly-control = {{ path = {:?} }}\nstampfly-types = {{ path = {:?} }}\n[profile.release]\nlto = \"thin\"\n",
        path("stampfly-control"),
        path("stampfly-types")
    );
    let program = [include_str!("../../against/rate.rs"), side.interface].concat();
    let io = |path: &Path, e: std::io::Error| format!("{}: {e}", path.display());
    fs::create_dir_all(package.join("src")).map_err(|e| io(&package, e))?;
    fs::write(package.join("Cargo.toml"), manifest).map_err(|e| io(&package, e))?;
    fs::write(package.join("src/main.rs"), program).map_err(|e| io(&package, e))?;
    run_program(cargo(repository, side).current_dir(&package).args(["build", "--quiet", "--release"]))
}

fn package(side: &Side) -> PathBuf {
    side.target.join("package")
}

/// The benchmark's own figure, the last line it prints; no part of it has this name.
fn chain(repository: &Repository, side: &Side) -> Result<f64, Failure> {
    let bench = ["bench", "--quiet", "-p", "stampfly-benches", "--bench", "chain", "--", "none"];
    let (said, _) = capture(cargo(repository, side).args(bench))?;
    let figure = said.lines().find_map(|line| line.strip_prefix("mean of")?.rsplit_once(": ")?.1.strip_suffix(" ns"));
    figure.and_then(|text| text.parse().ok()).ok_or_else(|| format!("no mean in\n{said}"))
}

fn control(repository: &Repository, side: &Side) -> Result<f64, Failure> {
    let (said, _) = capture(repository.command("taskset").args(["-c", "0"]).arg(side.target.join("release/rate")))?;
    said.trim().parse().map_err(|_| format!("no number: {said}"))
}

fn simulation(repository: &Repository, side: &Side) -> Result<f64, Failure> {
    let mut campaign = repository.command("taskset");
    campaign.args(["-c", "0"]).arg(side.target.join("release/stampfly")).args(["campaign", "--flights", FLIGHTS]);
    let begun = Instant::now();
    capture(&mut campaign)?;
    Ok(begun.elapsed().as_secs_f64())
}
