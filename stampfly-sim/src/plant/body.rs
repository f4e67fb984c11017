//! Interface of a vehicle that moves as one rigid body in a [`World`](crate::World).
//!
//! [`Body`] is the vehicle in motion, [`Airframe`] the set of parameters from which it is made.
//! Implement both for a vehicle of another kind. Features that only one kind has are reached
//! through [`World::inspect_as`](crate::World::inspect_as) and
//! [`World::change`](crate::World::change).

use super::{Battery, CannotSimulate, GRAVITY, Motion, Plant, PlantParameters, Pose, ROTORS, RotorFault};
use super::{Scene, WindConfig};
use crate::conditions::Conditions;
use core::any::Any;
use core::fmt;
use nalgebra::Vector3;
use stampfly_param::ParameterTable;

/// Disturbance of the sensors by the vehicle that carries them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbance {
    /// Magnetic field per ampere of battery current above [`Body::idle_current`], body FRD, µT/A.
    pub field: [f64; 3],
    /// Pressure at the barometer when all rotors turn at [`Body::nominal_rotor_speed`], Pa. It
    /// grows with the square of the speed. By default it is three times as large close to the
    /// ground (`baro_wash_floor` of [`Conditions`]).
    pub wash: f64,
}

impl Disturbance {
    /// No disturbance.
    pub const NONE: Self = Self { field: [0.0; 3], wash: 0.0 };
}

/// A vehicle in its surroundings, advanced step by step.
///
/// [`step`](Self::step) and [`motion`](Self::motion) are required; the other functions serve flying
/// vehicles and disturbances of sensors.
///
/// ```
/// use stampfly_sim::plant::{Body, GRAVITY, Motion, STEP};
/// use stampfly_sim::{World, types::Instant};
///
/// #[derive(Debug)]
/// struct Trolley(Motion);
///
/// impl Body for Trolley {
///     fn step(&mut self) {
///         // A constant push forward of 1 m/s².
///         self.0.specific_force.x = 1.0;
///         self.0.advance(STEP.seconds_f64(), GRAVITY);
///     }
///
///     fn motion(&self) -> &Motion {
///         &self.0
///     }
/// }
///
/// let world = World::new(Trolley(Motion::default()), Instant::ZERO);
/// let truth = world.truth_at(Instant::from_secs(2));
/// assert!((truth.position.x - 2.0).abs() < 1e-3 && truth.position.z.abs() < 1e-6);
/// ```
pub trait Body: Any + fmt::Debug {
    /// Advances by one [`STEP`](super::STEP).
    fn step(&mut self);

    /// Position, attitude and their derivatives.
    fn motion(&self) -> &Motion;

    /// Gravity, m/s², constant during a flight. By default [`GRAVITY`].
    fn gravity(&self) -> f64 {
        GRAVITY
    }

    /// Velocity of the air at this height above the ground, m; world NED, m/s. By default still
    /// air.
    fn air(&self, _height: f64) -> Vector3<f64> {
        Vector3::zeros()
    }

    /// Density of the air, kg/m³. By default that of the standard atmosphere at sea level.
    fn air_density(&self) -> f64 {
        1.225
    }

    /// The battery. By default one that is always full.
    fn battery(&self) -> &Battery {
        &Battery::UNUSED
    }

    /// True while any part touches the ground. By default always, as for a vehicle on wheels.
    fn contact(&self) -> bool {
        true
    }

    /// Number of steps in which a part that does not carry the vehicle touched the ground: a
    /// propeller, a wing tip. By default 0.
    fn scrapes(&self) -> u64 {
        0
    }

    /// Rotor speed in normal flight, rad/s, by which disturbances are scaled. By default 1, so that
    /// a body without rotors causes no division by zero.
    fn nominal_rotor_speed(&self) -> f64 {
        1.0
    }

    /// Current of everything except the motors, A. By default 0.
    fn idle_current(&self) -> f64 {
        0.0
    }

    /// Disturbance of the sensors. By default none.
    fn disturbance(&self) -> Disturbance {
        Disturbance::NONE
    }

