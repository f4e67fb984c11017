//! A conventional aeroplane: wing, tail, one electric propeller, servos, three wheels, ground and
//! wind.
//!
//! Six degrees of freedom, integrated as for the quadrotor. The aerodynamics are a table of
//! dimensionless derivatives, [`AeroplaneParameters`], given by the vehicle's crate. The example
//! has the published derivatives of the University of Minnesota's Ultra Stick 25e at 0.27 of its
//! mass, so it flies at about half of its speeds and stalls at 5 m/s; this aeroplane does not
//! exist. Use [`Aeroplane`] alone to study the vehicle, and a [`World`](crate::World) to add
//! sensors. Not for spins, aerobatics at large angles of attack, or flexible structures.

mod aerodynamics;
mod gear;
mod parameters;
mod propeller;
mod servos;
mod trim;

pub use gear::Gear;
pub use parameters::AeroplaneParameters;
pub use propeller::Propeller;
pub use servos::{SURFACES, Surface};
pub use trim::{Trim, TrimError};

use super::{Airframe, Battery, Body, DT, Disturbance, Motion, Pose, ROTORS};
use super::{RotorFault, Wind, WindConfig};
use crate::conditions::Conditions;
use crate::noise::{Noise, Stream};
use aerodynamics::{Flow, Warp};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use servos::Servos;

/// Standard deviations of the asymmetry about roll, pitch and yaw: the effect of some tenths of a
/// degree of aileron, elevator and rudder.
const WARP: [f64; 3] = [0.0006, 0.003, 0.0006];

/// An aeroplane in its surroundings.
///
/// ```
/// use stampfly_sim::plant::{Aeroplane, AeroplaneParameters, WindConfig};
///
/// let parameters = AeroplaneParameters { manufacturing_spread: 0.0, ..AeroplaneParameters::EXAMPLE };
/// let cruise = Aeroplane::trim(&parameters, 10.0, 0.0)?;
/// let mut plane = Aeroplane::new(&parameters, &WindConfig::CALM, Some(&cruise.pose(50.0, 0.0)), 1);
/// plane.settle(&cruise);
/// for _ in 0..1600 {
///     plane.set_duty(cruise.voltage / plane.battery().voltage());
///     plane.step();
/// }
/// assert!((plane.airspeed() - 10.0).abs() < 0.1 && (plane.motion().position.z + 50.0).abs() < 0.1);
/// # Ok::<(), stampfly_sim::plant::TrimError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Aeroplane {
    parameters: AeroplaneParameters,
    inertia: Matrix3<f64>,
    inverse: Matrix3<f64>,
    warp: Warp,
    motion: Motion,
    propeller: Propeller,
    servos: Servos,
    battery: Battery,
    gear: Gear,
    wind: Wind,
}

impl Aeroplane {
    /// An aeroplane at `pose`; `None` places it on the runway at the origin, facing north.
    /// [`Pose::rotors`] is the propeller speed relative to its nominal speed.
    #[must_use]
    pub fn new(parameters: &AeroplaneParameters, wind: &WindConfig, pose: Option<&Pose>, seed: u64) -> Self {
        let p = parameters;
        let mut noise = Noise::stream(seed, Stream::Airframe);
        let standing = p.standing([0.0; 2], 0.0);
        let pose = pose.unwrap_or(&standing);
        let speed = pose.rotors * p.propeller_nominal_speed;
        let xz = p.inertia_xz;
        let inertia = Matrix3::new(p.inertia_x, 0.0, -xz, 0.0, p.inertia_y, 0.0, -xz, 0.0, p.inertia_z);
        let motion = Motion {
            position: pose.position,
            velocity: pose.velocity,
            attitude: pose.attitude,
            rate: pose.rate,
            specific_force: pose.attitude.inverse_transform_vector(&Vector3::new(0.0, 0.0, -p.gravity)),
            angular_acceleration: Vector3::zeros(),
            rotor_speed: [speed, 0.0, 0.0, 0.0],
            current: p.board_current,
        };
        Self {
            inertia,
            // A singular tensor, possible with a large product of inertia, disables rotation.
            inverse: inertia.try_inverse().unwrap_or_else(Matrix3::zeros),
            warp: Warp(WARP.map(|deviation| deviation * p.manufacturing_spread * noise.normal())),
            motion,
            propeller: Propeller::new(p, speed),
            servos: Servos::new(p),
            battery: Battery::new(&p.battery(), p.board_current),
            gear: Gear::new(p),
            wind: Wind::new(wind, DT, Noise::stream(seed, Stream::Wind)),
            parameters: p.clone(),
        }
    }

