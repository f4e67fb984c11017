//! Emulator of the magnetometer BMM150: Bosch BST-BMM150-DS001 ("DS" below), on I²C or SPI.
//!
//! | register | content | DS |
//! |---|---|---|
//! | 0x40 | identity 0x32 | 5.3.1 |
//! | 0x42–0x47 | x, y (13 bits from bit 3), z (15 bits from bit 1), low byte first; bit 0 of each: passed the self test | 5.3.2 |
//! | 0x48–0x49 | Hall resistance (14 bits from bit 2); bit 0: data ready | 5.3.2 |
//! | 0x4B | bit 0 power; bit 2 SPI of three wires; bits 7 and 1 together reset | 5.3.4 |
//! | 0x4C | current of the advanced self test (7:6): 3 positive, 2 negative; rate (5:3), mode (2:1): 0 normal, 1 forced, 3 sleep; self test (0); 0x06 after reset | 5.3.4 |
//! | 0x4E | axes that are not measured: x (3), y (4), z (5) | 5.3.5 |
//! | 0x51, 0x52 | repetitions: xy 1 + 2n, z 1 + n | 5.3.6 |
//! | 0x5D–0x71 | trim | Bosch's BMM150 Sensor API (BSD-3-Clause), not in the data sheet |
//!
//! After power-on the chip is in suspend, in which only 0x4B is accessible; waking takes 3 ms (DS
//! 1.1, 4.2). One conversion takes 145 µs per xy repetition, 500 µs per z repetition and 980 µs (DS
//! 4.2.4). Reading data clears data ready (DS 4.4); a read that begins in the data registers
//! returns one conversion (DS 4.4).
//!
//! On SPI, bit 7 of the address marks a read, and data follow immediately; a write is one register
//! and one value. With bit 2 of 0x4B, which can be set while the power is on, SPI has three wires
//! and SDO is silent (DS, "Serial peripheral interface"). The pin PS, not the traffic, selects the
//! kind of bus.
//!
//! Raw counts are obtained by inverting the public compensation formula of the Sensor API.
//!
//! The self-test (DS 4.7) runs in sleep mode when its bit is set, and clears the bit. The current
//! of the advanced self-test changes z by 180 to 240 µT between its two directions, as Bosch's
//! Sensor API checks.
//!
//! *Unverified*: a self-test lasts 1 ms (the Sensor API waits two), does not start in another mode,
//! and its result bits are zero before and persist until the next; 210 µT between the two currents;
//! an axis that is not measured keeps its value; other registers read zero in suspend and while
//! waking; writes are pairs of register and value; noise is independent of the repetitions; the
//! Hall resistance is nearly constant; an undriven line reads as ones. Not modelled: interrupts,
//! thresholds.

use super::{Chip, Flaw, I2cChip, SpiChip};
use crate::noise::{Noise, Stream};
use crate::sensors::mag::{MagPhysics, RATE};
use crate::sensors::schedule::Schedule;
use crate::time::Clock;
use crate::world::World;
use stampfly_types::{Duration, Instant};

const ID: u16 = 0x40;
const DATA: u16 = 0x42;
const POWER: u16 = 0x4B;
const MODE: u16 = 0x4C;
const AXES: u16 = 0x4E;
const REPETITIONS_XY: u16 = 0x51;
const REPETITIONS_Z: u16 = 0x52;
const TRIM: u16 = 0x5D;
/// Time from suspend to sleep (DS 1.1).
const WAKE: Duration = Duration::from_micros(3_000);
/// Duration of the self test.
const SELF_TEST: Duration = Duration::from_micros(1_000);
/// Field of the advanced self-test's current, µT.
const SELF_TEST_FIELD: f64 = 105.0;
/// Conversions per second in normal mode (DS 5.3.4).
const RATES: [f64; 8] = [10.0, 2.0, 6.0, 8.0, 15.0, 20.0, 25.0, 30.0];
/// Registers 0x4C to 0x52 after reset (DS 5.2).
const SETTINGS: [u8; 7] = [0x06, 0x3F, 0x07, 0, 0, 0, 0];

