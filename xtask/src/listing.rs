//! Listings in documents, each of which is the same text as in a program that is built and run.
//!
//! A comment names the program: `<!-- listing: PATH#PART -->` in the line before the block of code. PART is what stands between
//! `// ANCHOR: PART` and `// ANCHOR_END: PART` there; without it the listing is the program without the text on its top.

use crate::repository::Failure;

const BEGIN: &str = "<!-- listing: ";
const END: &str = " -->";
const FENCE: &str = "```";

/// The page with each listing as its program has it; `read` gives a program by its path.
pub fn refreshed(page: &str, read: impl Fn(&str) -> Result<String, Failure>) -> Result<String, Failure> {
    if !page.contains(BEGIN) {
        return Ok(page.to_owned());
    }
    let mut new = String::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        new += line;
        new += "\n";
        let Some(source) = line.strip_prefix(BEGIN).and_then(|line| line.strip_suffix(END)) else { continue };
        let fence = lines.next().filter(|line| line.starts_with(FENCE));
        let fence = fence.ok_or_else(|| format!("no block of code behind the listing {source}"))?;
        if !lines.by_ref().any(|line| line == FENCE) {
            return Err(format!("the listing {source} does not end"));
        }
        let (path, part) = source.split_once('#').map_or((source, None), |(path, part)| (path, Some(part)));
        let code = cut(&read(path)?, part).ok_or_else(|| format!("no part {source}"))?;
        new += &format!("{fence}\n{code}{FENCE}\n");
    }
    Ok(new)
}

/// A part of a program, as far to the left as it goes.
fn cut(program: &str, part: Option<&str>) -> Option<String> {
    let lines: Vec<&str> = match part {
        Some(part) => {
            let at = |mark: &str| program.lines().position(|line| line.trim() == format!("// {mark}: {part}"));
            let (begin, end) = (at("ANCHOR")?, at("ANCHOR_END")?);
            program.lines().take(end).skip(begin + 1).collect()
        }
        None => program.lines().skip_while(|line| line.starts_with("//!") || line.is_empty()).collect(),
    };
    let lines = lines.into_iter().filter(|line| !line.trim_start().starts_with("// ANCHOR"));
    let indent = |line: &str| line.len() - line.trim_start().len();
    let least = lines.clone().filter(|line| !line.is_empty()).map(indent).min()?;
    Some(lines.map(|line| format!("{}\n", line.get(least..).unwrap_or(line))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROGRAM: &str = "//! Text.\n\nuse a;\nfn main() {\n    // ANCHOR: b\n    if c {\n\n        d();\n    }\n    // ANCHOR_END: b\n}\n";

    #[test]
    fn a_listing_is_what_the_program_has() {
        let page = |code: &str| format!("x\n\n<!-- listing: a.rs#b -->\n```rust,ignore\n{code}```\n\ny\n");
        let read = |path: &str| if path == "a.rs" { Ok(PROGRAM.to_owned()) } else { Err("none".to_owned()) };
        assert_eq!(refreshed(&page("old\n"), read), Ok(page("if c {\n\n    d();\n}\n")));
        assert!(refreshed(&page("old\n").replace("#b", "#e"), read).is_err());
        assert!(refreshed(&page("old\n").replace("a.rs", "e.rs"), read).is_err());
        assert!(refreshed("<!-- listing: a.rs -->\n\n```rust\n```\n", read).is_err());
        let whole = "<!-- listing: a.rs -->\n```rust\nuse a;\nfn main() {\n    if c {\n\n        d();\n    }\n}\n```\n";
        assert_eq!(refreshed(whole, read), Ok(whole.to_owned()));
        assert_eq!(refreshed("no listing", read), Ok("no listing".to_owned()));
    }
}
