//! The components against values that somebody else computed from the document's formulas, in double precision.

use serde_json::Value;
use stampfly_control::esc::{Protocol, counts};
use stampfly_control::mixer::shares::mix;
use stampfly_mode::Gestures;
use stampfly_stm32_quad::battery::Battery;
use stampfly_stm32_quad::frame::QUADROTOR_X;
use stampfly_stm32_quad::lamps::{Lamps, pattern};
use stampfly_stm32_quad::messages::{BatteryState, ControlState};
use stampfly_stm32_quad::parameters::Parameters;
use stampfly_stm32_quad::rate_loops::{Demand, RateLoops};
use stampfly_stm32_quad::startup::{Shown, Startup, Step};
use stampfly_types::{Duration, Instant, Vec3};

fn vectors(text: &str) -> Value {
    serde_json::from_str(text).expect("valid JSON")
}

fn logic() -> Value {
    vectors(include_str!("../vectors/fc_logic.json"))
}

fn number(value: &Value) -> f32 {
    value.as_f64().expect("number") as f32
}

fn numbers<const N: usize>(value: &Value) -> [f32; N] {
    let numbers: Vec<f32> = value.as_array().expect("array").iter().map(number).collect();
    numbers.try_into().expect("as long as it should be")
}

fn assert_near(ours: f32, theirs: &Value, tolerance: f32, what: &str) {
    let theirs = number(theirs);
    assert!((ours - theirs).abs() <= tolerance * theirs.abs().max(1.0), "{what}: {ours} for {theirs}");
}

#[test]
fn the_defaults_are_the_documents() {
    let (parameters, pid) = (Parameters::default(), vectors(include_str!("../vectors/pid_mixer.json")));
    let theirs = &logic()["defaults"];
    let [roll, pitch, yaw] = numbers_of_gains(&theirs["pid"]);
    let Parameters { roll: r, pitch: p, yaw: y, stick, gain, battery, filter, .. } = parameters;
    assert_eq!([[r.p, r.i, r.d], [p.p, p.i, p.d], [y.p, y.i, y.d]], [roll, pitch, yaw]);
    assert_near(stick.angle_max, &pid["params"]["angle_max"], 1e-6, "angle_max");
    assert_near(stick.rotation_max, &pid["params"]["rotation_max"], 1e-6, "rotation_max");
    for (ours, name) in [
        (gain.rotation, "rotation_gain"),
        (gain.throttle, "throttle_gain"),
        (stick.threshold, "stk_thres"),
        (battery.scale, "vbat_scale"),
        (battery.warning, "vbat_warn"),
        (battery.critical, "vbat_crit"),
        (filter.accel, "filter_acc"),
        (filter.gyro, "filter_gyro"),
        (filter.derivative, "filter_dterm"),
    ] {
        assert_near(ours, &theirs[name], 1e-6, name);
    }
}

fn numbers_of_gains(value: &Value) -> [[f32; 3]; 3] {
    let rows: Vec<[f32; 3]> = value.as_array().expect("rows").iter().map(numbers).collect();
    rows.try_into().expect("three axes")
}

/// The gyro of the one case that moves, which the file gives only at some steps.
fn moving(step: u64) -> Vec3 {
    let time = step as f64 / 4000.0;
    Vec3::new((0.1 * (80.0 * time).sin()) as f32, (-0.05 * (50.0 * time).cos()) as f32, 0.02)
}

