//! What happens between the marks of the program: instructions and misses of every pass of the flight band.

use crate::cache::{Cache, Shape};
use std::collections::BTreeMap;
use std::fmt::{self, Display};
use std::ops::Range;

/// Where the program's parts lie.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    /// Read through the cache of instructions: code in flash.
    pub code: Range<u64>,
    /// Read through the cache of data: constants in flash.
    pub constants: Range<u64>,
    /// In RAM whatever it is part of.
    pub ram: Vec<Range<u64>>,
    /// Marks: a pass begins; it has ended, on the ground or with motors that may turn.
    pub begins: u64,
    /// See there.
    pub ends_on_ground: u64,
    /// See there.
    pub ends_armed: u64,
    /// Marks: what is between them is neither counted nor cached.
    pub aside_begins: u64,
    /// See there.
    pub aside_ends: u64,
    /// Mark: an activation is over. Executed while aside, once more often than its place in the schedule says.
    pub counts: u64,
}

/// What something took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Instructions.
    pub instructions: u64,
    /// Lines of code that had to be fetched.
    pub code: u64,
    /// Lines of constants that had to be fetched.
    pub constants: u64,
}

impl Cost {
    /// What was added since `earlier`.
    fn since(self, earlier: Self) -> Self {
        Self {
            instructions: self.instructions - earlier.instructions,
            code: self.code - earlier.code,
            constants: self.constants - earlier.constants,
        }
    }
}

/// Instructions, lines of code, lines of constants.
impl Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {}", self.instructions, self.code, self.constants)
    }
}

/// Follows a program.
#[derive(Debug)]
pub struct Passes {
    layout: Layout,
    instructions: Cache,
    data: Cache,
    /// Of everything so far.
    total: Cost,
    /// The total when the present pass began.
    pass: Option<Cost>,
    aside: bool,
    /// Passes that are over. May the motors turn?
    passes: Vec<(bool, Cost)>,
    /// The total when the last activation was over, or the pass began.
    activation: Cost,
    /// How often its mark was seen.
    counted: usize,
    /// Activations that are over, with their places in the schedule.
    activations: Vec<(usize, Cost)>,
    /// Lines missed in the present pass.
    missed: Vec<u64>,
    /// How often each line was missed in armed passes.
    by_line: BTreeMap<u64, u64>,
}

impl Layout {
    fn is_in_ram(&self, address: u64) -> bool {
        self.ram.iter().any(|range| range.contains(&address))
    }
}

impl Passes {
    /// Nothing has happened.
    pub fn new(layout: Layout) -> Self {
        Self {
            layout,
            instructions: Cache::new(Shape::INSTRUCTIONS),
            data: Cache::new(Shape::DATA),
            total: Cost::default(),
            pass: None,
            aside: false,
            passes: Vec::new(),
            activation: Cost::default(),
            counted: 0,
            activations: Vec::new(),
            missed: Vec::new(),
            by_line: BTreeMap::new(),
        }
    }

    /// An instruction at this address is executed.
    pub fn executes(&mut self, address: u64) {
        if address == self.layout.begins {
            self.begin();
        } else if address == self.layout.ends_on_ground {
            self.end(false);
        } else if address == self.layout.ends_armed {
            self.end(true);
        } else if address == self.layout.aside_begins {
            self.aside = true;
        } else if address == self.layout.aside_ends {
            self.aside = false;
            self.activation_is_over();
        } else if address == self.layout.counts {
            self.counted += 1;
        }
        if self.aside {
            return;
        }
        self.total.instructions += 1;
        if self.layout.code.contains(&address) {
            self.fetches(address);
        }
    }

    /// Data at this address are read. Those of a function lie in its code: they come through that cache.
    pub fn reads(&mut self, address: u64) {
        if self.aside {
            return;
        }
        if self.layout.code.contains(&address) {
            self.fetches(address);
        } else if self.layout.constants.contains(&address)
            && !self.layout.is_in_ram(address)
            && self.data.misses(address)
        {
            self.total.constants += 1;
            self.missed.push(self.data.line_of(address));
        }
    }

    fn fetches(&mut self, address: u64) {
        if !self.layout.is_in_ram(address) && self.instructions.misses(address) {
            self.total.code += 1;
            self.missed.push(self.instructions.line_of(address));
        }
    }

