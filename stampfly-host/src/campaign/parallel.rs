//! Work on as many threads as there are cores, with results in the order of the work.

use std::collections::BTreeMap;
use std::num::NonZero;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// On how many cores that many pieces of work are done at once: all there are, or as many as are allowed.
#[must_use]
pub fn workers(pieces: usize, most: Option<NonZero<usize>>) -> usize {
    let cores = most.or_else(|| std::thread::available_parallelism().ok());
    cores.map_or(1, usize::from).min(pieces.max(1))
}

/// Does each piece of work, and returns what came of it in the order of the pieces: it does not depend on the threads.
///
/// ```
/// use stampfly_host::campaign::parallel;
/// assert_eq!(parallel::each(3, parallel::workers(3, None), &|piece| piece * piece), [0, 1, 4]);
/// ```
pub fn each<T: Send>(pieces: usize, threads: usize, work: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(BTreeMap::new());
    std::thread::scope(|scope| {
        for _ in 0..threads.clamp(1, pieces.max(1)) {
            scope.spawn(|| {
                loop {
                    let piece = next.fetch_add(1, Ordering::Relaxed);
                    if piece >= pieces {
                        return;
                    }
                    let result = work(piece);
                    if let Ok(mut done) = done.lock() {
                        done.insert(piece, result);
                    }
                }
            });
        }
    });
    done.into_inner().unwrap_or_default().into_values().collect()
}
