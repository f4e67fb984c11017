//! How long what a socket hands over may have waited.
//!
//! A socket does not say when something came. The thread that reads it looks again and again, so what
//! it finds came since the look before: a tenth of a second ago at the most. After a stop of the
//! program, or while the flight takes nothing more, it may be as old as that took; what follows without
//! a pause may be, too.

use super::events::POLL;
use std::io::{Error, ErrorKind};
use std::time::{Duration, Instant};

/// Two looks that are farther apart were held up.
const HELD_UP: Duration = Duration::from_millis(300);
/// While it catches up, a pause of this length says that nothing more waits.
pub(super) const PAUSE: Duration = Duration::from_millis(1);
/// After this long it has caught up: a socket keeps less than can be read in this time.
const CATCHES_UP: Duration = Duration::from_millis(250);

/// The looks at one socket.
#[derive(Clone, Copy, Debug)]
pub(super) struct Looks {
    last: Instant,
    /// While it catches up: since when what comes may have waited, and when that was noticed.
    behind: Option<(Instant, Instant)>,
}

impl Looks {
    pub const fn begin(now: Instant) -> Self {
        Self { last: now, behind: None }
    }

    /// Something was there. Returns since when it may have waited.
    pub fn found(&mut self, now: Instant) -> Instant {
        let before = core::mem::replace(&mut self.last, now);
        if now.saturating_duration_since(before) > HELD_UP {
            let since = self.behind.map_or(before, |(since, _)| since);
            self.behind = Some((since, now));
        }
        self.behind = self.behind.filter(|(_, noticed)| now.saturating_duration_since(*noticed) < CATCHES_UP);
        self.behind.map_or(now, |(since, _)| since)
    }

    /// The look ended with this error. That nothing was there only a time-out says: a program that was
    /// stopped is interrupted when it goes on, whatever waits for it.
    pub fn failed(&mut self, now: Instant, error: &Error) {
        if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) {
            (self.last, self.behind) = (now, None);
        }
    }

    /// For how long the next look waits for something to come.
    pub const fn patience(&self) -> Duration {
        if self.behind.is_some() { PAUSE } else { POLL }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_found_after_a_stop_may_be_as_old_as_the_stop_and_so_may_what_follows_without_a_pause() {
        let begun = Instant::now();
        let at = |ms| begun + Duration::from_millis(ms);
        let mut looks = Looks::begin(begun);
        let [nothing, interrupted] = [ErrorKind::WouldBlock, ErrorKind::Interrupted].map(Error::from);
        assert_eq!(looks.found(at(90)), at(90));
        looks.failed(at(190), &nothing);
        looks.failed(at(3_999), &interrupted);
        assert_eq!((looks.found(at(4_000)), looks.patience()), (at(190), PAUSE));
        assert_eq!(looks.found(at(4_001)), at(190));
        looks.failed(at(4_002), &nothing);
        assert_eq!((looks.found(at(4_003)), looks.patience()), (at(4_003), POLL));
        // A stream without a pause is fresh again after a quarter of a second.
        looks.failed(at(4_100), &nothing);
        let old = (0..1_000).filter(|ms| looks.found(at(9_000 + ms)) < at(9_000)).count();
        assert_eq!(old, 250);
    }
}
