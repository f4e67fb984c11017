//! cargo-mutants, the tool that changes the program and runs the tests, and what it says.
//!
//! It works in a copy of the sources below cargo's folder for generated files, so the sources themselves never hold a mutant.

use super::list::{FILE, digest};
use crate::copy::{Files, copy, sources};
use crate::repository::{Failure, Repository, capture, run as run_program};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use toml_edit::{Array, DocumentMut, Item, value};

const MANIFEST: &str = "Cargo.toml";
const VERSION: &str = "27.1.0";
const TREE: &str = "mutants/tree";
/// The packages of the copy. With all of the workspace cargo itself would take half of the time.
const PACKAGES: [&str; 3] = ["stampfly-types", "stampfly-control", "stampfly-mode"];
/// Its own, for packages of the same names in another folder would be built in turns.
const BUILD: &str = "mutants/build";
/// Longest time to build, and of the tests, s: quick ones take one, and all of them ten. What takes longer has survived.
const BUILD_TIME: &str = "120";
const QUICK_TIME: &str = "20";
const TIME: &str = "120";

/// A package and those of its files that are mutated.
pub struct Mutated {
    pub package: &'static str,
    /// From the top of the repository; a folder ends with `/`.
    pub place: &'static str,
    /// With which the package is tested; what stands under another is in no test.
    pub features: &'static [&'static str],
    /// What the tests are told in the first pass: they find most of the mutants, and take a second.
    pub quick: &'static [&'static str],
}

/// What decides whether motors turn: what [`coverage`](crate::steps::coverage) looks at as well.
pub const MUTATED: [Mutated; 2] = [
    Mutated {
        package: "stampfly-mode",
        place: "stampfly-mode/src/",
        features: &[],
        quick: &["--skip", "exhaustive", "--skip", "alerts_of_a_kind", "--skip", "entered_once_and_left_once"],
    },
    Mutated {
        package: "stampfly-control",
        place: "stampfly-control/src/mixer/",
        features: &["serde"],
        quick: &["mixer"],
    },
];

/// The other tests, which take ten seconds and more, and the code that they can see. Survivors of the first pass meet them.
const SLOW: [(&[&str], &[&str]); 3] = [
    (
        &["exhaustive", "alerts_of_a_kind"],
        &[
            "stampfly-mode/src/arming.rs",
            "stampfly-mode/src/decision.rs",
            "stampfly-mode/src/facts.rs",
            "stampfly-mode/src/machine.rs",
            "stampfly-mode/src/pilot.rs",
            "stampfly-mode/src/state.rs",
            "stampfly-mode/src/stop_button.rs",
            "stampfly-mode/src/transitions.rs",
        ],
    ),
    (&["entered_once_and_left_once"], &["stampfly-mode/src/stage/"]),
    (&[], &["stampfly-control/src/mixer/"]),
];

/// The slow tests that can see this file; `None` when there are none.
fn slow(file: &str) -> Option<&'static [&'static str]> {
    SLOW.iter().find(|(_, places)| places.iter().any(|place| file.starts_with(place))).map(|(tests, _)| *tests)
}

/// A change of the program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mutant {
    /// As the tool names it: `FILE:LINE:COLUMN: CHANGE`.
    pub name: String,
    pub file: String,
    /// Without line and column, so that it survives edits: `FILE: CHANGE`, and ` #2` for the second of the same text.
    pub label: String,
}

/// What became of a mutant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    Caught,
    /// No test failed, or none ended in time.
    Survived,
    /// It does not compile.
    Unviable,
}

/// The copy of the sources, and the program that mutates it.
pub struct Tool<'r> {
    repository: &'r Repository,
    program: PathBuf,
    tree: PathBuf,
}

impl<'r> Tool<'r> {
    /// Installs the program where it is missing, and brings the copy up to date.
    pub fn ready(repository: &'r Repository) -> Result<Self, Failure> {
        let place = repository.target(&format!("mutants/cargo-mutants-{VERSION}"));
        let program = place.join("bin/cargo-mutants");
        if !program.exists() {
            let mut install = repository.cargo();
            install
                .args(["install", "--quiet", "--locked", "cargo-mutants", "--version", VERSION, "--root"])
                .arg(&place);
            run_program(install.arg("--target-dir").arg(place.join("build")))?;
            // 300 MB that nothing needs again.
            let _ = fs::remove_dir_all(place.join("build"));
        }
        let tree = repository.target(TREE);
        copy(&repository.root, &tree, &small(repository, sources(repository)?)?)?;
        Ok(Self { repository, program, tree })
    }

