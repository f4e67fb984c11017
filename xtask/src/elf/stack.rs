//! The deepest a function can get, over everything it calls.
//!
//! A call through a pointer could go anywhere; the caller says which functions may be behind one, and the deepest of
//! them counts at every such call. Recursion and frames of unknown size have no bound and are named.

use super::Program;
use std::collections::{BTreeMap, BTreeSet};

/// How deep, and by which way.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Depth {
    /// Bytes.
    pub bytes: u64,
    /// Functions with their frames, from the root to the deepest.
    pub way: Vec<(String, u64)>,
    /// What cannot be bounded: functions that call themselves, or lower the stack by an unknown amount.
    pub unbounded: BTreeSet<String>,
}

/// What may be behind a pointer: where the caller's name contains the first, functions whose name contains one of the
/// second. The first line that fits a caller counts; one with an empty first part fits every caller.
pub type Pointers<'p> = &'p [(&'p str, &'p [&'p str])];

/// Looks through a program.
pub struct Stack<'a> {
    program: &'a Program,
    pointers: Pointers<'a>,
    /// The deepest behind each line of `pointers`.
    behind: Vec<Depth>,
    known: BTreeMap<u64, Depth>,
    open: BTreeSet<u64>,
}

impl<'a> Stack<'a> {
    /// Of this program.
    pub fn new(program: &'a Program, pointers: Pointers<'a>) -> Self {
        let behind = vec![Depth::default(); pointers.len()];
        let mut stack = Self { program, pointers, behind, known: BTreeMap::new(), open: BTreeSet::new() };
        for _ in 0..2 {
            let deepest = |(_, targets): &(&str, &[&str])| {
                let matches = targets.iter().flat_map(|part| program.functions(std::slice::from_ref(part)));
                let ours: Vec<u64> = matches.filter(|(_, s)| s.owner != "C").map(|(address, _)| address).collect();
                ours.into_iter().map(|address| stack.below(address)).max_by_key(|depth| depth.bytes).unwrap_or_default()
            };
            stack.behind = pointers.iter().map(deepest).collect();
            stack.known.clear();
        }
        stack
    }

    /// The deepest that this function may reach through a pointer.
    fn behind_pointers_of(&self, caller: &str) -> Depth {
        let lines = self.pointers.iter().zip(&self.behind);
        lines
            .into_iter()
            .find(|((part, _), _)| caller.contains(part))
            .map(|(_, depth)| depth.clone())
            .unwrap_or_default()
    }

    /// The depth of the function at this address.
    pub fn below(&mut self, address: u64) -> Depth {
        if let Some(depth) = self.known.get(&address) {
            return depth.clone();
        }
        let Some(symbol) = self.program.symbols.get(&address) else { return Depth::default() };
        let Some(code) = symbol.code.as_ref().filter(|_| !symbol.name.starts_with("core::panicking")) else {
            return Depth::default();
        };
        if !self.open.insert(address) {
            return Depth { unbounded: [symbol.name.clone()].into(), ..Depth::default() };
        }
        let mut deepest = if code.indirect > 0 { self.behind_pointers_of(&symbol.name) } else { Depth::default() };
        let mut unbounded = BTreeSet::new();
        if code.unbounded {
            unbounded.insert(symbol.name.clone());
        }
        for call in &code.calls {
            let depth = self.below(*call);
            unbounded.extend(depth.unbounded.iter().cloned());
            if depth.bytes > deepest.bytes {
                deepest = depth;
            }
        }
        self.open.remove(&address);
        let mut way = vec![(symbol.name.clone(), code.frame)];
        way.extend(deepest.way);
        let depth = Depth { bytes: code.frame + deepest.bytes, way, unbounded };
        self.known.insert(address, depth.clone());
        depth
    }
}
