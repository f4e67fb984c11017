//! The airframe: what a vehicle weighs, how it turns, where its rotors are and what they can do.
//!
//! An [`Airframe`] is a plain value that lives with its vehicle, usually as a constant in the vehicle's own crate. The
//! configurations of mixer, controllers and motor stage are derived from it by their constructors `for_airframe`, so
//! that a number of the vehicle is written down once. Use it to set up a vehicle; what is tuned afterwards is tuned in the
//! configurations, which stay plain structs. It does not describe drag, battery or ground contact: no control law here
//! needs them, and a simulator has parameters of its own.
//!
//! # Limits derived from it
//! * Collective thrust ends at [`THRUST_SHARE`] of what all motors can do, so that some room to steer is left.
//! * Torque about an axis ends at a share ([`TILT_TORQUE_SHARE`], [`YAW_TORQUE_SHARE`]) of what the rotors give about
//!   that axis when those of one side are at full thrust and those of the other at none: half the sum of
//!   |lever arm| × largest thrust.

use stampfly_types::{GRAVITY, Vec3};

use crate::curve::MotorCurve;

/// Which way a rotor turns, seen from above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spin {
    /// Clockwise: its drag turns the body counter-clockwise.
    Clockwise,
    /// Counter-clockwise: its drag turns the body clockwise, which is positive yaw.
    CounterClockwise,
}

/// One rotor of the airframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotor {
    /// Forward of the centre of mass, m.
    pub x: f32,
    /// Right of the centre of mass, m.
    pub y: f32,
    /// Sense of rotation.
    pub spin: Spin,
    /// Drag torque per thrust, m.
    pub kappa: f32,
}

impl Rotor {
    /// The rotors of a quadrotor in X: front right, rear right, rear left, front left, the first counter-clockwise.
    ///
    /// `offset` is each rotor's distance from the body's x and y axis, m; `kappa` the drag torque per thrust, m.
    #[must_use]
    pub const fn quadrotor_x(offset: f32, kappa: f32) -> [Self; 4] {
        [
            Self { x: offset, y: offset, spin: Spin::CounterClockwise, kappa },
            Self { x: -offset, y: offset, spin: Spin::Clockwise, kappa },
            Self { x: -offset, y: -offset, spin: Spin::CounterClockwise, kappa },
            Self { x: offset, y: -offset, spin: Spin::Clockwise, kappa },
        ]
    }

    /// Yaw torque per thrust, m: κ, negative for a rotor that turns clockwise.
    #[must_use]
    pub const fn yaw_arm(&self) -> f32 {
        match self.spin {
            Spin::CounterClockwise => self.kappa,
            Spin::Clockwise => -self.kappa,
        }
    }
}

/// Share of full thrust that collective thrust may use: eight percent of every motor are left to steer with.
pub const THRUST_SHARE: f32 = 0.92;
/// Share of the largest roll and pitch torque that a controller may ask for: with collective thrust at half, every motor
/// keeps more than half of its range for thrust and yaw.
pub const TILT_TORQUE_SHARE: f32 = 0.4;
/// Share of the largest yaw torque that a controller may ask for. The mixer gives yaw up first, so a larger share costs
/// neither thrust nor tilt.
pub const YAW_TORQUE_SHARE: f32 = 0.75;

/// A multirotor with fixed, parallel rotors and equal motors. Body axes are forward, right, down from the centre of mass.
///
/// ```
/// use stampfly_control::{Airframe, CascadeConfig, MotorCurve, MultirotorMixer, Rotor, Spin};
/// use stampfly_types::Vec3;
///
/// // A hexacopter of 1.8 kg with 10 inch propellers 0.28 m from its centre, one arm straight ahead.
/// const fn rotor(x: f32, y: f32, spin: Spin) -> Rotor {
///     Rotor { x, y, spin, kappa: 0.016 }
/// }
/// const HEXACOPTER: Airframe = Airframe {
///     mass: 1.8,
///     inertia: Vec3::new(0.022, 0.024, 0.042),
///     rotors: &[
///         rotor(0.28, 0.0, Spin::CounterClockwise),
///         rotor(0.14, 0.2425, Spin::Clockwise),
///         rotor(-0.14, 0.2425, Spin::CounterClockwise),
///         rotor(-0.28, 0.0, Spin::Clockwise),
///         rotor(-0.14, -0.2425, Spin::CounterClockwise),
///         rotor(0.14, -0.2425, Spin::Clockwise),
///     ],
///     motor: MotorCurve { ct: 1.2e-5, am: 4.0e-6, bm: 1.3e-2, cm: 0.2 },
///     motor_lag: 0.045,
///     motor_thrust_max: 7.0,
///     cells: 4,
/// };
/// assert!((HEXACOPTER.hover_thrust() - 17.65).abs() < 0.01, "N");
/// let mixer = MultirotorMixer::for_airframe(&HEXACOPTER)?;
/// let config = CascadeConfig::for_airframe(&HEXACOPTER);
/// assert!(config.altitude.thrust_max > 2.0 * HEXACOPTER.hover_thrust());
/// assert!(config.rate.pitch.kp > config.rate.roll.kp, "more inertia, more gain");
/// # Ok::<(), stampfly_control::GeometryError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Airframe {
    /// Take-off mass, battery included, kg.
    pub mass: f32,
    /// Principal moments of inertia about the body's axes, kg·m². Measure them on a bifilar pendulum, or add up the parts.
    pub inertia: Vec3,
    /// The rotors, in the order of the motors' outputs.
    pub rotors: &'static [Rotor],
    /// How one motor with its propeller turns voltage into thrust.
    pub motor: MotorCurve,
    /// Time constant of one motor with its propeller near hover, s.
    pub motor_lag: f32,
    /// Largest thrust of one motor, N: at the largest duty on a full battery.
    pub motor_thrust_max: f32,
    /// Lithium cells in series.
    pub cells: u8,
}

