//! A conversation with the StampFly: what its console has beside that of every vehicle.

use stampfly_board::console::{Command, Console, Newest, Profile};
use stampfly_board::topics::Id;
use stampfly_board::{VehicleConfig, schedule};
use stampfly_control::autotune::{AutotuneAxis, AutotuneStage, AutotuneStatus};
use stampfly_flight::console::calibrate::Calibrate;
use stampfly_flight::console::{Request, SensorLine, answer};
use stampfly_flight::doctor::{Fact, Finding, Verdict};
use stampfly_types::messages::{
    Alerts, ArmBlocks, ArmRefusals, CalibrationKind, CalibrationReport, CalibrationStage, FlightMode, FlightPhase,
    FlightStatus, PilotInput, PowerData, SystemAlert, TofData,
};
use stampfly_types::{Instant, Message};

/// A vehicle that has published its mode, if it has.
fn vehicle(armed: Option<bool>) -> Newest {
    let mut newest = Newest::new();
    if let Some(armed) = armed {
        let phase = if armed { FlightPhase::Flying } else { FlightPhase::IdleGround };
        let blocks = ArmBlocks::LOW_BATTERY | ArmBlocks::THROTTLE;
        let mode = FlightStatus { phase, armed, mode: FlightMode::AltHold, blocks, ..Default::default() };
        newest.note(Id::flight_status as usize, Instant::ZERO, &mode.to_words());
    }
    newest
}

fn ask(newest: &Newest, line: &str) -> (String, Request<Command>) {
    let (profile, mut config) = (Profile::new(&schedule::ACTIVATIONS), VehicleConfig::default());
    let mut console =
        Console { version: "stampfly 9.9", newest, sensors: &[], profile: &profile, facts: &[], config: &mut config };
    let mut reply = String::new();
    let request = answer(line, Instant::from_secs(5), &mut console, &mut reply).expect("a String takes everything");
    (reply, request)
}

#[test]
fn status_says_what_blocks_arming() {
    let mut newest = vehicle(Some(false));
    let alert = SystemAlert { active: Alerts::COMM_LOST, ..Default::default() };
    newest.note(Id::system_alert as usize, Instant::ZERO, &alert.to_words());
    let power = PowerData { voltage: 3.456, current: 0.5, power: 1.7 };
    newest.note(Id::sensor_power as usize, Instant::ZERO, &power.to_words());
    newest.note(Id::command_pilot as usize, Instant::from_millis(4_980), &PilotInput::default().to_words());
    let (said, _) = ask(&newest, "status");
    for part in
        ["IdleGround, disarmed", "AltHold", "LOW_BATTERY THROTTLE", "COMM_LOST", "3.46 V", "20 ms ago", "awake    5 s"]
    {
        assert!(said.contains(part), "{part} is missing:\n{said}");
    }
    assert!(ask(&Newest::new(), "status").0.contains("never heard"), "nothing published yet");
}

#[test]
fn status_says_why_it_did_not_arm() {
    let mut newest = vehicle(Some(false));
    assert!(!ask(&newest, "status").0.contains("refused"));
    let none = ArmBlocks::NONE;
    let refusals = ArmRefusals {
        attempts: 2,
        blocks: ArmBlocks::TILTED | ArmBlocks::NO_LINK,
        check: [ArmBlocks::TILTED, ArmBlocks::NO_LINK, none, none],
        value: [0.5, 1.0, 0.0, 0.0],
        limit: [0.35, 0.0, 0.0, 0.0],
        since: [2_000, 1_500, 0, 0].map(Instant::from_millis),
    };
    newest.note(Id::arm_refusals as usize, Instant::from_secs(3), &refusals.to_words());
    let (said, _) = ask(&newest, "status");
    for part in ["2 times to arm, last 2 s ago", "TILTED 0.50, limit 0.35, for 1000 ms", "NO_LINK for 1500 ms"] {
        assert!(said.contains(part), "{part} is missing:\n{said}");
    }
}

