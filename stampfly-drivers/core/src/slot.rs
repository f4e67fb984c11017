//! Shares one SPI bus between two devices without a lock: a *lead* with a fixed rhythm and a
//! *guest*.
//!
//! With a lock, the inertial sensor waits whenever the flow sensor happens to transfer, and its
//! samples are delayed by a random time. Here the lead transfers at any time. The guest transfers
//! only in the pause after the lead's transfers, and only when its own transfer ends before the
//! lead is due again. Use it where one device has to be on time and its transfers are short
//! compared with its period.
//!
//! Not for two devices that both have to be on time, and not for transfers longer than the pause.
//! Not across executors: the state is in `Cell`s, so both tasks run on one executor.
//!
//! # Guarantees
//! * Transfers never overlap, whatever the devices do.
//! * A lead that keeps its rhythm never waits for the guest. It keeps its rhythm when a burst of
//!   transfers begins no earlier than a period less the guard after the previous burst, and no
//!   pause within a burst is longer than [`Rhythm::settle`].
//! * A lead that does not keep it waits for at most the guest's longest transfer; [`Slots::delays`]
//!   counts these waits.
//! * A transfer of the guest that takes longer than its declared maximum is given up at that time
//!   ([`SlotError::TooLong`]).
//! * While the lead keeps its rhythm, the guest begins within one period and the lead's burst.
//! * When the lead has been silent for two periods, the guest transfers without it: a failed
//!   inertial sensor does not disable the flow sensor.
//!
//! ```
//! # use core::convert::Infallible;
//! # use embedded_hal::{delay::DelayNs, spi::{ErrorType, Operation}};
//! # use stampfly_types::{Duration, Instant};
//! # struct Device;
//! # impl ErrorType for Device { type Error = Infallible; }
//! # impl embedded_hal::spi::SpiDevice for Device {
//! #     fn transaction(&mut self, _: &mut [Operation<'_, u8>]) -> Result<(), Infallible> { Ok(()) }
//! # }
//! # use core::cell::Cell;
//! # #[derive(Clone)] struct Delay<'a>(&'a Cell<u64>);
//! # impl DelayNs for Delay<'_> { fn delay_ns(&mut self, ns: u32) { self.0.set(self.0.get() + u64::from(ns)); } }
//! # let nanos = Cell::new(1_000_000_000);
//! # let now = || Instant::from_micros(nanos.get() / 1_000);
//! # let clock = stampfly_driver_core::blocking::BlockingClock::new(Delay(&nanos), now);
//! # let (imu, flow) = (stampfly_driver_core::blocking::Blocking(Device), stampfly_driver_core::blocking::Blocking(Device));
//! use embedded_hal_async::spi::SpiDevice as _;
//! use stampfly_driver_core::blocking::block_on;
//! use stampfly_driver_core::slot::{Rhythm, Slots};
//!
//! // Two devices of one bus, each with its own chip select and its own clock rate.
//! let mut slots = Slots::new(clock, Rhythm::HZ_400);
//! let (mut imu, mut flow, bus) = slots.split(imu, flow, Duration::from_micros(200));
//! block_on(imu.write(&[0x80]))?;
//! block_on(flow.write(&[0x16])).expect("begins when the lead has settled");
//! assert_eq!(bus.delays(), 0);
//! # Ok::<(), Infallible>(())
//! ```

use crate::Timebase;
use crate::time::{Standstill, sleep_until, within};
use core::cell::Cell;
use core::fmt::{self, Debug, Display};
use core::future::poll_fn;
use core::pin::pin;
use core::task::{Poll, Waker};
use embedded_hal_async::spi::{Error, ErrorKind, ErrorType, Operation, SpiDevice};
use stampfly_types::{Duration, Instant};

/// Timing of the lead's transfers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rhythm {
    /// Time from the beginning of one burst of the lead's transfers to the beginning of the next.
    pub period: Duration,
    /// How much earlier than `period` the next burst may begin: the lead's clock differs from this
    /// one, and its task may wake up late.
    pub guard: Duration,
    /// Longest pause between two transfers of one burst.
    pub settle: Duration,
}

impl Rhythm {
    /// Rhythm of the BMI270 driver: a status read and a FIFO read every 2.5 ms of the chip's clock,
    /// which may be off by 3 %.
    pub const HZ_400: Self = Self {
        period: Duration::from_micros(2_500),
        guard: Duration::from_micros(250),
        settle: Duration::from_micros(50),
    };
}

