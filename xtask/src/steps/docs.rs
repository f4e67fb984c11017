//! `docs`: do links, pictures, paths and generated tables of the documents agree with the repository?
//!
//! | checked | how |
//! |---|---|
//! | links into the repository, relative or by its address | the file exists, in a document the heading, too |
//! | links to lines (`#L12`) | refused: lines move; name the item in the text instead |
//! | pictures in `docs/images` | some document shows them |
//! | paths in the columns `home` and `test` of the table of requirements | they exist |
//! | figures in the README's column `figure` | a page that measures them has the same |
//! | the guide to tuning | it names every public field of the filter's configuration |
//! | listings after `<!-- listing: PATH#PART -->` | they are the same as in that program; `--fix` writes them |
//! | generated pages | they are what the program prints; `--fix` writes them |
//! | front pages of crates | description, keywords, categories, all features documented on sites and named in the README |
//! | changelogs | each published crate has an entry for its version, under one for what comes next |
//! | the tables of re-inserted bugs, mutants and controls | they are what the lists in `xtask/*.toml` say; `--fix` writes them |
//! | the tables of campaigns | they are what `xtask/safety.json` says; `--fix` writes them. When the golden flight has changed since they were flown, that is said |
//!
//! Every document is checked that git tracks or would add.

use super::program::stampfly;
use crate::arguments::Arguments;
use crate::changelog;
use crate::control::{self, List as Controls};
use crate::front_page;
use crate::listing;
use crate::mutation::list::List as Mutants;
use crate::mutation::page as mutants;
use crate::page::Page;
use crate::reinserted::list::List;
use crate::reinserted::page as bugs;
use crate::repository::{Failure, Repository, capture};
use crate::safety::page as safety;
use crate::safety::results::{Results, golden};
use std::fs;
use std::path::Path;

/// Addresses of the repository's files, for documents that are read elsewhere.
const ADDRESSES: &[&str] =
    &["https://github.com/stampfly/stampfly/blob/main/", "https://raw.githubusercontent.com/stampfly/stampfly/main/"];
/// Folder of the pictures.
const PICTURES: &str = "docs/images";
/// The table of requirements, and its columns that hold paths.
const REQUIREMENTS: (&str, [&str; 2]) = ("docs/reference/requirements.md", ["home", "test"]);
/// The front page, its column of figures, and the pages they are taken from.
const FIGURES: (&str, &str, [&str; 3]) =
    ("README.md", "figure", ["docs/reference/figures.md", "docs/reference/schedule.md", "docs/explain/safety.md"]);
/// The guide to tuning, and the structure whose fields it must name.
const TUNING: (&str, &str, &str) = ("docs/explain/estimation.md", "stampfly-eskf/src/config.rs", "EskfConfig");
/// The generated documents: the subcommand of `stampfly` that prints the table, and the text before it.
const GENERATED: &[(&str, &str, &str)] = &[
    (
        "docs/reference/topics.md",
        "topics",
        "# Topics\n\nThe topics of the StampFly, their publishers and their readers. Printed from the topic table in \
         `stampfly-board/src/topics.rs` by `cargo xtask docs --fix`. The log reads every topic.",
    ),
    (
        "docs/reference/schedule.md",
        "schedule",
        "# Schedule\n\nThe activations of the StampFly's runnables. Printed from the activation table in \
         `stampfly-board/src/schedule.rs` by `cargo xtask docs --fix`.\n\nThe budget is the most that an activation \
         may take on the target; `cargo xtask qemu` counts what it takes. The response is the longest time from a \
         runnable's trigger until it has published, provided that every runnable keeps to its budget: for `actuation` \
         that is the time from an inertial sample to the motors. The compiler computes it (`stampfly-bus/src/response.rs`) \
         and refuses a table in which a runnable could be late.",
    ),
    (
        "docs/reference/faults.md",
        "faults",
        "# Faults\n\nWhat can go wrong in a simulated flight of the StampFly: `stampfly fly --fault NAME[=VALUE]@WHEN[+SECONDS]`. \
         Printed from the table in `stampfly-board/src/simulation/faults/table.rs` by `cargo xtask docs --fix`.\n\nWHEN is \
         `calibration`, `ground`, `spool`, `takeoff`, `hover`, `move`, `flip`, `mode`, `chop`, `parameter`, `landing`, `touch`, or a number of seconds after \
         power-on; a fault lasts for SECONDS, or to the end of the flight. How a flight may end, from best to worst: refused, transparent, degraded, \
         landed, cut; crashed, flown-away and kept-on are never acceptable. The rules are in \
         `stampfly-board/src/simulation/judge/mod.rs`.",
    ),
    (
        "docs/reference/modes.md",
        "modes",
        "# Modes\n\nThe mode machine: its phases, who may do what, and what it asks for before arming. Printed from the tables of \
         `stampfly-mode` by `cargo xtask docs --fix`. A test explores every phase with every alert, every pair of alerts and every set of \
         up to three events in every order (`stampfly-mode/src/decision/tests.rs`).",
    ),
];