#[test]
fn its_own_commands_are_refused_in_flight_and_before_anything_is_known() {
    let requests = [
        ("pair", Command::Pair(true)),
        ("pair stop", Command::Pair(false)),
        ("motor test 3 10%", Command::TestMotor { motor: 3, duty: 0.1 }),
    ];
    for (line, command) in requests {
        assert_eq!(ask(&vehicle(Some(false)), line), (String::new(), Request::Vehicle(command)), "{line}");
        for armed in [None, Some(true)] {
            let (said, request) = ask(&vehicle(armed), line);
            assert!(said.contains("armed") && request == Request::Nothing, "{line}: {said}");
        }
    }
    assert_eq!(ask(&vehicle(Some(true)), "motor stop").1, Request::Vehicle(Command::StopMotor), "always allowed");
}

#[test]
fn only_motors_that_exist_turn_and_only_slowly() {
    for line in ["motor test 0 10", "motor test 5 10", "motor test 1 31", "motor test 1 nan", "motor test 1 -1"] {
        let (said, request) = ask(&vehicle(Some(false)), line);
        assert!(!said.is_empty() && request == Request::Nothing, "{line}: {said}");
    }
    for line in ["motor test 1", "motor test 256 1", "motor", "motor test one 1"] {
        assert!(ask(&vehicle(Some(false)), line).0.contains("usage: motor test N PERCENT"), "{line}");
    }
}

#[test]
fn doctor_says_what_is_silent_and_what_only_the_board_knows() {
    let mut newest = vehicle(Some(false));
    newest.note(Id::sensor_power as usize, Instant::from_millis(4_900), &PowerData::default().to_words());
    newest.note(Id::sensor_tof as usize, Instant::from_millis(2_000), &TofData::default().to_words());
    let line = |name, samples| SensorLine { name, samples, errors: 1, last_error: None };
    let sensors = [line("power", 60), line("tof", 50), line("flow", 0)];
    let facts = [Fact { name: "flash", verdict: Verdict::Fail, value: &"DIO at 40 MHz", advice: "flash it again" }];
    let (profile, mut config) = (Profile::new(&schedule::ACTIVATIONS), VehicleConfig::default());
    let mut console = Console {
        version: "stampfly 9.9",
        newest: &newest,
        sensors: &sensors,
        profile: &profile,
        facts: &facts,
        config: &mut config,
    };
    let mut reply = String::new();
    assert_eq!(answer("doctor", Instant::from_secs(5), &mut console, &mut reply), Ok(Request::Nothing));
    let found = |name: &str| reply.lines().filter_map(Finding::parse).find(|line| line.name == name);
    let verdict = |name| found(name).map(|line| line.verdict);
    assert_eq!(
        ["power", "tof", "flow", "passes", "arming", "flash"].map(verdict),
        [Verdict::Pass, Verdict::Fail, Verdict::Fail, Verdict::Pass, Verdict::Look, Verdict::Fail].map(Some),
        "{reply}"
    );
    assert!(found("arming").is_some_and(|line| line.value == "LOW_BATTERY THROTTLE"), "{reply}");
    assert!(found("flash").is_some_and(|line| line.advice == "flash it again"), "{reply}");
}

#[test]
fn the_list_of_parameters_is_straight() {
    let (list, _) = ask(&vehicle(Some(false)), "param list");
    let first_column = |line: &str| line.split(' ').next().map_or(0, str::len);
    assert!(list.lines().all(|line| first_column(line) < 30), "the columns are straight");
}

#[test]
fn everything_in_the_help_is_understood() {
    let (help, _) = ask(&vehicle(Some(false)), "help");
    assert!(help.contains("motor stop") && help.contains("param save"));
    for line in help.lines() {
        let example = line.split_at(24).0.replace("[NAME]", "imu").replace("[PREFIX]", "rate").replace("PERCENT", "5");
        let example =
            example.replace(" NAME", " eskf.gate").replace("VALUE", "4").replace("KIND", "level").replace(" N ", " 1 ");
        let (said, _) = ask(&vehicle(Some(false)), &example);
        assert!(!said.contains("usage") && !said.contains("no such command"), "{example}: {said}");
    }
}

