//! An SPI bus on virtual time: one [`SpiPort`] per chip select, each with its own clock rate.
//!
//! Time works as on [`I2cBus`](super::I2cBus): a transfer costs its bits and its delays, and no other chip gets the
//! bus meanwhile. Clock polarity is not modelled.

use super::fault::{Attached, carry};
use super::{BusError, SpiChip, after};
use crate::noise::Noise;
use crate::time::Clock;
use core::cell::{Cell, RefCell};
use embedded_hal::spi::{ErrorType, Operation};
use stampfly_types::{Duration, Instant};
use std::rc::Rc;

/// Share of the bits that a chip with a floating select spoils by answering into the same line: its select is taken for
/// low some of the time, and half of its bits are wrong. *Unverified*: a floating line may do anything.
const DISTURBANCE: f64 = 0.05;
/// Share of the bits that are wrong on a clock faster than the chip allows. *Unverified*: some chips take a little more.
const TOO_FAST: f64 = 0.05;
/// Stream of the bit errors; no sensor has this number.
const STREAM: u64 = 102;

struct State {
    clock: Clock,
    busy_until: Cell<Instant>,
    noise: RefCell<Noise>,
    /// How many chip selects nobody drives.
    floating: Cell<u32>,
    /// The byte that every transfer reads, when the line from the chips is stuck.
    stuck: Cell<Option<u8>>,
}

/// The wires that all chips share.
#[derive(Clone)]
pub struct SpiBus(Rc<State>);

impl core::fmt::Debug for SpiBus {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SpiBus").field("busy_until", &self.0.busy_until).finish_non_exhaustive()
    }
}

impl SpiBus {
    /// A bus without chips. The seed decides on bit errors and refusals.
    #[must_use]
    pub fn new(clock: &Clock, seed: u64) -> Self {
        let noise = RefCell::new(Noise::new(seed, STREAM));
        Self(Rc::new(State {
            clock: clock.clone(),
            busy_until: Cell::new(clock.now()),
            noise,
            floating: Cell::new(0),
            stuck: Cell::new(None),
        }))
    }

    /// Solders a chip to the bus and to a chip select of its own, which is driven high. `frequency` is the clock for
    /// this chip, Hz; above the [highest](SpiChip::HIGHEST_CLOCK) that it allows its transfers are garbled.
    pub fn attach<C: SpiChip + 'static>(&self, frequency: u32, chip: C) -> (SpiPort<C>, Attached) {
        self.solder(frequency, chip, false)
    }

    /// The same with a chip select that floats: as long as nobody drives it, by [`SpiPort::park`] or a first transfer,
    /// the chip disturbs what the others answer. So does a flow sensor of the StampFly that is not looked after before
    /// the inertial sensor is asked.
    pub fn attach_floating<C: SpiChip + 'static>(&self, frequency: u32, chip: C) -> (SpiPort<C>, Attached) {
        self.solder(frequency, chip, true)
    }

    /// The line from the chips is stuck: high, low, or free again with `None`. What is sent still arrives.
    pub fn hold_miso(&self, level: Option<bool>) {
        self.0.stuck.set(level.map(|high| if high { 0xFF } else { 0 }));
    }

    fn solder<C: SpiChip + 'static>(&self, frequency: u32, chip: C, floating: bool) -> (SpiPort<C>, Attached) {
        self.0.floating.set(self.0.floating.get() + u32::from(floating));
        let chip = Rc::new(RefCell::new(chip));
        let attached = Attached::new(&self.0.clock, chip.clone());
        let byte = 8_000_000_000 / u64::from(frequency.max(1));
        let garbled = if frequency > C::HIGHEST_CLOCK { TOO_FAST } else { 0.0 };
        (
            SpiPort {
                bus: self.clone(),
                chip,
                attached: attached.clone(),
                byte,
                garbled,
                floating: Cell::new(floating),
            },
            attached,
        )
    }
}

/// One chip's place on the bus. Implements the `SpiDevice` traits of embedded-hal, `async` and blocking.
pub struct SpiPort<C> {
    bus: SpiBus,
    chip: Rc<RefCell<C>>,
    attached: Attached,
    /// Nanoseconds per byte.
    byte: u64,
    /// Share of the bits that this clock spoils.
    garbled: f64,
    /// Nobody has driven the chip select yet.
    floating: Cell<bool>,
}

impl<C: SpiChip> core::fmt::Debug for SpiPort<C> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SpiPort").field("chip", &self.chip).finish_non_exhaustive()
    }
}

impl<C> SpiPort<C> {
    /// Drives the chip select, high until the next transfer.
    pub fn park(&self) {
        let others = self.bus.0.floating.get() - u32::from(self.floating.take());
        self.bus.0.floating.set(others);
    }