#[test]
fn loops_and_mixer_in_every_case() {
    let vectors = vectors(include_str!("../vectors/pid_mixer.json"));
    for (ours, theirs) in QUADROTOR_X.iter().zip(vectors["mix"].as_array().expect("rows")) {
        assert_eq!(*ours, numbers::<3>(theirs));
    }
    let tolerance = number(&vectors["tolerance_f32"]);
    let parameters = Parameters::default();
    let mut compared = 0;
    for case in vectors["cases"].as_array().expect("cases") {
        let name = case["name"].as_str().expect("name");
        let rows = case["rows"].as_array().expect("rows");
        let mut loops = RateLoops::new(&parameters);
        for step in 0..case["steps"].as_u64().expect("steps") {
            // Between two rows the sticks stay.
            let index = |row: &&Value| row["i"].as_u64().expect("index");
            let row = rows.iter().rfind(|row| index(row) <= step).expect("a row for the first step");
            let [roll, pitch, yaw, throttle] = numbers(&row["stick"]);
            let angle_mode = row["selflv"].as_bool().expect("mode");
            let demand = Demand { sticks: [roll, pitch, yaw].map(|stick| (stick - 0.5) / 0.5), angle_mode };
            let [x, y, z] = numbers(&row["angle"]);
            let gyro = if name == "acro_all_axes" {
                moving(step)
            } else {
                let [x, y, z] = numbers(&row["gyro"]);
                Vec3::new(x, y, z)
            };
            let terms = loops.step(&demand, &Vec3::new(x, y, z), &gyro, &parameters);
            let is_cut = throttle <= parameters.stick.threshold;
            if is_cut {
                loops.cut();
            }
            if index(&row) != step {
                continue;
            }
            for (axis, (ours, theirs)) in terms.iter().zip(row["terms"].as_array().expect("terms")).enumerate() {
                let what = format!("{name}, step {step}, axis {axis}");
                let [p, i, d] = ours.parts;
                for (ours, name) in [(ours.setpoint, "setpoint"), (ours.error, "error"), (p, "p"), (i, "i"), (d, "d")] {
                    assert_near(ours, &theirs[name], tolerance, &format!("{what}, {name}"));
                }
            }
            let shares = mix(&QUADROTOR_X, throttle, terms.map(|term| term.output()));
            for motor in 0..4 {
                let what = format!("{name}, step {step}, motor {}", motor + 1);
                let sent = if is_cut { 0.0 } else { shares[motor].clamp(0.0, 1.0) };
                assert_near(sent, &row["motor"][motor], tolerance, &what);
                if !is_cut {
                    assert_near(shares[motor], &row["motor_unclamped"][motor], tolerance, &what);
                }
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 4 * 32);
}

#[test]
fn the_battery_changes_its_flags_when_it_should() {
    let logic = logic();
    let parameters = Parameters::default().battery;
    let mut battery = Battery::at(0.0);
    let mut transitions = logic["battery"]["transitions"].as_array().expect("transitions").iter();
    let (mut tick, mut before, mut last) = (0, (false, false), BatteryState::default());
    for segment in logic["battery"]["input_segments_V_ticks"].as_array().expect("segments") {
        for _ in 0..segment[1].as_u64().expect("ticks") {
            last = battery.measure(number(&segment[0]), &parameters);
            if (last.empty, last.low) != before {
                before = (last.empty, last.low);
                let theirs = transitions.next().expect("a transition of theirs");
                assert_eq!(theirs["tick"].as_u64(), Some(tick));
                assert_eq!((theirs["nobat"].as_bool(), theirs["lowbat"].as_bool()), (Some(last.empty), Some(last.low)));
                assert_near(last.voltage, &theirs["vbat"], 1e-6, "voltage");
            }
            tick += 1;
        }
    }
    assert_eq!(transitions.next(), None);
    assert_near(last.voltage, &logic["battery"]["final"][0], 1e-6, "voltage in the end");
}

#[test]
fn a_full_battery_is_full_from_the_first_moment_and_two_cells_are_two() {
    let parameters = Parameters::default().battery;
    let state = Battery::default().measure(4.2, &parameters);
    assert!(!state.low && !state.empty, "the original takes two seconds");
    let two = stampfly_stm32_quad::parameters::BatteryParameters { cells: 2.0, reference: 3.3, ..parameters };
    assert!(Battery::default().measure(6.5, &two).low && !Battery::default().measure(6.7, &two).low);
    // 7.4 V behind the divider, at 3.3 V of 4096.
    let counts = (7.4 / two.scale / 3.3 * 4096.0) as u32;
    assert!((Battery::default().step(counts, &two).voltage - 7.4).abs() < 5e-3);
}

#[test]
fn lights_in_every_state() {
    let logic = logic();
    let theirs =
        |name: &str| u8::from_str_radix(logic["led"]["patterns"][name].as_str().expect("bits"), 2).expect("8 bits");
    let armed = ControlState { online: true, armed: true, angle_mode: true, ..Default::default() };
    let disarmed = ControlState { armed: false, ..armed };
    let (full, low) = (BatteryState::default(), BatteryState { low: true, ..Default::default() });
    let empty = BatteryState { empty: true, ..low };
    // Each also has everything that is below it.
    for (name, state, battery) in [
        ("OFFLINE", ControlState { online: false, calibrating: true, ..armed }, empty),
        ("CALIB", ControlState { calibrating: true, ..disarmed }, empty),
        ("ACRO", ControlState { angle_mode: false, ..disarmed }, empty),
        ("ANGLE", disarmed, empty),
        ("NOBAT", armed, empty),
        ("LOWBAT", armed, low),
        ("ARMED", armed, full),
    ] {
        assert_eq!(pattern(&state, &battery), theirs(name), "{name}");
    }
    let mut lamps = Lamps::default();
    assert!(!lamps.step(0xFF), "dark at first");
    let second: Vec<bool> = (0..8).map(|_| lamps.step(theirs("CALIB"))).collect();
    assert_eq!(second, [true, true, false, true, true, false, true, false]);
}

#[test]
fn sticks_arm_and_disarm_at_the_documents_threshold() {
    let commands = &logic()["stick_commands"];
    let threshold = number(&commands["threshold"]);
    assert_eq!((commands["low"].as_str(), commands["high"].as_str()), (Some("value<=0.05"), Some("value>=0.95")));
    let mut gestures = Gestures::new(Duration::from_secs(2), threshold);
    let mut armed = |throttle, yaw| gestures.step(Instant::ZERO, Some([throttle, yaw]), true).armed;
    assert!(!armed(0.051, 0.95) && !armed(0.05, 0.949) && armed(0.05, 0.95));
    assert!(armed(0.05, 0.051) && !armed(0.05, 0.05));
}

#[test]
fn pulses_are_as_long_as_they_should_be() {
    let logic = logic();
    for (share, theirs) in logic["esc"]["pulse_us"].as_object().expect("pulses") {
        let share: f32 = share.parse().expect("a share");
        let microseconds = Protocol::Oneshot125.microseconds(counts(share));
        assert_near(microseconds, theirs, 1e-5, "pulse");
        assert!((Protocol::Oneshot125.share(microseconds) - share).abs() < 1.0 / 502.0);
    }
}

#[test]
fn the_start_up_sequence_does_its_steps_in_order() {
    let mut startup = Startup::default();
    let (mut done, mut changes, mut front, mut motors) = (vec![], [0; 3], None, vec![]);
    let theirs = logic();
    let sequence = theirs["init_sequence"].as_array().expect("sequence");
    for ms in 0..30_000_u64 {
        let (shown, step) = startup.step(Duration::from_millis(ms));
        done.extend(step.map(|step| (step, ms)));
        if ms < 15_000 {
            assert_eq!(shown, Shown { front: shown.front, back: !shown.front, motors: 0.0 });
            if front != Some(shown.front) || ms % 5_000 == 0 {
                changes[ms as usize / 5_000] += 1;
            }
            front = Some(shown.front);
        } else if motors.last() != Some(&(shown.motors, shown.front)) {
            motors.push((shown.motors, shown.front));
        }
    }
    assert_eq!(done, [(Step::ForgetTransmitter, 5_000), (Step::ResetParameters, 10_000)]);
    assert_eq!(changes, [0, 2, 4].map(|row| sequence[row]["toggles"].as_u64().expect("toggles")));
    assert_eq!(motors, [(1.0, false), (0.05, false), (0.0, true)]);
}
