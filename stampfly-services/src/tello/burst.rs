//! Datagrams that a network has delayed.
//!
//! A text command has no time. But a program sends its sticks ten to fifty times a second: many of
//! them in one moment after a silence were sent during it, and what comes with them may be as old as
//! the silence. The first ones cannot be told from fresh ones. Nothing else is counted: a program
//! that waits for its answers may say a lot in one moment.

use stampfly_types::{Duration, Instant};

/// What comes after a silence of this length may be as old.
const SILENCE: Duration = Duration::from_secs(1);
/// Datagrams that were held up come within this time of one another.
const APART: Duration = Duration::from_millis(5);
/// So many sticks in a burst a program may send without having been held up.
const FEW: u8 = 3;

/// The datagrams of the program that commands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Burst {
    heard: Instant,
    /// Does this burst follow a silence, and how many sticks are in it?
    is_behind: bool,
    sticks: u8,
}

impl Burst {
    /// Of a program that has spoken at this instant for the first time.
    pub const fn new(now: Instant) -> Self {
        Self { heard: now, is_behind: false, sticks: 0 }
    }

    /// A datagram has arrived. May it be older than a second?
    pub fn hear(&mut self, now: Instant, is_sticks: bool) -> bool {
        let silence = now.since(self.heard);
        if silence > APART {
            (self.is_behind, self.sticks) = (silence > SILENCE, 0);
        }
        self.heard = now;
        self.sticks = self.sticks.saturating_add(u8::from(is_sticks));
        self.is_behind && self.sticks > FEW
    }
}