/// Trim of this specimen: typical magnitudes, all different.
const X1: i8 = 2;
const Y1: i8 = -3;
const X2: i8 = 26;
const Y2: i8 = 27;
const Z1: u16 = 22_800;
const Z2: i16 = 730;
const Z3: i16 = -120;
const Z4: i16 = 9;
const XY1: u8 = 29;
const XY2: i8 = -3;
const XYZ1: u16 = 6_806;
/// Nominal Hall resistance.
const HALL: f64 = 6_850.0;

/// Registers 0x5D to 0x71.
fn trim() -> [u8; 21] {
    let mut bytes = [0; 21];
    let mut put = |register: u16, value: &[u8]| {
        let place = usize::from(register - TRIM);
        bytes[place..place + value.len()].copy_from_slice(value);
    };
    put(0x5D, &[X1 as u8, Y1 as u8]);
    put(0x62, &Z4.to_le_bytes());
    put(0x64, &[X2 as u8, Y2 as u8]);
    put(0x68, &Z2.to_le_bytes());
    put(0x6A, &Z1.to_le_bytes());
    put(0x6C, &XYZ1.to_le_bytes());
    put(0x6E, &Z3.to_le_bytes());
    put(0x70, &[XY2 as u8, XY1]);
    bytes
}

/// Raw counts for a field, µT, chip axes, at a Hall resistance.
fn counts(field: [f64; 3], hall: f64) -> [i16; 3] {
    let turn = f64::from(XYZ1) * 16_384.0 / hall - 16_384.0;
    let gain = f64::from(XY2) * turn * turn / 268_435_456.0 + turn * f64::from(XY1) / 16_384.0 + 256.0;
    let flat = |value: f64, one: i8, two: i8| {
        (16.0 * value - 8.0 * f64::from(one)) * 8_192.0 / (gain * (f64::from(two) + 160.0))
    };
    let upright = (64.0 * field[2] * (f64::from(Z2) + f64::from(Z1) * hall / 32_768.0)
        + f64::from(Z3) * (hall - f64::from(XYZ1)))
        / 131_072.0
        + f64::from(Z4);
    // The chip marks an overflow with its lowest value.
    let limit = |value: f64, bound: f64| if value.abs() < bound { value.round() as i16 } else { -bound as i16 };
    [limit(flat(field[0], X1, X2), 4_096.0), limit(flat(field[1], Y1, Y2), 4_096.0), limit(upright, 16_384.0)]
}

/// The emulator. The same seed gives the same specimen as [`MagModel`](crate::sensors::MagModel).
///
/// ```
/// use embedded_hal::i2c::I2c;
/// use stampfly_sim::chips::{Bmm150, I2cBus};
/// use stampfly_sim::{Simulation, SimulationConfig};
/// use stampfly_types::Instant;
///
/// let simulation = Simulation::new(&SimulationConfig::example());
/// let clock = simulation.clock.clone();
/// let mut bus = I2cBus::new(&clock, 1);
/// bus.attach(0x10, Bmm150::new(&simulation.world, &clock, 1));
/// bus.write(0x10, &[0x4B, 1])?;
/// clock.advance_to(Instant::from_millis(4));
/// let mut id = [0];
/// bus.write_read(0x10, &[0x40], &mut id)?;
/// assert_eq!(id, [0x32]);
/// # Ok::<(), stampfly_sim::chips::BusError>(())
/// ```
#[derive(Debug)]
pub struct Bmm150 {
    physics: MagPhysics,
    noise: Noise,
    /// True time per time of the chip's clock.
    pace: f64,
    id: u8,
    /// Instant from which the chip is awake; `None` in suspend.
    awake: Option<Instant>,
    /// Registers 0x4C to 0x52.
    settings: [u8; 7],
    /// End of the running conversion.
    until: Option<Instant>,
    data: [u8; 8],
    /// End of the running self test.
    self_test: Option<Instant>,
    /// The sensing elements are broken.
    broken: bool,
    flaw: Option<Flaw>,
    /// Copy of the data for the present read.
    shadow: [u8; 8],
    pointer: u16,
    /// First byte of a transfer on SPI.
    command: u8,
    /// Three-wire SPI.
    three_wires: bool,
}

