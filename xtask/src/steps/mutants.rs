//! `mutants`: does a test fail when the code that decides whether motors turn is changed?
//!
//! Each mutant is one small change: `<` becomes `<=`, `&&` becomes `||`, a function returns nothing. A test of the same crate has to fail
//! with it. One that survives is a missing test, or superfluous code, or cannot be told from the program by anything that
//! matters; `xtask/mutants.toml` lists the last kind and says why. The step fails on a survivor that is not listed, and on a
//! listed one that a test catches or that is no more.
//!
//! | command | runs |
//! |---|---|
//! | `cargo xtask mutants` | the sample named in the list, in about a minute; says which files have changed since they were run |
//! | `cargo xtask mutants NAME...` | every mutant of the files whose path contains one of the names, some seconds each |
//! | `cargo xtask mutants all` | every mutant of every file: hours |
//!
//! What was caught once is not run again until the code of its package changes, and what survived not until its code or tests do, so a run
//! that was broken off goes on where it was. A test that was removed is noticed when `mutants/outcomes` in cargo's folder is. `--fix` records
//! the figures of the files that passed, in the list and in `docs/explain/safety.md`.

use crate::arguments::Arguments;
use crate::mutation::list::{FILE, Figures, List, Record, digest};
use crate::mutation::page;
use crate::mutation::tool::{MUTATED, Mutant, Mutated, Outcome, Tool, owner};
use crate::repository::{Failure, Repository};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let list = List::read(repository)?;
    let tool = Tool::ready(repository)?;
    let mut mutants = Vec::new();
    for mutated in &MUTATED {
        mutants.extend(tool.list(mutated)?);
    }
    let gone = gone(&list, &mutants);
    if !gone.is_empty() {
        return Err(format!("{FILE} names mutants that are no more:\n  {}", gone.join("\n  ")));
    }
    match arguments.rest.as_slice() {
        [] => sample(&tool, &list, &mutants),
        names => files(repository, &tool, &list, &mutants, names, arguments.fix),
    }
}

/// Runs the mutants that the list names for it.
fn sample(tool: &Tool, list: &List, mutants: &[Mutant]) -> Result<(), Failure> {
    let begun = Instant::now();
    let mut survivors = Vec::new();
    for mutated in &MUTATED {
        let named = |mutant: &&Mutant| list.sample.contains(&mutant.label) && is_of(mutated, mutant);
        let chosen: Vec<&Mutant> = mutants.iter().filter(named).collect();
        if !chosen.is_empty() {
            tool.baseline(mutated, false)?;
            let outcomes = tool.run(mutated, &chosen, false)?;
            survivors.extend(
                outcomes.into_iter().filter(|(_, outcome)| *outcome != Outcome::Caught).map(|(label, _)| label),
            );
        }
    }
    println!("{} mutants of {}; {:.0} s", list.sample.len(), mutants.len(), begun.elapsed().as_secs_f64());
    for file in by_file(mutants).keys() {
        let recorded = list.records.iter().find(|record| record.file == *file);
        if recorded.map(|record| &record.digest) != Some(&tool.digest(file)?) {
            let since = if recorded.is_some() { "has changed since" } else { "has no record that" };
            println!("{file} {since} all of its mutants were run");
        }
    }
    if survivors.is_empty() { Ok(()) } else { Err(format!("no test catches\n  {}", survivors.join("\n  "))) }
}

/// Runs all mutants of the files that are meant.
fn files(
    repository: &Repository,
    tool: &Tool,
    list: &List,
    mutants: &[Mutant],
    names: &[String],
    fix: bool,
) -> Result<(), Failure> {
    let meant = |file: &str| names.iter().any(|name| name == "all" || file.contains(name.as_str()));
    let by_file = by_file(mutants);
    let chosen: Vec<_> = by_file.iter().filter(|(file, _)| meant(file)).collect();
    if chosen.is_empty() {
        return Err(format!("no file with mutants has {names:?} in its path"));
    }
    println!("{:<44} {:>7} {:>7} {:>9} {:>8} {:>7}", "file", "mutants", "caught", "explained", "unviable", "seconds");
    let (mut failures, mut tested) = (Vec::new(), Vec::new());
    for (file, mutants) in chosen {
        let mutated = owner(Path::new(file)).ok_or_else(|| format!("{file} is of no package"))?;
        let begun = Instant::now();
        let mut memory = Memory::of(repository, mutated, file)?;
        let left: Vec<&Mutant> = mutants.iter().copied().filter(|mutant| !memory.knows(&mutant.label)).collect();
        if !left.is_empty() {
            if !tested.contains(&mutated.package) {
                tool.baseline(mutated, true)?;
                tested.push(mutated.package);
            }
            memory.outcomes.extend(tool.run(mutated, &left, true)?);
            memory.write()?;
        }
        let (figures, wrong) = judged(list, mutants, &memory.outcomes);
        let Figures { mutants, caught, explained, unviable } = figures;
        let seconds = begun.elapsed().as_secs_f64();
        println!("{file:<44} {mutants:>7} {caught:>7} {explained:>9} {unviable:>8} {seconds:>7.0}");
        if wrong.is_empty() && fix {
            // Hours pass, in which somebody may have edited the list; and what has been run is kept when the rest is broken off.
            let mut list = List::read(repository)?;
            list.record(Record { file: (*file).to_owned(), figures, digest: tool.digest(file)? });
            list.write()?;
            let (document, begin, end) = page::PLACE;
            repository.fill(document, begin, end, &page::table(&list))?;
        }
        wrong.iter().for_each(|wrong| println!("  {wrong}"));
        failures.extend(wrong);
    }
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n  ")) }
}