    /// Steady straight flight at this airspeed, m/s, on a path with this angle of climb, rad.
    ///
    /// # Errors
    /// If the aeroplane cannot fly this way.
    pub fn trim(parameters: &AeroplaneParameters, airspeed: f64, path: f64) -> Result<Trim, TrimError> {
        Trim::find(parameters, airspeed, path)
    }

    /// Sets surfaces, without delay, and duty cycle to those of a trimmed flight, for a start in
    /// the air.
    pub fn settle(&mut self, trim: &Trim) {
        self.servos.command(trim.surfaces);
        self.servos.settle();
        self.set_duty(trim.voltage / self.battery.voltage().max(1.0));
    }

    /// Sets the duty cycle of the motor, 0 to 1.
    pub fn set_duty(&mut self, duty: f64) {
        self.propeller.set_duty(duty);
    }

    /// Commands the servos, in shares of the largest deflection, −1 to 1, in the order of
    /// [`Surface`].
    pub fn set_surfaces(&mut self, shares: [f64; SURFACES]) {
        self.servos.command(shares);
    }

    /// Jams a servo at a share of its largest deflection, or releases it.
    pub fn jam(&mut self, surface: Surface, at: Option<f64>) {
        self.servos.jam(surface, at);
    }

    /// Positions of the servos, in shares of the largest deflection.
    #[must_use]
    pub fn surfaces(&self) -> [f64; SURFACES] {
        self.servos.position()
    }

    /// Advances by one [`STEP`](super::STEP).
    pub fn step(&mut self) {
        self.wind.step();
        self.servos.step();
        let (p, m) = (&self.parameters, &self.motion);
        let shares = self.servos.position();
        let reaches = [p.reach_aileron, p.reach_aileron, p.reach_elevator, p.reach_rudder, p.reach_flap, 0.0];
        let angles = core::array::from_fn(|i| shares[i] * reaches[i]);
        let air = self.through_air();

        // Tested before the step, so that a propeller in contact gives no thrust in this step.
        let held = self.gear.holds_propeller(&m.position, &m.attitude);
        let voltage = self.battery.under(p.board_current, &[self.propeller.load()]);
        let thrust = self.propeller.step(DT, voltage, air.x, held);
        let current = thrust.current + p.board_current;
        self.battery.step(DT, current);
        let (mut force, mut torque) =
            aerodynamics::loads(p, &self.warp, &air, &m.rate, &angles, -m.position.z + p.tips_above);
        force.x += thrust.thrust;
        torque += Vector3::new(thrust.torque, thrust.thrust * p.propeller_below, 0.0);
        // A positive rudder turns the nose left and steering is positive to the right, hence the
        // sign.
        let steering = -shares[Surface::Rudder as usize] * p.steering_reach;
        let brake = shares[Surface::Brake as usize];
        let (ground_force, ground_torque) =
            self.gear.push(&m.position, &m.velocity, &m.attitude, &m.rate, steering, brake);
        force += m.attitude.inverse_transform_vector(&ground_force);
        torque += ground_torque;

        // Gyroscopic torque at the half step, as for the quadrotor.
        let acceleration = |rate: &Vector3<f64>| {
            let momentum = self.inertia * rate + Vector3::new(thrust.momentum, 0.0, 0.0);
            self.inverse * (torque - rate.cross(&momentum))
        };
        let angular_acceleration = acceleration(&(m.rate + acceleration(&m.rate) * (0.5 * DT)));
        let gravity = p.gravity;
        self.motion.specific_force = force / p.mass;
        self.motion.angular_acceleration = angular_acceleration;
        self.motion.advance(DT, gravity);
        self.motion.rotor_speed[0] = self.propeller.speed();
        self.motion.current = current;
    }

