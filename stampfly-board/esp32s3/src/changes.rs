//! Parameters that have changed, on their way from the console's core to the one that flies, which takes the gains between two passes and the others when the vehicle is
//! disarmed.
//!
//! The room for one is got and given back on the console's core, so that the core that flies does not wait for the heap. Only when another one was handed over in the
//! moment in which it applied one, it gives one back.

use alloc::boxed::Box;
use core::cell::RefCell;
use core::sync::atomic::{AtomicU8, Ordering};
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use stampfly_board::VehicleConfig;
use stampfly_flight::live::Change;

type Waiting = Option<Box<Change<VehicleConfig>>>;

/// Nothing is to be done.
const NOTHING: u8 = 0;
/// Something, once the vehicle is disarmed.
const AT_REST: u8 = 1;
/// Something, armed or not.
const AT_ONCE: u8 = 2;

/// What there is to do. Looked at after every pass, where a critical section would be too much.
static DUE: AtomicU8 = AtomicU8::new(NOTHING);
/// There is one.
static WAITING: CriticalSectionMutex<RefCell<Waiting>> = CriticalSectionMutex::new(RefCell::new(None));

fn due(change: &Change<VehicleConfig>) -> u8 {
    match (change.is_due(true), change.is_due(false)) {
        (true, _) => AT_ONCE,
        (false, true) => AT_REST,
        (false, false) => NOTHING,
    }
}

/// Hands one over, on the console's core. Where one waits already, this one takes its place and does for both.
pub fn hand_over(change: Change<VehicleConfig>) {
    let mut change = Box::new(change);
    let earlier = WAITING.lock(|waiting| {
        let mut waiting = waiting.borrow_mut();
        if let Some(earlier) = &*waiting {
            change.follow(earlier);
        }
        DUE.store(due(&change), Ordering::Release);
        waiting.replace(change)
    });
    // Given back here, not inside of the critical section.
    drop(earlier);
}

/// Is something to be done for a vehicle that is armed, or is not?
#[inline]
pub fn is_due(is_armed: bool) -> bool {
    DUE.load(Ordering::Acquire) > if is_armed { AT_REST } else { NOTHING }
}

/// The one that waits, to be [given back](give_back).
pub fn take() -> Waiting {
    WAITING.lock(|waiting| waiting.borrow_mut().take())
}

/// Gives one back, with what is left to do of it. It stays here, done or not, until the next one is handed over.
pub fn give_back(change: Box<Change<VehicleConfig>>) {
    let spare = WAITING.lock(|waiting| {
        let mut waiting = waiting.borrow_mut();
        let (kept, spare) = match waiting.take() {
            Some(mut newer) => {
                newer.follow(&change);
                (newer, Some(change))
            }
            None => (change, None),
        };
        DUE.store(due(&kept), Ordering::Release);
        *waiting = Some(kept);
        spare
    });
    drop(spare);
}
