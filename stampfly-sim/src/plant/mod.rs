//! Vehicle dynamics: rigid bodies with motors, a battery, the ground and the air.
//!
//! | part | purpose |
//! |---|---|
//! | [`Plant`], [`PlantParameters`] | a quadrotor in X with brushed motors, indoors |
//! | [`Aeroplane`], [`AeroplaneParameters`] | a conventional aeroplane with one electric propeller, outdoors |
//! | [`Body`], [`Airframe`] | interface of a body in a [`World`](crate::World), and of its parameters |
//! | [`Battery`], [`Wind`] | models shared by all bodies |
//! | [`Scene`] | floor, ceiling, walls and a holding hand around a quadrotor |
//!
//! Translation follows Newton's law in the world frame, rotation Euler's equations in the body
//! frame with the rotors' angular momentum. The step is fixed at [`STEP`] and explicit: of second
//! order for position, attitude and gyroscopic torque, of first order for the forces. At 1600 Hz
//! the integration error is far below the uncertainty of every parameter.
//!
//! Use [`Plant`] alone to study the vehicle; use [`Simulation`](crate::Simulation) to fly it with
//! sensors.

mod aeroplane;
mod air;
mod battery;
mod body;
mod check;
mod ground;
mod lag;
mod motion;
mod motor;
mod parameters;
mod scene;
pub(crate) mod table;
mod wear;
mod wind;

use air::{Air, Push};

pub use aeroplane::{Aeroplane, AeroplaneParameters, Gear, Propeller, SURFACES, Surface, Trim, TrimError};
pub use battery::{Battery, BatterySpec, Load};
pub use body::{Airframe, Body, Disturbance};
pub use check::{CannotSimulate, FullThrottle};
pub use ground::Ground;
pub use motion::Motion;
pub use motor::{ROTORS, RotorFault, Rotors};
pub use parameters::PlantParameters;
pub use scene::{Beyond, Hand, Scene};
pub use wind::{Wind, WindConfig, WindProfile};

use crate::conditions::Conditions;
use crate::noise::{Noise, Stream};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use stampfly_types::Duration;

/// Length of one physics step: 1/1600 s.
pub const STEP: Duration = Duration::from_micros(625);

/// [`STEP`] in seconds.
pub(crate) const DT: f64 = 625e-6;

/// Standard gravity, m/s²: the default of a [`Body`].
pub const GRAVITY: f64 = 9.806_65;

/// Initial pose and motion of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// World NED, m.
    pub position: Vector3<f64>,
    /// World NED, m/s.
    pub velocity: Vector3<f64>,
    /// Body FRD → world NED.
    pub attitude: UnitQuaternion<f64>,
    /// Body FRD, rad/s.
    pub rate: Vector3<f64>,
    /// Rotor speeds relative to hover speed: 1 for a start in the air.
    pub rotors: f64,
}

/// A quadrotor in its surroundings.
///
/// ```
/// use stampfly_sim::plant::{Plant, PlantParameters, Pose, WindConfig};
///
/// // One second at full power from a hover.
/// let pose = Pose::hovering(1.0);
/// let parameters = PlantParameters { manufacturing_spread: 0.0, ..PlantParameters::EXAMPLE };
/// let mut plant = Plant::new(&parameters, &WindConfig::CALM, Some(&pose), 1);
/// plant.set_duty([1.0; 4]);
/// for _ in 0..1600 {
///     plant.step();
/// }
/// assert!(plant.motion().position.z < -3.0, "z points down");
/// assert!(plant.battery().voltage() < plant.battery().open_circuit());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    parameters: PlantParameters,
    inertia: Vector3<f64>,
    motion: Motion,
    rotors: Rotors,
    battery: Battery,
    ground: Ground,
    wind: Wind,
    /// Aerodynamic effects enabled by the conditions.
    air: Option<Air>,
    scene: Scene,
}

