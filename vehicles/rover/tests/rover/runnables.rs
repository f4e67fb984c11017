//! Each runnable by itself, on a mock of the runtime environment: which signals it reads, and what it writes.

use stampfly_flight::Mock;
use stampfly_param::{ParameterAction, ParameterRequest, ParameterStatus};
use stampfly_rover::messages::*;
use stampfly_rover::topics::Bus;
use stampfly_rover::{Parameters, Runnables};
use stampfly_types::{Instant, Message};

const NOW: Instant = Instant::from_millis(1_000);

/// Runs one runnable on these signals, and returns what it writes.
struct Bench<'b>(Mock<'b, Runnables>);

impl<'b> Bench<'b> {
    fn new(bus: &'b mut Bus) -> Self {
        Self(Mock::new(bus, &Parameters::default()))
    }

    /// A vehicle whose supervisor finds everything in order.
    fn normal(bus: &'b mut Bus) -> Self {
        Self::new(bus).with("safety_status", SafetyStatus::default())
    }

    fn with<M: Message>(mut self, topic: &str, message: M) -> Self {
        self.0.publish(topic, NOW, &message).expect("a topic of this message");
        self
    }

    fn writes<M: Message>(&mut self, runnable: &str, topic: &str) -> Option<M> {
        let before = self.0.newest::<M>(topic).map_or(0, |sample| sample.generation);
        self.0.run(runnable, NOW).expect("a runnable");
        self.0
            .newest::<M>(topic)
            .filter(|sample| sample.generation > before && sample.at == NOW)
            .map(|sample| sample.data)
    }
}

const INPUT: DriverInput = DriverInput { throttle: 0.5, brake: 0.25, steer: 1.0 };
const ESTOP: SafetyStatus = SafetyStatus { estop: false, system_state: SystemState::EStop, stalled: Components::NONE };

#[test]
fn engine_reads_throttle_and_writes_acceleration() {
    let accel = |bench: Bench<'_>| {
        let mut bench = bench.with("driver_input", INPUT);
        bench.writes::<DriveCommand>("engine", "drive_command").expect("a command").acceleration
    };
    assert_eq!(accel(Bench::normal(&mut Bus::new())), 1.0, "the document's example");
    assert_eq!(accel(Bench::new(&mut Bus::new()).with("safety_status", ESTOP)), 0.0);
    assert_eq!(accel(Bench::new(&mut Bus::new())), 0.0, "no supervisor, no drive");
    let mut parameters = Parameters::default();
    parameters.engine.max_accel = 3.0;
    assert_eq!(accel(Bench::normal(&mut Bus::new()).with("parameters", parameters)), 1.5);
}

#[test]
fn engine_passes_on_the_other_process_and_is_silent_with_it() {
    let mut bus = Bus::new();
    let remote = DriveCommand { acceleration: 0.7 };
    let mut bench = Bench::normal(&mut bus).with("driver_input", INPUT).with("remote_drive", remote);
    assert_eq!(bench.writes("engine", "drive_command"), Some(remote));
    assert_eq!(bench.writes::<DriveCommand>("engine", "drive_command"), None, "nothing new, no heartbeat");
    let (mut bench, none) = (bench.with("safety_status", ESTOP), Some(DriveCommand { acceleration: 0.0 }));
    assert_eq!(bench.writes("engine", "drive_command"), none, "lets go of what it held");
    assert_eq!(bench.writes::<DriveCommand>("engine", "drive_command"), None, "and that is no heartbeat");
    let mut bench = bench.with("remote_drive", remote);
    assert_eq!(bench.writes("engine", "drive_command"), none, "EStop is above it");
}

#[test]
fn com_is_silent_when_a_component_is_not_heard() {
    let mut bus = Bus::new();
    let mut bench = Bench::new(&mut bus);
    assert_eq!(bench.writes("com", "com_status"), Some(ComStatus { heard: Components::NONE }), "none is expected");
    let mut bench = bench.with("remote_drive", DriveCommand::default());
    assert_eq!(bench.writes("com", "com_status"), Some(ComStatus { heard: Components::ENGINE }));
    assert_eq!(bench.writes::<ComStatus>("com", "com_status"), None);
}

#[test]
fn brake_reads_pedal_and_writes_deceleration() {
    let (mut bus, mut stopped) = (Bus::new(), Bus::new());
    let mut bench = Bench::normal(&mut bus).with("driver_input", INPUT);
    assert_eq!(bench.writes("brake", "brake_command"), Some(BrakeCommand { deceleration: 1.0 }));
    let mut bench = Bench::new(&mut stopped).with("driver_input", INPUT).with("safety_status", ESTOP);
    assert_eq!(bench.writes("brake", "brake_command"), Some(BrakeCommand { deceleration: 4.0 }));
}

#[test]
fn steering_reads_the_wheel_and_follows_with_its_lag() {
    let mut bus = Bus::new();
    let mut bench = Bench::normal(&mut bus).with("driver_input", INPUT);
    let mut angle = || bench.writes::<SteeringCommand>("steering", "steering_command").expect("a command").angle;
    assert!((angle() - 0.025_797_206).abs() < 1e-6, "the document's value");
    let second = angle();
    assert!(second > 0.049 && second < 0.4);
    let mut bench = bench.with("safety_status", ESTOP);
    let stopped = bench.writes::<SteeringCommand>("steering", "steering_command").expect("a command").angle;
    assert!(stopped < second, "back to the centre");
}

