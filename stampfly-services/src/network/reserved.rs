//! Times of signatures that are reserved in flash, so that what was signed before a restart is not believed after it.
//!
//! A board has no clock that goes on without power. So it keeps a time that is ahead of every signature, and begins with it after a restart: whatever it believed before is old then. A station
//! whose clock is behind that takes over the vehicle's, as MAVLink's signing wants it; [`Mavlink`](crate::mavlink::Mavlink) tells it. Flash is not written while the motors turn, therefore what is
//! reserved is enough for a flight.

/// Signatures count time in units of 10 µs.
const MINUTE: u64 = 60 * 100_000;
/// Reserved at once.
const WHOLE: u64 = 30 * MINUTE;
/// More is reserved when less than this is left: longer than a battery lasts.
const LEAST: u64 = 15 * MINUTE;
/// A receiver believes somebody new who is this far behind.
const OLD: u64 = MINUTE;

/// What is reserved.
///
/// ```
/// use stampfly_services::network::Reserved;
/// let mut reserved = Reserved::new(None);
/// let until = reserved.due(0).expect("nothing is reserved yet");
/// reserved.kept(until);
/// assert_eq!(reserved.due(1_000), None);
/// // After a restart, every time before is old.
/// assert!(Reserved::new(Some(until)).epoch() > 1_000);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reserved {
    epoch: u64,
    until: u64,
}

impl Reserved {
    /// Its name in flash.
    pub const NAME: &str = "network.signed";

    /// What flash has from before the restart.
    #[must_use]
    pub const fn new(stored: Option<u64>) -> Self {
        let epoch = match stored {
            Some(until) => until,
            None => 0,
        };
        Self { epoch, until: epoch }
    }

    /// The time of a signature at the clock's zero.
    #[must_use]
    pub const fn epoch(&self) -> u64 {
        self.epoch
    }

    /// Is enough reserved for signatures at this time? Nothing is to be believed before.
    #[must_use]
    pub const fn covers(&self, time: u64) -> bool {
        time.saturating_add(OLD) < self.until
    }

    /// What is to be kept in flash now, if anything.
    #[must_use]
    pub const fn due(&self, time: u64) -> Option<u64> {
        if time.saturating_add(LEAST) < self.until { None } else { Some(time.saturating_add(WHOLE)) }
    }

    /// It was kept.
    pub const fn kept(&mut self, until: u64) {
        self.until = until;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Flash is written while disarmed alone; a station's clock may be years ahead.
        #[test]
        fn nothing_that_was_believed_is_believed_after_a_restart(
            lives in prop::collection::vec(prop::collection::vec((0_u64..10 * MINUTE, 0_u64..1 << 40), 1..6), 1..6),
        ) {
            let (mut stored, mut newest) = (None, None);
            for life in lives {
                let mut reserved = Reserved::new(stored);
                if let Some(newest) = newest {
                    prop_assert!(reserved.epoch() > newest + OLD, "{newest} is believed again");
                }
                let mut time = reserved.epoch();
                for (flight, station) in life {
                    // On the ground: a station is heard, and what is due is kept.
                    time = time.max(station);
                    if let Some(until) = reserved.due(time) {
                        stored = Some(until);
                        reserved.kept(until);
                    }
                    prop_assert!(reserved.covers(time));
                    // In the air.
                    time += flight;
                    newest = Some(time);
                }
            }
        }
    }
}
