//! `book-chapters`: mdBook's preprocessor for the pages of `docs`, which are written to be read in the repository as well.
//!
//! A link to a source file leads from there to the file, but not from a page of the book: it becomes the file's address. Formulas between
//! dollar signs and in blocks of the kind `math`, which forges show, become MathML, which browsers show without any script.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository};
use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};
use pulldown_latex::config::{DisplayMode, RenderConfig};
use pulldown_latex::{Parser as Formula, Storage, push_mathml};
use serde_json::Value;
use std::io::Read;
use std::ops::Range;
use std::path::{Component, Path, PathBuf};

/// As mdBook and `book.toml` call it.
pub const NAME: &str = "book-chapters";
/// Folder of the pages.
pub const PAGES: &str = "docs";
/// Where the repository's files are for readers of the book.
const ADDRESS: &str = "https://github.com/stampfly/stampfly/blob/main/";

pub fn run(_: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    // `supports RENDERER` asks whether we can; we can for each.
    if arguments.rest.first().is_some_and(|word| word == "supports") {
        return Ok(());
    }
    let mut input = String::new();
    std::io::stdin().read_to_string(&mut input).map_err(|e| e.to_string())?;
    let both: Value = serde_json::from_str(&input).map_err(|e| format!("not mdBook's: {e}"))?;
    let mut book = both.get(1).ok_or("not mdBook's: no book")?.clone();
    let mut chapters = 0;
    adapt_all(&mut book, &mut chapters)?;
    if chapters == 0 {
        return Err("no chapter: has mdBook's format changed?".to_owned());
    }
    println!("{book}");
    Ok(())
}

/// Every chapter, wherever it is in the book.
fn adapt_all(value: &mut Value, chapters: &mut usize) -> Result<(), Failure> {
    let page = value["path"].as_str().map(str::to_owned);
    if let (Some(page), Some(text)) = (page, value["content"].as_str()) {
        let adapted = adapt(text, &page_folder(&page)).map_err(|e| format!("{PAGES}/{page}: {e}"))?;
        value["content"] = Value::String(adapted);
        *chapters += 1;
    }
    match value {
        Value::Array(values) => values.iter_mut().try_for_each(|value| adapt_all(value, chapters)),
        Value::Object(fields) => fields.values_mut().try_for_each(|value| adapt_all(value, chapters)),
        _ => Ok(()),
    }
}

/// One page of this folder.
fn adapt(text: &str, folder: &Path) -> Result<String, Failure> {
    let mut changes: Vec<(Range<usize>, String)> = Vec::new();
    // A block of code that a forge shows as a formula, while we are in it.
    let mut formula: Option<String> = None;
    let options = Options::ENABLE_TABLES | Options::ENABLE_MATH;
    for (event, range) in Parser::new_ext(text, options).into_offset_iter() {
        match event {
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                let Some(address) = outside(&dest_url, folder) else { continue };
                // The target stands behind the text, which may hold the same words.
                let found = text[range.clone()].rfind(&*dest_url).map(|at| range.start + at);
                changes.extend(found.map(|at| (at..at + dest_url.len(), address)));
            }
            Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(kind))) if &*kind == "math" => {
                formula = Some(String::new())
            }
            Event::Text(text) => formula.iter_mut().for_each(|formula| *formula += &text),
            Event::End(TagEnd::CodeBlock) => {
                if let Some(formula) = formula.take() {
                    changes.push((range, mathml(&formula, DisplayMode::Block)?));
                }
            }
            Event::InlineMath(formula) => changes.push((range, mathml(&formula, DisplayMode::Inline)?)),
            Event::DisplayMath(formula) => changes.push((range, mathml(&formula, DisplayMode::Block)?)),
            _ => {}
        }
    }
    changes.sort_by_key(|(range, _)| std::cmp::Reverse(range.start));
    let mut adapted = text.to_owned();
    for (range, new) in changes {
        adapted.replace_range(range, &new);
    }
    Ok(adapted)
}

