//! Pitot tube with a differential pressure sensor like Sensirion's SDP33.
//!
//! Measures the dynamic pressure of the air along the body's x axis, `½·ρ·v·|v|`. Residual zero
//! offset, scale and noise are drawn from the seed. For a blocked, iced or disconnected tube change
//! the samples with a [`Line`](crate::fault::Line). Not valid at flow angles beyond about 20°; the
//! lag of long hoses is not modelled.

use super::schedule::Schedule;
use crate::noise::{Noise, Stream};
use crate::time::Clock;
use crate::world::World;
use core::convert::Infallible;
use stampfly_drivers::{Airspeed, Sample};
use stampfly_types::messages::AirspeedData;
use stampfly_types::{Duration, Instant};

/// Averages reported per second, 1/s.
const RATE: f64 = 50.0;
const READ_OUT: Duration = Duration::from_micros(500);
/// Residual zero offset, standard deviation, Pa: accuracy at zero of the data sheet (0.2 Pa) plus
/// wind during zeroing.
const OFFSET: f64 = 0.5;
/// Bound of the scale error: 3 % of the reading (data sheet, span accuracy).
const SCALE: f64 = 0.03;
/// Standard deviation of an average over 20 ms, Pa. The sensor's noise is smaller; turbulence at
/// the tube is an assumption.
const DEVIATION: f64 = 0.3;
/// Resolution, Pa: 20 counts per pascal (data sheet).
const RESOLUTION: f64 = 0.05;
/// Range, Pa.
const RANGE: f64 = 1500.0;
/// Temperature of the air in the fuselage without heating of the vehicle, °C.
const TEMPERATURE: f64 = 20.0;

/// Model of a pitot tube. Implements [`Airspeed`].
///
/// ```
/// use stampfly_drivers::Airspeed;
/// use stampfly_sim::plant::{Aeroplane, AeroplaneParameters, WindConfig};
/// use stampfly_sim::sensors::AirspeedModel;
/// use stampfly_sim::{Simulation, SimulationConfig, time::block_on};
///
/// let parameters = AeroplaneParameters::EXAMPLE;
/// let pose = Aeroplane::trim(&parameters, 12.0, 0.0)?.pose(50.0, 0.0);
/// let config = SimulationConfig { pose: Some(pose), wind: WindConfig::CALM, ..SimulationConfig::new(parameters) };
/// let Simulation { clock, world, .. } = Simulation::new(&config);
/// let mut tube = AirspeedModel::new(&world, &clock, 1);
/// let Ok(sample) = block_on(&clock, tube.next());
/// let airspeed = (2.0 * sample.data.pressure / 1.225).sqrt();
/// assert!((airspeed - 12.0).abs() < 0.6);
/// # Ok::<(), stampfly_sim::plant::TrimError>(())
/// ```
#[derive(Debug)]
pub struct AirspeedModel {
    world: World,
    clock: Clock,
    schedule: Schedule,
    noise: Noise,
    offset: f64,
    scale: f64,
}

impl AirspeedModel {
    /// A zeroed tube. `seed` draws its errors and noise.
    #[must_use]
    pub fn new(world: &World, clock: &Clock, seed: u64) -> Self {
        let mut noise = Noise::stream(seed, Stream::Airspeed);
        Self {
            schedule: Schedule::new(clock.now(), RATE, 0.02, &mut noise),
            offset: OFFSET * noise.normal(),
            scale: 1.0 + noise.within(SCALE),
            noise,
            world: world.clone(),
            clock: clock.clone(),
        }
    }

    /// Residual zero offset, Pa, and factor on the pressure.
    #[must_use]
    pub fn errors(&self) -> (f64, f64) {
        (self.offset, self.scale)
    }

    fn measure(&mut self, at: Instant) -> AirspeedData {
        let motion = self.world.motion_at(at);
        let (air, density) = self.world.inspect(|body| (body.air(-motion.position.z), body.air_density()));
        let ahead = motion.attitude.inverse_transform_vector(&(motion.velocity - air)).x;
        // Signed: a tube reads suction when the air comes from behind.
        let dynamic = 0.5 * density * ahead * ahead.abs();
        let pressure = self.scale * dynamic + self.offset + DEVIATION * self.noise.normal();
        let temperature = TEMPERATURE + self.world.warmth_at(at) + 0.05 * self.noise.normal();
        AirspeedData {
            pressure: ((pressure / RESOLUTION).round() * RESOLUTION).clamp(-RANGE, RANGE) as f32,
            temperature: ((temperature * 200.0).round() / 200.0) as f32,
        }
    }
}

impl Airspeed for AirspeedModel {
    type Error = Infallible;

    async fn next(&mut self) -> Result<Sample<AirspeedData>, Infallible> {
        let number = self.schedule.upcoming(self.clock.now(), READ_OUT.as_micros() as f64);
        let at = self.schedule.instant(number);
        self.clock.sleep_until(at + READ_OUT).await;
        self.schedule.reported(number);
        let data = self.measure(at);
        Ok(Sample { at, data })
    }
}
