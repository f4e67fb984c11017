//! When a board's radio joins an access point: only with motors off, on the pilot's channel, and not again and again.
//!
//! | file | what it is |
//! |---|---|
//! | `mod.rs` | [`Association`]: what the radio is to do next |
//! | `credentials.rs` | [`Credentials`]: a network's name and pass-phrase, and their form in flash |
//! | `wish.rs` | [`Wish`]: what a person types about it |
//!
//! For a radio that also hears the pilot, which is on one channel at a time. A search for a network elsewhere would cost the pilot's packets, so the radio looks for its access point on the
//! pilot's channel alone, and leaves one that moves away. While the motors may turn it looks for none at all. Not for a radio that has a network to itself.

mod credentials;
mod wish;

pub use credentials::{Credentials, CredentialsError, NAMES, RECORD, Record};
pub use wish::{USAGE, Wish};

use core::fmt;
use stampfly_types::{Duration, Instant};

/// Before the second try. Each further one waits twice as long.
const FIRST: Duration = Duration::from_secs(2);
/// Doublings of it: 64 s is the longest.
const DOUBLINGS: u32 = 5;
/// An attempt that has come to nothing by then is given up. Handshake and retries of the radio's libraries take less.
const PATIENCE: Duration = Duration::from_secs(15);

/// What the radio is to do. It says with an [`Event`] what came of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Join the access point, on the pilot's channel alone.
    Join,
    /// Leave it, or end the attempt to join.
    Leave,
}

/// What the radio has done, or what has happened to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// It has joined an access point, on this channel.
    Joined(u8),
    /// It could not, or is not joined any more.
    Away,
    /// The access point is on this channel now.
    Channel(u8),
}

/// How it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// No network is known.
    Off,
    /// Not joined; the next try is not before this instant, nor while armed.
    Away(Instant),
    /// It tries to, since this instant.
    Joining(Instant),
    /// It is, on this channel.
    Joined(u8),
    /// It leaves.
    Leaving,
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Off => f.write_str("no network is known"),
            Self::Away(_) => f.write_str("not joined"),
            Self::Joining(_) => f.write_str("joining"),
            Self::Joined(channel) => write!(f, "joined on channel {channel}"),
            Self::Leaving => f.write_str("leaving"),
        }
    }
}

/// What the radio is to do next.
///
/// ```
/// use stampfly_services::association::{Association, Event, State, Step};
/// use stampfly_types::Instant;
/// let mut association = Association::new(1, true);
/// assert_eq!(association.poll(Instant::ZERO, true), None, "armed");
/// assert_eq!(association.poll(Instant::ZERO, false), Some(Step::Join));
/// association.note(Instant::from_secs(1), Event::Joined(1));
/// // Armed, it stays.
/// assert_eq!(association.poll(Instant::from_secs(2), true), None);
/// assert_eq!(association.state(), State::Joined(1));
/// ```
#[derive(Clone, Debug)]
pub struct Association {
    /// The pilot's channel.
    channel: u8,
    is_wanted: bool,
    state: State,
    /// Tries in a row that came to nothing.
    failures: u32,
}

impl Association {
    /// For a radio whose pilot is on this channel. `is_wanted` says whether a network is known.
    #[must_use]
    pub const fn new(channel: u8, is_wanted: bool) -> Self {
        let state = if is_wanted { State::Away(Instant::ZERO) } else { State::Off };
        Self { channel, is_wanted, state, failures: 0 }
    }

    /// How it is.
    #[must_use]
    pub const fn state(&self) -> State {
        self.state
    }

    /// Is the radio part of a network?
    #[must_use]
    pub const fn is_joined(&self) -> bool {
        matches!(self.state, State::Joined(_))
    }

    /// Another network is known, or none any more. The present one is left.
    pub fn want(&mut self, is_wanted: bool) {
        (self.is_wanted, self.failures) = (is_wanted, 0);
        self.state = match self.state {
            State::Off | State::Away(_) => self.away(Instant::ZERO),
            // Its channel is nobody's: the next step is to leave.
            State::Joining(_) | State::Joined(_) => State::Joined(0),
            State::Leaving => State::Leaving,
        };
    }

    /// What the radio is to do now, once. `armed` is true as long as nobody knows that the motors are off.
    pub fn poll(&mut self, now: Instant, armed: bool) -> Option<Step> {
        match self.state {
            State::Away(until) if !armed && now >= until => {
                self.state = State::Joining(now);
                Some(Step::Join)
            }
            State::Joining(since) if armed || now.since(since) >= PATIENCE => self.leave(),
            // To go elsewhere with it would be to leave the pilot.
            State::Joined(channel) if channel != self.channel => self.leave(),
            _ => None,
        }
    }

    const fn leave(&mut self) -> Option<Step> {
        self.state = State::Leaving;
        Some(Step::Leave)
    }

    /// What the radio says.
    pub fn note(&mut self, now: Instant, event: Event) {
        self.state = match (event, self.state) {
            (Event::Joined(channel), State::Joining(_)) => {
                self.failures = 0;
                State::Joined(channel)
            }
            (Event::Channel(channel), State::Joined(_)) => State::Joined(channel),
            (Event::Away, State::Joining(_) | State::Joined(_) | State::Leaving) => {
                let wait = Duration::from_micros(FIRST.as_micros() << self.failures.min(DOUBLINGS));
                self.failures = self.failures.saturating_add(1);
                self.away(now + wait)
            }
            // Too late: it leaves.
            (_, state) => state,
        };
    }

