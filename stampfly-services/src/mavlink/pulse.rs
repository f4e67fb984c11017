//! Was what comes now held up on its way?
//!
//! MAVLink's messages do not say when they were sent. But a program that is there says so once a second: when its heartbeat is overdue, and then much comes at once, a
//! network has held it up, and a command in that burst may be as old as the silence. A program whose heartbeats do not come regularly tells nothing by their absence, and is
//! not judged.

use stampfly_types::{Duration, Instant};

/// Longest time between two heartbeats of a program that sends one a second. A command within it is fresh enough.
const BEAT: Duration = Duration::from_millis(1_400);
/// So many heartbeats in a row are regular.
const REGULAR: u8 = 3;
/// What was held up comes in one piece: after a gap of this length it is over.
const BURST: Duration = Duration::from_millis(100);

/// What is known of one client's heartbeats.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pulse {
    heard: Instant,
    beat: Instant,
    beats: u8,
    is_held: bool,
}

impl Pulse {
    pub const fn new() -> Self {
        Self { heard: Instant::ZERO, beat: Instant::ZERO, beats: 0, is_held: false }
    }

    /// A frame has come.
    pub fn hear(&mut self, now: Instant, is_heartbeat: bool) {
        if now.since(self.heard) > BURST {
            self.is_held = self.beats >= REGULAR && now.since(self.heard) > BEAT;
        }
        self.heard = now;
        if is_heartbeat {
            let is_regular = now.since(self.beat) <= BEAT;
            self.beats = if is_regular { self.beats.saturating_add(1) } else { 1 };
            self.beat = now;
        }
    }

    /// May what comes now be older than a second?
    pub const fn is_held(&self) -> bool {
        self.is_held
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Heartbeats at these times, and what is known then.
    fn held(pulse: &mut Pulse, times: &[u64]) -> bool {
        times.iter().for_each(|ms| pulse.hear(Instant::from_millis(*ms), true));
        pulse.is_held()
    }

    #[test]
    fn what_comes_after_an_overdue_heartbeat_was_held_up_until_the_burst_is_over() {
        for hold in [1_500, 5_000, 20_000] {
            let mut pulse = Pulse::new();
            assert!(!held(&mut pulse, &[1_000, 2_050, 3_000, 4_000]));
            pulse.hear(Instant::from_millis(4_000 + hold), false);
            assert!(pulse.is_held());
            assert!(held(&mut pulse, &[4_001 + hold, 4_090 + hold]), "more of the same");
            pulse.hear(Instant::from_millis(4_300 + hold), false);
            assert!(!pulse.is_held(), "it is back");
        }
    }

    #[test]
    fn a_program_without_regular_heartbeats_is_not_judged() {
        for times in [&[][..], &[1_000, 4_000, 9_000, 12_000], &[1_000, 2_000]] {
            let mut pulse = Pulse::new();
            assert!(!held(&mut pulse, times));
            pulse.hear(Instant::from_secs(60), false);
            assert!(!pulse.is_held(), "{times:?}");
        }
    }

    #[test]
    fn a_heartbeat_that_is_a_little_late_is_none_that_was_held_up() {
        let mut pulse = Pulse::new();
        assert!(!held(&mut pulse, &[1_000, 2_000, 3_000, 4_000, 5_350]));
    }
}
