//! Inertial sensor BMI270 as the StampFly uses it: ±8 g, ±2000 °/s, 1600 Hz into a FIFO read in
//! groups of four and decimated to 400 Hz.

use super::mounting::Mounting;
use super::schedule::Schedule;
use crate::noise::{Noise, Stream};
use crate::normals::Normals;
use crate::time::Clock;
use crate::vibration::Vibration;
use crate::world::World;
use core::convert::Infallible;
use nalgebra::{Matrix3, Vector3};
use stampfly_drivers::{Decimator, Peak, Sample};
use stampfly_types::messages::ImuData;
use stampfly_types::{Duration, GRAVITY, Instant, Vec3};

/// Counts per m/s² at ±8 g.
const ACCEL_SCALE: f64 = 4096.0 / GRAVITY as f64;
/// Counts per rad/s at ±2000 °/s.
const GYRO_SCALE: f64 = 16.4 * 180.0 / core::f64::consts::PI;
const RATE: f64 = 1600.0;
/// Samples in one FIFO read.
const GROUP: usize = 4;
/// Delay of interrupt and burst read after the last sample of a group.
const LATENCY: Duration = Duration::from_micros(120);
/// Delay of the reader above which samples are lost (the world keeps 80 ms).
const MEMORY: Duration = Duration::from_micros(60_000);

/// Noise densities per axis (x, y, z) from a static record: accelerometer, m/s²/√Hz, gyroscope,
/// rad/s/√Hz. Noise per sample is the density times the square root of half the rate.
const ACCEL_DENSITY: [f64; 3] = [0.00113, 0.00122, 0.00141];
const GYRO_DENSITY: [f64; 3] = [0.000146, 0.000145, 0.000148];
/// Turn-on offset of the accelerometer, standard deviation per axis, m/s².
const ACCEL_BIAS: f64 = 0.12;
/// Turn-on offset of the gyroscope, bound per axis: 1 °/s.
const GYRO_BIAS: f64 = 0.017_453;
/// Random walk of the offsets, per √s.
const ACCEL_WALK: f64 = 3e-4;
const GYRO_WALK: f64 = 2e-5;
/// Temperature coefficients of the offsets, bounds per axis: 0.25 mg/K and 0.015 °/s/K (data sheet
/// of the BMI270, tables 2 and 3).
const ACCEL_DRIFT: f64 = 2.45e-3;
const GYRO_DRIFT: f64 = 2.6e-4;
/// Temperature without drift, °C.
const REFERENCE: f64 = 25.0;

/// Inertial input and its conversion, shared by the model and the register-level emulator.
#[derive(Debug)]
pub(crate) struct ImuPhysics {
    world: World,
    noise: Normals,
    vibration: Vibration,
    /// Number of samples made.
    samples: u64,
    start: Instant,
    accel_bias: Vector3<f64>,
    gyro_bias: Vector3<f64>,
    /// Misalignment and scale.
    accel_matrix: Matrix3<f64>,
    gyro_matrix: Matrix3<f64>,
    /// Mounting error, if the conditions have one.
    mounting: Option<Mounting>,
    /// Temperature coefficients of accelerometer and gyro, 1/K, if imperfections are enabled.
    drift: Option<(Vector3<f64>, Vector3<f64>)>,
}

