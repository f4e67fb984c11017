//! A quadcopter of its own: rigid body, first-order motors, drag, wind, ground. Written from the equations of motion
//! and sharing nothing with the controllers, so that an error here and an error there do not cancel.
//!
//! Drag overstates what air does to a vehicle of this mass several times, so that gusts hit hard.

use std::collections::VecDeque;

use stampfly_control::{Airframe, ControlInput, Controller, Mixed, Mixer, MultirotorMixer};
use stampfly_types::messages::{
    CommandSetpoint, ControlOutput, FlightMode, FlightPhase, FlightStatus, GroundContact, LandDetected, Setpoint,
    StateEstimate, Validity,
};
use stampfly_types::{Duration, GRAVITY, Instant, Quat, Vec3, math};

/// The airframe the gains are derived from.
pub const AIRFRAME: Airframe = Airframe::EXAMPLE;
/// Drag over air speed squared, N/(m/s)².
const DRAG: f32 = 2.7 * AIRFRAME.mass;
/// Drag torque over angular rate squared, N·m/(rad/s)², about the axis of least inertia.
const TURNING_DRAG: f32 = 6e-4;

/// What can differ from the vehicle the gains were chosen for.
#[derive(Clone, Copy, Debug)]
pub struct Vehicle {
    pub mass: f32,
    pub inertia: Vec3,
    pub motor_lag: f32,
    /// Delay of measurements, control periods.
    pub delay: usize,
    /// Amplitude of the noise on rates, rad/s, velocity, m/s, and position, m.
    pub noise: [f32; 3],
    /// Thrust of each motor over what was commanded.
    pub motor_gain: [f32; 4],
}

