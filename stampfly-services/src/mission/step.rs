//! What a mission is made of, what happens in it, and why it does not go on.

use crate::refusal::Refusal;
use core::fmt;
use stampfly_types::{Duration, Vec3};

/// One step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Step {
    /// Rise to this height above the ground, m. Done at once by a vehicle that flies.
    TakeOff(f32),
    /// Fly to a place. From the ground, take off first.
    GoTo {
        /// World frame, relative to the origin, m.
        place: Vec3,
        /// Heading there, rad; `None` keeps the present one.
        yaw: Option<f32>,
        /// Reached within this distance, m.
        radius: Option<f32>,
        /// Stay for so long; `None` for ever.
        stay: Option<Duration>,
    },
    /// Fly to this place at the present height, north and east, m, if there is one, and land.
    Land(Option<[f32; 2]>),
    /// Stay where it is.
    Wait(Duration),
    /// From now on this fast, m/s; zero for the vehicle's own speed.
    Speed(f32),
}

/// A mission: the step at each place from zero, `None` behind the last.
pub type Steps<'s> = &'s dyn Fn(usize) -> Option<Step>;

/// Why a mission does not go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Halt {
    /// Somebody asked for that, or for something else.
    Asked,
    /// The motors are off.
    Disarmed,
    /// A pilot flies.
    Pilot,
    /// The failsafe flies.
    Failsafe,
    /// Somebody else lands it.
    Landing,
    /// Whoever started it is not heard any more.
    Silent,
    /// The vehicle does not take a command.
    Refused(Refusal),
}

impl fmt::Display for Halt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Asked => f.write_str("asked to"),
            Self::Disarmed => f.write_str("motors are off"),
            Self::Pilot => f.write_str("a pilot flies"),
            Self::Failsafe => f.write_str("the failsafe flies"),
            Self::Landing => f.write_str("it lands"),
            Self::Silent => f.write_str("nobody is heard"),
            Self::Refused(refusal) => refusal.fmt(f),
        }
    }
}

impl core::error::Error for Halt {}

/// What has happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Event {
    /// The step at this place is done.
    Reached(usize),
    /// The last one is done.
    Finished,
    /// It does not go on by itself.
    Halted(Halt),
}
