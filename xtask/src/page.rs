//! What is checked of a Markdown page: its links, its headings, and the paths in columns of its tables.

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};
use std::collections::BTreeSet;

/// A page, parsed.
#[derive(Debug, Default, PartialEq)]
pub struct Page {
    /// Targets of links and pictures, as written.
    pub links: Vec<String>,
    /// Targets of pictures.
    pub pictures: BTreeSet<String>,
    /// Anchors of the headings.
    pub anchors: BTreeSet<String>,
    /// Code spans in tables, each with the heading of its column.
    pub cells: Vec<(String, String)>,
}

impl Page {
    /// Parses CommonMark with GitHub's tables.
    pub fn parse(text: &str) -> Self {
        let mut page = Self::default();
        let (mut heading, mut columns, mut column) = (None::<String>, Vec::<String>::new(), 0);
        let (mut in_head, mut in_table) = (false, false);
        for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
            match event {
                Event::Start(Tag::Link { dest_url, .. }) => page.links.push(dest_url.into_string()),
                Event::Start(Tag::Image { dest_url, .. }) => {
                    page.pictures.insert(dest_url.to_string());
                    page.links.push(dest_url.into_string());
                }
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::End(TagEnd::Heading(_)) => page.anchors.extend(heading.take().map(|text| anchor(&text))),
                Event::Start(Tag::Table(_)) => (in_table, columns) = (true, Vec::new()),
                Event::End(TagEnd::Table) => in_table = false,
                Event::Start(Tag::TableHead) => in_head = true,
                Event::End(TagEnd::TableHead) => in_head = false,
                Event::Start(Tag::TableRow) => column = 0,
                Event::Start(Tag::TableCell) if in_head => columns.push(String::new()),
                Event::End(TagEnd::TableCell) if !in_head => column += 1,
                Event::Text(text) | Event::Code(text) if in_head => {
                    columns.iter_mut().last().into_iter().for_each(|name| *name += &text)
                }
                Event::Text(text) | Event::Code(text) if heading.is_some() => {
                    heading.iter_mut().for_each(|heading| *heading += &text)
                }
                Event::Code(code) if in_table => {
                    page.cells.extend(columns.get(column).map(|name| (name.clone(), code.into_string())));
                }
                _ => {}
            }
        }
        page
    }
}

/// GitHub's anchor of a heading: small letters, blanks become dashes, other signs go.
fn anchor(heading: &str) -> String {
    let kept = |c: char| match c {
        ' ' => Some('-'),
        c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
        _ => None,
    };
    heading.to_lowercase().chars().filter_map(kept).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_headings_and_cells_are_found() {
        let page = Page::parse(
            "# 2. What it's for: `code`\n\n[a](b.md#c) ![d](images/e.svg) `[no](link)` <https://x.org>\n\n\
             ```text\n[no](link)\n# no heading\n```\n\n| id | home |\n|---|---|\n| `1` | `a/b`, c [l](m) |\n\n`outside`\n",
        );
        assert_eq!(page.links, ["b.md#c", "images/e.svg", "https://x.org", "m"]);
        assert_eq!(page.pictures, ["images/e.svg".to_owned()].into());
        assert_eq!(page.anchors, ["2-what-its-for-code".to_owned()].into());
        let cell = |column: &str, code: &str| (column.to_owned(), code.to_owned());
        assert_eq!(page.cells, [cell("id", "1"), cell("home", "a/b")]);
    }
}
