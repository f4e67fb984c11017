//! Emulator of the inertial sensor MPU-6000: InvenSense's register map RM-MPU-6000A 4.2 ("RM") and
//! product specification PS-MPU-6000A 3.4 ("PS"), on SPI.
//!
//! | register | content | after reset | RM |
//! |---|---|---|---|
//! | 0x0D–0x10 | factory trim of the self-test, five bits per axis and sensor | a specimen's | 4.1 |
//! | 0x19 | divider of the sample rate, less one | 0 | 4.2 |
//! | 0x1A | low-pass (2:0); with 0 and 7 the gyroscope has 8 kHz, otherwise 1 kHz | 0 | 4.3 |
//! | 0x1B, 0x1C | gyroscope, accelerometer: self test (7:5), range (4:3) | 0 | 4.4, 4.5 |
//! | 0x3A | interrupt status: data ready (0), cleared by reading | 0 | 4.16 |
//! | 0x3B–0x48 | accelerometer, temperature, gyroscope, high byte first | 0 | 4.17 to 4.19 |
//! | 0x68 | resets the signal paths of gyroscope (2), accelerometer (1), temperature (0) | 0 | 4.27 |
//! | 0x6A | no I²C (4) | 0 | 4.29 |
//! | 0x6B | reset (7), sleep (6), temperature off (3), clock (2:0) | 0x40 | 4.30 |
//! | 0x75 | identity 0x68 | | 4.34 |
//!
//! Bit 7 of 0x6B resets; 0x08 switches the temperature sensor and resets nothing. After a reset the
//! chip sleeps and its data are zero. A burst read of the data has one instant: the data are copied
//! when the chip select falls (RM 4.17). The accelerometer has 1 kHz; its samples repeat at higher
//! rates (RM 4.2). Sensor and interrupt registers may be read at up to 20 MHz, all others are
//! limited to 1 MHz (PS 6.5).
//!
//! *Unverified*: on a faster clock the other registers read all ones and ignore writes; the chip
//! does not respond for 100 ms after power-on and after a reset (the sheets require this wait); the
//! gyroscope's first data come 30 ms after waking (PS 6.1 says when they are valid), and the
//! accelerometer's immediately; the filter, a first-order low-pass; registers not named here read
//! back the value written; a stopped clock freezes the data. Section numbers follow the order of
//! the register map. Not modelled: FIFO, interrupt pin, I²C and the auxiliary bus, low-power
//! cycles, axes in standby, motion detection, drift.

pub(crate) mod physics;

use super::{Chip, Flaw, SpiChip};
use crate::sensors::imu::to_counts;
use crate::sensors::schedule::Schedule;
use crate::time::Clock;
use crate::world::World;
use physics::{ACCEL_TICKS, Physics};
use stampfly_types::{Duration, GRAVITY, Instant};

const SELF_TEST: usize = 0x0D;
const DIVIDER: u16 = 0x19;
const FILTER: u16 = 0x1A;
const GYRO_CONFIG: u16 = 0x1B;
const ACCEL_CONFIG: u16 = 0x1C;
const INTERRUPT_STATUS: u16 = 0x3A;
const DATA: usize = 0x3B;
const PATH_RESET: u16 = 0x68;
const POWER: u16 = 0x6B;
const IDENTITY: u16 = 0x75;
/// Time from power-on or reset to the first access (PS 6.3; RM 4.30).
const START_UP: Duration = Duration::from_micros(100_000);
/// Time from waking to the gyroscope's data (PS 6.1).
const GYRO_START: Duration = Duration::from_micros(30_000);
/// Least time of a byte at 1 MHz, minus the rounding to whole microseconds.
const SLOW_BYTE: Duration = Duration::from_micros(7);
const DEGREE: f64 = core::f64::consts::PI / 180.0;
/// Factory trim of the specimen for x, y, z: accelerometer, gyroscope; five bits each.
const TRIM: [[u8; 3]; 2] = [[14, 17, 11], [12, 15, 18]];

/// The emulator.
///
/// ```
/// use embedded_hal::spi::SpiDevice;
/// use stampfly_sim::chips::{Mpu6000, SpiBus};
/// use stampfly_sim::{Simulation, SimulationConfig};
/// use stampfly_types::Instant;
///
/// let simulation = Simulation::new(&SimulationConfig::example());
/// let clock = simulation.clock.clone();
/// let (mut port, _) = SpiBus::new(&clock, 1).attach(1_000_000, Mpu6000::new(&simulation.world, &clock, 1, 1.0));
/// clock.advance_to(Instant::from_millis(100));
/// let mut answer = [0; 2];
/// port.transfer(&mut answer, &[0xF5])?;
/// assert_eq!(answer[1], 0x68);
/// # Ok::<(), stampfly_sim::chips::BusError>(())
/// ```
#[derive(Debug)]
pub struct Mpu6000 {
    physics: Physics,
    schedule: Schedule,
    /// Number of the next tick at 8 kHz.
    tick: u64,
    id: u8,
    registers: [u8; 128],
    /// End of the start-up.
    ready: Instant,
    /// Instant of waking; `None` while asleep.
    awake: Option<Instant>,
    /// Wake-up requests ignored since the last reset.
    slept: u32,
    /// Last samples of accelerometer and gyroscope, counts.
    sampled: [[i16; 3]; 2],
    broken: bool,
    flaw: Option<Flaw>,
    /// Address byte of this transfer, and its instant.
    command: u8,
    commanded: Instant,
    /// Copy of the data at the start of this transfer.
    shadow: [u8; 14],
}

