//! Position, velocity, attitude and rate, and their integration under constant forces.
//!
//! Every [`Body`](super::Body) moves by these equations, which are of second order for position and
//! attitude. Use them for at most one [`STEP`](super::STEP) at a time.

use super::{GRAVITY, ROTORS};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Motion of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// World NED, m. The floor is at z = 0.
    pub position: Vector3<f64>,
    /// World NED, m/s.
    pub velocity: Vector3<f64>,
    /// Body FRD → world NED.
    pub attitude: UnitQuaternion<f64>,
    /// Body FRD, rad/s.
    pub rate: Vector3<f64>,
    /// Specific force at the centre of mass, body FRD, m/s².
    pub specific_force: Vector3<f64>,
    /// Body FRD, rad/s².
    pub angular_acceleration: Vector3<f64>,
    /// Rotor speeds, rad/s.
    pub rotor_speed: [f64; ROTORS],
    /// Battery current, A.
    pub current: f64,
}

impl Default for Motion {
    /// At rest on the ground at the origin, facing north, under [`GRAVITY`].
    fn default() -> Self {
        Self {
            position: Vector3::zeros(),
            velocity: Vector3::zeros(),
            attitude: UnitQuaternion::identity(),
            rate: Vector3::zeros(),
            specific_force: Vector3::new(0.0, 0.0, -GRAVITY),
            angular_acceleration: Vector3::zeros(),
            rotor_speed: [0.0; ROTORS],
            current: 0.0,
        }
    }
}

impl Motion {
    /// Advances by `dt` seconds as a vehicle that rolls on level ground without slipping: it
    /// reaches the forward speed `speed`, m/s, and turns right at the rate `turn`, rad/s.
    ///
    /// ```
    /// use stampfly_sim::plant::Motion;
    /// let mut motion = Motion::default();
    /// for _ in 0..1_000 {
    ///     // A circle with a radius of 2 m, half of it.
    ///     motion.roll(core::f64::consts::PI * 1e-3, 2.0, 1.0);
    /// }
    /// assert!(motion.position.x.abs() < 0.01 && (motion.position.y - 4.0).abs() < 0.01);
    /// // The centripetal acceleration, to the right.
    /// assert!((motion.specific_force.y - 2.0).abs() < 1e-3);
    /// ```
    pub fn roll(&mut self, dt: f64, speed: f64, turn: f64) {
        let ahead = self.attitude * Vector3::x();
        let before = ahead.dot(&self.velocity);
        self.velocity = ahead * before;
        self.rate = Vector3::new(0.0, 0.0, turn);
        self.specific_force = Vector3::new((speed - before) / dt, before * turn, -GRAVITY);
        self.advance(dt, GRAVITY);
    }

    /// The motion `dt` seconds later, for times shorter than a step, with constant specific force,
    /// angular acceleration and rotor speeds.
    #[inline]
    #[must_use]
    pub(crate) fn after(&self, dt: f64, gravity: f64) -> Self {
        let mut later = *self;
        later.advance(dt, gravity);
        later
    }

    /// Advances by `dt` seconds with constant specific force and angular acceleration under this
    /// gravity, m/s².
    // Inlined, so that results of the present step stay in registers.
    #[inline(always)]
    pub fn advance(&mut self, dt: f64, gravity: f64) {
        let mean_rate = self.rate + self.angular_acceleration * (0.5 * dt);
        // Position first: it needs the velocity at the beginning of the step.
        self.position = self.position_after(dt, gravity);
        self.velocity += self.acceleration(gravity) * dt;
        // The mean rate over the step makes the attitude second order.
        self.attitude = turn(&self.attitude, &(mean_rate * dt));
        self.rate = self.rate_after(dt);
    }

    /// Only the position of [`after`](Self::after).
    pub(crate) fn position_after(&self, dt: f64, gravity: f64) -> Vector3<f64> {
        self.position + self.velocity * dt + self.acceleration(gravity) * (0.5 * dt * dt)
    }

    /// Only the rate of [`after`](Self::after).
    pub(crate) fn rate_after(&self, dt: f64) -> Vector3<f64> {
        self.rate + self.angular_acceleration * dt
    }

    fn acceleration(&self, gravity: f64) -> Vector3<f64> {
        self.attitude * self.specific_force + Vector3::new(0.0, 0.0, gravity)
    }
}

/// The attitude after a small rotation `angle` (rotation vector, body frame).
///
/// Sine and cosine use their series up to the third order: at 2000 °/s a step turns by 0.02 rad,
/// for which the truncation error is below 1e-10.
fn turn(attitude: &UnitQuaternion<f64>, angle: &Vector3<f64>) -> UnitQuaternion<f64> {
    let square = 0.25 * angle.norm_squared();
    let vector = angle * (0.5 * (1.0 - square / 6.0));
    UnitQuaternion::new_normalize(attitude.quaternion() * Quaternion::from_parts(1.0 - 0.5 * square, vector))
}
