//! Control surfaces of an aeroplane: which way ailerons, elevator, rudder, elevons, V-tail and flaps go for what is asked.
//!
//! Every aeroplane is a list of surfaces, each with the share of roll, pitch, yaw and flap that it takes; [`Surface`] has them by name. A share
//! is a deflection, −1 to 1 of a surface's largest; the servo's middle, reach and direction belong to its output.
//!
//! A positive deflection is trailing edge down, for a fin trailing edge left, which is how PX4 and textbooks have it. Body frame FRD:
//! positive roll is right wing down, positive pitch nose up, positive yaw nose right. So for positive roll the left aileron goes down and the
//! right one up, for positive pitch the elevator up, for positive yaw the rudder right.
//!
//! It does not look at the airspeed: a controller divides its demand by the square of it.

use crate::bound::symmetric;

/// What is asked of all surfaces together, each −1 to 1. Flaps are 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceDemand {
    /// Right wing down is positive.
    pub roll: f32,
    /// Nose up is positive.
    pub pitch: f32,
    /// Nose right is positive.
    pub yaw: f32,
    /// Flaps down.
    pub flap: f32,
}

/// One surface: how much of each demand it takes, and which way.
///
/// ```
/// use stampfly_control::surfaces::{Surface, SurfaceDemand, deflections};
/// // A flying wing.
/// let wing = [Surface::ELEVON_LEFT, Surface::ELEVON_RIGHT];
/// let climb = SurfaceDemand { pitch: 0.4, ..SurfaceDemand::default() };
/// assert_eq!(deflections(&wing, &climb), [-0.2, -0.2], "both up, nose up");
/// let turn = SurfaceDemand { roll: 0.4, ..SurfaceDemand::default() };
/// assert_eq!(deflections(&wing, &turn), [0.2, -0.2], "left down, right up: rolls to the right");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Surface {
    /// Deflection for full roll.
    pub roll: f32,
    /// Deflection for full pitch.
    pub pitch: f32,
    /// Deflection for full yaw.
    pub yaw: f32,
    /// Deflection for full flaps.
    pub flap: f32,
}

impl Surface {
    const NONE: Self = Self { roll: 0.0, pitch: 0.0, yaw: 0.0, flap: 0.0 };
    /// Aileron of the left wing.
    pub const AILERON_LEFT: Self = Self { roll: 1.0, ..Self::NONE };
    /// Aileron of the right wing.
    pub const AILERON_RIGHT: Self = Self { roll: -1.0, ..Self::NONE };
    /// Elevator.
    pub const ELEVATOR: Self = Self { pitch: -1.0, ..Self::NONE };
    /// Rudder: right, and so negative, for a positive yaw.
    pub const RUDDER: Self = Self { yaw: -1.0, ..Self::NONE };
    /// Flap of either wing.
    pub const FLAP: Self = Self { flap: 1.0, ..Self::NONE };
    /// Elevon of the left wing: half of its reach for roll, half for pitch, so that both fit at once.
    pub const ELEVON_LEFT: Self = Self { roll: 0.5, pitch: -0.5, ..Self::NONE };
    /// Elevon of the right wing.
    pub const ELEVON_RIGHT: Self = Self { roll: -0.5, pitch: -0.5, ..Self::NONE };
    /// Left half of a V-tail that opens upwards: nose up is up, nose right is down, which there is to the right.
    pub const V_TAIL_LEFT: Self = Self { pitch: -0.5, yaw: 0.5, ..Self::NONE };
    /// Right half of a V-tail: nose up and nose right are both up, the latter being to the right there.
    pub const V_TAIL_RIGHT: Self = Self { pitch: -0.5, yaw: -0.5, ..Self::NONE };
    /// Flaperon of the left wing: all of its reach for roll, half for flaps; roll goes first.
    pub const FLAPERON_LEFT: Self = Self { roll: 1.0, flap: 0.5, ..Self::NONE };
    /// Flaperon of the right wing.
    pub const FLAPERON_RIGHT: Self = Self { roll: -1.0, flap: 0.5, ..Self::NONE };

