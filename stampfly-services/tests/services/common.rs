//! A vehicle that publishes what a test says and notes what services ask of it.

use core::fmt;
use stampfly_bus::TopicInfo;
use stampfly_flight::console::{self, CommandError, SensorLine};
use stampfly_flight::newest::{NewestSamples, longest_message};
use stampfly_flight::profile::Rows;
use stampfly_param::{Conflict, ParameterError, ParameterInfo, Parameters};
use stampfly_services::{CommandNotice, Connection, Lease, Places, Refusal, Request, Requester, VehicleAccess, View};
use stampfly_types::messages::{
    CommandSource, FlightPhase, FlightStatus, GuidedCommand, PilotInput, StateEstimate, Validity,
};
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
        /// Refusals to arm.
        arm_refusals: ArmRefusals = latest @ on event from stack => [services];
        /// Alerts.
        system_alert: SystemAlert = latest @ 400 Hz from stack => [services];
        /// Set-point.
        setpoint: Setpoint = latest @ 400 Hz from stack => [services];
        /// Duties.
        actuator_motor: MotorOutput = latest @ 400 Hz from stack => [services];
        /// A calibration.
        calibration_report: CalibrationReport = latest @ on event from stack => [services];
    }
}

pub use topics::Id;

pub type Newest = NewestSamples<{ topics::COUNT }, { longest_message(&topics::TOPICS) }>;

/// Two parameters, one with a name that MAVLink has no room for.
#[derive(Debug)]
pub struct Two(pub [f32; 2]);

const NAMES: [&str; 2] = ["gain", "a.name.that.is.longer.than.sixteen"];

impl Parameters for Two {
    fn describe(&self, index: usize) -> Option<ParameterInfo<'_>> {
        let name = NAMES.get(index)?;
        Some(ParameterInfo { name, unit: "1", min: 0.0, max: 10.0, meaning: "", in_flight: index == 0 })
    }
    fn get(&self, index: usize) -> Option<f32> {
        self.0.get(index).copied()
    }
    fn set(&mut self, index: usize, value: f32) -> Result<(), ParameterError> {
        let parameter = self.0.get_mut(index).ok_or(ParameterError::Unknown)?;
        if !(0.0..=10.0).contains(&value) {
            return Err(ParameterError::OutOfRange { min: 0.0, max: 10.0 });
        }
        *parameter = value;
        Ok(())
    }
    fn check(&self, _: Option<usize>) -> Result<(), ParameterError> {
        let conflict = ParameterError::Conflict(Conflict {
            parameters: NAMES,
            reason: "seven and nine never fly together, on no day",
        });
        if self.0 == [7.0, 9.0] { Err(conflict) } else { Ok(()) }
    }
}

/// The console of the vehicle: parameters, and a command that only the board can do.
pub struct Board<'b>(pub &'b mut Two, pub bool);

impl console::Vehicle for Board<'_> {
    type Command = core::convert::Infallible;
    type Request = core::convert::Infallible;
    const COMMANDS: &'static [(&'static str, &'static str)] = &[];
    const TOPICS: &'static [TopicInfo] = &topics::TOPICS;
    fn is_armed(&self) -> Option<bool> {
        Some(self.1)
    }
    fn version(&self) -> &str {
        "µ 1.0"
    }
    fn status(&self, _: Instant, reply: &mut dyn fmt::Write) -> fmt::Result {
        (0..40).try_for_each(|line| write!(reply, "line {line} of µ\r\n"))
    }
    fn newest(&self, _: usize) -> Option<(Instant, &[u32])> {
        None
    }
    fn sensors(&self) -> &[SensorLine<'_>] {
        &[]
    }
    fn profile(&self) -> Rows<'_> {
        Rows::default()
    }
    fn parameters(&mut self) -> &mut dyn Parameters {
        self.0
    }
    fn parse(_: &[&str]) -> Result<Self::Command, CommandError> {
        Err(CommandError::Unknown)
    }
    fn answer(
        &mut self,
        command: Self::Command,
        _: Instant,
        _: &mut dyn fmt::Write,
    ) -> Result<Option<Self::Request>, fmt::Error> {
        match command {}
    }
}

/// The vehicle.
pub struct Vehicle {
    newest: Newest,
    places: Places,
    pub lease: Lease,
    pub connections: Connection,
    pub parameters: Two,
    pub guided: Vec<GuidedCommand>,
    pub steered: Vec<PilotInput>,
    pub alive: Vec<Requester>,
    pub requests: Vec<Request>,
    pub told: Vec<CommandNotice>,
}

impl Vehicle {
    /// Standing, ready to arm, at the origin.
    pub fn standing() -> Self {
        let mut vehicle = Self {
            newest: Newest::new(),
            places: Places::of(&topics::TOPICS),
            lease: Lease::new(),
            connections: 0,
            parameters: Two([1.0, 2.0]),
            guided: Vec::new(),
            steered: Vec::new(),
            alive: Vec::new(),
            requests: Vec::new(),
            told: Vec::new(),
        };
        vehicle.status(|status| status.phase = FlightPhase::IdleGround);
        let valid = Validity::TILT | Validity::POSITION_XY | Validity::POSITION_Z;
        vehicle.publish(Id::estimate_state, &StateEstimate { valid, ..Default::default() });
        vehicle
    }

    /// Flying at the origin, for a program.
    pub fn flying() -> Self {
        let mut vehicle = Self::standing();
        vehicle.status(|status| {
            (status.phase, status.armed, status.commander) = (FlightPhase::Flying, true, CommandSource::Guided);
        });
        vehicle
    }

    /// A copy of what it has published.
    pub fn samples(&self) -> Newest {
        self.newest.clone()
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

impl VehicleAccess for Vehicle {
    fn view(&self) -> View<'_> {
        View::new(&self.newest, &self.places)
    }
    fn guide(&mut self, now: Instant, requester: Requester, command: GuidedCommand) -> Result<(), Refusal> {
        self.lease.ask(now, requester, &command)?;
        self.guided.push(command);
        Ok(())
    }
    fn connection(&mut self) -> Connection {
        self.connections += 1;
        self.connections
    }
    fn told(&self, after: u32) -> Option<(u32, CommandNotice)> {
        self.told.get(after as usize).map(|told| (after + 1, *told))
    }
    fn leave(&mut self, has_left: &dyn Fn(Requester) -> bool) {
        self.lease.leave(has_left);
    }
    fn steer(&mut self, now: Instant, requester: Requester, input: &PilotInput) -> Result<(), Refusal> {
        self.lease.steer(now, requester)?;
        self.steered.push(*input);
        Ok(())
    }
    fn alive(&mut self, now: Instant, requester: Requester) {
        self.lease.alive(now, requester);
        self.alive.push(requester);
    }
    fn parameters(&mut self) -> &mut dyn Parameters {
        &mut self.parameters
    }
    fn request(&mut self, _: Instant, request: Request) -> Result<(), Refusal> {
        self.requests.push(request);
        Ok(())
    }
}
