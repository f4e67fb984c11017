//! `constants`: no constant of the StampFly in a generic crate.
//!
//! A generic crate serves any vehicle; an airframe is a value that the vehicle's crate passes in. What counts as a constant of
//! the StampFly is listed in `xtask/constants.toml`: parts of identifiers and numbers. Sources and tests of every library
//! are searched, except those of the vehicles; comments and texts are not. What is still there is listed in the same
//! file; an entry that matches nothing fails as well, so the list can only shrink.

use crate::arguments::Arguments;
use crate::repository::{Failure, Library, Repository, VEHICLES, capture};
use proc_macro2::{TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use toml_edit::{DocumentMut, Item, Table};

const LIST: &str = "xtask/constants.toml";
/// Folders of a crate that are searched.
const FOLDERS: [&str; 2] = ["src", "tests"];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let text = fs::read_to_string(repository.root.join(LIST)).map_err(|e| format!("{LIST}: {e}"))?;
    let list = List::parse(&text).map_err(|e| format!("{LIST}: {e}"))?;
    let libraries = repository.libraries()?;
    let crate_names: BTreeSet<String> = libraries.iter().map(|library| library.name.replace('-', "_")).collect();
    let is_generic =
        |library: &&Library| !library.folder.starts_with(VEHICLES) && !list.vehicles.contains(&library.name);
    let (mut files, mut found) = (0, BTreeMap::new());
    for library in libraries.iter().filter(is_generic) {
        for folder in FOLDERS.map(|folder| library.folder.join(folder)) {
            let mut sources = repository.command("git");
            sources.args(["ls-files", "--cached", "--others", "--exclude-standard"]).arg(folder);
            let (sources, _) = capture(&mut sources)?;
            for file in sources.lines().filter(|file| file.ends_with(".rs")) {
                // A file that was removed without telling git is no source.
                let Ok(text) = fs::read_to_string(repository.root.join(file)) else { continue };
                files += 1;
                let hits = list.search(&text, &crate_names).map_err(|e| format!("{file}: {e}"))?;
                if !hits.is_empty() {
                    found.insert(file.to_owned(), hits);
                }
            }
        }
    }
    println!("{files} files of generic crates, constants of a vehicle in {}", found.len());
    let failures = list.compare(&found);
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n  ")) }
}

/// What was found in a file: each word with the lines it stands in.
type Hits = BTreeMap<String, BTreeSet<usize>>;

/// The list of constants, and where they are allowed for now.
struct List {
    /// Crates that are not searched.
    vehicles: BTreeSet<String>,
    /// Parts of identifiers, in small letters.
    identifiers: Vec<String>,
    /// Numbers and their names.
    numbers: Vec<(String, f64)>,
    /// Words allowed in a file.
    allowed: BTreeMap<String, BTreeSet<String>>,
}

