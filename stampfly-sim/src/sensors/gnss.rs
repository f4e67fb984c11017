//! Satellite receiver like a u-blox M8: a few fixes per second, delayed, with a position error that
//! wanders by a metre or two.
//!
//! Position errors are the sum of a first-order Gauss-Markov process (satellites, ionosphere,
//! multipath: common to all fixes of some minutes) and white noise; velocity errors are white. The
//! receiver's filter and steps when the set of satellites changes are not modelled. For jamming
//! change the samples with a [`Line`](crate::fault::Line). Not for RTK.

use super::schedule::Schedule;
use crate::noise::{Noise, Stream};
use crate::time::Clock;
use crate::world::World;
use core::convert::Infallible;
use nalgebra::Vector3;
use stampfly_drivers::{Gnss, Sample};
use stampfly_types::messages::{GnssData, GnssFix};
use stampfly_types::{Duration, Instant, Origin};

/// Age above which no fix is begun: the world keeps only the recent past.
const TOO_OLD: Duration = Duration::from_millis(70);
/// Bound of the delay's variation, s: messages wait for each other on the receiver's port.
const JITTER: f64 = 0.005;
/// Time from the first two-dimensional to the first three-dimensional fix.
const FLAT: Duration = Duration::from_secs(1);

/// Configuration of a satellite receiver, and the geographic position of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GnssConfig {
    /// Geographic position of the world's origin.
    pub origin: Origin,
    /// Fixes per second.
    pub rate: f64,
    /// Delay from the instant of a fix to its message, s. At most 50 ms more than a period.
    pub delay: f64,
    /// Time from the start to the first three-dimensional fix, s.
    pub first_fix: f64,
    /// Satellites in use.
    pub satellites: u8,
    /// Standard deviation of the wandering error: horizontal per axis, and vertical, m.
    pub wander: [f64; 2],
    /// Correlation time of the wandering error, s.
    pub correlation: f64,
    /// Standard deviation of the white error: horizontal per axis, and vertical, m.
    pub noise: [f64; 2],
    /// Standard deviation of the velocity per axis, m/s.
    pub speed_noise: f64,
}

impl GnssConfig {
    /// A u-blox M8 under an open sky, at 5 Hz, with a warm start.
    ///
    /// The delay lies between PX4's default of 110 ms (`EKF2_GPS_DELAY`) and the 120 ms that
    /// ArduPilot assumes for an M8, rounded up. The data sheet (UBX-15031086) specifies 2.5 m CEP,
    /// 0.05 m/s for half of all velocities, and a first fix after 1 s hot and 26 s cold. The
    /// division of the position error into wander and noise, and a total somewhat better than
    /// specified, are assumptions.
    #[must_use]
    pub const fn m8(origin: Origin) -> Self {
        Self {
            origin,
            rate: 5.0,
            delay: 0.12,
            first_fix: 5.0,
            satellites: 14,
            wander: [1.2, 2.0],
            correlation: 120.0,
            noise: [0.15, 0.3],
            speed_noise: 0.06,
        }
    }
}

/// Model of a satellite receiver. Implements [`Gnss`].
///
/// `Sample::at` is the instant of the fix; the sample is delivered after the delay. A caller that
/// asks late misses fixes.
///
/// ```
/// use stampfly_drivers::Gnss;
/// use stampfly_sim::plant::AeroplaneParameters;
/// use stampfly_sim::sensors::{GnssConfig, GnssModel};
/// use stampfly_sim::{Simulation, SimulationConfig, time::block_on};
/// use stampfly_types::{Origin, messages::GnssFix};
///
/// let Simulation { clock, world, .. } = Simulation::new(&SimulationConfig::new(AeroplaneParameters::EXAMPLE));
/// let origin = Origin { latitude: 365_440_000, longitude: 1_367_050_000, altitude: 30_000 };
/// let mut gnss = GnssModel::new(&world, &clock, 1, &GnssConfig::m8(origin));
/// block_on(&clock, async {
///     let mut fix = gnss.next().await?;
///     while fix.data.fix != GnssFix::ThreeDimensional {
///         fix = gnss.next().await?;
///     }
///     assert!(fix.age(clock.now()).as_micros() > 100_000);
///     assert!(origin.local(fix.data.latitude, fix.data.longitude).iter().all(|metres| metres.abs() < 6.0));
///     Ok::<(), core::convert::Infallible>(())
/// })?;
/// # Ok::<(), core::convert::Infallible>(())
/// ```
#[derive(Debug)]
pub struct GnssModel {
    world: World,
    clock: Clock,
    config: GnssConfig,
    schedule: Schedule,
    noise: Noise,
    /// Instant of power-on.
    start: Instant,
    /// Wandering error, world NED, m.
    wander: Vector3<f64>,
}

