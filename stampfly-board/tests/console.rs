//! A conversation with the vehicle.

use proptest::prelude::*;
use stampfly_board::console::{Context, Newest, Request, SensorLine, answer};
use stampfly_board::parameters::PARAMETERS;
use stampfly_board::profile::Profile;
use stampfly_board::tasks::Health;
use stampfly_board::{VehicleConfig, wiring};
use stampfly_types::messages::{
    Alerts, ArmBlocks, FlightMode, FlightState, ImuData, PilotInput, PowerData, SystemAlert, SystemMode,
};
use stampfly_types::{Instant, Message, Vec3};

/// A board with everything the console may want to know.
struct Board {
    newest: Newest,
    profile: Profile,
    health: Health,
    config: VehicleConfig,
}

impl Board {
    fn new() -> Self {
        Self { newest: Newest::new(), profile: Profile::new(), health: Health::new(), config: VehicleConfig::default() }
    }

    fn in_state(armed: bool) -> Self {
        let mut board = Self::new();
        let state = if armed { FlightState::Flying } else { FlightState::IdleGround };
        let blocks = ArmBlocks::LOW_BATTERY | ArmBlocks::THROTTLE;
        let mode = SystemMode { state, armed, mode: FlightMode::AltHold, blocks, ..Default::default() };
        board.newest.note(wiring::Id::system_mode, Instant::ZERO, &mode.to_words());
        board
    }

    fn ask(&mut self, line: &str) -> (String, Request) {
        let mut reply = String::new();
        let mut context = Context {
            now: Instant::from_secs(5),
            version: "stampfly 9.9",
            newest: &self.newest,
            sensors: &[SensorLine { name: "imu", health: &self.health }],
            profile: &self.profile,
            config: &mut self.config,
        };
        let request = answer(line, &mut context, &mut reply).expect("a String takes everything");
        (reply, request)
    }

    fn says(&mut self, line: &str) -> String {
        self.ask(line).0
    }
}

#[test]
fn status_says_what_keeps_it_from_arming() {
    let mut board = Board::in_state(false);
    let alert = SystemAlert { active: Alerts::COMM_LOST, ..Default::default() };
    board.newest.note(wiring::Id::system_alert, Instant::ZERO, &alert.to_words());
    let power = PowerData { voltage: 3.456, current: 0.5, power: 1.7 };
    board.newest.note(wiring::Id::sensor_power, Instant::ZERO, &power.to_words());
    board.newest.note(wiring::Id::command_pilot, Instant::from_millis(4_980), &PilotInput::default().to_words());
    let said = board.says("status");
    for part in
        ["IdleGround, disarmed", "AltHold", "LOW_BATTERY THROTTLE", "COMM_LOST", "3.46 V", "20 ms ago", "awake    5 s"]
    {
        assert!(said.contains(part), "{part} is missing:\n{said}");
    }
    assert!(Board::new().says("status").contains("never heard"), "a vehicle that has published nothing has a status");
}

#[test]
fn sensors_and_topics_are_shown_with_their_units() {
    let mut board = Board::new();
    let sample = ImuData { accel: Vec3::new(0.5, -0.25, -9.75), gyro: Vec3::zeros(), temperature: 31.5 };
    board.newest.note(wiring::Id::sensor_imu, Instant::from_millis(4_000), &sample.to_words());
    let said = board.says("sensor imu");
    assert!(said.contains("1000 ms old") && said.contains("accel 0.5 -0.25 -9.75 m/s^2"), "{said}");
    assert_eq!(board.says("topic sensor_imu"), said);
    assert_eq!(board.says("sensor tof"), "nothing yet\r\n");
    assert_eq!(board.says("sensor nose"), "there is no such topic\r\n");
    let mode = Board::in_state(false).says("topic system_mode");
    assert!(mode.contains("blocks LOW_BATTERY THROTTLE") && mode.contains("state IdleGround"), "{mode}");
    assert!(board.says("sensor").lines().any(|line| line.starts_with("imu") && line.ends_with("none")));
}

