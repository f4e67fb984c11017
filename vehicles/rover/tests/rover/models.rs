//! The models against the reference values of the architecture document, and what must hold for any input.

use proptest::prelude::*;
use serde_json::Value;
use stampfly_rover::messages::VehicleState;
use stampfly_rover::parameters::{SteeringParameters, VehicleParameters};
use stampfly_rover::{Parameters, models};
use stampfly_types::Duration;

const TICK: Duration = Duration::from_millis(10);
/// Of the reference values, per step.
const TOLERANCE: f64 = 1e-5;

fn vectors() -> Value {
    serde_json::from_str(include_str!("../vectors/models.json")).expect("the file is JSON")
}

fn rows(value: &Value) -> &[Value] {
    let rows = value.as_array().expect("a list");
    assert!(!rows.is_empty());
    rows
}

/// A number of a row. Truth values are 0 or 1.
fn number(row: &Value, name: &str) -> f64 {
    row[name].as_f64().unwrap_or_else(|| panic!("no {name} in {row}"))
}

fn single(row: &Value, name: &str) -> f32 {
    number(row, name) as f32
}

fn duration(row: &Value) -> Duration {
    Duration::from_seconds(single(row, "dt"))
}

fn estop(row: &Value) -> bool {
    number(row, "estop") != 0.0
}

#[track_caller]
fn close(actual: f32, row: &Value, name: &str, tolerance: f64) {
    let expected = number(row, name);
    // Relative above one: wheel speeds are 100 rad/s, where f32 has steps of 8e-6.
    let error = (f64::from(actual) - expected).abs() / expected.abs().max(1.0);
    assert!(error <= tolerance, "{name}: {actual} instead of {expected}\n{row}");
}

#[test]
fn defaults_are_the_documents() {
    let reference = &vectors()["params"];
    let Parameters { engine, brake, steering, vehicle, .. } = Parameters::default();
    for (group, name, value) in [
        ("engine", "max_accel_mps2", engine.max_accel),
        ("brake", "max_decel_mps2", brake.max_decel),
        ("brake", "estop_max_decel_mps2", brake.estop_max_decel),
        ("steering", "max_steer_angle_rad", steering.max_angle),
        ("steering", "time_constant_s", steering.time_constant),
        ("vehicle", "wheel_radius_m", vehicle.wheel_radius),
        ("vehicle", "wheelbase_m", vehicle.wheelbase),
        ("vehicle", "linear_drag", vehicle.linear_drag),
        ("vehicle", "max_speed_mps", vehicle.max_speed),
        ("vehicle", "estop_decel_mps2", vehicle.estop_decel),
    ] {
        assert_eq!(value, single(&reference[group], name), "{group}.{name}");
    }
}

#[test]
fn engine_and_brake_reproduce_the_reference() {
    let (vectors, parameters) = (vectors(), Parameters::default());
    for row in rows(&vectors["engine"]) {
        let accel = models::drive_acceleration(single(row, "throttle"), estop(row), &parameters.engine);
        close(accel, row, "accel", TOLERANCE);
    }
    for row in rows(&vectors["brake"]) {
        let decel = models::brake_deceleration(single(row, "brake"), estop(row), &parameters.brake);
        close(decel, row, "decel", TOLERANCE);
    }
}

#[test]
fn steering_reproduces_the_reference() {
    let (vectors, parameters) = (vectors(), Parameters::default().steering);
    for row in rows(&vectors["steering"]) {
        let parameters = SteeringParameters { time_constant: single(row, "tau"), ..parameters };
        let angle = models::step_steering(single(row, "current"), single(row, "target"), duration(row), &parameters);
        close(angle, row, "new", TOLERANCE);
    }
    let response = &vectors["steering_step_response"];
    for row in rows(&response["samples"]) {
        let mut angle = 0.0;
        for _ in 0..row["n"].as_u64().expect("a number of steps") {
            angle = models::step_steering(angle, single(response, "target"), duration(response), &parameters);
        }
        close(angle, row, "angle", TOLERANCE);
        close(angle, row, "closed_form", TOLERANCE);
    }
    let euler = 0.01 / 0.15 * 0.4;
    let first = models::step_steering(0.0, 0.4, TICK, &parameters);
    assert!((f64::from(first) - euler).abs() > 50.0 * TOLERANCE, "the exact lag, not Euler's");
}

