//! Shares one I2C bus between several drivers, in round-robin order, with recovery of a stuck bus.
//!
//! The drivers run as tasks of one executor. Each has a [`Share`] of the bus and holds the bus for
//! one transfer at a time; the next share that waits, in circular order, is served next. A driver
//! therefore waits for at most one transfer of every other driver, however often those request the
//! bus. The share whose transfer fails also recovers the bus, so a device that hangs delays the
//! other drivers by about a millisecond.
//!
//! Not across executors or cores: the state is in `Cell`s.
//!
//! # Guarantees
//! * Transfers never overlap. A transfer that was dropped half way ends before the next one begins.
//! * A share waits for at most one transfer, and one recovery, of every other share.
//! * After a transfer that fails with an error other than a missing acknowledge, the bus is
//!   recovered before the next share is served. After a transfer that was dropped, it is recovered
//!   before the next transfer.

use crate::recovery::{Recovery, RecoveryError};
use core::cell::Cell;
use core::future::poll_fn;
use core::task::{Context, Poll, Waker};
use embedded_hal_async::i2c::{Error, ErrorKind, ErrorType, I2c, Operation};

/// A bus that its owner can free: by resetting the peripheral, or by clocking the pins with
/// [`recover_i2c`](crate::recover_i2c).
pub trait RecoverableI2c: I2c {
    /// Frees the data line within about a millisecond.
    ///
    /// # Errors
    /// When the bus is not free afterwards.
    async fn recover(&mut self) -> Result<Recovery, RecoveryError>;
}

/// The bus, and the queue of its `N` shares.
///
/// ```
/// # use core::convert::Infallible;
/// # use embedded_hal_async::i2c::{ErrorType, I2c, Operation};
/// # use stampfly_driver_core::{Recovery, RecoveryError};
/// # struct Wire;
/// # impl ErrorType for Wire { type Error = Infallible; }
/// # impl I2c for Wire {
/// #     async fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), Infallible> {
/// #         for operation in operations { if let Operation::Read(into) = operation { into.fill(0x58) } }
/// #         Ok(())
/// #     }
/// # }
/// # impl stampfly_driver_core::shared::RecoverableI2c for Wire {
/// #     async fn recover(&mut self) -> Result<Recovery, RecoveryError> { Ok(Recovery::WasFree) }
/// # }
/// use embedded_hal_async::i2c::I2c as _;
/// use stampfly_driver_core::blocking::block_on;
/// use stampfly_driver_core::shared::SharedI2c;
///
/// let mut bus = SharedI2c::new(Wire);
/// let ([mut baro, mut mag], counters) = bus.split();
/// let mut id = [0];
/// block_on(baro.write_read(0x76, &[0xD0], &mut id))?;
/// block_on(mag.write(0x10, &[0x4B, 1]))?;
/// assert_eq!((id, counters.recoveries()), ([0x58], 0));
/// # Ok::<(), Infallible>(())
/// ```
pub struct SharedI2c<B, const N: usize> {
    /// `None` while a share transfers.
    bus: Cell<Option<B>>,
    /// Wakers of the shares that wait.
    waiting: [Cell<Option<Waker>>; N],
    /// The share that has been woken and is served next.
    called: Cell<Option<usize>>,
    /// A transfer was dropped before it ended, so the bus may be stuck.
    suspect: Cell<bool>,
    recoveries: Cell<u32>,
    failures: Cell<u32>,
}

impl<B: RecoverableI2c, const N: usize> SharedI2c<B, N> {
    /// Takes ownership of the bus.
    pub const fn new(bus: B) -> Self {
        Self {
            bus: Cell::new(Some(bus)),
            waiting: [const { Cell::new(None) }; N],
            called: Cell::new(None),
            suspect: Cell::new(false),
            recoveries: Cell::new(0),
            failures: Cell::new(0),
        }
    }

