//! Ceilings and walls, which draw: air that is sucked in between them and the rotors has little room, is fast, and has little pressure.
//!
//! **Ceiling.** Between a disc of radius R and a ceiling at distance d above it the air comes in from all sides, at radius r with `v·r/2d` when it goes through the disc
//! with v. Bernoulli and the balance of momentum, in which the ceiling is drawn as strongly as the disc, give for the disc
//! `T = 2ρA·v²·γ²` with `γ² = 1 + 1/32·(R/d)²`; far away it is the momentum theory's (this is the model of Hsiao and Chirarattananon, Ceiling effects for hybrid
//! aerial-surface locomotion of small rotorcraft, 2019, who measured it with propellers of 23 and 50 mm radius). So the same thrust needs less inflow, and blades
//! that turn as fast as before make more of it: `T = T₀·(1 + s·(1 − v/v₀))`. The blades' slope s is 2 here: usual for propellers of that pitch.
//!
//! **Wall.** The rotors are a sink for the air around. A sink at distance d from a wall feels its image behind it, which draws it with
//! `ρQ²/16πd²` (Lagally's theorem); Q is the flow through all rotors. That is 1 % of a StampFly's weight at 5 cm.

use super::DENSITY;
use core::f64::consts::PI;

/// How much less the blades push for more inflow.
const SLOPE: f64 = 2.0;
/// Nothing comes nearer to a ceiling or wall than this, in radii: there is a frame around.
const NEAREST: f64 = 0.2;

/// Thrust of rotors under a ceiling over that of free ones as fast; `distance` from the ceiling in radii.
pub(super) fn under_ceiling(distance: f64) -> f64 {
    let distance = distance.max(NEAREST);
    let gamma = (1.0 + 1.0 / (32.0 * distance * distance)).sqrt();
    // T = u²·T₀ and v = u·v₀/γ: u² + s·u/γ = 1 + s.
    let half = 0.5 * SLOPE / gamma;
    let u = (half * half + 1.0 + SLOPE).sqrt() - half;
    u * u
}

/// Force towards a wall, N, of rotors with this flow, m³/s, at a distance, m.
pub(super) fn beside_wall(distance: f64, flow: f64, radius: f64) -> f64 {
    let distance = distance.max(2.0 * radius);
    DENSITY * flow * flow / (16.0 * PI * distance * distance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_from_a_ceiling_there_is_no_effect_and_near_by_a_strong_one() {
        assert!((under_ceiling(1e3) - 1.0).abs() < 1e-6);
        assert!((1.0..1.03).contains(&under_ceiling(1.0)), "one radius below: {}", under_ceiling(1.0));
        assert!((1.15..1.3).contains(&under_ceiling(0.25)), "a quarter: {}", under_ceiling(0.25));
        assert!(under_ceiling(0.0) < 1.4, "it does not hold for ever: {}", under_ceiling(0.0));
    }

    /// Both equations of the file's comment.
    #[test]
    fn momentum_and_blades_agree() {
        for distance in [0.2, 0.5, 1.0, 3.0] {
            let thrust = under_ceiling(distance);
            let inflow = (thrust / (1.0 + 1.0 / (32.0 * distance * distance))).sqrt();
            assert!((thrust - (1.0 + SLOPE * (1.0 - inflow))).abs() < 1e-12, "{distance}");
        }
    }

    #[test]
    fn a_wall_draws_with_one_per_cent_of_the_weight_at_five_centimetres() {
        // The StampFly: four discs of 15 mm, 7.3 m/s.
        let flow = 4.0 * PI * 0.015 * 0.015 * 7.3;
        let share = beside_wall(0.05, flow, 0.015) / 0.361;
        assert!((0.009..0.013).contains(&share), "{share}");
        assert!(beside_wall(0.5, flow, 0.015) < 0.011 * beside_wall(0.05, flow, 0.015));
    }
}
