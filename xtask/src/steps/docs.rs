//! `docs`: does what the documents point at exist, and say what they say it says?
//!
//! A link to a line, such as `[`Ring::write`](../stampfly-bus/src/ring.rs#L90)`, is checked: the line must contain the
//! last word of the link's text. Lines move, so `cargo xtask docs --fix` puts the numbers right and rewrites the
//! generated tables; without `--fix` a difference is a failure. Every other link into the repository, relative or by
//! its address, must lead to a file, and one to a heading of a document must find it there. Every document is checked that
//! git knows or would take. Every picture must be shown somewhere,
//! and the guide to tuning must name every field there is to tune.

use crate::Failure;
use crate::arguments::Arguments;
use crate::repository::{Repository, capture};
use std::fs;
use std::path::Path;

/// Addresses of the repository's files, for documents that are read elsewhere.
const ADDRESSES: &[&str] =
    &["https://github.com/stampfly/stampfly/blob/main/", "https://raw.githubusercontent.com/stampfly/stampfly/main/"];
/// Where the pictures are.
const PICTURES: &str = "docs/images";
/// The guide to tuning, and the structure whose fields it must name.
const TUNING: (&str, &str, &str) = ("docs/estimation.md", "stampfly-eskf/src/config.rs", "pub struct EskfConfig {");
/// The documents that are generated: the subcommand of `stampfly` that prints their table, and what comes before it.
const GENERATED: &[(&str, &str, &str)] = &[
    (
        "docs/topics.md",
        "topics",
        "# Topics\n\nWho publishes what for whom. Printed from the topic table in \
         `stampfly-board/src/topic_table.rs` by `cargo xtask docs --fix`; the log reads every topic.",
    ),
    (
        "docs/schedule.md",
        "schedule",
        "# Schedule\n\nWho runs when. Printed from the activation table in `stampfly-board/src/activation_table.rs` by \
         `cargo xtask docs --fix`.\n\nA budget is what an activation may take on the target; `cargo xtask qemu` counts \
         what it takes. A response is the time from a runnable's trigger until it has published, at the latest, if \
         everybody keeps to their budgets: for `actuation` that is the time from an inertial sample to the motors. The \
         compiler computes it (`stampfly-bus/src/response.rs`) and refuses a table in which somebody could be late.",
    ),
];

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let fix = arguments.fix;
    let mut stale = Vec::new();
    let mut all = String::new();
    let (documents, _) =
        capture(repository.command("git").args(["ls-files", "--cached", "--others", "--exclude-standard", "*.md"]))?;
    for name in documents.lines() {
        let path = repository.root.join(name);
        let text = fs::read_to_string(&path).map_err(|e| format!("{name}: {e}"))?;
        let folder = path.parent().unwrap_or(&repository.root);
        let checked = check_links(&text, folder, &repository.root).map_err(|e| format!("{name}: {e}"))?;
        keep(&path, name, &text, &checked, fix, &mut stale)?;
        all += &text;
    }
    check_pictures(&repository.root, &all)?;
    check_tuning(&repository.root)?;
    for (name, command, introduction) in GENERATED {
        let mut list = repository.cargo();
        let (table, _) =
            capture(list.args(["run", "--quiet", "--release", "--bin", "stampfly", "--", command, "--markdown"]))?;
        let page = format!("{introduction}\n\n{table}");
        let path = repository.root.join(name);
        let before = fs::read_to_string(&path).unwrap_or_default();
        keep(&path, name, &before, &page, fix, &mut stale)?;
    }
    if stale.is_empty() { Ok(()) } else { Err(format!("out of date: {stale:?}; run `cargo xtask docs --fix`")) }
}

fn keep(path: &Path, name: &str, before: &str, now: &str, fix: bool, stale: &mut Vec<String>) -> Result<(), Failure> {
    if before == now {
        return Ok(());
    }
    if fix {
        println!("{name}: updated");
        return fs::write(path, now).map_err(|e| format!("{name}: {e}"));
    }
    stale.push(name.to_owned());
    Ok(())
}

