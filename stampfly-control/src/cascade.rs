//! The default controller: a cascade of loops, each one file.
//!
//! ```text
//! set-point ─► position ─► acceleration ─┐
//! set-point ─► altitude ─► thrust        ├─► attitude ─► body rate ─► torque
//! sticks ────────────────► lean, rates ──┘
//! ```
//!
//! All loops run every step. The path's derivatives are fed forward at every level they reach (velocity, acceleration,
//! and the rate at which the acceleration turns the vehicle), so that following a path needs no error to begin with.
//!
//! The innermost loop is exchangeable: anything that is a [`RateLaw`]. [`RateController`] is the default,
//! [`IndiController`](crate::IndiController) the same cascade around another one.

use stampfly_types::messages::{ControlOutput, FlightPhase};
use stampfly_types::{GRAVITY, Instant, Quat, Vec3, math};

use crate::airframe::Airframe;
use crate::altitude::{AltitudeConfig, AltitudeController, Climb, ThrustLimits};
use crate::answer::Answer;
use crate::attitude::{self, AttitudeConfig};
use crate::bound::symmetric;
use crate::controller::{ControlInput, Controller};
use crate::intent::{Heading, Horizontal, Intent, Vertical};
use crate::position::{PositionConfig, PositionController};
use crate::rate::{LEAN, RateConfig, RateController, RateLaw};
use crate::timing::StepTimer;

/// Gains and limits of all loops.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CascadeConfig {
    /// Body rate.
    pub rate: RateConfig,
    /// Attitude.
    pub attitude: AttitudeConfig,
    /// Horizontal position and velocity.
    pub position: PositionConfig,
    /// Height, climb and thrust.
    pub altitude: AltitudeConfig,
    /// What full stick means.
    pub sticks: StickConfig,
}

impl CascadeConfig {
    /// All loops of the airframe; sticks as for any vehicle.
    #[must_use]
    pub fn for_airframe(airframe: &Airframe) -> Self {
        Self {
            rate: RateConfig::for_airframe(airframe),
            attitude: AttitudeConfig::for_airframe(airframe),
            position: PositionConfig::for_airframe(airframe),
            altitude: AltitudeConfig::for_airframe(airframe),
            sticks: StickConfig::default(),
        }
    }
}

/// What full stick means in the modes that command angles or rates.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StickConfig {
    /// Lean at full stick, rad.
    pub lean_max: f32,
    /// Roll and pitch rate at full stick, rad/s.
    pub tilt_rate_max: f32,
    /// Yaw rate at full stick, rad/s.
    pub yaw_rate_max: f32,
}

impl Default for StickConfig {
    fn default() -> Self {
        Self { lean_max: 0.52, tilt_rate_max: 4.0, yaw_rate_max: 2.5 }
    }
}

/// Below this throttle a vehicle under manual thrust that stands on the ground has its motors off.
const THROTTLE_OFF: f32 = 0.03;
/// Deflection of both tilt sticks together below which they rest.
const AT_REST: f32 = 0.1;
/// A path moves by millimetres in a step; one that moves so far, m, has jumped.
const JUMP: f32 = 0.1;

/// The cascade.
///
/// ```
/// use stampfly_control::{Airframe, CascadeConfig, CascadeController, ControlInput, Controller};
/// use stampfly_types::messages::*;
/// use stampfly_types::{Instant, Vec3};
///
/// let mut controller = CascadeController::new(&CascadeConfig::for_airframe(&Airframe::EXAMPLE));
/// let estimate = StateEstimate { valid: Validity::ALL, ..Default::default() };
/// let mode = FlightStatus { phase: FlightPhase::Flying, mode: FlightMode::PosHold, armed: true, ..Default::default() };
/// let land_detected = LandDetected { contact: GroundContact::Air, thrust_ceiling: f32::MAX, ..Default::default() };
/// let setpoint = Setpoint {
///     position: Vec3::new(1.0, 0.0, 0.0),
///     axes: SetpointAxes::POSITION_XY | SetpointAxes::POSITION_Z | SetpointAxes::YAW,
///     ..Default::default()
/// };
/// let input = ControlInput {
///     estimate: &estimate, command: &CommandSetpoint::default(), setpoint: &setpoint, flight_status: &mode, land_detected: &land_detected,
///     unmet: [0.0; 4],
/// };
/// let output = controller.step(Instant::from_micros(2_500), &input);
/// assert!(output.torque.y < 0.0, "nose down to fly forward");
/// assert!((output.thrust - Airframe::EXAMPLE.hover_thrust()).abs() < 0.1, "its weight");
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CascadeController<R = RateController> {
    attitude: AttitudeConfig,
    sticks: StickConfig,
    tan_tilt_max: f32,
    sin_lean_max: f32,
    rate: R,
    position: PositionController,
    altitude: AltitudeController,
    timer: StepTimer,
    resets: u32,
    /// The path's acceleration one step ago, while a path is followed: its difference is the path's jerk.
    path: Option<Vec3>,
    /// Its position one step ago, while that is followed.
    place: Option<Vec3>,
    answer: Answer,
}

