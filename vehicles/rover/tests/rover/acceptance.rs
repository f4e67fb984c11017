//! The acceptance list of the architecture document, line by line, on the assembled vehicle.

use crate::common::{Events, instant, manual, run};
use proptest::prelude::*;
use serde_json::Value;
use stampfly_log::csv;
use stampfly_param::{ParameterAction, ParameterRequest, ParameterStatus};
use stampfly_rover::Parameters;
use stampfly_rover::messages::*;
use stampfly_types::Message;

fn operated(operator: OperatorCommand) -> Events {
    Events { operator: Some(operator), ..Events::default() }
}

fn last(records: &[LogRecord]) -> LogRecord {
    *records.last().expect("at least one tick")
}

/// The built-in scenario.
fn demo() -> Vec<LogRecord> {
    run(1000, |_, _| operated(OperatorCommand { mode: InputMode::Demo, ..OperatorCommand::default() }))
}

#[test]
fn the_documents_scenario_is_reproduced() {
    let vectors: Value = serde_json::from_str(include_str!("../vectors/models.json")).expect("JSON");
    let rows = vectors["scenario_document_order"]["rows"].as_array().expect("a list");
    let records = demo();
    for row in rows {
        let number = |name: &str| row[name].as_f64().unwrap_or_else(|| panic!("no {name}"));
        let record = records[(number("t") * 100.0).round() as usize - 1];
        for (field, words) in stampfly_types::text::fields::<LogRecord>(&record.to_words()) {
            if ["estop", "system_state"].contains(&field.name) {
                continue;
            }
            let (expected, actual) = (number(field.name), f64::from(f32::from_bits(words[0])));
            // The reference allows 1e-3 on positions after 10 s.
            let error = (actual - expected).abs() / expected.abs().max(1.0);
            assert!(error <= 1e-3, "t = {}: {} is {actual} instead of {expected}", record.t, field.name);
        }
    }
    assert_eq!(rows.len(), 17);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn speed_is_never_negative(inputs in proptest::collection::vec((0.0f32..=1.0, 0.0f32..=1.0, -1.0f32..=1.0), 1..20)) {
        let records = run(20 * inputs.len(), |tick, _| {
            let (throttle, brake, steer) = inputs[tick / 20];
            operated(manual(throttle, brake, steer))
        });
        for record in &records {
            prop_assert!(record.v >= 0.0 && text_is_finite(record));
            prop_assert_eq!(record.system_state, SystemState::Normal);
        }
    }

    #[test]
    fn an_emergency_stop_converges_to_zero(throttle in 0.0f32..=1.0, steer in -1.0f32..=1.0, at in 1usize..300) {
        let records = run(at + 60, |tick, _| operated(OperatorCommand { estop: tick >= at, ..manual(throttle, 0.0, steer) }));
        for record in &records[at..] {
            prop_assert_eq!(record.drive_accel_cmd, 0.0);
            prop_assert_eq!((record.estop, record.system_state), (true, SystemState::EStop), "at once");
            prop_assert_eq!(record.throttle, throttle, "the log keeps what was asked for");
        }
        prop_assert!(records[at + 31..].iter().all(|record| record.v == 0.0));
        let angles: Vec<f32> = records[at..].iter().map(|record| record.steer_angle_cmd.abs()).collect();
        prop_assert!(angles.is_sorted_by(|a, b| a >= b), "the wheels go to the centre");
    }

    #[test]
    fn speed_and_wheel_speed_are_monotone_in_throttle(low in 0.0f32..=1.0, more in 0.0f32..=1.0) {
        let end = |throttle: f32| last(&run(200, |_, _| operated(manual(throttle, 0.0, 0.0))));
        let (slow, fast) = (end(low), end((low + more).min(1.0)));
        prop_assert!(fast.v >= slow.v && fast.wheel_omega >= slow.wheel_omega);
    }

    #[test]
    fn the_sign_of_the_steering_is_the_sign_of_the_yaw(throttle in 0.1f32..=1.0, steer in 0.05f32..=1.0) {
        let end = |steer: f32| last(&run(100, |_, _| operated(manual(throttle, 0.0, steer))));
        prop_assert!(end(steer).yaw > 0.0 && end(-steer).yaw < 0.0);
        prop_assert_eq!(end(steer).yaw, -end(-steer).yaw);
    }

    #[test]
    fn the_steering_angle_saturates(steer in -1.0f32..=1.0) {
        let records = run(300, |_, _| operated(manual(0.5, 0.0, steer)));
        prop_assert!(records.iter().all(|record| record.steer_angle_cmd.abs() <= 0.4));
        prop_assert!((last(&records).steer_angle_cmd - 0.4 * steer).abs() < 1e-5);
    }

    #[test]
    fn harder_braking_stops_earlier(soft in 0.1f32..=0.8, more in 0.1f32..=0.2) {
        let ticks_to_stop = |brake: f32| {
            let records = run(1000, |tick, _| {
                operated(if tick < 150 { manual(1.0, 0.0, 0.0) } else { manual(0.0, brake, 0.0) })
            });
            records[150..].iter().position(|record| record.v == 0.0).expect("it stops")
        };
        prop_assert!(ticks_to_stop(soft + more) < ticks_to_stop(soft));
    }

    #[test]
    fn the_same_input_gives_the_same_trajectory(throttle in 0.0f32..=1.0, steer in -1.0f32..=1.0) {
        let once = || run(200, |_, _| operated(manual(throttle, 0.0, steer)));
        prop_assert_eq!(once(), once());
    }
}