/// Is every picture shown by one of the documents?
fn check_pictures(root: &Path, documents: &str) -> Result<(), Failure> {
    let pictures = fs::read_dir(root.join(PICTURES)).map_err(|e| format!("{PICTURES}: {e}"))?;
    for picture in pictures {
        let name = picture.map_err(|e| format!("{PICTURES}: {e}"))?.file_name();
        let name = name.to_string_lossy();
        if !documents.contains(&format!("images/{name})")) {
            return Err(format!("{PICTURES}/{name} is in no document"));
        }
    }
    Ok(())
}

/// Does the guide to tuning name every field?
fn check_tuning(root: &Path) -> Result<(), Failure> {
    let (guide, source, structure) = TUNING;
    let read = |name: &str| fs::read_to_string(root.join(name)).map_err(|e| format!("{name}: {e}"));
    let (text, source) = (read(guide)?, read(source)?);
    let missing = missing_fields(&text, &source, structure);
    if missing.is_empty() { Ok(()) } else { Err(format!("{guide}: the guide to tuning leaves out {missing:?}")) }
}

/// Public fields of a structure that the text does not name as code.
fn missing_fields<'s>(text: &str, source: &'s str, structure: &str) -> Vec<&'s str> {
    let lines = source.lines().skip_while(|line| *line != structure).skip(1).take_while(|line| *line != "}");
    let fields = lines.filter_map(|line| line.trim().strip_prefix("pub ")?.split_once(':'));
    fields.map(|(field, _)| field).filter(|field| !text.contains(&format!("`{field}`"))).collect()
}

/// Is there a heading that a link to this anchor leads to? GitHub's rule: small letters, blanks become dashes, other
/// signs go.
fn has_heading(text: &str, anchor: &str) -> bool {
    let kept = |c: char| match c {
        ' ' => Some('-'),
        c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
        _ => None,
    };
    let headings = text
        .lines()
        .filter_map(|line| line.trim_start_matches('#').strip_prefix(' ').filter(|_| line.starts_with('#')));
    headings
        .map(|heading| heading.to_lowercase().chars().filter_map(kept).collect::<String>())
        .any(|slug| slug == anchor)
}

/// The text with every line number put right.
fn check_links(text: &str, folder: &Path, root: &Path) -> Result<String, Failure> {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(start) = rest.find("](") {
        let (before, after) = rest.split_at(start);
        let Some(end) = after.find(')') else { break };
        let target = &after[2..end];
        out.push_str(before);
        out.push_str("](");
        if let Some(anchor) = target.strip_prefix('#')
            && !has_heading(text, anchor)
        {
            return Err(format!("link to #{anchor}: no such heading"));
        }
        if let Some(file) = ADDRESSES.iter().find_map(|address| target.strip_prefix(address)) {
            leads_somewhere(root, file)?;
        }
        out.push_str(&check_link(before, target, folder)?);
        rest = &after[end..];
    }
    out.push_str(rest);
    Ok(out)
}

fn check_link(before: &str, target: &str, folder: &Path) -> Result<String, Failure> {
    if target.contains("://") || target.starts_with('#') {
        return Ok(target.to_owned());
    }
    leads_somewhere(folder, target)?;
    let Some((file, line)) = target.split_once("#L").filter(|(_, line)| line.parse::<usize>().is_ok()) else {
        return Ok(target.to_owned());
    };
    let path = folder.join(file);
    let text = &before[before.rfind('[').map_or(0, |at| at + 1)..];
    let word = text.trim_matches('`').rsplit([':', '.', ' ']).next().unwrap_or_default().trim_matches('`');
    let source = fs::read_to_string(&path).map_err(|e| format!("{file}: {e}"))?;
    let defines = |line: &str| {
        let keywords = ["fn", "struct", "trait", "mod", "const", "enum", "macro_rules!"];
        keywords.iter().any(|keyword| has_word(line, &format!("{keyword} {word}")))
    };
    let number: usize = line.parse().unwrap_or_default();
    let fits = |line: &str| has_word(line, word);
    if source.lines().nth(number.wrapping_sub(1)).is_some_and(&defines) {
        return Ok(target.to_owned());
    }
    let mut lines = source.lines().enumerate();
    let found = lines.clone().find(|(_, line)| defines(line)).or_else(|| lines.find(|(_, line)| fits(line)));
    let (index, _) = found.ok_or_else(|| format!("link to {target}: no line has '{word}'"))?;
    Ok(format!("{file}#L{}", index + 1))
}

