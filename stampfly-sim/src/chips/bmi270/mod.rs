//! Emulator of the inertial sensor BMI270: Bosch BST-BMI270-DS000 ("DS" below), on SPI or I²C.
//!
//! | register | content | after reset | DS |
//! |---|---|---|---|
//! | 0x00 | identity 0x24 | | 5.2.1 |
//! | 0x02 | errors: bit 0 fatal | 0 | 5.2.2 |
//! | 0x03 | status: accelerometer (7), gyroscope (6) data ready, command ready (4) | 0x10 | 5.2.3 |
//! | 0x0C–0x11, 0x12–0x17 | accelerometer, gyroscope, low byte first | 0 | 5.2.8, 5.2.14 |
//! | 0x18–0x1A | time, 39.0625 µs | | 5.2.20 |
//! | 0x1B | event: bit 0 power-on, cleared by reading; (4:2) settings refused | 1 | 5.2.23 |
//! | 0x1D | interrupt status: accelerometer (7), gyroscope (6) ready, FIFO at its watermark (1), cleared by reading | 0 | 5.2.25 |
//! | 0x21 | (3:0) 0 not initialised, 1 ready, 2 failed | 0 | 5.2.30 |
//! | 0x22–0x23 | temperature, 1/512 K above 23 °C, 0x8000 invalid | 0x8000 | 5.2.31 |
//! | 0x24–0x25, 0x26 | FIFO fill level, FIFO data | 0 | 5.2.33 to 5.2.35 |
//! | 0x2F | page of the features, which are 0x30 to 0x3F | 0 | 5.2.36 |
//! | 0x32, 0x33 | page 1: longest burst; (0) retrim instead of a test of the gyroscope, (1) give it up | 0 | |
//! | 0x38 | page 0: (5:3) what became of the command to test | 0 | |
//! | 0x40, 0x41 | accelerometer filter and rate, range | 0xA8, 0x02 | 5.2.45, 5.2.46 |
//! | 0x42, 0x43 | gyroscope filter and rate, range | 0xA9, 0x00 | 5.2.47, 5.2.48 |
//! | 0x46, 0x47 | FIFO watermark, bytes (4:0 of the second) | 0x00, 0x02 | 5.2.51, 5.2.52 |
//! | 0x48, 0x49 | FIFO: stop when full (0), time (1); header (4), accelerometer (6), gyroscope (7) | 0x02, 0x10 | 5.2.53, 5.2.54 |
//! | 0x53 | interrupt pin 1: output (3), open drain (2), active high (1) | 0 | 5.2.63 |
//! | 0x55 | bit 0: interrupts are latched | 0 | 5.2.65 |
//! | 0x58 | to pin 1: data ready (2), FIFO watermark (1) | 0 | 5.2.68 |
//! | 0x59 | 0 prepares, 1 ends the upload | 0 | 5.2.69 |
//! | 0x38 | page 0: (5:3) result of the test command | 0 | |
//! | 0x69 | bit 2: a test of the gyroscope runs | 0 | 5.2.75 |
//! | 0x6D | accelerometer self test: on (0), positive (2), large (3) | 0 | 5.2.79 |
//! | 0x6E | gyroscope self test: done (0), x, y, z in order (1 to 3) | 0 | 5.2.80 |
//! | 0x7C | bit 0: advanced power save | 0x03 | 5.2.98 |
//! | 0x7D | gyroscope (1), accelerometer (2), temperature (3) on | 0 | 5.2.99 |
//! | 0x7E | 0xB6 resets, 0xB0 empties the FIFO, 0x02 tests the gyroscope | 0 | 5.2.100 |
//!
//! The section numbers of single registers follow the order of the register map and are
//! *unverified*; the contents are those of the map in DS 5.1.
//!
//! A read has one dummy byte before the data (DS 6.3). The chip starts on I²C and switches to SPI
//! at the first rising edge of chip select, so the first transfer after power-on and after a reset
//! is lost (DS 6.1). A read continues with the next register, except at 0x26 and 0x5E. In advanced
//! power save neither the FIFO nor the upload is accessible, and writes need 450 µs between them,
//! otherwise 2 µs (DS 4.4, 6.5).
//!
//! Over I²C, at 0x68 or 0x69, the chip answers as long as chip select stays high; reads then have
//! no dummy byte (DS 6.4).
//!
//! *Unverified* about pin 1: that it follows the watermark while it is not latched, that data ready
//! is a pulse of 312 µs, and that a latched interrupt is set again immediately while its cause
//! persists. On the board the pin has a pull-up, so it is high while it is not an output, and open
//! drain makes no difference. For the self-tests see `self_test.rs`.
//!
//! The time counts sixteen ticks per sample, and samples fall on multiples of sixteen: Bosch
//! documents this for related parts (BMI160, 2.3.1 table 11; BMA400, "Sensor Time"), and their
//! drivers rely on it.
//!
//! *Unverified*: accesses during the 2 ms of a start are ignored and read as zero; writes too close
//! together are lost; upload data not announced by a zero in 0x59 are ignored; sensors do not start
//! before the upload has succeeded; 10 ms from the end of an upload to its result; first data 2 ms
//! (accelerometer) and 45 ms (gyroscope) after being switched on; a plain mean as filter at rates
//! below 1600 Hz; the four bytes after header 0x48. Not modelled: rates above 1600 Hz, interrupt
//! pin 2, FIFO downsampling, features, the auxiliary bus, filter delay.
mod bus;
mod fifo;
mod interrupt;
mod interrupt_pin;
mod registers;
mod sampling;
mod self_test;