impl Plant {
    /// A vehicle at `pose` under neutral conditions; `None` places it on the floor at the origin,
    /// facing north. `seed` draws its specimen and the gusts.
    #[must_use]
    pub fn new(parameters: &PlantParameters, wind: &WindConfig, pose: Option<&Pose>, seed: u64) -> Self {
        Self::under(parameters, &Conditions::GENTLE, wind, pose, seed)
    }

    /// As [`new`](Self::new), under these conditions.
    #[must_use]
    pub fn under(
        parameters: &PlantParameters,
        conditions: &Conditions,
        wind: &WindConfig,
        pose: Option<&Pose>,
        seed: u64,
    ) -> Self {
        let p = &parameters.under(conditions, seed);
        let mut rotors = Rotors::new(p, conditions, seed);
        let standing = Pose::standing(p, 0.0);
        let pose = pose.unwrap_or(&standing);
        rotors.set_speed([pose.rotors * rotors.hover_speed(); ROTORS]);
        let motion = Motion {
            position: pose.position,
            velocity: pose.velocity,
            attitude: pose.attitude,
            rate: pose.rate,
            specific_force: pose.attitude.inverse_transform_vector(&Vector3::new(0.0, 0.0, -p.gravity)),
            angular_acceleration: Vector3::zeros(),
            rotor_speed: rotors.speed(),
            current: p.board_current,
        };
        Self {
            inertia: Vector3::new(p.inertia_x, p.inertia_y, p.inertia_z),
            motion,
            rotors,
            battery: Battery::new(&p.battery(), p.board_current),
            ground: Ground::new(p),
            wind: Wind::new(wind, DT, Noise::stream(seed, Stream::Wind)),
            air: Air::new(p, conditions, seed),
            parameters: p.clone(),
            scene: Scene::under(conditions),
        }
    }

    /// Sets the duty cycles of the motors, 0 to 1: front right, rear right, rear left, front left.
    pub fn set_duty(&mut self, duty: [f64; ROTORS]) {
        self.rotors.set_duty(duty);
    }

    /// Sets the fault of a rotor; rotors count from 0 in motor order.
    pub fn set_rotor_fault(&mut self, rotor: usize, fault: RotorFault) {
        self.rotors.set_fault(rotor, fault);
    }

    /// Advances by one [`STEP`].
    pub fn step(&mut self) {
        let p = &self.parameters;
        let m = &self.motion;
        self.wind.step();
        // Ground effect by the height of the floor directly below, so an edge acts at once.
        let mut lift = self.ground.lift(self.scene.floor(&m.position) - m.position.z);
        if let Some(air) = &self.air {
            lift *= air.lift(m, &self.scene);
        }
        let held = self.ground.held(&m.position, &m.attitude, &self.scene);
        // Before the rotor step, with the back-EMF of the present speeds: voltage and currents are
        // consistent within the step.
        let voltage = self.battery.under(p.board_current, &self.rotors.loads());
        let loads = self.rotors.step(DT, voltage, lift, held);
        let current = loads.current + p.board_current;
        self.battery.step(DT, current);

        // Rotors have a drag linear in airspeed and rotor speed, the body a quadratic one.
        let speed = m.rotor_speed;
        // Mean rotor speed relative to hover.
        let share = (speed[0] + speed[1] + speed[2] + speed[3]) / (ROTORS as f64 * self.rotors.hover_speed());
        // Height above the level floor; steps are neglected.
        let mut wind = self.wind.velocity(-m.position.z);
        if let Some(air) = &mut self.air {
            wind += air.wind(share);
        }
        // Velocity through the air in body axes, in which the drag coefficients are given.
        let air = m.attitude.inverse_transform_vector(&(m.velocity - wind));
        let linear = Vector3::new(p.drag_horizontal, p.drag_horizontal, p.drag_vertical) * share;
        let drag = -(air.component_mul(&linear) + air * (p.drag_quadratic * air.norm()));

        let (mut floor_force, mut floor_torque) =
            self.ground.push(&m.position, &m.velocity, &m.attitude, &m.rate, &self.scene);
        // The hand acts like a contact force of the floor: force in world axes, torque in body
        // axes.
        if self.scene.hand.is_some() {
            let (force, torque) = self.scene.hold(m);
            floor_force += force;
            floor_torque += torque;
        }
        let mut body_force =
            drag + Vector3::new(0.0, 0.0, -loads.thrust) + m.attitude.inverse_transform_vector(&floor_force);
        if let Some(Push { force, torque }) = self.air.as_mut().map(|effects| effects.push(m, &self.scene, &air, share))
        {
            body_force += force;
            floor_torque += torque;
        }
        let specific_force = body_force / p.mass;

        // Rolling and pitching move the rotors along their axes, which damps like climbing does.
        let arm = p.rotor_offset * p.rotor_offset * p.drag_vertical * share;
        let damping = Vector3::new(arm * m.rate.x, arm * m.rate.y, 0.0) + m.rate * (p.drag_rotation * m.rate.norm());
        let torque = loads.torque + floor_torque - damping;
        // Evaluating the gyroscopic torque at the half step preserves the energy of a spinning
        // body.
        let acceleration = |rate: &Vector3<f64>| {
            let momentum = self.inertia.component_mul(rate) + Vector3::new(0.0, 0.0, loads.momentum_z);
            (torque - rate.cross(&momentum)).component_div(&self.inertia)
        };
        let angular_acceleration = acceleration(&(m.rate + acceleration(&m.rate) * (0.5 * DT)));

        // Forces first, then integration: `advance` reads both accelerations from the motion.
        self.motion.specific_force = specific_force;
        self.motion.angular_acceleration = angular_acceleration;
        self.motion.advance(DT, p.gravity);
        self.motion.rotor_speed = self.rotors.speed();
        self.motion.current = current;
    }

