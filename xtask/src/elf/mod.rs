//! The functions and objects of a linked program: size, owning crate, callees.

mod names;
mod riscv;
pub mod stack;

pub use names::Names;

use crate::repository::Failure;
use object::elf::SHF_ALLOC;
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind, SymbolKind};
use std::collections::BTreeMap;
use std::path::Path;

/// Owner of objects that the compiler named itself (text, tables, merged variables): some Rust crate.
pub const CONSTANTS: &str = "constants";
/// Owner of objects whose names are not Rust names.
pub const C: &str = "C";

/// One function or object.
#[derive(Debug)]
pub struct Symbol {
    /// As written in the source; a path for Rust, one word for C.
    pub name: String,
    /// The crate; [`CONSTANTS`] for a nameless object of Rust's, of which the crate is not known; [`C`].
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

/// Bytes of flash and of memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sizes {
    /// Bytes of flash.
    pub flash: u64,
    /// Bytes of memory.
    pub memory: u64,
}

impl Sizes {
    /// Something of this size, at this place.
    pub fn add(&mut self, size: u64, place: Place) {
        self.flash += if place == Place::Memory { 0 } else { size };
        self.memory += if place == Place::Flash { 0 } else { size };
    }

    /// What is left without these.
    pub fn checked_sub(self, part: Self) -> Option<Self> {
        Some(Self { flash: self.flash.checked_sub(part.flash)?, memory: self.memory.checked_sub(part.memory)? })
    }
}

/// The program.
#[derive(Default)]
pub struct Program {
    /// By address.
    pub symbols: BTreeMap<u64, Symbol>,
    /// Of all sections together, what no symbol covers included. Without the stack, which is what is left over.
    pub sections: Sizes,
    /// Constants in flash, with their addresses.
    constants: Vec<(u64, Vec<u8>)>,
    /// Values of the linker's own symbols.
    linker: BTreeMap<String, u64>,
}

impl Program {
    /// Reads a 32-bit RISC-V program with its symbols.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let bytes = std::fs::read(path).map_err(|e| fail(&e))?;
        let file = object::File::parse(&*bytes).map_err(|e| fail(&e))?;
        let mut program = Self::default();
        for section in file.sections() {
            if section.kind() == SectionKind::ReadOnlyData || section.name().is_ok_and(|name| name == ".rodata") {
                program.constants.push((section.address(), section.data().map_err(|e| fail(&e))?.to_vec()));
            }
            let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
            let is_gap = matches!(section.name(), Ok(".stack" | ".text_gap"));
            if let (Some(place), false, true) = (place(&section), is_gap, sh_flags & u64::from(SHF_ALLOC) != 0) {
                program.sections.add(section.size(), place);
            }
        }
        let crate_name = file.symbols().filter(|symbol| symbol.kind() == SymbolKind::File).find_map(main_crate);
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
            let owner = match name {
                // The entry has a name that start-up code knows.
                "main" => crate_name.clone().unwrap_or_else(|| C.to_owned()),
                name => owner(name, &readable),
            };
            let thing = Symbol { name: readable, owner, size: symbol.size(), place, code };
            program.symbols.insert(symbol.address(), thing);
        }
        if program.symbols.is_empty() { Err(fail(&"no symbols")) } else { Ok(program) }
    }

    /// The place in a source file that a `core::panic::Location` at this address tells: `FILE:LINE`.
    pub fn location(&self, address: u64) -> Option<String> {
        let word = |index: u64| Some(u32::from_le_bytes(self.bytes(address + 4 * index, 4)?.try_into().ok()?));
        let file = std::str::from_utf8(self.bytes(u64::from(word(0)?), u64::from(word(1)?))?).ok()?;
        file.ends_with(".rs").then(|| Some(format!("{file}:{}", word(2)?)))?
    }

    fn bytes(&self, address: u64, size: u64) -> Option<&[u8]> {
        self.constants.iter().find_map(|(start, bytes)| {
            let offset = usize::try_from(address.checked_sub(*start)?).ok()?;
            bytes.get(offset..offset.checked_add(usize::try_from(size).ok()?)?)
        })
    }

    /// The symbol that this address lies in, and where it begins.
    pub fn at(&self, address: u64) -> Option<(u64, &Symbol)> {
        let (start, symbol) = self.symbols.range(..=address).next_back()?;
        (address - start < symbol.size).then_some((*start, symbol))
    }

    /// What to call an address that lies in no symbol: a function in ROM, or one in assembly that says no size.
    pub fn outside(&self, address: u64) -> String {
        let named = self.linker.iter().find(|(name, value)| **value == address && !name.is_empty());
        named.map_or_else(|| format!("{address:#x}"), |(name, _)| name.clone())
    }

    /// The functions whose name contains all of these parts.
    pub fn functions<'a>(&'a self, parts: &'a [&str]) -> impl Iterator<Item = (u64, &'a Symbol)> {
        let matches = |symbol: &Symbol| symbol.code.is_some() && parts.iter().all(|part| symbol.name.contains(part));
        self.symbols.iter().filter(move |(_, symbol)| matches(symbol)).map(|(address, symbol)| (*address, symbol))
    }
}