use super::{Chip, Flaw};
use crate::sensors::imu::ImuPhysics;
use crate::sensors::schedule::Schedule;
use crate::time::Clock;
use crate::world::World;
use fifo::Fifo;
use interrupt::Interrupt;
pub use interrupt_pin::InterruptPin;
use self_test::SelfTest;
use stampfly_types::{Duration, Instant};

const ID: u16 = 0x00;
const STATUS: u16 = 0x03;
const ACCEL: u16 = 0x0C;
const GYRO: u16 = 0x12;
const TIME: u16 = 0x18;
const EVENT: u16 = 0x1B;
const INTERRUPTS: u16 = 0x1D;
const INTERNAL_STATUS: u16 = 0x21;
const TEMPERATURE: u16 = 0x22;
const FIFO_LENGTH: u16 = 0x24;
const FIFO_DATA: u16 = 0x26;
const FEATURE_PAGE: u16 = 0x2F;
/// Page 1: longest burst, and selection of the gyroscope's test.
const TEST_WORD_LOW: u16 = 0x32;
const TEST_WORD_HIGH: u16 = 0x33;
/// Page 0: result of the test command.
const TEST_STATUS: u16 = 0x38;
const ACCEL_SETTINGS: u16 = 0x40;
const ACCEL_RANGE: u16 = 0x41;
const GYRO_SETTINGS: u16 = 0x42;
const GYRO_RANGE: u16 = 0x43;
const WATERMARK: u16 = 0x46;
const FIFO_MODE: u16 = 0x48;
const FIFO_CONTENT: u16 = 0x49;
const INTERRUPT_PIN: u16 = 0x53;
const LATCH: u16 = 0x55;
const INTERRUPT_MAP: u16 = 0x58;
const UPLOAD_CONTROL: u16 = 0x59;
const UPLOAD_ADDRESS_LOW: u16 = 0x5B;
const UPLOAD_ADDRESS_HIGH: u16 = 0x5C;
const UPLOAD_DATA: u16 = 0x5E;
const GYRO_TEST: u16 = 0x69;
const ACCEL_SELF_TEST: u16 = 0x6D;
const GYRO_SELF_TEST: u16 = 0x6E;
const POWER_SAVE: u16 = 0x7C;
const POWER: u16 = 0x7D;
const COMMAND: u16 = 0x7E;

