//! Each component by itself: supervisor, driver's input, diagnosis, table of parameters.

use proptest::prelude::*;
use stampfly_param::ParameterTable;
use stampfly_param::parameters::validate;
use stampfly_rover::Parameters;
use stampfly_rover::diag::{Signals, check};
use stampfly_rover::driver_input::{DriverSelector, DriverSources, demo};
use stampfly_rover::messages::*;
use stampfly_rover::safety::{SafetyInput, SafetySupervisor};
use stampfly_types::{Duration, Instant};

fn at(millis: u64) -> Instant {
    Instant::from_millis(millis)
}

/// A supervisor that is stepped every 100 ms with heartbeats of the components that live.
struct Bench {
    supervisor: SafetySupervisor,
    parameters: Parameters,
    checks: u64,
    beats: [u32; 6],
}

impl Bench {
    fn new() -> Self {
        let (supervisor, parameters) = (SafetySupervisor::default(), Parameters::default());
        Self { supervisor, parameters, checks: 0, beats: [0; 6] }
    }

    fn check(&mut self, dead: Components, input: SafetyInput) -> SafetyStatus {
        for (beats, component) in self.beats.iter_mut().zip(Components::EACH) {
            *beats = beats.wrapping_add(u32::from(!dead.contains(*component)));
        }
        self.checks += 1;
        let input = SafetyInput { heartbeats: self.beats, ..input };
        self.supervisor.step(at(100 * self.checks), &input, &self.parameters.safety)
    }

    fn checks(&mut self, count: usize, dead: Components) -> SafetyStatus {
        (0..count).map(|_| self.check(dead, SafetyInput::default())).last().expect("at least one")
    }
}

const RESET: SafetyInput = SafetyInput {
    heartbeats: [0; 6],
    faulty: false,
    estop: false,
    reset: true,
    replayed: (false, SystemState::Normal),
};

#[test]
fn each_component_is_supervised() {
    for component in Components::EACH.iter().copied() {
        let mut bench = Bench::new();
        assert_eq!(bench.checks(20, Components::NONE), SafetyStatus::default());
        let status = bench.checks(3, component);
        assert_eq!((status.system_state, status.stalled), (SystemState::Degraded, component));
    }
}

#[test]
fn heartbeat_counters_may_wrap() {
    let mut bench = Bench { beats: [u32::MAX - 5; 6], ..Bench::new() };
    assert_eq!(bench.checks(20, Components::NONE).system_state, SystemState::Normal);
}

#[test]
fn components_have_their_timeout_to_start_in() {
    let mut bench = Bench::new();
    assert_eq!(bench.checks(2, Components::ALL).system_state, SystemState::Normal);
    assert_eq!(bench.checks(1, Components::ALL).system_state, SystemState::EStop);
}

#[test]
fn timeouts_are_parameters_of_each_component() {
    let mut bench = Bench::new();
    bench.parameters.safety.engine_timeout = 1.0;
    bench.checks(1, Components::NONE);
    let states: Vec<_> = (0..12).map(|_| bench.checks(1, Components::ENGINE).system_state).collect();
    let noticed = states.iter().position(|state| *state == SystemState::Degraded);
    assert_eq!(noticed, Some(8), "900 ms after it was seen for the last time, so within 1 s");
}

#[test]
fn degraded_and_emergency_stop_are_latched() {
    let mut bench = Bench::new();
    bench.checks(1, Components::NONE);
    bench.checks(5, Components::ENGINE);
    let recovered = bench.checks(5, Components::NONE);
    assert_eq!((recovered.system_state, recovered.stalled), (SystemState::Degraded, Components::NONE));
    bench.checks(5, Components::ENGINE | Components::BRAKE);
    assert_eq!(bench.checks(5, Components::NONE).system_state, SystemState::EStop);
    assert_eq!(bench.check(Components::NONE, RESET).system_state, SystemState::Normal);
}

#[test]
fn a_reset_does_not_hide_what_is_still_wrong() {
    let two = Components::ENGINE | Components::BRAKE;
    let mut bench = Bench::new();
    bench.checks(5, two);
    assert_eq!(bench.check(two, RESET).system_state, SystemState::EStop);
    bench.checks(1, Components::ENGINE);
    assert_eq!(bench.check(Components::ENGINE, RESET).system_state, SystemState::Degraded, "one is back");
    let both = SafetyInput { estop: true, ..RESET };
    bench.checks(1, Components::NONE);
    assert_eq!(bench.check(Components::NONE, both).system_state, SystemState::EStop, "the stop wins");
}