impl GnssModel {
    /// A receiver that is powered on now. `seed` draws its errors.
    #[must_use]
    pub fn new(world: &World, clock: &Clock, seed: u64, config: &GnssConfig) -> Self {
        let mut noise = Noise::stream(seed, Stream::Gnss);
        // No tolerance of the rate: the receiver's clock follows the satellites.
        let schedule = Schedule::new(clock.now(), config.rate, 0.0, &mut noise);
        let wander = deviations(config.wander).component_mul(&noise.normal3());
        Self {
            world: world.clone(),
            clock: clock.clone(),
            config: *config,
            schedule,
            noise,
            start: clock.now(),
            wander,
        }
    }

    /// The present wandering error of the position, world NED, m.
    #[must_use]
    pub fn wander(&self) -> Vector3<f64> {
        self.wander
    }

    fn fix(&mut self, at: Instant) -> GnssData {
        let config = self.config;
        let motion = self.world.motion_at(at);
        // Exact discretisation of the first-order process over one period.
        let keep = libm::exp(-1.0 / (config.rate * config.correlation.max(1e-3)));
        let drive = (1.0 - keep * keep).sqrt();
        // All draws are made for every fix, so that the sequence is independent of the fix type.
        let [fresh, own, speed] = [(); 3].map(|()| self.noise.normal3());
        self.wander = self.wander * keep + deviations(config.wander).component_mul(&fresh) * drive;

        let on_for = at.since(self.start).seconds_f64();
        let share = (on_for / config.first_fix.max(1e-3)).clamp(0.0, 1.0);
        let satellites = (f64::from(config.satellites) * share) as u8;
        let fix = match on_for - config.first_fix {
            left if left >= 0.0 => GnssFix::ThreeDimensional,
            left if left >= -FLAT.seconds_f64() => GnssFix::TwoDimensional,
            _ => return GnssData { satellites, ..GnssData::default() },
        };
        let place = motion.position + self.wander + deviations(config.noise).component_mul(&own);
        let velocity = motion.velocity + speed * config.speed_noise;
        let (latitude, longitude) = config.origin.global([place.x as f32, place.y as f32]);
        let accuracy = |axis: usize| libm::hypot(config.wander[axis], config.noise[axis]);
        // The receiver's messages have a resolution of 1 mm and 1 mm/s.
        let millimetres = |metres: f64| ((metres * 1000.0).round() / 1000.0) as f32;
        GnssData {
            fix,
            satellites,
            latitude,
            longitude,
            altitude: millimetres(f64::from(config.origin.altitude) * 1e-3 - place.z),
            velocity: velocity.map(|speed| f64::from(millimetres(speed))).cast::<f32>().into(),
            horizontal_accuracy: millimetres(accuracy(0)),
            vertical_accuracy: millimetres(accuracy(1)),
            speed_accuracy: millimetres(config.speed_noise),
        }
    }
}

fn deviations([horizontal, vertical]: [f64; 2]) -> Vector3<f64> {
    Vector3::new(horizontal, horizontal, vertical)
}

impl Gnss for GnssModel {
    type Error = Infallible;

    async fn next(&mut self) -> Result<Sample<GnssData>, Infallible> {
        let number = self.schedule.upcoming(self.clock.now(), TOO_OLD.as_micros() as f64 - self.schedule.period());
        let at = self.schedule.instant(number);
        self.clock.sleep_until(at).await;
        let data = self.fix(at);
        let delay = self.config.delay + self.noise.within(JITTER);
        self.clock.sleep_until(at + Duration::from_micros((delay.max(0.0) * 1e6) as u64)).await;
        self.schedule.reported(number);
        Ok(Sample { at, data })
    }
}