#[test]
fn dynamics_read_commands_and_write_motion() {
    let moves = |bench: Bench<'_>| {
        let mut bench = bench.with("drive_command", DriveCommand { acceleration: 1.0 });
        bench.writes::<VehicleState>("vehicle_dynamics", "vehicle_state").expect("a state")
    };
    let state = moves(Bench::normal(&mut Bus::new()));
    assert!((state.v - 0.01).abs() < 1e-7 && state.t == 1.0);
    assert_eq!(moves(Bench::new(&mut Bus::new()).with("safety_status", ESTOP)).v, 0.0);
}

#[test]
fn supervisor_reads_buttons_faults_and_heartbeats() {
    let state = |mut bench: Bench<'_>| {
        bench.writes::<SafetyStatus>("safety_supervisor", "safety_status").expect("a status").system_state
    };
    let pressed = OperatorCommand { estop: true, ..OperatorCommand::default() };
    let fault = DiagStatus { faults: Faults::SPEED, seen: Faults::SPEED };
    assert_eq!(state(Bench::new(&mut Bus::new())), SystemState::Normal);
    assert_eq!(state(Bench::new(&mut Bus::new()).with("operator_command", pressed)), SystemState::EStop);
    assert_eq!(state(Bench::new(&mut Bus::new()).with("diag_status", fault)), SystemState::Degraded);
    let record = LogRecord { system_state: SystemState::Degraded, ..LogRecord::default() };
    let replays = OperatorCommand { mode: InputMode::Replay, ..OperatorCommand::default() };
    let replay = |mode| {
        let mut bus = Bus::new();
        state(Bench::new(&mut bus).with("operator_command", mode).with("replay_record", record))
    };
    assert_eq!(replay(replays), SystemState::Degraded);
    assert_eq!(replay(OperatorCommand::default()), SystemState::Normal, "not in a replay");
}

#[test]
fn driver_input_limits_speed_and_steering_while_degraded() {
    let mut bus = Bus::new();
    let operator = OperatorCommand { throttle: 1.0, steer: 1.0, ..OperatorCommand::default() };
    let degraded = SafetyStatus { system_state: SystemState::Degraded, ..SafetyStatus::default() };
    let fast = VehicleState { v: 2.0, ..VehicleState::default() };
    let mut bench = Bench::new(&mut bus).with("operator_command", operator);
    let free = DriverInput { throttle: 1.0, brake: 0.0, steer: 1.0 };
    assert_eq!(bench.writes("driver_input", "driver_input"), Some(free));
    let mut bench = bench.with("safety_status", degraded).with("vehicle_state", fast);
    let limited = DriverInput { throttle: 0.0, brake: 1.0, steer: 0.5 };
    assert_eq!(bench.writes("driver_input", "driver_input"), Some(limited));
}

#[test]
fn nvm_takes_valid_requests_and_counts_the_others() {
    let mut bus = Bus::new();
    let mut bench = Bench::new(&mut bus);
    assert_eq!(bench.writes("nvm", "parameters"), Some(Parameters::default()));
    assert_eq!(bench.writes::<Parameters>("nvm", "parameters"), None, "only when they change");
    let request = |action, value| ParameterRequest { action, index: 0, value };
    let bench = bench.with("parameter_request", request(ParameterAction::Set, 99.0));
    let bench = bench.with("parameter_request", request(ParameterAction::Set, 1.0));
    let mut bench = bench.with("parameter_request", request(ParameterAction::Apply, 0.0));
    let changed: Parameters = bench.writes("nvm", "parameters").expect("a change");
    assert_eq!(changed.engine.max_accel, 1.0);
    let status = bench.0.newest::<ParameterStatus>("parameter_status").expect("a status").data;
    assert_eq!((status.version, status.refused, status.applied_at), (1, 1, NOW));
    let mut bench = bench.with("diag_status", DiagStatus { faults: Faults::DRIVE, seen: Faults::DRIVE });
    assert_eq!(bench.writes("nvm", "parameters"), Some(Parameters::default()), "rolled back");
}

#[test]
fn logging_writes_one_line_of_every_signal() {
    let mut bus = Bus::new();
    let state = VehicleState { t: 1.0, v: 2.0, x: 3.0, y: 4.0, yaw: 5.0, yaw_rate: 6.0, wheel_omega: 7.0 };
    let (drive, brake) = (DriveCommand { acceleration: 8.0 }, BrakeCommand { deceleration: 9.0 });
    let bench = Bench::new(&mut bus).with("driver_input", INPUT).with("vehicle_state", state);
    let bench = bench.with("drive_command", drive).with("brake_command", brake).with("safety_status", ESTOP);
    let steering = SteeringCommand { angle: 0.1 };
    let mut bench = bench.with("steering_command", steering);
    let line = bench.writes::<LogRecord>("logging", "log_record");
    assert_eq!(line, Some(LogRecord::new(&INPUT, (&drive, &brake, &steering), &state, &ESTOP)));
}

#[test]
fn diag_names_the_fault_and_remembers_it() {
    let mut bus = Bus::new();
    let mut bench = Bench::new(&mut bus).with("drive_command", DriveCommand { acceleration: 5.0 });
    let found = |faults| Some(DiagStatus { faults, seen: Faults::DRIVE });
    assert_eq!(bench.writes("diag", "diag_status"), found(Faults::DRIVE));
    let mut bench = bench.with("drive_command", DriveCommand::default());
    assert_eq!(bench.writes("diag", "diag_status"), found(Faults::NONE));
}