#[test]
fn holding_the_reset_does_not_defeat_the_latch() {
    let mut bench = Bench::new();
    bench.check(Components::NONE, RESET);
    bench.check(Components::NONE, SafetyInput { estop: true, ..RESET });
    assert_eq!(bench.check(Components::NONE, RESET).system_state, SystemState::EStop);
    bench.checks(1, Components::NONE);
    assert_eq!(bench.check(Components::NONE, RESET).system_state, SystemState::Normal, "pressed again");
}

#[test]
fn a_fault_of_the_diagnosis_degrades() {
    let status = Bench::new().check(Components::NONE, SafetyInput { faulty: true, ..SafetyInput::default() });
    assert_eq!(status.system_state, SystemState::Degraded);
}

#[test]
fn a_replayed_state_adds_to_the_supervisors_own_and_is_not_latched() {
    let replayed = |state| SafetyInput { replayed: (true, state), ..SafetyInput::default() };
    let mut bench = Bench::new();
    let status = bench.check(Components::NONE, replayed(SystemState::EStop));
    assert_eq!((status.estop, status.system_state), (true, SystemState::EStop));
    assert_eq!(bench.checks(1, Components::NONE), SafetyStatus::default());
    bench.check(Components::NONE, SafetyInput { estop: true, ..SafetyInput::default() });
    let status = bench.check(Components::NONE, replayed(SystemState::Normal));
    assert_eq!(status.system_state, SystemState::EStop, "a log cannot release the latch");
}

#[test]
fn a_supervisor_that_is_silent_stops_the_vehicle() {
    let (status, parameters) = (SafetyStatus::default(), Parameters::default().safety);
    let age = |millis| Some(Duration::from_millis(millis));
    assert!(!status.must_stop(age(0), &parameters) && !status.must_stop(age(300), &parameters));
    assert!(status.must_stop(age(301), &parameters), "the watchdog");
    assert!(status.must_stop(None, &parameters), "nothing moves before the first check");
    for status in [
        SafetyStatus { estop: true, ..SafetyStatus::default() },
        SafetyStatus { system_state: SystemState::EStop, ..SafetyStatus::default() },
    ] {
        assert!(status.must_stop(age(0), &parameters));
    }
    assert!(!SafetyStatus { system_state: SystemState::Degraded, ..status }.must_stop(age(0), &parameters));
}

fn sources(operator: OperatorCommand) -> DriverSources {
    DriverSources { operator, operator_age: Some(Duration::ZERO), ..DriverSources::default() }
}

fn mode(mode: InputMode) -> OperatorCommand {
    OperatorCommand { throttle: 0.3, brake: 0.1, steer: -0.2, mode, ..OperatorCommand::default() }
}

#[test]
fn each_mode_has_its_source() {
    let parameters = Parameters::default().input;
    let mut selector = DriverSelector::default();
    let manual = selector.step(at(0), &sources(mode(InputMode::Manual)), &parameters);
    assert_eq!(manual, DriverInput { throttle: 0.3, brake: 0.1, steer: -0.2 });
    let recorded = DriverInput { throttle: 0.9, brake: 0.0, steer: 1.0 };
    let replay = DriverSources { replay: Some(recorded), ..sources(mode(InputMode::Replay)) };
    assert_eq!(selector.step(at(0), &replay, &parameters), recorded);
    assert_eq!(selector.step(at(0), &sources(mode(InputMode::Replay)), &parameters), DriverInput::STOP, "the end");
}

#[test]
fn the_demo_begins_when_its_mode_is_entered() {
    let parameters = Parameters::default().input;
    let mut selector = DriverSelector::default();
    let mut step = |millis, source| selector.step(at(millis), &sources(mode(source)), &parameters);
    step(1_000, InputMode::Manual);
    for entered in [5_000, 60_000] {
        for after in [0, 1_990, 2_000, 4_990, 5_000, 6_990, 7_000, 20_000] {
            assert_eq!(step(entered + after, InputMode::Demo), demo(Duration::from_millis(after)));
        }
        step(entered + 20_010, InputMode::Manual);
    }
    assert_eq!(demo(Duration::from_millis(1_999)).throttle, 0.6);
    assert_eq!(demo(Duration::from_secs(2)).steer, 0.2);
    assert_eq!(demo(Duration::from_secs(8)), DriverInput::default());
}

