//! Does each published crate's changelog know the version that the crate has, and a place for what comes next?

use crate::repository::{Failure, Repository};
use std::fs;

/// In place of the date of a version that has a number because something broke, but is not released.
const PREPARED: &str = "in preparation";

/// What is wrong with the changelogs.
pub fn failures(repository: &Repository) -> Result<Vec<Failure>, Failure> {
    let version = repository.version()?;
    let mut failures = Vec::new();
    for library in repository.libraries()?.iter().filter(|library| library.published) {
        let path = library.folder.join("CHANGELOG.md");
        let text = fs::read_to_string(repository.root.join(&path)).map_err(|e| format!("{}: {e}", path.display()))?;
        failures.extend(check(&text, &version).err().map(|e| format!("{}: {e}", path.display())));
    }
    Ok(failures)
}

/// One changelog: first what is not released, then the versions, the newest of them the crate's own.
fn check(text: &str, version: &str) -> Result<(), Failure> {
    let mut headings = text.lines().filter_map(|line| line.strip_prefix("## "));
    if headings.next() != Some("Unreleased") {
        return Err("the first heading is not `Unreleased`".to_owned());
    }
    let newest = headings.next().and_then(|heading| heading.split_once(" – "));
    match newest {
        Some((newest, date)) if newest == version && (is_date(date) || date == PREPARED) => Ok(()),
        _ => Err(format!(
            "the heading after `Unreleased` is not `{version} – YEAR-MONTH-DAY` or `{version} – {PREPARED}`"
        )),
    }
}

/// As in 2026-11-21.
fn is_date(text: &str) -> bool {
    let parts: Vec<&str> = text.split('-').collect();
    let digits = |part: &&str| part.chars().all(|digit| digit.is_ascii_digit());
    parts.iter().all(digits) && parts.iter().map(|part| part.len()).eq([4, 2, 2])
}

#[cfg(test)]
mod tests {
    use super::check;

    #[test]
    fn the_version_of_the_crate_comes_first() {
        let page = |headings: &str| format!("# Changelog\n\n{headings}\n- Something.\n");
        assert_eq!(check(&page("## Unreleased\n\n## 0.2.0 – 2026-11-26\n\n### Added"), "0.2.0"), Ok(()));
        assert_eq!(check(&page("## Unreleased\n\n## 0.3.0 – in preparation\n\n### Removed"), "0.3.0"), Ok(()));
        for wrong in [
            "## 0.2.0 – 2026-11-26",
            "## Unreleased",
            "## Unreleased\n\n## 0.1.0 – 2026-11-21\n\n## 0.2.0 – 2026-11-26",
            "## Unreleased\n\n## 0.2.0",
            "## Unreleased\n\n## 0.2.0 – soon",
        ] {
            assert!(check(&page(wrong), "0.2.0").is_err(), "{wrong}");
        }
    }
}
