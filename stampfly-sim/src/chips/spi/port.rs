//! One chip on an SPI bus: timing and data of its driver's transfers.

use super::analyser::Seen;
use super::bus::SpiBus;
use super::wire::{self, BitOrder, Controller, Levels, Wire};
use crate::chips::fault::{Attached, carry};
use crate::chips::{BusError, Latency, SpiChip, after};
use crate::time::Clock;
use core::cell::{Cell, RefCell};
use embedded_hal::spi::{ErrorType, MODE_3, Mode, Operation};
use stampfly_types::{Duration, Instant};
use std::rc::Rc;

/// Probability that a chip with a floating select corrupts a bit on the shared line: the select
/// reads low part of the time, and half of the chip's bits are wrong. *Unverified*: the behaviour
/// of a floating line is undefined.
const DISTURBANCE: f64 = 0.05;
/// Probability of a wrong bit on a clock faster than the chip allows. *Unverified*: some chips
/// tolerate slightly more.
const TOO_FAST: f64 = 0.05;
/// A chip on the bus. Implements the `SpiDevice` traits of embedded-hal, `async` and blocking.
pub struct SpiPort<C> {
    bus: SpiBus,
    /// Number on the bus, in the order of attachment.
    number: usize,
    chip: Rc<RefCell<C>>,
    attached: Attached,
    /// Time of a byte, ns.
    byte: u64,
    /// Probability of a wrong bit on this clock.
    garbled: f64,
    mode: Mode,
    order: BitOrder,
    /// Rising clock edges while the chip was selected.
    rising: Cell<u64>,
    /// The chip select is not driven yet.
    floating: Cell<bool>,
}

/// A transfer in progress.
struct Transfer {
    start: Instant,
    end: Instant,
    /// Result as far as known at the start.
    outcome: Result<(), BusError>,
    /// Levels of the lines when the chip select falls.
    levels: Levels,
    latency: Latency,
    /// The processor performs all of it without yielding.
    blocks: bool,
}

impl SpiBus {
    /// Attaches a chip with its own chip select, which is driven high. `frequency` is the clock for
    /// this chip, Hz; above its [highest](SpiChip::HIGHEST_CLOCK) clock, transfers are corrupted.
    /// The mode is 3, see [`SpiPort::with_mode`].
    pub fn attach<C: SpiChip + 'static>(&self, frequency: u32, chip: C) -> (SpiPort<C>, Attached) {
        self.solder(frequency, chip, false)
    }

    /// As [`attach`](Self::attach), with a floating chip select: until it is driven, by
    /// [`SpiPort::park`] or a first transfer, the chip disturbs the answers of the others. On the
    /// StampFly the flow sensor does so if the inertial sensor is read before the flow sensor's
    /// select is initialised.
    pub fn attach_floating<C: SpiChip + 'static>(&self, frequency: u32, chip: C) -> (SpiPort<C>, Attached) {
        self.solder(frequency, chip, true)
    }

    fn solder<C: SpiChip + 'static>(&self, frequency: u32, chip: C, floating: bool) -> (SpiPort<C>, Attached) {
        self.0.floating.set(self.0.floating.get() + u32::from(floating));
        let chip = Rc::new(RefCell::new(chip));
        let attached = Attached::new(&self.0.clock, chip.clone());
        (
            SpiPort {
                bus: self.clone(),
                number: self.0.chips.replace(self.0.chips.get() + 1),
                chip,
                attached: attached.clone(),
                byte: byte_time(frequency),
                garbled: garbled::<C>(frequency),
                mode: MODE_3,
                order: BitOrder::MostFirst,
                rising: Cell::new(0),
                floating: Cell::new(floating),
            },
            attached,
        )
    }
}

/// Time of a byte, ns.
fn byte_time(frequency: u32) -> u64 {
    8_000_000_000 / u64::from(frequency.max(1))
}

const fn garbled<C: SpiChip>(frequency: u32) -> f64 {
    if frequency > C::HIGHEST_CLOCK { TOO_FAST } else { 0.0 }
}

impl<C: SpiChip> core::fmt::Debug for SpiPort<C> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SpiPort").field("chip", &self.chip).finish_non_exhaustive()
    }
}

impl<C> SpiPort<C> {
    /// Sets the clock mode.
    #[must_use]
    pub const fn with_mode(mut self, mode: Mode) -> Self {
        self.mode = mode;
        self
    }