#[test]
fn longitudinal_motion_reproduces_the_reference() {
    let (vectors, parameters) = (vectors(), Parameters::default().vehicle);
    for row in rows(&vectors["longitudinal"]) {
        let parameters = VehicleParameters { linear_drag: single(row, "drag"), ..parameters };
        let state = VehicleState { v: single(row, "v"), ..VehicleState::default() };
        let (drive, brake) = (single(row, "drive"), single(row, "brake"));
        let next = models::step_longitudinal(&state, duration(row), drive, brake, estop(row), &parameters);
        close(next.v, row, "v_next", TOLERANCE);
        close(next.wheel_omega, row, "wheel_omega", TOLERANCE);
    }
    let response = &vectors["longitudinal_drag_response"];
    let parameters = VehicleParameters { linear_drag: single(response, "drag"), ..parameters };
    for row in rows(&response["samples"]) {
        let mut state = VehicleState::default();
        for _ in 0..row["n"].as_u64().expect("a number of steps") {
            let drive = single(response, "drive");
            state = models::step_longitudinal(&state, duration(response), drive, 0.0, false, &parameters);
        }
        close(state.v, row, "v", TOLERANCE);
    }
}

#[test]
fn an_emergency_stop_from_full_speed_takes_thirty_steps() {
    let (vectors, Parameters { brake, vehicle, .. }) = (vectors(), Parameters::default());
    let ideal = vectors["estop_stop_steps_from_3mps"]["steps_to_zero"].as_u64().expect("a number of steps");
    let mut state = VehicleState { v: 3.0, ..VehicleState::default() };
    let mut steps = 0;
    while state.v > 0.0 {
        let decel = models::brake_deceleration(0.0, true, &brake);
        state = models::step_longitudinal(&state, TICK, 0.0, decel, true, &vehicle);
        steps += 1;
    }
    assert!((ideal..=ideal + 1).contains(&steps), "{steps}");
    assert_eq!((state.v, state.wheel_omega), (0.0, 0.0));
}

#[test]
fn lateral_motion_reproduces_the_reference() {
    let (vectors, parameters) = (vectors(), Parameters::default().vehicle);
    for row in rows(&vectors["lateral"]) {
        let state = VehicleState { v: single(row, "v"), yaw: single(row, "yaw"), ..VehicleState::default() };
        let next = models::step_lateral(&state, duration(row), single(row, "delta"), &parameters);
        for (value, name) in [(next.x, "x"), (next.y, "y"), (next.yaw, "yaw"), (next.yaw_rate, "yaw_rate")] {
            close(value, &row["out"], name, TOLERANCE);
        }
    }
    let circle = &vectors["lateral_circle"];
    for row in rows(&circle["samples"]) {
        let mut state = VehicleState { v: single(circle, "v"), ..VehicleState::default() };
        for _ in 0..row["n"].as_u64().expect("a number of steps") {
            state = models::step_lateral(&state, duration(circle), single(circle, "delta"), &parameters);
        }
        // The reference allows 1e-3 on positions after 10 s.
        for (value, name) in [(state.x, "x"), (state.y, "y"), (state.yaw, "yaw"), (state.yaw_rate, "yaw_rate")] {
            close(value, row, name, 1e-3);
        }
        // Semi-implicit: every position lies on a circle through the start, of the ideal radius to first order in dt.
        let radius = single(circle, "radius_ideal");
        let (x, y) = (state.x / radius, state.y / radius - 1.0);
        let off = x * x + y * y - 1.0;
        assert!(off.abs() < 0.01, "{off}");
    }
}

/// The same inputs for a time: what a vehicle does from standstill.
fn drive(throttle: f32, steer: f32, ticks: usize) -> VehicleState {
    let parameters = Parameters::default();
    let (mut state, mut angle) = (VehicleState::default(), 0.0);
    for _ in 0..ticks {
        let accel = models::drive_acceleration(throttle, false, &parameters.engine);
        angle = models::step_steering(
            angle,
            models::steering_target(steer, false, &parameters.steering),
            TICK,
            &parameters.steering,
        );
        state = models::step_longitudinal(&state, TICK, accel, 0.0, false, &parameters.vehicle);
        state = models::step_lateral(&state, TICK, angle, &parameters.vehicle);
    }
    state
}