/// Is there a file where this leads, and in a document the heading?
fn leads_somewhere(folder: &Path, target: &str) -> Result<(), Failure> {
    let (file, anchor) = target.split_once('#').map_or((target, None), |(file, anchor)| (file, Some(anchor)));
    let path = folder.join(file);
    if !path.exists() {
        return Err(format!("link to {file}, which does not exist"));
    }
    match anchor.filter(|_| file.ends_with(".md")) {
        None => Ok(()),
        Some(anchor) => {
            let text = fs::read_to_string(&path).map_err(|e| format!("{file}: {e}"))?;
            if has_heading(&text, anchor) { Ok(()) } else { Err(format!("link to {target}: no such heading")) }
        }
    }
}

/// Does the line hold these words, not as a part of longer ones?
fn has_word(line: &str, words: &str) -> bool {
    let inside = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(words).any(|(at, _)| {
        let before = line[..at].chars().next_back();
        let after = line[at + words.len()..].chars().next();
        !before.is_some_and(inside) && !after.is_some_and(inside)
    })
}

#[cfg(test)]
mod tests {
    use super::{check_links, missing_fields};
    use crate::Failure;
    use std::path::Path;

    /// Checks a text as if it were in this package, at the top.
    fn checked(text: &str) -> Result<String, Failure> {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        check_links(text, here, here)
    }

    #[test]
    fn links_into_the_repository_lead_somewhere() {
        let page = "# 2. What it's for\n\n[there](#2-what-its-for)";
        assert_eq!(checked(page).as_deref(), Ok(page));
        assert!(checked("# Here\n[x](#there)").is_err());
        assert!(checked("[x](https://github.com/stampfly/stampfly/blob/main/Cargo.toml)").is_ok());
        assert!(checked("[x](https://github.com/stampfly/stampfly/blob/main/nowhere.md)").is_err());
        assert!(checked("[x](https://example.org/nowhere.md)").is_ok());
        let other = "../stampfly-eskf/README.md";
        let text = include_str!("../../../stampfly-eskf/README.md");
        let heading = text.lines().find_map(|line| line.strip_prefix("## ")).expect("it has headings").to_lowercase();
        let slug: String =
            heading.replace(' ', "-").chars().filter(|c| c.is_alphanumeric() || "-_".contains(*c)).collect();
        assert_eq!(checked(&format!("[x]({other}#{slug})")).err(), None);
        assert!(checked(&format!("[x]({other}#no-such-heading)")).is_err());
    }

    #[test]
    fn fields_that_are_not_named_are_found() {
        let source = "pub struct Config {\n    /// One.\n    pub one: f32,\n    pub two: f32,\n}\npub struct B {\n    pub three: f32,\n}\n";
        assert_eq!(missing_fields("`one` and two", source, "pub struct Config {"), ["two"]);
    }

    #[test]
    fn line_numbers_follow_the_word() {
        let fixed = checked("see [`docs::check_links`](src/steps/docs.rs#L1).").expect("exists");
        let number: usize = fixed.trim_end_matches(").").rsplit('L').next().expect("a number").parse().expect("one");
        let line = include_str!("docs.rs").lines().nth(number - 1).expect("that line");
        assert!(line.starts_with("fn check_links"), "{line}");
        assert_eq!(checked(&fixed).expect("exists"), fixed);
        assert!(checked("[x](nowhere.md)").is_err());
        assert!(checked("[`no_such_thing_here`](Cargo.toml#L1)").is_err());
    }
}