/// The bus's time, divided between its two devices.
pub struct Slots<T> {
    clock: T,
    rhythm: Rhythm,
    /// The lead holds or awaits the bus.
    lead: Cell<bool>,
    /// The guest transfers.
    guest: Cell<bool>,
    /// Start of the lead's latest burst.
    begun: Cell<Instant>,
    /// End of the lead's latest transfer.
    ended: Cell<Instant>,
    /// Number of transfers of the lead that have ended, modulo 2³².
    transfers: Cell<u32>,
    /// Number of transfers of the lead that had to wait, modulo 2³².
    delays: Cell<u32>,
    /// Waker of the device that waits for the other one's transfer to end. Each side has one task.
    waiting_lead: Cell<Option<Waker>>,
    waiting_guest: Cell<Option<Waker>>,
}

/// The lead's SPI device.
pub struct Lead<'s, D, T> {
    slots: &'s Slots<T>,
    device: D,
}

/// The guest's SPI device.
pub struct Guest<'s, D, T> {
    slots: &'s Slots<T>,
    device: D,
    longest: Duration,
}

/// Reason why a transfer of the guest failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SlotError<E> {
    /// The SPI device reported an error.
    Device(E),
    /// The transfer took longer than its declared maximum and was given up.
    TooLong,
}

impl<E: Error> Error for SlotError<E> {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Device(error) => error.kind(),
            Self::TooLong => ErrorKind::Other,
        }
    }
}

impl<E: Debug> Display for SlotError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Device(error) => write!(f, "the device says {error:?}"),
            Self::TooLong => f.write_str("the transfer took longer than promised and was given up"),
        }
    }
}

impl<E: Debug> core::error::Error for SlotError<E> {}

/// Next action of a guest that has a transfer to make.
enum Opening {
    /// Transfer now.
    Now,
    /// Check again at this instant.
    At(Instant),
    /// Check again when the lead's next transfer has ended, or at this instant at the latest.
    AfterLead(Instant),
}

impl<T: Timebase + Clone> Slots<T> {
    /// Divides the time of a bus whose lead has this rhythm.
    pub const fn new(clock: T, rhythm: Rhythm) -> Self {
        Self {
            clock,
            rhythm,
            lead: Cell::new(false),
            guest: Cell::new(false),
            begun: Cell::new(Instant::ZERO),
            ended: Cell::new(Instant::ZERO),
            transfers: Cell::new(0),
            delays: Cell::new(0),
            waiting_lead: Cell::new(None),
            waiting_guest: Cell::new(None),
        }
    }

    /// Returns the two devices, and a reference for reading [`delays`](Self::delays).
    ///
    /// A transfer of the guest that takes longer than `longest` is given up. A guest whose
    /// `longest` does not fit into the lead's pause transfers only while the lead is silent.
    pub const fn split<L, G>(
        &mut self,
        lead: L,
        guest: G,
        longest: Duration,
    ) -> (Lead<'_, L, T>, Guest<'_, G, T>, &Self) {
        let slots = &*self;
        (Lead { slots, device: lead }, Guest { slots, device: guest, longest }, slots)
    }

    /// Number of times the lead had to wait for the guest, modulo 2³². Zero while the lead keeps
    /// its rhythm.
    #[must_use]
    pub fn delays(&self) -> u32 {
        self.delays.get()
    }

    fn opening(&self, longest: Duration) -> Opening {
        let now = self.clock.now();
        let Rhythm { period, guard, settle } = self.rhythm;
        // A lead that has missed two periods has failed or is restarting.
        let silent = self.ended.get().max(self.begun.get()) + period + period;
        if self.lead.get() {
            return Opening::AfterLead(now + period);
        }
        if now >= silent {
            return Opening::Now;
        }
        // The pause opens `settle` after the lead's last transfer, since another one of the same
        // burst may follow until then. It closes early enough for the guest's longest transfer to
        // end before the earliest start of the next burst.
        let opens = self.ended.get() + settle;
        let closes = self.begun.get() + period - (guard + longest);
        match () {
            // No room before the next burst: wait for its end, or until the lead counts as silent.
            () if opens > closes || now > closes => Opening::AfterLead(silent),
            () if now < opens => Opening::At(opens),
            () => Opening::Now,
        }
    }

