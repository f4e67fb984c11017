//! The magnetometer, BMM150 at 25 Hz: the Earth's field, the vehicle's own iron and the motors' current.

use super::schedule::Schedule;
use crate::noise::{Noise, Stream};
use crate::time::Clock;
use crate::world::World;
use core::convert::Infallible;
use nalgebra::Vector3;
use stampfly_drivers::{Magnetometer, Sample};
use stampfly_types::messages::MagData;
use stampfly_types::{Duration, Instant};

pub(crate) const RATE: f64 = 25.0;
const READ_OUT: Duration = Duration::from_micros(300);
/// The Earth's field in Kanazawa, world NED, µT (World Magnetic Model, rounded): 49° of dip, 8° west.
const FIELD: [f64; 3] = [30.8, -4.3, 36.4];
/// Standard deviation of one sample, µT (static records).
const DEVIATION: f64 = 0.65;
/// Resolution, µT.
const RESOLUTION: f64 = 0.3;
/// Standard deviation of the hard-iron offset per axis, µT.
const HARD_IRON: f64 = 12.0;
/// Field per ampere of battery current, body, µT/A: what a flight record shows between standing and hovering.
const PER_AMPERE: [f64; 3] = [-13.0, 20.0, -7.0];
/// Share of the motors' field that flickers with the commutation.
const FLICKER: f64 = 0.2;

/// The field at the chip, shared by the model and the register-level emulator.
#[derive(Debug)]
pub(crate) struct MagPhysics {
    world: World,
    noise: Noise,
    hard_iron: Vector3<f64>,
    idle_current: f64,
}

impl MagPhysics {
    pub(crate) fn new(world: &World, mut noise: Noise) -> Self {
        Self {
            hard_iron: noise.normal3() * HARD_IRON,
            idle_current: world.inspect(|plant| plant.parameters().board_current),
            noise,
            world: world.clone(),
        }
    }

    /// One conversion at `at`, µT, body.
    pub(crate) fn field(&mut self, at: Instant) -> Vector3<f64> {
        let motion = self.world.motion_at(at);
        let motors = (motion.current - self.idle_current).max(0.0) * (1.0 + FLICKER * self.noise.normal());
        motion.attitude.inverse_transform_vector(&Vector3::from(FIELD))
            + self.hard_iron
            + Vector3::from(PER_AMPERE) * motors
            + self.noise.normal3() * DEVIATION
    }
}

/// The model of the magnetometer. Implements [`Magnetometer`].
#[derive(Debug)]
pub struct MagModel {
    clock: Clock,
    schedule: Schedule,
    physics: MagPhysics,
}

impl MagModel {
    pub(crate) fn new(world: &World, clock: &Clock, seed: u64) -> Self {
        let mut noise = Noise::stream(seed, Stream::Mag);
        Self {
            schedule: Schedule::new(clock.now(), RATE, 0.02, &mut noise),
            physics: MagPhysics::new(world, noise),
            clock: clock.clone(),
        }
    }

    /// The offset that a calibration has to find, µT, body.
    #[must_use]
    pub fn hard_iron(&self) -> stampfly_types::Vec3 {
        self.physics.hard_iron.cast::<f32>().into()
    }
}

impl Magnetometer for MagModel {
    type Error = Infallible;

    async fn next(&mut self) -> Result<Sample<MagData>, Infallible> {
        let number = self.schedule.upcoming(self.clock.now(), READ_OUT.as_micros() as f64);
        let at = self.schedule.instant(number);
        self.clock.sleep_until(at + READ_OUT).await;
        self.schedule.reported(number);
        let field = self.physics.field(at).map(|value| (value / RESOLUTION).round() * RESOLUTION);
        Ok(Sample { at, data: MagData { field: field.cast::<f32>().into() } })
    }
}
