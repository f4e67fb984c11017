//! I²C bus on virtual time, with the `async` and the blocking traits of embedded-hal.
//!
//! A transfer occupies the bus for its bits at 400 kHz. The chips process each byte at the instant
//! of its last bit, but only when the transfer is complete, so that the world is never advanced
//! beyond the clock. A future dropped before completion has transferred nothing, but the bus stays
//! busy for the planned time.

use super::fault::{Attached, Faults, carry};
use super::latency::Latency;
use super::{BusError, I2cChip, after};
use crate::noise::Noise;
use crate::time::Clock;
use core::cell::{Cell, RefCell};
use embedded_hal::i2c::{ErrorType, NoAcknowledgeSource, Operation};
use stampfly_types::{Duration, Instant};
use std::rc::Rc;

/// Time of a bit at 400 kHz, ns: fast mode of the I²C specification (UM10204, table 10).
const BIT: u64 = 2_500;
/// Bits per byte including its acknowledge.
const BYTE: u64 = 9;
/// Clock pulses after which a chip interrupted within a byte has released the data line (UM10204,
/// section 3.1.16).
const RECOVERY: u8 = 9;
/// Random stream of bit errors; no sensor uses this number.
const STREAM: u64 = 101;

struct Device {
    /// The address to which it was soldered.
    soldered: u8,
    chip: Rc<RefCell<dyn I2cChip>>,
    attached: Attached,
}

impl Device {
    fn answers(&self, address: u8) -> bool {
        self.chip.borrow().address(self.soldered) == Some(address)
    }
}

struct State {
    clock: Clock,
    devices: RefCell<Vec<Device>>,
    busy_until: Rc<Cell<Instant>>,
    /// Clock pulses until the data line is released.
    held: Cell<u8>,
    /// The data line is shorted to ground.
    shorted: Cell<bool>,
    noise: RefCell<Noise>,
    /// Every operation begins with a start condition.
    restarts: Cell<bool>,
    latency: Cell<Latency>,
}

/// A handle to the bus. Clones are the same bus; each driver can own one.
///
/// ```
/// use stampfly_sim::chips::{Bmp280, I2cBus};
/// use stampfly_sim::{Simulation, SimulationConfig};
/// use stampfly_types::Instant;
///
/// let simulation = Simulation::new(&SimulationConfig::example());
/// let clock = simulation.clock.clone();
/// let mut bus = I2cBus::new(&clock, 1);
/// bus.attach(0x76, Bmp280::new(&simulation.world, &clock, 1));
/// let mut id = [0];
/// embedded_hal::i2c::I2c::write_read(&mut bus, 0x76, &[0xD0], &mut id)?;
/// assert_eq!(clock.now(), Instant::from_micros(98), "39 bits: start, address, register, start, address, data, stop");
/// # Ok::<(), stampfly_sim::chips::BusError>(())
/// ```
#[derive(Clone)]
pub struct I2cBus(Rc<State>);

impl core::fmt::Debug for I2cBus {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let addresses: Vec<u8> =
            self.0.devices.borrow().iter().filter_map(|device| device.chip.borrow().address(device.soldered)).collect();
        f.debug_struct("I2cBus").field("addresses", &addresses).field("held", &self.0.held).finish_non_exhaustive()
    }
}

impl I2cBus {
    /// A bus without chips. `seed` draws bit errors and refusals.
    #[must_use]
    pub fn new(clock: &Clock, seed: u64) -> Self {
        Self(Rc::new(State {
            clock: clock.clone(),
            devices: RefCell::default(),
            busy_until: Rc::new(Cell::new(clock.now())),
            held: Cell::new(0),
            shorted: Cell::new(false),
            noise: RefCell::new(Noise::new(seed, STREAM)),
            restarts: Cell::new(false),
            latency: Cell::default(),
        }))
    }

    /// Sends a start condition before every operation, also between two of the same direction,
    /// which embedded-hal requires to be joined. Linux and some controllers' drivers send each
    /// operation as a separate message.
    pub fn restart_between_operations(&self) {
        self.0.restarts.set(true);
    }

    /// Sets the software latency: once per transfer for set-up, and once per operation for waking
    /// the task unless it is polled.
    pub fn set_latency(&self, latency: Latency) {
        self.0.latency.set(latency);
    }

    /// Attaches a chip at a 7-bit address. Chips with the same address all receive writes, and
    /// reads are the AND of their bytes, because any of them pulls the line low.
    pub fn attach(&self, address: u8, mut chip: impl I2cChip + 'static) -> Attached {
        chip.wire(&self.0.busy_until);
        let chip = Rc::new(RefCell::new(chip));
        let attached = Attached::new(&self.0.clock, chip.clone());
        self.0.devices.borrow_mut().push(Device { soldered: address, chip, attached: attached.clone() });
        attached
    }

    /// Makes a chip hold the data line low, as after an interrupted byte, until nine clock pulses.
    pub fn hold_sda(&self) {
        self.0.held.set(RECOVERY);
    }

    /// Shorts the data line to ground, or removes the short. Clock pulses do not release it.
    pub fn short_sda(&self, shorted: bool) {
        self.0.shorted.set(shorted);
    }

    /// True if the data line is released.
    #[must_use]
    pub fn sda_is_high(&self) -> bool {
        self.0.held.get() == 0 && !self.0.shorted.get()
    }

    /// One pulse of the clock line outside a transfer. Takes no time; the caller waits between
    /// edges.
    pub fn pulse_scl(&self) {
        self.0.held.set(self.0.held.get().saturating_sub(1));
    }

