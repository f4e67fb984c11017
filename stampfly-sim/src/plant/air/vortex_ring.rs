//! Vortex ring state: a rotor that sinks into its own wake draws in the air it has just pushed
//! down.
//!
//! The plain plant gains thrust in proportion to the sink rate, as momentum theory has it near
//! hover. Measured inflow deviates. With the climb rate `x = V/v` in units of the induced velocity
//! in hover, Leishman's curve through the measurements (Principles of Helicopter Aerodynamics, 2nd
//! ed., eq. 2.101, for −2 ≤ x ≤ 0) is
//!
//! ```text
//! vᵢ/v = κ − 1.125·x − 1.372·x² − 1.718·x³ − 0.655·x⁴,   κ = 1 for an ideal rotor
//! ```
//!
//! The flow through the disc, `x + vᵢ/v`, therefore stays near 0.9 to 0.8 from x = −0.4 to −1.2
//! instead of falling to 0.4: most of the damping is lost. Near hover the curve is no better than
//! momentum theory, so it is blended in between x = −0.2 and −0.5, where the ring begins. Below x =
//! −1.7 the rotor is in the windmill brake state, without loss.
//!
//! In the ring the thrust of each rotor fluctuates independently. Small propellers were measured to
//! fluctuate by about ±30 % at worst (Shetty and Selig, Small-scale propellers operating in the
//! vortex ring state, AIAA 2011-1254); the model takes this as three standard deviations at x =
//! −0.9. Fluctuations last some tens of revolutions, here 50 ms, *unverified*. Horizontal motion at
//! 0.95 v leaves the ring behind (Johnson, NASA/TP-2005-213477).

use super::Push;
use crate::noise::Noise;
use crate::normals::Normals;
use crate::plant::motor::PLACES;
use crate::plant::{PlantParameters, ROTORS};
use nalgebra::Vector3;

/// Climb rates between which the measured curve is blended in.
const ONSET: [f64; 2] = [-0.2, -0.5];
/// Climb rate with the largest fluctuation, and the one at which it has vanished.
const WORST: f64 = -0.9;
const END: f64 = -1.7;
/// Standard deviation of a rotor's thrust at the worst climb rate, as a share of its hover thrust.
const UNSTEADY: f64 = 0.1;
/// Correlation time of the fluctuation, s.
const LASTS: f64 = 0.05;
/// Horizontal speed from which no ring forms, in units of the induced velocity.
const SIDEWAYS: f64 = 0.95;
/// Least rotor speed, as a share of hover speed, at which the wake has an effect.
const SLOWEST: f64 = 0.2;

/// Vortex ring state of one vehicle.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct VortexRing {
    noise: Normals,
    strength: f64,
    induced: f64,
    /// Loss of thrust of all rotors in hover per unit of normalised inflow, N.
    per_inflow: f64,
    /// Hover thrust of one rotor, N, and its distance from the axes, m.
    each: f64,
    offset: f64,
    unsteady: [f64; ROTORS],
}

impl VortexRing {
    pub fn new(p: &PlantParameters, strength: f64, induced: f64, noise: Noise) -> Self {
        Self {
            noise: noise.into(),
            strength,
            induced,
            // In momentum theory near hover the inflow changes by half of the climb rate, which
            // causes the plant's vertical drag.
            per_inflow: 2.0 * p.drag_vertical * induced,
            each: p.mass * p.gravity / ROTORS as f64,
            offset: p.rotor_offset,
            unsteady: [0.0; ROTORS],
        }
    }

    /// Advances by `dt` seconds with this velocity through the air, body, m/s, and rotors at the
    /// share `share` of their hover speed.
    pub fn step(&mut self, dt: f64, air: &Vector3<f64>, share: f64) -> Push {
        let still = Push { force: Vector3::zeros(), torque: Vector3::zeros() };
        let induced = self.induced * share;
        // Body z points down: a positive `air.z` is sinking.
        let climb = -air.z / induced;
        // No random numbers are drawn outside the ring, which keeps ordinary flight cheap.
        if share < SLOWEST || climb > ONSET[0] {
            self.unsteady = [0.0; ROTORS];
            return still;
        }
        let sideways = (air.x * air.x + air.y * air.y).sqrt() / (SIDEWAYS * induced);
        // Scales with the square of rotor speed, as thrust does.
        let strength = self.strength * (1.0 - sideways * sideways).max(0.0) * share * share;
        let loss = strength * self.per_inflow * excess(climb);
        let keep = libm::exp(-dt / LASTS);
        let deviation = UNSTEADY * self.each * unsteadiness(climb);
        // Independent per rotor, hence the torque.
        let noise: [f64; ROTORS] = self.noise.next();
        let mut push = Push { force: Vector3::new(0.0, 0.0, loss), ..still };
        for ((unsteady, noise), (x, y)) in self.unsteady.iter_mut().zip(noise).zip(PLACES) {
            *unsteady = *unsteady * keep + (1.0 - keep * keep).sqrt() * noise;
            let thrust = strength * deviation * *unsteady;
            push.force.z -= thrust;
            push.torque += Vector3::new(-y * self.offset * thrust, x * self.offset * thrust, 0.0);
        }
        push
    }
}