impl Default for Vehicle {
    fn default() -> Self {
        Self {
            mass: AIRFRAME.mass,
            inertia: AIRFRAME.inertia,
            motor_lag: AIRFRAME.motor_lag,
            // 3 ms of filter and one period of computing, rounded up.
            delay: 2,
            noise: [0.0; 3],
            motor_gain: [1.0; 4],
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub struct State {
    pub position: Vec3,
    pub velocity: Vec3,
    pub attitude: Quat,
    pub rate: Vec3,
    pub thrust: [f32; 4],
}

/// One vehicle under one controller.
pub struct Flight<C> {
    pub vehicle: Vehicle,
    pub controller: C,
    pub state: State,
    pub now: Instant,
    pub flight_status: FlightStatus,
    pub land_detected: LandDetected,
    pub command: CommandSetpoint,
    pub setpoint: Setpoint,
    pub valid: Validity,
    pub wind: Vec3,
    pub output: ControlOutput,
    pub mixed: Mixed,
    mixer: MultirotorMixer,
    history: VecDeque<StateEstimate>,
    specific_force: Vec3,
    random: u32,
}

pub const PERIOD: Duration = Duration::from_micros(2_500);
const SUBSTEPS: u32 = 5;

impl<C: Controller> Flight<C> {
    /// Hovering at 1 m over the origin.
    pub fn hovering(controller: C, vehicle: Vehicle) -> Self {
        let thrust = [vehicle.mass * GRAVITY / 4.0; 4];
        let mut flight = Self::standing(controller, vehicle);
        flight.state.position.z = -1.0;
        flight.state.thrust = thrust;
        flight.flight_status.phase = FlightPhase::Flying;
        flight.land_detected.contact = GroundContact::Air;
        flight.setpoint.position.z = -1.0;
        flight
    }

    /// Standing on the ground at the origin, armed and about to take off.
    pub fn standing(controller: C, vehicle: Vehicle) -> Self {
        use stampfly_types::messages::SetpointAxes as Axes;
        Self {
            vehicle,
            controller,
            state: State {
                position: Vec3::zeros(),
                velocity: Vec3::zeros(),
                attitude: Quat::identity(),
                rate: Vec3::zeros(),
                thrust: [0.0; 4],
            },
            now: Instant::from_secs(5),
            flight_status: FlightStatus {
                phase: FlightPhase::TakeOff,
                mode: FlightMode::PosHold,
                armed: true,
                ..FlightStatus::default()
            },
            land_detected: LandDetected { thrust_ceiling: f32::MAX, ..LandDetected::default() },
            command: CommandSetpoint::default(),
            setpoint: Setpoint { axes: Axes::POSITION_XY | Axes::POSITION_Z | Axes::YAW, ..Setpoint::default() },
            valid: Validity::ALL,
            wind: Vec3::zeros(),
            output: ControlOutput::default(),
            mixed: Mixed::default(),
            mixer: MultirotorMixer::for_airframe(&AIRFRAME).expect("flies"),
            history: VecDeque::new(),
            specific_force: Vec3::new(0.0, 0.0, -GRAVITY),
            random: 12345,
        }
    }

    /// The newest estimate that has reached the controller.
    pub fn estimate(&self) -> StateEstimate {
        self.history.front().copied().unwrap_or_else(|| self.measure())
    }

    /// One control period.
    pub fn step(&mut self) {
        let measured = self.noisy();
        self.history.push_back(measured);
        if self.history.len() > 1 + self.vehicle.delay {
            self.history.pop_front();
        }
        let estimate = self.estimate();
        let input = ControlInput {
            estimate: &estimate,
            command: &self.command,
            setpoint: &self.setpoint,
            flight_status: &self.flight_status,
            land_detected: &self.land_detected,
            unmet: self.mixed.unmet,
        };
        self.output = self.controller.step(self.now, &input);
        assert!(
            self.output.thrust.is_finite() && self.output.torque.iter().all(|t| t.is_finite()),
            "{:?} from {input:?}",
            self.output
        );
        self.mixed = self.mixer.mix(&self.output);
        for _ in 0..SUBSTEPS {
            self.integrate(PERIOD.seconds() / SUBSTEPS as f32);
        }
        self.now += PERIOD;
    }

    /// Steps for `seconds` and gives each state to `watch`.
    pub fn fly(&mut self, seconds: f32, mut watch: impl FnMut(&mut Self)) {
        for _ in 0..(seconds / PERIOD.seconds()).round() as u32 {
            self.step();
            watch(self);
        }
    }

    fn measure(&self) -> StateEstimate {
        StateEstimate {
            attitude: self.state.attitude,
            position: self.state.position,
            velocity: self.state.velocity,
            angular_rate: self.state.rate,
            specific_force: self.specific_force,
            height: -self.state.position.z,
            valid: self.valid,
            ..StateEstimate::default()
        }
    }

    fn noisy(&mut self) -> StateEstimate {
        let mut estimate = self.measure();
        let [rate, velocity, position] = self.vehicle.noise;
        estimate.angular_rate += self.random_vector() * rate;
        estimate.velocity += self.random_vector() * velocity;
        estimate.position += self.random_vector() * position;
        estimate
    }

    /// Uniform in a cube of standard deviation one per axis; a linear congruential generator is random enough here.
    pub fn random_vector(&mut self) -> Vec3 {
        let mut next = || {
            self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((self.random >> 8) as f32 / (1 << 23) as f32 - 1.0) * 1.732
        };
        Vec3::new(next(), next(), next())
    }

    fn integrate(&mut self, dt: f32) {
        let body = &mut self.state;
        let mut force = 0.0;
        let mut torque = Vec3::zeros();
        for (n, rotor) in AIRFRAME.rotors.iter().enumerate() {
            let wanted = self.mixed.thrust[n] * self.vehicle.motor_gain[n];
            body.thrust[n] += (wanted - body.thrust[n]) * (dt / self.vehicle.motor_lag);
            let thrust = body.thrust[n];
            force += thrust;
            torque += Vec3::new(-rotor.y * thrust, rotor.x * thrust, rotor.yaw_arm() * thrust);
        }
        let airspeed = body.velocity - self.wind;
        let drag = -airspeed * DRAG * airspeed.norm();
        let push = body.attitude * Vec3::new(0.0, 0.0, -force) + drag;
        let acceleration = push / self.vehicle.mass + Vec3::new(0.0, 0.0, GRAVITY);
        self.specific_force = body.attitude.inverse() * (push / self.vehicle.mass);
        let on_ground = body.position.z >= 0.0;
        if on_ground && acceleration.z > 0.0 {
            // The ground carries the rest and holds the feet.
            body.velocity = Vec3::zeros();
            body.position.z = 0.0;
            body.rate = Vec3::zeros();
            return;
        }
        body.velocity += acceleration * dt;
        body.position += body.velocity * dt;
        let momentum = self.vehicle.inertia.component_mul(&body.rate);
        let turning = (torque - body.rate.cross(&momentum) - body.rate * (TURNING_DRAG * body.rate.norm()))
            .component_div(&self.vehicle.inertia);
        body.rate += turning * dt;
        body.attitude *= Quat::from_scaled_axis(body.rate * dt);
        body.attitude = body.attitude.normalize();
    }
}

/// Wind that wanders: first-order noise of 0.8 s correlation whose speed has the given root mean square.
pub fn gust<C: Controller>(flight: &mut Flight<C>, speed: f32) {
    const SHARE: f32 = 0.0025 / 0.8;
    let kick = flight.random_vector();
    flight.wind += -flight.wind * SHARE + kick * (speed * math::sqrt(2.0 / 3.0 * SHARE));
}

/// Root mean square and largest magnitude of a series.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spread {
    sum: f64,
    count: u32,
    pub largest: f32,
}

impl Spread {
    pub fn add(&mut self, value: f32) {
        self.sum += f64::from(value) * f64::from(value);
        self.count += 1;
        self.largest = self.largest.max(value.abs());
    }

    pub fn rms(&self) -> f32 {
        (self.sum / f64::from(self.count.max(1))).sqrt() as f32
    }
}