/// Values after reset that are not zero.
const AFTER_RESET: [(u16, u8); 11] = [
    (ACCEL_SETTINGS, 0xA8),
    (ACCEL_RANGE, 0x02),
    (GYRO_SETTINGS, 0xA9),
    (0x44, 0x46),
    (0x45, 0x88),
    (0x47, 0x02),
    (FIFO_MODE, 0x02),
    (FIFO_CONTENT, 0x10),
    (EVENT, 0x01),
    (TEMPERATURE + 1, 0x80),
    (POWER_SAVE, 0x03),
];
/// [`TEST_STATUS`]: the test command was not prepared.
const NOT_PREPARED: u8 = 0x08;
const READY_ACCEL: u8 = 0x80;
const READY_GYRO: u8 = 0x40;
const COMMAND_READY: u8 = 0x10;
/// FIFO at its watermark, in the interrupt status and in the map of pin 1.
const AT_WATERMARK: u8 = 0x02;
/// Data ready, in the map of pin 1.
const DATA_READY: u8 = 0x04;
const START_UP: Duration = Duration::from_micros(2_000);
const UPLOAD_CHECK: Duration = Duration::from_micros(10_000);
const ACCEL_START: Duration = Duration::from_micros(2_000);
const GYRO_START: Duration = Duration::from_micros(45_000);
/// Rate code of 1600 Hz.
const FASTEST: u8 = 0x0C;
/// Size of the memory for the upload, bytes.
const UPLOAD_SIZE: usize = 8_192;

/// The emulator. The same seed gives the same specimen as [`ImuModel`](crate::sensors::ImuModel).
///
/// ```
/// use embedded_hal::spi::SpiDevice;
/// use stampfly_sim::chips::{Bmi270, SpiBus};
/// use stampfly_sim::{Simulation, SimulationConfig};
/// use stampfly_types::Instant;
///
/// let simulation = Simulation::new(&SimulationConfig::example());
/// let clock = simulation.clock.clone();
/// let image = [0x5A; 8192];
/// let chip = Bmi270::new(&simulation.world, &clock, 1, 1.0, &image);
/// let (mut port, _) = SpiBus::new(&clock, 1).attach(8_000_000, chip);
/// clock.advance_to(Instant::from_millis(2));
/// let mut answer = [0; 3];
/// port.transfer(&mut answer, &[0x80])?; // chooses SPI
/// port.transfer(&mut answer, &[0x80])?;
/// assert_eq!(answer[2], 0x24, "after one byte without meaning");
/// # Ok::<(), stampfly_sim::chips::BusError>(())
/// ```
#[derive(Debug)]
pub struct Bmi270 {
    physics: ImuPhysics,
    schedule: Schedule,
    /// Number of the next sample at 1600 Hz.
    tick: u64,
    id: u8,
    image: Vec<u8>,
    memory: Vec<u8>,
    registers: [u8; 128],
    /// End of the start-up.
    ready: Instant,
    /// Origin of the chip's time.
    epoch: Instant,
    spi: bool,
    /// Writes before this instant are ignored.
    idle_until: Instant,
    /// The present transfer began late enough to be accepted.
    accepts: bool,
    /// The upload has been announced.
    prepared: bool,
    /// End of the check of an upload.
    check: Option<Instant>,
    /// Byte address of the upload.
    address: usize,
    /// Instants at which accelerometer and gyroscope were switched on; `None` while off.
    on: [Option<Instant>; 2],
    /// Sums and numbers of samples since the last output, accelerometer and gyroscope.
    sums: [([f64; 3], u64); 2],
    fifo: Fifo,
    interrupt: Interrupt,
    self_test: SelfTest,
    /// The features' control word and result of gyroscope tests.
    test_word: [u8; 2],
    test_status: u8,
    /// The sensing elements are broken.
    broken: bool,
    flaw: Option<Flaw>,
    /// Address byte of this transfer.
    command: u8,
    pointer: u16,
    /// Copy of the data registers at the start of the present transfer.
    shadow: [u8; 12],
}

