//! The flight core's hardware, by a script: its clock, its SPI, the inertial sensor's pin.
//!
//! What stands for hardware is [aside](crate::marks): it is neither counted nor cached. What the core itself does about it is counted, as
//! far as it is here: waiting for alarms, waking tasks. The HAL's registers are not.

use crate::marks;
use crate::script::{Sample, Script, Transfer, hash_of};
use core::cell::{Cell, RefCell};
use core::convert::Infallible;
use core::future::poll_fn;
use core::task::{Poll, Waker};
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::digital::Wait;
use embedded_hal_async::spi::{self, Operation, SpiDevice};
use heapless::Vec;
use stampfly_drivers::Timebase;
use stampfly_types::{Duration, Instant};

/// Most alarms that are set at a time. Those whose task has stopped waiting ring all the same.
const ALARMS: usize = 32;

/// Does it aside.
fn aside<T>(what: impl FnOnce() -> T) -> T {
    marks::aside_begins();
    let result = what();
    marks::aside_ends();
    result
}

/// Everything around the core.
pub struct Hardware {
    script: RefCell<Script<'static>>,
    now: Cell<Instant>,
    alarms: RefCell<Vec<(Instant, Waker), ALARMS>>,
    /// The next sample of the other core, and the next time the pin is high.
    sample: Cell<Option<Sample<'static>>>,
    pin: Cell<Option<Instant>>,
    is_high: Cell<bool>,
    /// Is the script over, or has a driver left it?
    over: Cell<bool>,
    left: Cell<bool>,
    /// May the motors turn?
    armed: Cell<bool>,
    /// For how long the core has waited for transfers since the pin was last high, and in all periods with motors that might turn.
    waited: Cell<Duration>,
    waits: Cell<Waits>,
}

/// For how long the core itself waited for transfers, a period of the inertial sensor with motors that might turn.
#[derive(Clone, Copy, Debug, Default)]
pub struct Waits {
    /// Periods.
    pub periods: u32,
    /// In all of them.
    pub all: Duration,
    /// In the one in which it was most.
    pub most: Duration,
}

impl Hardware {
    /// At power-on.
    pub fn new(mut script: Script<'static>) -> Self {
        Self {
            now: Cell::new(script.start),
            alarms: RefCell::new(Vec::new()),
            sample: Cell::new(script.samples.sample()),
            pin: Cell::new(script.pin.pin()),
            is_high: Cell::new(false),
            over: Cell::new(false),
            left: Cell::new(false),
            armed: Cell::new(false),
            waited: Cell::new(Duration::ZERO),
            waits: Cell::new(Waits::default()),
            script: RefCell::new(script),
        }
    }

    /// Has a driver said something else than when the script was written?
    pub fn was_left(&self) -> bool {
        self.left.get()
    }

    /// How long it waited for transfers.
    pub fn waits(&self) -> Waits {
        self.waits.get()
    }

    /// From now on the motors may turn, or no longer.
    pub fn set_armed(&self, armed: bool) {
        self.armed.set(armed);
    }

    /// A period is over and the next begins: the pin is high.
    fn next_period(&self) {
        let waited = self.waited.take();
        if self.armed.get() {
            let Waits { periods, all, most } = self.waits.get();
            self.waits.set(Waits { periods: periods + 1, all: all + waited, most: most.max(waited) });
            marks::pass_ends_armed();
        } else {
            marks::pass_ends_on_ground();
        }
        marks::pass_begins();
    }