    /// Position, attitude and their derivatives.
    #[must_use]
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// The motors with their propellers.
    #[must_use]
    pub fn rotors(&self) -> &Rotors {
        &self.rotors
    }

    /// The battery.
    #[must_use]
    pub fn battery(&self) -> &Battery {
        &self.battery
    }

    /// The contact model of the floor.
    #[must_use]
    pub fn ground(&self) -> &Ground {
        &self.ground
    }

    /// The scene around the vehicle.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene around the vehicle, for changes between two steps.
    pub fn scene_mut(&mut self) -> &mut Scene {
        &mut self.scene
    }

    /// Velocity of the air at this height above the ground, m, including the wake recirculating in
    /// a small room; world NED, m/s.
    #[must_use]
    pub fn air(&self, height: f64) -> Vector3<f64> {
        let wind = self.wind.velocity(height);
        self.air.as_ref().map_or(wind, |air| wind + air.returning())
    }

    /// Wind and gusts, without recirculation.
    #[must_use]
    pub fn wind(&self) -> &Wind {
        &self.wind
    }

    /// The parameters of this specimen under its conditions.
    #[must_use]
    pub fn parameters(&self) -> &PlantParameters {
        &self.parameters
    }
}

impl Pose {
    /// Standing on the floor at the origin with this heading, rad, motors off.
    #[must_use]
    pub fn standing(parameters: &PlantParameters, yaw: f64) -> Self {
        let (sin, cos) = libm::sincos(0.5 * yaw);
        Self {
            position: Vector3::new(0.0, 0.0, -parameters.ground_height),
            velocity: Vector3::zeros(),
            attitude: UnitQuaternion::new_normalize(Quaternion::new(cos, 0.0, 0.0, sin)),
            rate: Vector3::zeros(),
            rotors: 0.0,
        }
    }

    /// Hovering at this height above the floor, m, facing north.
    #[must_use]
    pub fn hovering(height: f64) -> Self {
        Self {
            position: Vector3::new(0.0, 0.0, -height),
            velocity: Vector3::zeros(),
            attitude: UnitQuaternion::identity(),
            rate: Vector3::zeros(),
            rotors: 1.0,
        }
    }
}
