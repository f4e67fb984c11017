//! Emulator of the barometer BMP280: Bosch BST-BMP280-DS001 ("DS" below), on I²C or SPI.
//!
//! | register | content | DS |
//! |---|---|---|
//! | 0x88–0x9F | calibration words T1–T3, P1–P9, low byte first | 3.11.2, table 17 |
//! | 0xD0 | identity 0x58 | 4.3.1 |
//! | 0xE0 | 0xB6 resets; reads 0 | 4.3.2 |
//! | 0xF3 | status: bit 3 converting, bit 0 copying calibration | 4.3.3 |
//! | 0xF4 | oversampling T (7:5), P (4:2), mode (1:0) | 4.3.4 |
//! | 0xF5 | standby (7:5), filter (4:2) | 4.3.5 |
//! | 0xF7–0xFC | pressure, temperature, 20 bits each, high byte first | 4.3.6, 4.3.7 |
//!
//! Reads continue with the next register; writes are pairs of register and value (DS 5.2.1, 5.2.2).
//! The same holds on SPI, where bit 7 of the address marks a read and data follow immediately (DS
//! 5.3); bit 0 of 0xF5 selects three-wire SPI, whose SDO is silent (DS 4.3.5, 5.3). A read that
//! begins in the data registers returns one conversion, even if another ends meanwhile (DS 3.10). A
//! mode written during a conversion takes effect at its end (DS 3.6). A write to 0xF5 in normal
//! mode is ignored; the data sheet says that this may happen (4.3.5).
//!
//! *Unverified*: in the 2 ms of its start-up the chip acknowledges, ignores writes and shows a zero
//! calibration (DS table 2 gives only the time); the noise per oversampling, which is scaled from
//! this project's static records at ×4 and filter 4 by the square root of the number of samples;
//! with a broken sensing element the data registers keep their reset value while conversions
//! continue; an undriven line reads as ones. Not modelled: I²C is disabled after the first low CSB
//! (DS 5.1); here a chip is attached to one kind of bus.

use super::{Chip, Flaw, I2cChip, SpiChip};
use crate::noise::{Noise, Stream};
use crate::sensors::baro::{BaroPhysics, DEVIATION, RATE};
use crate::sensors::schedule::Schedule;
use crate::time::Clock;
use crate::world::World;
use stampfly_types::{Duration, Instant};

const CALIBRATION: u16 = 0x88;
const ID: u16 = 0xD0;
const RESET: u16 = 0xE0;
const STATUS: u16 = 0xF3;
const CONTROL: u16 = 0xF4;
const CONFIG: u16 = 0xF5;
const DATA: u16 = 0xF7;
const RESET_WORD: u16 = 0xB6;
/// Start-up time (DS table 2).
const START_UP: Duration = Duration::from_micros(2_000);
/// Content of the data registers before the first conversion, and for a quantity that is not
/// measured (DS 4.2, 3.3.1).
const SKIPPED: u32 = 0x80000;
/// Standby times of normal mode, µs (DS table 11).
const STANDBY: [u64; 8] = [500, 62_500, 125_000, 250_000, 500_000, 1_000_000, 2_000_000, 4_000_000];

/// Calibration words in the order of their registers: T1, T2, T3, P1 to P9. The example of DS 3.12.
const WORDS: [i32; 12] = [27_504, 26_435, -1_000, 36_477, -10_685, 3_024, 2_855, 140, -7, 15_500, -14_600, 6_000];

/// Fine temperature, 5120 per °C, from the raw value (DS 8.1).
fn fine_temperature(adc: f64) -> f64 {
    let word = |n: usize| f64::from(WORDS[n]);
    let first = (adc / 16_384.0 - word(0) / 1_024.0) * word(1);
    let second = adc / 131_072.0 - word(0) / 8_192.0;
    first + second * second * word(2)
}

/// Pressure, Pa, from the raw value (DS 8.1).
fn pressure(adc: f64, fine: f64) -> f64 {
    let p = |n: usize| f64::from(WORDS[n + 2]);
    let x = fine / 2.0 - 64_000.0;
    let offset = (x * x * p(6) / 32_768.0 + x * p(5) * 2.0) / 4.0 + p(4) * 65_536.0;
    let slope = (1.0 + (p(3) * x * x / 524_288.0 + p(2) * x) / 524_288.0 / 32_768.0) * p(1);
    let y = (1_048_576.0 - adc - offset / 4_096.0) * 6_250.0 / slope;
    y + (p(9) * y * y / 2_147_483_648.0 + y * p(8) / 32_768.0 + p(7)) / 16.0
}

/// The largest 20-bit value at which the increasing function `rising` is at most zero, by
/// bisection.
fn invert(rising: impl Fn(f64) -> f64) -> u32 {
    (0..20).rev().fold(0, |value, bit| {
        let with = value | 1 << bit;
        if rising(f64::from(with)) <= 0.0 { with } else { value }
    })
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Sleep,
    Converting { until: Instant },
    Standby { until: Instant },
}