    /// Sleeps until something happens: an alarm, or a sample of the other core, which is returned. `false` when nothing does any more.
    ///
    /// Waking the tasks is the core's work; the rest is not.
    pub fn sleep(&self, mut publish: impl FnMut(&Sample<'_>)) -> bool {
        let is_over = aside(|| {
            let alarms = self.alarms.borrow();
            let alarm = alarms.iter().map(|(at, _)| *at).min();
            let sample = self.sample.get().map(|sample| sample.came);
            let Some(next) = alarm.into_iter().chain(sample).min().filter(|_| !self.over.get() && !self.left.get())
            else {
                return true;
            };
            self.now.set(self.now.get().max(next));
            false
        });
        if is_over {
            return false;
        }
        aside(|| {
            while let Some(sample) = self.sample.get().filter(|sample| sample.came <= self.now.get()) {
                publish(&sample);
                self.sample.set(self.script.borrow_mut().samples.sample());
            }
        });
        if self.pin.get().is_some_and(|high| high <= self.now.get()) && !self.is_high.replace(true) {
            self.next_period();
        }
        let mut alarms = self.alarms.borrow_mut();
        let mut place = 0;
        while let Some((at, _)) = alarms.get(place) {
            if *at <= self.now.get() {
                let (_, waker) = alarms.swap_remove(place);
                waker.wake();
            } else {
                place += 1;
            }
        }
        true
    }

    fn ring(&self, at: Instant, waker: &Waker) {
        let mut alarms = self.alarms.borrow_mut();
        if alarms.iter().any(|(known, other)| *known == at && other.will_wake(waker)) {
            return;
        }
        if alarms.push((at, waker.clone())).is_err() {
            self.left.set(true);
        }
    }

    async fn sleep_until(&self, at: Instant) {
        poll_fn(|context| {
            if self.now.get() >= at {
                return Poll::Ready(());
            }
            self.ring(at, context.waker());
            Poll::Pending
        })
        .await;
    }

    /// The next transfer, if it is the one that the script has here.
    fn transfer(&self, chip: u8, operations: &[Operation<'_, u8>]) -> Option<Transfer<'static>> {
        let Some(transfer) = self.script.borrow_mut().transfers.transfer() else {
            self.over.set(true);
            return None;
        };
        let wrote = operations.iter().flat_map(|operation| match operation {
            Operation::Write(bytes) | Operation::Transfer(_, bytes) => *bytes,
            _ => &[],
        });
        let same = transfer.chip == chip && transfer.wrote == hash_of(wrote.copied());
        self.left.set(self.left.get() || !same);
        same.then_some(transfer)
    }
}

/// The time.
#[derive(Clone, Copy)]
pub struct Clock(pub &'static Hardware);

impl Timebase for Clock {
    fn now(&self) -> Instant {
        self.0.now.get()
    }
}

impl DelayNs for Clock {
    async fn delay_ns(&mut self, ns: u32) {
        self.0.sleep_until(self.0.now.get() + Duration::from_micros(u64::from(ns.div_ceil(1_000)))).await;
    }

    async fn delay_us(&mut self, us: u32) {
        self.0.sleep_until(self.0.now.get() + Duration::from_micros(u64::from(us))).await;
    }
}

/// A chip on the SPI.
pub struct Chip {
    /// The hardware it is part of.
    pub hardware: &'static Hardware,
    /// 0 is the inertial sensor, 1 the flow sensor.
    pub number: u8,
}

impl spi::ErrorType for Chip {
    type Error = spi::ErrorKind;
}

impl SpiDevice for Chip {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), spi::ErrorKind> {
        let hardware = self.hardware;
        let Some(transfer) = aside(|| hardware.transfer(self.number, operations)) else {
            return core::future::pending().await;
        };
        if transfer.blocked {
            aside(|| {
                hardware.waited.set(hardware.waited.get() + transfer.ended.since(hardware.now.get()));
                hardware.now.set(hardware.now.get().max(transfer.ended));
            });
        } else {
            hardware.sleep_until(transfer.ended).await;
        }
        aside(|| {
            let mut read = transfer.read;
            for operation in operations {
                let (Operation::Read(into) | Operation::Transfer(into, _) | Operation::TransferInPlace(into)) =
                    operation
                else {
                    continue;
                };
                let Some((bytes, rest)) = read.split_at_checked(into.len()) else { continue };
                into.copy_from_slice(bytes);
                read = rest;
            }
        });
        Ok(())
    }
}

/// The inertial sensor's interrupt pin.
pub struct Pin(pub &'static Hardware);

impl stampfly_drivers::embedded_hal::digital::ErrorType for Pin {
    type Error = Infallible;
}

impl Wait for Pin {
    async fn wait_for_high(&mut self) -> Result<(), Infallible> {
        let Some(at) = self.0.pin.get() else { return core::future::pending().await };
        self.0.sleep_until(at).await;
        aside(|| {
            self.0.is_high.set(false);
            self.0.pin.set(self.0.script.borrow_mut().pin.pin());
        });
        Ok(())
    }

    async fn wait_for_low(&mut self) -> Result<(), Infallible> {
        core::future::pending().await
    }

    async fn wait_for_rising_edge(&mut self) -> Result<(), Infallible> {
        self.wait_for_high().await
    }

    async fn wait_for_falling_edge(&mut self) -> Result<(), Infallible> {
        core::future::pending().await
    }

    async fn wait_for_any_edge(&mut self) -> Result<(), Infallible> {
        self.wait_for_high().await
    }
}