/// Measured inflow beyond what the plain plant assumes, in units of the induced velocity. Never
/// negative.
fn excess(x: f64) -> f64 {
    let measured = x * (-0.125 + x * (-1.372 + x * (-1.718 - 0.655 * x)));
    let onset = ((x - ONSET[0]) / (ONSET[1] - ONSET[0])).clamp(0.0, 1.0);
    onset * (measured - 0.5 * x).max(0.0)
}

/// Relative fluctuation of the thrust, 1 at the worst climb rate.
fn unsteadiness(x: f64) -> f64 {
    let rises = (x - ONSET[0]) / (WORST - ONSET[0]);
    let falls = (x - END) / (WORST - END);
    rises.min(falls).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANT: PlantParameters = PlantParameters { manufacturing_spread: 0.0, ..PlantParameters::EXAMPLE };
    const INDUCED: f64 = 4.0;

    fn ring() -> VortexRing {
        VortexRing::new(&PLANT, 1.0, INDUCED, Noise::new(1, 1))
    }

    /// Flow through the disc of the plant with the ring.
    fn through(x: f64) -> f64 {
        1.0 + 0.5 * x + excess(x)
    }

    /// Values of Leishman's curve, and momentum theory of the windmill state at its end.
    #[test]
    fn the_flow_through_the_disc_is_the_measured_one() {
        for (x, measured) in [(-0.5, 0.893), (-1.0, 0.816), (-1.5, 0.583)] {
            assert!((through(x) - measured).abs() < 2e-3, "{x}: {}", through(x));
        }
        assert!((0.80..0.91).contains(&through(-0.7)) && (0.72..0.91).contains(&through(-1.2)), "it hardly falls");
        assert_eq!((excess(0.0), excess(-0.2), excess(-1.9)), (0.0, 0.0, 0.0));
    }

    #[test]
    fn sinking_at_the_induced_velocity_loses_most_of_the_damping() {
        let mut ring = ring();
        let sinking = Vector3::new(0.0, 0.0, INDUCED);
        let count = 40_000;
        let (mut mean, mut square) = (0.0, 0.0);
        for _ in 0..count {
            let push = ring.step(625e-6, &sinking, 1.0);
            mean += push.force.z / f64::from(count);
            square += push.torque.x * push.torque.x / f64::from(count);
        }
        let damping = PLANT.drag_vertical * INDUCED;
        assert!((0.55..0.7).contains(&(mean / damping)), "{mean} of {damping} N");
        // Four rotors at one arm, each with 0.1 of its thrust, reduced for the distance from the
        // worst climb rate.
        let each = PLANT.mass * PLANT.gravity / 4.0;
        let expected = 0.1 * each * (0.7 / 0.8) * 2.0 * PLANT.rotor_offset;
        assert!((square.sqrt() / expected - 1.0).abs() < 0.1, "{} of {expected} N·m", square.sqrt());
    }

    #[test]
    fn climbing_flying_away_and_rotors_at_rest_have_no_ring() {
        let still = Push { force: Vector3::zeros(), torque: Vector3::zeros() };
        let mut ring = ring();
        assert_eq!(ring.step(625e-6, &Vector3::new(0.0, 0.0, -3.0), 1.0), still);
        assert_eq!(ring.step(625e-6, &Vector3::new(0.0, 0.0, 0.3), 1.0), still, "a landing");
        assert_eq!(ring.step(625e-6, &Vector3::new(0.0, 0.0, 5.0), 0.0), still);
        let away = ring.step(625e-6, &Vector3::new(INDUCED, 0.0, INDUCED), 1.0);
        assert!(away.force.norm() == 0.0 && away.torque.norm() == 0.0, "{away:?}");
    }
}