/// The emulator. The same seed gives the same specimen as [`BaroModel`](crate::sensors::BaroModel).
///
/// ```
/// use embedded_hal::i2c::I2c;
/// use stampfly_sim::chips::{Bmp280, I2cBus};
/// use stampfly_sim::{Simulation, SimulationConfig};
/// use stampfly_types::Instant;
///
/// let simulation = Simulation::new(&SimulationConfig::example());
/// let clock = simulation.clock.clone();
/// let mut bus = I2cBus::new(&clock, 1);
/// bus.attach(0x76, Bmp280::new(&simulation.world, &clock, 1));
/// clock.advance_to(Instant::from_millis(2));
/// bus.write(0x76, &[0xF4, 0b001_001_01])?; // once, forced
/// clock.advance_to(Instant::from_millis(9));
/// let mut data = [0; 6];
/// bus.write_read(0x76, &[0xF7], &mut data)?;
/// assert_ne!(data, [0x80, 0, 0, 0x80, 0, 0]);
/// # Ok::<(), stampfly_sim::chips::BusError>(())
/// ```
#[derive(Debug)]
pub struct Bmp280 {
    physics: BaroPhysics,
    /// True time per time of the chip's clock.
    pace: f64,
    id: u8,
    /// End of the start-up.
    ready: Instant,
    phase: Phase,
    control: u8,
    config: u8,
    /// Mode written during a conversion.
    pending: Option<u8>,
    /// The sensing element is broken.
    broken: bool,
    flaw: Option<Flaw>,
    last_conversion: Instant,
    /// Raw pressure and temperature.
    data: [u32; 2],
    /// Copy of the data for the present read.
    shadow: [u32; 2],
    /// State of the filter; `None` before the first conversion.
    filtered: Option<[f64; 2]>,
    pointer: u16,
    /// First byte of a transfer on SPI.
    command: u8,
}

impl Bmp280 {
    /// A chip after power-on.
    #[must_use]
    pub fn new(world: &World, clock: &Clock, seed: u64) -> Self {
        let mut noise = Noise::stream(seed, Stream::Baro);
        let now = clock.now();
        let pace = Schedule::new(now, RATE, 0.02, &mut noise).period() * RATE * 1e-6;
        let physics = BaroPhysics::new(world, now, noise, seed);
        let mut chip = Self {
            physics,
            pace,
            id: 0x58,
            ready: now,
            phase: Phase::Sleep,
            control: 0,
            config: 0,
            pending: None,
            broken: false,
            flaw: None,
            last_conversion: now,
            data: [SKIPPED; 2],
            shadow: [SKIPPED; 2],
            filtered: None,
            pointer: 0,
            command: 0,
        };
        chip.reset(now);
        chip
    }

    /// Samples per conversion of pressure and temperature (DS tables 21, 22).
    fn oversampling(&self) -> [u64; 2] {
        [self.control >> 2 & 7, self.control >> 5].map(|code| if code == 0 { 0 } else { 1 << (code.min(5) - 1) })
    }

    fn true_time(&self, microseconds: u64) -> Duration {
        Duration::from_micros((microseconds as f64 * self.pace) as u64)
    }

    /// Typical conversion time: 1 ms, 2 ms per sample, and 0.5 ms when pressure is measured (DS
    /// table 13).
    fn conversion_time(&self) -> Duration {
        let [pressure, temperature] = self.oversampling();
        self.true_time(1_000 + 2_000 * (pressure + temperature) + if pressure > 0 { 500 } else { 0 })
    }

    /// Enters sleep or starts a conversion according to the mode bits: 0 sleep, 1 and 2 forced, 3
    /// normal (DS table 10).
    fn enter_mode(&mut self, now: Instant) {
        self.phase = match self.control & 3 {
            0 => Phase::Sleep,
            _ => Phase::Converting { until: now + self.conversion_time() },
        };
    }

    fn convert(&mut self, at: Instant) {
        let [samples, temperature_samples] = self.oversampling();
        let period = f64::from(at.since(self.last_conversion).seconds());
        self.last_conversion = at;
        // `DEVIATION` is after a filter of coefficient 4 at ×4; a filter of coefficient c divides
        // the variance of white noise by 2c − 1.
        let deviation = DEVIATION * (7.0 * 4.0 / samples.max(1) as f64).sqrt();
        let (true_pressure, celsius) =
            (self.physics.pressure(at, period, deviation), f64::from(self.physics.temperature(at)));
        // Temperature first: the pressure compensation needs the fine temperature.
        let temperature = invert(|adc| fine_temperature(adc) - 5_120.0 * celsius);
        let fine = fine_temperature(f64::from(temperature));
        let fresh = [invert(|adc| true_pressure - pressure(adc, fine)), temperature];
        let coefficient = f64::from(1u8 << (self.config >> 2 & 7).min(4));
        // The first conversion initialises the filter.
        let before = self.filtered.unwrap_or(fresh.map(f64::from));
        let filtered: [f64; 2] =
            core::array::from_fn(|i| (before[i] * (coefficient - 1.0) + f64::from(fresh[i])) / coefficient);
        self.filtered = Some(filtered);
        if self.flaw == Some(Flaw::Stuck) && self.data != [SKIPPED; 2] {
            return;
        }
        let counts = [samples, temperature_samples];
        self.data = core::array::from_fn(|i| match counts[i] {
            0 => SKIPPED,
            _ if self.broken => SKIPPED,
            // 16 bits and one more per doubling; 20 with the filter (DS 3.3.1, 3.3.2, 3.3.3).
            _ if coefficient > 1.0 => filtered[i] as u32,
            count => filtered[i] as u32 & !((16 / count as u32) - 1),
        });
    }

