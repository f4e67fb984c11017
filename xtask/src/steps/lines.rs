//! `lines`: is a vehicle still little more than its tables?
//!
//! What several vehicles need belongs in a crate of its own. That a vehicle's folder grows is how one sees that it did not get
//! there, so each has a limit. Lines of sources count, empty ones and comments included; tests, firmware packages and the
//! simulation of the StampFly do not. How many lines name one sensor shows what a sensor costs.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture};
use std::fs;

/// Folders, what in them does not count, the word that a line has to name, the most lines, and the most files.
const LIMITS: [Limit; 6] = [
    Limit {
        folders: &["stampfly-board/src"],
        without: &["/simulation/", "/tests"],
        word: None,
        lines: 2_000,
        files: None,
    },
    Limit { folders: &["vehicles/rover"], without: &["/tests/"], word: None, lines: 1_500, files: None },
    // These two with what is around them in simulation.
    Limit { folders: &["vehicles/plane/src"], without: &[], word: None, lines: 1_700, files: None },
    Limit { folders: &["vehicles/stm32-quad/src"], without: &[], word: None, lines: 2_500, files: None },
    // What a vehicle asks of someone who begins, comments included.
    Limit { folders: &["examples/examples/own_vehicle.rs"], without: &[], word: None, lines: 200, files: None },
    Limit {
        folders: &["stampfly-board/src", "stampfly-host/src"],
        without: &["/tests"],
        word: Some("baro"),
        lines: 14,
        files: Some(7),
    },
];

struct Limit {
    folders: &'static [&'static str],
    without: &'static [&'static str],
    word: Option<&'static str>,
    lines: usize,
    files: Option<usize>,
}

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let mut failures = Vec::new();
    for limit in &LIMITS {
        let mut sources = repository.command("git");
        sources.args(["ls-files", "--cached", "--others", "--exclude-standard"]).args(limit.folders);
        let (sources, _) = capture(&mut sources)?;
        let counts = |file: &&str| file.ends_with(".rs") && !limit.without.iter().any(|part| file.contains(part));
        // A file that was removed without telling git is no source.
        let texts =
            sources.lines().filter(counts).filter_map(|file| fs::read_to_string(repository.root.join(file)).ok());
        let each: Vec<usize> = texts.map(|text| count(&text, limit.word)).filter(|count| *count > 0).collect();
        let (lines, files) = (each.iter().sum::<usize>(), each.len());
        let what = limit.word.map_or(String::new(), |word| format!(" that name `{word}`"));
        let most = limit.files.map_or(String::new(), |most| format!(" in {most} files"));
        let said = format!(
            "{}: {lines} lines{what} in {files} files; at most {}{most}",
            limit.folders.join(", "),
            limit.lines
        );
        println!("{said}");
        if lines == 0 || lines > limit.lines || limit.files.is_some_and(|most| files > most) {
            failures.push(said);
        }
    }
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n  ")) }
}

/// Lines before the tests of a file, or those of them that name the word or the sensor's topic.
fn count(text: &str, word: Option<&str>) -> usize {
    let is_word = |letter: char| letter.is_alphanumeric() || letter == '_';
    let names = |line: &&str| {
        word.is_none_or(|word| {
            let line = line.to_lowercase();
            line.split(|letter| !is_word(letter)).any(|part| part.strip_prefix("sensor_").unwrap_or(part) == word)
        })
    };
    text.lines().take_while(|line| *line != "#[cfg(test)]").filter(names).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_do_not_count_and_words_are_whole() {
        let text = "//! Baro.\nuse sensor_baro;\nlet barometer = 1;\n\n#[cfg(test)]\nmod tests { baro }\n";
        assert_eq!((count(text, None), count(text, Some("baro"))), (4, 2));
    }
}