    /// Velocity through the air, body FRD, m/s.
    fn through_air(&self) -> Vector3<f64> {
        let m = &self.motion;
        m.attitude.inverse_transform_vector(&(m.velocity - self.wind.velocity(-m.position.z)))
    }

    /// Speed through the air, m/s.
    #[must_use]
    pub fn airspeed(&self) -> f64 {
        self.through_air().norm()
    }

    /// Angle of attack, rad.
    #[must_use]
    pub fn alpha(&self) -> f64 {
        Flow::of(&self.through_air()).alpha
    }

    /// Sideslip, rad, positive with the air from the right.
    #[must_use]
    pub fn beta(&self) -> f64 {
        Flow::of(&self.through_air()).beta
    }

    /// Position, attitude and their derivatives.
    #[must_use]
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Motor and propeller.
    #[must_use]
    pub fn propeller(&self) -> &Propeller {
        &self.propeller
    }

    /// The battery.
    #[must_use]
    pub fn battery(&self) -> &Battery {
        &self.battery
    }

    /// The contact model of undercarriage and airframe.
    #[must_use]
    pub fn gear(&self) -> &Gear {
        &self.gear
    }

    /// Wind and gusts.
    #[must_use]
    pub fn wind(&self) -> &Wind {
        &self.wind
    }

    /// The parameters.
    #[must_use]
    pub fn parameters(&self) -> &AeroplaneParameters {
        &self.parameters
    }
}

impl AeroplaneParameters {
    /// Standing on the runway at this position, world north and east, m, with this heading, rad,
    /// motor off.
    #[must_use]
    pub fn standing(&self, [north, east]: [f64; 2], heading: f64) -> Pose {
        let (sin, cos) = libm::sincos(0.5 * heading);
        Pose {
            position: Vector3::new(north, east, -self.gear_height),
            velocity: Vector3::zeros(),
            attitude: UnitQuaternion::new_normalize(Quaternion::new(cos, 0.0, 0.0, sin)),
            rate: Vector3::zeros(),
            rotors: 0.0,
        }
    }
}

impl Body for Aeroplane {
    fn step(&mut self) {
        Self::step(self);
    }

    fn motion(&self) -> &Motion {
        Self::motion(self)
    }

    fn gravity(&self) -> f64 {
        self.parameters.gravity
    }

    fn air(&self, height: f64) -> Vector3<f64> {
        self.wind.velocity(height)
    }

    fn air_density(&self) -> f64 {
        self.parameters.air_density
    }

    fn battery(&self) -> &Battery {
        Self::battery(self)
    }

    fn contact(&self) -> bool {
        self.gear.contact()
    }

    fn scrapes(&self) -> u64 {
        self.gear.scrapes()
    }

    fn nominal_rotor_speed(&self) -> f64 {
        self.parameters.propeller_nominal_speed
    }

    fn idle_current(&self) -> f64 {
        self.parameters.board_current
    }

    fn disturbance(&self) -> Disturbance {
        let p = &self.parameters;
        // The model divides the pressure by the number of a quadrotor's rotors; an aeroplane has
        // one.
        Disturbance { field: [p.field_x, p.field_y, p.field_z], wash: p.static_wash * ROTORS as f64 }
    }

    /// Uses the first value.
    fn set_duty(&mut self, [duty, ..]: [f64; ROTORS]) {
        Self::set_duty(self, duty);
    }

    fn set_rotor_fault(&mut self, rotor: usize, fault: RotorFault) {
        if rotor == 0 {
            self.propeller.set_fault(fault);
        }
    }
}

impl Airframe for AeroplaneParameters {
    type Body = Aeroplane;

    fn body(&self, wind: &WindConfig, pose: Option<&Pose>, seed: u64) -> Aeroplane {
        Aeroplane::new(self, wind, pose, seed)
    }

    fn under(&self, conditions: &Conditions, _seed: u64) -> Self {
        Self::under(self, conditions)
    }
}
