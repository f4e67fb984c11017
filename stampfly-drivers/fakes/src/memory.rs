//! Chips as memories, for the examples in the documentation.
//!
//! Written values can be read back, and the example provides the initial contents. The chips have
//! no timing, and only the driver's waits advance the clock. Not for tests of a driver, because the
//! chips have no faults.

pub use crate::closure::Clock;
use core::cell::Cell;
use core::convert::Infallible;
use embedded_hal::digital::OutputPin;
use embedded_hal_async::i2c::{self, I2c};
use embedded_hal_async::spi::{self, SpiDevice};
use std::rc::Rc;

/// A bus with one chip, and its reset pin.
pub struct Chip {
    memory: [u8; 4096],
    /// Registers that are read in one piece, longest contents first.
    pieces: Vec<(u16, Vec<u8>)>,
    /// The register bank of the flow sensor; each bank has 128 registers.
    bank: u16,
    /// The chip is out of reset, if it has a pin.
    pub awake: Rc<Cell<bool>>,
    /// Registers have addresses of two bytes.
    is_wide: bool,
}

impl Chip {
    /// A chip with these contents, each from a register on.
    #[must_use]
    pub fn new(content: &[(u16, &[u8])]) -> Self {
        let is_wide = content.iter().any(|(register, _)| *register > 0xFF);
        let mut chip =
            Self { memory: [0; 4096], bank: 0, pieces: Vec::new(), awake: Rc::new(Cell::new(true)), is_wide };
        for (register, data) in content {
            chip.store(*register, data);
        }
        chip
    }

    fn store(&mut self, register: u16, data: &[u8]) {
        self.pieces.retain(|piece| piece.0 != register || piece.1.len() != data.len());
        self.pieces.push((register, data.to_vec()));
        self.memory[usize::from(register)..][..data.len()].copy_from_slice(data);
    }

    fn load(&self, register: u16, into: &mut [u8]) {
        let piece = self.pieces.iter().find(|piece| piece.0 == register && piece.1.len() == into.len());
        into.copy_from_slice(piece.map_or(&self.memory[usize::from(register)..][..into.len()], |piece| &piece.1));
    }
}

impl i2c::ErrorType for Chip {
    type Error = i2c::ErrorKind;
}

impl I2c for Chip {
    async fn transaction(&mut self, _: u8, operations: &mut [i2c::Operation<'_>]) -> Result<(), i2c::ErrorKind> {
        if !self.awake.get() {
            return Err(i2c::ErrorKind::NoAcknowledge(i2c::NoAcknowledgeSource::Address));
        }
        let number = |address: &[u8]| address.iter().fold(0, |number, byte| number << 8 | u16::from(*byte));
        match operations {
            [i2c::Operation::Write(address), i2c::Operation::Read(into)] => {
                let register = number(address);
                self.load(register, into);
                // A range finder numbers its results.
                if let Some((_, result)) = self.pieces.iter_mut().find(|piece| piece.0 == 0x89 && register == 0x89) {
                    result[2] = result[2].wrapping_add(1);
                }
            }
            [i2c::Operation::Write(message)] => {
                let (address, data) = message.split_at(if self.is_wide { 2 } else { 1 });
                self.store(number(address), data);
            }
            _ => panic!("not a register access"),
        }
        Ok(())
    }
}

impl spi::ErrorType for Chip {
    type Error = Infallible;
}

impl SpiDevice for Chip {
    async fn transaction(&mut self, operations: &mut [spi::Operation<'_, u8>]) -> Result<(), Infallible> {
        use spi::Operation::{DelayNs, Read, Write};
        match operations {
            [Write([register, _]), Read(into)] => self.load(u16::from(register & 0x7F), into),
            [Write([register]), Write(data)] => self.store(u16::from(*register), data),
            [Write([register]), DelayNs(_), Read(into)] => self.load(self.bank << 7 | u16::from(*register), into),
            [Write([0xFF, bank]), DelayNs(_)] => self.bank = u16::from(*bank),
            [Write([register, value]), DelayNs(_)] => {
                self.store(self.bank << 7 | u16::from(register & 0x7F), &[*value])
            }
            _ => panic!("not a register access"),
        }
        Ok(())
    }
}

/// A reset pin of a chip.
#[derive(Default)]
pub struct Pin(pub Rc<Cell<bool>>);

impl embedded_hal::digital::ErrorType for Pin {
    type Error = Infallible;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.set(false);
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.set(true);
        Ok(())
    }
}