impl CascadeController {
    /// A cascade at rest.
    #[must_use]
    pub fn new(config: &CascadeConfig) -> Self {
        Self::with_rate_law(config, RateController::new(&config.rate))
    }

    /// Changes all gains in flight: between two steps, in bounded time. Integrals, filters, the hover thrust as learned and every limit stay as they are,
    /// so the output moves only by what the gains change, and the same gains change nothing, bit for bit.
    pub fn set_gains(&mut self, config: &CascadeConfig) {
        self.set_outer_gains(config);
        self.rate.set_gains(&config.rate);
    }
}

impl<R> CascadeController<R> {
    /// A cascade at rest around this innermost loop; the gains for the default one are not used.
    #[must_use]
    pub fn with_rate_law(config: &CascadeConfig, rate: R) -> Self {
        Self {
            attitude: config.attitude,
            sticks: config.sticks,
            tan_tilt_max: math::tan(config.position.tilt_max),
            sin_lean_max: math::sin(config.sticks.lean_max),
            rate,
            position: PositionController::new(&config.position),
            altitude: AltitudeController::new(&config.altitude),
            timer: StepTimer::default(),
            resets: 0,
            path: None,
            place: None,
            answer: Answer::default(),
        }
    }

    /// Changes the gains around the innermost loop in flight, as [`set_gains`](CascadeController::set_gains) does.
    pub fn set_outer_gains(&mut self, config: &CascadeConfig) {
        self.attitude.tilt_gain = config.attitude.tilt_gain;
        self.attitude.heading_gain = config.attitude.heading_gain;
        self.position.set_gains(&config.position);
        self.altitude.set_gains(&config.altitude);
    }

    /// The innermost loop, to change its gains.
    pub const fn rate_law_mut(&mut self) -> &mut R {
        &mut self.rate
    }

    /// Thrust at hover as learned so far, N.
    #[must_use]
    pub fn hover_thrust(&self) -> f32 {
        self.altitude.hover_thrust()
    }

    fn thrust(&mut self, intent: &Intent, input: &ControlInput<'_>, cos_tilt: f32, dt: f32) -> f32 {
        let limits = ThrustLimits {
            ceiling: input.land_detected.thrust_ceiling,
            unmet: input.unmet[3],
            learn: !intent.grounded && input.land_detected.thrust_ceiling > 1.0,
            // While taking off the ground carries what thrust does not: the integral must be free to find the weight.
            hold: intent.grounded && input.flight_status.phase != FlightPhase::TakeOff,
        };
        let (path, estimate) = (input.setpoint, input.estimate);
        let climb = Climb {
            error: path.position.z - estimate.position.z,
            target: path.velocity.z,
            acceleration: path.acceleration.z,
            velocity: estimate.velocity.z,
            cos_tilt,
        };
        match intent.vertical {
            Vertical::Path => self.altitude.step(&climb, &limits, dt),
            Vertical::Velocity => self.altitude.step(&Climb { error: 0.0, ..climb }, &limits, dt),
            Vertical::Throttle(throttle) => self.altitude.manual(throttle),
            Vertical::Descend => self.altitude.descend(&limits),
        }
    }

    /// The body's z axis that pushes as asked, in the world frame, and the rate at which the path turns it.
    fn down_axis(&mut self, intent: &Intent, input: &ControlInput<'_>, dt: f32) -> (Vec3, Vec3) {
        let (path, estimate) = (input.setpoint, input.estimate);
        let before = self.place.take();
        let error = match intent.horizontal {
            Horizontal::Path => {
                // A path that jumps gives up where the vehicle could not go; what kept it from there may be gone.
                if before.is_some_and(|before| (path.position - before).horizontal().norm_squared() > JUMP * JUMP) {
                    self.position.reset();
                }
                self.place = Some(path.position);
                path.position - estimate.position
            }
            Horizontal::Velocity => Vec3::zeros(),
            Horizontal::Lean { forward, right } => {
                self.path = None;
                self.position.reset();
                let tan = self.altitude.tan_lean_max();
                let sin = tan / math::sqrt(1.0 + tan * tan);
                return (
                    lean(forward, right, math::smaller(self.sin_lean_max, sin), &estimate.attitude),
                    Vec3::zeros(),
                );
            }
            Horizontal::Rates { .. } | Horizontal::Damp | Horizontal::Nothing => {
                self.path = None;
                self.position.reset();
                return (Vec3::z(), Vec3::zeros());
            }
        };
        let ahead = path.acceleration;
        let demand = self.position.step(&error, &path.velocity, &ahead, &estimate.velocity, dt, intent.grounded);
        // Thrust has to carry the weight as well: the axis is the direction of g − a.
        let carried = math::larger(GRAVITY - ahead.z, 0.5 * GRAVITY);
        let per_weight = 1.0 / carried;
        let (mut x, mut y) = (demand.x * per_weight, demand.y * per_weight);
        let slope_squared = x * x + y * y;
        let tan_max =
            math::smaller(math::smaller(self.tan_tilt_max, intent.tan_tilt_max), self.altitude.tan_lean_max());
        if slope_squared > tan_max * tan_max {
            let shorten = tan_max / math::sqrt(slope_squared);
            (x, y) = (x * shorten, y * shorten);
        }
        let scale = 1.0 / math::sqrt(1.0 + x * x + y * y);
        let down = Vec3::new(-x * scale, -y * scale, scale);

        let jerk = self.path.map_or(Vec3::zeros(), |before| (ahead - before) / dt);
        self.path = Some(ahead);
        (down, turn_rate(&jerk, per_weight))
    }
}