    fn update(&mut self, now: Instant) {
        loop {
            match self.phase {
                Phase::Converting { until } if until <= now => {
                    self.convert(until);
                    if let Some(control) = self.pending.take() {
                        self.control = control;
                        self.enter_mode(until);
                    } else if self.control & 3 == 3 {
                        let standby = STANDBY[usize::from(self.config >> 5)];
                        self.phase = Phase::Standby { until: until + self.true_time(standby) };
                    } else {
                        // A forced conversion resets the mode bits to sleep (DS 3.6.2).
                        self.control &= !3;
                        self.phase = Phase::Sleep;
                    }
                }
                Phase::Standby { until } if until <= now => {
                    self.phase = Phase::Converting { until: until + self.conversion_time() };
                }
                _ => return,
            }
        }
    }
}

impl Chip for Bmp280 {
    fn read(&mut self, register: u16, now: Instant) -> u16 {
        self.update(now);
        let starting = now < self.ready;
        u16::from(match register {
            CALIBRATION..0xA0 if !starting => {
                let offset = usize::from(register - CALIBRATION);
                (WORDS[offset / 2] as u16).to_le_bytes()[offset % 2]
            }
            ID => self.id,
            STATUS => u8::from(matches!(self.phase, Phase::Converting { .. })) << 3 | u8::from(starting),
            CONTROL => self.control,
            CONFIG => self.config,
            DATA..0xFD => {
                let offset = usize::from(register - DATA);
                let value = self.shadow[offset / 3] << 12;
                value.to_be_bytes()[offset % 3]
            }
            _ => 0,
        })
    }

    fn write(&mut self, register: u16, value: u16, now: Instant) {
        self.update(now);
        if now < self.ready {
            return;
        }
        match register {
            RESET if value == RESET_WORD => self.reset(now),
            CONTROL if matches!(self.phase, Phase::Converting { .. }) => self.pending = Some(value as u8),
            CONTROL => {
                self.control = value as u8;
                self.enter_mode(now);
            }
            // Bit 1 does not exist; bit 0 selects three-wire SPI.
            CONFIG if self.control & 3 != 3 => self.config = value as u8 & !2,
            _ => {}
        }
    }

    fn reset(&mut self, now: Instant) {
        self.ready = now + START_UP;
        self.phase = Phase::Sleep;
        self.control = 0;
        self.config = 0;
        self.pending = None;
        self.data = [SKIPPED; 2];
        self.shadow = self.data;
        self.filtered = None;
        self.pointer = 0;
    }

    fn set_flaw(&mut self, flaw: Option<Flaw>) {
        self.flaw = flaw;
    }

    fn set_id(&mut self, id: u16) {
        self.id = id as u8;
    }

    fn set_broken(&mut self, broken: bool) {
        self.broken = broken;
    }
}

impl I2cChip for Bmp280 {
    fn receive(&mut self, index: usize, byte: u8, now: Instant) -> bool {
        if index.is_multiple_of(2) {
            self.pointer = u16::from(byte);
        } else {
            self.write(self.pointer, u16::from(byte), now);
        }
        true
    }

    fn send(&mut self, index: usize, now: Instant) -> u8 {
        if index == 0 {
            self.update(now);
            self.shadow = self.data;
        }
        let byte = self.read(self.pointer, now) as u8;
        self.pointer = (self.pointer + 1) & 0xFF;
        byte
    }
}

impl SpiChip for Bmp280 {
    /// DS table 28.
    const HIGHEST_CLOCK: u32 = 10_000_000;

    fn answer(&mut self, index: usize, now: Instant) -> u8 {
        let silent = 0xFF;
        if index == 0 || self.command & 0x80 == 0 {
            return silent;
        }
        let sent = self.send(index - 1, now);
        self.pointer |= 0x80;
        if self.config & 1 == 0 { sent } else { silent }
    }

    fn take(&mut self, index: usize, byte: u8, now: Instant) {
        if index == 0 {
            self.command = byte;
            self.pointer = 0x80 | u16::from(byte);
        } else if self.command & 0x80 == 0 {
            // Another address or its value: as on I²C, except for bit 7 of addresses.
            self.receive(index, if index.is_multiple_of(2) { byte | 0x80 } else { byte }, now);
        }
    }

    fn release(&mut self, _: Instant) {}
}
