//! What the modes between ground and ground look at, and what they ask for.

use super::config::LandingConfig;
use super::weight::Answers;
use crate::stage::Vehicle;
use stampfly_types::messages::{FlightPhase, GroundContact, LandDetected, Setpoint, StateEstimate, Validity};

/// A multicopter, as far as it has to do with the ground.
pub struct Multicopter;

impl Vehicle for Multicopter {
    type Input<'a> = Seen<'a>;
    type Output = Asked;
}

/// What the manager looks at in one cycle.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    pub config: &'a LandingConfig,
    pub phase: FlightPhase,
    /// The phase before was a take-off, so it may climb.
    pub breaks_off: bool,
    pub estimate: &'a StateEstimate,
    pub setpoint: &'a Setpoint,
    /// What the weight test says in this cycle.
    pub weight: Answers,
    /// Contact with the ground in the cycle before.
    pub contact: GroundContact,
}

impl Seen<'_> {
    /// Height above the surface, m, if it is known.
    pub fn height(&self) -> Option<f32> {
        self.estimate.valid.contains(Validity::HEIGHT).then_some(self.estimate.height)
    }

    /// Rate of descent, m/s, if it is known.
    pub fn sink_rate(&self) -> Option<f32> {
        self.estimate.valid.contains(Validity::VELOCITY_Z).then_some(self.estimate.velocity.z)
    }

    /// Nothing new, and no limit of thrust.
    pub fn asked(&self) -> Asked {
        self.touching(self.contact)
    }

    /// The same, with this contact.
    pub fn touching(&self, contact: GroundContact) -> Asked {
        Asked {
            land_detected: LandDetected {
                contact,
                thrust_ceiling: f32::MAX,
                descent_rate: self.config.descent,
                ..LandDetected::default()
            },
            is_testing: false,
        }
    }
}

/// What the manager asks for in one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// What others see.
    pub land_detected: LandDetected,
    /// Thrust is being taken away to find the ground.
    pub is_testing: bool,
}
