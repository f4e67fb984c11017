//! The vehicle's own world: it begins where the vehicle stood, and its north is where the vehicle looked.

use stampfly_sim::Truth;
use stampfly_types::{Quat, Vec3, frame};

/// Where the vehicle stood at the start, and how it was turned.
///
/// Nothing on board knows north: the vehicle's world begins where it stood and ahead of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Home {
    origin: Vec3,
    turn: Quat,
}

impl Home {
    /// Of a vehicle that stands like this at the start.
    pub fn new(start: &Truth) -> Self {
        Self { origin: start.position, turn: frame::from_yaw(-frame::yaw(&start.attitude)) }
    }

    /// Turns and moves the truth into the vehicle's world.
    pub fn bring(&self, truth: &mut Truth) {
        truth.position = self.turn * (truth.position - self.origin);
        truth.velocity = self.turn * truth.velocity;
        truth.wind = self.turn * truth.wind;
        truth.attitude = self.turn * truth.attitude;
    }
}