/// Is this one of the functions that never return, because something is wrong that cannot be?
pub fn panics(name: &str) -> bool {
    let starts =
        ["core::panicking::", "core::slice::index::slice_", "core::slice::copy_from_slice_impl::len_mismatch_fail"];
    let names = [
        "core::cell::panic_already_borrowed",
        "core::cell::panic_already_mutably_borrowed",
        "core::option::expect_failed",
        "core::option::unwrap_failed",
        "core::result::unwrap_failed",
        "core::str::slice_error_fail",
    ];
    starts.iter().any(|start| name.starts_with(start)) || names.contains(&name)
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

/// The crate that is linked into a program: the first unit of Rust code is called `CRATE.HASH-cgu.N`.
fn main_crate<'d>(file: impl ObjectSymbol<'d>) -> Option<String> {
    let (name, unit) = file.name().ok()?.split_once('.')?;
    unit.contains("-cgu.").then(|| name.to_owned())
}

/// Who a symbol belongs to, by its own name and its readable one.
fn owner(name: &str, readable: &str) -> String {
    match name {
        _ if readable != name => owning_crate(readable),
        // Private names of LLVM; the radio's libraries were made with GCC, which leaves none in a program.
        _ if name.starts_with(".L") => CONSTANTS.to_owned(),
        _ => C.to_owned(),
    }
}

/// The crate a readable name belongs to: `a` in `a::b`, `<a::B as c::D>::e` and `<[a::B]>::c`.
fn owning_crate(name: &str) -> String {
    let start = name.trim_start_matches(|c: char| !c.is_alphanumeric() && c != '_');
    let start = ["mut ", "dyn ", "const "].iter().fold(start, |rest, word| rest.strip_prefix(word).unwrap_or(rest));
    start.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

#[cfg(test)]
pub mod tests {
    use super::riscv::Code;
    use super::{Place, Program, Symbol, owner, owning_crate, panics};

    /// Functions at 16, 32 ...: name, frame, whom it calls, calls through a pointer.
    pub fn program(functions: &[(&str, u64, &[u64], usize)]) -> Program {
        let symbols = functions.iter().zip(1..).map(|((name, frame, calls, indirect), index)| {
            let constants = calls.iter().map(|call| (*call, Vec::new())).collect();
            let calls = calls.iter().copied().collect();
            let code = Code { frame: *frame, calls, constants, indirect: *indirect, unbounded: false };
            let (name, owner) = ((*name).to_owned(), owning_crate(name));
            (16 * index, Symbol { name, owner, size: 16, place: Place::Flash, code: Some(code) })
        });
        Program { symbols: symbols.collect(), ..Program::default() }
    }

    #[test]
    fn a_location_is_read() {
        let mut bytes = vec![0x10, 0x10, 0, 0, 4, 0, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0];
        bytes.extend(b"a.rsx");
        let program = Program { constants: vec![(0x1000, bytes)], ..Program::default() };
        assert_eq!(program.location(0x1000).as_deref(), Some("a.rs:7"));
        assert_eq!((program.location(0x1004), program.location(0x2000)), (None, None));
    }

    #[test]
    fn what_panics_is_known_by_name() {
        assert!(panics("core::panicking::panic_const::panic_const_div_by_zero"));
        assert!(panics("core::slice::index::slice_index_fail"));
        assert!(!panics("core::slice::sort::heapsort"));
    }

    #[test]
    fn the_name_tells_the_crate() {
        assert_eq!(owning_crate("stampfly_eskf::eskf::Eskf::new"), "stampfly_eskf");
        assert_eq!(owning_crate("<stampfly_eskf::eskf::Eskf as stampfly_eskf::Estimator>::predict"), "stampfly_eskf");
        assert_eq!(owning_crate("<&mut dyn embassy_time::Driver>::now"), "embassy_time");
        assert_eq!(owning_crate("core::fmt::write"), "core");
    }

    #[test]
    fn names_made_by_the_compiler_do_not_count_as_c() {
        assert_eq!(owner(".Lanon.aca3.930", ".Lanon.aca3.930"), "constants");
        assert_eq!(owner(".Lswitch.table.x", ".Lswitch.table.x"), "constants");
        assert_eq!(owner("sta_input", "sta_input"), "C");
        assert_eq!(owner("_RNvCs_4core3fmt", "core::fmt"), "core");
    }
}