impl Mpu6000 {
    /// A chip after power-on. `vibration` is that of [`SimulationConfig`](crate::SimulationConfig).
    #[must_use]
    pub fn new(world: &World, clock: &Clock, seed: u64, vibration: f64) -> Self {
        let now = clock.now();
        let (physics, schedule) = Physics::new(world, clock, seed, vibration);
        let mut chip = Self {
            physics,
            schedule,
            tick: 0,
            id: 0x68,
            registers: [0; 128],
            ready: now,
            awake: None,
            slept: 0,
            sampled: [[0; 3]; 2],
            broken: false,
            flaw: None,
            command: 0,
            commanded: now,
            shadow: [0; 14],
        };
        chip.reset(now);
        chip
    }

    fn register(&self, register: u16) -> u8 {
        self.registers[usize::from(register & 0x7F)]
    }

    /// Advances the chip to `now`.
    fn update(&mut self, now: Instant) {
        while self.schedule.instant(self.tick) <= now {
            let (tick, at) = (self.tick, self.schedule.instant(self.tick));
            self.tick += 1;
            // The clock is stopped (RM 4.30).
            if self.register(POWER) & 7 == 7 {
                continue;
            }
            if let Some(awake) = self.awake.filter(|awake| *awake <= at) {
                self.sample(tick, awake, at);
            }
        }
    }

    fn sample(&mut self, tick: u64, awake: Instant, at: Instant) {
        let filter = self.register(FILTER) & 7;
        let fast = filter == 0 || filter == 7;
        self.physics.tick(tick, filter % 7, at);
        let [accel, gyro] = self.physics.filtered().map(|body| Flaw::turn(self.flaw, body));
        // The chip is mounted such that body is (y, x, −z) of the chip.
        let axes = [[accel[1], accel[0], -accel[2]], [gyro[1], gyro[0], -gyro[2]]];
        if tick.is_multiple_of(ACCEL_TICKS) {
            self.sampled[0] = self.convert(0, axes[0]);
        }
        // With a filter the gyroscope has 1 kHz as well.
        if (fast || tick.is_multiple_of(ACCEL_TICKS)) && at.since(awake) >= GYRO_START {
            self.sampled[1] = self.convert(1, axes[1]);
        }
        let period = (u64::from(self.register(DIVIDER)) + 1) * if fast { 1 } else { ACCEL_TICKS };
        if tick.is_multiple_of(period) && self.flaw != Some(Flaw::Stuck) {
            self.publish(at);
        }
    }

    /// Counts of one sensor (PS 6.1, 6.2), including the self-test response (RM 4.1).
    fn convert(&self, sensor: usize, axes: [f64; 3]) -> [i16; 3] {
        let config = self.register([ACCEL_CONFIG, GYRO_CONFIG][sensor]);
        let range = config >> 3 & 3;
        let scale = if sensor == 0 {
            f64::from(16_384_u32 >> range) / f64::from(GRAVITY)
        } else {
            131.0 / f64::from(1_u8 << range) / DEGREE
        };
        core::array::from_fn(|axis| {
            if self.broken {
                return 0;
            }
            let code = f64::from(TRIM[sensor][axis]) - 1.0;
            let tested = config >> (7 - axis) & 1 != 0;
            let answer = match (tested, sensor) {
                (false, _) => 0.0,
                // Factory trim in counts at ±8 g and ±250 °/s.
                (true, 0) => 4096.0 * 0.34 * libm::pow(0.92 / 0.34, code / 30.0) / 4096.0 * f64::from(GRAVITY),
                (true, _) => {
                    let sign = if axis == 1 { -1.0 } else { 1.0 };
                    sign * 25.0 * 131.0 * libm::pow(1.046, code) / 131.0 * DEGREE
                }
            };
            // 3 % deviation from the factory trim.
            to_counts(axes[axis] + 1.03 * answer, scale)
        })
    }

