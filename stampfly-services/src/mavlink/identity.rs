//! What a vehicle is in MAVLink, and which messages are for it.

use crate::mission::Origin;
use stampfly_link::mavlink::dialects::common::MavType;

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
