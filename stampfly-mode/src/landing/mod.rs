//! Take-off and landing: contact with the ground, when take-off is done, when touchdown is sure.
//!
//! Everything here reads the estimate and the thrust that the motors were told to make, never a
//! sensor: a range finder that hangs must not stop a landing. Thrust that was asked for and not
//! made carries nothing, and a tired battery's demand is no thrust to compare with.
//!
//! It is built of [modes with stages](crate::stage), which follow the flight phase that the [machine](crate::machine) decides:
//!
//! | phase | mode | stages |
//! |---|---|---|
//! | INIT, IDLE_GROUND, IDLE_HELD | stand | |
//! | ARMED, TAKEOFF | take-off | spool-up, lift-off, climb |
//! | FLYING | fly | |
//! | LANDING | landing | descend, flare, touchdown, blind |
//!
//! A vehicle whose specific force does not follow its thrust stands. So does one that has lost half of its thrust, in whatever
//! way, and none of its specific force, and one that does not sink with half of the thrust that carries its weight. Neither height nor climb rate can make a vehicle in the air count as landed. One that
//! falls although its height says that it stands gets its thrust back, and comes down blind, as one without height and climb
//! rate does. One that does not feel its specific force is not known to stand: the [machine](crate::machine) stops its motors
//! by its height.

mod blind;
mod config;
mod descent;
mod flight;
mod seen;
mod take_off;
mod weight;

use crate::stage::Selector;
pub use config::LandingConfig;
use core::fmt;
use flight::{Flight, FlightStage};
use seen::Seen;
use stampfly_types::Instant;
use stampfly_types::messages::{
    ControlOutput, FlightPhase, GroundContact, LandDetected, MotorOutput, Setpoint, StateEstimate,
};
use weight::{Answers, WeightTest};

/// What the manager looks at.
#[derive(Clone, Copy, Debug)]
pub struct LandingInput<'a> {
    /// The estimate.
    pub estimate: &'a StateEstimate,
    /// Its specific force is measured.
    pub felt: bool,
    /// The present flight phase.
    pub phase: FlightPhase,
    /// The set-point one step ago.
    pub setpoint: &'a Setpoint,
    /// The controller's demand one step ago.
    pub demand: &'a ControlOutput,
    /// Share of its thrust that the motors could not make, 0 is none
    /// ([`MotorOutput::unmet`](stampfly_types::messages::MotorOutput)).
    pub unmet: f32,
}

impl LandingInput<'_> {
    /// Thrust that the motors were told to make, N.
    fn thrust(&self) -> f32 {
        self.demand.thrust * MotorOutput::met(self.unmet)
    }
}

/// The take-off and landing manager.
///
/// ```
/// use stampfly_mode::{LandingConfig, LandingInput, TakeoffLanding};
/// use stampfly_types::{Instant, messages::*};
/// use stampfly_types::Vec3;
/// let mut manager = TakeoffLanding::new(LandingConfig::default());
/// // A vehicle of half a kilogram that stands on the floor in LANDING: its thrust falls, its specific force does not.
/// let specific_force = Vec3::new(0.0, 0.0, -9.8);
/// let estimate = StateEstimate { height: 0.03, specific_force, valid: Validity::ALL, ..Default::default() };
/// let (mut landed_at, mut ceiling) = (None, 1.0f32);
/// for k in 0..1000u64 {
///     let land_detected = manager.step(Instant::from_micros(2_500 * k), &LandingInput {
///         felt: true,
///         estimate: &estimate, phase: FlightPhase::Landing, setpoint: &Setpoint::default(),
///         demand: &ControlOutput { thrust: 4.9 * ceiling.min(1.0), ..Default::default() },
///         unmet: 0.0,
///     });
///     ceiling = land_detected.thrust_ceiling;
///     if land_detected.landed && landed_at.is_none() { landed_at = Some(k as f32 * 0.0025) }
/// }
/// assert!(landed_at.is_some_and(|t| t > 0.3 && t < 1.5));
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TakeoffLanding {
    config: LandingConfig,
    phase: FlightPhase,
    contact: GroundContact,
    breaks_off: bool,
    selector: Selector<Flight>,
    weight: WeightTest,
    /// Was thrust being taken away in the step before?
    is_testing: bool,
}

impl TakeoffLanding {
    /// A manager of a vehicle that stands.
    #[must_use]
    pub fn new(config: LandingConfig) -> Self {
        Self {
            config,
            phase: FlightPhase::Init,
            contact: GroundContact::Ground,
            breaks_off: false,
            selector: Selector::new(),
            weight: WeightTest::default(),
            is_testing: false,
        }
    }

    /// One step, at the control rate.
    pub fn step(&mut self, now: Instant, input: &LandingInput<'_>) -> LandDetected {
        let before = core::mem::replace(&mut self.phase, input.phase);
        let entered = input.phase != before;
        if entered {
            self.is_testing = false;
            self.breaks_off = before == FlightPhase::TakeOff;
            if input.phase == FlightPhase::Landing {
                self.weight.begin_landing();
            }
        }
        let estimate = input.estimate;
        let weight = if input.felt {
            self.weight.step(now, -estimate.specific_force.z, input.thrust(), self.is_testing)
        } else {
            Answers::UNKNOWN
        };
        let seen = Seen {
            config: &self.config,
            phase: input.phase,
            breaks_off: self.breaks_off,
            estimate,
            setpoint: input.setpoint,
            weight,
            contact: self.contact,
        };
        // A take-off goes on when its spool-up is over.
        if entered && (before, input.phase) != (FlightPhase::Armed, FlightPhase::TakeOff) {
            self.selector.switch(FlightStage::of(input.phase), now, &seen);
        }
        // No stage of these fails, and none hands over in a circle.
        let asked = self.selector.execute(now, &seen).unwrap_or_else(|_| seen.asked());
        self.is_testing = asked.is_testing;
        self.contact = asked.land_detected.contact;
        asked.land_detected
    }

    /// The present mode and its stage, for people: `Landing/Touchdown`.
    #[must_use]
    pub fn stage(&self) -> impl fmt::Display {
        &self.selector
    }
}

#[cfg(test)]
mod tests;
