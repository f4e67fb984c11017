//! The vehicles there are. This list is the only place in the programs that names one.

use stampfly_board::simulation::StampFly;
use stampfly_plane::simulation::Plane;
use stampfly_rover::simulation::Rover;
use stampfly_sim::vehicle::Vehicle;
use stampfly_stm32_quad::simulation::Stm32Quad;
use std::fmt;

/// The vehicle that is meant when none is named.
pub const DEFAULT: &str = StampFly::NAME;

/// Names of all vehicles, as `--vehicle` takes them.
pub const NAMES: &[&str] = &[StampFly::NAME, Rover::NAME, Stm32Quad::NAME, Plane::NAME];

/// Something to do for one vehicle, whichever it is.
pub trait ForVehicle {
    /// What comes of it.
    type Output;

    /// Does it.
    fn run<V: Vehicle>(self) -> Self::Output;
}

/// Does something for the vehicle of this name.
///
/// # Errors
/// When there is no such vehicle.
pub fn with<T: ForVehicle>(name: &str, task: T) -> Result<T::Output, UnknownVehicle> {
    match name {
        StampFly::NAME => Ok(task.run::<StampFly>()),
        Rover::NAME => Ok(task.run::<Rover>()),
        Stm32Quad::NAME => Ok(task.run::<Stm32Quad>()),
        Plane::NAME => Ok(task.run::<Plane>()),
        _ => Err(UnknownVehicle(name.to_owned())),
    }
}

/// There is no vehicle of this name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownVehicle(pub String);

impl fmt::Display for UnknownVehicle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "there is no vehicle '{}'; there are: {}", self.0, NAMES.join(", "))
    }
}

impl std::error::Error for UnknownVehicle {}
