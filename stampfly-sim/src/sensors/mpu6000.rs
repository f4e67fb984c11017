//! Inertial sensor MPU-6000 of small flight controllers, polled at 4 kHz: ±16 g, ±2000 °/s, without
//! its configurable low-pass filter.
//!
//! Has the physics of the [emulated chip](crate::chips::Mpu6000) without its registers. The gyro
//! converts at 8 kHz and the accelerometer at 1 kHz, so three of four samples repeat the
//! accelerometer's last value.

use super::imu::to_counts;
use super::schedule::Schedule;
use crate::chips::mpu6000::physics::{ACCEL_TICKS, Physics};
use crate::time::Clock;
use crate::world::World;
use core::convert::Infallible;
use stampfly_drivers::Sample;
use stampfly_types::messages::ImuData;
use stampfly_types::{Duration, GRAVITY, Instant, Vec3};

/// Polling period.
const PERIOD: Duration = Duration::from_micros(250);
/// Time to read fourteen bytes and their address at 20 MHz.
const READ_OUT: Duration = Duration::from_micros(8);
/// Counts per m/s² at ±16 g.
const ACCEL_SCALE: f64 = 2048.0 / GRAVITY as f64;
/// Counts per rad/s at ±2000 °/s.
const GYRO_SCALE: f64 = 16.4 * 180.0 / core::f64::consts::PI;

/// Model of the sensor. Implements [`Imu`](stampfly_drivers::Imu) at 4 kHz; a sample is the content
/// of the chip's registers at that instant.
#[derive(Debug)]
pub struct Mpu6000Model {
    clock: Clock,
    start: Instant,
    polls: u64,
    physics: Physics,
    schedule: Schedule,
    /// Number of the next tick at 8 kHz.
    tick: u64,
    /// Content of the accelerometer's registers.
    accel: [f64; 3],
}

impl Mpu6000Model {
    /// The sensor of this vehicle with the specimen of this seed. `vibration` is the amplitude
    /// relative to the recorded flights.
    #[must_use]
    pub fn new(world: &World, clock: &Clock, seed: u64, vibration: f64) -> Self {
        let (physics, schedule) = Physics::new(world, clock, seed, vibration);
        Self { clock: clock.clone(), start: clock.now(), polls: 0, physics, schedule, tick: 0, accel: [0.0; 3] }
    }

    /// Accelerometer and gyro registers at this instant, in SI units.
    fn convert(&mut self, at: Instant) -> [Vec3; 2] {
        // The chip runs at its own rate between polls.
        while self.schedule.instant(self.tick) <= at {
            self.physics.tick(self.tick, 0, self.schedule.instant(self.tick));
            if self.tick.is_multiple_of(ACCEL_TICKS) {
                [self.accel, _] = self.physics.filtered();
            }
            self.tick += 1;
        }
        let [_, gyro] = self.physics.filtered();
        let si = |values: [f64; 3], scale: f64| {
            let [x, y, z] = values.map(|value| (f64::from(to_counts(value, scale)) / scale) as f32);
            Vec3::new(x, y, z)
        };
        [si(self.accel, ACCEL_SCALE), si(gyro, GYRO_SCALE)]
    }
}

impl stampfly_drivers::Imu for Mpu6000Model {
    type Error = Infallible;

    async fn next(&mut self) -> Result<Sample<ImuData>, Infallible> {
        // Missed polls are skipped.
        let since = self.clock.now().since(self.start).as_micros() / PERIOD.as_micros();
        self.polls = since.max(self.polls) + 1;
        let at = self.start + PERIOD * self.polls;
        self.clock.sleep_until(at + READ_OUT).await;
        let [accel, gyro] = self.convert(at);
        let temperature = self.physics.temperature(at) as f32;
        Ok(Sample { at, data: ImuData { accel, gyro, temperature, accel_peak: 0.0 } })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Simulation, SimulationConfig, time::block_on};
    use stampfly_drivers::Imu;

    #[test]
    fn it_stands_and_its_accelerometer_repeats_itself() {
        let simulation = Simulation::new(&SimulationConfig::example());
        let clock = simulation.clock.clone();
        let mut sensor = Mpu6000Model::new(&simulation.world, &clock, 1, 0.0);
        let samples = block_on(&clock, async {
            let mut samples = Vec::new();
            for _ in 0..4_000 {
                samples.push(sensor.next().await?);
            }
            Ok::<_, Infallible>(samples)
        });
        let Ok(samples) = samples;
        assert!(samples.windows(2).all(|pair| pair[1].at.since(pair[0].at) == PERIOD));
        let repeated = samples.windows(2).filter(|pair| pair[0].data.accel == pair[1].data.accel).count();
        assert!((2_950..=3_050).contains(&repeated), "{repeated} of 4000");
        let mean = samples.iter().map(|sample| f64::from(sample.data.accel.z)).sum::<f64>() / 4_000.0;
        assert!((mean + 9.81).abs() < 1.1, "{mean}");
        let rate = samples.iter().map(|sample| f64::from(sample.data.gyro.x)).sum::<f64>() / 4_000.0;
        let spread = samples.iter().map(|s| (f64::from(s.data.gyro.x) - rate).powi(2)).sum::<f64>() / 4_000.0;
        assert!((5e-4..3e-3).contains(&spread.sqrt()), "{}", spread.sqrt());
    }
}