    const fn away(&self, until: Instant) -> State {
        if self.is_wanted { State::Away(until) } else { State::Off }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CHANNEL: u8 = 1;

    #[test]
    fn tries_that_come_to_nothing_become_rare() {
        let (mut association, mut now) = (Association::new(CHANNEL, true), Instant::ZERO);
        let mut waits = std::vec::Vec::new();
        for _ in 0..8 {
            let before = now;
            while association.poll(now, false) != Some(Step::Join) {
                now += Duration::from_millis(100);
            }
            waits.push(now.since(before).as_micros() / 1_000_000);
            association.note(now, Event::Away);
        }
        assert_eq!(waits, [0, 2, 4, 8, 16, 32, 64, 64]);
        while association.poll(now, false) != Some(Step::Join) {
            now += Duration::from_secs(1);
        }
        association.note(now, Event::Joined(CHANNEL));
        association.note(now, Event::Away);
        assert_eq!(association.state(), State::Away(now + FIRST), "one that was there is looked for at once");
    }

    #[test]
    fn arming_ends_an_attempt_and_keeps_what_is_there() {
        let mut association = Association::new(CHANNEL, true);
        assert_eq!(association.poll(Instant::ZERO, false), Some(Step::Join));
        assert_eq!(association.poll(Instant::from_millis(10), true), Some(Step::Leave));
        association.note(Instant::from_millis(20), Event::Joined(CHANNEL));
        assert_eq!(association.state(), State::Leaving, "it joined while it was to leave");
        association.note(Instant::from_millis(30), Event::Away);
        assert_eq!(association.poll(Instant::from_secs(60), true), None);
        assert_eq!(association.poll(Instant::from_secs(60), false), Some(Step::Join));
        association.note(Instant::from_secs(61), Event::Joined(CHANNEL));
        assert_eq!(association.poll(Instant::from_secs(62), true), None);
        assert!(association.is_joined());
        association.note(Instant::from_secs(63), Event::Away);
        assert_eq!(association.poll(Instant::from_secs(600), true), None, "it was lost in flight");
    }

    #[test]
    fn an_access_point_that_moves_is_left_in_flight_too() {
        let mut association = Association::new(CHANNEL, true);
        association.poll(Instant::ZERO, false);
        association.note(Instant::ZERO, Event::Joined(CHANNEL));
        association.note(Instant::ZERO, Event::Channel(6));
        assert_eq!(association.poll(Instant::ZERO, true), Some(Step::Leave));
    }

    #[test]
    fn what_is_forgotten_is_left_and_not_looked_for() {
        let mut association = Association::new(CHANNEL, true);
        association.poll(Instant::ZERO, false);
        association.note(Instant::ZERO, Event::Joined(CHANNEL));
        association.want(false);
        assert_eq!(association.poll(Instant::ZERO, false), Some(Step::Leave));
        association.note(Instant::ZERO, Event::Away);
        assert_eq!(association.state(), State::Off);
        assert_eq!(association.poll(Instant::from_secs(600), false), None);
        association.want(true);
        assert_eq!(association.poll(Instant::from_secs(600), false), Some(Step::Join));
    }

    #[derive(Clone, Debug)]
    enum Happens {
        Poll { armed: bool },
        Says(Event),
        Want(bool),
    }

    fn happens() -> impl Strategy<Value = Happens> {
        prop_oneof![
            4 => any::<bool>().prop_map(|armed| Happens::Poll { armed }),
            1 => (0_u8..14).prop_map(|channel| Happens::Says(Event::Joined(channel))),
            1 => (0_u8..14).prop_map(|channel| Happens::Says(Event::Channel(channel))),
            1 => Just(Happens::Says(Event::Away)),
            1 => any::<bool>().prop_map(Happens::Want),
        ]
    }

    proptest! {
        /// Whatever the radio says, and whenever.
        #[test]
        fn it_never_joins_armed_nor_unasked_and_never_says_the_same_twice(
            all in prop::collection::vec((happens(), 0_u64..20_000), 1..200),
        ) {
            let (mut association, mut now) = (Association::new(CHANNEL, true), Instant::ZERO);
            let (mut last, mut is_wanted) = (None, true);
            for (what, ms) in all {
                now += Duration::from_millis(ms);
                match what {
                    Happens::Poll { armed } => {
                        let step = association.poll(now, armed);
                        if step == Some(Step::Join) {
                            prop_assert!(!armed && is_wanted);
                        }
                        if step.is_some() {
                            prop_assert_ne!(step, last, "without a word of the radio");
                            last = step;
                        }
                    }
                    Happens::Says(event) => {
                        association.note(now, event);
                        if event == Event::Away {
                            last = None;
                        }
                    }
                    Happens::Want(wanted) => {
                        association.want(wanted);
                        is_wanted = wanted;
                    }
                }
            }
        }
    }
}