fn text_is_finite(record: &LogRecord) -> bool {
    stampfly_types::text::is_finite(record)
}

fn index_of(name: &str) -> u32 {
    use stampfly_param::ParameterTable;
    Parameters::TABLE.iter().position(|row| row.info.name == name).expect("a parameter").try_into().expect("few")
}

fn request(action: ParameterAction, name: &str, value: f32) -> ParameterRequest {
    ParameterRequest { action, index: index_of(name), value }
}

#[test]
fn a_change_of_parameters_alters_behaviour_and_can_be_rolled_back() {
    let mut status = ParameterStatus::default();
    let records = run(50, |tick, link| {
        let request = match tick {
            10 => Some(request(ParameterAction::Set, "engine.max_accel", 1.0)),
            15 => Some(request(ParameterAction::Set, "engine.max_accel", 99.0)),
            20 => Some(request(ParameterAction::Apply, "engine.max_accel", 0.0)),
            30 => Some(request(ParameterAction::RollBack, "engine.max_accel", 0.0)),
            _ => None,
        };
        request.map(|request| link.parameter_request.publish(instant(tick), request).expect("room"));
        status = link.parameter_status.latest().map_or(status, |sample| sample.data);
        operated(manual(1.0, 0.0, 0.0))
    });
    let acceleration = |from: usize, to: usize, expected: f32| {
        records[from..to].iter().for_each(|record| assert_eq!(record.drive_accel_cmd, expected, "{}", record.t));
    };
    acceleration(0, 20, 2.0);
    acceleration(20, 30, 1.0);
    acceleration(30, 50, 2.0);
    assert_eq!((status.version, status.applied_at, status.refused), (2, instant(30), 1));
}

#[test]
fn parameters_that_do_not_fit_the_vehicle_are_rolled_back_by_the_diagnosis() {
    let mut version = 0;
    let records = run(200, |tick, link| {
        let request = match tick {
            50 => Some(request(ParameterAction::Set, "engine.max_accel", 1.0)),
            51 => Some(request(ParameterAction::Apply, "engine.max_accel", 0.0)),
            _ => None,
        };
        request.map(|request| link.parameter_request.publish(instant(tick), request).expect("room"));
        version = link.parameter_status.latest().map_or(0, |sample| sample.data.version);
        // An engine that does not keep to the new limit.
        let remote_drive = Some(DriveCommand { acceleration: 1.7 });
        Events { remote_drive, ..operated(manual(1.0, 0.0, 0.0)) }
    });
    assert_eq!(version, 2, "applied, and rolled back");
    assert_eq!(records[51].system_state, SystemState::Normal);
    assert_eq!(records[52].system_state, SystemState::Degraded, "the fault");
}

#[test]
fn an_engine_in_another_process_drives_and_its_death_is_an_emergency_stop() {
    for (died, silent) in (200..220).flat_map(|died| [(died, false), (died, true)]) {
        let records = run(died + 70, |tick, _| Events {
            remote_drive: (tick < died).then_some(DriveCommand { acceleration: 1.5 }),
            // Without an operator the supervisor runs every 100 ms only.
            operator: (!silent || tick == 0).then_some(manual(1.0, 0.0, 0.0)),
            ..Events::default()
        });
        assert!(records[..died].iter().all(|record| record.drive_accel_cmd == 1.5 && !record.estop));
        let stop = records.iter().position(|record| record.system_state == SystemState::EStop).expect("a stop");
        assert!((died..died + 30).contains(&stop), "{} ticks after the last command", stop - (died - 1));
        assert!(records[stop..].iter().all(|record| record.drive_accel_cmd == 0.0));
        assert_eq!(last(&records).v, 0.0);
    }
}

#[test]
fn every_component_stops_by_itself_when_the_supervisor_is_silent() {
    for silent_from in [0, 200, 205] {
        let records = run(silent_from + 70, |tick, _| Events {
            is_unsupervised: tick >= silent_from,
            ..operated(manual(1.0, 0.0, 1.0))
        });
        let end = last(&records);
        assert_eq!((end.drive_accel_cmd, end.brake_decel_cmd, end.v), (0.0, 4.0, 0.0));
        let stop = records.iter().position(|record| record.drive_accel_cmd == 0.0).expect("a stop");
        assert_eq!(
            stop,
            if silent_from == 0 { 0 } else { silent_from + 30 },
            "the watchdog's 0.3 s after its last word"
        );
        assert!(end.steer_angle_cmd < 0.1 && end.steer == 1.0, "the log keeps what was asked for");
    }
}

