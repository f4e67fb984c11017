//! Range finders VL53L3CX: one measurement every 33 ms along a fixed axis.

use super::light::{Echo, Echoes, Light, MAXIMUM};
use super::schedule::Schedule;
use crate::noise::{Noise, Stream};
use crate::plant::Motion;
use crate::time::Clock;
use crate::world::World;
use core::convert::Infallible;
use nalgebra::Vector3;
use stampfly_drivers::{RangeFinder, Sample};
use stampfly_types::messages::TofData;
use stampfly_types::{Duration, Instant};

pub(crate) const RATE: f64 = 30.0;
/// Time to read 134 bytes at 400 kHz.
const READ_OUT: Duration = Duration::from_micros(3_200);
/// Shortest range distinguishable from the cover glass, m.
const MINIMUM: f64 = 0.020;
/// Share of measurements lost without an external cause.
const DROPOUTS: f64 = 0.003;

/// `TofData::status`: valid.
pub const STATUS_VALID: u8 = 0;
/// `TofData::status`: standard deviation too large.
pub const STATUS_SIGMA: u8 = 1;
/// `TofData::status`: signal too weak.
pub const STATUS_SIGNAL: u8 = 2;
/// `TofData::status`: phase outside the valid range.
pub const STATUS_OUT_OF_BOUNDS: u8 = 4;

/// Direction of a range finder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mount {
    /// Down, along +z of the body.
    Bottom,
    /// Forward, along +x of the body. The world has no visible walls: it sees only the floor, when
    /// the nose is down.
    Front,
}

/// Target and measurement, shared by the model and the register-level emulator.
#[derive(Debug)]
pub(crate) struct RangePhysics {
    world: World,
    noise: Noise,
    light: Light,
    /// Scale factor and offset, m, of this specimen.
    scale: f64,
    offset: f64,
}

impl RangePhysics {
    /// The physics, and the schedule of its measurements.
    pub(crate) fn new(world: &World, start: Instant, seed: u64, mount: Mount) -> (Self, Schedule) {
        let (stream, specimen, axis) = match mount {
            Mount::Bottom => (Stream::BottomTof, Stream::BottomTofSpecimen, Vector3::z()),
            Mount::Front => (Stream::FrontTof, Stream::FrontTofSpecimen, Vector3::x()),
        };
        let conditions = world.conditions();
        let mut noise = Noise::stream(seed, stream);
        let schedule = Schedule::new(start, RATE, 0.02, &mut noise);
        let physics = Self {
            offset: noise.within(conditions.range_offset),
            scale: 1.0 + Noise::stream(seed, specimen).within(conditions.range_scale),
            light: Light::new(&conditions, axis),
            noise,
            world: world.clone(),
        };
        (physics, schedule)
    }

    /// Distance to the floor along a direction, body; `None` if the beam misses it.
    fn distance(&self, motion: &Motion, direction: &Vector3<f64>) -> Option<f64> {
        let beam = motion.attitude * direction;
        (beam.z > 1e-3).then(|| self.world.inspect(|plant| plant.scene().distance(&motion.position, &beam)))
    }

    fn true_distance(&self, instant: Instant) -> Option<f64> {
        self.distance(&self.world.motion_at(instant), &self.light.axis())
    }

    fn echoes(&self, instant: Instant) -> Echoes {
        let motion = self.world.motion_at(instant);
        self.light.echoes(|direction| self.distance(&motion, direction))
    }

    /// Echoes at the distances that this specimen measures.
    pub(crate) fn optical_echoes(&self, instant: Instant) -> Echoes {
        self.echoes(instant).map(|echo| Echo { distance: echo.distance * self.scale + self.offset, ..echo })
    }

    /// Echoes if an object covers the window at this distance, m.
    pub(crate) fn covered(&self, metres: f64) -> Echoes {
        self.light.echoes(|_| Some(metres))
    }

    /// Ambient light, 10⁶ photons/s over all detectors.
    pub(crate) fn ambient(&self) -> f64 {
        self.light.ambient
    }

