//! What the judge sees of a vehicle.

use stampfly_sim::Truth;
use stampfly_types::Instant;
use stampfly_types::messages::FlightStatus;

/// What happens beside the bus at an instant.
pub struct Sight<'a> {
    pub now: Instant,
    /// In the vehicle's world.
    pub truth: &'a Truth,
    /// Height above the floor below, 0 when it stands, m.
    pub clearance: f32,
    /// In so many physics steps a wall or a ceiling has pushed it.
    pub strikes: u64,
    pub status: &'a FlightStatus,
    /// Steps of the mission that are done.
    pub done: usize,
}
