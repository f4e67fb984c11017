//! A chip made of closures: registers, a FIFO that fills in virtual time, faults of single
//! accesses.

use stampfly_bmi270::{Bmi270, Config};
use stampfly_driver_core::Timebase;
use stampfly_driver_core::chip::TransferLimit;
use stampfly_driver_fakes::closure::{AXES, Access, Clock, Fault, SpiBus};
use std::cell::RefCell;
use std::rc::Rc;

pub const BLOB: [u8; 600] = [0xC8; 600];
/// Nominal sample period of the chip, ns, for 16 ticks.
pub const PERIOD: u64 = 625_000;

pub struct Chip {
    pub clock: Clock,
    pub registers: [u8; 128],
    pub writes: Vec<(u8, Vec<u8>)>,
    /// Number of chip samples read from the FIFO.
    pub consumed: u64,
    /// Header at the beginning of the next FIFO read.
    pub header: Option<u8>,
    /// Faults of the next reads of a register.
    pub faults: Vec<(u8, Fault)>,
    /// A bit that is inverted in the next read of a register.
    pub flip: Option<(u8, usize)>,
    pub starts: bool,
    pub frozen: bool,
    /// Sample period of the chip, ns.
    pub period: u64,
    /// Counts of one sample: accelerometer, gyroscope.
    pub sample: fn(u64) -> [i16; 6],
}

impl Chip {
    pub fn new(clock: &Clock) -> Self {
        let mut registers = [0; 128];
        registers[0x00] = 0x24;
        Self {
            clock: clock.clone(),
            registers,
            writes: Vec::new(),
            consumed: 0,
            header: None,
            faults: Vec::new(),
            flip: None,
            starts: true,
            frozen: false,
            period: PERIOD,
            sample: |_| [100, 200, -4096, 164, -328, 16],
        }
    }

    pub fn nanos(&self) -> u64 {
        self.clock.now().as_micros() * 1_000
    }

    /// Number of chip samples taken so far.
    pub fn produced(&self) -> u64 {
        if self.frozen { self.consumed } else { self.nanos() / self.period }
    }

    pub fn access(&mut self, access: Access<'_>) -> Result<(), Fault> {
        match access {
            Access::Write(register, data) => {
                self.writes.push((register, data.to_vec()));
                match (register, data) {
                    (0x7E, [0xB6]) => self.registers[0x21] = 0,
                    (0x7E, [0xB0]) => self.consumed = self.produced(),
                    (0x59, [1]) => self.registers[0x21] = if self.starts { 1 } else { 2 },
                    (0x5E, _) => {}
                    // Deflections of ±9 g on every axis, with the signs of the data sheet.
                    (0x6D, [command]) => {
                        let sign: i16 = if command & 4 != 0 { 18_432 } else { -18_432 };
                        for (axis, value) in [sign, -sign, sign].into_iter().enumerate() {
                            self.registers[0x0C + 2 * axis..][..2].copy_from_slice(&value.to_le_bytes());
                        }
                    }
                    _ => self.registers[usize::from(register)..][..data.len()].copy_from_slice(data),
                }
            }
            Access::Read(register, into) => {
                if let Some(position) = self.faults.iter().position(|(at, _)| *at == register) {
                    return Err(self.faults.remove(position).1);
                }
                let nanos = self.nanos();
                self.registers[0x18..0x1B]
                    .copy_from_slice(&(nanos % self.period * 16 / self.period).to_le_bytes()[..3]);
                let bytes = ((self.produced() - self.consumed).min(157) * 13) as u16;
                self.registers[0x24..0x26].copy_from_slice(&bytes.to_le_bytes());
                if register == 0x26 {
                    for frame in into.chunks_mut(13) {
                        self.consumed += 1;
                        let [accel @ .., gx, gy, gz] = (self.sample)(self.consumed);
                        frame[0] = self.header.take().unwrap_or(0x8C);
                        let words = [gx, gy, gz].into_iter().chain(accel);
                        for (bytes, word) in frame[1..].chunks_mut(2).zip(words) {
                            bytes.copy_from_slice(&word.to_le_bytes());
                        }
                    }
                } else {
                    into.copy_from_slice(&self.registers[usize::from(register)..][..into.len()]);
                }
                if let Some((_, bit)) = self.flip.take_if(|(at, _)| *at == register) {
                    into[bit / 8] ^= 1 << (bit % 8);
                }
            }
        }
        Ok(())
    }
}

pub type Shared = Rc<RefCell<Chip>>;

pub fn bench() -> (Clock, Shared) {
    let clock = Clock::default();
    let chip = Rc::new(RefCell::new(Chip::new(&clock)));
    (clock, chip)
}

pub fn driver(
    clock: &Clock,
    chip: &Shared,
    config: Config,
) -> Bmi270<'static, impl stampfly_driver_core::chip::Registers<Error = Fault>, Clock> {
    let chip = chip.clone();
    let bus = SpiBus { clock: clock.clone(), chip: move |access: Access<'_>| chip.borrow_mut().access(access) };
    Bmi270::spi(bus, clock.clone(), &BLOB, AXES, config).with_transfer_limit(TransferLimit::SPI_SENSORS)
}