    /// The scene around the vehicle. By default a level floor only.
    fn scene(&self) -> &Scene {
        &Scene::LEVEL
    }

    /// Sets the duty cycles of the motors, 0 to 1. By default ignored; a body with other actuators
    /// is commanded through [`World::change`](crate::World::change).
    fn set_duty(&mut self, _duty: [f64; ROTORS]) {}

    /// Sets the fault of a rotor, counted from 0. A rotor that does not exist is ignored, and so is
    /// every fault by default.
    fn set_rotor_fault(&mut self, _rotor: usize, _fault: RotorFault) {}
}

/// Named parameters from which a body is made.
pub trait Airframe: ParameterTable<f64> + Clone + fmt::Debug + PartialEq {
    /// The body made from them.
    type Body: Body;

    /// A body in this air at `pose`; `None` places it on the ground at the origin, facing north.
    /// `seed` determines all random values.
    fn body(&self, wind: &WindConfig, pose: Option<&Pose>, seed: u64) -> Self::Body;

    /// These parameters under the conditions, as far as parameters can express them: battery wear
    /// and temperature, mass of this seed's specimen. By default unchanged.
    #[must_use]
    fn under(&self, _conditions: &Conditions, _seed: u64) -> Self {
        self.clone()
    }

    /// The [body](Self::body) under these conditions. By default made from the parameters
    /// [under](Self::under) them.
    fn body_under(&self, conditions: &Conditions, wind: &WindConfig, pose: Option<&Pose>, seed: u64) -> Self::Body {
        self.under(conditions, seed).body(wind, pose, seed)
    }

    /// Lift of the rotors at full throttle, in weights. By default infinite, for vehicles that
    /// rotors do not carry.
    fn lift(&self) -> f64 {
        f64::INFINITY
    }

    /// Checks that the parameters together describe a vehicle that can be simulated. By default
    /// accepted.
    ///
    /// # Errors
    /// [`CannotSimulate`] with the reason.
    fn check(&self) -> Result<(), CannotSimulate> {
        Ok(())
    }
}

impl Body for Plant {
    fn step(&mut self) {
        Self::step(self);
    }

    fn motion(&self) -> &Motion {
        Self::motion(self)
    }

    fn gravity(&self) -> f64 {
        self.parameters().gravity
    }

    fn air(&self, height: f64) -> Vector3<f64> {
        Self::air(self, height)
    }

    fn battery(&self) -> &Battery {
        Self::battery(self)
    }

    fn contact(&self) -> bool {
        self.ground().contact()
    }

    fn scrapes(&self) -> u64 {
        self.ground().scrapes()
    }

    fn nominal_rotor_speed(&self) -> f64 {
        self.rotors().hover_speed()
    }

    fn idle_current(&self) -> f64 {
        self.parameters().board_current
    }

    fn disturbance(&self) -> Disturbance {
        // Differences between standing and hovering in a flight record of the StampFly.
        Disturbance { field: [-13.0, 20.0, -7.0], wash: 2.5 }
    }

    fn scene(&self) -> &Scene {
        Self::scene(self)
    }

    fn set_duty(&mut self, duty: [f64; ROTORS]) {
        Self::set_duty(self, duty);
    }

    fn set_rotor_fault(&mut self, rotor: usize, fault: RotorFault) {
        Self::set_rotor_fault(self, rotor, fault);
    }
}

impl Airframe for PlantParameters {
    type Body = Plant;

    fn body(&self, wind: &WindConfig, pose: Option<&Pose>, seed: u64) -> Plant {
        Plant::new(self, wind, pose, seed)
    }

    fn under(&self, conditions: &Conditions, seed: u64) -> Self {
        Self::under(self, conditions, seed)
    }

    fn body_under(&self, conditions: &Conditions, wind: &WindConfig, pose: Option<&Pose>, seed: u64) -> Plant {
        Plant::under(self, conditions, wind, pose, seed)
    }

    fn lift(&self) -> f64 {
        self.full_throttle().lift
    }

    fn check(&self) -> Result<(), CannotSimulate> {
        Self::check(self)
    }
}