    /// Waits until the guest may transfer, and marks the bus as taken.
    async fn open(&self, longest: Duration) -> Turn<'_> {
        let mut clock = self.clock.clone();
        let (mut standstill, mut stands) = (Standstill::new(), false);
        loop {
            let now = clock.now();
            match self.opening(longest) {
                Opening::Now => return Turn::take(&self.guest, &self.waiting_lead),
                Opening::At(_) if stands => return Turn::take(&self.guest, &self.waiting_lead),
                Opening::At(instant) => {
                    sleep_until(&mut clock, instant).await;
                    standstill.note(instant.since(now), clock.now());
                }
                Opening::AfterLead(latest) => {
                    let before = self.transfers.get();
                    let ended = poll_fn(|context| {
                        if self.transfers.get() != before {
                            return Poll::Ready(());
                        }
                        self.waiting_guest.set(Some(context.waker().clone()));
                        Poll::Pending
                    });
                    if stands {
                        // Without a working clock, the end of a transfer of the lead is the only
                        // reliable event.
                        ended.await;
                        continue;
                    }
                    // The end of the lead's transfer or the latest instant, whichever comes first.
                    let left = latest.since(now);
                    if within(&mut clock, left, ended).await.is_none() {
                        standstill.note(left, clock.now());
                    }
                }
            }
            // A clock that stands still never reaches the instant of `Opening::At`.
            stands |= standstill.take();
        }
    }

    /// Marks the bus as taken by the lead. Waits only if the guest is transferring, which means
    /// that the lead left its rhythm.
    async fn lead(&self) -> Turn<'_> {
        // Marked before the wait, so that the guest does not begin another transfer first.
        let turn = Turn::take(&self.lead, &self.waiting_guest);
        if self.guest.get() {
            self.delays.set(self.delays.get().wrapping_add(1));
            poll_fn(|context| {
                if !self.guest.get() {
                    return Poll::Ready(());
                }
                self.waiting_lead.set(Some(context.waker().clone()));
                Poll::Pending
            })
            .await;
        }
        let now = self.clock.now();
        // Transfers within half a period after the start of a burst belong to that burst.
        if now.since(self.begun.get()) >= self.rhythm.period / 2 {
            self.begun.set(now);
        }
        turn
    }
}

/// Marks the bus as taken by one of the two devices. Dropping it, also in the middle of a transfer,
/// releases the bus.
struct Turn<'s> {
    taken: &'s Cell<bool>,
    waiting: &'s Cell<Option<Waker>>,
}

impl<'s> Turn<'s> {
    fn take(taken: &'s Cell<bool>, waiting: &'s Cell<Option<Waker>>) -> Self {
        taken.set(true);
        Self { taken, waiting }
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        self.taken.set(false);
        if let Some(waker) = self.waiting.take() {
            waker.wake();
        }
    }
}

/// Records the end of a transfer of the lead when dropped, however the transfer ended.
struct Ended<'s, T: Timebase + Clone>(&'s Slots<T>);

impl<T: Timebase + Clone> Drop for Ended<'_, T> {
    fn drop(&mut self) {
        self.0.ended.set(self.0.clock.now());
        self.0.transfers.set(self.0.transfers.get().wrapping_add(1));
    }
}

impl<D: ErrorType, T> ErrorType for Lead<'_, D, T> {
    type Error = D::Error;
}

impl<D: SpiDevice, T: Timebase + Clone> SpiDevice for Lead<'_, D, T> {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), D::Error> {
        // Dropped in reverse order: the end is recorded first, then the guest is woken.
        let _turn = self.slots.lead().await;
        let _ended = Ended(self.slots);
        self.device.transaction(operations).await
    }
}

impl<D: ErrorType, T> ErrorType for Guest<'_, D, T> {
    type Error = SlotError<D::Error>;
}

impl<D: SpiDevice, T: Timebase + Clone> SpiDevice for Guest<'_, D, T> {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Self::Error> {
        let _turn = self.slots.open(self.longest).await;
        let outcome =
            within(&mut self.slots.clock.clone(), self.longest, pin!(self.device.transaction(operations))).await;
        outcome.ok_or(SlotError::TooLong)?.map_err(SlotError::Device)
    }
}