/// A table within a document: the subcommand of `stampfly` that prints it, and what is before and after it.
const WITHIN: (&str, (&str, &str, &str)) =
    ("doors", ("SECURITY.md", "<!-- doors: cargo xtask docs --fix -->\n", "<!-- end of doors -->"));

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let root = &repository.root;
    let (documents, _) =
        capture(repository.command("git").args(["ls-files", "--cached", "--others", "--exclude-standard", "*.md"]))?;
    let mut failures = Vec::new();
    let mut shown = Vec::new();
    // A document that was removed without telling git is no document.
    for name in documents.lines().filter(|name| root.join(name).exists()) {
        let page = read(root, name)?;
        let folder = root.join(name).parent().unwrap_or(root).to_owned();
        failures.extend(
            page.links
                .iter()
                .filter_map(|link| check(link, &page, &folder, root).err())
                .map(|e| format!("{name}: {e}")),
        );
        shown.extend(page.pictures);
        failures.extend(stale_listing(root, name, arguments.fix)?);
    }
    failures.extend(missing_pictures(root, &shown)?);
    failures.extend(missing_paths(root, &read(root, REQUIREMENTS.0)?));
    failures.extend(missing_figures(root)?);
    failures.extend(missing_fields(root)?);
    failures.extend(changelog::failures(repository)?);
    failures.extend(front_page::failures(repository)?);
    for (name, command, introduction) in GENERATED {
        let (table, _) = capture(stampfly(repository)?.args([command, "--markdown"]))?;
        let (path, page) = (root.join(name), format!("{introduction}\n\n{table}"));
        if fs::read_to_string(&path).is_ok_and(|committed| committed == page) {
            continue;
        }
        if arguments.fix {
            fs::write(&path, page).map_err(|e| format!("{name}: {e}"))?;
            println!("{name}: updated");
        } else {
            failures.push(format!("{name} is out of date; run `cargo xtask docs --fix`"));
        }
    }
    let bugs = bugs::table(&List::read(repository)?.bugs);
    let mutants = mutants::table(&Mutants::read(repository)?);
    let controls = Controls::read(repository)?.table();
    let (command, place) = WITHIN;
    let (doors, _) = capture(stampfly(repository)?.args([command, "--markdown"]))?;
    failures.extend(stale(repository, place, &format!("\n{doors}\n"), arguments.fix)?);
    for (place, table) in [(bugs::PLACE, bugs), (mutants::PLACE, mutants), (control::PLACE, controls)] {
        failures.extend(stale(repository, place, &table, arguments.fix)?);
    }
    let campaigns = Results::read(repository)?;
    for (place, table) in safety::tables(&campaigns) {
        failures.extend(stale(repository, place, &table, arguments.fix)?);
    }
    // Flown again in ten minutes, and not for every change of a gain: said, and no failure.
    let golden = golden(repository)?;
    let old = campaigns.results.iter().filter(|found| found.program.golden != golden);
    let old: Vec<_> = old.map(|found| format!("\"{}\"", found.name)).collect();
    if !old.is_empty() {
        println!(
            "docs/explain/safety.md: the golden flight has changed since these campaigns; `cargo xtask safety {}` flies them again",
            old.join(" ")
        );
    }
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n  ")) }
}

/// A generated table between two marks of a document, where it is not this one.
fn stale(
    repository: &Repository,
    (document, begin, end): (&str, &str, &str),
    table: &str,
    fix: bool,
) -> Result<Option<Failure>, Failure> {
    if repository.between(document, begin, end)? == table {
        return Ok(None);
    }
    if fix {
        repository.fill(document, begin, end, table)?;
        println!("{document}: updated");
        return Ok(None);
    }
    Ok(Some(format!("{document} is out of date; run `cargo xtask docs --fix`")))
}

