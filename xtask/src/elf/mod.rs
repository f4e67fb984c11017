//! A linked program as its functions and objects: how large each is, whose it is, whom it calls.

mod riscv;
pub mod stack;

use crate::Failure;
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};
use std::collections::BTreeMap;
use std::path::Path;

/// One function or object.
#[derive(Debug)]
pub struct Symbol {
    /// As written in the source; a path for Rust, one word for C.
    pub name: String,
    /// The crate, or `C`.
    pub owner: String,
    /// Bytes.
    pub size: u64,
    /// Where it lives.
    pub place: Place,
    /// What it does to the stack and whom it calls; only functions.
    pub code: Option<riscv::Code>,
}

/// Where something lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Flash only: code and constants.
    Flash,
    /// Memory, with a copy in flash: code that must not wait, and variables that begin as something.
    Both,
    /// Memory only: variables that begin as zero.
    Memory,
}

/// The program.
pub struct Program {
    /// By address.
    pub symbols: BTreeMap<u64, Symbol>,
    /// Values of the linker's own symbols.
    linker: BTreeMap<String, u64>,
}

impl Program {
    /// Reads a 32-bit RISC-V program with its symbols.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let bytes = std::fs::read(path).map_err(|e| fail(&e))?;
        let file = object::File::parse(&*bytes).map_err(|e| fail(&e))?;
        let mut program = Self { symbols: BTreeMap::new(), linker: BTreeMap::new() };
        for symbol in file.symbols() {
            let name = symbol.name().unwrap_or_default();
            let section = symbol.section_index().and_then(|index| file.section_by_index(index).ok());
            let is_thing = matches!(symbol.kind(), SymbolKind::Text | SymbolKind::Data) && symbol.size() > 0;
            let (Some(section), true) = (section, is_thing) else {
                program.linker.insert(name.to_owned(), symbol.address());
                continue;
            };
            let Some(place) = place(&section) else { continue };
            let code = (symbol.kind() == SymbolKind::Text).then(|| {
                let data = section.data_range(symbol.address(), symbol.size()).ok().flatten();
                riscv::read(data.unwrap_or_default(), symbol.address())
            });
            let readable = format!("{:#}", rustc_demangle::demangle(name));
            let owner = if readable == name { "C".to_owned() } else { owner(&readable) };
            let thing = Symbol { name: readable, owner, size: symbol.size(), place, code };
            program.symbols.insert(symbol.address(), thing);
        }
        if program.symbols.is_empty() { Err(fail(&"no symbols")) } else { Ok(program) }
    }

    /// The value of a symbol that the linker script defines.
    pub fn linker(&self, name: &str) -> Result<u64, Failure> {
        self.linker.get(name).copied().ok_or_else(|| format!("the program has no symbol `{name}`"))
    }

    /// The functions whose name contains all of these parts.
    pub fn functions<'a>(&'a self, parts: &'a [&str]) -> impl Iterator<Item = (u64, &'a Symbol)> {
        let matches = |symbol: &Symbol| symbol.code.is_some() && parts.iter().all(|part| symbol.name.contains(part));
        self.symbols.iter().filter(move |(_, symbol)| matches(symbol)).map(|(address, symbol)| (*address, symbol))
    }
}

fn place<'d>(section: &impl ObjectSection<'d>) -> Option<Place> {
    let name = section.name().unwrap_or_default();
    // Initialised variables and code for the memory are loaded from flash.
    let both = [".data", ".rwtext", ".rwdata", ".trap"].iter().any(|prefix| name.starts_with(prefix));
    match section.kind() {
        _ if both => Some(Place::Both),
        SectionKind::UninitializedData | SectionKind::Common => Some(Place::Memory),
        SectionKind::Text | SectionKind::ReadOnlyData | SectionKind::ReadOnlyString => Some(Place::Flash),
        SectionKind::Data => Some(Place::Both),
        _ => None,
    }
}

/// The crate a readable name belongs to: `a` in `a::b`, `<a::B as c::D>::e` and `<[a::B]>::c`.
fn owner(name: &str) -> String {
    let start = name.trim_start_matches(|c: char| !c.is_alphanumeric() && c != '_');
    let start = ["mut ", "dyn ", "const "].iter().fold(start, |rest, word| rest.strip_prefix(word).unwrap_or(rest));
    start.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

#[cfg(test)]
mod tests {
    use super::owner;

    #[test]
    fn a_name_says_whose_it_is() {
        assert_eq!(owner("stampfly_eskf::eskf::Eskf::new"), "stampfly_eskf");
        assert_eq!(owner("<stampfly_eskf::eskf::Eskf as stampfly_eskf::Estimator>::predict"), "stampfly_eskf");
        assert_eq!(owner("<&mut dyn embassy_time::Driver>::now"), "embassy_time");
        assert_eq!(owner("core::fmt::write"), "core");
    }
}
