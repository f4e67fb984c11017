//! Output stage for servos: pulses of 1000 to 2000 µs.
//!
//! Lag and speed of the servos belong to the aeroplane ([`plant`](crate::plant)). On a body without
//! control surfaces nothing moves.

use crate::plant::{Aeroplane, SURFACES, Surface};
use crate::time::Clock;
use crate::world::World;
use core::convert::Infallible;
use stampfly_drivers::ServoOutputs;
use stampfly_types::messages::ServoOutput;

/// Resolution: microseconds from the centre to the end.
const STEPS: f64 = 500.0;

/// Servo outputs of an aeroplane. Implements [`ServoOutputs`].
///
/// ```
/// use stampfly_drivers::ServoOutputs;
/// use stampfly_sim::plant::{Aeroplane, AeroplaneParameters, Surface};
/// use stampfly_sim::sensors::ServoModel;
/// use stampfly_sim::{Simulation, SimulationConfig};
/// use stampfly_types::{Instant, messages::ServoOutput};
///
/// let Simulation { clock, world, .. } = Simulation::new(&SimulationConfig::new(AeroplaneParameters::EXAMPLE));
/// let mut servos = ServoModel::new(&world, &clock, &[Surface::Elevator, Surface::Rudder]);
/// servos.write(&ServoOutput { deflection: [-0.5, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], count: 2 })?;
/// world.advance_to(Instant::from_millis(300));
/// let elevator = world.inspect_as(|plane: &Aeroplane| plane.surfaces()[Surface::Elevator as usize]);
/// assert!(elevator.is_some_and(|share| (share + 0.5).abs() < 0.01));
/// # Ok::<(), core::convert::Infallible>(())
/// ```
#[derive(Clone, Debug)]
pub struct ServoModel {
    world: World,
    clock: Clock,
    surfaces: Vec<Surface>,
}

impl ServoModel {
    /// Servos that move these surfaces, in the order of [`ServoOutput::deflection`]. If several
    /// move the same surface, the last one wins.
    #[must_use]
    pub fn new(world: &World, clock: &Clock, surfaces: &[Surface]) -> Self {
        Self { world: world.clone(), clock: clock.clone(), surfaces: surfaces.to_vec() }
    }
}

impl ServoOutputs for ServoModel {
    type Error = Infallible;

    fn write(&mut self, output: &ServoOutput) -> Result<(), Infallible> {
        let mut shares = [0.0; SURFACES];
        let told = output.deflection.iter().take(usize::from(output.count));
        for (surface, wanted) in self.surfaces.iter().zip(told) {
            // A value that is not finite centres the servo.
            let wanted = if wanted.is_finite() { f64::from(wanted.clamp(-1.0, 1.0)) } else { 0.0 };
            shares[*surface as usize] = (wanted * STEPS).round() / STEPS;
        }
        self.world.change(self.clock.now(), |plane: &mut Aeroplane| plane.set_surfaces(shares));
        Ok(())
    }
}
