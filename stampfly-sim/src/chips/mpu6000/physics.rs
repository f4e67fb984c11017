//! Physics of an MPU-6000 at 8 kHz, before and after its low-pass filter (MPU-6000 product
//! specification 3.4, "PS"; register map 4.2, "RM").

use crate::noise::Noise;
use crate::sensors::mounting::Mounting;
use crate::sensors::schedule::Schedule;
use crate::time::Clock;
use crate::vibration::Vibration;
use crate::world::World;
use nalgebra::Vector3;
use stampfly_types::{GRAVITY, Instant};

/// Rate of the gyroscope, Hz (PS 7.4, RM 4.2).
pub(crate) const RATE: f64 = 8_000.0;
/// Gyroscope ticks per sample of the accelerometer, which has 1 kHz (PS 7.5).
pub(crate) const ACCEL_TICKS: u64 = 8;
/// Tolerance of the clock with a gyroscope as reference (PS 6.6).
const CLOCK: f64 = 0.01;
/// Random streams of this chip; no sensor uses these numbers.
const STREAM: u64 = 104;
const VIBRATION_STREAM: u64 = 105;
/// Noise densities (PS 6.1, 6.2): 0.005 °/s/√Hz, 400 µg/√Hz.
const GYRO_DENSITY: f64 = 0.005 * DEGREE;
const ACCEL_DENSITY: f64 = 400e-6 * GRAVITY as f64;
/// Offsets at 25 °C (PS 6.1, 6.2): ±20 °/s; ±50 mg in x and y, ±80 mg in z.
const GYRO_OFFSET: f64 = 20.0 * DEGREE;
const ACCEL_OFFSET: [f64; 3] = [0.05, 0.05, 0.08];
/// Bound of the scale error (PS 6.1, 6.2).
const SCALE: f64 = 0.03;
const DEGREE: f64 = core::f64::consts::PI / 180.0;

/// Bandwidths of accelerometer and gyroscope by filter setting, Hz (RM 4.3).
const BANDWIDTH: [[f64; 2]; 7] =
    [[260.0, 256.0], [184.0, 188.0], [94.0, 98.0], [44.0, 42.0], [21.0, 20.0], [10.0, 10.0], [5.0, 5.0]];

#[derive(Debug)]
pub(crate) struct Physics {
    world: World,
    /// Mounting error, if the conditions have one.
    mounting: Option<Mounting>,
    noise: Noise,
    vibration: Vibration,
    start: Instant,
    accel_offset: Vector3<f64>,
    gyro_offset: Vector3<f64>,
    accel_scale: Vector3<f64>,
    gyro_scale: Vector3<f64>,
    /// Accelerometer x, y, z, m/s², and gyroscope x, y, z, rad/s, body, after the low-pass filter.
    filtered: [f64; 6],
}

impl Physics {
    pub fn new(world: &World, clock: &Clock, seed: u64, vibration: f64) -> (Self, Schedule) {
        let mut noise = Noise::new(seed, STREAM);
        let start = clock.now();
        let schedule = Schedule::new(start, RATE, CLOCK, &mut noise);
        let hover_speed = world.inspect(|body| body.nominal_rotor_speed());
        let shaking = Noise::new(seed, VIBRATION_STREAM);
        let physics = Self {
            mounting: Mounting::of(world, seed),
            world: world.clone(),
            vibration: Vibration::new(vibration, schedule.period() * 1e-6, hover_speed, shaking),
            start,
            accel_offset: Vector3::from(ACCEL_OFFSET.map(|offset| noise.within(offset * f64::from(GRAVITY)))),
            gyro_offset: Vector3::from_fn(|_, _| noise.within(GYRO_OFFSET)),
            accel_scale: Vector3::from_fn(|_, _| 1.0 + noise.within(SCALE)),
            gyro_scale: Vector3::from_fn(|_, _| 1.0 + noise.within(SCALE)),
            filtered: [0.0; 6],
            noise,
        };
        (physics, schedule)
    }

    /// One tick with this filter setting, modelled as a first-order low-pass. The accelerometer is
    /// sampled every eighth tick.
    pub fn tick(&mut self, tick: u64, filter: u8, at: Instant) {
        let motion = self.world.inertial_at(at);
        let shake = self.vibration.step(&motion.rotor_speed);
        let (force, rate) = match &self.mounting {
            Some(mounting) => (mounting.accel * mounting.felt(&motion), mounting.gyro * motion.rate),
            None => (motion.specific_force, motion.rate),
        };
        let felt = [
            force.component_mul(&self.accel_scale) + self.accel_offset,
            rate.component_mul(&self.gyro_scale) + self.gyro_offset,
        ];
        let bandwidths = BANDWIDTH[usize::from(filter).min(BANDWIDTH.len() - 1)];
        for (sensor, (felt, bandwidth)) in felt.iter().zip(bandwidths).enumerate() {
            let (ticks, density) = if sensor == 0 { (ACCEL_TICKS, ACCEL_DENSITY) } else { (1, GYRO_DENSITY) };
            if !tick.is_multiple_of(ticks) {
                continue;
            }
            let rate = RATE / ticks as f64;
            // First-order low-pass with this corner frequency.
            let share = 1.0 - libm::exp(-core::f64::consts::TAU * bandwidth / rate);
            let noise = self.noise.normal3() * (density * libm::sqrt(rate / 2.0));
            for axis in 0..3 {
                let place = 3 * sensor + axis;
                self.filtered[place] += share * (felt[axis] + shake[place] + noise[axis] - self.filtered[place]);
            }
        }
    }

    /// Accelerometer and gyroscope after the low-pass filter.
    pub fn filtered(&self) -> [[f64; 3]; 2] {
        let [ax, ay, az, gx, gy, gz] = self.filtered;
        [[ax, ay, az], [gx, gy, gz]]
    }

    /// Die temperature, °C.
    pub fn temperature(&self, at: Instant) -> f64 {
        let minutes = f64::from(at.since(self.start).seconds()) / 60.0;
        25.0 + 10.0 * minutes / (minutes + 2.0) + self.world.warmth_at(at)
    }
}
