//! The rover's components in the order of the document, without topics: what a test needs to drive a whole vehicle.

use stampfly_rover::diag::{self, Signals};
use stampfly_rover::driver_input::{DriverSelector, DriverSources};
use stampfly_rover::messages::*;
use stampfly_rover::safety::{COMPONENTS, PERIOD, SafetyInput, SafetySupervisor};
use stampfly_rover::{Parameters, models};
use stampfly_types::{Duration, Instant};

pub const TICK: Duration = Duration::from_millis(10);

/// What happens to a vehicle in one tick.
#[derive(Clone, Copy, Default)]
pub struct Events {
    pub operator: OperatorCommand,
    /// A line of a log.
    pub replay: Option<LogRecord>,
    /// Components that do not run.
    pub dead: Components,
}

/// All components with what they remember.
#[derive(Clone, Default)]
pub struct Rover {
    pub parameters: Parameters,
    pub signals: Signals,
    pub safety: SafetyStatus,
    pub now: Instant,
    selector: DriverSelector,
    supervisor: SafetySupervisor,
    heartbeats: [u32; COMPONENTS.len()],
    last_check: Option<Instant>,
    heard: SafetyInput,
    faulty: bool,
}

impl Rover {
    /// One tick of 10 ms. The supervisor runs every 100 ms and whenever the operator's buttons or the log change.
    pub fn tick(&mut self, events: &Events) -> LogRecord {
        let Self { parameters, signals, .. } = self;
        let runs = |component| !events.dead.contains(component);
        for (beats, component) in self.heartbeats.iter_mut().zip(COMPONENTS) {
            *beats += u32::from(runs(component));
        }
        let replayed = events.replay.map_or_else(Default::default, |record| (record.estop, record.system_state));
        let heard = SafetyInput {
            heartbeats: self.heard.heartbeats,
            faulty: self.faulty,
            estop: events.operator.estop,
            reset: events.operator.reset,
            replayed,
        };
        let due = self.last_check.is_none_or(|last| self.now.since(last) >= PERIOD);
        if due || heard != self.heard {
            self.heard = heard;
            self.last_check = Some(self.now);
            let input = SafetyInput { heartbeats: self.heartbeats, ..heard };
            self.safety = self.supervisor.step(self.now, &input, &parameters.safety);
        }
        let estop = self.safety.must_stop(self.last_check.map(|at| self.now.since(at)), &parameters.safety);
        let sources = DriverSources {
            operator: events.operator,
            operator_age: Some(Duration::ZERO),
            replay: events.replay.as_ref().map(LogRecord::driver_input),
            speed: signals.state.v,
            system_state: self.safety.system_state,
        };
        signals.input = self.selector.step(self.now, &sources, &parameters.input);
        if runs(Components::ENGINE) {
            let acceleration = models::drive_acceleration(signals.input.throttle, estop, &parameters.engine);
            signals.drive = DriveCommand { acceleration };
        }
        if runs(Components::BRAKE) {
            let deceleration = models::brake_deceleration(signals.input.brake, estop, &parameters.brake);
            signals.brake = BrakeCommand { deceleration };
        }
        if runs(Components::STEERING) {
            let target = models::steering_target(signals.input.steer, estop, &parameters.steering);
            let angle = models::step_steering(signals.steering.angle, target, TICK, &parameters.steering);
            signals.steering = SteeringCommand { angle };
        }
        self.now += TICK;
        if runs(Components::DYNAMICS) {
            let (drive, brake) = (signals.drive.acceleration, signals.brake.deceleration);
            let state = models::step_longitudinal(&signals.state, TICK, drive, brake, estop, &parameters.vehicle);
            let state = models::step_lateral(&state, TICK, signals.steering.angle, &parameters.vehicle);
            signals.state = VehicleState { t: self.now.seconds_f64() as f32, ..state };
        }
        self.faulty = !diag::check(signals, parameters).is_empty();
        let commands = (&signals.drive, &signals.brake, &signals.steering);
        LogRecord::new(&signals.input, commands, &signals.state, &self.safety)
    }
}

/// The operator's command with these pedals and this wheel.
pub fn manual(throttle: f32, brake: f32, steer: f32) -> OperatorCommand {
    OperatorCommand { throttle, brake, steer, ..OperatorCommand::default() }
}

/// A fresh vehicle, driven by `events` for a number of ticks.
pub fn run(ticks: usize, mut events: impl FnMut(usize, &mut Rover) -> Events) -> Vec<LogRecord> {
    let mut rover = Rover::default();
    (0..ticks)
        .map(|tick| {
            let events = events(tick, &mut rover);
            rover.tick(&events)
        })
        .collect()
}
