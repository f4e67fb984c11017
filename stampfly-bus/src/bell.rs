//! Waiting for a topic: a bell that the publisher rings and tasks sleep by. Behind the feature `async`.
//!
//! Polling is what a control loop wants: it reads what there is and goes on. A task that has nothing to do until a
//! sample comes, such as a radio's or a display's, sleeps by a bell, which the hook of the bus rings:
//!
//! ```
//! mod topics {
//!     use stampfly_bus::types::messages::TofData;
//!     stampfly_bus::topics! {
//!         outside tof, display;
//!         /// Range to the ground.
//!         range: TofData = ring(4) @ 30 Hz from tof => [display];
//!     }
//! }
//! use stampfly_bus::{Bell, Instant, types::messages::TofData};
//!
//! static PUBLISHED: Bell<2> = Bell::new();
//!
//! # fn main() { embassy_futures::block_on(async {
//! let mut bus = topics::Bus::new();
//! // Called with the number of the topic: one bell for all, or one for each.
//! let ends = bus.split(Some(|_| PUBLISHED.ring()));
//! let topics::Outside { mut tof, mut display } = ends.outside;
//!
//! let show = async { PUBLISHED.wait_for(|| display.range.next()).await.data.distance };
//! let measure = async {
//!     tof.range.publish(Instant::from_millis(2), &TofData { distance: 0.4, ..TofData::default() })
//! };
//! assert_eq!(embassy_futures::join::join(show, measure).await, (0.4, 1));
//! # }) }
//! ```
//!
//! A topic of policy `latest` is waited for with `|| reader.has_new().then(|| reader.latest()).flatten()`. Samples stay where they were, in
//! the lock-free ring, and a bus without a bell pays nothing. Ringing takes a critical section, so a crate that supplies
//! `critical-section` has to be there. Whoever is woken in vain sleeps again.
//!
//! Not for publishing in an interrupt that the critical section does not mask.

use core::cell::RefCell;
use core::future::poll_fn;
use core::task::{Poll, Waker};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::waitqueue::MultiWakerRegistration;

/// What up to `N` tasks sleep by. With more of them all are woken to look, and none sleeps for ever. See the
/// [module](self) documentation.
pub struct Bell<const N: usize> {
    // Borrowed within the critical section only, so by one at a time.
    sleepers: Mutex<CriticalSectionRawMutex, RefCell<MultiWakerRegistration<N>>>,
}

impl<const N: usize> Bell<N> {
    /// A bell by which nobody sleeps. Usually a `static`.
    #[must_use]
    pub const fn new() -> Self {
        Self { sleepers: Mutex::new(RefCell::new(MultiWakerRegistration::new())) }
    }

    /// Wakes all who sleep by it. Call it after the publish.
    pub fn ring(&self) {
        self.sleepers.lock(|sleepers| {
            if let Ok(mut sleepers) = sleepers.try_borrow_mut() {
                sleepers.wake();
            }
        });
    }

    /// Sleeps until `look` finds something. What is rung for between two looks is not missed.
    pub async fn wait_for<T>(&self, mut look: impl FnMut() -> Option<T>) -> T {
        poll_fn(|context| {
            if let Some(found) = look() {
                return Poll::Ready(found);
            }
            self.sleep(context.waker());
            // Published since the first look: the bell rang before this task slept by it.
            look().map_or(Poll::Pending, Poll::Ready)
        })
        .await
    }

    fn sleep(&self, waker: &Waker) {
        self.sleepers.lock(|sleepers| {
            if let Ok(mut sleepers) = sleepers.try_borrow_mut() {
                sleepers.register(waker);
            }
        });
    }
}

impl<const N: usize> Default for Bell<N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::sync::atomic::{AtomicU32, Ordering};
    use embassy_futures::{block_on, join::join4, poll_once};
    use std::thread;

    #[test]
    fn nothing_that_is_rung_for_is_missed() {
        static BELL: Bell<1> = Bell::new();
        static NEWEST: AtomicU32 = AtomicU32::new(0);
        const LAST: u32 = 20_000;
        // It publishes, then rings; the sleeper looks, sleeps, and looks again.
        let publisher = thread::spawn(|| {
            for n in 1..=LAST {
                NEWEST.store(n, Ordering::Release);
                BELL.ring();
                if n % 64 == 0 {
                    thread::yield_now();
                }
            }
        });
        let mut seen = 0;
        while seen < LAST {
            seen = block_on(BELL.wait_for(|| Some(NEWEST.load(Ordering::Acquire)).filter(|newest| *newest > seen)));
        }
        publisher.join().expect("it published all");
    }

    #[test]
    fn more_sleepers_than_places_all_wake() {
        let (bell, rung) = (Bell::<2>::new(), AtomicU32::new(0));
        let sleeper = || bell.wait_for(|| (rung.load(Ordering::Relaxed) > 0).then_some(()));
        let ring = async {
            rung.store(1, Ordering::Relaxed);
            bell.ring();
        };
        block_on(join4(sleeper(), sleeper(), sleeper(), ring));
    }

    #[test]
    fn nobody_wakes_without_a_reason() {
        let bell = Bell::<1>::default();
        bell.ring();
        assert!(poll_once(bell.wait_for(|| None::<()>)).is_pending());
    }
}