impl ImuPhysics {
    /// The physics, and the schedule of its samples, which always have 1600 Hz.
    pub(crate) fn new(world: &World, start: Instant, seed: u64, vibration: f64) -> (Self, Schedule) {
        let mut noise = Noise::stream(seed, Stream::Imu);
        let schedule = Schedule::new(start, RATE, 0.02, &mut noise);
        // Half a degree between the axes, and 0.5 % of scale.
        let mut matrix = || Matrix3::identity() + Matrix3::from_fn(|_, _| noise.within(0.005));
        let (mut accel_matrix, mut gyro_matrix) = (matrix(), matrix());
        let mounting = Mounting::of(world, seed);
        if let Some(mounting) = &mounting {
            (accel_matrix, gyro_matrix) = (accel_matrix * mounting.accel, gyro_matrix * mounting.gyro);
        }
        let hover_speed = world.inspect(|body| body.nominal_rotor_speed());
        let strength = world.imperfections();
        let drift = (strength > 0.0).then(|| {
            let mut noise = Noise::stream(seed, Stream::Drift);
            let mut within = |bound: f64| Vector3::from_fn(|_, _| noise.within(bound * strength));
            (within(ACCEL_DRIFT), within(GYRO_DRIFT))
        });
        let physics = Self {
            drift,
            mounting,
            vibration: Vibration::new(
                vibration,
                schedule.period() * 1e-6,
                hover_speed,
                Noise::stream(seed, Stream::Vibration),
            ),
            samples: 0,
            start,
            accel_bias: noise.normal3() * ACCEL_BIAS,
            gyro_bias: Vector3::from_fn(|_, _| noise.within(GYRO_BIAS)),
            accel_matrix,
            gyro_matrix,
            noise: noise.into(),
            world: world.clone(),
        };
        world.note_specimen(|specimen| {
            specimen.accel_matrix = physics.accel_matrix;
            specimen.lever = mounting.map_or_else(Vector3::zeros, |mounting| mounting.lever);
            (specimen.accel_bias, specimen.gyro_bias) = (physics.accel_bias, physics.gyro_bias);
            (specimen.accel_drift, specimen.gyro_drift) = drift.unwrap_or_default();
        });
        (physics, schedule)
    }

    /// The next sample, taken at `at`: accelerometer x, y, z, m/s², gyroscope x, y, z, rad/s, body.
    pub(crate) fn sample(&mut self, at: Instant) -> [f64; 6] {
        let motion = self.world.inertial_at(at);
        let shake = self.vibration.step(&motion.rotor_speed);
        // Lever arm first, then misalignment and scale, offset, and temperature drift.
        let force = self.mounting.map_or(motion.specific_force, |mounting| mounting.felt(&motion));
        let mut accel = self.accel_matrix * force + self.accel_bias;
        let mut gyro = self.gyro_matrix * motion.rate + self.gyro_bias;
        if let Some((of_accel, of_gyro)) = &self.drift {
            let warmer = f64::from(self.temperature(at)) - REFERENCE;
            accel += of_accel * warmer;
            gyro += of_gyro * warmer;
        }
        // White noise of density n, sampled at the rate r, has the standard deviation n·√(r/2).
        let per_sample = (RATE / 2.0).sqrt();
        let noise: [f64; 6] = self.noise.next();
        let sample = core::array::from_fn(|channel| {
            let (value, density) = if channel < 3 {
                (accel[channel], ACCEL_DENSITY[channel])
            } else {
                (gyro[channel - 3], GYRO_DENSITY[channel - 3])
            };
            value + shake[channel] + density * per_sample * noise[channel]
        });
        self.samples += 1;
        // The slow random walk is advanced once per group.
        if self.samples.is_multiple_of(GROUP as u64) {
            let wander = (GROUP as f64 / RATE).sqrt();
            self.accel_bias += Vector3::from(self.noise.next()) * (ACCEL_WALK * wander);
            self.gyro_bias += Vector3::from(self.noise.next()) * (GYRO_WALK * wander);
        }
        sample
    }

    /// Die temperature, °C: it warms by 10 K within a few minutes, plus [`World::warm`].
    pub(crate) fn temperature(&self, at: Instant) -> f32 {
        let minutes = at.since(self.start).seconds() / 60.0;
        25.0 + 10.0 * minutes / (minutes + 2.0) + self.world.warmth_at(at) as f32
    }
}

/// Converts a value to counts, rounded and saturated as in the chip.
pub(crate) fn to_counts(value: f64, counts_per_unit: f64) -> i16 {
    let counts = value * counts_per_unit;
    (counts + 0.5f64.copysign(counts)) as i16
}

