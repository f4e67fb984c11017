//! What a [`World`](crate::World) can hold: any vehicle that moves as one rigid body.
//!
//! [`Body`] is the vehicle in motion, [`Airframe`] the numbers of which it is made. Implement both for a vehicle of another kind. What only
//! one kind has stays with it: [`World::inspect_as`](crate::World::inspect_as) and [`World::change`](crate::World::change) reach it.

use super::{Battery, CannotSimulate, GRAVITY, Motion, Plant, PlantParameters, Pose, ROTORS, RotorFault};
use super::{Scene, WindConfig};
use crate::conditions::Conditions;
use core::any::Any;
use core::fmt;
use nalgebra::Vector3;
use stampfly_param::ParameterTable;

/// What a vehicle does to the sensors that it carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbance {
    /// Field per ampere of battery current above [`Body::idle_current`], body FRD, µT/A.
    pub field: [f64; 3],
    /// Pressure at the barometer when all rotors turn at [`Body::nominal_rotor_speed`], Pa. It grows with the square of the speed, and is three
    /// times as much close to the ground.
    pub wash: f64,
}

impl Disturbance {
    /// None at all.
    pub const NONE: Self = Self { field: [0.0; 3], wash: 0.0 };
}

/// A vehicle in its surroundings, advanced step by step.
///
/// A vehicle needs two of these; the others are for what flies, and for what disturbs its sensors.
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
///         // Somebody pushes: a metre a second more every second, forward.
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

    /// Where it is and how it moves.
    fn motion(&self) -> &Motion;

    /// Gravity, m/s². It does not change. By default [`GRAVITY`].
    fn gravity(&self) -> f64 {
        GRAVITY
    }

    /// Velocity of the air at this height above the ground, world NED, m/s. By default there is no wind.
    fn air(&self, _height: f64) -> Vector3<f64> {
        Vector3::zeros()
    }

    /// Density of the air, kg/m³. By default the standard atmosphere's at sea level.
    fn air_density(&self) -> f64 {
        1.225
    }

    /// The battery. By default one that is always full.
    fn battery(&self) -> &Battery {
        &Battery::UNUSED
    }

    /// Does anything touch the ground? By default always, as of what rolls.
    fn contact(&self) -> bool {
        true
    }

    /// In how many steps something has touched the ground that does not carry the vehicle there: a
    /// propeller, a wing tip. By default none.
    fn scrapes(&self) -> u64 {
        0
    }

    /// Rotor speed in usual flight, rad/s. By default 1: what has no rotors must not divide by nothing.
    fn nominal_rotor_speed(&self) -> f64 {
        1.0
    }

    /// What everything but the motors draws, A. By default nothing.
    fn idle_current(&self) -> f64 {
        0.0
    }

    /// What it does to its sensors. By default nothing.
    fn disturbance(&self) -> Disturbance {
        Disturbance::NONE
    }

    /// What stands around it. By default a level ground and nothing else.
    fn scene(&self) -> &Scene {
        &Scene::LEVEL
    }

    /// Sets the duty cycles of the motors, 0 to 1. By default ignored: a body that is driven otherwise is reached by
    /// [`World::change`](crate::World::change).
    fn set_duty(&mut self, _duty: [f64; ROTORS]) {}

    /// Breaks or mends a rotor, from 0; one that does not exist is ignored.
    fn set_rotor_fault(&mut self, _rotor: usize, _fault: RotorFault) {}
}

/// The numbers of which a body is made, each with a name.
pub trait Airframe: ParameterTable<f64> + Clone + fmt::Debug + PartialEq {
    /// What is made of them.
    type Body: Body;

    /// A body in this air at `pose`; `None` stands it on the ground at the origin, facing north. `seed` is of everything random.
    fn body(&self, wind: &WindConfig, pose: Option<&Pose>, seed: u64) -> Self::Body;

    /// The same numbers under these conditions, as far as they can say it: the battery worn and cold, the specimen of this seed as heavy as it
    /// is. By default as they are.
    #[must_use]
    fn under(&self, _conditions: &Conditions, _seed: u64) -> Self {
        self.clone()
    }

    /// The [body](Self::body) under these conditions. By default of the numbers that are [under](Self::under) them.
    fn body_under(&self, conditions: &Conditions, wind: &WindConfig, pose: Option<&Pose>, seed: u64) -> Self::Body {
        self.under(conditions, seed).body(wind, pose, seed)
    }

    /// What its rotors carry at full throttle, in weights. By default there is no limit: not every vehicle is carried by rotors.
    fn lift(&self) -> f64 {
        f64::INFINITY
    }

    /// Are these numbers together a vehicle that can be simulated? By default yes.
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
        // What a flight record of the StampFly shows between standing and hovering.
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