impl<R: RateLaw> Controller for CascadeController<R> {
    // By itself for each rate law: a vehicle that can choose keeps the one it flies with in fast memory.
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
        if let Vertical::Throttle(throttle) = intent.vertical
            && throttle < THROTTLE_OFF
            && intent.grounded
        {
            self.reset();
            return ControlOutput::default();
        }

        let estimate = input.estimate;
        let tilt_known = !matches!(intent.horizontal, Horizontal::Damp | Horizontal::Nothing);
        let down_in_body = if tilt_known { attitude::down_in_body(&estimate.attitude) } else { Vec3::z() };
        let thrust = self.thrust(&intent, input, down_in_body.z, dt);
        let (down, turning) = self.down_axis(&intent, input, dt);

        let target = match intent.horizontal {
            Horizontal::Nothing => {
                self.rate.reset();
                return ControlOutput { thrust, torque: Vec3::zeros() };
            }
            Horizontal::Damp => Vec3::zeros(),
            Horizontal::Rates { forward, right } => {
                let yaw = match intent.heading {
                    Heading::Stick(stick) => stick * self.sticks.yaw_rate_max,
                    Heading::Rate(rate) | Heading::Hold { rate, .. } => rate,
                };
                Vec3::new(right * self.sticks.tilt_rate_max, -forward * self.sticks.tilt_rate_max, yaw)
            }
            Horizontal::Path | Horizontal::Velocity | Horizontal::Lean { .. } => {
                let (heading, yaw_rate) = match intent.heading {
                    Heading::Hold { yaw, rate } => {
                        let (sin, cos) = math::sin_cos(0.5 * yaw);
                        ((cos, sin), rate)
                    }
                    Heading::Rate(rate) => (attitude::half_heading(&estimate.attitude), rate),
                    Heading::Stick(stick) => {
                        (attitude::half_heading(&estimate.attitude), stick * self.sticks.yaw_rate_max)
                    }
                };
                let wanted = attitude::from_down_axis(&down, heading);
                let feedback = attitude::rate_towards(&self.attitude, &estimate.attitude, &wanted);
                feedback + down_in_body * yaw_rate + estimate.attitude.inverse_transform_vector(&turning)
            }
        };
        // A load that lies askew lifts one leg first, and its torque has to be found before the
        // others follow, however far the vehicle leans meanwhile. Where a stick asks for the lean, a
        // hand may be what stops it.
        let lifts = input.flight_status.phase == FlightPhase::TakeOff;
        let asked =
            matches!(intent.horizontal, Horizontal::Lean { forward, right } if forward.abs() + right.abs() > AT_REST);
        let trim = if lifts && !asked { f32::MAX } else { LEAN * self.attitude.tilt_gain };
        let free = Intent { grounded: intent.grounded && !lifts, ..intent };
        let [roll, pitch, yaw] = self.answer.step(&free, &target, &estimate.angular_rate, trim, dt);
        let held = [roll, pitch, yaw || intent.grounded];
        let torque = self.rate.step(&target, &estimate.angular_rate, dt, input.unmet, held);
        ControlOutput { thrust, torque }
    }

    fn reset(&mut self) {
        self.rate.reset();
        self.position.reset();
        self.altitude.reset();
        self.path = None;
        self.place = None;
        self.answer = Answer::default();
    }
}

/// The down axis of a vehicle that leans by its sticks, which are relative to its heading.
fn lean(forward: f32, right: f32, sin_max: f32, attitude: &Quat) -> Vec3 {
    let length = math::sqrt(forward * forward + right * right).max(1.0);
    let (forward, right) = (forward / length * sin_max, right / length * sin_max);
    let (cos_half, sin_half) = attitude::half_heading(attitude);
    let (cos, sin) = (cos_half * cos_half - sin_half * sin_half, 2.0 * sin_half * cos_half);
    Vec3::new(
        -(forward * cos - right * sin),
        -(forward * sin + right * cos),
        math::sqrt(1.0 - forward * forward - right * right),
    )
}

/// World-frame rate at which a path with this jerk turns the thrust direction, near level.
///
/// The axis tilts with n = (−aₓ, −a_y, g)/g, so it moves with −jerk/g and turns about ẑ × ṅ. A path that jumps (a mode
/// change) is no path to follow: its jerk is bounded.
fn turn_rate(jerk: &Vec3, per_weight: f32) -> Vec3 {
    const MAX: f32 = 1.5;
    Vec3::new(symmetric(jerk.y * per_weight, MAX), symmetric(-jerk.x * per_weight, MAX), 0.0)
}