/// A document whose listings differ from their programs.
fn stale_listing(root: &Path, name: &str, fix: bool) -> Result<Option<Failure>, Failure> {
    let text = |name: &str| fs::read_to_string(root.join(name)).map_err(|e| format!("{name}: {e}"));
    let page = text(name)?;
    let new = listing::refreshed(&page, text).map_err(|e| format!("{name}: {e}"))?;
    if new == page {
        return Ok(None);
    }
    if fix {
        fs::write(root.join(name), new).map_err(|e| format!("{name}: {e}"))?;
        println!("{name}: updated");
        return Ok(None);
    }
    Ok(Some(format!("{name}: a listing differs from its program; run `cargo xtask docs --fix`")))
}

fn read(root: &Path, name: &str) -> Result<Page, Failure> {
    Ok(Page::parse(&fs::read_to_string(root.join(name)).map_err(|e| format!("{name}: {e}"))?))
}

/// Does a link of this page lead somewhere?
fn check(link: &str, page: &Page, folder: &Path, root: &Path) -> Result<(), Failure> {
    let (folder, target) = match ADDRESSES.iter().find_map(|address| link.strip_prefix(address)) {
        Some(target) => (root, target),
        None if link.contains("://") || link.starts_with("mailto:") => return Ok(()),
        None => (folder, link),
    };
    let (file, anchor) = target.split_once('#').map_or((target, None), |(file, anchor)| (file, Some(anchor)));
    let path = folder.join(file);
    if !path.exists() {
        return Err(format!("link to {link}: there is no such file"));
    }
    let Some(anchor) = anchor else { return Ok(()) };
    let found = match file {
        "" => page.anchors.contains(anchor),
        _ if file.ends_with(".md") => read(folder, file)?.anchors.contains(anchor),
        _ => return Err(format!("link to {link}: lines move; link to the file and name the item")),
    };
    if found { Ok(()) } else { Err(format!("link to {link}: there is no such heading")) }
}

/// Pictures that no document shows.
fn missing_pictures(root: &Path, shown: &[String]) -> Result<Vec<Failure>, Failure> {
    let pictures = fs::read_dir(root.join(PICTURES)).map_err(|e| format!("{PICTURES}: {e}"))?;
    let names = pictures.filter_map(|picture| picture.ok()?.file_name().into_string().ok());
    let is_shown = |name: &String| shown.iter().any(|link| link.ends_with(&format!("images/{name}")));
    Ok(names.filter(|name| !is_shown(name)).map(|name| format!("{PICTURES}/{name} is in no document")).collect())
}

/// Paths in the table of requirements that do not exist.
fn missing_paths(root: &Path, page: &Page) -> Vec<Failure> {
    let (document, columns) = REQUIREMENTS;
    let paths = page.cells.iter().filter(|(column, _)| columns.contains(&column.as_str())).map(|(_, path)| path);
    let mut missing: Vec<_> = paths
        .filter(|path| !root.join(path).exists())
        .map(|path| format!("{document}: {path} does not exist"))
        .collect();
    if page.cells.is_empty() {
        missing.push(format!("{document}: no table"));
    }
    missing
}

/// Figures of the front page that no page has which measures them.
fn missing_figures(root: &Path) -> Result<Vec<Failure>, Failure> {
    let (front, column, pages) = FIGURES;
    let texts: Result<Vec<String>, Failure> =
        pages.iter().map(|name| fs::read_to_string(root.join(name)).map_err(|e| format!("{name}: {e}"))).collect();
    Ok(unknown(&read(root, front)?, column, &texts?)
        .iter()
        .map(|figure| format!("{front}: the figure {figure} is in none of {}", pages.join(", ")))
        .collect())
}

/// Code spans in this column of a page's tables that are in none of these texts.
fn unknown(page: &Page, column: &str, texts: &[String]) -> Vec<String> {
    let cells = page.cells.iter().filter(|(name, _)| name == column).map(|(_, figure)| figure);
    cells.filter(|figure| !texts.iter().any(|text| text.contains(*figure))).cloned().collect()
}