    /// The deflection, −1 to 1. Flaps take what roll, pitch and yaw leave; what is no number is zero.
    #[must_use]
    pub fn deflection(&self, demand: &SurfaceDemand) -> f32 {
        let part = |share: f32, demand: f32| {
            let part = share * symmetric(if demand.is_nan() { 0.0 } else { demand }, 1.0);
            if part.is_finite() { symmetric(part, 1.0) } else { 0.0 }
        };
        let steers = part(self.roll, demand.roll) + part(self.pitch, demand.pitch) + part(self.yaw, demand.yaw);
        let steers = symmetric(steers, 1.0);
        // All that steers has the same way left on the other side of the wing, or lowering the flaps would roll it.
        let room = 1.0 - steers.abs();
        steers + symmetric(part(self.flap, demand.flap.max(0.0)), room)
    }
}

/// The deflections of all surfaces of an aeroplane, in their order.
#[must_use]
pub fn deflections<const N: usize>(surfaces: &[Surface; N], demand: &SurfaceDemand) -> [f32; N] {
    surfaces.each_ref().map(|surface| surface.deflection(demand))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type S = Surface;

    /// What surfaces make of their deflections, as an aeroplane answers: the force of a surface acts against its deflection's way, at
    /// its place. Left is −1. Roll, pitch and yaw, each over what full deflection of all surfaces that take part in it makes.
    fn made([left, right]: [f32; 2], tail: [f32; 2], rudder: f32) -> [f32; 6] {
        // Down at the left lifts the left wing, which rolls right. Down at a tail lifts it, nose down. Of a V, the left half faces up and
        // right, so down there is a force up and left: the tail goes left, the nose right. A fin's trailing edge to the left pushes
        // the tail right, nose left.
        let roll = 0.5 * (left - right);
        let both = 0.5 * (left + right);
        [roll, -both, both, -0.5 * (tail[0] + tail[1]), 0.5 * (tail[0] - tail[1]), -rudder]
    }

    proptest! {
        #[test]
        fn what_is_asked_is_what_the_surfaces_make(
            roll in -1f32..1.0, pitch in -1f32..1.0, yaw in -1f32..1.0, flap in 0f32..1.0,
        ) {
            let demand = SurfaceDemand { roll, pitch, yaw, flap };
            let near = |a: f32, b: f32| (a - b).abs() < 1e-5;
            let wings = deflections(&[S::ELEVON_LEFT, S::ELEVON_RIGHT], &demand);
            let tail = deflections(&[S::V_TAIL_LEFT, S::V_TAIL_RIGHT], &demand);
            let [rolls, pitches, _, tail_pitches, yaws, turns] = made(wings, tail, S::RUDDER.deflection(&demand));
            prop_assert!(near(rolls, 0.5 * roll) && near(pitches, 0.5 * pitch));
            prop_assert!(near(tail_pitches, 0.5 * pitch) && near(yaws, 0.5 * yaw) && near(turns, yaw));
            let flaperons = deflections(&[S::FLAPERON_LEFT, S::FLAPERON_RIGHT], &demand);
            let [rolls, _, lowered, ..] = made(flaperons, tail, 0.0);
            prop_assert!(near(rolls, roll), "flaps never cost roll: {rolls} of {roll}");
            prop_assert!(near(lowered, (0.5 * flap).min(1.0 - roll.abs())));
            let ailerons = deflections(&[S::AILERON_LEFT, S::AILERON_RIGHT], &demand);
            prop_assert!(near(made(ailerons, tail, 0.0)[0], roll));
            prop_assert!(near(S::ELEVATOR.deflection(&demand), -pitch) && near(S::FLAP.deflection(&demand), flap));
        }

        #[test]
        fn no_bits_go_beyond_the_reach(shares: [f32; 4], asked: [f32; 4]) {
            let surface = Surface { roll: shares[0], pitch: shares[1], yaw: shares[2], flap: shares[3] };
            let demand = SurfaceDemand { roll: asked[0], pitch: asked[1], yaw: asked[2], flap: asked[3] };
            let deflection = surface.deflection(&demand);
            prop_assert!(deflection.abs() <= 1.0 + 1e-6, "{deflection}");
        }
    }
}
