//! How a bug is written into a source text: beside the right code, chosen when the program runs.
//!
//! So one build has all bugs, and with none of them on it is the flight code as it is. What is replaced is an expression, or
//! statements that end a block or stand in one.

use super::list::{Bug, Kind};
use crate::repository::Failure;

/// The environment variable that names the bug that is on.
pub const VARIABLE: &str = "REINSERTED_BUG";

/// The module that each crate with a bug gets. The copy is for a PC, so it has the standard library; its name is another one, since
/// a crate may have its own `std`.
pub const MODULE: &str = r#"//! Which of the re-inserted bugs is on.

extern crate std as standard;

static ON: standard::sync::OnceLock<standard::string::String> = standard::sync::OnceLock::new();

pub(crate) fn on(bug: &str) -> bool {
    ON.get_or_init(|| standard::env::var("REINSERTED_BUG").unwrap_or_default()).as_str() == bug
}
"#;

/// The text with these bugs in it, each guarded. Every bug has to be found exactly once, and apart from the others.
pub fn with_bugs(source: &str, bugs: &[&Bug]) -> Result<String, Failure> {
    let mut places = Vec::new();
    for bug in bugs {
        let mut found = source.match_indices(&bug.from);
        match (found.next(), found.next()) {
            (Some((start, _)), None) => places.push((start, *bug)),
            (None, _) => return Err(format!("{}: {} does not contain what it replaces", bug.name, bug.file)),
            (Some(_), Some(_)) => return Err(format!("{}: {} contains it more than once", bug.name, bug.file)),
        }
    }
    places.sort_by_key(|(start, _)| *start);
    let (mut text, mut end) = (String::new(), 0);
    for (start, bug) in places {
        let between = source.get(end..start).ok_or_else(|| format!("{}: overlaps another bug", bug.name))?;
        end = start + bug.from.len();
        let choice = format!("if crate::reinserted::on({:?}) {{ {} }} else {{ {} }}", bug.name, bug.to, bug.from);
        text += between;
        text += &match bug.kind {
            Kind::Expression => format!("({choice})"),
            Kind::Statement => choice,
        };
    }
    Ok(text + &source[end..])
}

/// The root file of a crate with the module.
pub fn with_module(root: &str) -> String {
    format!("{root}\nmod reinserted;\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bug(name: &str, kind: Kind, from: &str, to: &str) -> Bug {
        let [name, from, to] = [name, from, to].map(str::to_owned);
        Bug { name, kind, from, to, file: "here".into(), ..Bug::default() }
    }

    #[test]
    fn an_expression_keeps_its_place() {
        let sign = bug("sign", Kind::Expression, "-gain", "gain");
        let text = with_bugs("let a = -gain * 2.0;", &[&sign]).expect("found once");
        assert_eq!(text, r#"let a = (if crate::reinserted::on("sign") { gain } else { -gain }) * 2.0;"#);
        assert!(syn::parse_str::<syn::Stmt>(&text).is_ok());
    }

    #[test]
    fn a_statement_may_vanish() {
        let reset = bug("reset", Kind::Statement, "self.sum = 0.0;", "");
        let text = with_bugs("fn f(&mut self) { self.sum = 0.0; self.on = true }", &[&reset]).expect("found once");
        assert!(text.contains(r#"if crate::reinserted::on("reset") {  } else { self.sum = 0.0; } self.on"#), "{text}");
        assert!(syn::parse_str::<syn::ImplItemFn>(&text).is_ok());
    }

    #[test]
    fn bugs_of_one_file_go_in_together_and_in_any_order() {
        let [first, second] = [("b", "1", "3"), ("a", "2", "4")].map(|(n, f, t)| bug(n, Kind::Expression, f, t));
        let text = with_bugs("f(1, 2)", &[&second, &first]).expect("apart");
        assert_eq!(text, with_bugs("f(1, 2)", &[&first, &second]).expect("apart"));
        assert_eq!(text.matches("reinserted").count(), 2);
        assert!(syn::parse_str::<syn::Expr>(&text).is_ok());
    }

    #[test]
    fn what_is_not_there_once_or_overlaps_is_refused() {
        let one = |from: &str| with_bugs("a + b + a", &[&bug("x", Kind::Expression, from, "c")]);
        assert!(one("d").is_err_and(|e| e.contains("does not contain")));
        assert!(one("a").is_err_and(|e| e.contains("more than once")));
        assert!(one("b").is_ok());
        let [long, short] = ["a + b", "b + a"].map(|from| bug("x", Kind::Expression, from, "c"));
        assert!(with_bugs("a + b + a", &[&long, &short]).is_err_and(|e| e.contains("overlaps")));
    }

    #[test]
    fn the_module_is_rust_and_reads_the_variable() {
        assert!(syn::parse_file(MODULE).is_ok());
        assert!(MODULE.contains(&format!("{VARIABLE:?}")));
        assert!(syn::parse_file(&with_module("#![no_std]\npub mod a;")).is_ok());
    }
}