/// The address of what a relative link leads to, if that is no part of the book.
fn outside(link: &str, folder: &Path) -> Option<String> {
    if link.contains("://") || link.starts_with('#') || link.starts_with("mailto:") {
        return None;
    }
    let (file, anchor) =
        link.split_once('#').map_or((link, String::new()), |(file, anchor)| (file, format!("#{anchor}")));
    let mut path = PathBuf::new();
    for part in folder.join(file).components() {
        match part {
            Component::ParentDir => _ = path.pop(),
            Component::Normal(name) => path.push(name),
            _ => {}
        }
    }
    if path.starts_with(PAGES) { None } else { Some(format!("{ADDRESS}{}{anchor}", path.display())) }
}

/// A formula for a browser, in one line and without any sign that Markdown would take for its own.
fn mathml(formula: &str, display_mode: DisplayMode) -> Result<String, Failure> {
    let storage = Storage::new();
    if let Some(error) = Formula::new(formula, &storage).find_map(Result::err) {
        return Err(format!("the formula {formula}: {error}"));
    }
    let storage = Storage::new();
    let (mut html, config) = (String::new(), RenderConfig { display_mode, ..RenderConfig::default() });
    push_mathml(&mut html, Formula::new(formula, &storage), config).map_err(|e| e.to_string())?;
    // It writes two attributes without a blank between them.
    let html = html.replace("\"minsize", "\" minsize");
    let signs =
        [("\n", " "), ("|", "&#124;"), ("*", "&#42;"), ("_", "&#95;"), ("[", "&#91;"), ("]", "&#93;"), ("`", "&#96;")];
    Ok(signs.iter().fold(html, |html, (sign, entity)| html.replace(sign, entity)))
}

/// A folder of the book's pages seen from the top of the repository.
fn page_folder(page: &str) -> PathBuf {
    Path::new(PAGES).join(page).parent().unwrap_or(Path::new(PAGES)).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_out_of_the_book_become_addresses() {
        let page = "[a](../README.md#x) ![b](images/c.png) [`../d`](../../d/e.rs) [f](other.md#g) [h](#i) <https://j.org> `[k](../l)`";
        let here = adapt(page, Path::new("docs")).expect("no formula");
        assert!(
            here.starts_with("[a](https://github.com/stampfly/stampfly/blob/main/README.md#x) ![b](images/c.png)"),
            "{here}"
        );
        let below = adapt(page, Path::new("docs/how-to")).expect("no formula");
        assert!(below.starts_with("[a](../README.md#x) "), "{below}");
        assert!(below.contains("[`../d`](https://github.com/stampfly/stampfly/blob/main/d/e.rs)"), "{below}");
        assert!(below.ends_with("[f](other.md#g) [h](#i) <https://j.org> `[k](../l)`"), "{below}");
    }

    #[test]
    fn formulas_become_mathml() {
        let page = adapt("| a |\n|---|\n| $v_b = \\lVert R\\rVert$ |\n\n`$x$`\n", Path::new("docs"));
        let page = page.expect("a formula");
        assert!(page.contains("<math"), "{page}");
        assert!(!page.contains("$v") && !page.contains("_b"), "{page}");
        assert!(page.ends_with("`$x$`\n"), "{page}");
        let block =
            adapt("Before:\n\n```math\na = \\big(b\\big)\n```\n\nAfter.\n", Path::new("docs")).expect("a formula");
        assert!(block.starts_with("Before:\n\n<math") && block.ends_with("</math>\n\nAfter.\n"), "{block}");
        assert!(!block.contains("\"minsize"), "{block}");
        assert!(adapt("$\\nonsense$", Path::new("docs")).is_err());
    }

    #[test]
    fn every_chapter_is_adapted() {
        let chapter = |path: &str, sub: Value| serde_json::json!({ "Chapter": { "content": "[a](../b)", "path": path, "sub_items": sub } });
        let mut book =
            serde_json::json!({ "items": [chapter("a.md", serde_json::json!([chapter("b.md", Value::Null)]))] });
        let mut chapters = 0;
        adapt_all(&mut book, &mut chapters).expect("links");
        assert_eq!(chapters, 2);
        assert_eq!(book.to_string().matches(ADDRESS).count(), 2, "{book}");
    }
}