impl Bmm150 {
    /// A chip after power-on.
    #[must_use]
    pub fn new(world: &World, clock: &Clock, seed: u64) -> Self {
        let mut noise = Noise::stream(seed, Stream::Mag);
        let pace = Schedule::new(clock.now(), RATE, 0.02, &mut noise).period() * RATE * 1e-6;
        Self {
            physics: MagPhysics::new(world, noise, seed),
            // A separate stream, so that the field has the same noise as the model's.
            noise: Noise::new(seed, 103),
            pace,
            id: 0x32,
            awake: None,
            settings: SETTINGS,
            until: None,
            data: [0; 8],
            self_test: None,
            broken: false,
            flaw: None,
            shadow: [0; 8],
            pointer: 0,
            command: 0,
            three_wires: false,
        }
    }

    fn setting(&self, register: u16) -> u8 {
        self.settings[usize::from(register - MODE)]
    }

    fn is_awake(&self, now: Instant) -> bool {
        self.awake.is_some_and(|instant| instant <= now)
    }

    fn mode(&self) -> u8 {
        self.setting(MODE) >> 1 & 3
    }

    /// Which of x, y and z are measured (DS 5.3.5).
    fn measures(&self) -> [bool; 3] {
        [0x08, 0x10, 0x20].map(|bit| self.setting(AXES) & bit == 0)
    }

    fn conversion_time(&self) -> Duration {
        let [x, y, z] = self.measures();
        let (xy, z) = (u64::from(x || y), u64::from(z));
        let (xy_repetitions, z_repetitions) = (self.setting(REPETITIONS_XY), self.setting(REPETITIONS_Z));
        let flat = xy * 145 * (1 + 2 * u64::from(xy_repetitions));
        let upright = z * 500 * (1 + u64::from(z_repetitions));
        Duration::from_micros(((flat + upright + 980) as f64 * self.pace) as u64)
    }

    fn start(&mut self, now: Instant) {
        self.until = (self.mode() < 2).then(|| now + self.conversion_time());
    }

    fn update(&mut self, now: Instant) {
        if self.self_test.take_if(|end| *end <= now).is_some() {
            self.settings[0] &= !1;
            let passed = u8::from(!self.broken);
            [0, 2, 4].into_iter().for_each(|place| self.data[place] = self.data[place] & !1 | passed);
        }
        while let Some(until) = self.until.filter(|until| *until <= now) {
            self.convert(until);
            if self.mode() == 0 {
                let rate = RATES[usize::from(self.setting(MODE) >> 3 & 7)];
                let period = Duration::from_micros((1e6 / rate * self.pace) as u64);
                self.until = Some(until + period.max(self.conversion_time()));
            } else {
                // A forced conversion ends in sleep mode (DS 4.2.4).
                self.settings[0] |= 0x06;
                self.until = None;
            }
        }
    }

