//! Access to the BMI270's registers (DS 6): SPI with a dummy byte before read data, I²C without.

use super::{ACCEL, Bmi270, FIFO_DATA, TIME, UPLOAD_DATA};
use crate::chips::{Chip, I2cChip, SpiChip};
use stampfly_types::{Duration, Instant};

impl Bmi270 {
    /// A transfer begins at this register.
    fn begin(&mut self, register: u8, now: Instant) {
        self.update(now);
        self.accepts = now >= self.idle_until;
        self.pointer = u16::from(register & 0x7F);
        self.shadow.copy_from_slice(&self.registers[usize::from(ACCEL)..usize::from(TIME)]);
    }

    /// Returns the register of the next byte and advances, except at data ports.
    fn step(&mut self) -> u16 {
        let register = self.pointer;
        if register != FIFO_DATA && register != UPLOAD_DATA {
            self.pointer = (self.pointer + 1) & 0x7F;
        }
        register
    }

    fn store(&mut self, byte: u8, now: Instant) {
        let register = self.step();
        if self.accepts {
            self.write(register, u16::from(byte), now);
        }
    }

    /// A transfer ends.
    fn end(&mut self, wrote: bool, now: Instant) {
        if wrote && self.accepts {
            let idle = if self.saves_power() { 450 } else { 2 };
            self.idle_until = now + Duration::from_micros(idle);
        }
        self.fifo.release();
        self.drive_pin();
        self.interrupt.wake();
    }
}

impl SpiChip for Bmi270 {
    const HIGHEST_CLOCK: u32 = 10_000_000;

    fn answer(&mut self, index: usize, now: Instant) -> u8 {
        if index == 0 || !self.spi || self.command & 0x80 == 0 {
            return 0xFF;
        }
        if index == 1 {
            return 0;
        }
        let register = self.step();
        self.read(register, now) as u8
    }

    // Called for every byte of a FIFO read, in which it does nothing.
    #[inline]
    fn take(&mut self, index: usize, byte: u8, now: Instant) {
        if index == 0 {
            self.command = byte;
            self.begin(byte, now);
        } else if self.spi && self.command & 0x80 == 0 {
            self.store(byte, now);
        }
    }

    fn release(&mut self, now: Instant) {
        let wrote = self.spi && self.command & 0x80 == 0;
        // A rising edge selects SPI, except during start-up, hence not at the end of the transfer
        // that resets.
        self.spi = now >= self.ready;
        self.end(wrote, now);
    }
}

impl I2cChip for Bmi270 {
    fn receive(&mut self, index: usize, byte: u8, now: Instant) -> bool {
        if index == 0 {
            self.command = 0;
            self.begin(byte, now);
        } else {
            self.command = 1;
            self.store(byte, now);
        }
        true
    }

    fn send(&mut self, _: usize, now: Instant) -> u8 {
        let register = self.step();
        self.read(register, now) as u8
    }

    fn stop(&mut self, now: Instant) {
        self.end(self.command != 0, now);
    }
}