/// Any number a broken component could hand over, and many that a sound one would.
fn any_number() -> impl Strategy<Value = f32> {
    prop_oneof![4 => -3.0f32..3.0, 1 => any::<f32>(), 1 => Just(f32::NAN), 1 => Just(f32::INFINITY)]
}

proptest! {
    #[test]
    fn commands_stay_in_range_whatever_the_input(input in any_number(), current in -0.4f32..=0.4, millis in 0u64..1000) {
        let parameters = Parameters::default();
        let accel = models::drive_acceleration(input, false, &parameters.engine);
        prop_assert!((0.0..=parameters.engine.max_accel).contains(&accel));
        let decel = models::brake_deceleration(input, false, &parameters.brake);
        prop_assert!((0.0..=parameters.brake.max_decel).contains(&decel));
        let target = models::steering_target(input, false, &parameters.steering);
        let angle = models::step_steering(current, target, Duration::from_millis(millis), &parameters.steering);
        let limit = parameters.steering.max_angle;
        prop_assert!((-limit..=limit).contains(&target) && (-limit..=limit).contains(&angle));
        let beyond = models::step_steering(current, input, Duration::from_millis(millis), &parameters.steering);
        prop_assert!((-limit..=limit).contains(&beyond), "the stop holds for any target");
    }

    #[test]
    fn speed_is_never_negative_nor_above_its_limit(v in 0.0f32..=3.0, drive in any_number(), brake in any_number(), estop: bool) {
        let parameters = Parameters::default().vehicle;
        let state = VehicleState { v, ..VehicleState::default() };
        let next = models::step_longitudinal(&state, TICK, drive, brake, estop, &parameters);
        prop_assert!((0.0..=parameters.max_speed).contains(&next.v));
        prop_assert_eq!(next.wheel_omega, next.v / parameters.wheel_radius);
    }

    #[test]
    fn an_emergency_stop_reaches_zero_and_stays_there(v in 0.0f32..=3.0, throttle in 0.0f32..=1.0, brake in 0.0f32..=1.0) {
        let parameters = Parameters::default();
        let mut state = VehicleState { v, ..VehicleState::default() };
        for tick in 0..100 {
            let accel = models::drive_acceleration(throttle, true, &parameters.engine);
            let decel = models::brake_deceleration(brake, true, &parameters.brake);
            prop_assert_eq!((accel, decel), (0.0, parameters.brake.estop_max_decel), "input does not count");
            let next = models::step_longitudinal(&state, TICK, accel, decel, true, &parameters.vehicle);
            prop_assert!(next.v <= state.v);
            state = next;
            prop_assert!(tick < 31 || state.v == 0.0);
        }
    }

    #[test]
    fn more_throttle_is_not_slower(low in 0.0f32..=1.0, more in 0.0f32..=1.0, ticks in 1usize..300) {
        let high = (low + more).min(1.0);
        let (slow, fast) = (drive(low, 0.0, ticks), drive(high, 0.0, ticks));
        prop_assert!(fast.v >= slow.v && fast.wheel_omega >= slow.wheel_omega);
        prop_assert!(high <= low + 1e-3 || fast.v > slow.v || fast.v == 3.0);
    }

    #[test]
    fn the_other_steering_mirrors_the_path(steer in 0.01f32..=1.0, throttle in 0.1f32..=1.0, ticks in 2usize..300) {
        let (left, right) = (drive(throttle, steer, ticks), drive(throttle, -steer, ticks));
        prop_assert!(left.yaw > 0.0 && left.yaw_rate > 0.0, "positive steering turns left");
        prop_assert_eq!((left.x, left.v), (right.x, right.v));
        prop_assert_eq!((left.y, left.yaw, left.yaw_rate), (-right.y, -right.yaw, -right.yaw_rate));
    }

    #[test]
    fn a_longer_period_gives_the_same_steering(target in -0.4f32..=0.4, ticks in 1u64..50) {
        let parameters = Parameters::default().steering;
        let steps = (0..ticks).fold(0.0, |angle, _| models::step_steering(angle, target, TICK, &parameters));
        let once = models::step_steering(0.0, target, TICK * ticks, &parameters);
        prop_assert!((steps - once).abs() < 1e-5);
    }
}
