//! Tracking control on SE(3): the second controller, and the proof that controllers can be exchanged.
//!
//! T. Lee, M. Leok and N. H. McClamroch, *Geometric tracking control of a quadrotor UAV on SE(3)*, IEEE CDC 2010,
//! equations (10) to (16), with an integral on the position error as in F. Goodarzi, D. Lee and T. Lee, *Geometric
//! nonlinear PID control of a quadrotor UAV on SE(3)*, ECC 2013. The attitude error is formed on rotation matrices,
//! e_R = ½ (R_dᵀR − RᵀR_d)^∨, torque directly from it, and the gyroscopic term is cancelled.
//!
//! Choose it for agile paths and for study. The cascade rejects more: this law has no integral on the attitude, so a
//! motor that is weaker than the others leaves a small lean, which the position integral has to make up for.

use nalgebra::Matrix3;
use stampfly_types::messages::ControlOutput;
use stampfly_types::{GRAVITY, Instant, Quat, Vec3, math};

use crate::airframe::Airframe;
use crate::attitude;
use crate::bound::{possible_thrust, symmetric, tan_lean_max, within};
use crate::cascade::StickConfig;
use crate::controller::{ControlInput, Controller};
use crate::intent::{Heading, Horizontal, Intent, Vertical};
use crate::timing::StepTimer;

/// Gains of the geometric controller. All of them are per unit of mass or inertia, so they are squared frequencies
/// and dampings and hold for vehicles of any size.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GeometricConfig {
    /// Mass, kg.
    pub mass: f32,
    /// Principal moments of inertia, kg·m².
    pub inertia: Vec3,
    /// Acceleration per position error, 1/s².
    pub position: f32,
    /// Acceleration per velocity error, 1/s.
    pub velocity: f32,
    /// Acceleration per integral of the position error, 1/s³.
    pub integral: f32,
    /// Largest acceleration the integral may stand for, m/s².
    pub integral_max: f32,
    /// Angular acceleration per attitude error, 1/s²: tilt, then heading.
    pub attitude: [f32; 2],
    /// Angular acceleration per rate error, 1/s: tilt, then heading.
    pub rate: [f32; 2],
    /// Largest tilt, rad.
    pub tilt_max: f32,
    /// Largest collective thrust, N.
    pub thrust_max: f32,
    /// Largest torque per axis, N·m.
    pub torque_max: Vec3,
    /// What full stick means.
    pub sticks: StickConfig,
}

impl GeometricConfig {
    /// Mass, inertia and limits from the airframe. The gains hold for any whose motors are quick. Slower ones stretch time by
    /// one over [`Airframe::quickness`]: a gain is a power of a frequency, so it shrinks with as many powers of the quickness, and
    /// what is left of damping and phase is what it was.
    #[must_use]
    pub fn for_airframe(airframe: &Airframe) -> Self {
        let quickness = airframe.quickness();
        let squared = quickness * quickness;
        Self {
            mass: airframe.mass,
            inertia: airframe.inertia,
            position: 14.0 * squared,
            velocity: 7.0 * quickness,
            integral: 12.0 * (squared * quickness),
            integral_max: 4.0,
            attitude: [450.0 * squared, 80.0 * squared],
            rate: [32.0 * quickness, 16.0 * quickness],
            tilt_max: 0.35,
            thrust_max: airframe.thrust_limit(),
            torque_max: airframe.torque_limit(),
            sticks: StickConfig::default(),
        }
    }
}

/// Lee's controller.
///
/// ```
/// use stampfly_control::{Airframe, ControlInput, Controller, GeometricConfig, GeometricController};
/// use stampfly_types::messages::*;
/// use stampfly_types::{Instant, Vec3};
///
/// // Any controller, behind the same trait.
/// let config = GeometricConfig::for_airframe(&Airframe::EXAMPLE);
/// let mut controller: Box<dyn Controller> = Box::new(GeometricController::new(&config));
/// let estimate = StateEstimate { valid: Validity::ALL, ..Default::default() };
/// let mode = FlightStatus { phase: FlightPhase::Flying, mode: FlightMode::AltHold, armed: true, ..Default::default() };
/// let land_detected = LandDetected { contact: GroundContact::Air, thrust_ceiling: f32::MAX, ..Default::default() };
/// let setpoint = Setpoint { axes: SetpointAxes::POSITION_Z | SetpointAxes::YAW, ..Default::default() };
/// let output = controller.step(Instant::from_micros(2_500), &ControlInput {
///     estimate: &estimate, command: &CommandSetpoint { roll: 0.5, ..Default::default() }, setpoint: &setpoint,
///     flight_status: &mode, land_detected: &land_detected, unmet: [0.0; 4],
/// });
/// assert!(output.torque.x > 0.0, "stick right, right wing down");
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GeometricController {
    config: GeometricConfig,
    tan_tilt_max: f32,
    tan_lean_max: f32,
    /// Acceleration the integral stands for, world frame.
    integral: Vec3,
    timer: StepTimer,
    resets: u32,
}

