//! Magnetometer BMM150 at 25 Hz: Earth's field, hard and soft iron, and the field of the motor
//! current.

use super::schedule::Schedule;
use crate::noise::{Noise, Stream};
use crate::time::Clock;
use crate::world::World;
use core::convert::Infallible;
use nalgebra::{Matrix3, Vector3};
use stampfly_drivers::{Magnetometer, Sample};
use stampfly_types::messages::MagData;
use stampfly_types::{Duration, Instant};

pub(crate) const RATE: f64 = 25.0;
const READ_OUT: Duration = Duration::from_micros(300);
/// Standard deviation of one sample, µT (static records).
const DEVIATION: f64 = 0.65;
/// Resolution, µT.
const RESOLUTION: f64 = 0.3;
/// Standard deviation of the hard-iron offset per axis, µT.
const HARD_IRON: f64 = 12.0;
/// Bound of the contribution of soft iron and unequal gains to each element of the symmetric
/// matrix.
const SOFT_IRON: f64 = 0.06;
/// Relative fluctuation of the motors' field due to commutation.
const FLICKER: f64 = 0.2;

/// Magnetic field at the chip, shared by the model and the register-level emulator.
#[derive(Debug)]
pub(crate) struct MagPhysics {
    world: World,
    noise: Noise,
    hard_iron: Vector3<f64>,
    /// Soft-iron matrix, if imperfections are enabled.
    soft_iron: Option<Matrix3<f64>>,
    idle_current: f64,
    /// Earth's field, world NED, µT.
    earth: Vector3<f64>,
    /// Field of the motor current, body, µT/A.
    per_ampere: Vector3<f64>,
}

impl MagPhysics {
    pub(crate) fn new(world: &World, mut noise: Noise, seed: u64) -> Self {
        let hard_iron = noise.normal3() * HARD_IRON;
        let strength = world.imperfections();
        let soft_iron = (strength > 0.0).then(|| {
            let mut noise = Noise::stream(seed, Stream::SoftIron);
            let half = Matrix3::from_fn(|_, _| noise.within(0.5 * SOFT_IRON * strength));
            Matrix3::identity() + half + half.transpose()
        });
        world.note_specimen(|specimen| {
            specimen.hard_iron = hard_iron;
            specimen.soft_iron = soft_iron.unwrap_or_else(Matrix3::identity);
        });
        Self {
            hard_iron,
            soft_iron,
            idle_current: world.inspect(|body| body.idle_current()),
            earth: world.field(),
            per_ampere: world.inspect(|body| body.disturbance().field).into(),
            noise,
            world: world.clone(),
        }
    }

    /// One conversion at `at`, µT, body.
    pub(crate) fn field(&mut self, at: Instant) -> Vector3<f64> {
        let motion = self.world.motion_at(at);
        // Commutation makes the field fluctuate in proportion to the current.
        let motors = (motion.current - self.idle_current).max(0.0) * (1.0 + FLICKER * self.noise.normal());
        let field = motion.attitude.inverse_transform_vector(&self.earth);
        self.soft_iron.map_or(field, |iron| iron * field)
            + self.hard_iron
            + self.per_ampere * motors
            + self.noise.normal3() * DEVIATION
    }
}

/// Model of the magnetometer. Implements [`Magnetometer`].
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
            physics: MagPhysics::new(world, noise, seed),
            clock: clock.clone(),
        }
    }

    /// The hard-iron offset, which a calibration has to find, µT, body.
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
