//! Does the vehicle stand? Thrust is taken away; if the accelerometer does not notice, something else carries the weight.
//!
//! In the air the accelerometer measures thrust over mass, so a share less of thrust is the same share less of specific
//! force within the motors' lag. On the ground the legs take over what the rotors leave, and the specific force stays one g.
//! Neither mass nor height nor climb rate is needed, and a constant bias of the accelerometer cancels: both quantities are
//! compared with what they were before.
//!
//! The test costs height: with 40 % of the thrust missing, a vehicle in the air has gained 0.2 m/s after 60 ms.

use stampfly_types::{Duration, Instant};

/// What the test says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Support {
    /// Not enough thrust has been taken away to tell.
    Unknown,
    /// Something other than the rotors carries the vehicle.
    Stands,
    /// Nothing does.
    Falls,
}

/// Time constant that stands for the motors' lag (20 ms on small ones) and for the filter of the specific force, s.
const LAG: f32 = 0.02;
/// Time constant of the reference, s: some periods of what shakes a vehicle, and shorter than a descent.
const REFERENCE: f32 = 0.15;
/// Less than this share of the thrust taken away tells nothing: vibration leaves 0.05 g in the mean over [`LAG`].
const LEAST_SHARE: f32 = 0.15;
/// The specific force follows thrust by less than this: it stands. Legs that spring back follow for a moment.
const STANDS: f32 = 0.4;
/// By more than this: it falls. The air cushion near the ground carries up to a fifth.
const FALLS: f32 = 0.65;
/// A step that lasts longer is treated as this long, s.
const LONGEST_STEP: f32 = 0.02;

/// Filtered thrust and specific force, and what both were before thrust was taken away.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WeightTest {
    last: Option<Instant>,
    /// Specific force upwards along the body's z axis, m/s², and its average.
    force: f32,
    force_before: f32,
    /// Thrust in two stages, as motors and filter delay it, N, and its average.
    thrust: [f32; 2],
    thrust_before: f32,
}

impl WeightTest {
    /// Takes one step's specific force upwards, m/s², and demanded thrust, N. `testing`: thrust is being taken away, the
    /// reference stays.
    pub fn step(&mut self, now: Instant, force: f32, thrust: f32, testing: bool) -> Support {
        if !(force.is_finite() && thrust.is_finite()) {
            return Support::Unknown;
        }
        let Some(last) = self.last.replace(now) else {
            (self.force, self.force_before) = (force, force);
            (self.thrust, self.thrust_before) = ([thrust; 2], thrust);
            return Support::Unknown;
        };
        let dt = now.since(last).seconds().min(LONGEST_STEP);
        let fast = dt / (LAG + dt);
        self.force += fast * (force - self.force);
        self.thrust[0] += fast * (thrust - self.thrust[0]);
        self.thrust[1] += fast * (self.thrust[0] - self.thrust[1]);
        if !testing {
            let slow = dt / (REFERENCE + dt);
            self.force_before += slow * (self.force - self.force_before);
            self.thrust_before += slow * (self.thrust[1] - self.thrust_before);
            return Support::Unknown;
        }
        // Positive: both were there before.
        if !(self.thrust_before > 0.0 && self.force_before > 0.0) {
            return Support::Unknown;
        }
        let taken = 1.0 - self.thrust[1] / self.thrust_before;
        let missing = 1.0 - self.force / self.force_before;
        if taken < LEAST_SHARE {
            Support::Unknown
        } else if missing < STANDS * taken {
            Support::Stands
        } else if missing > FALLS * taken {
            Support::Falls
        } else {
            Support::Unknown
        }
    }
}

/// How long a condition has held without a break.
pub fn lasting(since: &mut Option<Instant>, now: Instant, holds: bool) -> Duration {
    if !holds {
        *since = None;
        return Duration::ZERO;
    }
    now.since(*since.get_or_insert(now))
}