impl GeometricController {
    /// A controller at rest.
    #[must_use]
    pub fn new(config: &GeometricConfig) -> Self {
        Self {
            config: *config,
            tan_tilt_max: math::tan(config.tilt_max),
            tan_lean_max: math::tan(config.sticks.lean_max),
            integral: Vec3::zeros(),
            timer: StepTimer::default(),
            resets: 0,
        }
    }

    /// Acceleration asked for, world frame: feedback, integral and path. Axes that are not commanded are zero.
    fn acceleration(&mut self, intent: &Intent, input: &ControlInput<'_>, dt: f32) -> Vec3 {
        let (path, estimate, config) = (input.setpoint, input.estimate, &self.config);
        let (flat, flat_position) = match intent.horizontal {
            Horizontal::Path => (1.0, 1.0),
            Horizontal::Velocity => (1.0, 0.0),
            Horizontal::Lean { .. } | Horizontal::Rates { .. } | Horizontal::Damp | Horizontal::Nothing => (0.0, 0.0),
        };
        let (upright, upright_position) = match intent.vertical {
            Vertical::Path => (1.0, 1.0),
            Vertical::Velocity => (1.0, 0.0),
            Vertical::Throttle(_) | Vertical::Descend => (0.0, 0.0),
        };
        // An axis that is not followed may hold no number at all, and zero times NaN is NaN: select, then compute.
        let pick = |x: f32, y: f32, z: f32, flat: f32, upright: f32| {
            let flat = if flat > 0.0 { (x, y) } else { (0.0, 0.0) };
            Vec3::new(flat.0, flat.1, if upright > 0.0 { z } else { 0.0 })
        };
        let position = path.position - estimate.position;
        let position = pick(position.x, position.y, position.z, flat_position, upright_position);
        let velocity = path.velocity - estimate.velocity;
        let velocity = pick(velocity.x, velocity.y, velocity.z, flat, upright);
        let ahead = pick(path.acceleration.x, path.acceleration.y, path.acceleration.z, flat, upright);

        if !intent.grounded {
            let max = config.integral_max;
            self.integral = (self.integral + position * (config.integral * dt)).map(|i| symmetric(i, max));
        }
        self.integral = pick(self.integral.x, self.integral.y, self.integral.z, flat, upright);
        ahead + position * config.position + velocity * config.velocity + self.integral
    }

    /// Specific force asked of the motors along the world axes over mass: a − g, within the largest tilt.
    fn specific_force(&mut self, intent: &Intent, input: &ControlInput<'_>, dt: f32) -> Vec3 {
        let demand = self.acceleration(intent, input, dt);
        let up = within(GRAVITY - demand.z, 0.3 * GRAVITY, self.config.thrust_max / self.config.mass);
        let (x, y, tan_max) = match intent.horizontal {
            Horizontal::Lean { forward, right } => {
                let (cos_half, sin_half) = attitude::half_heading(&input.estimate.attitude);
                let (cos, sin) = (cos_half * cos_half - sin_half * sin_half, 2.0 * sin_half * cos_half);
                let reach = up * self.tan_lean_max;
                (reach * (forward * cos - right * sin), reach * (forward * sin + right * cos), self.tan_lean_max)
            }
            Horizontal::Path
            | Horizontal::Velocity
            | Horizontal::Rates { .. }
            | Horizontal::Damp
            | Horizontal::Nothing => (demand.x, demand.y, self.tan_tilt_max.min(intent.tan_tilt_max)),
        };
        // A throttle stick demands no climb.
        let needed = if matches!(intent.vertical, Vertical::Path | Vertical::Velocity) { up } else { 0.0 };
        let tan_max = tan_max.min(tan_lean_max(self.config.thrust_max / self.config.mass, needed));
        let length = math::sqrt(x * x + y * y);
        let scale = if length > tan_max * up { tan_max * up / length } else { 1.0 };
        Vec3::new(x * scale, y * scale, -up)
    }
}

