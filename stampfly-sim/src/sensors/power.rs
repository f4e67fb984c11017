//! Battery monitor INA3221: voltage and mean current at 10 Hz.

use super::schedule::Schedule;
use crate::noise::{Noise, Stream};
use crate::time::Clock;
use crate::world::World;
use core::convert::Infallible;
use stampfly_drivers::{PowerMonitor, Sample};
use stampfly_types::messages::PowerData;
use stampfly_types::{Duration, Instant};

pub(crate) const RATE: f64 = 10.0;
const READ_OUT: Duration = Duration::from_micros(300);
/// Resolution of the voltage, V.
const VOLTAGE_STEP: f64 = 0.008;
/// Resolution of the current, A: 40 µV over 10 mΩ.
const CURRENT_STEP: f64 = 0.004;

/// Voltage and current at the chip, shared by the model and the register-level emulator.
#[derive(Debug)]
pub(crate) struct PowerPhysics {
    world: World,
    noise: Noise,
    /// Gain error of shunt and amplifier.
    gain: f64,
    /// Charge drawn at the previous sample, C, and its instant.
    before: (f64, Instant),
}

impl PowerPhysics {
    pub(crate) fn new(world: &World, start: Instant, mut noise: Noise) -> Self {
        Self {
            gain: 1.0 + noise.within(0.02),
            noise,
            before: (world.inspect(|plant| plant.battery().drawn()), start),
            world: world.clone(),
        }
    }

    /// Present voltage, V, and mean current since the previous call, A.
    pub(crate) fn measure(&mut self, now: Instant) -> [f64; 2] {
        self.world.advance_to(now);
        let (voltage, drawn) = self.world.inspect(|plant| (plant.battery().voltage(), plant.battery().drawn()));
        // The mean over the interval comes from the charge, which includes every physics step.
        let mean = (drawn - self.before.0) / f64::from(now.since(self.before.1).seconds()).max(1e-3);
        self.before = (drawn, now);
        let voltage = voltage + 0.003 * self.noise.normal();
        [voltage, mean * self.gain + 0.003 * self.noise.normal()]
    }

    /// Voltage, V, and current, A, averaged over a conversion, within the past that the world
    /// keeps.
    pub(crate) fn mean(&mut self, begin: Instant, end: Instant) -> [f64; 2] {
        const POINTS: u64 = 8;
        let length = end.since(begin).as_micros();
        let current = (0..POINTS)
            .map(|point| {
                self.world.motion_at(begin + Duration::from_micros(length * (2 * point + 1) / (2 * POINTS))).current
            })
            .sum::<f64>()
            / POINTS as f64;
        let voltage = self.world.inspect(|plant| plant.battery().voltage()) + 0.003 * self.noise.normal();
        [voltage, current * self.gain + 0.003 * self.noise.normal()]
    }
}

/// Model of the battery monitor. Implements [`PowerMonitor`].
#[derive(Debug)]
pub struct PowerModel {
    clock: Clock,
    schedule: Schedule,
    physics: PowerPhysics,
}

impl PowerModel {
    pub(crate) fn new(world: &World, clock: &Clock, seed: u64) -> Self {
        let mut noise = Noise::stream(seed, Stream::Power);
        Self {
            schedule: Schedule::new(clock.now(), RATE, 0.02, &mut noise),
            physics: PowerPhysics::new(world, clock.now(), noise),
            clock: clock.clone(),
        }
    }
}

impl PowerMonitor for PowerModel {
    type Error = Infallible;

    async fn next(&mut self) -> Result<Sample<PowerData>, Infallible> {
        let number = self.schedule.upcoming(self.clock.now(), READ_OUT.as_micros() as f64);
        let at = self.schedule.instant(number);
        self.clock.sleep_until(at + READ_OUT).await;
        self.schedule.reported(number);
        let [voltage, current] = self.physics.measure(self.clock.now());
        let voltage = (voltage / VOLTAGE_STEP).round() * VOLTAGE_STEP;
        let current = (current / CURRENT_STEP).round() * CURRENT_STEP;
        let power = voltage * current;
        Ok(Sample { at, data: PowerData { voltage: voltage as f32, current: current as f32, power: power as f32 } })
    }
}