#[test]
fn a_silent_operator_is_a_braking_vehicle() {
    let (mut selector, parameters) = (DriverSelector::default(), Parameters::default().input);
    for (age, expected) in [(None, DriverInput::STOP), (Some(501), DriverInput::STOP)] {
        let sources =
            DriverSources { operator_age: age.map(Duration::from_millis), ..sources(mode(InputMode::Manual)) };
        assert_eq!(selector.step(at(0), &sources, &parameters), expected);
    }
}

proptest! {
    #[test]
    fn the_input_is_in_range_whatever_comes(throttle: f32, brake: f32, steer: f32, speed in 0.0f32..3.0, state in 0u32..3) {
        let system_state = SystemState::from_number(state).expect("three states");
        let operator = OperatorCommand { throttle, brake, steer, ..OperatorCommand::default() };
        let sources = DriverSources { speed, system_state, ..sources(operator) };
        let input = DriverSelector::default().step(at(0), &sources, &Parameters::default().input);
        let signals = Signals { input, ..Signals::default() };
        prop_assert!(check(&signals, &Parameters::default()).is_empty(), "{:?}", input);
    }

    #[test]
    fn degraded_input_limited_again_is_the_same(throttle in 0.0f32..=1.0, brake in 0.0f32..=1.0, steer in -1.0f32..=1.0, speed in 0.0f32..3.0) {
        let parameters = Parameters::default().input;
        let operator = OperatorCommand { throttle, brake, steer, ..OperatorCommand::default() };
        let degraded = DriverSources { speed, system_state: SystemState::Degraded, ..sources(operator) };
        let once = DriverSelector::default().step(at(0), &degraded, &parameters);
        prop_assert!(once.steer.abs() <= 0.5 && once.throttle <= throttle && once.brake >= brake);
        prop_assert!(speed < 1.0 || once.throttle == 0.0);
        prop_assert!(speed < 1.2 || once.brake == 1.0);
        let replay = OperatorCommand { mode: InputMode::Replay, ..OperatorCommand::default() };
        let again = DriverSources { operator: replay, replay: Some(once), ..degraded };
        prop_assert_eq!(DriverSelector::default().step(at(0), &again, &parameters), once);
    }
}

#[test]
fn every_fault_is_found_and_named() {
    type Spoil = fn(&mut Signals, f32);
    let parameters = Parameters::default();
    let sound = Signals::default();
    let spoilt = |spoil: Spoil, value: f32| {
        let mut signals = sound;
        spoil(&mut signals, value);
        check(&signals, &parameters)
    };
    let cases: [(Spoil, f32, Faults); 9] = [
        (|s, v| s.input.throttle = v, 1.1, Faults::DRIVER_INPUT),
        (|s, v| s.input.brake = v, -0.1, Faults::DRIVER_INPUT),
        (|s, v| s.input.steer = v, 1.1, Faults::DRIVER_INPUT),
        (|s, v| s.drive.acceleration = v, 2.1, Faults::DRIVE),
        (|s, v| s.brake.deceleration = v, 4.1, Faults::BRAKE),
        (|s, v| s.steering.angle = v, -0.41, Faults::STEERING),
        (|s, v| s.state.wheel_omega = v, 1.0, Faults::WHEEL),
        (|s, v| s.state.yaw_rate = v, f32::INFINITY, Faults::POSE),
        (|s, v| (s.state.v, s.state.wheel_omega) = (v, v / 0.03), 3.1, Faults::SPEED),
    ];
    assert!(check(&sound, &parameters).is_empty());
    for (number, (spoil, value, fault)) in cases.into_iter().enumerate() {
        assert_eq!(spoilt(spoil, value), fault, "case {number}");
        assert!(spoilt(spoil, f32::NAN).contains(fault), "case {number}: not a number");
    }
}

#[test]
fn every_parameter_has_its_own_field_and_a_default_in_range() {
    assert_eq!(validate(&Parameters::default()), Ok(()));
    for (index, row) in Parameters::TABLE.iter().enumerate() {
        let mut changed = Parameters::default();
        let value = if row.get(&changed) == row.info.min { row.info.max } else { row.info.min };
        row.set(&mut changed, value).expect("the ends are in range");
        for (other_index, other) in Parameters::TABLE.iter().enumerate() {
            let expected = if index == other_index { value } else { other.get(&Parameters::default()) };
            assert_eq!(other.get(&changed), expected, "{} changed {}", row.info.name, other.info.name);
            assert!(index == other_index || row.info.name != other.info.name);
        }
    }
}