impl Controller for GeometricController {
    // A vehicle that can choose has another one in its place most of the time.
    #[inline(never)]
    fn follow(&mut self, now: Instant, intent: Option<Intent>, input: &ControlInput<'_>) -> ControlOutput {
        let dt = self.timer.step(now);
        if input.flight_status.control_resets != self.resets {
            self.resets = input.flight_status.control_resets;
            self.reset();
        }
        let Some(intent) = intent else {
            self.reset();
            return ControlOutput::default();
        };
        let config = self.config;
        let force = self.specific_force(&intent, input, dt);
        let tilt_known = !matches!(intent.horizontal, Horizontal::Damp | Horizontal::Nothing);
        let estimate = input.estimate;
        let rotation = Matrix3::from(if tilt_known { estimate.attitude } else { Quat::identity() });
        let down = rotation * Vec3::z();

        let hover = config.mass * GRAVITY;
        let thrust = match intent.vertical {
            // Equation (15): the demanded force, as far as it lies along the body's axis.
            Vertical::Path | Vertical::Velocity => -config.mass * force.dot(&down),
            Vertical::Throttle(throttle) => throttle * config.thrust_max,
            Vertical::Descend => 0.96 * hover,
        };
        // A pilot's thrust is the pilot's.
        let limited = !matches!(intent.vertical, Vertical::Throttle(_));
        let ceiling = if limited { input.land_detected.thrust_ceiling } else { f32::MAX };
        let thrust = possible_thrust(thrust, config.thrust_max, ceiling, hover);

        let (heading, yaw_rate) = match intent.heading {
            Heading::Hold { yaw, rate } => {
                let (sin, cos) = math::sin_cos(0.5 * yaw);
                ((cos, sin), rate)
            }
            Heading::Rate(rate) => (attitude::half_heading(&estimate.attitude), rate),
            Heading::Stick(stick) => (attitude::half_heading(&estimate.attitude), stick * config.sticks.yaw_rate_max),
        };
        let omega = estimate.angular_rate;
        let (error, omega_target) = match intent.horizontal {
            Horizontal::Nothing => return ControlOutput { thrust, torque: Vec3::zeros() },
            Horizontal::Damp => (Vec3::zeros(), Vec3::zeros()),
            Horizontal::Rates { forward, right } => {
                let reach = config.sticks.tilt_rate_max;
                (Vec3::zeros(), Vec3::new(right * reach, -forward * reach, yaw_rate))
            }
            Horizontal::Path | Horizontal::Velocity | Horizontal::Lean { .. } => {
                let wanted = Matrix3::from(attitude::from_down_axis(&-force.normalize(), heading));
                let back = rotation.transpose();
                (attitude_error(&(back * wanted)), back * Vec3::z() * yaw_rate)
            }
        };
        // Equation (16) with the inertia factored out of the gains. The path's own angular acceleration is left out:
        // it needs the fourth derivative of the position, which a jerk-limited path does not have.
        let rate_error = omega - omega_target;
        let [tilt, heading] = config.attitude;
        let [tilt_rate, heading_rate] = config.rate;
        let wanted = -Vec3::new(
            tilt * error.x + tilt_rate * rate_error.x,
            tilt * error.y + tilt_rate * rate_error.y,
            heading * error.z + heading_rate * rate_error.z,
        );
        let inertia = config.inertia;
        let torque = inertia.component_mul(&wanted) + omega.cross(&inertia.component_mul(&omega));
        let max = config.torque_max;
        let torque = torque.zip_map(&max, |t, max| if t.is_finite() { symmetric(t, max) } else { 0.0 });
        ControlOutput { thrust, torque }
    }

    fn reset(&mut self) {
        self.integral = Vec3::zeros();
    }
}

/// ½ (R_dᵀR − RᵀR_d)^∨ for RᵀR_d: equation (10).
fn attitude_error(in_body: &Matrix3<f32>) -> Vec3 {
    0.5 * Vec3::new(in_body.m23 - in_body.m32, in_body.m31 - in_body.m13, in_body.m12 - in_body.m21)
}