/// What became of the mutants of a file, and what of it is wrong.
fn judged(list: &List, mutants: &[&Mutant], outcomes: &BTreeMap<String, Outcome>) -> (Figures, Vec<Failure>) {
    let (mut figures, mut wrong) = (Figures { mutants: mutants.len(), ..Figures::default() }, Vec::new());
    for mutant in mutants {
        match (outcomes.get(&mutant.label), list.why(&mutant.label)) {
            (Some(Outcome::Caught), None) => figures.caught += 1,
            (Some(Outcome::Unviable), None) => figures.unviable += 1,
            (Some(Outcome::Survived), Some(_)) => figures.explained += 1,
            (Some(Outcome::Survived), None) => {
                wrong.push(format!("no test catches {}\n    {}", mutant.label, mutant.name))
            }
            (Some(_), Some(_)) => wrong.push(format!("explained in {FILE}, and does not survive: {}", mutant.label)),
            (None, _) => wrong.push(format!("not run: {}", mutant.label)),
        }
    }
    (figures, wrong)
}

/// Labels in the list that no mutant has.
fn gone(list: &List, mutants: &[Mutant]) -> Vec<String> {
    let labels = list.explained.keys().chain(&list.sample);
    labels.filter(|label| !mutants.iter().any(|mutant| mutant.label == **label)).cloned().collect()
}

fn is_of(mutated: &Mutated, mutant: &Mutant) -> bool {
    mutant.file.starts_with(mutated.place)
}

fn by_file(mutants: &[Mutant]) -> BTreeMap<&str, Vec<&Mutant>> {
    let mut files: BTreeMap<&str, Vec<&Mutant>> = BTreeMap::new();
    for mutant in mutants {
        files.entry(&mutant.file).or_default().push(mutant);
    }
    files
}

/// What became of the mutants of a file when the code of its package was as it is now. A test that was added since catches no fewer, so
/// only survivors are run again when tests change.
#[derive(Debug)]
struct Memory {
    path: PathBuf,
    /// Of the package's code without its tests, and of all of it.
    digests: [String; 2],
    outcomes: BTreeMap<String, Outcome>,
}

/// The words of the file of a [`Memory`].
const WORDS: [(Outcome, &str); 3] =
    [(Outcome::Caught, "caught"), (Outcome::Survived, "survived"), (Outcome::Unviable, "unviable")];

impl Memory {
    fn of(repository: &Repository, mutated: &Mutated, file: &str) -> Result<Self, Failure> {
        let io = |e: std::io::Error| format!("{}: {e}", mutated.package);
        let folder = repository.root.join(mutated.package);
        let (mut folders, mut files) = (vec![folder], Vec::new());
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).map_err(io)? {
                let path = entry.map_err(io)?.path();
                if path.is_dir() { folders.push(path) } else { files.push(path) }
            }
        }
        files.retain(|file| file.extension().is_some_and(|extension| extension == "rs" || extension == "toml"));
        files.sort();
        let (mut code, mut all) = (String::new(), String::new());
        for file in files {
            let text = fs::read_to_string(&file).map_err(io)?;
            code += without_tests(&file, &text);
            all += &text;
        }
        let place = repository.target("mutants/outcomes").join(file.replace('/', "-"));
        let digests = [code, all].map(|text| digest(text.as_bytes()));
        Ok(Self::read(place.with_extension("txt"), digests))
    }

    fn read(path: PathBuf, digests: [String; 2]) -> Self {
        let text = fs::read_to_string(&path).unwrap_or_default();
        let mut lines = text.lines();
        let mut digest = || lines.next().unwrap_or_default();
        let [same_code, same] = [digest() == digests[0], digest() == digests[1]];
        let outcome = |line: &str| {
            let (word, label) = line.split_once(' ')?;
            let (outcome, _) = WORDS.iter().find(|(_, known)| *known == word)?;
            Some((label.to_owned(), *outcome))
        };
        let mut outcomes: BTreeMap<_, _> = lines.filter_map(outcome).collect();
        outcomes.retain(|_, outcome| same || (same_code && *outcome != Outcome::Survived));
        Self { path, digests, outcomes }
    }

    fn knows(&self, label: &str) -> bool {
        self.outcomes.contains_key(label)
    }

    fn write(&self) -> Result<(), Failure> {
        let io = |e: std::io::Error| format!("{}: {e}", self.path.display());
        let mut text = self.digests.join("\n");
        for (label, outcome) in &self.outcomes {
            let word = WORDS.iter().find(|(known, _)| known == outcome).map_or("", |(_, word)| word);
            text += &format!("\n{word} {label}");
        }
        fs::create_dir_all(self.path.parent().unwrap_or(&self.path)).map_err(io)?;
        fs::write(&self.path, text).map_err(io)
    }
}

