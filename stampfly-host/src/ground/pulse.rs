//! The age of asks that carry no time of their own.
//!
//! A silent page may be waiting for an answer. But several signs of life that arrive together after
//! a silence were sent during it: a network has delayed them, and the asks that arrive with them
//! may be as old as the silence.

use std::time::Duration;

/// A silence of this length may be that of a network.
const SILENCE: Duration = Duration::from_secs(1);
/// Delayed texts arrive within this time of one another.
const BURST: Duration = Duration::from_millis(100);
/// And all of them within this time: they are few. A program that talks without a pause, each time
/// that it is answered, is not late for ever.
const LONGEST: Duration = Duration::from_secs(1);
/// Signs of life in one burst that a page without a delay does not send.
const SIGNS: u32 = 2;

/// The signs of life of one page.
#[derive(Debug)]
pub(super) struct Pulse {
    heard: Duration,
    /// The beginning of the silence before this burst, that of the burst, and its signs of life.
    silent: Option<(Duration, Duration, u32)>,
}

impl Pulse {
    pub fn new(now: Duration) -> Self {
        Self { heard: now, silent: None }
    }

    /// A text has arrived. Returns the earliest time at which it may have been sent.
    pub fn hear(&mut self, now: Duration, is_alive: bool) -> Duration {
        let gap = now.saturating_sub(self.heard);
        if gap > BURST {
            self.silent = (gap > SILENCE).then_some((self.heard, now, 0));
        }
        self.silent.take_if(|(_, begun, _)| now.saturating_sub(*begun) > LONGEST);
        self.heard = now;
        match &mut self.silent {
            Some((since, _, signs)) => {
                *signs += u32::from(is_alive);
                if *signs >= SIGNS { *since } else { now }
            }
            None => now,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_with_signs_of_life_that_a_network_has_held_up_is_as_old_as_the_silence() {
        let at = |ms: u64| Duration::from_millis(10_000 + ms);
        let mut pulse = Pulse::new(at(0));
        for ms in (0..2_000).step_by(400) {
            assert_eq!(pulse.hear(at(ms), true), at(ms));
        }
        // A network that is gone for three seconds, and then brings what waited.
        assert_eq!(pulse.hear(at(4_600), true), at(4_600), "one sign may be one that was said just now");
        for (ms, is_alive) in [(4_601, true), (4_602, false), (4_640, true), (4_700, false)] {
            assert_eq!(pulse.hear(at(ms), is_alive), at(1_600));
        }
        assert_eq!(pulse.hear(at(5_100), true), at(5_100), "it is back");
    }

    #[test]
    fn a_program_that_says_with_each_question_that_it_is_there_is_late_for_a_second_at_most() {
        let at = |ms: u64| Duration::from_millis(10_000 + ms);
        let mut pulse = Pulse::new(at(0));
        for ms in (5_000..9_000).step_by(10) {
            pulse.hear(at(ms), true);
            let asked = pulse.hear(at(ms), false);
            assert!(asked == at(ms) || ms <= 6_000, "{ms} ms");
        }
    }

    #[test]
    fn a_program_that_waits_for_something_before_it_asks_is_not_taken_for_late() {
        let mut pulse = Pulse::new(Duration::ZERO);
        for seconds in [1, 2, 10, 60] {
            let now = Duration::from_secs(seconds);
            // As it goes on, it says once more that it is there.
            assert_eq!(pulse.hear(now, true), now);
            assert_eq!(pulse.hear(now, false), now);
        }
    }
}
