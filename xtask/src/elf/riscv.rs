//! What a function's machine code says about the stack: by how much it lowers the pointer, and whom it calls.
//!
//! For RV32IMAC as compilers write it. Everything is read in the order of addresses, whatever the branches: an adjustment
//! that is not always made counts nevertheless, so the answer is never too small. Not a disassembler.

use std::collections::BTreeSet;

/// What one function does.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Code {
    /// Bytes by which the stack pointer is lowered.
    pub frame: u64,
    /// Functions it calls or jumps to.
    pub calls: BTreeSet<u64>,
    /// For each of those calls, in order: whom, and the arguments that are constants.
    pub constants: Vec<(u64, Vec<u64>)>,
    /// Calls through a pointer.
    pub indirect: usize,
    /// It lowers the stack pointer by what only it knows when it runs.
    pub unbounded: bool,
}

const SP: usize = 2;
const RA: usize = 1;
/// Registers that arguments are passed in.
const ARGUMENTS: std::ops::Range<usize> = 10..18;

/// Sign-extends the lowest `bits` of a number.
fn signed(value: u32, bits: u32) -> i64 {
    i64::from(((value << (32 - bits)) as i32) >> (32 - bits))
}

/// A field of an instruction: `width` bits from `from` on, moved to `to`.
fn field(word: u32, from: u32, width: u32, to: u32) -> u32 {
    ((word >> from) & ((1 << width) - 1)) << to
}

/// Reads the machine code of a function that begins at `start`.
pub fn read(bytes: &[u8], start: u64) -> Code {
    let mut reader = Reader { code: Code::default(), known: [None; 32], start, end: start + bytes.len() as u64 };
    let mut place = 0;
    while let Some(low) = bytes.get(place..place + 2) {
        let low = u32::from(u16::from_le_bytes([low[0], low[1]]));
        let address = start + place as u64;
        if low & 3 != 3 {
            reader.short(low, address);
            place += 2;
        } else {
            let high = bytes.get(place + 2..place + 4).map_or(0, |b| u32::from(u16::from_le_bytes([b[0], b[1]])));
            reader.long(high << 16 | low, address);
            place += 4;
        }
    }
    reader.code
}

struct Reader {
    code: Code,
    /// What registers hold, as far as it is a constant.
    known: [Option<i64>; 32],
    start: u64,
    end: u64,
}

impl Reader {
    fn lower(&mut self, by: i64) {
        if by < 0 {
            self.code.frame += by.unsigned_abs();
        }
    }

    /// A jump to a place that the code names. Within the function it is a branch.
    fn jump(&mut self, target: i64) {
        let target = target as u64 & 0xFFFF_FFFF;
        if !(self.start..self.end).contains(&target) {
            self.code.calls.insert(target);
            let arguments = self.known[ARGUMENTS].iter().flatten().map(|value| *value as u64 & 0xFFFF_FFFF);
            self.code.constants.push((target, arguments.collect()));
        }
    }

    /// A jump to where a register says.
    fn jump_to(&mut self, register: usize, offset: i64, is_call: bool) {
        match self.known[register] {
            Some(base) => self.jump(base + offset),
            // A return.
            None if !is_call && register == RA => {}
            // A call, perhaps the last thing the function does; the table of a `match` looks the same and counts as one.
            None => self.code.indirect += 1,
        }
        self.forget();
    }

    /// After a call nothing is known.
    fn forget(&mut self) {
        self.known = [None; 32];
    }

    fn short(&mut self, word: u32, address: u64) {
        let register = field(word, 7, 5, 0) as usize;
        let immediate = signed(field(word, 2, 5, 0) | field(word, 12, 1, 5), 6);
        match (word & 3, field(word, 13, 3, 0)) {
            // c.jal, c.j
            (1, 1 | 5) => {
                let offset = field(word, 12, 1, 11)
                    | field(word, 11, 1, 4)
                    | field(word, 9, 2, 8)
                    | field(word, 8, 1, 10)
                    | field(word, 7, 1, 6)
                    | field(word, 6, 1, 7)
                    | field(word, 3, 3, 1)
                    | field(word, 2, 1, 5);
                self.jump(address as i64 + signed(offset, 12));
                if field(word, 13, 3, 0) == 1 {
                    self.forget();
                }
            }
            // c.addi16sp
            (1, 3) if register == SP => {
                let by = field(word, 12, 1, 9)
                    | field(word, 6, 1, 4)
                    | field(word, 5, 1, 6)
                    | field(word, 3, 2, 7)
                    | field(word, 2, 1, 5);
                self.lower(signed(by, 10));
            }
            // c.lui
            (1, 3) => self.known[register] = Some(immediate << 12),
            // c.li
            (1, 2) => self.known[register] = Some(immediate),
            // c.addi
            (1, 0) if register == SP => self.lower(immediate),
            (1, 0) => self.known[register] = self.known[register].map(|value| value + immediate),
            // c.jr, c.jalr, c.mv, c.add
            (2, 4) => {
                let (source, is_call) = (field(word, 2, 5, 0), field(word, 12, 1, 0) == 1);
                match (source, register) {
                    (0, 0) => {}
                    (0, _) => self.jump_to(register, 0, is_call),
                    _ => self.known[register] = None,
                }
            }
            // Loads and arithmetic.
            (0, 2) => self.known[8 + field(word, 2, 3, 0) as usize] = None,
            (1, 4) => self.known[8 + field(word, 7, 3, 0) as usize] = None,
            (2, 2) => self.known[register] = None,
            // c.slli
            (2, 0) => {
                let by = field(word, 2, 5, 0);
                self.known[register] = self.known[register].map(|value| value << by);
            }
            (0, 0) => self.known[8 + field(word, 2, 3, 0) as usize] = None,
            _ => {}
        }
    }

