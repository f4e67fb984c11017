//! Names and sections of any linked program: which function an address belongs to.

use crate::repository::Failure;
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

/// Names by address, and the program's sections.
pub struct Names {
    functions: BTreeMap<u64, (u64, String)>,
    sections: BTreeMap<String, Range<u64>>,
}

impl Names {
    /// Reads a program with its symbols.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let bytes = std::fs::read(path).map_err(|e| fail(&e))?;
        let file = object::File::parse(&*bytes).map_err(|e| fail(&e))?;
        let functions = file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.size() > 0);
        let named = functions.map(|symbol| {
            let name = format!("{:#}", rustc_demangle::demangle(symbol.name().unwrap_or_default()));
            (symbol.address(), (symbol.size(), name))
        });
        let sections = file.sections().filter_map(|section| {
            let range = section.address()..section.address() + section.size();
            Some((section.name().ok()?.to_owned(), range))
        });
        Ok(Self { functions: named.collect(), sections: sections.collect() })
    }

    /// Where the one function of this name begins.
    pub fn address(&self, name: &str) -> Result<u64, Failure> {
        let mut found = self.functions.iter().filter(|(_, (_, is))| is == name);
        match (found.next(), found.next()) {
            (Some((address, _)), None) => Ok(*address),
            (None, _) => Err(format!("no function {name}")),
            (Some(_), Some(_)) => Err(format!("more than one function {name}")),
        }
    }

    /// Where a section lies.
    pub fn section(&self, name: &str) -> Result<Range<u64>, Failure> {
        self.sections.get(name).cloned().ok_or_else(|| format!("no section {name}"))
    }

    /// The function that this line of 32 bytes, or its end, belongs to.
    pub fn of(&self, line: u64) -> &str {
        let nearest = self.functions.range(..line + 32).next_back();
        nearest.filter(|(start, (size, _))| *start + size > line).map_or("no function", |(_, (_, name))| name)
    }
}