    /// The wires that it shares with others.
    #[must_use]
    pub fn bus(&self) -> SpiBus {
        self.bus.clone()
    }

    /// The clock of the bus and the chip, for pins that the chip has beside it.
    pub(super) fn chip(&self) -> (Clock, Rc<RefCell<C>>) {
        (self.bus.0.clock.clone(), self.chip.clone())
    }
}

impl<C: SpiChip> SpiPort<C> {
    /// Takes the bus. Returns the start, the end, and what is already known to fail.
    fn begin(&self, operations: &[Operation<'_, u8>]) -> (Instant, Instant, Result<(), BusError>) {
        self.park();
        let state = &self.bus.0;
        let start = state.clock.now();
        let refusals = self.attached.faults().refusals;
        let refused = refusals > 0.0 && state.noise.borrow_mut().chance(refusals);
        let nanoseconds: u64 = operations
            .iter()
            .map(|operation| match operation {
                Operation::Read(bytes) => self.byte * bytes.len() as u64,
                Operation::Write(bytes) => self.byte * bytes.len() as u64,
                Operation::Transfer(read, write) => self.byte * read.len().max(write.len()) as u64,
                Operation::TransferInPlace(bytes) => self.byte * bytes.len() as u64,
                Operation::DelayNs(delay) => u64::from(*delay),
            })
            .sum();
        let end = start + Duration::from_micros(nanoseconds.div_ceil(1_000));
        state.busy_until.set(end);
        (start, end, if refused { Err(BusError::Overrun) } else { Ok(()) })
    }

    /// Exchanges the bytes of a transfer that began at `start` and ended at `end`.
    fn exchange(&self, operations: &mut [Operation<'_, u8>], start: Instant, end: Instant) {
        let faults = self.attached.faults();
        let disturbance = if self.bus.0.floating.get() > 0 { DISTURBANCE } else { 0.0 };
        let mut chip = self.chip.borrow_mut();
        let mut noise = self.bus.0.noise.borrow_mut();
        let (mut index, mut nanoseconds) = (0, 0);
        let stuck = self.bus.0.stuck.get();
        let mut byte = |out: u8, nanoseconds: u64| {
            if faults.dead {
                return stuck.unwrap_or(0xFF);
            }
            let errors = faults.bit_errors.max(self.garbled);
            let out = carry(out, errors, &mut noise);
            let answer = chip.exchange(index, out, after(start, nanoseconds));
            index += 1;
            stuck.unwrap_or(carry(answer, errors.max(disturbance), &mut noise))
        };
        for operation in operations {
            match operation {
                Operation::Read(bytes) => bytes.iter_mut().for_each(|slot| {
                    nanoseconds += self.byte;
                    *slot = byte(0, nanoseconds);
                }),
                Operation::Write(bytes) => bytes.iter().for_each(|out| {
                    nanoseconds += self.byte;
                    byte(*out, nanoseconds);
                }),
                Operation::Transfer(read, write) => {
                    for place in 0..read.len().max(write.len()) {
                        nanoseconds += self.byte;
                        let answer = byte(write.get(place).copied().unwrap_or(0), nanoseconds);
                        if let Some(slot) = read.get_mut(place) {
                            *slot = answer;
                        }
                    }
                }
                Operation::TransferInPlace(bytes) => bytes.iter_mut().for_each(|slot| {
                    nanoseconds += self.byte;
                    *slot = byte(*slot, nanoseconds);
                }),
                Operation::DelayNs(delay) => nanoseconds += u64::from(*delay),
            }
        }
        if !faults.dead {
            chip.release(end);
        }
    }
}

impl<C> ErrorType for SpiPort<C> {
    type Error = BusError;
}

impl<C: SpiChip> embedded_hal_async::spi::SpiDevice for SpiPort<C> {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), BusError> {
        let state = self.bus.0.clone();
        while state.busy_until.get() > state.clock.now() {
            state.clock.sleep_until(state.busy_until.get()).await;
        }
        let (start, end, outcome) = self.begin(operations);
        state.clock.sleep_until(end).await;
        outcome?;
        self.exchange(operations, start, end);
        Ok(())
    }
}

impl<C: SpiChip> embedded_hal::spi::SpiDevice for SpiPort<C> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), BusError> {
        let state = self.bus.0.clone();
        state.clock.advance_to(state.busy_until.get());
        let (start, end, outcome) = self.begin(operations);
        state.clock.advance_to(end);
        outcome?;
        self.exchange(operations, start, end);
        Ok(())
    }
}