/// Time constant of the motors up to which the rate and attitude loops have their full bandwidth, s. Slower motors lower them
/// in proportion: what their pole leaves after the lead grows with it, and a step of the lean would overshoot by more than 15 %.
pub const QUICK_MOTOR: f32 = 0.02;

impl Airframe {
    /// Share of the loops' full bandwidth that the motors allow: 1 up to [`QUICK_MOTOR`], less for slower ones.
    #[must_use]
    pub fn quickness(&self) -> f32 {
        (QUICK_MOTOR / self.motor_lag).min(1.0)
    }

    /// A quadrotor of half a kilogram that nobody built, in round numbers: for examples, tests and benchmarks. A vehicle
    /// describes itself.
    pub const EXAMPLE: Self = Self {
        mass: 0.5,
        inertia: Vec3::new(6.0e-4, 7.0e-4, 1.2e-3),
        rotors: &Rotor::quadrotor_x(0.09, 0.02),
        motor: MotorCurve { ct: 2.0e-6, am: 1.5e-6, bm: 5.0e-3, cm: 0.05 },
        motor_lag: 0.018,
        motor_thrust_max: 2.3,
        cells: 2,
    };

    /// Thrust that carries the vehicle, N.
    #[must_use]
    pub const fn hover_thrust(&self) -> f32 {
        self.mass * GRAVITY
    }

    /// What all motors push with together at most, N.
    #[must_use]
    pub const fn full_thrust(&self) -> f32 {
        self.rotors.len() as f32 * self.motor_thrust_max
    }

    /// Torque about each body axis that one rotor's share of the weight makes, N·m, the mean over the rotors.
    #[must_use]
    pub fn rotor_torque(&self) -> Vec3 {
        let rotors = self.rotors.len().max(1) as f32;
        let arms =
            self.rotors.iter().fold(Vec3::zeros(), |sum, rotor| sum + Vec3::new(rotor.y, rotor.x, rotor.kappa).abs());
        arms * (self.hover_thrust() / (rotors * rotors))
    }

    /// Largest collective thrust for a controller, N: [`THRUST_SHARE`] of [`Self::full_thrust`].
    #[must_use]
    pub const fn thrust_limit(&self) -> f32 {
        THRUST_SHARE * self.full_thrust()
    }

    /// Largest torque for a controller about each body axis, N·m; see the [module](self) for the rule.
    #[must_use]
    pub fn torque_limit(&self) -> Vec3 {
        let arms = self
            .rotors
            .iter()
            .fold(Vec3::zeros(), |sum, rotor| sum + Vec3::new(rotor.y.abs(), rotor.x.abs(), rotor.kappa.abs()));
        let shares = Vec3::new(TILT_TORQUE_SHARE, TILT_TORQUE_SHARE, YAW_TORQUE_SHARE);
        arms.component_mul(&shares) * (0.5 * self.motor_thrust_max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_leave_room_above_hover() {
        let airframe = Airframe::EXAMPLE;
        assert!((airframe.hover_thrust() - 4.903).abs() < 1e-3);
        assert!((airframe.thrust_limit() - 0.92 * 9.2).abs() < 1e-5);
        let limit = airframe.torque_limit();
        // A quarter of 4.903 N on a lever of 0.09 m.
        assert!((airframe.rotor_torque() - Vec3::new(0.1103, 0.1103, 0.0245)).norm() < 1e-4);
        // Two motors at 2.3 N on levers of 0.09 m, the others still: 0.414 N·m.
        assert!((limit - Vec3::new(0.4 * 0.414, 0.4 * 0.414, 0.75 * 0.092)).norm() < 1e-6, "{limit}");
    }

    #[test]
    fn a_motor_reaches_its_largest_thrust_on_a_full_battery() {
        let airframe = Airframe::EXAMPLE;
        let voltage = airframe.motor.voltage(airframe.motor_thrust_max);
        assert!(voltage < 4.2 * f32::from(airframe.cells), "{voltage} V");
    }
}
