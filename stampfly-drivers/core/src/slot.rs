//! Two devices on one SPI bus without a lock: one leads, the other fits in between.
//!
//! With a lock the inertial sensor waits whenever the flow sensor happens to transfer, and its sample is late by a time
//! that depends on chance. Here the *lead* has a rhythm and never asks; the *guest* transfers only in the pause after
//! the lead's transfers, and only when it will be over before the lead is due again. Use it where one device has to be
//! on time and its transfers are short against its period. Not for two devices that both have to, not for transfers
//! longer than the pause, and not across executors: it is `Cell`s, so both tasks run on one.
//!
//! # Guarantees
//! * Two transfers never overlap, whatever the devices do.
//! * A lead that keeps its rhythm (a burst of transfers begins no earlier than a period less the guard after the one
//!   before, and within a burst no pause is longer than [`Rhythm::settle`]) never waits for the guest.
//! * One that does not waits for at most the guest's longest transfer; [`Slots::delays`] counts how often.
//! * A guest's transfer that takes longer than it promised is given up at that time ([`SlotError::TooLong`]).
//! * A guest whose lead transfers in its rhythm begins within one period and the lead's burst.
//! * A guest whose lead is silent for two periods goes on by itself: a dead inertial sensor does not blind the flow
//!   sensor.
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

/// When the lead transfers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rhythm {
    /// From the beginning of one burst of the lead's transfers to that of the next.
    pub period: Duration,
    /// How much earlier than that the next may begin: the lead's clock is not ours, and its task may wake up late.
    pub guard: Duration,
    /// The longest pause between two transfers of one burst.
    pub settle: Duration,
}

impl Rhythm {
    /// The BMI270's driver: a status and a FIFO read every 2.5 ms of a clock that may be off by 3 per cent.
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
    /// The lead transfers right now.
    lead: Cell<bool>,
    /// The guest transfers right now.
    guest: Cell<bool>,
    /// Beginning of the lead's last burst.
    begun: Cell<Instant>,
    /// End of the lead's last transfer.
    ended: Cell<Instant>,
    /// Transfers of the lead that ended.
    transfers: Cell<u32>,
    /// Transfers of the lead that had to wait.
    delays: Cell<u32>,
    /// Who waits for the other's end. There is one of each.
    waiting_lead: Cell<Option<Waker>>,
    waiting_guest: Cell<Option<Waker>>,
}

/// The lead's device.
pub struct Lead<'s, D, T> {
    slots: &'s Slots<T>,
    device: D,
}

/// The guest's device.
pub struct Guest<'s, D, T> {
    slots: &'s Slots<T>,
    device: D,
    longest: Duration,
}

/// Why the guest's transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SlotError<E> {
    /// The device says so.
    Device(E),
    /// It took longer than promised, and the lead must not wait.
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

/// What a guest that wants to transfer has to do.
enum Opening {
    /// Begin.
    Now,
    /// Ask again at this instant.
    At(Instant),
    /// Ask again when the lead's next transfer is over, at the latest at this instant.
    AfterLead(Instant),
}

impl<T: Timebase + Clone> Slots<T> {
    /// A bus whose lead has this rhythm.
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

    /// The two devices, and the bus to ask for its [`delays`](Self::delays).
    ///
    /// No transfer of the guest takes longer than `longest`: one that would is given up. A guest whose `longest` does
    /// not fit into the lead's pause transfers only when the lead is silent.
    pub const fn split<L, G>(
        &mut self,
        lead: L,
        guest: G,
        longest: Duration,
    ) -> (Lead<'_, L, T>, Guest<'_, G, T>, &Self) {
        let slots = &*self;
        (Lead { slots, device: lead }, Guest { slots, device: guest, longest }, slots)
    }

    /// How often the lead had to wait for the guest. Zero while it keeps its rhythm.
    #[must_use]
    pub fn delays(&self) -> u32 {
        self.delays.get()
    }

    fn opening(&self, longest: Duration) -> Opening {
        let now = self.clock.now();
        let Rhythm { period, guard, settle } = self.rhythm;
        let silent = self.ended.get().max(self.begun.get()) + period + period;
        if self.lead.get() {
            return Opening::AfterLead(now + period);
        }
        if now >= silent {
            return Opening::Now;
        }
        let opens = self.ended.get() + settle;
        let closes = self.begun.get() + period - (guard + longest);
        match () {
            () if opens > closes || now > closes => Opening::AfterLead(silent),
            () if now < opens => Opening::At(opens),
            () => Opening::Now,
        }
    }

    /// Waits for the guest's turn and takes it.
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
                        // Without a clock only the lead's end is sure.
                        ended.await;
                        continue;
                    }
                    // Whichever comes first.
                    let left = latest.since(now);
                    if within(&mut clock, left, ended).await.is_none() {
                        standstill.note(left, clock.now());
                    }
                }
            }
            stands |= standstill.take();
        }
    }

    /// Takes the lead's turn: at once, unless it came out of its rhythm into a transfer of the guest.
    async fn lead(&self) -> Turn<'_> {
        // Taken before it waits, so that the guest does not begin another one first.
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
        // Whatever follows within half a period belongs to the same burst.
        if now.since(self.begun.get()) >= self.rhythm.period / 2 {
            self.begun.set(now);
        }
        turn
    }
}

/// The bus, taken by one of the two; given back when dropped, also in the middle of a transfer.
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

/// The end of a lead's transfer, however it ended.
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
        // Dropped in the opposite order: first the end is noted, then the guest is woken.
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
