//! A vehicle that publishes what a test says and notes what services ask of it.
#![allow(dead_code, reason = "each test uses a part")]

use stampfly_flight::newest::{NewestSamples, longest_message};
use stampfly_flight::parameters::{ParameterError, ParameterInfo, Parameters};
use stampfly_services::{Cockpit, Lease, Places, Refusal, Request, Seat, View};
use stampfly_types::messages::{FlightPhase, FlightStatus, GuidedCommand, PilotInput, StateEstimate, Validity};
use stampfly_types::{Instant, Message};

pub mod topics {
    use stampfly_types::messages::*;
    stampfly_bus::topics! {
        outside sensors, stack, services;
        /// Inertial sample.
        sensor_imu: ImuData = latest @ 400 Hz from sensors => [services];
        /// Range.
        sensor_tof: TofData = latest @ 30 Hz from sensors => [services];
        /// Flow.
        sensor_flow: FlowData = latest @ 100 Hz from sensors => [services];
        /// Battery.
        sensor_power: PowerData = latest @ 14 Hz from sensors => [services];
        /// Estimate.
        estimate_state: StateEstimate = latest @ 400 Hz from stack => [services];
        /// State.
        flight_status: FlightStatus = latest @ 400 Hz from stack => [services];
        /// Alerts.
        system_alert: SystemAlert = latest @ 400 Hz from stack => [services];
        /// Set-point.
        setpoint: Setpoint = latest @ 400 Hz from stack => [services];
        /// Duties.
        actuator_motor: MotorOutput = latest @ 400 Hz from stack => [services];
    }
}

pub use topics::Id;

type Newest = NewestSamples<{ topics::COUNT }, { longest_message(&topics::TOPICS) }>;

/// Two parameters, one with a name that MAVLink has no room for.
#[derive(Debug)]
pub struct Two(pub [f32; 2]);

const NAMES: [&str; 2] = ["gain", "a.name.that.is.longer.than.sixteen"];

impl Parameters for Two {
    fn describe(&self, index: usize) -> Option<ParameterInfo<'_>> {
        let name = NAMES.get(index)?;
        Some(ParameterInfo { name, unit: "1", min: 0.0, max: 10.0, meaning: "" })
    }
    fn get(&self, index: usize) -> Option<f32> {
        self.0.get(index).copied()
    }
    fn set(&mut self, index: usize, value: f32) -> Result<(), ParameterError> {
        if !(0.0..=10.0).contains(&value) {
            return Err(ParameterError::OutOfRange { min: 0.0, max: 10.0 });
        }
        self.0[index] = value;
        Ok(())
    }
}

/// The vehicle.
pub struct Vehicle {
    newest: Newest,
    places: Places,
    pub lease: Lease,
    pub parameters: Two,
    pub guided: Vec<GuidedCommand>,
    pub steered: Vec<PilotInput>,
    pub alive: Vec<Seat>,
    pub requests: Vec<Request>,
}

impl Vehicle {
    /// Standing, ready to arm, at the origin.
    pub fn standing() -> Self {
        let mut vehicle = Self {
            newest: Newest::new(),
            places: Places::of(&topics::TOPICS),
            lease: Lease::new(),
            parameters: Two([1.0, 2.0]),
            guided: Vec::new(),
            steered: Vec::new(),
            alive: Vec::new(),
            requests: Vec::new(),
        };
        vehicle.status(|status| status.phase = FlightPhase::IdleGround);
        let valid = Validity::TILT | Validity::POSITION_XY | Validity::POSITION_Z;
        vehicle.publish(Id::estimate_state, &StateEstimate { valid, ..Default::default() });
        vehicle
    }

    /// Flying, at the origin.
    pub fn flying() -> Self {
        let mut vehicle = Self::standing();
        vehicle.status(|status| (status.phase, status.armed) = (FlightPhase::Flying, true));
        vehicle
    }

    pub fn publish<M: Message>(&mut self, id: Id, message: &M) {
        self.newest.note(id as usize, Instant::ZERO, message.to_words().as_ref());
    }

    pub fn publish_at<M: Message>(&mut self, at: Instant, id: Id, message: &M) {
        self.newest.note(id as usize, at, message.to_words().as_ref());
    }

    pub fn status(&mut self, change: impl FnOnce(&mut FlightStatus)) {
        let mut status = self.view().state();
        change(&mut status);
        self.publish(Id::flight_status, &status);
    }
}

impl Cockpit for Vehicle {
    fn view(&self) -> View<'_> {
        View::new(&self.newest, &self.places)
    }
    fn guide(&mut self, now: Instant, seat: Seat, command: GuidedCommand) -> Result<(), Refusal> {
        self.lease.ask(now, seat, &command)?;
        self.guided.push(command);
        Ok(())
    }
    fn steer(&mut self, _: Instant, _: Seat, input: &PilotInput) -> Result<(), Refusal> {
        self.steered.push(*input);
        Ok(())
    }
    fn alive(&mut self, now: Instant, seat: Seat) {
        self.lease.alive(now, seat);
        self.alive.push(seat);
    }
    fn parameters(&mut self) -> &mut dyn Parameters {
        &mut self.parameters
    }
    fn request(&mut self, _: Instant, request: Request) -> Result<(), Refusal> {
        self.requests.push(request);
        Ok(())
    }
}
