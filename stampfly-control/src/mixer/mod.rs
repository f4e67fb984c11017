//! Force and torque to thrust per motor, for any airframe of fixed rotors.
//!
//! A rotor at (x, y) that pushes with thrust T along −z adds −y·T of roll, x·T of pitch and ±κ·T of yaw torque (κ:
//! drag torque per thrust; positive for a rotor that turns counter-clockwise seen from above). Stacked, that is a 4×N
//! matrix; the mixer is its Moore–Penrose inverse, for four rotors the plain inverse.
//!
//! The inverse is computed when the mixer is made, in constants if need be: a vehicle's mixer can be a `const`, and an
//! airframe that cannot be flown then does not compile.
//!
//! Motors can neither pull nor push without end. When a demand does not fit, it is given up in this order: yaw
//! first, then thrust, roll and pitch last, because they decide about up and down. What was given up is reported, so
//! that integrators can stop.
//!
//! [`shares`] is the other mixer, of vehicles whose gains are shares of a motor's range.

mod geometry;
mod multirotor;
pub mod shares;
#[cfg(test)]
mod tests;

pub use geometry::GeometryError;
pub use multirotor::MultirotorMixer;

use stampfly_types::messages::{ControlOutput, MAX_MOTORS};

/// Thrust per motor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mixed {
    /// Thrust per motor, N; zero beyond `count`.
    pub thrust: [f32; MAX_MOTORS],
    /// How many motors there are.
    pub count: u8,
    /// Shares of the demand that were given up: roll, pitch, yaw (0 to 1) and thrust. The last is negative when more
    /// thrust than asked was needed for roll and pitch.
    pub unmet: [f32; 4],
}

/// Anything that distributes force and torque over motors.
///
/// # Contract
/// * Every thrust is finite and within the motors' limits, whatever the demand.
/// * A demand that fits is met exactly; otherwise `unmet` says what is missing.
pub trait Mixer {
    /// Distributes the demand.
    fn mix(&self, demand: &ControlOutput) -> Mixed;
}