    /// Copies the last samples to the data registers.
    fn publish(&mut self, at: Instant) {
        let temperature = if self.register(POWER) & 8 == 0 {
            to_counts(self.physics.temperature(at) - 36.53, 340.0)
        } else {
            i16::from_be_bytes([self.registers[DATA + 6], self.registers[DATA + 7]])
        };
        let [[ax, ay, az], [gx, gy, gz]] = self.sampled;
        for (place, value) in [ax, ay, az, temperature, gx, gy, gz].into_iter().enumerate() {
            self.registers[DATA + 2 * place..][..2].copy_from_slice(&value.to_be_bytes());
        }
        self.registers[usize::from(INTERRUPT_STATUS)] |= 1;
    }

    /// True if this register is accessible on the present clock, judged by the time since the
    /// address byte (PS 6.5).
    fn is_reachable(&self, now: Instant) -> bool {
        let register = usize::from(self.command & 0x7F);
        let reads_data = self.command & 0x80 != 0 && (usize::from(INTERRUPT_STATUS)..DATA + 14).contains(&register);
        reads_data || now.since(self.commanded) >= SLOW_BYTE
    }

    fn clear_data(&mut self) {
        self.registers[DATA..DATA + 14].fill(0);
        self.sampled = [[0; 3]; 2];
    }
}

impl Chip for Mpu6000 {
    fn read(&mut self, register: u16, now: Instant) -> u16 {
        if now < self.ready {
            return 0;
        }
        self.update(now);
        let register = register & 0x7F;
        let value = self.register(register);
        match register {
            IDENTITY => u16::from(self.id),
            INTERRUPT_STATUS => {
                self.registers[usize::from(INTERRUPT_STATUS)] = 0;
                u16::from(value)
            }
            _ => u16::from(value),
        }
    }

    fn write(&mut self, register: u16, value: u16, now: Instant) {
        if now < self.ready {
            return;
        }
        self.update(now);
        let (register, value) = (register & 0x7F, value as u8);
        match register {
            POWER if value & 0x80 != 0 => self.reset(now),
            POWER
                if value & 0x40 == 0 && matches!(self.flaw, Some(Flaw::Sleepy(requests)) if self.slept < requests) =>
            {
                self.slept += 1;
            }
            POWER => {
                self.registers[usize::from(POWER)] = value;
                let awake = value & 0x40 == 0;
                self.awake = awake.then(|| self.awake.unwrap_or(now));
            }
            // The bits clear themselves.
            PATH_RESET if value & 7 != 0 => {
                self.clear_data();
                self.awake = self.awake.map(|_| now);
            }
            0x0D..=0x10 | 0x3A..=0x48 | PATH_RESET | IDENTITY => {}
            _ => self.registers[usize::from(register)] = value,
        }
    }

    fn reset(&mut self, now: Instant) {
        self.registers = [0; 128];
        self.registers[usize::from(POWER)] = 0x40;
        let [accel, gyro] = TRIM;
        // Registers 0x0D to 0x0F: upper three bits of the accelerometer's trim and all of the
        // gyroscope's. 0x10: lower two bits of the accelerometer's (RM 4.1).
        for axis in 0..3 {
            self.registers[SELF_TEST + axis] = accel[axis] >> 2 << 5 | gyro[axis];
            self.registers[SELF_TEST + 3] |= (accel[axis] & 3) << (4 - 2 * axis);
        }
        self.sampled = [[0; 3]; 2];
        (self.ready, self.awake, self.slept) = (now + START_UP, None, 0);
    }

    fn set_id(&mut self, id: u16) {
        self.id = id as u8;
    }

    fn set_broken(&mut self, broken: bool) {
        self.broken = broken;
    }

    fn set_flaw(&mut self, flaw: Option<Flaw>) {
        self.flaw = flaw;
    }
}

impl SpiChip for Mpu6000 {
    const HIGHEST_CLOCK: u32 = 20_000_000;

    fn answer(&mut self, index: usize, now: Instant) -> u8 {
        let Some(offset) = index.checked_sub(1).filter(|_| self.command & 0x80 != 0) else { return 0xFF };
        if !self.is_reachable(now) {
            return 0xFF;
        }
        let register = (usize::from(self.command & 0x7F) + offset) & 0x7F;
        match register.checked_sub(DATA).and_then(|place| self.shadow.get(place)) {
            Some(byte) if now >= self.ready => *byte,
            _ => self.read(register as u16, now) as u8,
        }
    }

    fn take(&mut self, index: usize, byte: u8, now: Instant) {
        if index == 0 {
            (self.command, self.commanded) = (byte, now);
            self.update(now);
            self.shadow.copy_from_slice(&self.registers[DATA..DATA + 14]);
        } else if self.command & 0x80 == 0 && self.is_reachable(now) {
            self.write(u16::from(self.command & 0x7F) + index as u16 - 1, u16::from(byte), now);
        }
    }

    fn release(&mut self, _: Instant) {}
}
