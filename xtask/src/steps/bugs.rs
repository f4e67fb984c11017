//! `bugs`: does the campaign of faults find bugs that vehicles had in the field?
//!
//! `xtask/bugs.toml` lists them. A copy of the sources gets all of them at once, each asleep until an environment variable
//! names it, and is built once. For every bug its flight is flown twice: with the bug it has to end as recorded, without it
//! well. `--fix` flies the campaign with each bug that has no such flight, and records the first that shows it. Names after
//! that restrict it to these bugs.

use crate::arguments::Arguments;
use crate::parallel;
use crate::reinserted::flight::{Copy, copy};
use crate::reinserted::list::{Bug, FILE, List};
use crate::reinserted::{page, tree};
use crate::repository::{Failure, Repository};
use std::time::Instant;

/// As many have to be found.
const LEAST: usize = 30;

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let mut list = List::read(repository)?;
    let chosen = |bug: &Bug| arguments.rest.is_empty() || arguments.rest.contains(&bug.name);
    if let Some(unknown) = arguments.rest.iter().find(|name| !list.bugs.iter().any(|bug| bug.name == **name)) {
        return Err(format!("no bug is called `{unknown}`"));
    }
    let begun = Instant::now();
    let copy = copy(&tree::built(repository, &list.bugs)?, repository);
    println!("the copy with {} bugs was built in {:.0} s", list.bugs.len(), begun.elapsed().as_secs_f64());
    let flown: Vec<Bug> = list.bugs.iter().filter(|bug| chosen(bug)).cloned().collect();
    let recorded: Vec<&Bug> = flown.iter().filter(|bug| bug.flight.is_some()).collect();
    let verdicts = parallel::each(&recorded, parallel::cores(), |bug| shown(repository, &copy, bug));
    println!("{:<40} {:<16} {:<16} flight", "bug", "ends with it", "without it");
    let mut failures = Vec::new();
    for (bug, verdict) in recorded.iter().zip(&verdicts) {
        match verdict {
            Ok(ends) => println!(
                "{:<40} {:<16} {:<16} {}",
                bug.name,
                ends[0].as_deref().unwrap_or("well"),
                ends[1].as_deref().unwrap_or("well"),
                bug.flight.as_deref().unwrap_or_default()
            ),
            Err(failure) => println!("{:<40} {failure}", bug.name),
        }
        failures.extend(judged(bug, verdict).err());
    }
    if arguments.fix {
        failures = fix(repository, &copy, &mut list, &flown, &verdicts)?;
        let (document, begin, end) = page::PLACE;
        repository.fill(document, begin, end, &page::table(&list.bugs))?;
    }
    let found = list.bugs.iter().filter(|bug| bug.flight.is_some()).count();
    println!("{found} of {} bugs have a flight; {:.0} s", list.bugs.len(), begun.elapsed().as_secs_f64());
    let unsaid = list.bugs.iter().filter(|bug| bug.flight.is_none() && bug.missed.is_none());
    failures.extend(unsaid.map(|bug| format!("{}: no flight; `cargo xtask bugs --fix` looks for one", bug.name)));
    if found < LEAST {
        failures.push(format!("{found} bugs are found; {LEAST} have to be"));
    }
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n  ")) }
}

/// How a bug's flight ends with it and without it.
type Ends = [Option<String>; 2];

fn shown(repository: &Repository, copy: &Copy, bug: &Bug) -> Result<Ends, Failure> {
    let line = bug.flight.as_deref().unwrap_or_default();
    Ok([copy.fly(repository, line, Some(bug))?, copy.fly(repository, line, None)?])
}

/// Is the bug found, as it is recorded?
fn judged(bug: &Bug, verdict: &Result<Ends, Failure>) -> Result<(), Failure> {
    let name = &bug.name;
    let recorded = bug.ends.as_deref().unwrap_or_default();
    match verdict {
        Err(failure) => Err(format!("{name}: {failure}")),
        Ok([_, Some(without)]) => Err(format!("{name}: without it the flight ends wrong, too: {without}")),
        Ok([None, _]) => Err(format!("{name}: not found: the flight ends well with it")),
        Ok([Some(ends), _]) if ends != recorded => {
            Err(format!("{name}: ends {ends}, in {FILE} {recorded}; `cargo xtask bugs --fix` records it"))
        }
        Ok(_) => Ok(()),
    }
}

/// Records how flights end now, and looks for flights where none shows the bug. What is not found is a failure, unless it is
/// known to be.
fn fix(
    repository: &Repository,
    copy: &Copy,
    list: &mut List,
    bugs: &[Bug],
    verdicts: &[Result<Ends, Failure>],
) -> Result<Vec<Failure>, Failure> {
    let (mut failures, mut verdicts) = (Vec::new(), verdicts.iter());
    for bug in bugs {
        let verdict = if bug.flight.is_some() { verdicts.next() } else { None };
        let found = match (verdict, &bug.flight) {
            (Some(Ok([Some(ends), None])), Some(flight)) => Some((flight.clone(), ends.clone())),
            _ if bug.missed.is_some() && bugs.len() > 1 => continue,
            _ => {
                let found = copy.search(repository, bug)?;
                match &found {
                    Some((flight, ends)) => println!("{}: {ends}: {flight}", bug.name),
                    None => failures.push(format!("{}: no flight of the campaign shows it", bug.name)),
                }
                found
            }
        };
        list.record(&bug.name, found.as_ref().map(|(flight, ends)| (flight.as_str(), ends.as_str())));
        // A search takes minutes; what was found is kept when it is broken off.
        list.write()?;
    }
    Ok(failures)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bug_has_to_end_as_recorded_and_well_without_it() {
        let bug = Bug { name: "x".into(), flight: Some("f".into()), ends: Some("crashed".into()), ..Bug::default() };
        let ends = |with: Option<&str>, without: Option<&str>| {
            judged(&bug, &Ok([with, without].map(|ends| ends.map(str::to_owned))))
        };
        assert_eq!(ends(Some("crashed"), None), Ok(()));
        assert!(ends(None, None).is_err_and(|e| e.contains("not found")));
        assert!(ends(Some("I10"), None).is_err_and(|e| e.contains("--fix")));
        assert!(ends(Some("crashed"), Some("I10")).is_err_and(|e| e.contains("without it")));
        assert!(judged(&bug, &Err("no program".into())).is_err());
    }
}
