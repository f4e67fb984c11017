//! Commands that a network has delayed.
//!
//! MAVLink's messages carry no time, and a silent program may be waiting for an answer. But several
//! heartbeats that arrive together after a silence were sent during it: the commands behind them
//! may be as old as the silence. A command ahead of them cannot be told from a fresh one. How long
//! something lay in a queue of this machine, the queue's owner knows and says.

use stampfly_types::{Duration, Instant};

/// Longest time between two heartbeats of a program that sends one a second.
const SILENCE: Duration = Duration::from_millis(1_400);
/// Delayed frames arrive within this time of one another.
const BURST: Duration = Duration::from_millis(100);
/// Heartbeats together that a program without a delay does not send.
const HEARTBEATS: u8 = 2;
/// So near together are those that a network has kept. One that goes with each question of a program
/// comes an answer later.
const TOGETHER: Duration = Duration::from_millis(4);
/// Heartbeats that are farther apart than this come at their pace, and a burst is over, also when a
/// program streams without a pause.
const PACE: Duration = Duration::from_millis(500);

/// The heartbeats of one client, and what they show: what comes now may be old.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pulse {
    heard: Instant,
    /// When the other end said that what comes behind was late.
    late: Option<Instant>,
    /// Does this burst follow a silence, and how many heartbeats are in it?
    is_behind: bool,
    heartbeats: u8,
    /// When the last one came.
    beat: Instant,
    /// What comes now lay in a queue.
    lay: bool,
}

impl Pulse {
    /// The client has come now.
    #[must_use]
    pub const fn new(now: Instant) -> Self {
        Self { late: None, heard: now, is_behind: false, heartbeats: 0, beat: Instant::ZERO, lay: false }
    }

    /// What comes until this is called again lay in a queue of this machine for more than a second,
    /// or it did not.
    pub const fn lies(&mut self, lay: bool) {
        self.lay = lay;
    }

    /// A frame has arrived.
    pub fn hear(&mut self, now: Instant, is_heartbeat: bool) {
        if now.since(self.heard) > BURST {
            (self.is_behind, self.heartbeats) = (now.since(self.heard) > SILENCE, 0);
        }
        self.heard = now;
        if is_heartbeat {
            let since = now.since(self.beat);
            if self.heartbeats > 0 && since > PACE {
                (self.is_behind, self.heartbeats) = (false, 0);
            }
            let is_alone = self.heartbeats < HEARTBEATS && since > TOGETHER;
            self.heartbeats = if is_alone { 1 } else { self.heartbeats.saturating_add(1) };
            self.beat = now;
        }
    }

    /// The other end knows the vehicle's clock, and says with it whether what comes behind is late.
    pub(crate) fn mark(&mut self, now: Instant, is_late: bool) {
        self.late = is_late.then_some(now);
    }

    /// May the frames that arrive now be older than a second?
    #[must_use]
    pub fn is_held(&self) -> bool {
        let is_late = self.late.is_some_and(|at| self.heard.since(at) <= BURST);
        self.lay || is_late || (self.is_behind && self.heartbeats >= HEARTBEATS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hear(pulse: &mut Pulse, ms: u64, is_heartbeat: bool) -> bool {
        pulse.hear(Instant::from_millis(ms), is_heartbeat);
        pulse.is_held()
    }

    #[test]
    fn what_comes_behind_heartbeats_that_were_held_up_may_be_as_old_as_they() {
        let mut pulse = Pulse::new(Instant::ZERO);
        assert!((1..5).all(|second| !hear(&mut pulse, 1_000 * second, true)));
        assert!(!hear(&mut pulse, 9_000, true), "one may have been sent just now");
        assert!(hear(&mut pulse, 9_001, true) && hear(&mut pulse, 9_002, false) && hear(&mut pulse, 9_090, true));
        assert!(!hear(&mut pulse, 9_300, false), "it is back");
    }

    #[test]
    fn a_heartbeat_with_each_of_several_questions_behind_a_silence_is_no_delay() {
        let mut pulse = Pulse::new(Instant::from_millis(40_000));
        for ms in [40_000, 40_005, 40_010, 43_000, 43_020, 43_025, 50_000, 50_005] {
            assert!(!hear(&mut pulse, ms, true) && !hear(&mut pulse, ms, false), "{ms} ms");
        }
        // Once it is seen, it is so to the end of what was kept.
        assert!(!hear(&mut pulse, 60_000, true) && hear(&mut pulse, 60_001, true) && hear(&mut pulse, 60_090, true));
    }

    #[test]
    fn a_program_that_waits_for_something_before_it_asks_is_not_taken_for_late() {
        let mut pulse = Pulse::new(Instant::ZERO);
        for second in [1, 2, 3, 4, 9, 20, 60] {
            assert!(!hear(&mut pulse, 1_000 * second, true) && !hear(&mut pulse, 1_000 * second, false));
        }
    }
}