/// A source file without what only tests need.
fn without_tests<'t>(file: &Path, text: &'t str) -> &'t str {
    let is_test = file.ends_with("tests.rs") || file.components().any(|part| part.as_os_str() == "tests");
    if is_test { "" } else { text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default().trim_end() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mutants() -> Vec<Mutant> {
        let mutant =
            |name: &str| Mutant { name: format!("f:1:1: {name}"), file: "f".into(), label: format!("f: {name}") };
        ["caught", "equal", "missed", "bad"].map(mutant).into()
    }

    fn list(explained: &[&str]) -> List {
        let names = explained.iter().map(|name| format!("\"f: {name}\"")).collect::<Vec<_>>().join(",");
        List::parse(&format!("[[explained]]\nwhy = \"w\"\nmutants = [{names}]\n"), PathBuf::new()).expect("a list")
    }

    fn wrong(explained: &[&str], missed: Outcome) -> (Figures, Vec<Failure>) {
        use Outcome::{Caught, Survived, Unviable};
        let mutants = mutants();
        let outcomes =
            mutants.iter().map(|mutant| mutant.label.clone()).zip([Caught, Survived, missed, Unviable]).collect();
        judged(&list(explained), &mutants.iter().collect::<Vec<_>>(), &outcomes)
    }

    #[test]
    fn a_survivor_has_to_be_explained_and_nothing_else_may_be() {
        let figures = Figures { mutants: 4, caught: 2, explained: 1, unviable: 1 };
        assert_eq!(wrong(&["equal"], Outcome::Caught), (figures, vec![]));
        let (_, missed) = wrong(&["equal"], Outcome::Survived);
        assert!(missed.len() == 1 && missed[0].contains("no test catches f: missed"), "{missed:?}");
        let (_, caught) = wrong(&["equal", "caught"], Outcome::Caught);
        assert!(caught.len() == 1 && caught[0].contains("does not survive: f: caught"), "{caught:?}");
    }

    #[test]
    fn what_is_not_run_is_not_well() {
        let (_, wrong) = judged(&list(&[]), &mutants().iter().collect::<Vec<_>>(), &BTreeMap::new());
        assert_eq!(wrong.len(), 4);
    }

    #[test]
    fn a_listed_mutant_that_is_no_more_is_named() {
        assert_eq!(gone(&list(&["equal", "other"]), &mutants()), ["f: other"]);
    }

    #[test]
    fn what_survived_is_run_again_with_other_tests_and_all_of_it_with_other_code() {
        let path = std::env::temp_dir().join(format!("stampfly-mutants-{}.txt", std::process::id()));
        let read = |digests: [&str; 2]| Memory::read(path.clone(), digests.map(str::to_owned));
        let mut memory = read(["1", "2"]);
        assert!(memory.outcomes.is_empty());
        memory.outcomes = [("f: a".to_owned(), Outcome::Caught), ("f: b #2".to_owned(), Outcome::Survived)].into();
        memory.write().expect("written");
        let knows = |digests| ["f: a", "f: b #2"].map(|label| read(digests).knows(label));
        assert_eq!(knows(["1", "2"]), [true; 2]);
        assert_eq!(knows(["1", "3"]), [true, false]);
        assert_eq!(knows(["3", "2"]), [true; 2], "the same text altogether");
        assert_eq!(knows(["3", "3"]), [false; 2]);
        fs::remove_file(path).expect("the file");
    }

    #[test]
    fn tests_are_no_code() {
        let code = |file: &str| without_tests(Path::new(file), "code\n#[cfg(test)]\nmod tests {\n}\n").len();
        assert_eq!([code("src/a.rs"), code("src/tests.rs"), code("src/tests/a.rs")], [4, 0, 0]);
    }
}
