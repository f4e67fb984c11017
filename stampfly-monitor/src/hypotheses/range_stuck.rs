//! The range repeats one value while the vehicle moves.
//!
//! A noise of one millimetre repeats a reading with a probability below 0.4. Dirt on the glass, a
//! frozen register or a cover repeat it permanently.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::messages::Finding;

/// Motion of the altimeter during the repetitions, m.
const MOVED: f32 = 0.2;
/// Number of repetitions while it moves that far. The larger one holds until the altimeter has
/// settled, because it may drift while the vehicle still stands.
const WHILE_MOVING: u32 = 6;
const UNSETTLED: u32 = 15;
/// Number of repetitions after a jump.
const AFTER_JUMP: u32 = 8;
/// Number of repetitions without any motion: 1.5 s.
const ALWAYS: u32 = 45;
/// Number of repetitions since the ground, on it and in flight together: 3 s. Recorded StampFlys
/// repeat a range 24 times on the ground.
const FROM_GROUND: u32 = 90;

/// Tests whether the range repeats one value while the vehicle moves. Details are at the head of
/// the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RangeStuck {
    /// Height of the altimeter at the first repetition, m.
    from: f32,
    /// The first of the equal readings had jumped.
    jumped: bool,
    /// Repetitions on the ground before the take-off; cleared when the range changes.
    stood: u32,
}

impl Hypothesis for RangeStuck {
    const SENSOR: Sensor = Sensor::Range;
    const FINDING: Finding = Finding::Stuck;

    fn step(&mut self, _: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        let altimeter = seen.altimeter;
        if !seen.flies && !seen.stands {
            // The accelerometer's error changes when the propellers stop: restart the comparison.
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