#[test]
fn gains_that_were_found_are_taken_as_parameters_on_the_ground() {
    let found = AutotuneStatus {
        axis: AutotuneAxis::Pitch,
        stage: AutotuneStage::Done,
        kp: 7e-4,
        ti: 0.3,
        td: 0.02,
        ..AutotuneStatus::default()
    };
    let mut newest = vehicle(Some(false));
    assert!(!ask(&newest, "status").0.contains("autotune"));
    newest.note(Id::autotune as usize, Instant::ZERO, &found.to_words());
    assert!(ask(&newest, "status").0.contains("autotune Pitch: margins"));
    let taken = |newest: &Newest| {
        let (profile, mut config) = (Profile::new(&schedule::ACTIVATIONS), VehicleConfig::default());
        let mut console =
            Console { version: "1", newest, sensors: &[], profile: &profile, facts: &[], config: &mut config };
        let mut reply = String::new();
        let request = answer("autotune accept", Instant::from_secs(5), &mut console, &mut reply);
        assert_eq!(request, Ok(Request::Nothing), "{reply}");
        config.cascade.rate
    };
    let default = VehicleConfig::default().cascade.rate;
    let pitch = taken(&newest).pitch;
    assert_eq!((pitch.kp, pitch.ti, pitch.td, pitch.eta), (7e-4, 0.3, 0.02, default.pitch.eta));
    assert_eq!(taken(&newest).roll, default.roll);
    for armed in [None, Some(true)] {
        let mut newest = vehicle(armed);
        newest.note(Id::autotune as usize, Instant::ZERO, &found.to_words());
        assert_eq!(taken(&newest), default, "{armed:?}");
    }
    let stopped = AutotuneStatus { stage: AutotuneStage::Stopped, ..found };
    newest.note(Id::autotune as usize, Instant::ZERO, &stopped.to_words());
    assert_eq!(taken(&newest), default);
    assert!(ask(&newest, "autotune").0.contains("autotune accept"));
}

#[test]
fn a_calibration_is_refused_while_it_is_armed_and_what_was_found_is_taken_to_be_saved() {
    let found = CalibrationReport {
        kind: CalibrationKind::SixPositions,
        stage: CalibrationStage::Done,
        values: [0.1, -0.2, 0.3, 1.01, 1.0, 0.99, 0.0, 0.0, 0.0],
        ..CalibrationReport::default()
    };
    let taken = |newest: &Newest| {
        let (profile, mut config) = (Profile::new(&schedule::ACTIVATIONS), VehicleConfig::default());
        let mut console =
            Console { version: "1", newest, sensors: &[], profile: &profile, facts: &[], config: &mut config };
        let request = answer("calibrate accept", Instant::from_secs(5), &mut console, &mut String::new());
        (request.expect("a String takes everything"), config.corrections)
    };
    for armed in [None, Some(true)] {
        let mut newest = vehicle(armed);
        newest.note(Id::calibration_report as usize, Instant::ZERO, &found.to_words());
        let (said, request) = ask(&newest, "calibrate six");
        assert!(said.contains("armed") && !said.contains("lay it"), "{said}");
        assert_eq!((request, taken(&newest)), (Request::Nothing, (Request::Nothing, Default::default())), "{armed:?}");
        // What makes it safer is not refused.
        let cancel = Request::Vehicle(Command::Calibrate(Calibrate::Begin(CalibrationKind::None)));
        assert_eq!(ask(&newest, "calibrate cancel").1, cancel);
    }
    let mut newest = vehicle(Some(false));
    let begin = Request::Vehicle(Command::Calibrate(Calibrate::Begin(CalibrationKind::Level)));
    assert_eq!(ask(&newest, "calibrate level").1, begin);
    assert_eq!(taken(&newest), (Request::Nothing, Default::default()), "nothing was found");
    newest.note(Id::calibration_report as usize, Instant::ZERO, &found.to_words());
    let (request, corrections) = taken(&newest);
    assert_eq!((request, corrections.accel.bias.z, corrections.accel.scale.x), (Request::SaveParameters, 0.3, 1.01));
    assert!(ask(&newest, "calibrate status").0.contains("bias 0.100 -0.200 0.300 m/s^2"));
}
