//! A blow from above: a ceiling, a shelf, a hand.
//!
//! It turns no motor off. A vehicle that is upright is pushed down by it and flies on; with its
//! motors off it would fall from there. It lands. Any other blow is a crash: a wall, the ground, or
//! the ground above a vehicle that lies on its back.

use super::input::FailsafeInput;
use stampfly_types::messages::{Alerts, Validity};
use stampfly_types::{Vec3, frame};

/// Cosine of the largest tilt, 60°, at which what is above the body is above the vehicle.
const UPRIGHT: f32 = 0.5;

/// Replaces [`IMPACT`](Alerts::IMPACT) by [`STRUCK`](Alerts::STRUCK) where the blow came from above.
/// `force`: the specific force of the blow, body FRD, m/s².
pub(super) fn from_above(found: Alerts, input: &FailsafeInput<'_>, force: &Vec3) -> Alerts {
    let estimate = input.estimate;
    let upright = estimate.valid.contains(Validity::TILT) && frame::cos_tilt(&estimate.attitude) > UPRIGHT;
    // What presses on the body from above accelerates it downwards.
    let pressed = force.z > 0.0 && force.z * force.z > force.x * force.x + force.y * force.y;
    if found.contains(Alerts::IMPACT) && upright && pressed {
        found.without(Alerts::IMPACT).with(Alerts::STRUCK)
    } else {
        found
    }
}