    fn begin(&mut self) {
        self.pass = Some(self.total);
        self.activation = self.total;
        self.missed.clear();
    }

    fn end(&mut self, armed: bool) {
        let Some(before) = self.pass.take() else { return };
        self.passes.push((armed, self.total.since(before)));
        self.activation = self.total;
        if armed {
            for line in self.missed.drain(..) {
                *self.by_line.entry(line).or_default() += 1;
            }
        }
    }

    /// What was aside is over; an activation only when its mark was seen meanwhile.
    fn activation_is_over(&mut self) {
        if let Some(place) = std::mem::take(&mut self.counted).checked_sub(1) {
            self.activations.push((place, self.total.since(self.activation)));
            self.activation = self.total;
        }
    }
}

/// One line a pass, then one an activation, then one a line of memory: `pass ARMED COST`, `activation PLACE COST`, `line ADDRESS MISSES`.
impl Display for Passes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (armed, cost) in &self.passes {
            writeln!(f, "pass {} {cost}", u8::from(*armed))?;
        }
        for (place, cost) in &self.activations {
            writeln!(f, "activation {place} {cost}")?;
        }
        self.by_line.iter().try_for_each(|(line, misses)| writeln!(f, "line {line:x} {misses}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout() -> Layout {
        Layout {
            code: 0x1000..0x2000,
            constants: 0x2000..0x3000,
            ram: vec![0x1800..0x1900, 0x1a00..0x1a80],
            begins: 0x1000,
            ends_on_ground: 0x1100,
            ends_armed: 0x1200,
            aside_begins: 0x1300,
            aside_ends: 0x1400,
            counts: 0x1480,
        }
    }

    #[test]
    fn counts_what_lies_between_the_marks() {
        let mut passes = Passes::new(layout());
        passes.executes(0x1500);
        passes.reads(0x2500);
        for _ in 0..2 {
            passes.executes(0x1000);
            for address in [0x1500, 0x1504, 0x1600, 0x1800, 0x5000] {
                passes.executes(address);
            }
            passes.reads(0x2500);
            passes.reads(0x2600);
            passes.reads(0x5000);
            passes.executes(0x1200);
        }
        passes.executes(0x1700);
        // The mark itself, 0x1600 and the second constant; 0x1800 is in RAM, 0x5000 no flash.
        let first = Cost { instructions: 6, code: 2, constants: 1 };
        assert_eq!(passes.passes, [(true, first), (true, Cost { code: 0, constants: 0, ..first })]);
        assert_eq!(passes.to_string().lines().last(), Some("line 2600 1"));
    }

    #[test]
    fn the_ground_counts_apart() {
        let mut passes = Passes::new(layout());
        passes.executes(0x1100);
        passes.executes(0x1000);
        passes.executes(0x1100);
        assert_eq!(passes.to_string(), "pass 0 1 1 0\n");
    }

    #[test]
    fn what_another_core_does_is_no_part_of_a_pass() {
        let mut passes = Passes::new(layout());
        for address in [0x1000, 0x1300, 0x1500, 0x1600, 0x1400, 0x1100] {
            passes.executes(address);
        }
        passes.reads(0x2500);
        assert_eq!(passes.to_string(), "pass 0 2 2 0\n");
    }

    #[test]
    fn an_activation_is_what_its_mark_was_counted_for() {
        let mut passes = Passes::new(layout());
        passes.executes(0x1000);
        passes.executes(0x1500);
        // Something that is written aside and ends no activation.
        for address in [0x1300, 0x1400] {
            passes.executes(address);
        }
        passes.executes(0x1600);
        for address in [0x1300, 0x1480, 0x1480, 0x1480, 0x1400, 0x1700, 0x1300, 0x1480, 0x1400] {
            passes.executes(address);
        }
        // An instruction is counted after its mark: what returns from aside belongs to what follows.
        let cost = |instructions, code| Cost { instructions, code, constants: 0 };
        assert_eq!(passes.activations, [(2, cost(4, 4)), (0, cost(2, 1))]);
    }

    #[test]
    fn literals_come_through_the_cache_of_instructions() {
        let mut passes = Passes::new(layout());
        passes.executes(0x1000);
        passes.reads(0x1500);
        passes.executes(0x1500);
        passes.executes(0x1100);
        assert_eq!(passes.passes[0].1.code, 2);
    }
}