    fn convert(&mut self, at: Instant) {
        let body = self.physics.field(at);
        if self.flaw == Some(Flaw::Stuck) && self.data != [0; 8] {
            self.data[6] |= 1;
            return;
        }
        let [ahead, right, down] = Flaw::turn(self.flaw, body.into());
        let hall = (HALL + self.noise.normal()).round();
        // The chip is mounted such that body is (−y, x, z) of the chip.
        let current = match self.setting(MODE) >> 6 {
            3 => SELF_TEST_FIELD,
            2 => -SELF_TEST_FIELD,
            _ => 0.0,
        };
        let field = if self.broken { [0.0; 3] } else { [right, -ahead, down + current] };
        let [x, y, z] = counts(field, hall);
        let words = [(x as u16) << 3, (y as u16) << 3, (z as u16) << 1, (hall as u16) << 2 | 1];
        let [measures_x, measures_y, measures_z] = self.measures();
        let measured = [measures_x, measures_y, measures_z, true];
        for ((pair, word), _) in
            self.data.chunks_exact_mut(2).zip(words).zip(measured).filter(|(_, measured)| *measured)
        {
            // Bit 0 holds the result of the last self-test and is kept.
            let passed = u16::from(pair[0] & 1);
            pair.copy_from_slice(&(word | passed).to_le_bytes());
        }
    }
}

impl Chip for Bmm150 {
    fn read(&mut self, register: u16, now: Instant) -> u16 {
        self.update(now);
        if register == POWER {
            return u16::from(self.three_wires) << 2 | u16::from(self.awake.is_some());
        }
        if !self.is_awake(now) {
            return 0;
        }
        u16::from(match register {
            ID => self.id,
            DATA..0x4A => self.shadow[usize::from(register - DATA)],
            MODE..=REPETITIONS_Z => self.setting(register),
            TRIM..0x72 => trim()[usize::from(register - TRIM)],
            _ => 0,
        })
    }

    fn write(&mut self, register: u16, value: u16, now: Instant) {
        self.update(now);
        match register {
            POWER if value & 0x82 == 0x82 && self.is_awake(now) => {
                // A soft reset keeps the power bit and ends in sleep mode (DS 5.3.4).
                self.reset(now);
                self.awake = Some(now + WAKE);
            }
            POWER if value & 1 == 0 => self.reset(now),
            POWER => {
                self.three_wires = self.is_awake(now) && value & 4 != 0;
                self.awake = Some(self.awake.unwrap_or(now + WAKE));
            }
            _ if !self.is_awake(now) => {}
            MODE => {
                self.settings[0] = value as u8;
                let sleeps = self.mode() == 3;
                self.self_test = (value & 1 != 0 && sleeps).then(|| now + SELF_TEST);
                if !sleeps {
                    self.settings[0] &= !1;
                }
                self.start(now);
            }
            0x4D..=REPETITIONS_Z => self.settings[usize::from(register - MODE)] = value as u8,
            _ => {}
        }
    }

    fn reset(&mut self, _: Instant) {
        self.awake = None;
        self.three_wires = false;
        self.settings = SETTINGS;
        self.until = None;
        self.self_test = None;
        self.data = [0; 8];
        self.shadow = [0; 8];
    }

    fn set_broken(&mut self, broken: bool) {
        self.broken = broken;
    }

    fn set_flaw(&mut self, flaw: Option<Flaw>) {
        self.flaw = flaw;
    }

    fn set_id(&mut self, id: u16) {
        self.id = id as u8;
    }
}

impl I2cChip for Bmm150 {
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
            if (DATA..0x4A).contains(&self.pointer) {
                self.data[6] &= !1;
            }
        }
        let byte = self.read(self.pointer, now) as u8;
        self.pointer = (self.pointer + 1) & 0xFF;
        byte
    }
}

impl SpiChip for Bmm150 {
    /// DS, "Serial peripheral interface".
    const HIGHEST_CLOCK: u32 = 10_000_000;

    fn answer(&mut self, index: usize, now: Instant) -> u8 {
        let silent = 0xFF;
        if index == 0 || self.command & 0x80 == 0 {
            return silent;
        }
        let sent = self.send(index - 1, now);
        if self.three_wires { silent } else { sent }
    }

    fn take(&mut self, index: usize, byte: u8, now: Instant) {
        if index == 0 {
            self.command = byte;
            self.pointer = u16::from(byte & 0x7F);
        } else if index == 1 && self.command & 0x80 == 0 {
            self.write(self.pointer, u16::from(byte), now);
        }
    }

    fn release(&mut self, _: Instant) {}
}
