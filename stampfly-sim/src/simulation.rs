//! A vehicle ready to fly: the world, the clock and the chips, made from one configuration and one seed.

use crate::plant::{Plant, PlantParameters, Pose, WindConfig};
use crate::sensors::Sensors;
use crate::time::Clock;
use crate::world::{Truth, World};
use stampfly_types::Instant;

/// All that decides a simulation. The same configuration gives the same bits on every machine.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulationConfig {
    /// Seed of everything random: specimens, noise, gusts.
    pub seed: u64,
    /// What the clock shows at the start.
    pub start: Instant,
    /// The vehicle and its surroundings.
    pub plant: PlantParameters,
    /// The air.
    pub wind: WindConfig,
    /// Strength of propeller vibration; 1 is what was recorded, 0 is none.
    pub vibration: f64,
    /// Where it starts; `None` stands it on the floor at the origin, facing north.
    pub pose: Option<Pose>,
}

impl SimulationConfig {
    /// This vehicle with seed 1, standing on the floor of a room with people in it.
    #[must_use]
    pub fn new(plant: PlantParameters) -> Self {
        Self { seed: 1, start: Instant::ZERO, plant, wind: WindConfig::default(), vibration: 1.0, pose: None }
    }

    /// [`PlantParameters::EXAMPLE`], a vehicle that nobody built: for examples and tests.
    #[must_use]
    pub fn example() -> Self {
        Self::new(PlantParameters::EXAMPLE)
    }
}

/// One simulated vehicle.
///
/// The parts are public and independent handles: hand `sensors` to the flight stack's tasks, keep `world` to look at
/// the truth, and let [`Tasks`](crate::time::Tasks) move `clock`.
///
/// ```
/// use stampfly_drivers::{Imu, MotorOutputs};
/// use stampfly_sim::{Simulation, SimulationConfig, time::block_on};
/// use stampfly_types::messages::MotorOutput;
///
/// let mut simulation = Simulation::new(&SimulationConfig::example());
/// let clock = simulation.clock.clone();
/// block_on(&clock, async {
///     for _ in 0..400 {
///         let sample = simulation.sensors.imu.next().await?;
///         assert!((sample.data.accel.z + 9.81).abs() < 1.0, "standing");
///         let output = MotorOutput { duty: [0.1; 8], count: 4, armed: true, ..Default::default() };
///         simulation.sensors.motors.write(&output)?;
///     }
///     Ok::<(), core::convert::Infallible>(())
/// })?;
/// let truth = simulation.truth();
/// assert!(truth.contact && truth.rotor_speed[0] > 100.0);
/// # Ok::<(), core::convert::Infallible>(())
/// ```
#[derive(Debug)]
pub struct Simulation {
    /// Virtual time.
    pub clock: Clock,
    /// The vehicle in its surroundings.
    pub world: World,
    /// The chips.
    pub sensors: Sensors,
}

impl Simulation {
    /// A vehicle at the start.
    #[must_use]
    pub fn new(config: &SimulationConfig) -> Self {
        let clock = Clock::new(config.start);
        let plant = Plant::new(&config.plant, &config.wind, config.pose.as_ref(), config.seed);
        let world = World::new(plant, config.start);
        let sensors = Sensors::new(&world, &clock, config.seed, config.vibration);
        Self { clock, world, sensors }
    }

    /// What is really the case now.
    #[must_use]
    pub fn truth(&self) -> Truth {
        self.world.truth_at(self.clock.now())
    }
}
