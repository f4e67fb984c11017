//! What campaigns found, `xtask/safety.json`: each campaign with its command line and the part of
//! its report that documents and checks need. Written by `cargo xtask safety`.

use crate::repository::{Failure, Repository, json};
use serde_json::{Map, Value, json};
use std::fs;
use std::path::Path;

/// Its path in the repository.
pub const FILE: &str = "xtask/safety.json";
/// What flights of the same flight stack have in common: it is recorded again when they are meant
/// to change.
const GOLDEN: &str = "stampfly-board/golden/flight.bin";

/// What is kept of a report.
const KEPT: [&str; 16] = [
    "flights",
    "idle",
    "cells",
    "cells_flown",
    "faulted",
    "nominal",
    "right_cuts",
    "needless_cuts",
    "cuts",
    "needless_by_fault",
    "never_began",
    "violations",
    "failures",
    "well",
    "unhindered",
    "while_sound",
];

/// A campaign, and what it found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Its name.
    pub name: String,
    /// The command that flies it.
    pub line: String,
    /// The program that flew it.
    pub program: Program,
    /// The kept part of what that printed.
    pub report: Value,
}

impl Found {
    fn json(&self) -> Value {
        let Self { name, line, program: Program { flown_by, golden }, report } = self;
        json!({ "name": name, "line": line, "flown_by": flown_by, "golden": golden, "report": report })
    }
}

/// The program that flew a campaign.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Program {
    /// Its version and commit.
    pub flown_by: String,
    /// Hash over the golden flight.
    pub golden: String,
}

/// All of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Results {
    /// In the order of the tables.
    pub results: Vec<Found>,
}

impl Results {
    /// Those of the repository.
    pub fn read(repository: &Repository) -> Result<Self, Failure> {
        let text = fs::read_to_string(repository.root.join(FILE)).map_err(|e| format!("{FILE}: {e}"))?;
        Self::parse(&json(&text)?)
            .ok_or_else(|| format!("{FILE} is no list of results: `cargo xtask safety` writes one"))
    }

    fn parse(value: &Value) -> Option<Self> {
        let text = |value: &Value, name: &str| Some(value.get(name)?.as_str()?.to_owned());
        let results = value.get("campaigns")?.as_array()?.iter().map(|campaign| {
            let report = campaign.get("report")?.clone();
            let program = Program { flown_by: text(campaign, "flown_by")?, golden: text(campaign, "golden")? };
            Some(Found { name: text(campaign, "name")?, line: text(campaign, "line")?, program, report })
        });
        Some(Self { results: results.collect::<Option<_>>()? })
    }

    /// Puts a result in the place of an earlier one, or behind the others.
    pub fn put(&mut self, name: &str, line: &str, program: &Program, report: &Value) {
        let kept = KEPT.iter().filter_map(|key| Some(((*key).to_owned(), report.get(*key)?.clone())));
        let hindered = report["cells"].as_array().map(|cells| ("hindered".to_owned(), hindered(cells)));
        let kept = kept.filter(|(_, value)| !value.is_array() || value != &report["cells"]).chain(hindered);
        let report = Value::Object(kept.collect::<Map<_, _>>());
        let result = Found { name: name.to_owned(), line: line.to_owned(), program: program.clone(), report };
        match self.results.iter_mut().find(|known| known.name == name) {
            Some(known) => *known = result,
            None => self.results.push(result),
        }
    }

    /// The campaign of this name.
    pub fn of(&self, name: &str) -> Option<&Found> {
        self.results.iter().find(|result| result.name == name)
    }

    /// Writes them.
    pub fn write(&self, repository: &Repository) -> Result<(), Failure> {
        let campaigns: Vec<_> = self.results.iter().map(Found::json).collect();
        let all = json!({ "campaigns": campaigns });
        let text = serde_json::to_string_pretty(&all).map_err(|e| e.to_string())? + "\n";
        fs::write(repository.root.join(FILE), text).map_err(|e| format!("{FILE}: {e}"))
    }
}

/// Of stick files in their modes, those in which a vehicle did something by itself while it was
/// sound.
fn hindered(cells: &[Value]) -> Value {
    let is_hindered = |cell: &&Value| cell["while_sound"].as_object().is_some_and(|counts| !counts.is_empty());
    let short = |cell: &Value| {
        let file =
            cell["file"].as_str().and_then(|file| Path::new(file).file_stem()).map(|name| name.to_string_lossy());
        json!({ "file": file, "mode": cell["mode"], "flights": cell["flights"], "while_sound": cell["while_sound"] })
    };
    cells.iter().filter(is_hindered).map(short).collect()
}

/// The hash over the golden flight: FNV-1a, which needs no crate and is the same everywhere.
pub fn golden(repository: &Repository) -> Result<String, Failure> {
    let bytes = fs::read(repository.root.join(GOLDEN)).map_err(|e| format!("{GOLDEN}: {e}"))?;
    let hash = bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325u64, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3));
    Ok(format!("{hash:016x}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_stick_files_those_are_kept_in_which_a_sound_vehicle_was_hindered() {
        let cell = |file: &str, while_sound: Value| json!({ "file": file, "mode": null, "flights": 3, "ended_well": 3, "while_sound": while_sound });
        let mut results = Results::default();
        let cells = json!([cell("sticks/a.csv", json!({})), cell("/data/b.csv", json!({ "IMPACT cut": 2 }))]);
        results.put(
            "sticks",
            "stampfly campaign --sticks",
            &Program::default(),
            &json!({ "flights": 6, "cells": cells }),
        );
        let kept = json!([{ "file": "b", "mode": null, "flights": 3, "while_sound": { "IMPACT cut": 2 } }]);
        assert_eq!(results.of("sticks").map(|found| &found.report), Some(&json!({ "flights": 6, "hindered": kept })));
        results.put("faults", "stampfly campaign --faults", &Program::default(), &json!({ "cells": 371 }));
        assert_eq!(results.of("faults").map(|found| &found.report), Some(&json!({ "cells": 371 })));
    }

    #[test]
    fn results_survive_their_file_and_keep_what_is_needed() {
        let mut results = Results::default();
        let [old, new] = ["1a", "2b"].map(|commit| Program { flown_by: commit.into(), golden: "0".into() });
        results.put("usual", "stampfly campaign", &old, &json!({ "flights": 3, "wall_s": 1.0, "out": "/tmp" }));
        results.put("drawn", "stampfly campaign --drawn", &old, &json!({ "flights": 4 }));
        results.put("usual", "stampfly campaign", &new, &json!({ "flights": 5 }));
        let names: Vec<_> = results.results.iter().map(|result| result.name.as_str()).collect();
        assert_eq!(names, ["usual", "drawn"], "in its place");
        assert_eq!(results.of("usual").map(|result| &result.report), Some(&json!({ "flights": 5 })));
        assert_eq!(results.results.iter().map(|found| &found.program).collect::<Vec<_>>(), [&new, &old]);
        let file = json!({
            "campaigns": [{ "name": "usual", "line": "x", "flown_by": "0.3.0", "golden": "0", "report": {} }],
        });
        assert_eq!(Results::parse(&file).map(|results| results.results.len()), Some(1));
        assert_eq!(Results::parse(&json!({ "campaigns": [{ "name": "usual" }] })), None);
    }
}