    fn long(&mut self, word: u32, address: u64) {
        let (register, source, other) =
            (field(word, 7, 5, 0) as usize, field(word, 15, 5, 0) as usize, field(word, 20, 5, 0) as usize);
        let immediate = signed(word >> 20, 12);
        match word & 0x7F {
            // jal
            0x6F => {
                let offset =
                    field(word, 31, 1, 20) | field(word, 12, 8, 12) | field(word, 20, 1, 11) | field(word, 21, 10, 1);
                self.jump(address as i64 + signed(offset, 21));
                if register == RA {
                    self.forget();
                }
            }
            // jalr
            0x67 => self.jump_to(source, immediate, register == RA),
            // auipc, lui
            0x17 => self.known[register] = Some(address as i64 + i64::from((word & 0xFFFF_F000) as i32)),
            0x37 => self.known[register] = Some(i64::from((word & 0xFFFF_F000) as i32)),
            // addi
            0x13 if field(word, 12, 3, 0) == 0 => match (register, source) {
                (SP, SP) => self.lower(immediate),
                // Back to the frame pointer at the end.
                (SP, _) => {}
                _ => self.known[register] = self.known[source].map(|value| value + immediate),
            },
            // sub sp, sp, register; add sp, sp, register
            0x33 if register == SP && source == SP => {
                let by = self.known[other].map(|by| if word >> 30 & 1 == 1 { -by } else { by });
                self.code.unbounded |= by.is_none();
                self.lower(by.unwrap_or_default());
            }
            // Stores and branches write no register.
            0x23 | 0x63 => {}
            _ => self.known[register] = None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Code, read};

    fn words(words: &[u32]) -> Vec<u8> {
        words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }

    #[test]
    fn frames_and_calls() {
        // addi sp, sp, -32; auipc ra, 1; jalr ra, 8(ra); addi sp, sp, 32; ret
        let code = read(&words(&[0xfe01_0113, 0x0000_1097, 0x0080_80e7, 0x0201_0113, 0x0000_8067]), 0x1000);
        assert_eq!(
            code,
            Code { frame: 32, calls: [0x200c].into(), constants: vec![(0x200c, vec![])], ..Code::default() }
        );
        // lui t0, 13; addi t0, t0, -16; sub sp, sp, t0; jalr ra, a5
        let code = read(&words(&[0x0000_d2b7, 0xff02_8293, 0x4051_0133, 0x0007_80e7]), 0x1000);
        assert_eq!(code, Code { frame: 0xd000 - 16, indirect: 1, ..Code::default() });
        // c.li a2, 27; c.slli a2, 8; sub sp, sp, a2
        let code = read(&words(&[0x0622_466d, 0x40c1_0133]), 0x1000);
        assert_eq!(code, Code { frame: 27 << 8, ..Code::default() });
        // lui a0, 13; addi a0, a0, -16; auipc ra, 1; jalr ra, 8(ra)
        let code = read(&words(&[0x0000_d537, 0xff05_0513, 0x0000_1097, 0x0080_80e7]), 0x1000);
        assert_eq!(code.constants, [(0x2010, vec![0xd000 - 16])]);
        // jalr zero, a5: perhaps the last call of a function, without a way back
        assert_eq!(read(&words(&[0x0007_8067]), 0).indirect, 1);
        // sub sp, sp, a0
        assert!(read(&words(&[0x40a1_0133]), 0).unbounded);
    }

    #[test]
    fn short_instructions() {
        // c.addi16sp sp, -64; c.jal +16 (out of the function); c.addi sp, -16; c.j +16 (a tail call)
        let code = read(&words(&[0x2801_7139, 0xa801_1141]), 0x1000);
        assert_eq!(code.frame, 80);
        assert_eq!(code.calls, [0x1012, 0x1016].into());
    }
}
