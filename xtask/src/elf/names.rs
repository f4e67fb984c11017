//! Names and sections of any linked program: which function an address belongs to.

use crate::repository::Failure;
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

/// A function.
struct Function {
    /// Where it is entered.
    entry: u64,
    /// What lies between it and the one before is its own, too: an Xtensa core has its constants there.
    range: Range<u64>,
    /// As the compiler mangles it.
    mangled: String,
    name: String,
}

/// Names by address, and the program's sections.
pub struct Names {
    /// By their ends.
    functions: BTreeMap<u64, Function>,
    sections: BTreeMap<String, Range<u64>>,
}

impl Names {
    /// Reads a program with its symbols.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let bytes = std::fs::read(path).map_err(|e| fail(&e))?;
        let file = object::File::parse(&*bytes).map_err(|e| fail(&e))?;
        let mut symbols: Vec<_> =
            file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.size() > 0).collect();
        symbols.sort_by_key(ObjectSymbol::address);
        let mut functions = BTreeMap::new();
        let mut before = symbols.first().map_or(0, ObjectSymbol::address);
        for symbol in symbols {
            let (entry, end) = (symbol.address(), symbol.address() + symbol.size());
            let mangled = symbol.name().unwrap_or_default().to_owned();
            let name = format!("{:#}", rustc_demangle::demangle(&mangled));
            functions.insert(end, Function { entry, range: before.min(entry)..end, mangled, name });
            before = end;
        }
        let sections = file.sections().filter_map(|section| {
            let range = section.address()..section.address() + section.size();
            Some((section.name().ok()?.to_owned(), range))
        });
        Ok(Self { functions, sections: sections.collect() })
    }

    /// Where the one function of this name begins.
    pub fn address(&self, name: &str) -> Result<u64, Failure> {
        let mut found = self.functions.values().filter(|function| function.name == name);
        match (found.next(), found.next()) {
            (Some(function), None) => Ok(function.entry),
            (None, _) => Err(format!("no function {name}")),
            (Some(_), Some(_)) => Err(format!("more than one function {name}")),
        }
    }

    /// Where a section lies.
    pub fn section(&self, name: &str) -> Result<Range<u64>, Failure> {
        self.sections.get(name).cloned().ok_or_else(|| format!("no section {name}"))
    }

    /// The function that this line of 32 bytes, or its start, belongs to.
    pub fn of(&self, line: u64) -> &str {
        let next = self.functions.range(line + 1..).next();
        next.filter(|(_, function)| function.range.start < line + 32).map_or("no function", |(_, it)| &it.name)
    }

    /// The functions whose mangled names fit one of these patterns, as a linker script has them: `*` stands for anything.
    pub fn fitting(&self, patterns: &[&str]) -> Vec<Range<u64>> {
        let fits = |function: &&Function| patterns.iter().any(|pattern| fits(pattern, &function.mangled));
        self.functions.values().filter(fits).map(|it| it.range.clone()).collect()
    }
}

/// Does a name fit a pattern?
fn fits(pattern: &str, name: &str) -> bool {
    let Some((start, rest)) = pattern.split_once('*') else { return pattern == name };
    let Some(name) = name.strip_prefix(start) else { return false };
    // Whatever the star stands for, the rest has to fit what is behind it.
    (0..=name.len()).filter_map(|skipped| name.get(skipped..)).any(|behind| fits(rest, behind))
}

#[cfg(test)]
mod tests {
    use super::fits;

    #[test]
    fn a_star_stands_for_anything() {
        assert!(fits("*eskf*step*", "_ZN4eskf6filter4stepE"));
        assert!(fits("*", "") && fits("step", "step") && fits("*step", "a_step"));
        assert!(!fits("*step", "steps") && !fits("step", "a_step") && !fits("*step*eskf*", "_ZN4eskf4stepE"));
    }
}
