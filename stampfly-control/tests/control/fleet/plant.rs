//! A rigid body under any rotors and any loop rate: first-order motors, drag, 3 ms of sensor delay. It flies in the air only and
//! knows nothing of the controllers, so an error here and an error there do not cancel.

use std::collections::VecDeque;

use stampfly_control::{Airframe, ControlInput, Controller, Mixed, Mixer, MultirotorMixer};
use stampfly_types::messages::{
    CommandSetpoint, FlightMode, FlightPhase, FlightStatus, GroundContact, LandDetected, Setpoint, SetpointAxes,
    StateEstimate, Validity,
};
use stampfly_types::{Duration, GRAVITY, Instant, Quat, Vec3};

/// Delay of the measurements: a filter's 3 ms.
const DELAY: u64 = 3_000;
/// Drag over speed, 1/s: some tenths for vehicles of any size.
const DRAG: f32 = 0.25;

/// What the vehicle has of what its airframe says, and how often it is controlled.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    pub mass: f32,
    pub inertia: f32,
    pub lag: f32,
    /// Control period and integration step, us: the one is a multiple of the other.
    pub period: u64,
    pub step: u64,
}

/// As the airframe says, at 400 Hz.
pub const NOMINAL: Truth = Truth { mass: 1.0, inertia: 1.0, lag: 1.0, period: 2_500, step: 500 };

/// One vehicle in the air.
pub struct Body<C> {
    airframe: Airframe,
    truth: Truth,
    controller: C,
    mixer: MultirotorMixer,
    pub position: Vec3,
    pub velocity: Vec3,
    pub attitude: Quat,
    pub rate: Vec3,
    thrust: [f32; 8],
    mixed: Mixed,
    pub setpoint: Setpoint,
    /// A way forward, m, that takes so many seconds from this instant, us.
    way: Option<(f32, f32, u64)>,
    history: VecDeque<StateEstimate>,
    now: u64,
}

impl<C: Controller> Body<C> {
    /// Hovering over the origin at 10 m, motors at the thrust that carries it.
    pub fn new(airframe: &Airframe, truth: Truth, controller: C) -> Self {
        let share = truth.mass * airframe.hover_thrust() / airframe.rotors.len() as f32;
        let position = Vec3::new(0.0, 0.0, -10.0);
        Self {
            airframe: *airframe,
            truth,
            controller,
            mixer: MultirotorMixer::for_airframe(airframe).expect("it can be controlled"),
            position,
            velocity: Vec3::zeros(),
            attitude: Quat::identity(),
            rate: Vec3::zeros(),
            thrust: [share; 8],
            mixed: Mixed::default(),
            setpoint: Setpoint {
                position,
                axes: SetpointAxes::POSITION_XY | SetpointAxes::POSITION_Z | SetpointAxes::YAW,
                ..Setpoint::default()
            },
            way: None,
            history: VecDeque::new(),
            now: 0,
        }
    }

    /// Sends it so far forward: at once, or along the path of least jerk.
    pub fn send(&mut self, distance: f32, seconds: f32) {
        if seconds > 0.0 {
            self.way = Some((distance, seconds, self.now));
        } else {
            self.setpoint.position.x = distance;
        }
    }

    /// The polynomial of fifth order from rest to rest, and its derivatives.
    fn guide(&mut self) {
        let Some((distance, seconds, start)) = self.way else { return };
        let t = ((self.now - start) as f32 * 1e-6 / seconds).min(1.0);
        self.setpoint.position.x = distance * t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
        self.setpoint.velocity.x = distance / seconds * 30.0 * t * t * (1.0 - t) * (1.0 - t);
        self.setpoint.acceleration.x = distance / (seconds * seconds) * 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t);
    }

    /// Flies for so many seconds and shows every control period.
    pub fn fly(&mut self, seconds: f32, mut watch: impl FnMut(&Self)) {
        let end = self.now + (seconds * 1e6) as u64;
        while self.now < end {
            self.history.push_back(StateEstimate {
                attitude: self.attitude,
                position: self.position,
                velocity: self.velocity,
                angular_rate: self.rate,
                height: -self.position.z,
                valid: Validity::ALL,
                ..StateEstimate::default()
            });
            if self.history.len() > 1 + (DELAY / self.truth.step) as usize {
                self.history.pop_front();
            }
            if self.now.is_multiple_of(self.truth.period) {
                self.control();
                watch(self);
            }
            self.integrate(Duration::from_micros(self.truth.step).seconds());
            self.now += self.truth.step;
        }
    }

    fn control(&mut self) {
        self.guide();
        let estimate = self.history.front().copied().unwrap_or_default();
        let output = self.controller.step(
            Instant::from_micros(1_000_000 + self.now),
            &ControlInput {
                estimate: &estimate,
                command: &CommandSetpoint::default(),
                setpoint: &self.setpoint,
                flight_status: &FlightStatus {
                    phase: FlightPhase::Flying,
                    mode: FlightMode::PosHold,
                    armed: true,
                    ..FlightStatus::default()
                },
                land_detected: &LandDetected {
                    contact: GroundContact::Air,
                    thrust_ceiling: f32::MAX,
                    ..LandDetected::default()
                },
                unmet: self.mixed.unmet,
            },
        );
        self.mixed = self.mixer.mix(&output);
    }

    fn integrate(&mut self, dt: f32) {
        let (mut force, mut torque) = (0.0, Vec3::zeros());
        let lag = self.truth.lag * self.airframe.motor_lag;
        let decay = lag / (lag + dt);
        for ((rotor, wanted), thrust) in self.airframe.rotors.iter().zip(self.mixed.thrust).zip(&mut self.thrust) {
            *thrust = wanted + (*thrust - wanted) * decay;
            force += *thrust;
            torque += Vec3::new(-rotor.y, rotor.x, rotor.yaw_arm()) * *thrust;
        }
        let mass = self.truth.mass * self.airframe.mass;
        let inertia = self.truth.inertia * self.airframe.inertia;
        let push = self.attitude * Vec3::new(0.0, 0.0, -force / mass);
        let acceleration = push - self.velocity * DRAG + Vec3::new(0.0, 0.0, GRAVITY);
        self.velocity += acceleration * dt;
        self.position += self.velocity * dt;
        let turning = torque - self.rate.cross(&inertia.component_mul(&self.rate));
        self.rate += turning.component_div(&inertia) * dt;
        self.attitude *= Quat::from_scaled_axis(self.rate * dt);
        self.attitude = self.attitude.normalize();
    }
}
