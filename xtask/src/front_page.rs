//! What a registry and a documentation site show of each published crate: is all of it there?

use crate::repository::{Failure, Library, Repository};
use std::fs;
use toml_edit::{DocumentMut, Item};

/// The most keywords that the registry takes, and the fewest by which a crate is found.
const KEYWORDS: std::ops::RangeInclusive<usize> = 3..=5;

/// What is missing.
pub fn failures(repository: &Repository) -> Result<Vec<Failure>, Failure> {
    let mut failures = Vec::new();
    for library in repository.libraries()?.iter().filter(|library| library.published) {
        let readme = repository.root.join(&library.folder).join("README.md");
        let readme = fs::read_to_string(&readme).map_err(|e| format!("{}: {e}", readme.display()))?;
        let missing = check(library, &repository.manifest(&library.folder)?, &readme);
        failures.extend(missing.into_iter().map(|missing| format!("{}: {missing}", library.folder.display())));
    }
    Ok(failures)
}

fn check(library: &Library, manifest: &DocumentMut, readme: &str) -> Vec<Failure> {
    let package = |key: &str| manifest.get("package").and_then(|package| package.get(key));
    let count = |key: &str| package(key).and_then(Item::as_array).map_or(0, |list| list.len());
    let on_site =
        package("metadata").and_then(|metadata| metadata.get("docs")?.get("rs")?.get("all-features")?.as_bool());
    let mut missing = Vec::new();
    if package("description").and_then(Item::as_str).is_none_or(str::is_empty) {
        missing.push("no description".to_owned());
    }
    if !KEYWORDS.contains(&count("keywords")) {
        missing.push("no three to five keywords of its own".to_owned());
    }
    if count("categories") == 0 {
        missing.push("no categories of its own".to_owned());
    }
    if on_site != Some(true) {
        missing.push("documentation sites are not told to show all features".to_owned());
    }
    let in_table = |feature: &&String| !readme.contains(&format!("| `{feature}` |"));
    missing.extend(
        library
            .features
            .iter()
            .filter(in_table)
            .map(|feature| format!("no line for the feature `{feature}` in README.md")),
    );
    missing
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_named() {
        let features = vec!["serde".to_owned()];
        let library = Library { name: "a".to_owned(), folder: "a".into(), bare_metal: true, published: true, features };
        let whole = "[package]\ndescription = \"A\"\nkeywords = [\"a\", \"b\", \"c\"]\ncategories = [\"d\"]\n\
                     [package.metadata.docs.rs]\nall-features = true\n";
        let found =
            |manifest: &str, readme: &str| check(&library, &manifest.parse().expect("a manifest"), readme).len();
        assert_eq!(found(whole, "| `serde` | states |"), 0);
        assert_eq!(found(whole, "serde"), 1);
        assert_eq!(found("[package]\nkeywords.workspace = true\n", ""), 5);
    }
}
