//! Which tests fly in real time at the same time: as many as the machine has cores.
//!
//! A vehicle in real time takes a tenth of a core, so that these tests mostly wait, side by side. More of them than cores would
//! measure the machine.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::available_parallelism;

static FLYING: Mutex<usize> = Mutex::new(0);
static LANDED: Condvar = Condvar::new();

/// A test that flies in real time, until it is dropped.
pub struct InRealTime(());

/// Waits until a core is free.
pub fn in_real_time() -> InRealTime {
    let cores = available_parallelism().map_or(1, usize::from);
    let free = LANDED.wait_while(flying(), |flying| *flying >= cores);
    *free.unwrap_or_else(PoisonError::into_inner) += 1;
    InRealTime(())
}

impl Drop for InRealTime {
    fn drop(&mut self) {
        *flying() -= 1;
        LANDED.notify_one();
    }
}

/// A test that failed has left the number as it was.
fn flying() -> MutexGuard<'static, usize> {
    FLYING.lock().unwrap_or_else(PoisonError::into_inner)
}
