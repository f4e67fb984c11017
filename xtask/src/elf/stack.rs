//! Bound of the stack of a function, over everything it calls.
//!
//! A table lists the possible targets of calls through pointers, by caller; at every such call the deepest target counts.
//! Targets may call through pointers themselves. When that leads back to the same row of the table, as when formatting a
//! value formats another one inside it, the row has to say how often. Any other recursion, and frames of unknown size, have no
//! bound and are reported, as are functions whose code is not in the program.

use super::{Program, Symbol, panics};
use std::collections::{BTreeMap, BTreeSet};

/// How deep, and by which way.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Depth {
    /// Bytes.
    pub bytes: u64,
    /// Functions with their frames, from the root to the deepest.
    pub way: Vec<(String, u64)>,
    /// What cannot be bounded: functions that call themselves, or lower the stack by an unknown amount, and rows of the
    /// table that lead back to themselves without saying how often.
    pub unbounded: BTreeSet<String>,
    /// Functions that are not in the program. Each counts as the allowance.
    pub elsewhere: BTreeSet<String>,
}

/// A row of the table: what may be behind a pointer.
#[derive(Clone, Copy, Debug)]
pub struct Behind<'p> {
    /// A part of the caller's name. The first row that fits a caller counts; an empty part fits every caller.
    pub callers: &'p str,
    /// Parts of the names of what may be called.
    pub targets: &'p [&'p str],
    /// How many calls by this row may be open at once, where what is called can come back to such a call.
    pub nests: Option<u8>,
}

/// Looks through a program.
pub struct Stack<'a> {
    program: &'a Program,
    table: &'a [Behind<'a>],
    /// Bytes that a function elsewhere may take.
    allowance: u64,
    /// The functions behind each row.
    targets: Vec<Vec<u64>>,
    known: BTreeMap<State, Depth>,
    open: BTreeSet<State>,
}

/// A function, and how many calls by each row are open above it.
type State = (u64, Vec<u8>);