    /// Every mutant of a package, in the order of the sources.
    pub fn list(&self, mutated: &Mutated) -> Result<Vec<Mutant>, Failure> {
        let glob =
            if mutated.place.ends_with('/') { format!("{}**/*.rs", mutated.place) } else { mutated.place.into() };
        let mut command = self.mutants([glob.as_str()]);
        let (said, _) = capture(command.args(["--list", "--json"]))?;
        let list: Value = serde_json::from_str(&said).map_err(|e| format!("{}: {e}", mutated.place))?;
        let list = list.as_array().ok_or("no list of mutants")?;
        let name = |mutant: &Value| mutant["name"].as_str().map(str::to_owned);
        labelled(&list.iter().filter_map(name).collect::<Vec<_>>())
    }

    /// Do the tests of a package pass, all or the quick ones, when it has no mutant? Without that, every mutant would be caught.
    pub fn baseline(&self, mutated: &Mutated, all: bool) -> Result<(), Failure> {
        let tests = if all { &[] } else { mutated.quick };
        let mut cargo = self.repository.cargo();
        environment(self.repository, cargo.current_dir(&self.tree));
        cargo.args(["test", "--quiet", "--lib", "--package", mutated.package]).args(features(mutated));
        run_program(cargo.arg("--").args(tests))
    }

    /// Tests mutants of one file, first with the quick tests and then, if so wanted, those that survive with the slow ones.
    pub fn run(&self, mutated: &Mutated, mutants: &[&Mutant], all: bool) -> Result<BTreeMap<String, Outcome>, Failure> {
        let mut outcomes = self.pass(mutated, mutants, mutated.quick, QUICK_TIME)?;
        let survived = |mutant: &&Mutant| outcomes.get(&mutant.label) == Some(&Outcome::Survived);
        let survivors: Vec<&Mutant> = mutants.iter().copied().filter(survived).collect();
        let slow = survivors.first().filter(|_| all).and_then(|mutant| slow(&mutant.file));
        if let Some(tests) = slow {
            outcomes.extend(self.pass(mutated, &survivors, tests, TIME)?);
        }
        Ok(outcomes)
    }

    fn pass(
        &self,
        mutated: &Mutated,
        mutants: &[&Mutant],
        tests: &[&str],
        time: &str,
    ) -> Result<BTreeMap<String, Outcome>, Failure> {
        let place = self.repository.target("mutants");
        let report = place.join("mutants.out/outcomes.json");
        let _ = fs::remove_file(&report);
        // The tool runs deleted fields of every file that it is given, whatever else is chosen.
        let mut command = self.mutants(mutants.iter().map(|mutant| mutant.file.as_str()).collect::<BTreeSet<_>>());
        command.args([
            "--in-place",
            "--baseline",
            "skip",
            "--timeout",
            time,
            "--build-timeout",
            BUILD_TIME,
            "--no-times",
        ]);
        command.arg("--output").arg(&place).args(features(mutated));
        command.args(mutants.iter().flat_map(|mutant| ["--re".to_owned(), format!("^{}$", escaped(&mutant.name))]));
        command.args(["--", "--lib", "--"]).args(tests);
        // It fails when a mutant survives; whether it ran at all, the report tells.
        let output = command.output().map_err(|e| format!("cargo-mutants could not be started: {e}"))?;
        let said = || String::from_utf8_lossy(&output.stderr).into_owned();
        let report = fs::read_to_string(&report).map_err(|_| format!("cargo-mutants ran nothing: {}", said()))?;
        let found = outcomes(&report)?;
        let outcome = |mutant: &&Mutant| {
            let outcome = found.get(&mutant.name).ok_or_else(|| format!("not run: {}\n{}", mutant.name, said()))?;
            Ok((mutant.label.clone(), *outcome))
        };
        mutants.iter().map(outcome).collect()
    }