#[test]
fn a_missing_heartbeat_of_two_components_is_an_emergency_stop_within_the_limit() {
    for (first, second) in [(0, 1), (0, 4), (2, 3), (4, 5)] {
        for died in 200..220 {
            let dead = Components::EACH[first] | Components::EACH[second];
            let records = run(400, |tick, _| Events {
                operator: Some(manual(0.5, 0.0, 0.0)),
                dead: if tick >= died { dead } else { Components::NONE },
                ..Events::default()
            });
            let stop = records.iter().position(|record| record.system_state == SystemState::EStop);
            let ticks = stop.expect("an emergency stop") - (died - 1);
            assert!(ticks <= 30, "{ticks} ticks after the last heartbeat of {dead:?}");
            if !dead.contains(Components::DYNAMICS) {
                assert_eq!(last(&records).v, 0.0);
            }
        }
    }
}

#[test]
fn a_missing_heartbeat_of_one_component_limits_speed_and_steering_and_the_log_continues() {
    let records = run(800, |tick, _| Events {
        operator: Some(manual(1.0, 0.0, 1.0)),
        dead: if tick >= 200 { Components::COM } else { Components::NONE },
        ..Events::default()
    });
    assert_eq!((records[199].system_state, records[199].v), (SystemState::Normal, 3.0));
    let end = last(&records);
    assert_eq!(end.system_state, SystemState::Degraded);
    assert!((end.v - 1.0).abs() < 1e-3, "braked to the limit and held there: {}", end.v);
    assert!(end.steer == 0.5 && (end.steer_angle_cmd - 0.2).abs() < 1e-5);
    assert!(records.iter().map(|record| record.t).is_sorted_by(|a, b| a < b));
}

#[test]
fn an_emergency_stop_is_latched_until_an_explicit_reset() {
    let pressed = OperatorCommand { estop: true, ..manual(1.0, 0.0, 0.0) };
    let reset = OperatorCommand { reset: true, ..manual(1.0, 0.0, 0.0) };
    let records = run(600, |tick, _| {
        operated(match tick {
            100 => pressed,
            300..310 => reset,
            _ => manual(1.0, 0.0, 0.0),
        })
    });
    assert!(records[150..300].iter().all(|record| record.v == 0.0 && record.system_state == SystemState::EStop));
    assert!(!records[101].estop, "the button was let go");
    assert_eq!(records[300].system_state, SystemState::Normal);
    assert!(last(&records).v > 2.0);
}

/// A drive with everything in it: turns, braking, a stalled component, an emergency stop and a reset.
fn eventful() -> Vec<LogRecord> {
    run(1200, |tick, _| {
        let operator = OperatorCommand {
            estop: (400..420).contains(&tick),
            reset: tick == 600 || tick == 950,
            ..manual(0.7, 0.0, if tick % 200 < 100 { 1.0 / 3.0 } else { -0.9 })
        };
        Events {
            operator: Some(operator),
            dead: if (700..900).contains(&tick) { Components::COM } else { Components::NONE },
            ..Events::default()
        }
    })
}

#[test]
fn a_replay_of_the_csv_log_reproduces_it() {
    let recorded = eventful();
    for state in [SystemState::Normal, SystemState::Degraded, SystemState::EStop] {
        assert!(recorded.iter().any(|record| record.system_state == state), "{state:?} is in the log");
    }
    let log = |records: &[LogRecord]| {
        let mut log = String::new();
        csv::write_header::<LogRecord>(&mut log).expect("a string takes everything");
        records.iter().try_for_each(|record| csv::write_line(record, &mut log)).expect("a string takes everything");
        log
    };
    let text = log(&recorded);
    let header = "t,throttle,brake,steer,drive_accel_cmd,brake_decel_cmd,steer_angle_cmd,x,y,yaw,v,yaw_rate,wheel_omega,estop,system_state";
    assert_eq!(text.lines().next(), Some(header));
    let lines: Vec<LogRecord> = text.lines().skip(1).map(|line| csv::read_line(line).expect("our own line")).collect();
    let replayed = run(lines.len(), |tick, _| Events {
        replay: lines.get(tick).copied(),
        ..operated(OperatorCommand { mode: InputMode::Replay, ..OperatorCommand::default() })
    });
    assert_eq!(log(&replayed), text, "byte for byte");
    // The public logs' three decimals would not do.
    let coarse: Vec<LogRecord> =
        lines.iter().map(|line| LogRecord { steer: (line.steer * 1e3).round() / 1e3, ..*line }).collect();
    let replayed = run(coarse.len(), |tick, _| Events {
        replay: coarse.get(tick).copied(),
        ..operated(OperatorCommand { mode: InputMode::Replay, ..OperatorCommand::default() })
    });
    assert_ne!(log(&replayed), text);
}