    /// Returns one share for each driver, and a reference for reading the counters.
    pub fn split(&mut self) -> ([Share<'_, B, N>; N], &Self) {
        let bus = &*self;
        (core::array::from_fn(|index| Share { bus, index }), bus)
    }

    /// Number of recoveries in which a device held the data line and released it, modulo 2³².
    pub fn recoveries(&self) -> u32 {
        self.recoveries.get()
    }

    /// Number of recoveries after which the bus was not free, modulo 2³².
    pub fn failures(&self) -> u32 {
        self.failures.get()
    }

    async fn recover(&self, bus: &mut B) {
        self.suspect.set(false);
        match bus.recover().await {
            Ok(Recovery::WasFree) => {}
            Ok(Recovery::Freed { .. }) => self.recoveries.set(self.recoveries.get().wrapping_add(1)),
            Err(_) => self.failures.set(self.failures.get().wrapping_add(1)),
        }
    }

    /// Takes the bus when it is free for this share, or queues the share's waker.
    fn poll_turn(&self, index: usize, context: &mut Context<'_>) -> Poll<B> {
        // A share that was woken is served before all others, even if it has not been polled yet.
        if self.called.get().is_none_or(|called| called == index)
            && let Some(bus) = self.bus.take()
        {
            self.called.set(None);
            return Poll::Ready(bus);
        }
        if let Some(place) = self.waiting.get(index) {
            place.set(Some(context.waker().clone()));
        }
        Poll::Pending
    }

    /// Wakes the next share in circular order that waits.
    fn call_next(&self, after: usize) {
        self.called.set(None);
        for step in 1..=N {
            let index = (after + step) % N;
            if let Some(waker) = self.waiting.get(index).and_then(Cell::take) {
                self.called.set(Some(index));
                waker.wake();
                return;
            }
        }
    }
}

impl<B, const N: usize> core::fmt::Debug for SharedI2c<B, N> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let (recoveries, failures) = (&self.recoveries, &self.failures);
        f.debug_struct("SharedI2c").field("recoveries", recoveries).field("failures", failures).finish_non_exhaustive()
    }
}

/// One driver's share of the bus.
#[derive(Debug)]
pub struct Share<'b, B, const N: usize> {
    bus: &'b SharedI2c<B, N>,
    index: usize,
}

/// Removes the share from the queue when its wait is dropped.
struct Wait<'a, B: RecoverableI2c, const N: usize> {
    bus: &'a SharedI2c<B, N>,
    index: usize,
}

impl<B: RecoverableI2c, const N: usize> Drop for Wait<'_, B, N> {
    fn drop(&mut self) {
        if let Some(place) = self.bus.waiting.get(self.index) {
            place.set(None);
        }
        // The turn must not be lost with the future that was woken for it.
        if self.bus.called.get() == Some(self.index) {
            self.bus.call_next(self.index);
        }
    }
}

/// Returns the bus and wakes the next share, whether the transfer ended or was dropped.
struct Turn<'a, B: RecoverableI2c, const N: usize> {
    shared: &'a SharedI2c<B, N>,
    index: usize,
    bus: Option<B>,
    finished: bool,
}

impl<B: RecoverableI2c, const N: usize> Drop for Turn<'_, B, N> {
    fn drop(&mut self) {
        if !self.finished {
            self.shared.suspect.set(true);
        }
        self.shared.bus.set(self.bus.take());
        self.shared.call_next(self.index);
    }
}

impl<B: ErrorType, const N: usize> ErrorType for Share<'_, B, N> {
    type Error = B::Error;
}

