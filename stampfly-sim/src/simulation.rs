//! Builds a simulated vehicle from one configuration and one seed.

use crate::conditions::Conditions;
use crate::plant::{Airframe, Body, CannotSimulate, PlantParameters, Pose, WindConfig};
use crate::sensors::Sensors;
use crate::time::Clock;
use crate::world::{Truth, World};
use stampfly_param::{ParameterError, ParameterInfo, Parameters};
use stampfly_types::Instant;

/// Configuration of a simulation. The same configuration gives the same bits on every machine.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulationConfig<A = PlantParameters> {
    /// Seed of all random values: specimens, noise, gusts.
    pub seed: u64,
    /// Time shown by the clock at the start.
    pub start: Instant,
    /// The airframe.
    pub plant: A,
    /// Mean wind and gusts.
    pub wind: WindConfig,
    /// Battery age, floor, light, spread between specimens.
    pub conditions: Conditions,
    /// Amplitude of propeller vibration relative to the recorded flights; 0 disables it.
    pub vibration: f64,
    /// Amplitude of temperature drift and soft iron, which the recorded flights do not show: 1 is
    /// the data sheets' limit, 0 disables both.
    pub imperfections: f64,
    /// Initial position and motion; `None` places the vehicle on the floor at the origin, facing
    /// north.
    pub pose: Option<Pose>,
}

impl<A: Airframe> SimulationConfig<A> {
    /// This airframe with seed 1, standing on the floor, in the default indoor air, without
    /// imperfections.
    #[must_use]
    pub fn new(plant: A) -> Self {
        Self {
            seed: 1,
            start: Instant::ZERO,
            plant,
            wind: WindConfig::default(),
            conditions: Conditions::GENTLE,
            vibration: 1.0,
            imperfections: 0.0,
            pose: None,
        }
    }

    /// The same configuration in the [harsh](Conditions::harsh) world of its seed. Batteries are
    /// redrawn until full throttle lifts 1.2 times the vehicle's weight.
    #[must_use]
    pub fn in_harsh_world(self) -> Self {
        let conditions =
            Conditions::harsh(self.seed, |conditions| self.plant.under(conditions, self.seed).lift() >= SPARE_LIFT);
        Self { conditions, ..self }
    }

    /// Checks that the parameters together describe a vehicle that can be simulated.
    ///
    /// # Errors
    /// [`CannotSimulate`] with the reason.
    pub fn check(&self) -> Result<(), CannotSimulate> {
        Airframe::check(&self.plant.under(&self.conditions, self.seed))
    }
}

/// The numbers of the vehicle, then those of the conditions.
impl<A: Airframe> Parameters<f64> for SimulationConfig<A> {
    fn describe(&self, index: usize) -> Option<ParameterInfo<'_, f64>> {
        match index.checked_sub(A::TABLE.len()) {
            None => self.plant.describe(index),
            Some(behind) => self.conditions.describe(behind),
        }
    }

    fn get(&self, index: usize) -> Option<f64> {
        match index.checked_sub(A::TABLE.len()) {
            None => self.plant.get(index),
            Some(behind) => self.conditions.get(behind),
        }
    }

    fn set(&mut self, index: usize, value: f64) -> Result<(), ParameterError<f64>> {
        match index.checked_sub(A::TABLE.len()) {
            None => self.plant.set(index, value),
            Some(behind) => self.conditions.set(behind, value),
        }
    }
}

/// Least lift at full throttle, in weights, with which a vehicle is flown: holding height at 30° of
/// tilt needs 1.15, the rest covers the discharge during a flight.
const SPARE_LIFT: f64 = 1.2;

impl SimulationConfig {
    /// [`PlantParameters::EXAMPLE`], a fictitious quadrotor for examples and tests.
    #[must_use]
    pub fn example() -> Self {
        Self::new(PlantParameters::EXAMPLE)
    }
}

/// One simulated vehicle.
///
/// The parts are public, independent handles: give `sensors` to the tasks of the flight stack, keep
/// `world` to read the true state, and let [`Tasks`](crate::time::Tasks) advance `clock`.
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
    /// Virtual time, shared by all parts.
    pub clock: Clock,
    /// The vehicle in its surroundings.
    pub world: World,
    /// Sensors and motors.
    pub sensors: Sensors,
}

impl Simulation {
    /// A vehicle at the configured start.
    #[must_use]
    pub fn new<A: Airframe>(config: &SimulationConfig<A>) -> Self {
        let clock = Clock::new(config.start);
        let body = config.plant.body_under(&config.conditions, &config.wind, config.pose.as_ref(), config.seed);
        // The body takes the conditions that act on it above; the world keeps those that act on
        // sensors.
        let world = World::new(body, config.start)
            .with_imperfections(config.imperfections)
            .with_conditions(config.conditions.clone());
        let sensors = Sensors::new(&world, &clock, config.seed, config.vibration);
        Self { clock, world, sensors }
    }

    /// Puts a custom body on a clock that starts at zero, with all sensors and without recorded
    /// vibration. `seed` feeds the sensors' random values. The body defines its own initial pose
    /// and its own vibration.
    ///
    /// ```
    /// use stampfly_sim::plant::{Body, Motion};
    /// use stampfly_sim::{Simulation, drivers::Imu, time::block_on};
    ///
    /// #[derive(Debug, Default)]
    /// struct Stone(Motion);
    ///
    /// impl Body for Stone {
    ///     fn step(&mut self) {}
    ///     fn motion(&self) -> &Motion {
    ///         &self.0
    ///     }
    /// }
    ///
    /// let Simulation { clock, mut sensors, .. } = Simulation::of(Stone::default(), 1);
    /// let Ok(sample) = block_on(&clock, sensors.imu.next());
    /// assert!((sample.data.accel.z + 9.81).abs() < 0.5);
    /// ```
    #[must_use]
    pub fn of(body: impl Body, seed: u64) -> Self {
        let clock = Clock::new(Instant::ZERO);
        let world = World::new(body, Instant::ZERO);
        let sensors = Sensors::new(&world, &clock, seed, 0.0);
        Self { clock, world, sensors }
    }

    /// The true state at the clock's present time.
    #[must_use]
    pub fn truth(&self) -> Truth {
        self.world.truth_at(self.clock.now())
    }
}
