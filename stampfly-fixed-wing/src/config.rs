//! Speeds, heights and limits: all that the modes, the orders and the watch know of an aircraft.
//!
//! Airspeeds are true ones in m/s, heights in m above the strip, angles in rad, times in s. The default is the Ultra Stick 25e of the University of Minnesota, a
//! model of 1.96 kg and 1.27 m of span, on a grass strip 16 m wide. For another aircraft begin with its stall: rotation lies a fifth above it or more, cruise two thirds.

use crate::crash::CrashConfig;

/// An aircraft's numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Config {
    /// How fast.
    pub speed: Speeds,
    /// How high.
    pub height: Heights,
    /// How it turns and climbs.
    pub path: Paths,
    /// The last metres of a landing.
    pub flare: Flare,
    /// On its wheels.
    pub ground: Ground,
    /// When something is wrong.
    pub limits: Limits,
    /// What is a crash.
    pub crash: CrashConfig,
}

/// Airspeeds, m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Speeds {
    /// Slowest flight, wings level.
    pub stall: f32,
    /// It leaves the ground.
    pub rotation: f32,
    /// Of a climb.
    pub climb: f32,
    /// Between way-points.
    pub cruise: f32,
    /// On the slope, in stall speeds; half of the wind is added.
    pub approach_share: f32,
}

impl Default for Speeds {
    fn default() -> Self {
        Self { stall: 9.7, rotation: 12.0, climb: 16.5, cruise: 17.0, approach_share: 1.3 }
    }
}

/// Heights above the strip, m.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Heights {
    /// A take-off is over.
    pub climbed: f32,
    /// A landing begins.
    pub approach: f32,
    /// The slope is this high above the aiming point: what comes short must not land before it.
    pub crossing: f32,
    /// The throttle closes.
    pub flare: f32,
    /// The nose turns to the strip.
    pub decrab: f32,
    /// It is as good as on the ground.
    pub touchdown: f32,
}

impl Default for Heights {
    fn default() -> Self {
        Self { climbed: 40.0, approach: 40.0, crossing: 2.2, flare: 4.0, decrab: 1.5, touchdown: 0.4 }
    }
}

/// Turns and the first climb.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Paths {
    /// Radius of a turn, m.
    pub radius: f32,
    /// Largest bank, rad.
    pub bank_max: f32,
    /// Largest bank near the ground, rad.
    pub bank_low: f32,
    /// Bank of the circle in which it waits to know where it is, rad.
    pub bank_lost: f32,
    /// Pitch of the first climb, rad.
    pub climb_pitch: f32,
}

impl Default for Paths {
    fn default() -> Self {
        Self { radius: 70.0, bank_max: 0.7, bank_low: 0.35, bank_lost: 0.3, climb_pitch: 0.3 }
    }
}

/// The last metres of a landing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Flare {
    /// Rate of sink at touchdown, m/s.
    pub sink: f32,
    /// Time in which the height fades, s.
    pub time: f32,
    /// At the beginning of the flare it goes round when it is so far from the middle of the strip, m: half of its width.
    pub missed: f32,
}

impl Default for Flare {
    fn default() -> Self {
        Self { sink: 0.4, time: 3.0, missed: 8.0 }
    }
}

/// On its wheels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ground {
    /// Taxiing speed over the ground, m/s.
    pub speed: f32,
    /// A touchdown is over when it rolls this slowly, m/s.
    pub rolls: f32,
    /// How far beside the strip it parks, m.
    pub beside: f32,
    /// It turns into the strip this far before the point where it takes off, m.
    pub before: f32,
    /// A point is reached within this distance, m: a turn's radius.
    pub reached: f32,
}

impl Default for Ground {
    fn default() -> Self {
        Self { speed: 2.5, rolls: 4.0, beside: 20.0, before: 35.0, reached: 4.0 }
    }
}

/// When something is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Limits {
    /// The link is lost when nobody was heard for this long, s: it comes home and circles. Never, if it was never heard.
    pub link_lost: f32,
    /// When it has circled at home for so long and nobody wants anything else it lands, s.
    pub link_land: f32,
    /// When it has waited for so long to know where it is, it comes down where it is, s.
    pub blind: f32,
    /// Radius of the fence around home, m over ground.
    pub fence_radius: f32,
    /// Height of the fence above home, m.
    pub fence_height: f32,
    /// It lands at this voltage of the battery, V under load.
    pub battery: f32,
}

impl Default for Limits {
    fn default() -> Self {
        Self { link_lost: 5.0, link_land: 60.0, blind: 120.0, fence_radius: 1_500.0, fence_height: 150.0, battery: 9.9 }
    }
}
