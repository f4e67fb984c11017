//! The list of modes from the ground to the ground, and those of them that have one stage.

use super::descent::Landing;
use super::seen::{Multicopter, Seen};
use super::take_off::TakeOff;
use crate::stage::{Active, HandOver, Limit, Mode, Stage, Step};
use core::convert::Infallible;
use stampfly_types::Instant;
use stampfly_types::messages::{FlightPhase, GroundContact};

/// A flight, from the ground to the ground.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Flight;

impl Mode for Flight {
    type Vehicle = Multicopter;
    type Stage = FlightStage;
    type End = Infallible;
    const FIRST: FlightStage = FlightStage::Stand;

    fn enter(_: Instant, _: &Seen<'_>) -> Self {
        Self
    }
}

crate::stages! {
    /// The modes of a flight.
    pub enum FlightStage for Flight {
        Stand: Stand,
        TakeOff: Active<TakeOff>,
        Fly: Fly,
        Landing: Active<Landing>,
    }
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum FlightMemory;
}

impl FlightStage {
    /// The mode of a phase.
    pub const fn of(phase: FlightPhase) -> Self {
        match phase {
            FlightPhase::Init | FlightPhase::IdleGround | FlightPhase::IdleHeld => Self::Stand,
            FlightPhase::Armed | FlightPhase::TakeOff => Self::TakeOff,
            FlightPhase::Flying | FlightPhase::Flip => Self::Fly,
            FlightPhase::Landing => Self::Landing,
        }
    }
}

/// On the ground, motors off.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Stand;

impl Stage<Flight> for Stand {
    fn enter(_: &mut Flight, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Flight) -> Limit<Flight> {
        Limit::Unlimited("a vehicle stands until somebody arms it")
    }

    fn execute(&mut self, _: &mut Flight, _: Instant, seen: &Seen<'_>) -> Step<Flight> {
        Step::Stay(seen.touching(GroundContact::Ground))
    }
}

/// In flight.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Fly;

impl Stage<Flight> for Fly {
    fn enter(_: &mut Flight, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Flight) -> Limit<Flight> {
        Limit::Unlimited("the battery ends a flight")
    }

    fn execute(&mut self, _: &mut Flight, _: Instant, seen: &Seen<'_>) -> Step<Flight> {
        Step::Stay(seen.touching(GroundContact::Air))
    }
}

// The machine alone decides which phase follows: no mode ends by itself.
impl HandOver<TakeOff> for Flight {
    fn after(&mut self, end: Infallible) -> FlightStage {
        match end {}
    }
}

impl HandOver<Landing> for Flight {
    fn after(&mut self, end: Infallible) -> FlightStage {
        match end {}
    }
}