impl List {
    fn parse(text: &str) -> Result<Self, Failure> {
        let document: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| e.to_string())?;
        let words = |item: &Item| -> Option<Vec<String>> {
            item.as_array()?.iter().map(|word| Some(word.as_str()?.to_owned())).collect()
        };
        let list = |name: &str| document.get(name).and_then(words).ok_or_else(|| format!("no list of texts `{name}`"));
        let table =
            |name: &str| document.get(name).and_then(Item::as_table).ok_or_else(|| format!("no table `{name}`"));
        let number = |(name, item): (&str, &Item)| {
            let number = item.as_float().ok_or_else(|| format!("`{name}` is no number"))?;
            Ok::<_, Failure>((name.to_owned(), number))
        };
        let allowed = |table: &Table| {
            table
                .iter()
                .map(|(file, item)| {
                    let words = words(item).ok_or_else(|| format!("no list of texts for {file}"))?;
                    Ok::<_, Failure>((file.to_owned(), words.into_iter().collect::<BTreeSet<_>>()))
                })
                .collect::<Result<BTreeMap<_, _>, _>>()
        };
        Ok(Self {
            vehicles: list("vehicles")?.into_iter().collect(),
            identifiers: list("identifiers")?,
            numbers: table("numbers")?.iter().map(number).collect::<Result<_, _>>()?,
            allowed: allowed(table("allowed")?)?,
        })
    }

    /// Constants in a source.
    fn search(&self, text: &str, crate_names: &BTreeSet<String>) -> Result<Hits, Failure> {
        let tokens: TokenStream = text.parse().map_err(|e| format!("{e}"))?;
        let mut hits = Hits::new();
        self.search_tokens(tokens, crate_names, &mut hits);
        Ok(hits)
    }

    fn search_tokens(&self, tokens: TokenStream, crate_names: &BTreeSet<String>, hits: &mut Hits) {
        for token in tokens {
            let line = token.span().start().line;
            let word = match token {
                TokenTree::Group(group) => {
                    self.search_tokens(group.stream(), crate_names, hits);
                    continue;
                }
                TokenTree::Ident(ident) => {
                    let name = ident.to_string();
                    let small = name.to_lowercase();
                    let is_hit =
                        !crate_names.contains(&name) && self.identifiers.iter().any(|part| small.contains(part));
                    is_hit.then_some(name)
                }
                TokenTree::Literal(literal) => {
                    let number = number(&literal.to_string());
                    let hit = self.numbers.iter().find(|(_, listed)| Some(*listed) == number);
                    hit.map(|(name, _)| name.clone())
                }
                TokenTree::Punct(_) => None,
            };
            if let Some(word) = word {
                hits.entry(word).or_default().insert(line);
            }
        }
    }

    /// Constants that are not allowed, and permissions that nothing needs.
    fn compare(&self, found: &BTreeMap<String, Hits>) -> Vec<Failure> {
        let mut failures = Vec::new();
        for (file, hits) in found {
            let is_allowed = |word: &String| self.allowed.get(file).is_some_and(|words| words.contains(word));
            for (word, lines) in hits.iter().filter(|(word, _)| !is_allowed(word)) {
                let lines: Vec<String> = lines.iter().map(usize::to_string).collect();
                failures.push(format!("{file}: `{word}` of the StampFly in line {}", lines.join(", ")));
            }
        }
        for (file, words) in &self.allowed {
            let is_found = |word: &String| found.get(file).is_some_and(|hits| hits.contains_key(word));
            let gone = words.iter().filter(|word| !is_found(word));
            failures.extend(gone.map(|word| format!("{file}: no `{word}` is left, remove it from {LIST}")));
        }
        failures
    }
}

/// The value of a numeric literal, whatever its suffix.
fn number(literal: &str) -> Option<f64> {
    let digits = literal.replace('_', "");
    digits.trim_end_matches("f32").trim_end_matches("f64").parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "vehicles = []\nidentifiers = [\"stampfly\"]\n[numbers]\nmass = 0.0368\na = 6.7e-4\n\
                        [allowed]\n\"old.rs\" = [\"mass\", \"STAMPFLY_MASS\"]\n";

    fn words(source: &str) -> Vec<String> {
        let list = List::parse(TEXT).expect("a list");
        let hits = list.search(source, &["stampfly_types".to_owned()].into()).expect("tokens");
        hits.into_keys().collect()
    }

    #[test]
    fn constants_are_found_in_code_only() {
        assert_eq!(words("fn f() { Mixer::stampfly() }"), ["stampfly"]);
        assert_eq!(words("const STAMPFLY_MASS: f32 = 0.036_8f32;"), ["STAMPFLY_MASS", "mass"]);
        assert_eq!(words("const A: [f64; 1] = [-6.7e-4];"), ["a"]);
        assert!(
            words("/// The StampFly weighs 0.0368 kg.\nuse stampfly_types::Vec3; const B: &str = \"stampfly 0.0368\";")
                .is_empty()
        );
        assert!(words("const C: f32 = 0.03681;").is_empty());
    }

    #[test]
    fn new_constants_and_stale_permissions_fail() {
        let list = List::parse(TEXT).expect("a list");
        let found = |file: &str, words: &[&str]| {
            let hits = words.iter().map(|word| ((*word).to_owned(), [1].into())).collect();
            BTreeMap::from([(file.to_owned(), hits)])
        };
        assert!(list.compare(&found("old.rs", &["mass", "STAMPFLY_MASS"])).is_empty());
        assert_eq!(list.compare(&found("old.rs", &["mass"])).len(), 1);
        assert_eq!(list.compare(&found("new.rs", &["mass"])).len(), 3);
        assert!(List::parse("vehicles = []").is_err());
    }
}
