//! The same work on many things, several at a time.

use std::sync::{Mutex, PoisonError};
use std::thread;

/// Calls `work` with each item on as many threads as `at_once` says. The results are in the order of the
/// items. Panics if a call panics.
pub fn each<T, R: Send>(
    items: impl IntoIterator<Item = T, IntoIter: Send>,
    at_once: usize,
    work: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    let (waiting, results) = (Mutex::new(items.into_iter().enumerate()), Mutex::new(Vec::new()));
    let next = || waiting.lock().unwrap_or_else(PoisonError::into_inner).next();
    thread::scope(|scope| {
        for _ in 0..at_once {
            scope.spawn(|| {
                while let Some((place, item)) = next() {
                    let result = work(item);
                    results.lock().unwrap_or_else(PoisonError::into_inner).push((place, result));
                }
            });
        }
    });
    let mut results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.sort_by_key(|(place, _)| *place);
    results.into_iter().map(|(_, result)| result).collect()
}

/// As many threads as this machine has cores.
pub fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}

#[cfg(test)]
mod tests {
    use super::each;

    #[test]
    fn every_item_has_its_result() {
        let doubled = each(0..100, 3, |number| 2 * number);
        assert_eq!(doubled, (0..100).map(|number| 2 * number).collect::<Vec<_>>());
    }
}