/// Fields of the configuration that the guide to tuning leaves out.
fn missing_fields(root: &Path) -> Result<Vec<Failure>, Failure> {
    let (guide, source, structure) = TUNING;
    let read = |name: &str| fs::read_to_string(root.join(name)).map_err(|e| format!("{name}: {e}"));
    let (guide_text, source_text) = (read(guide)?, read(source)?);
    let fields = public_fields(&source_text, structure).map_err(|e| format!("{source}: {e}"))?;
    let missing = fields.into_iter().filter(|field| !guide_text.contains(&format!("`{field}`")));
    Ok(missing.map(|field| format!("{guide}: the guide to tuning leaves out `{field}`")).collect())
}

/// Names of the public fields of a structure, in a source file as `cargo fmt` leaves it.
fn public_fields(source: &str, structure: &str) -> Result<Vec<String>, Failure> {
    let begin = format!("pub struct {structure} {{");
    let body = source.lines().skip_while(|line| *line != begin).skip(1).take_while(|line| *line != "}");
    let field = |line: &str| Some(line.strip_prefix("    pub ")?.split_once(':')?.0.to_owned());
    let fields: Vec<String> = body.filter_map(field).collect();
    if fields.is_empty() { Err(format!("no `struct {structure}` with public fields")) } else { Ok(fields) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the links of a page at the top of this package, which stands for the repository.
    fn checked(text: &str) -> Result<(), Failure> {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let page = Page::parse(text);
        assert_eq!(page.links.len(), 1, "{text}");
        check(&page.links[0], &page, here, here)
    }

    #[test]
    fn links_into_the_repository_lead_somewhere() {
        assert_eq!(checked("# 2. What it's for\n\n[there](#2-what-its-for)"), Ok(()));
        assert!(checked("# Here\n[x](#there)").is_err());
        assert_eq!(checked("[x](src/main.rs)"), Ok(()));
        assert!(checked("[x](nowhere.md)").is_err());
        assert!(checked("[x](src/main.rs#L1)").is_err());
        assert_eq!(checked("[x](https://github.com/stampfly/stampfly/blob/main/Cargo.toml)"), Ok(()));
        assert!(checked("[x](https://github.com/stampfly/stampfly/blob/main/nowhere.md)").is_err());
        assert_eq!(checked("[x](https://example.org/nowhere.md)"), Ok(()));
    }

    #[test]
    fn links_to_headings_of_other_documents_are_followed() {
        let other = "../docs/reference/msrv.md";
        assert_eq!(checked(&format!("[x]({other}#rust-versions)")), Ok(()));
        assert!(checked(&format!("[x]({other}#no-such-heading)")).is_err());
    }

    #[test]
    fn paths_of_requirements_exist() {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let table = |home: &str| {
            Page::parse(&format!("| id | home | test | note |\n|---|---|---|---|\n| `x` | {home} | `src` | `y` |\n"))
        };
        assert!(missing_paths(here, &table("`src/main.rs`, not yet")).is_empty());
        assert_eq!(missing_paths(here, &table("`src/nowhere.rs`")).len(), 1);
        assert_eq!(missing_paths(here, &Page::parse("no table")).len(), 1);
    }

    #[test]
    fn figures_of_the_front_page_are_measured_somewhere() {
        let page = Page::parse("| what | figure | from |\n|---|---|---|\n| `x` | `1.2` m, `3.4` m | `y` |\n");
        assert_eq!(unknown(&page, "figure", &["a 1.2 m".to_owned(), "b".to_owned()]), ["3.4"]);
        assert_eq!(unknown(&page, "figure", &["1.2".to_owned(), "3.4".to_owned()]), [""; 0]);
    }

    #[test]
    fn only_public_fields_are_named() {
        let source = "pub struct A {\n    /// One.\n    pub one: f32,\n    two: f32,\n}\npub struct B {\n    pub three: f32,\n}\n";
        assert_eq!(public_fields(source, "A"), Ok(vec!["one".to_owned()]));
        assert!(public_fields(source, "C").is_err());
    }

    #[test]
    fn pictures_must_be_shown() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the repository");
        let count = fs::read_dir(root.join(PICTURES)).expect("pictures").count();
        assert_eq!(missing_pictures(root, &[]).map(|missing| missing.len()), Ok(count));
    }
}
