//! Emulator of the battery monitor INA3221: Texas Instruments SBOS576 revision B ("DS" below), with
//! channel 2 on the 10 mΩ shunt.
//!
//! | register | content | after reset | DS |
//! |---|---|---|---|
//! | 0x00 | reset (15), channels (14:12), averages (11:9), times (8:6 bus, 5:3 shunt), mode (2:0) | 0x7127 | 8.6.2.1 |
//! | 0x01, 0x03, 0x05 | shunt voltage, 40 µV in bit 3 | 0 | 8.6.2.2 and following |
//! | 0x02, 0x04, 0x06 | bus voltage, 8 mV in bit 3 | 0 | 8.6.2.3 and following |
//! | 0x07–0x0C | alert limits | 0x7FF8 | 8.6.1 |
//! | 0x0D, 0x0E | sum of shunt voltages, its limit | 0, 0x7FFE | 8.6.1 |
//! | 0x0F | mask and enable; bit 0: conversion ready | 0x0002 | 8.6.1 |
//! | 0x10, 0x11 | limits of the valid power | 0x2710, 0x2328 | 8.6.1 |
//! | 0xFE, 0xFF | maker, part | 0x5449, 0x3220 | 8.6.1 |
//!
//! A write to the configuration starts a new conversion and aborts the present one (DS 8.6.2.1).
//! Registers change when all averages of all enabled channels are done (DS 8.4.2.2). Conversion
//! ready is cleared by reading 0x0F and by a write to the configuration that does not power down
//! (DS 8.6.2.15).
//!
//! Not modelled: alerts and the sum. *Unverified*: the unconnected channels 1 and 3 read zero; a
//! read continues with the same register after two bytes; an incomplete word is ignored when
//! writing; a broken converter reads zero and still reports ready.

use super::{Chip, Flaw, I2cChip};
use crate::noise::{Noise, Stream};
use crate::sensors::power::{PowerPhysics, RATE};
use crate::sensors::schedule::Schedule;
use crate::time::Clock;
use crate::world::World;
use stampfly_types::{Duration, Instant};

const CONFIGURATION: u16 = 0x00;
const SHUNT: u16 = 0x03;
const BUS: u16 = 0x04;
const MASK: u16 = 0x0F;
const MAKER: u16 = 0xFE;
const PART: u16 = 0xFF;
/// Registers 0x00 to 0x11 after reset (DS 8.6.1).
const AFTER_RESET: [u16; 18] =
    [0x7127, 0, 0, 0, 0, 0, 0, 0x7FF8, 0x7FF8, 0x7FF8, 0x7FF8, 0x7FF8, 0x7FF8, 0, 0x7FFE, 2, 0x2710, 0x2328];
/// Channel 2 in the configuration.
const CHANNEL_TWO: u16 = 1 << 13;
/// Number of averages (DS table 3).
const AVERAGES: [u64; 8] = [1, 4, 16, 64, 128, 256, 512, 1_024];
/// Conversion times, µs (DS tables 4 and 5).
const TIMES: [u64; 8] = [140, 204, 332, 588, 1_100, 2_116, 4_156, 8_244];
/// Shunt, Ω.
const SHUNT_RESISTANCE: f64 = 0.01;

/// The emulator. The same seed gives the same specimen as
/// [`PowerModel`](crate::sensors::PowerModel).
///
/// ```
/// use embedded_hal::i2c::I2c;
/// use stampfly_sim::chips::{I2cBus, Ina3221};
/// use stampfly_sim::{Simulation, SimulationConfig};
/// use stampfly_types::Instant;
///
/// let simulation = Simulation::new(&SimulationConfig::example());
/// let clock = simulation.clock.clone();
/// let mut bus = I2cBus::new(&clock, 1);
/// bus.attach(0x40, Ina3221::new(&simulation.world, &clock, 1));
/// clock.advance_to(Instant::from_millis(8)); // it converts on its own after power-on
/// let mut word = [0; 2];
/// bus.write_read(0x40, &[0x04], &mut word)?;
/// let volts = f64::from(i16::from_be_bytes(word) >> 3) * 0.008;
/// assert!((4.0..4.4).contains(&volts));
/// # Ok::<(), stampfly_sim::chips::BusError>(())
/// ```
#[derive(Debug)]
pub struct Ina3221 {
    physics: PowerPhysics,
    /// True time per time of the chip's clock.
    pace: f64,
    part: u16,
    registers: [u16; 18],
    /// Begin of the running conversion; `None` when powered down or done.
    begun: Option<Instant>,
    /// The converter is broken.
    broken: bool,
    flaw: Option<Flaw>,
    pointer: u16,
    /// First byte of a word in transfer.
    half: u8,
}

