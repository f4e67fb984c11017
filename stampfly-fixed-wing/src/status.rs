//! The aircraft's state in the words of the family, so that its services (MAVLink, pages, missions) read it like any other vehicle's.

use crate::messages::Place;
use crate::path_manager::{PathManager, Sensed};
use stampfly_types::messages::*;

/// Phase, mode, who commands, why it would not arm.
#[must_use]
pub fn status(manager: &PathManager, sensed: &Sensed<'_>) -> FlightStatus {
    let armed = manager.is_armed();
    FlightStatus {
        phase: match manager.status().place {
            Place::Nowhere => FlightPhase::Init,
            Place::TakeOffRoll | Place::TakeOffClimb => FlightPhase::TakeOff,
            Place::CruisingCruise => FlightPhase::Flying,
            Place::LandingTransition
            | Place::LandingSlope
            | Place::LandingFlare
            | Place::LandingDecrab
            | Place::LandingTouchdown => FlightPhase::Landing,
            Place::TaxiingStop
            | Place::TaxiingTurnOff
            | Place::TaxiingPark
            | Place::TaxiingReturn
            | Place::TaxiingLineUp => {
                if armed {
                    FlightPhase::Armed
                } else {
                    FlightPhase::IdleGround
                }
            }
        },
        mode: FlightMode::PosHold,
        armed,
        commander: match (armed, manager.is_overruled()) {
            (false, _) => CommandSource::None,
            (true, true) => CommandSource::Failsafe,
            (true, false) => CommandSource::Guided,
        },
        blocks: manager.blocks(sensed),
        ..FlightStatus::default()
    }
}
