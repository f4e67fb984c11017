//! The range repeats itself while the vehicle moves.
//!
//! Noise of a millimetre repeats a reading with a probability below 0.4. Dirt on the glass, a frozen
//! register and a cover do it for ever.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::messages::Finding;

/// How far the altimeter moves while the range repeats itself, m.
const MOVED: f32 = 0.2;
/// Readings running that are equal while it moves so far: a range that measures changes with it. More
/// of them until the altimeter has settled, which may drift while the vehicle still stands.
const WHILE_MOVING: u32 = 6;
const UNSETTLED: u32 = 15;
/// As many after a jump.
const AFTER_JUMP: u32 = 8;
/// As many whether anything moves or not: 1.5 s.
const ALWAYS: u32 = 45;
/// As many from the ground on, those on the ground and those in the air together: 3 s. Recorded
/// StampFlys repeat one 24 times there.
const FROM_GROUND: u32 = 90;

/// See the head of this file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RangeStuck {
    /// Height of the altimeter when the range began to repeat itself, m.
    from: f32,
    /// The first of the equal readings had jumped.
    jumped: bool,
    /// Equal readings on the ground, before the take-off; none as soon as the range changes.
    stood: u32,
}

impl Hypothesis for RangeStuck {
    const SENSOR: Sensor = Sensor::Range;
    const FINDING: Finding = Finding::Stuck;

    fn step(&mut self, _: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        let altimeter = seen.altimeter;
        if !seen.flies && !seen.stands {
            // Propellers that stop take an error of the accelerometer with them.
            self.from = altimeter.height;
        }
        let Some(repeat) = &seen.range_repeat else { return Opinion::Unknown };
        if repeat.count == 0 {
            *self = Self { from: altimeter.height, jumped: repeat.jumps, stood: 0 };
        }
        if seen.stands {
            self.stood = repeat.count;
            return Opinion::Unknown;
        }
        let needed = if altimeter.has_settled() { WHILE_MOVING } else { UNSETTLED };
        let stuck = repeat.count >= needed && (altimeter.height - self.from).abs() > MOVED
            || repeat.count >= AFTER_JUMP && self.jumped
            || repeat.count >= ALWAYS + self.stood
            || repeat.count >= FROM_GROUND;
        if stuck { Opinion::Holds(seen.back_to_altimeter()) } else { Opinion::Unknown }
    }
}
