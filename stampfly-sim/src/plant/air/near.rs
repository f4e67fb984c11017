//! Attraction by ceilings and walls: the inflow between rotor and surface is fast and its pressure
//! low.
//!
//! **Ceiling.** Between a disc of radius R and a ceiling at distance d above it, air enters from
//! all sides, at radius r with `v·r/2d` for a velocity v through the disc. Bernoulli's equation and
//! the momentum balance, in which the ceiling is attracted as strongly as the disc, give `T =
//! 2ρA·v²·γ²` for the disc with `γ² = 1 + 1/32·(R/d)²`, which approaches momentum theory at large
//! distance (model of Hsiao and Chirarattananon, Ceiling effects for hybrid aerial-surface
//! locomotion of small rotorcraft, 2019, validated with propellers of 23 and 50 mm radius). The
//! same thrust then needs less inflow, so blades at the same speed produce more: `T = T₀·(1 + s·(1
//! − v/v₀))`. The slope s of the blades is 2, usual for propellers of this pitch.
//!
//! **Wall.** The rotors are a sink for the surrounding air. A sink at distance d from a wall is
//! attracted by its image with `ρQ²/16πd²` (Lagally's theorem), where Q is the flow through all
//! rotors: 1 % of a StampFly's weight at 5 cm.

use super::DENSITY;
use core::f64::consts::PI;

/// Relative loss of thrust per relative increase of inflow, s.
const SLOPE: f64 = 2.0;
/// Least distance from a ceiling, in radii, given by the frame.
const NEAREST: f64 = 0.2;

/// Thrust of rotors under a ceiling relative to free rotors of the same speed; `distance` in radii.
pub(super) fn under_ceiling(distance: f64) -> f64 {
    let distance = distance.max(NEAREST);
    let gamma = (1.0 + 1.0 / (32.0 * distance * distance)).sqrt();
    // T = u²·T₀ and v = u·v₀/γ: u² + s·u/γ = 1 + s.
    let half = 0.5 * SLOPE / gamma;
    let u = (half * half + 1.0 + SLOPE).sqrt() - half;
    u * u
}

/// Attraction by a wall, N, for this flow through the rotors, m³/s, at this distance, m. The
/// distance is limited to two radii.
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

    /// Both equations of the module documentation hold.
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