impl<B: RecoverableI2c, const N: usize> I2c for Share<'_, B, N> {
    async fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), B::Error> {
        let (shared, index) = (self.bus, self.index);
        let wait = Wait { bus: shared, index };
        let bus = poll_fn(|context| shared.poll_turn(index, context)).await;
        drop(wait);
        // From here on `Turn` returns the bus, also when this future is dropped.
        let mut turn = Turn { shared, index, bus: Some(bus), finished: false };
        // Always `Some`: it is taken only in `drop`. The alternative must not panic, so it waits.
        let Some(bus) = &mut turn.bus else { core::future::pending().await };
        // The transfer before this one was dropped half way: free the bus before using it.
        if shared.suspect.get() {
            shared.recover(bus).await;
        }
        let outcome = bus.transaction(address, operations).await;
        // A missing acknowledge is an answer of the bus, not a fault: the device is absent or busy.
        if outcome.as_ref().is_err_and(|error| !matches!(error.kind(), ErrorKind::NoAcknowledge(_))) {
            shared.recover(bus).await;
        }
        turn.finished = true;
        outcome
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::future::Future;
    use core::pin::pin;
    use std::rc::Rc;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::task::Wake;
    use std::vec::Vec;

    /// A bus whose transfers end at the second poll, and fail while it is stuck.
    #[derive(Clone, Default)]
    struct Wire(Rc<State>);

    #[derive(Default)]
    struct State {
        log: Cell<Vec<u8>>,
        stuck: Cell<bool>,
        recovered: Cell<u32>,
    }

    impl ErrorType for Wire {
        type Error = ErrorKind;
    }
    impl I2c for Wire {
        async fn transaction(&mut self, address: u8, _: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
            let mut looked = false;
            poll_fn(|context| {
                context.waker().wake_by_ref();
                if core::mem::replace(&mut looked, true) { Poll::Ready(()) } else { Poll::Pending }
            })
            .await;
            let mut log = self.0.log.take();
            log.push(address);
            self.0.log.set(log);
            if self.0.stuck.get() { Err(ErrorKind::ArbitrationLoss) } else { Ok(()) }
        }
    }
    impl RecoverableI2c for Wire {
        async fn recover(&mut self) -> Result<Recovery, RecoveryError> {
            self.0.recovered.set(self.0.recovered.get() + 1);
            Ok(if self.0.stuck.replace(false) { Recovery::Freed { clocks: 3 } } else { Recovery::WasFree })
        }
    }

    #[derive(Default)]
    struct Count(AtomicUsize);
    impl Wake for Count {
        fn wake(self: Arc<Self>) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }

    #[test]
    fn turns_go_round_however_greedy_somebody_is() {
        let wire = Wire::default();
        let mut shared = SharedI2c::<_, 3>::new(wire.clone());
        let ([mut a, mut b, mut c], _) = shared.split();
        async fn ask<const N: usize>(share: &mut Share<'_, Wire, N>, address: u8) {
            for _ in 0..4 {
                share.write(address, &[0]).await.expect("not stuck");
            }
        }
        let (mut a, mut b, mut c) = (pin!(ask(&mut a, 1)), pin!(ask(&mut b, 2)), pin!(ask(&mut c, 3)));
        let waker = Waker::from(Arc::new(Count::default()));
        let mut context = Context::from_waker(&waker);
        let mut done = [false; 3];
        while done != [true; 3] {
            done[0] = done[0] || a.as_mut().poll(&mut context).is_ready();
            done[1] = done[1] || b.as_mut().poll(&mut context).is_ready();
            done[2] = done[2] || c.as_mut().poll(&mut context).is_ready();
        }
        assert_eq!(wire.0.log.take(), [1, 2, 3, 1, 2, 3, 1, 2, 3, 1, 2, 3]);
        assert_eq!(wire.0.recovered.get(), 0);
    }

    #[test]
    fn a_stuck_bus_is_freed_before_the_next_turn() {
        let wire = Wire::default();
        let mut shared = SharedI2c::<_, 2>::new(wire.clone());
        let ([mut a, mut b], counters) = shared.split();
        wire.0.stuck.set(true);
        assert_eq!(crate::blocking::block_on(a.write(1, &[])), Err(ErrorKind::ArbitrationLoss));
        assert_eq!((counters.recoveries(), counters.failures()), (1, 0));
        assert_eq!(crate::blocking::block_on(b.write(2, &[])), Ok(()));
    }

    #[test]
    fn whoever_gives_up_leaves_nothing_behind() {
        let wire = Wire::default();
        let mut shared = SharedI2c::<_, 2>::new(wire.clone());
        let ([mut a, mut b], _) = shared.split();
        let waker = Waker::from(Arc::new(Count::default()));
        let mut context = Context::from_waker(&waker);
        {
            let mut transfer = pin!(a.write(1, &[]));
            assert!(transfer.as_mut().poll(&mut context).is_pending());
            let mut waits = pin!(b.write(2, &[]));
            assert!(waits.as_mut().poll(&mut context).is_pending(), "it is not its turn");
        }
        assert_eq!(crate::blocking::block_on(b.write(2, &[])), Ok(()));
        assert_eq!(wire.0.recovered.get(), 1, "what was given up half way may have left a device in the middle");
        assert_eq!(wire.0.log.take(), [2]);
    }
}
