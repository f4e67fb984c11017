//! `book`: builds the book of `docs`, checks every link and anchor in it, and runs the commands of its tutorial.
//!
//! mdBook builds it, with a preprocessor of ours ([`chapters`]); hyperlink follows the links of what came out, so that nothing counts that a
//! reader could not click. A chapter that the table of contents leaves out would be no page: it is looked for.

mod chapters;

pub use chapters::run as chapters;

use crate::arguments::Arguments;
use crate::cargo_tool::cargo_tool;
use crate::page::Page;
use crate::repository::{Failure, Repository, capture, run as run_program};
use chapters::PAGES;
use std::fs;

const MDBOOK: (&str, &str) = ("mdbook", "0.5.4");
const HYPERLINK: (&str, &str) = ("hyperlink", "0.3.2");
/// The table of contents in the folder of the pages.
const CONTENTS: &str = "SUMMARY.md";
/// The page whose commands are run.
const TUTORIAL: &str = "docs/guide/tutorial.md";

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let forgotten = forgotten(repository)?;
    if !forgotten.is_empty() {
        return Err(format!("{PAGES}/{CONTENTS} leaves out\n  {}", forgotten.join("\n  ")));
    }
    let place = repository.target("book");
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    let mut build = cargo_tool(repository, MDBOOK.0, MDBOOK.1)?;
    // This program as it is, and not cargo: that would wait for whatever is being built.
    build.env("MDBOOK_PREPROCESSOR__CHAPTERS__COMMAND", format!("{} {}", program.display(), chapters::NAME));
    // mdBook says what is wrong, for example a listing that is not there, and goes on.
    let (_, said) = capture(build.args(["build", "--dest-dir"]).arg(&place))?;
    eprint!("{said}");
    if let Some(line) = said.lines().find(|line| line.contains("WARN") || line.contains("ERROR")) {
        return Err(format!("mdbook is not content: {}", line.trim()));
    }
    let mut links = cargo_tool(repository, HYPERLINK.0, HYPERLINK.1)?;
    run_program(links.arg("--check-anchors").arg(&place))?;
    commands(repository)
}

/// Pages that are in no line of the table of contents.
fn forgotten(repository: &Repository) -> Result<Vec<String>, Failure> {
    let read = |name: &str| fs::read_to_string(repository.root.join(name)).map_err(|e| format!("{name}: {e}"));
    let contents = Page::parse(&read(&format!("{PAGES}/{CONTENTS}"))?);
    let mut list = repository.command("git");
    let pages = format!("{PAGES}/*.md");
    let (pages, _) = capture(list.args(["ls-files", "--cached", "--others", "--exclude-standard", &pages]))?;
    let names = pages.lines().filter_map(|page| page.strip_prefix(PAGES)?.strip_prefix('/'));
    let exists = |name: &&str| repository.root.join(PAGES).join(name).exists();
    let listed = |name: &&str| *name == CONTENTS || contents.links.iter().any(|link| link == name);
    Ok(names.filter(exists).filter(|name| !listed(name)).map(str::to_owned).collect())
}

/// Runs every command of the tutorial, as it stands there, and looks for what it is said to print.
fn commands(repository: &Repository) -> Result<(), Failure> {
    let text = fs::read_to_string(repository.root.join(TUTORIAL)).map_err(|e| format!("{TUTORIAL}: {e}"))?;
    let sessions = sessions(&text);
    if sessions.is_empty() {
        return Err(format!("{TUTORIAL} has no command"));
    }
    for Session { command, shown } in sessions {
        let mut shell = repository.command("sh");
        // Cargo as this program was started by; the reader's is the same.
        let (printed, _) = capture(shell.args(["-e", "-c", &command]))?;
        if let Some(line) = shown.iter().find(|line| !printed.lines().any(|printed| printed.trim_end() == **line)) {
            return Err(format!("{TUTORIAL}: `{command}` does not print\n{line}\nbut\n{printed}"));
        }
    }
    Ok(())
}

/// A command and lines that it prints.
#[derive(Debug, PartialEq)]
struct Session {
    command: String,
    shown: Vec<String>,
}

/// What a page's blocks of the kind `console` say: after `$ ` a command, then lines of its output, `…` for some that are left out.
fn sessions(page: &str) -> Vec<Session> {
    let mut sessions: Vec<Session> = Vec::new();
    let mut inside = false;
    for line in page.lines() {
        match (inside, line.strip_prefix("$ ")) {
            (false, _) => inside = line == "```console",
            (true, _) if line == "```" => inside = false,
            (true, Some(command)) => sessions.push(Session { command: command.to_owned(), shown: Vec::new() }),
            (true, None) if line == "…" => {}
            (true, None) => sessions.iter_mut().last().into_iter().for_each(|last| last.shown.push(line.to_owned())),
        }
    }
    sessions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_and_what_they_print_are_found() {
        let page = "Text\n\n```rust\n$ no\n```\n\n```console\n$ echo a\na\n…\nb\n$ true\n```\n$ no\n";
        let session = |command: &str, shown: &[&str]| Session {
            command: command.to_owned(),
            shown: shown.iter().map(|line| (*line).to_owned()).collect(),
        };
        assert_eq!(sessions(page), [session("echo a", &["a", "b"]), session("true", &[])]);
    }
}
