//! Coming down with neither height nor climb rate: on thrust, and a test of the ground now and then.
//!
//! With a share of its hover thrust missing, a vehicle sinks at the speed at which drag carries that share: 0.3 m/s for 5 %
//! against the vertical drag of about 1.4 1/s that small rotors have. Hover thrust is known to a few per cent, so a share
//! that is fixed might not sink at all; it falls slowly instead, by one per cent a second, until even a vehicle that knows
//! its hover thrust badly comes down. Once a second `WeightTest` asks whether it stands.
//!
//! | time since it began | share | sinks at, hover thrust known exactly |
//! |---|---|---|
//! | 0 s | 0.95 | 0.35 m/s |
//! | 4 s | 0.91 | 0.6 m/s |
//! | 7 s and later | 0.88 | 0.85 m/s |
//!
//! Not for a vehicle whose climb rate is known: that one sinks at the speed it is asked for.

use super::weight::{Answers, Support};
use crate::lasting::lasting;
use stampfly_types::{Duration, Instant};

/// Share of hover thrust at the start.
const FIRST_SHARE: f32 = 0.95;
/// The share, and for how long, of a descent that breaks off a take-off, which may climb by 1 m/s: it takes away 0.5 m/s.
const BREAK_OFF: (f32, Duration) = (0.87, Duration::from_millis(400));
/// How fast the share falls, 1/s.
const FALL: f32 = 0.01;
/// The least share. What it sinks at, below 0.9 m/s, legs survive.
const LEAST_SHARE: f32 = 0.88;
/// Share of hover thrust while the ground is tested.
const TEST_SHARE: f32 = 0.6;
/// Between two tests.
const PAUSE: Duration = Duration::from_millis(900);
/// A test takes this long before it says anything: three times the motors' lag.
const SETTLE: Duration = Duration::from_millis(60);
/// A test that has found no ground by then is over.
const TEST: Duration = Duration::from_millis(85);

/// A descent without height and climb rate.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BlindDescent {
    began: Instant,
    /// When the last test began.
    tested: Instant,
    is_testing: bool,
    stands: Option<Instant>,
    /// It breaks off a take-off.
    breaks_off: bool,
}

impl BlindDescent {
    /// One that begins, in flight or in a take-off.
    pub const fn new(now: Instant, breaks_off: bool) -> Self {
        Self { began: now, tested: now, is_testing: false, stands: None, breaks_off }
    }

    /// The ceiling of thrust as a share of hover thrust, and whether the vehicle has stood for `touchdown_time`.
    /// `weight` is what the weight test said in this step.
    pub fn step(&mut self, now: Instant, weight: Answers, touchdown_time: Duration) -> (f32, bool) {
        if !self.is_testing && now.since(self.tested) >= PAUSE {
            (self.is_testing, self.tested, self.stands) = (true, now, None);
        }
        let age = now.since(self.tested);
        if self.is_testing && age >= SETTLE {
            let standing = lasting(&mut self.stands, now, weight.quick == Support::Stands);
            if standing >= touchdown_time {
                return (TEST_SHARE, true);
            }
            if weight.quick == Support::Falls || (self.stands.is_none() && age >= TEST) {
                self.is_testing = false;
            }
        }
        let age = now.since(self.began);
        let share = (FIRST_SHARE - FALL * age.seconds()).max(LEAST_SHARE);
        let share = if self.breaks_off && age < BREAK_OFF.1 { BREAK_OFF.0 } else { share };
        (if self.is_testing { TEST_SHARE } else { share }, false)
    }

    /// Is thrust being taken away to find the ground?
    #[must_use]
    pub fn is_testing(&self) -> bool {
        self.is_testing
    }
}
