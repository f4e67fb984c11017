//! Since when a page may have asked what comes now, when it does not say so itself.
//!
//! A page that is there says so twice a second. When nothing has come of it for more than a second, and then much at once, a network has held it
//! up: whatever comes in that burst may have been asked when the silence began.

use std::time::Duration;

/// A page that has said so often in a row that it is there is believed to go on.
const HABIT: u32 = 3;
/// Between two signs of life.
const BEAT: Duration = Duration::from_secs(1);
/// What was held up comes in one piece: after a gap of this length it is over.
const BURST: Duration = Duration::from_millis(100);

/// What is known of one page's signs of life.
#[derive(Debug)]
pub(super) struct Pulse {
    heard: Duration,
    beats: u32,
    /// Since when what comes now may have been held up.
    held: Option<Duration>,
}

impl Pulse {
    pub fn new(now: Duration) -> Self {
        Self { heard: now, beats: 0, held: None }
    }

    /// Something has come. Returns since when it may have been on its way.
    pub fn hear(&mut self, now: Duration, is_alive: bool) -> Duration {
        let gap = now.saturating_sub(self.heard);
        if gap > BURST {
            self.held = (gap > BEAT && self.beats >= HABIT).then_some(self.heard);
        }
        self.beats = match (is_alive, gap > BEAT) {
            (true, true) => 1,
            (true, false) => self.beats + 1,
            (false, true) => 0,
            (false, false) => self.beats,
        };
        self.heard = now;
        self.held.unwrap_or(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_after_a_silence_of_a_page_that_says_that_it_is_there_was_held_up() {
        let at = |ms: u64| Duration::from_millis(10_000 + ms);
        let mut pulse = Pulse::new(at(0));
        for ms in (0..2_000).step_by(400) {
            assert_eq!(pulse.hear(at(ms), true), at(ms));
        }
        assert_eq!(pulse.hear(at(1_800), false), at(1_800));
        // A network that is gone for three seconds, and then brings what waited.
        for (ms, is_alive) in [(4_800, true), (4_801, false), (4_840, true), (4_900, false)] {
            assert_eq!(pulse.hear(at(ms), is_alive), at(1_800));
        }
        assert_eq!(pulse.hear(at(5_300), true), at(5_300), "it is back");
    }

    #[test]
    fn a_program_that_says_nothing_but_what_it_wants_is_not_taken_for_late() {
        let mut pulse = Pulse::new(Duration::ZERO);
        for seconds in [1, 2, 10, 60] {
            let now = Duration::from_secs(seconds);
            assert_eq!(pulse.hear(now, false), now);
        }
    }
}