/// Model of the inertial sensor. Implements [`Imu`](stampfly_drivers::Imu) at 400 Hz.
///
/// `Sample::at` is the centre of the decimation filter, three chip samples (1.9 ms) before the
/// newest one; including read-out a sample is 2 ms old when it is delivered.
#[derive(Debug)]
pub struct ImuModel {
    clock: Clock,
    physics: ImuPhysics,
    schedule: Schedule,
    decimator: Decimator,
    peak: Peak,
    /// Number of the first chip sample of the next group.
    cursor: u64,
}

impl ImuModel {
    pub(crate) fn new(world: &World, clock: &Clock, seed: u64, vibration: f64) -> Self {
        let (physics, schedule) = ImuPhysics::new(world, clock.now(), seed, vibration);
        Self {
            physics,
            schedule,
            decimator: Decimator::default(),
            peak: Peak::default(),
            cursor: 0,
            clock: clock.clone(),
        }
    }

    /// The present offsets, which an estimator has to find: accelerometer, m/s², and gyroscope,
    /// rad/s, without the rectification of vibration.
    #[must_use]
    pub fn bias(&self) -> (Vec3, Vec3) {
        (self.physics.accel_bias.cast::<f32>().into(), self.physics.gyro_bias.cast::<f32>().into())
    }

    /// Chip sample `number` in counts: accelerometer x, y, z, gyroscope x, y, z.
    fn convert(&mut self, number: u64) -> [i16; 6] {
        let sample = self.physics.sample(self.schedule.instant(number));
        core::array::from_fn(|channel| to_counts(sample[channel], if channel < 3 { ACCEL_SCALE } else { GYRO_SCALE }))
    }

    /// The next group of four samples from the FIFO in counts, with the instant of its first
    /// sample.
    ///
    /// For comparison with recordings that were filtered differently; flight code uses
    /// [`Imu::next`](stampfly_drivers::Imu::next).
    pub async fn next_group(&mut self) -> (Instant, [[i16; 6]; GROUP]) {
        let now = self.clock.now();
        if now.since(self.schedule.instant(self.cursor)) > MEMORY {
            // Overrun: the oldest samples are lost, and the filter's history with them.
            let first = self.schedule.upcoming(now, MEMORY.as_micros() as f64 * 0.5);
            self.cursor = first;
            (self.decimator, self.peak) = Default::default();
        }
        let last = self.cursor + GROUP as u64 - 1;
        self.clock.sleep_until(self.schedule.instant(last) + LATENCY).await;
        let first = self.cursor;
        self.cursor += GROUP as u64;
        let group = core::array::from_fn(|i| self.convert(first + i as u64));
        (self.schedule.instant(first), group)
    }
}

/// Converts counts, which may be fractional, to SI units: accelerometer, m/s², gyroscope, rad/s.
#[must_use]
pub fn counts_to_si(counts: [f64; 6]) -> (Vec3, Vec3) {
    let [ax, ay, az, gx, gy, gz] = counts;
    (
        (Vector3::new(ax, ay, az) / ACCEL_SCALE).cast::<f32>().into(),
        (Vector3::new(gx, gy, gz) / GYRO_SCALE).cast::<f32>().into(),
    )
}

impl stampfly_drivers::Imu for ImuModel {
    type Error = Infallible;

    async fn next(&mut self) -> Result<Sample<ImuData>, Infallible> {
        loop {
            let (at, group) = self.next_group().await;
            let accel_peak = self.peak.push(&group) / ACCEL_SCALE as f32;
            let Some(sum) = self.decimator.push(&group) else { continue };
            let (accel, gyro) = counts_to_si(sum.map(|sum| f64::from(sum) / f64::from(Decimator::GAIN)));
            let temperature = self.physics.temperature(at);
            return Ok(Sample { at, data: ImuData { accel, accel_peak, gyro, temperature } });
        }
    }
}