    /// The bus's clock.
    pub(super) fn clock(&self) -> Clock {
        self.0.clock.clone()
    }

    /// Time for which the chips at this address stretch the clock; `None` if none acknowledges.
    fn stretch(&self, address: u8) -> Option<Duration> {
        let acknowledges = |faults: &Faults| {
            let refused = faults.refusals > 0.0 && self.0.noise.borrow_mut().chance(faults.refusals);
            !faults.dead && !refused
        };
        let devices = self.0.devices.borrow();
        let answering = devices.iter().filter(|device| device.answers(address)).map(|device| device.attached.faults());
        answering.filter(acknowledges).map(|faults| faults.stretch).max()
    }

    /// Occupies the bus. Returns start, end, and errors already known.
    fn begin(&self, address: u8, operations: &[Operation<'_>]) -> (Instant, Instant, Result<(), BusError>) {
        let mut latency = self.0.latency.get();
        if latency.jitter > Duration::ZERO {
            latency = latency.drawn(self.0.noise.borrow_mut().unit());
        }
        let start = self.0.clock.now() + latency.setup;
        // Each operation that is not polled ends with an interrupt and a wake of the task.
        let woken = operations.iter().fold(Duration::ZERO, |late, operation| {
            late + latency.of_bytes(match operation {
                Operation::Read(bytes) => bytes.len(),
                Operation::Write(bytes) => bytes.len(),
            })
        });
        let (bits, stretch, outcome) = match self.stretch(address) {
            // The controller fails at the start condition, after one bit.
            _ if !self.sda_is_high() => (1, Duration::ZERO, Err(BusError::ArbitrationLost)),
            None => (2 + BYTE, Duration::ZERO, Err(BusError::NoAcknowledge(NoAcknowledgeSource::Address))),
            Some(stretch) => (self.length(operations), stretch, Ok(())),
        };
        let end = start + Duration::from_micros((bits * BIT).div_ceil(1_000)) + stretch + woken;
        self.0.busy_until.set(end);
        (start, end, outcome)
    }

    /// Number of bits of a transfer: a start and the address at every change of direction (or
    /// before every operation), the bytes, and the stop.
    fn length(&self, operations: &[Operation<'_>]) -> u64 {
        let mut before = None;
        operations.iter().fold(1, |bits, operation| {
            let (direction, bytes) = match operation {
                Operation::Read(bytes) => (Some(true), bytes.len()),
                Operation::Write(bytes) => (Some(false), bytes.len()),
            };
            let starts = core::mem::replace(&mut before, direction) != direction || self.0.restarts.get();
            bits + BYTE * bytes as u64 + if starts { 1 + BYTE } else { 0 }
        })
    }

    /// Exchanges the bytes of a transfer that began at `start`.
    fn exchange(&self, address: u8, operations: &mut [Operation<'_>], start: Instant) -> Result<(), BusError> {
        let devices = self.0.devices.borrow();
        let answering = |device: &&Device| device.answers(address) && !device.attached.faults().dead;
        let answering: Vec<&Device> = devices.iter().filter(answering).collect();
        if answering.is_empty() {
            return Err(BusError::NoAcknowledge(NoAcknowledgeSource::Address));
        }
        let errors = |device: &Device| device.attached.faults().bit_errors;
        let mut noise = self.0.noise.borrow_mut();
        let (mut bits, mut index, mut before) = (0, 0, None);
        for operation in operations {
            let direction = Some(matches!(operation, Operation::Read(_)));
            if core::mem::replace(&mut before, direction) != direction || self.0.restarts.get() {
                bits += 1 + BYTE;
                index = 0;
            }
            match operation {
                Operation::Write(bytes) => {
                    for byte in *bytes {
                        bits += BYTE;
                        let mut acknowledged = false;
                        for device in &answering {
                            let byte = carry(*byte, errors(device), &mut noise);
                            acknowledged |= device.chip.borrow_mut().receive(index, byte, after(start, bits * BIT));
                        }
                        if !acknowledged {
                            return Err(BusError::NoAcknowledge(NoAcknowledgeSource::Data));
                        }
                        index += 1;
                    }
                }
                Operation::Read(bytes) => {
                    for byte in bytes.iter_mut() {
                        bits += BYTE;
                        *byte = answering.iter().fold(0xFF, |byte, device| {
                            let sent = device.chip.borrow_mut().send(index, after(start, bits * BIT));
                            byte & carry(sent, errors(device), &mut noise)
                        });
                        index += 1;
                    }
                }
            }
        }
        for device in &answering {
            device.chip.borrow_mut().stop(after(start, bits * BIT));
        }
        Ok(())
    }
}

impl ErrorType for I2cBus {
    type Error = BusError;
}

impl embedded_hal_async::i2c::I2c for I2cBus {
    async fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), BusError> {
        while self.0.busy_until.get() > self.0.clock.now() {
            self.0.clock.sleep_until(self.0.busy_until.get()).await;
        }
        let (start, end, outcome) = self.begin(address, operations);
        self.0.clock.sleep_until(end).await;
        outcome?;
        self.exchange(address, operations, start)
    }
}

impl embedded_hal::i2c::I2c for I2cBus {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), BusError> {
        self.0.clock.advance_to(self.0.busy_until.get());
        let (start, end, outcome) = self.begin(address, operations);
        self.0.clock.advance_to(end);
        outcome?;
        self.exchange(address, operations, start)
    }
}