    /// The program, for these files.
    fn mutants<'f>(&self, files: impl IntoIterator<Item = &'f str>) -> Command {
        let mut command = self.repository.command(&self.program.to_string_lossy());
        environment(self.repository, &mut command);
        command.args(["mutants", "--no-config", "--colors", "never", "--dir"]).arg(&self.tree);
        command.args(files.into_iter().flat_map(|file| ["--file", file]));
        command
    }

    /// Digest of a file's text.
    pub fn digest(&self, file: &str) -> Result<String, Failure> {
        fs::read(self.tree.join(file)).map(|text| digest(&text)).map_err(|e| format!("{file}: {e}"))
    }
}

/// The features of a package, as cargo and the tool are told.
fn features(mutated: &Mutated) -> impl Iterator<Item = &'static str> {
    mutated.features.iter().flat_map(|feature| ["--features", feature])
}

/// What a workspace of [`PACKAGES`] alone consists of.
fn small(repository: &Repository, mut files: Files) -> Result<Files, Failure> {
    let manifest = repository.root.join(MANIFEST);
    let text = fs::read_to_string(&manifest).map_err(|e| format!("{MANIFEST}: {e}"))?;
    files.retain(|file, _| file.components().count() == 1 || PACKAGES.iter().any(|package| file.starts_with(package)));
    files.insert(MANIFEST.into(), Some(manifest_of(&text)?));
    Ok(files)
}

/// The workspace's manifest with [`PACKAGES`] for members.
fn manifest_of(text: &str) -> Result<String, Failure> {
    let mut manifest: DocumentMut = text.parse().map_err(|e| format!("{MANIFEST}: {e}"))?;
    let workspace = manifest.get_mut("workspace").and_then(Item::as_table_mut).ok_or("no workspace")?;
    workspace.remove("exclude");
    workspace.remove("default-members");
    workspace.insert("members", value(PACKAGES.into_iter().collect::<Array>()));
    Ok(manifest.to_string())
}

/// How tests are built and run: one file changes at a time, so building again is most of the time. Property tests draw the same cases
/// each time, or a mutant that one case in a thousand shows would be caught on some days.
fn environment(repository: &Repository, command: &mut Command) {
    command.env("CARGO_INCREMENTAL", "1").env("CARGO_PROFILE_TEST_DEBUG", "0").env("PROPTEST_RNG_SEED", "1");
    command.env("CARGO_TARGET_DIR", repository.target(BUILD));
}

