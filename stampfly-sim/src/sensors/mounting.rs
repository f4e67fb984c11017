//! Mounting error of an inertial sensor: misalignment and lever arm.
//!
//! Chip on board and board in frame are each misaligned by about a degree. At a lever arm r from
//! the centre of mass the sensor measures `f + α × r + ω × (ω × r)`, the specific force of that
//! point of a rigid body. Gyroscope and accelerometer are one chip: they share the misalignment,
//! but not the scale.
use crate::noise::{Noise, Stream};
use crate::world::{Inertial, World};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Mounting of one specimen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mounting {
    /// Matrices from true to measured values, in addition to the chip's own errors.
    pub accel: Matrix3<f64>,
    pub gyro: Matrix3<f64>,
    /// Position relative to the centre of mass, body, m.
    pub lever: Vector3<f64>,
}

impl Mounting {
    /// The mounting of this seed; `None` if the conditions have no mounting error, as in the gentle
    /// world.
    pub fn of(world: &World, seed: u64) -> Option<Self> {
        let conditions = world.conditions();
        let (askew, scale, lever) = (conditions.imu_misalignment, conditions.imu_scale, conditions.imu_lever);
        if [askew, scale, lever] == [0.0; 3] {
            return None;
        }
        let mut noise = Noise::stream(seed, Stream::ImuMounting);
        let mut within = |bound: f64| Vector3::from_fn(|_, _| noise.within(bound));
        let turn = turned(&within(askew));
        // Scale after rotation: each axis of the chip has its own.
        let mut scaled = || Matrix3::from_diagonal(&within(scale).map(|share| 1.0 + share)) * turn;
        Some(Self { accel: scaled(), gyro: scaled(), lever: within(lever) })
    }

    /// Specific force at the chip's position, body, m/s².
    pub fn felt(&self, motion: &Inertial) -> Vector3<f64> {
        let Inertial { specific_force, rate, angular_acceleration, .. } = motion;
        specific_force + angular_acceleration.cross(&self.lever) + rate.cross(&rate.cross(&self.lever))
    }
}

/// Rotation matrix from the body's axes into those of a chip rotated by this rotation vector, rad.
fn turned(by: &Vector3<f64>) -> Matrix3<f64> {
    // Not nalgebra's constructor, whose sine depends on the platform.
    let angle = by.norm();
    let (sin, cos) = libm::sincos(0.5 * angle);
    let vector = if angle > 0.0 { by * (sin / angle) } else { Vector3::zeros() };
    UnitQuaternion::new_normalize(Quaternion::from_parts(cos, vector)).inverse().to_rotation_matrix().into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Conditions, Simulation, SimulationConfig};

    fn specimen(seed: u64, conditions: Conditions) -> Option<Mounting> {
        let config = SimulationConfig { conditions, seed, ..SimulationConfig::example() };
        Mounting::of(&Simulation::new(&config).world, seed)
    }

    #[test]
    fn in_the_gentle_world_it_is_where_it_should_be() {
        assert_eq!(specimen(1, Conditions::GENTLE), None);
    }

    #[test]
    fn it_is_askew_by_up_to_the_angle_about_each_axis() {
        let conditions = Conditions { imu_misalignment: 0.035, ..Conditions::GENTLE };
        let angles = (0..300).map(|seed| {
            let mounting = specimen(seed, conditions.clone()).expect("askew");
            assert_eq!(mounting.accel, mounting.gyro, "one chip");
            assert!((mounting.accel.determinant() - 1.0).abs() < 1e-12, "it turns and does not stretch");
            let down = mounting.accel * Vector3::z();
            down.xy().norm().asin()
        });
        let largest = angles.fold(0.0, f64::max);
        assert!((0.04..=0.035 * 2f64.sqrt() + 1e-6).contains(&largest), "{largest} rad");
    }

    #[test]
    fn beside_the_centre_it_feels_the_turning() {
        let lever = Vector3::new(0.006, 0.0, 0.0);
        let (accel, gyro) = (Matrix3::identity(), Matrix3::identity());
        let mounting = Mounting { accel, gyro, lever };
        let motion = |rate, angular_acceleration| Inertial {
            specific_force: Vector3::zeros(),
            rate,
            angular_acceleration,
            rotor_speed: [0.0; 4],
        };
        // 10 rad/s about z: ω²·r towards the centre. 100 rad/s² about z: α·r to the right.
        let spinning = mounting.felt(&motion(Vector3::new(0.0, 0.0, 10.0), Vector3::zeros()));
        assert!((spinning - Vector3::new(-0.6, 0.0, 0.0)).norm() < 1e-12, "{spinning}");
        let starting = mounting.felt(&motion(Vector3::zeros(), Vector3::new(0.0, 0.0, 100.0)));
        assert!((starting - Vector3::new(0.0, 0.6, 0.0)).norm() < 1e-12, "{starting}");
    }
}