    /// One measurement around `instant`.
    pub(crate) fn measure(&mut self, instant: Instant) -> TofData {
        let distance = self.light.reported(&self.echoes(instant));
        let ceiling = self.light.ceiling;
        // Always the same number of draws, so that the noise sequence does not depend on the course
        // of the flight.
        let (lost, normal) = (self.noise.chance(DROPOUTS), self.noise.normal());
        let invalid = |status| TofData { distance: 0.0, sigma: 0.0, status, valid: false };
        // Between the maximum range and 1.2 times it the chip still gives a distance, marked as too
        // weak.
        let Some(distance) = distance.filter(|d| *d <= ceiling * 1.2) else { return invalid(STATUS_SIGNAL) };
        // Distance with the same signal-to-noise ratio in a dark room over a bright floor.
        let dim = distance * (MAXIMUM / ceiling);
        let sigma = 0.0008 + 0.0008 * dim + 0.0004 * dim * dim;
        // The chip reports whole millimetres.
        let reading = ((distance * self.scale + self.offset + sigma * normal) * 1000.0).round().max(0.0) / 1000.0;
        let status = if lost {
            STATUS_SIGMA
        } else if distance < MINIMUM {
            STATUS_OUT_OF_BOUNDS
        } else if distance > ceiling {
            STATUS_SIGNAL
        } else {
            STATUS_VALID
        };
        TofData { distance: reading as f32, sigma: sigma as f32, status, valid: status == STATUS_VALID }
    }
}

/// Model of a range finder. Implements [`RangeFinder`].
///
/// `Sample::at` is the middle of the measurement; the sample is delivered one read-out after its
/// end.
///
/// ```
/// use stampfly_drivers::RangeFinder;
/// use stampfly_sim::sensors::{Mount, RangeModel};
/// use stampfly_sim::{Simulation, SimulationConfig, time::block_on};
///
/// let mut simulation = Simulation::new(&SimulationConfig::example());
/// let Ok(sample) = block_on(&simulation.clock, simulation.sensors.tof.next());
/// assert!(sample.data.valid && (sample.data.distance - 0.03).abs() < 0.01, "standing");
///
/// // A second, front range finder, for vehicles that have one.
/// let mut front = RangeModel::new(&simulation.world, &simulation.clock, 1, Mount::Front);
/// let Ok(sample) = block_on(&simulation.clock, front.next());
/// assert!(!sample.data.valid, "no wall in sight");
/// ```
#[derive(Debug)]
pub struct RangeModel {
    clock: Clock,
    schedule: Schedule,
    physics: RangePhysics,
}

impl RangeModel {
    /// A range finder with this direction. `seed` draws its specimen and noise.
    #[must_use]
    pub fn new(world: &World, clock: &Clock, seed: u64, mount: Mount) -> Self {
        let (physics, schedule) = RangePhysics::new(world, clock.now(), seed, mount);
        Self { physics, schedule, clock: clock.clone() }
    }

    /// True distance to the floor along the axis at `instant`, m; `None` if the axis misses the
    /// floor.
    #[must_use]
    pub fn true_distance(&self, instant: Instant) -> Option<f64> {
        self.physics.true_distance(instant)
    }
}

impl RangeFinder for RangeModel {
    type Error = Infallible;

    async fn next(&mut self) -> Result<Sample<TofData>, Infallible> {
        let period = self.schedule.period();
        let latency = period + READ_OUT.as_micros() as f64;
        let number = self.schedule.upcoming(self.clock.now(), latency);
        let begin = self.schedule.instant(number);
        self.clock.sleep_until(begin + Duration::from_micros(latency as u64)).await;
        self.schedule.reported(number);
        // The chip integrates over the whole period, so the distance belongs to its middle.
        let at = begin + Duration::from_micros((0.5 * period) as u64);
        Ok(Sample { at, data: self.physics.measure(at) })
    }
}