/// Mutants of these names, labelled.
fn labelled(names: &[String]) -> Result<Vec<Mutant>, Failure> {
    let parts = |name: &String| {
        let (place, change) = name.split_once(": ")?;
        let file = place.split(':').next()?;
        Some((file.to_owned(), format!("{file}: {change}")))
    };
    let parts = |name| parts(name).ok_or_else(|| format!("{FILE}: no name of a mutant: {name}"));
    let all: Vec<(String, String)> = names.iter().map(parts).collect::<Result<_, _>>()?;
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    let label = |(name, (file, label)): (&String, &'_ (String, String))| (name.clone(), file.clone(), label.clone());
    let mut mutants = Vec::new();
    for (place, (name, file, text)) in names.iter().zip(&all).map(label).enumerate() {
        let count = all.iter().filter(|(_, other)| *other == text).count();
        let nth = seen.entry(&all[place].1).or_default();
        *nth += 1;
        let label = if count == 1 { text } else { format!("{text} #{nth}") };
        mutants.push(Mutant { name, file, label });
    }
    Ok(mutants)
}

/// What the tool's report says of each mutant, by name.
fn outcomes(report: &str) -> Result<BTreeMap<String, Outcome>, Failure> {
    let report: Value = serde_json::from_str(report).map_err(|e| format!("cargo-mutants' report: {e}"))?;
    let outcomes = report["outcomes"].as_array().ok_or("cargo-mutants' report has no outcomes")?;
    let outcome = |outcome: &Value| {
        let name = outcome["scenario"]["Mutant"]["name"].as_str()?;
        let found = match outcome["summary"].as_str()? {
            "CaughtMutant" => Outcome::Caught,
            "Unviable" => Outcome::Unviable,
            // Missed, or out of time.
            _ => Outcome::Survived,
        };
        Some((name.to_owned(), found))
    };
    Ok(outcomes.iter().filter_map(outcome).collect())
}

/// A name as a regular expression that matches it.
fn escaped(name: &str) -> String {
    name.chars().flat_map(|c| ".+*?()|[]{}^$\\".contains(c).then_some('\\').into_iter().chain([c])).collect()
}

/// Is this file mutated?
pub fn owner(file: &Path) -> Option<&'static Mutated> {
    MUTATED.iter().find(|mutated| file.to_str().is_some_and(|file| file.starts_with(mutated.place)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_have_no_lines_and_tell_equal_changes_apart() {
        let names =
            ["a.rs:1:2: replace < with > in f", "a.rs:3:9: replace < with > in f", "a.rs:4:1: replace g with ()"];
        let mutants = labelled(&names.map(str::to_owned)).expect("names");
        let labels: Vec<_> = mutants.iter().map(|mutant| mutant.label.as_str()).collect();
        assert_eq!(
            labels,
            ["a.rs: replace < with > in f #1", "a.rs: replace < with > in f #2", "a.rs: replace g with ()"]
        );
        assert_eq!((mutants[1].file.as_str(), mutants[1].name.as_str()), ("a.rs", names[1]));
        assert!(labelled(&["nothing".to_owned()]).is_err());
    }

    #[test]
    fn a_report_tells_what_became_of_each() {
        let one = |name: &str, summary: &str| {
            format!("{{\"scenario\": {{\"Mutant\": {{\"name\": \"{name}\"}}}}, \"summary\": \"{summary}\"}}")
        };
        let list = [one("a", "CaughtMutant"), one("b", "MissedMutant"), one("c", "Timeout"), one("d", "Unviable")];
        let report =
            format!("{{\"outcomes\": [{{\"scenario\": \"Baseline\", \"summary\": \"Success\"}}, {}]}}", list.join(","));
        let found: Vec<_> = outcomes(&report).expect("a report").into_values().collect();
        assert_eq!(found, [Outcome::Caught, Outcome::Survived, Outcome::Survived, Outcome::Unviable]);
        assert!(outcomes("{}").is_err());
    }

    #[test]
    fn names_are_matched_as_they_are() {
        assert_eq!(escaped("a.rs:1: + with * in <impl A for B>::c"), "a\\.rs:1: \\+ with \\* in <impl A for B>::c");
    }

    #[test]
    fn slow_tests_are_for_what_they_see() {
        assert_eq!(slow("stampfly-mode/src/stage/active.rs"), Some(&["entered_once_and_left_once"][..]));
        assert_eq!(slow("stampfly-mode/src/failsafe/motion.rs"), None);
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the repository");
        assert!(SLOW.iter().flat_map(|(_, places)| *places).all(|place| root.join(place).exists()));
    }

    #[test]
    fn the_copy_has_few_packages() {
        let text = "[workspace]\nresolver = \"3\"\nmembers = [\"a\"]\nexclude = [\"b\"]\ndefault-members = [\"a\"]\n\n[profile.test]\nopt-level = 2\n";
        let expected = "[workspace]\nresolver = \"3\"\nmembers = [\"stampfly-types\", \"stampfly-control\", \"stampfly-mode\"]\n\n[profile.test]\nopt-level = 2\n";
        assert_eq!(manifest_of(text).as_deref(), Ok(expected));
        assert!(MUTATED.iter().all(|mutated| PACKAGES.contains(&mutated.package)));
    }

    #[test]
    fn only_what_decides_is_mutated() {
        let package = |file: &str| owner(Path::new(file)).map(|mutated| mutated.package);
        assert_eq!(package("stampfly-mode/src/arming.rs"), Some("stampfly-mode"));
        assert_eq!(package("stampfly-control/src/mixer/multirotor.rs"), Some("stampfly-control"));
        assert_eq!(package("stampfly-control/src/pid.rs"), None);
    }
}
