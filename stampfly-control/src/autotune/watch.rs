//! When a vehicle may be excited: while it hovers by itself, nobody steers it, nothing is wrong, and what is done to it stays small.
//!
//! The same conditions hold before the first step and at every one; whichever fails first is told.

use stampfly_types::messages::{
    Alerts, CommandSetpoint, CommandSource, FlightPhase, FlightStatus, GroundContact, LandDetected, StateEstimate,
    Validity,
};
use stampfly_types::{math, message_enum};

use super::config::AutotuneConfig;
use crate::attitude;
use crate::controller::ControlInput;

/// All that a step looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AutotuneInput<'a> {
    /// Where the vehicle is and how it turns. The rates are the ones the rate loop gets.
    pub estimate: &'a StateEstimate,
    /// The sticks.
    pub command: &'a CommandSetpoint,
    /// Flight phase and mode.
    pub flight_status: &'a FlightStatus,
    /// Contact with the ground.
    pub land_detected: &'a LandDetected,
    /// What the failsafe has found.
    pub alerts: Alerts,
    /// What the mixer could not deliver in the previous step ([`Mixed::unmet`](crate::Mixed)): shares of roll, pitch, yaw, thrust.
    pub unmet: [f32; 4],
}

impl<'a> AutotuneInput<'a> {
    /// What a controller looks at, and what the failsafe has found.
    #[must_use]
    pub const fn of(input: &ControlInput<'a>, alerts: Alerts) -> Self {
        let ControlInput { estimate, command, flight_status, land_detected, unmet, .. } = *input;
        Self { estimate, command, flight_status, land_detected, alerts, unmet }
    }
}

message_enum! {
    /// Why tuning does not begin, or has ended without a result. The gains are as they were, and nothing is excited any more.
    #[non_exhaustive]
    pub enum AutotuneStop {
        /// An axis is being tuned.
        #[default]
        Busy = 0,
        /// Not armed and flying by itself, or too low, or it moves, or whether it does is not known.
        NotHovering = 1,
        /// Rate, attitude or torque are no numbers, or the tilt is not known.
        Estimate = 2,
        /// It tilts too far or turns too fast.
        Excursion = 3,
        /// Torque was cut too often: what is measured then is not what was asked for.
        Saturated = 4,
        /// A stick is not centred.
        Sticks = 5,
        /// The failsafe has found something.
        Alert = 6,
        /// Steps do not follow each other: one was missing for 20 ms, or they are too rare for the highest tone.
        Timing = 7,
        /// It takes too long.
        Timeout = 8,
        /// Windows differ too much, or no gain, lag and delay explain what was measured.
        Quality = 9,
        /// No gains within the bounds keep both margins.
        Margins = 10,
        /// The present gains are none to start from, or the ones that were found differ from them by more than they may.
        Bounds = 11,
        /// Somebody ended it.
        Cancelled = 12,
    }
}

impl core::fmt::Display for AutotuneStop {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Busy => "an axis is being tuned",
            Self::NotHovering => "the vehicle does not hover by itself",
            Self::Estimate => "rate, attitude or torque are not known",
            Self::Excursion => "it tilts too far or turns too fast",
            Self::Saturated => "torque was cut too often",
            Self::Sticks => "a stick is not centred",
            Self::Alert => "an alert is active",
            Self::Timing => "control steps do not follow each other",
            Self::Timeout => "it takes too long",
            Self::Quality => "what was measured is not good enough",
            Self::Margins => "no gains within the bounds keep both margins",
            Self::Bounds => "the gains differ too much from the present ones",
            Self::Cancelled => "somebody ended it",
        })
    }
}

impl core::error::Error for AutotuneStop {}

/// Whether the vehicle may be excited now.
pub(super) fn check(config: &AutotuneConfig, input: &AutotuneInput<'_>) -> Result<(), AutotuneStop> {
    let (estimate, status, command) = (input.estimate, input.flight_status, input.command);
    // Comparisons are false for what is no number, and then refuse.
    if !(estimate.attitude.is_unit()
        && estimate.valid.contains(Validity::TILT)
        && estimate.angular_rate.iter().all(|rate| rate.is_finite()))
    {
        return Err(AutotuneStop::Estimate);
    }
    if input.alerts.intersects(config.alerts) {
        return Err(AutotuneStop::Alert);
    }
    let by_itself = status.armed
        && status.phase == FlightPhase::Flying
        && !status.mode.is_manual()
        && command.source != CommandSource::Failsafe
        && input.land_detected.contact == GroundContact::Air;
    let high = estimate.valid.contains(Validity::HEIGHT) && estimate.height >= config.height_min;
    let drifts = estimate.valid.contains(Validity::VELOCITY_XY);
    let rests = (!drifts || estimate.velocity.horizontal().norm() <= config.speed_max)
        && estimate.velocity.z.abs() <= config.speed_max;
    if !(by_itself && high && rests) {
        return Err(AutotuneStop::NotHovering);
    }
    let sticks = [command.roll, command.pitch, command.yaw, command.throttle];
    if !sticks.iter().all(|stick| stick.abs() <= config.stick_max) {
        return Err(AutotuneStop::Sticks);
    }
    let level = attitude::down_in_body(&estimate.attitude).z >= math::cos(config.tilt_max);
    if !(level && estimate.angular_rate.iter().all(|rate| rate.abs() <= config.rate_max)) {
        return Err(AutotuneStop::Excursion);
    }
    Ok(())
}
