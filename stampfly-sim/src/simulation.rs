//! A vehicle ready to fly: the world, the clock and the chips, made from one configuration and one seed.

use crate::conditions::Conditions;
use crate::plant::{Airframe, Body, CannotSimulate, PlantParameters, Pose, WindConfig};
use crate::sensors::Sensors;
use crate::time::Clock;
use crate::world::{Truth, World};
use stampfly_param::{ParameterError, ParameterInfo, Parameters};
use stampfly_types::Instant;

/// All that decides a simulation. The same configuration gives the same bits on every machine.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulationConfig<A = PlantParameters> {
    /// Seed of everything random: specimens, noise, gusts.
    pub seed: u64,
    /// What the clock shows at the start.
    pub start: Instant,
    /// The vehicle and its surroundings.
    pub plant: A,
    /// The air.
    pub wind: WindConfig,
    /// What else it meets, beside the air: its battery's age, the light, how far specimens lie apart.
    pub conditions: Conditions,
    /// Strength of propeller vibration; 1 is what was recorded, 0 is none.
    pub vibration: f64,
    /// Strength of what the sensors of the recorded flights do not show: drift with temperature, and soft iron. 1 is what data sheets
    /// allow, 0 is none.
    pub imperfections: f64,
    /// Where it starts; `None` stands it on the floor at the origin, facing north.
    pub pose: Option<Pose>,
}

impl<A: Airframe> SimulationConfig<A> {
    /// This vehicle with seed 1, standing on the floor of a room with people in it.
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

    /// The same in the [harsh](Conditions::harsh) world of its seed, with a battery that carries a fifth more than the vehicle weighs: one that
    /// carries less people put aside.
    #[must_use]
    pub fn in_harsh_world(self) -> Self {
        let conditions =
            Conditions::harsh(self.seed, |conditions| self.plant.under(conditions, self.seed).lift() >= SPARE_LIFT);
        Self { conditions, ..self }
    }

    /// Are these numbers together a vehicle that can be simulated?
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

/// What a battery has to lift that somebody flies with, in weights, at full throttle: 30° of lean need 1.15 to hold the height, and the rest is
/// what a flight drains.
const SPARE_LIFT: f64 = 1.2;

impl SimulationConfig {
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
    pub fn new<A: Airframe>(config: &SimulationConfig<A>) -> Self {
        let clock = Clock::new(config.start);
        let body = config.plant.body_under(&config.conditions, &config.wind, config.pose.as_ref(), config.seed);
        let world = World::new(body, config.start)
            .with_imperfections(config.imperfections)
            .with_conditions(config.conditions.clone());
        let sensors = Sensors::new(&world, &clock, config.seed, config.vibration);
        Self { clock, world, sensors }
    }

    /// A body of one's own at the start, with all the chips, on a clock that shows zero. `seed` is of everything random in the chips. The
    /// body says by itself where it stands and what shakes it.
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

    /// What is really the case now.
    #[must_use]
    pub fn truth(&self) -> Truth {
        self.world.truth_at(self.clock.now())
    }
}