impl Bmi270 {
    /// A chip after power-on. `image` is the configuration that its check accepts, at most 8192
    /// bytes: the manufacturer's file or a placeholder. `vibration` is that of
    /// [`SimulationConfig`](crate::SimulationConfig).
    #[must_use]
    pub fn new(world: &World, clock: &Clock, seed: u64, vibration: f64, image: &[u8]) -> Self {
        let now = clock.now();
        let (physics, schedule) = ImuPhysics::new(world, now, seed, vibration);
        let mut chip = Self {
            physics,
            schedule,
            tick: 0,
            id: 0x24,
            image: image.iter().copied().take(UPLOAD_SIZE).collect(),
            memory: Vec::new(),
            registers: [0; 128],
            ready: now,
            epoch: now,
            spi: false,
            idle_until: now,
            accepts: false,
            prepared: false,
            check: None,
            address: 0,
            on: [None; 2],
            sums: Default::default(),
            fifo: Fifo::default(),
            interrupt: Interrupt::default(),
            self_test: SelfTest::default(),
            test_word: [0; 2],
            test_status: 0,
            broken: false,
            flaw: None,
            command: 0,
            pointer: 0,
            shadow: [0; 12],
        };
        chip.reset(now);
        chip
    }

    fn register(&self, register: u16) -> u8 {
        self.registers[usize::from(register & 0x7F)]
    }

    fn set(&mut self, register: u16, value: u8) {
        self.registers[usize::from(register & 0x7F)] = value;
    }

    fn saves_power(&self) -> bool {
        self.register(POWER_SAVE) & 1 != 0
    }

    /// The chip's 24-bit time at `at`.
    fn time(&self, at: Instant) -> [u8; 3] {
        let ticks = (16.0 * (self.schedule.phase(at) - self.schedule.phase(self.epoch).floor())) as u32;
        let [low, middle, high, _] = ticks.to_le_bytes();
        [low, middle, high]
    }

    fn update(&mut self, now: Instant) {
        if let Some(instant) = self.check.filter(|instant| *instant <= now) {
            self.check = None;
            let complete = !self.memory.is_empty() && self.memory.starts_with(&self.image);
            self.set(INTERNAL_STATUS, if complete { 1 } else { 2 });
            self.switch(instant);
        }
        if self.self_test.gyro_ends(now) {
            self.set(GYRO_SELF_TEST, if self.broken { 0x01 } else { 0x0F });
            self.set(GYRO_TEST, self.register(GYRO_TEST) & !0x04);
        }
        while self.schedule.instant(self.tick) <= now {
            let at = self.schedule.instant(self.tick);
            self.end_pulse(at);
            self.tick += 1;
            if self.on != [None; 2] {
                self.sample(at);
                self.drive_pin();
            }
        }
        self.end_pulse(now);
    }

    /// The earliest instant at which the state can change without a transfer.
    fn next_event(&self) -> Option<Instant> {
        let sample = (self.on != [None; 2]).then(|| self.schedule.instant(self.tick));
        [sample, self.check, self.interrupt.pulse_ends()].into_iter().flatten().min()
    }

    fn end_pulse(&mut self, now: Instant) {
        if self.interrupt.end_pulse(now) {
            self.drive_pin();
        }
    }

    /// True if the FIFO has reached its watermark, which is at least one byte (DS 4.8).
    fn at_watermark(&self) -> bool {
        let bytes = usize::from(self.register(WATERMARK)) | usize::from(self.register(WATERMARK + 1) & 0x1F) << 8;
        self.fifo.len() >= bytes.max(1)
    }

    /// Sets pin 1 according to settings and interrupt causes.
    fn drive_pin(&mut self) {
        let map = self.register(INTERRUPT_MAP);
        let request = map & AT_WATERMARK != 0 && self.at_watermark()
            || map & DATA_READY != 0 && self.interrupt.pulse_ends().is_some();
        self.interrupt.drive(request, self.register(LATCH) & 1 != 0, self.register(INTERRUPT_PIN));
    }
}
