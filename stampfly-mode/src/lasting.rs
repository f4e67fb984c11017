//! How long something has been so: what detectors wait for before they believe a condition.

use stampfly_types::{Duration, Instant};

/// How long a condition has held without a break. `since` is the caller's memory of it.
pub(crate) fn lasting(since: &mut Option<Instant>, now: Instant, holds: bool) -> Duration {
    if !holds {
        *since = None;
        return Duration::ZERO;
    }
    now.since(*since.get_or_insert(now))
}

/// Has the condition held for this time without a break?
pub(crate) fn lasts(since: &mut Option<Instant>, now: Instant, holds: bool, time: Duration) -> bool {
    lasting(since, now, holds) >= time && since.is_some()
}