#[test]
fn parameters_can_be_listed_changed_and_not_broken() {
    let mut board = Board::new();
    assert_eq!(board.says("param list").lines().count(), PARAMETERS.len());
    assert!(board.says("param list rate.yaw").lines().all(|line| line.starts_with("rate.yaw")));
    assert!(board.says("param set hover.thrust 0.4").contains("0.4"));
    assert_eq!(board.config.cascade.altitude.hover_thrust, 0.4);
    for hopeless in ["0.7", "nan", "inf", "-1", "fast", ""] {
        board.says(&format!("param set hover.thrust {hopeless}"));
        assert_eq!(board.config.cascade.altitude.hover_thrust, 0.4, "after {hopeless}");
    }
    assert!(board.says("param get hover.thrust").contains("0.1 to 0.6 N"));
    assert!(board.says("param get hover.trust").contains("no such parameter"));
}

#[test]
fn what_must_not_happen_in_flight_is_refused_in_flight_and_before_anything_is_known() {
    let requests = [
        ("param save", Request::SaveParameters),
        ("param reset", Request::ResetParameters),
        ("pair", Request::Pair),
        ("motor test 3 10", Request::TestMotor { motor: 3, duty: 0.1 }),
        ("log dump", Request::DumpLog),
        ("reboot", Request::Reboot),
    ];
    for (line, request) in requests {
        assert_eq!(Board::in_state(false).ask(line), (String::new(), request), "{line}");
        let because = [
            (Board::in_state(true), "the vehicle is armed\r\n"),
            (Board::new(), "nobody knows yet whether the vehicle is armed\r\n"),
        ];
        for (mut board, reason) in because {
            let (said, request) = board.ask(line);
            assert_eq!((said.as_str(), request), (reason, Request::Nothing), "{line}");
        }
    }
    assert_eq!(Board::in_state(true).ask("motor stop").1, Request::StopMotor, "stopping is always allowed");
}

#[test]
fn everything_in_the_help_is_understood() {
    let help = Board::in_state(false).says("help");
    assert!(help.lines().count() > 10);
    for line in help.lines() {
        let (usage, _) = line.split_at(24);
        let example = usage.replace("[NAME]", "imu").replace("[PREFIX]", "rate").replace("PERCENT", "5");
        let example = example.replace(" NAME", " eskf.gate").replace("VALUE", "4").replace(" N ", " 1 ");
        let said = Board::in_state(false).says(&example);
        assert!(!said.contains("usage") && !said.contains("no such command"), "{example}: {said}");
    }
    assert_eq!(Board::new().ask("   "), (String::new(), Request::Nothing));
    assert!(Board::new().says("status now").contains("no such command"));
    assert!(Board::new().says("motor test 1").contains("usage: motor test N PERCENT"));
}

#[test]
fn the_profile_is_a_table() {
    let said = Board::new().says("profile");
    assert_eq!(said.lines().count(), 2 + stampfly_board::plan::COUNT);
    assert!(said.lines().any(|line| line.starts_with("estimation")));
}

proptest! {
    #[test]
    fn any_line_gets_an_answer(line in "[ -~]{0,80}", armed: bool) {
        let (reply, _) = Board::in_state(armed).ask(&line);
        prop_assert!(reply.is_empty() || reply.ends_with("\r\n"));
    }

    #[test]
    fn any_words_of_ours_get_an_answer(
        words in prop::collection::vec(
            prop::sample::select(vec![
                "param", "set", "get", "list", "save", "eskf.gate", "1e39", "-0", "nan", "motor", "test", "1", "99%",
                "sensor", "imu", "topic", "log", "dump", "help", "profile",
            ]),
            0..7,
        ),
    ) {
        let mut board = Board::in_state(false);
        board.ask(&words.join(" "));
        prop_assert!((1.0..=20.0).contains(&board.config.eskf.gate));
    }
}