impl Ina3221 {
    /// A chip after power-on.
    #[must_use]
    pub fn new(world: &World, clock: &Clock, seed: u64) -> Self {
        let mut noise = Noise::stream(seed, Stream::Power);
        let now = clock.now();
        let pace = Schedule::new(now, RATE, 0.02, &mut noise).period() * RATE * 1e-6;
        let physics = PowerPhysics::new(world, now, noise);
        Self {
            physics,
            pace,
            part: 0x3220,
            registers: AFTER_RESET,
            begun: Some(now),
            broken: false,
            flaw: None,
            pointer: 0,
            half: 0,
        }
    }

    fn configuration(&self) -> u16 {
        self.registers[usize::from(CONFIGURATION)]
    }

    /// Measured quantities of the mode: shunt, bus (DS table 6).
    fn measures(&self) -> [bool; 2] {
        [self.configuration() & 1 != 0, self.configuration() & 2 != 0]
    }

    /// Duration of a conversion of all channels with all averages, at least 1 µs.
    fn conversion_time(&self) -> Duration {
        let field = |shift: u32| usize::from(self.configuration() >> shift & 7);
        let [shunt, bus] = self.measures();
        let channel = u64::from(shunt) * TIMES[field(3)] + u64::from(bus) * TIMES[field(6)];
        let channels = u64::from((self.configuration() >> 12 & 7).count_ones());
        Duration::from_micros(((channels * channel * AVERAGES[field(9)]) as f64 * self.pace).max(1.0) as u64)
    }

    fn start(&mut self, now: Instant) {
        self.begun = (self.configuration() & 3 != 0 && self.configuration() & 0x7000 != 0).then_some(now);
    }

    fn update(&mut self, now: Instant) {
        let Some(begun) = self.begun else { return };
        let length = self.conversion_time();
        let done = now.since(begun).as_micros() / length.as_micros();
        if done == 0 {
            return;
        }
        let continuous = self.configuration() & 4 != 0;
        // Earlier conversions have been overwritten, so only the newest is computed.
        let first = if continuous { begun + length * (done - 1) } else { begun };
        self.begun = continuous.then_some(first + length);
        self.registers[usize::from(MASK)] |= 1;
        if self.configuration() & CHANNEL_TWO == 0 {
            return;
        }
        let means = self.physics.mean(first, first + length);
        let [volts, amperes] = if self.broken { [0.0; 2] } else { means };
        let [volts, amperes] = match self.flaw {
            Some(Flaw::Voltage(factor)) => [volts * factor, amperes],
            Some(Flaw::Current(factor)) => [volts, amperes * factor],
            _ => [volts, amperes],
        };
        // Both quantities are 13-bit signed numbers in bits 15 to 3.
        let word = |value: f64| ((value.round().clamp(-4_096.0, 4_095.0) as i16) << 3) as u16;
        let [shunt, bus] = self.measures();
        if shunt {
            self.registers[usize::from(SHUNT)] = word(amperes * SHUNT_RESISTANCE / 40e-6);
        }
        if bus {
            self.registers[usize::from(BUS)] = word(volts / 8e-3);
        }
    }
}

impl Chip for Ina3221 {
    fn read(&mut self, register: u16, now: Instant) -> u16 {
        self.update(now);
        match register {
            MAKER => 0x5449,
            PART => self.part,
            _ => {
                let value = self.registers.get(usize::from(register)).copied().unwrap_or(0);
                if register == MASK {
                    self.registers[usize::from(MASK)] &= !1;
                }
                value
            }
        }
    }

    fn write(&mut self, register: u16, value: u16, now: Instant) {
        self.update(now);
        match register {
            CONFIGURATION if value & 0x8000 != 0 => self.reset(now),
            CONFIGURATION => {
                self.registers[usize::from(CONFIGURATION)] = value;
                if value & 3 != 0 {
                    self.registers[usize::from(MASK)] &= !1;
                }
                self.start(now);
            }
            // The lower ten bits of the mask are flags.
            MASK => self.registers[usize::from(MASK)] = self.registers[usize::from(MASK)] & 0x3FF | value & 0x7C00,
            0x07..=0x0C | 0x10 | 0x11 => self.registers[usize::from(register)] = value & !7,
            0x0E => self.registers[usize::from(register)] = value & !1,
            _ => {}
        }
    }

    fn reset(&mut self, now: Instant) {
        self.registers = AFTER_RESET;
        self.start(now);
    }

    fn set_id(&mut self, id: u16) {
        self.part = id;
    }

    fn set_flaw(&mut self, flaw: Option<Flaw>) {
        self.flaw = flaw;
    }

    fn set_broken(&mut self, broken: bool) {
        self.broken = broken;
    }
}

impl I2cChip for Ina3221 {
    fn receive(&mut self, index: usize, byte: u8, now: Instant) -> bool {
        match index {
            0 => self.pointer = u16::from(byte),
            1 => self.half = byte,
            2 => self.write(self.pointer, u16::from_be_bytes([self.half, byte]), now),
            _ => return false,
        }
        true
    }

    fn send(&mut self, index: usize, now: Instant) -> u8 {
        if index.is_multiple_of(2) {
            let [high, low] = self.read(self.pointer, now).to_be_bytes();
            self.half = low;
            high
        } else {
            self.half
        }
    }
}
