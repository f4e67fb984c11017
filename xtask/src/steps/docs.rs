//! `docs`: does what the documents point at exist, and say what they say it says?
//!
//! A link to a line, such as `[`Ring::write`](../stampfly-bus/src/ring.rs#L90)`, is checked: the line must contain the
//! last word of the link's text. Lines move, so `cargo xtask docs --fix` puts the numbers right and rewrites the
//! generated topic table; without `--fix` a difference is a failure. Every other relative link must lead to a file.

use crate::Failure;
use crate::repository::{Repository, capture};
use std::fs;
use std::path::Path;

/// Documents that are checked, relative to the top folder.
const DOCUMENTS: &[&str] = &["README.md", "docs/architecture.md", "docs/decisions.md", "docs/msrv.md"];
/// The document that is generated.
const TOPICS: &str = "docs/topics.md";

pub fn run(repository: &Repository, arguments: &[String]) -> Result<(), Failure> {
    let fix = match arguments {
        [] => false,
        [flag] if flag == "--fix" => true,
        _ => return Err("the only argument is --fix".to_owned()),
    };
    let mut stale = Vec::new();
    for name in DOCUMENTS {
        let path = repository.root.join(name);
        let text = fs::read_to_string(&path).map_err(|e| format!("{name}: {e}"))?;
        let folder = path.parent().unwrap_or(&repository.root);
        let checked = check_links(&text, folder).map_err(|e| format!("{name}: {e}"))?;
        keep(&path, name, &text, &checked, fix, &mut stale)?;
    }
    let mut list = repository.cargo();
    let (table, _) =
        capture(list.args(["run", "--quiet", "--release", "--bin", "stampfly", "--", "topics", "--markdown"]))?;
    let page = format!(
        "# Topics\n\nWho publishes what for whom. Printed from the topic table in \
         `stampfly-board/src/topic_table.rs` by `cargo xtask docs --fix`; the log reads every topic.\n\n{table}"
    );
    let path = repository.root.join(TOPICS);
    let before = fs::read_to_string(&path).unwrap_or_default();
    keep(&path, TOPICS, &before, &page, fix, &mut stale)?;
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

/// The text with every line number put right.
fn check_links(text: &str, folder: &Path) -> Result<String, Failure> {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(start) = rest.find("](") {
        let (before, after) = rest.split_at(start);
        let Some(end) = after.find(')') else { break };
        let target = &after[2..end];
        out.push_str(before);
        out.push_str("](");
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
    let (file, anchor) = target.split_once('#').map_or((target, None), |(file, anchor)| (file, Some(anchor)));
    let path = folder.join(file);
    if !path.exists() {
        return Err(format!("link to {file}, which does not exist"));
    }
    let Some(line) = anchor.and_then(|anchor| anchor.strip_prefix('L')) else { return Ok(target.to_owned()) };
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
    use super::check_links;
    use std::path::Path;

    #[test]
    fn line_numbers_follow_the_word() {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let fixed = check_links("see [`docs::check_links`](src/steps/docs.rs#L1).", here).expect("exists");
        let number: usize = fixed.trim_end_matches(").").rsplit('L').next().expect("a number").parse().expect("one");
        let line = include_str!("docs.rs").lines().nth(number - 1).expect("that line");
        assert!(line.starts_with("fn check_links"), "{line}");
        assert_eq!(check_links(&fixed, here).expect("exists"), fixed);
        assert!(check_links("[x](nowhere.md)", here).is_err());
        assert!(check_links("[`no_such_thing_here`](Cargo.toml#L1)", here).is_err());
    }
}
