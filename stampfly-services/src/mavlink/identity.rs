//! What a vehicle is in MAVLink, and which messages are for it.

use stampfly_link::mavlink::dialects::common::MavType;
use stampfly_types::Origin;

/// An autopilot, in MAVLink's numbering.
pub(super) const AUTOPILOT: u8 = 1;

/// What a vehicle is in MAVLink.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Identity {
    /// Its system number, from 1.
    pub system: u8,
    /// What kind of vehicle: a ground station decides by it what it shows.
    pub kind: MavType,
    /// Height that a take-off without one climbs to, m.
    pub take_off_height: f32,
    /// A place of a mission is reached within this distance unless its item says another, m: a little more than the one at which the vehicle itself
    /// takes the next way-point. An aeroplane is told of the next one before it turns.
    pub reach: f32,
    /// What a number without a name is worth in a version: major, minor, patch.
    pub version: [u8; 3],
}

/// What messages about the vehicle are made of besides what it publishes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Own {
    pub identity: Identity,
    /// Where on Earth it is, if anybody knows.
    pub origin: Option<Origin>,
}

impl Own {
    /// Is it for this vehicle? Zero is everybody.
    pub const fn is_meant(&self, system: u8, component: u8) -> bool {
        (system == 0 || system == self.identity.system) && matches!(component, 0 | AUTOPILOT)
    }
}
