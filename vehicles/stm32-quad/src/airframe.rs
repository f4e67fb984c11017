//! The frame that this firmware protects: what its protections have to know of it, each number with
//! where it comes from.
//!
//! The document's own frame is on a page that it does not print. This one has 220 mm, 380 g, two
//! cells and propellers of 5 × 3 inches, and is the one that the simulation flies. For another
//! frame change these numbers, and nothing else.

use stampfly_types::{Duration, GRAVITY};

/// What a frame can do, and what it bears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Airframe {
    /// Duty of every motor with which it hovers, a share.
    pub hover: f32,
    /// Force of the hardest touch-down that its legs bear, m/s²: what is harder breaks it.
    pub hardest_touch: f32,
    /// Lean with which it lies on its side, less what it may be wrong by, rad. On a slope that is
    /// as steep it tips over.
    pub lies: f32,
    /// Largest angular acceleration of its body, rad/s². A sample that asks for more is garbage, or
    /// a blow.
    pub angular_acceleration: f32,
    /// How long it needs to turn as it is told, at most.
    pub response: Duration,
}

/// The frame.
pub const AIRFRAME: Airframe = Airframe {
    // 0.93 N of each motor at 1086 rad/s, for which it needs 4.9 V of 8.2.
    hover: 0.6,
    // Legs of 1 kN/m stop 0.38 kg from 1.5 m/s within 30 mm, with 16 g at most and 12 g in the mean
    // of a blow. Its rotors push with 2.3 g, and with 1.2 g more where they sink into their own
    // wash at 10 m/s: flight makes a third of it.
    hardest_touch: 12.0 * GRAVITY,
    // On a foot and an upper corner it leans by 63°. Level flight ends at 64°, where its 2.3
    // weights of thrust carry just its weight.
    lies: 1.0,
    // Two rotors at full thrust and two at rest make 600 rad/s²; a blow of 100 N at a corner makes
    // twenty times as much for some milliseconds.
    angular_acceleration: 3_000.0,
    // Nothing brakes a rotor: it loses half of its speed in 0.4 s. With the throttle low and full
    // sticks the frame turns on meanwhile; in 24 flights with half a minute of stunts each the
    // longest was 0.25 s.
    response: Duration::from_millis(400),
};