impl<'a> Stack<'a> {
    /// Of this program. Refuses a table with a row that fits nothing in it: every bound would be smaller than it seems.
    pub fn new(program: &'a Program, table: &'a [Behind<'a>], allowance: u64) -> Result<Self, String> {
        let callers: BTreeSet<_> = program
            .symbols
            .values()
            .filter(|symbol| calls_through_pointers(symbol))
            .filter_map(|symbol| row(table, &symbol.name))
            .collect();
        for (index, behind) in table.iter().enumerate() {
            if !callers.contains(&index) {
                return Err(format!("no `{}` that calls through a pointer is left for its row", behind.callers));
            }
            for part in behind.targets {
                if program.functions(std::slice::from_ref(part)).next().is_none() {
                    return Err(format!("no function `{part}`, which is said to be behind a pointer"));
                }
            }
        }
        let targets = table.iter().map(|behind| {
            let matches = behind.targets.iter().flat_map(|part| program.functions(std::slice::from_ref(part)));
            matches.filter(|(_, symbol)| symbol.owner != super::C).map(|(address, _)| address).collect()
        });
        let targets = targets.collect();
        Ok(Self { program, table, allowance, targets, known: BTreeMap::new(), open: BTreeSet::new() })
    }

    /// The depth of the function at this address.
    pub fn below(&mut self, address: u64) -> Depth {
        self.depth((address, vec![0; self.table.len()]))
    }

    fn depth(&mut self, state: State) -> Depth {
        if let Some(depth) = self.known.get(&state) {
            return depth.clone();
        }
        let Some((start, symbol)) = self.program.at(state.0) else {
            let name = self.program.outside(state.0);
            let way = vec![(name.clone(), self.allowance)];
            return Depth { bytes: self.allowance, way, elsewhere: [name].into(), ..Depth::default() };
        };
        // What comes after a panic is no flight.
        let Some(code) = symbol.code.as_ref().filter(|_| !panics(&symbol.name)) else {
            return Depth::default();
        };
        let state = (start, state.1);
        if !self.open.insert(state.clone()) {
            return Depth { unbounded: [symbol.name.clone()].into(), ..Depth::default() };
        }
        let mut deepest = Depth::default();
        if code.indirect > 0 {
            deepest.add(self.behind_pointers_of(&symbol.name, &state.1));
        }
        for call in &code.calls {
            let depth = self.depth((*call, state.1.clone()));
            deepest.add(depth);
        }
        deepest.bytes += code.frame;
        deepest.way.insert(0, (symbol.name.clone(), code.frame));
        if code.unbounded {
            deepest.unbounded.insert(symbol.name.clone());
        }
        self.open.remove(&state);
        self.known.insert(state, deepest.clone());
        deepest
    }

    /// The deepest that this function may reach through a pointer.
    fn behind_pointers_of(&mut self, caller: &str, open: &[u8]) -> Depth {
        let mut deepest = Depth::default();
        let Some(row) = row(self.table, caller) else {
            deepest
                .unbounded
                .insert(format!("{caller}, which calls through a pointer of which the table says nothing"));
            return deepest;
        };
        match (open[row], self.table[row].nests) {
            (0, _) => {}
            (count, Some(most)) if count < most => {}
            (_, Some(_)) => return deepest,
            (_, None) => {
                deepest.unbounded.insert(format!("{caller}, a pointer behind which is such a call again"));
                return deepest;
            }
        }
        let mut open = open.to_vec();
        open[row] += 1;
        for target in self.targets[row].clone() {
            let depth = self.depth((target, open.clone()));
            deepest.add(depth);
        }
        deepest
    }
}

impl Depth {
    /// One more way down from the same place.
    fn add(&mut self, other: Self) {
        self.unbounded.extend(other.unbounded);
        self.elsewhere.extend(other.elsewhere);
        if other.bytes > self.bytes {
            (self.bytes, self.way) = (other.bytes, other.way);
        }
    }
}

fn row(table: &[Behind<'_>], caller: &str) -> Option<usize> {
    table.iter().position(|behind| caller.contains(behind.callers))
}

fn calls_through_pointers(symbol: &Symbol) -> bool {
    symbol.code.as_ref().is_some_and(|code| code.indirect > 0)
}

#[cfg(test)]
mod tests {
    use super::super::tests::program;
    use super::{Behind, Stack};

    const fn behind<'a>(callers: &'a str, targets: &'a [&'a str], nests: Option<u8>) -> Behind<'a> {
        Behind { callers, targets, nests }
    }

    #[test]
    fn the_deepest_way_counts() {
        let program = program(&[("a", 10, &[32, 48], 0), ("b", 5, &[], 0), ("c", 7, &[], 0)]);
        let depth = Stack::new(&program, &[], 0).expect("fits").below(16);
        assert_eq!((depth.bytes, depth.way), (17, vec![("a".to_owned(), 10), ("c".to_owned(), 7)]));
        assert!(depth.unbounded.is_empty() && depth.elsewhere.is_empty());
    }

    #[test]
    fn recursion_has_no_bound() {
        let program = program(&[("a", 10, &[32], 0), ("b", 5, &[16], 0)]);
        let depth = Stack::new(&program, &[], 0).expect("fits").below(16);
        assert_eq!(depth.unbounded, ["a".to_owned()].into());
    }

    #[test]
    fn a_jump_into_a_function_is_a_call_of_it() {
        let program = program(&[("a", 10, &[36], 0), ("b", 5, &[], 0)]);
        assert_eq!(Stack::new(&program, &[], 0).expect("fits").below(16).bytes, 15);
    }

    #[test]
    fn what_is_elsewhere_is_named_and_allowed_for() {
        let mut program = program(&[("a", 10, &[4096], 0)]);
        program.linker.insert("rom_read".to_owned(), 4096);
        let depth = Stack::new(&program, &[], 100).expect("fits").below(16);
        assert_eq!((depth.bytes, depth.elsewhere), (110, ["rom_read".to_owned()].into()));
    }

    #[test]
    fn a_pointer_behind_a_pointer() {
        let program = program(&[("a", 10, &[], 1), ("b", 5, &[], 1), ("c", 7, &[64], 0), ("d", 1, &[], 0)]);
        let table = [behind("a", &["b"], None), behind("b", &["c"], None)];
        assert_eq!(Stack::new(&program, &table, 0).expect("fits").below(16).bytes, 23);
    }

    #[test]
    fn what_has_no_bound_behind_a_pointer_is_named() {
        let program = program(&[("a", 10, &[64], 1), ("b", 5, &[48], 0), ("c", 7, &[32], 0), ("deep", 99, &[], 0)]);
        let depth = Stack::new(&program, &[behind("a", &["b"], None)], 0).expect("fits").below(16);
        assert_eq!((depth.bytes, depth.unbounded), (109, ["b".to_owned()].into()));
    }

    #[test]
    fn a_row_that_leads_back_to_itself_must_say_how_often() {
        let program = program(&[("write", 10, &[], 1), ("show", 5, &[16], 0)]);
        let bytes = |nests| {
            let table = [behind("write", &["show"], nests)];
            let depth = Stack::new(&program, &table, 0).expect("fits").below(16);
            (depth.bytes, depth.unbounded.len())
        };
        assert_eq!(bytes(Some(1)), (25, 0));
        assert_eq!(bytes(Some(3)), (55, 0));
        assert_eq!(bytes(None).1, 1);
    }

    #[test]
    fn a_table_that_does_not_fit_is_refused() {
        let program = program(&[("a", 10, &[], 1), ("b", 5, &[], 0)]);
        let fits = |table: &[Behind<'_>]| Stack::new(&program, table, 0).is_ok();
        assert!(fits(&[behind("a", &["b"], None)]));
        assert!(!fits(&[behind("a", &["gone"], None)]));
        // It calls nothing through a pointer.
        assert!(!fits(&[behind("b", &["a"], None), behind("", &["b"], None)]));
        // The first row leaves nothing for it.
        assert!(!fits(&[behind("", &["b"], None), behind("a", &["b"], None)]));
        // No row at all: a call to anywhere.
        assert_eq!(Stack::new(&program, &[], 0).expect("fits").below(16).unbounded.len(), 1);
    }
}