    /// Sets the bit order.
    #[must_use]
    pub const fn with_order(mut self, order: BitOrder) -> Self {
        self.order = order;
        self
    }

    /// Number of rising clock edges while the chip was selected: eight per byte, unless the idle
    /// level changed under it.
    #[must_use]
    pub fn rising_edges(&self) -> u64 {
        self.rising.get()
    }

    /// Drives the chip select high until the next transfer.
    pub fn park(&self) {
        let others = self.bus.0.floating.get() - u32::from(self.floating.take());
        self.bus.0.floating.set(others);
    }

    /// The bus.
    #[must_use]
    pub fn bus(&self) -> SpiBus {
        self.bus.clone()
    }

    /// The bus's clock and the chip, for pins of the chip outside the bus.
    pub(in crate::chips) fn chip(&self) -> (Clock, Rc<RefCell<C>>) {
        (self.bus.0.clock.clone(), self.chip.clone())
    }
}

impl<C: SpiChip> SpiPort<C> {
    /// Changes the clock from the next transfer on, Hz, for chips with two clock limits.
    pub fn set_frequency(&mut self, frequency: u32) {
        (self.byte, self.garbled) = (byte_time(frequency), garbled::<C>(frequency));
    }

    /// Occupies the bus.
    fn begin(&self, operations: &[Operation<'_, u8>]) -> Transfer {
        self.park();
        let state = &self.bus.0;
        let start = state.clock.now();
        let refusals = self.attached.faults().refusals;
        let refused = refusals > 0.0 && state.noise.borrow_mut().chance(refusals);
        let mut latency = state.latency.get();
        if latency.jitter > Duration::ZERO {
            latency = latency.drawn(state.noise.borrow_mut().unit());
        }
        let mut levels = state.levels.get();
        // Such a controller corrects the idle level before it selects the chip.
        if state.controller.get() == Controller::LevelFirst {
            levels.clock = wire::idles_high(self.mode);
        }
        let (mut nanoseconds, mut late, mut blocks) = (0, latency.setup, true);
        let mut sent_last = None;
        for operation in operations {
            match operation {
                Operation::DelayNs(delay) => {
                    nanoseconds += u64::from(*delay);
                    late += latency.of_pause(*delay);
                    blocks &= latency.is_spun(*delay);
                }
                bytes => {
                    let (length, last) = sent(bytes);
                    nanoseconds += self.byte * length as u64;
                    late += latency.of_bytes(length);
                    blocks &= length <= latency.polled;
                    if length > 0 {
                        sent_last = Some(last);
                    }
                }
            }
        }
        // MOSI keeps the level of the last bit sent.
        state.levels.set(sent_last.map_or(levels, |last| Levels::after(self.mode, self.order, last)));
        let end = start + late + Duration::from_micros(nanoseconds.div_ceil(1_000));
        state.busy_until.set(end);
        let outcome = if refused { Err(BusError::Overrun) } else { Ok(()) };
        Transfer { start, end, outcome, levels, latency, blocks }
    }

    /// Exchanges the bytes of a completed transfer.
    fn exchange(&self, operations: &mut [Operation<'_, u8>], transfer: &Transfer) {
        let Transfer { start, end, levels, .. } = *transfer;
        let faults = self.attached.faults();
        let stuck = self.bus.0.stuck.get();
        if faults.dead {
            return self.each(operations, transfer, |_, _, _| stuck.unwrap_or(0xFF));
        }
        let errors = faults.bit_errors.max(self.garbled);
        let disturbance = if self.bus.0.floating.get() > 0 { DISTURBANCE } else { 0.0 };
        let mut chip = self.chip.borrow_mut();
        let mut noise = self.bus.0.noise.borrow_mut();
        if wire::is_plain(levels, self.mode, self.order) && !self.bus.0.edge_by_edge.get() {
            let mut moved = 0;
            self.each(operations, transfer, |index, out, begin| {
                moved = index + 1;
                let out = carry(out, errors, &mut noise);
                let answer = chip.exchange(index, out, after(start, begin + self.byte));
                stuck.unwrap_or(carry(answer, errors.max(disturbance), &mut noise))
            });
            self.rising.set(self.rising.get() + 8 * moved as u64);
        } else {
            let mut wire = Wire::select(levels, self.mode, self.order);
            self.each(operations, transfer, |_, out, begin| {
                let out = carry(out, errors, &mut noise);
                let at = |bits: u32| after(start, begin + self.byte * u64::from(bits) / 8).min(end);
                let answer = wire.exchange(&mut *chip, out, at);
                stuck.unwrap_or(carry(answer, errors.max(disturbance), &mut noise))
            });
            self.rising.set(self.rising.get() + wire.rising);
        }
        chip.release(end);
    }

    /// Passes a completed transfer to the analyser.
    fn show(&self, operations: &[Operation<'_, u8>], transfer: &Transfer) {
        if self.bus.0.analyser.borrow().is_none() {
            return;
        }
        let (mut wrote, mut read) = (Vec::new(), Vec::new());
        for operation in operations {
            match operation {
                Operation::Write(bytes) => wrote.extend_from_slice(bytes),
                Operation::Read(bytes) => read.extend_from_slice(bytes),
                Operation::TransferInPlace(bytes) => read.extend_from_slice(bytes),
                Operation::Transfer(into, from) => {
                    wrote.extend_from_slice(from);
                    read.extend_from_slice(into);
                }
                Operation::DelayNs(_) => {}
            }
        }
        let Transfer { start: begun, end: ended, blocks: blocked, .. } = *transfer;
        self.bus.note(Seen::Transfer { chip: self.number, begun, ended, blocked, wrote, read });
    }

    /// Calls `byte` for each byte of a transfer with its number, the byte sent, and its begin in ns
    /// after the start. The result is the byte read.
    fn each(
        &self,
        operations: &mut [Operation<'_, u8>],
        transfer: &Transfer,
        mut byte: impl FnMut(usize, u8, u64) -> u8,
    ) {
        let latency = transfer.latency;
        let (mut index, mut nanoseconds) = (0, latency.setup.as_micros() * 1_000);
        let mut next = |out: u8, nanoseconds: &mut u64| {
            let answer = byte(index, out, *nanoseconds);
            index += 1;
            *nanoseconds += self.byte;
            answer
        };
        for operation in operations {
            let length = sent(operation).0;
            match operation {
                Operation::Read(bytes) => bytes.iter_mut().for_each(|slot| *slot = next(0, &mut nanoseconds)),
                Operation::Write(bytes) => bytes.iter().for_each(|out| {
                    next(*out, &mut nanoseconds);
                }),
                Operation::Transfer(read, write) => {
                    for place in 0..length {
                        let answer = next(write.get(place).copied().unwrap_or(0), &mut nanoseconds);
                        if let Some(slot) = read.get_mut(place) {
                            *slot = answer;
                        }
                    }
                }
                Operation::TransferInPlace(bytes) => {
                    bytes.iter_mut().for_each(|slot| *slot = next(*slot, &mut nanoseconds));
                }
                Operation::DelayNs(delay) => {
                    nanoseconds += u64::from(*delay) + latency.of_pause(*delay).as_micros() * 1_000;
                    continue;
                }
            }
            nanoseconds += latency.of_bytes(length).as_micros() * 1_000;
        }
    }
}

/// Number of bytes that an operation moves, and the last byte that it sends. A read sends zeros.
fn sent(operation: &Operation<'_, u8>) -> (usize, u8) {
    match operation {
        Operation::Read(bytes) => (bytes.len(), 0),
        Operation::Write(bytes) => (bytes.len(), bytes.last().copied().unwrap_or(0)),
        Operation::Transfer(read, write) => {
            let length = read.len().max(write.len());
            (length, write.get(length.saturating_sub(1)).copied().unwrap_or(0))
        }
        Operation::TransferInPlace(bytes) => (bytes.len(), bytes.last().copied().unwrap_or(0)),
        Operation::DelayNs(_) => (0, 0),
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
        let transfer = self.begin(operations);
        if transfer.blocks {
            state.clock.advance_to(transfer.end);
        } else {
            state.clock.sleep_until(transfer.end).await;
        }
        transfer.outcome?;
        self.exchange(operations, &transfer);
        self.show(operations, &transfer);
        Ok(())
    }
}

impl<C: SpiChip> embedded_hal::spi::SpiDevice for SpiPort<C> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), BusError> {
        let state = self.bus.0.clone();
        state.clock.advance_to(state.busy_until.get());
        let transfer = self.begin(operations);
        state.clock.advance_to(transfer.end);
        transfer.outcome?;
        self.exchange(operations, &transfer);
        self.show(operations, &transfer);
        Ok(())
    }
}
