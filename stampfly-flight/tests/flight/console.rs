//! A conversation with the rover.

use crate::common::topics::{self, Id};
use crate::common::{ACTIVATIONS, COUNT};
use core::fmt;
use proptest::prelude::*;
use stampfly_bus::TopicInfo;
use stampfly_flight::console::{COMMANDS, Command, CommandError, Request, SensorLine, Vehicle, answer};
use stampfly_flight::profile::Rows;
use stampfly_flight::{NewestSamples, Profile, longest_message};
use stampfly_param::{ParameterError, ParameterInfo, Parameters};
use stampfly_types::messages::{FlightStatus, TofData};
use stampfly_types::{Instant, Message};

static PROFILE: Profile<COUNT> = Profile::new(&ACTIVATIONS);

struct Gains([f32; 3]);

impl Parameters for Gains {
    fn describe(&self, index: usize) -> Option<ParameterInfo<'_>> {
        let [near, far, turn] = ["drive.near", "drive.far", "turn.rate"];
        let (name, unit) = *[(near, "1/m"), (far, "1/m"), (turn, "1")].get(index)?;
        Some(ParameterInfo { name, unit, min: 0.25, max: 2.0, meaning: "duty per metre", in_flight: name == far })
    }

    fn get(&self, index: usize) -> Option<f32> {
        self.0.get(index).copied()
    }

    fn set(&mut self, index: usize, value: f32) -> Result<(), ParameterError> {
        *self.0.get_mut(index).ok_or(ParameterError::Unknown)? = value;
        Ok(())
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Wheel {
    Turn(u8),
    Stop,
}

struct Rover<'c> {
    newest: NewestSamples<{ topics::COUNT }, { longest_message(&topics::TOPICS) }>,
    sensors: &'c [SensorLine<'c>],
    gains: Gains,
}

impl Vehicle for Rover<'_> {
    type Command = Wheel;
    type Request = Wheel;
    const COMMANDS: &'static [(&'static str, &'static str)] =
        &[("wheel turn N", "turn a wheel"), ("wheel stop", "stop")];
    const TOPICS: &'static [TopicInfo] = &topics::TOPICS;

    fn is_armed(&self) -> Option<bool> {
        self.newest.get::<FlightStatus>(Id::flight_status as usize).map(|(_, mode)| mode.armed)
    }

    fn version(&self) -> &str {
        "rover 9.9"
    }

    fn status(&self, now: Instant, reply: &mut dyn fmt::Write) -> fmt::Result {
        write!(reply, "awake {now}\r\n")
    }

    fn newest(&self, topic: usize) -> Option<(Instant, &[u32])> {
        self.newest.words(topic)
    }

    fn sensors(&self) -> &[SensorLine<'_>] {
        self.sensors
    }

    fn profile(&self) -> Rows<'_> {
        PROFILE.rows()
    }

    fn parameters(&mut self) -> &mut dyn Parameters {
        &mut self.gains
    }

    fn parse(words: &[&str]) -> Result<Wheel, CommandError> {
        const USAGE: CommandError = CommandError::Usage("wheel turn N | stop");
        match words {
            ["wheel", "turn", wheel] => wheel.parse().map(Wheel::Turn).map_err(|_| USAGE),
            ["wheel", "stop"] => Ok(Wheel::Stop),
            ["wheel", ..] => Err(USAGE),
            _ => Err(CommandError::Unknown),
        }
    }

    fn answer(&mut self, wheel: Wheel, _: Instant, _: &mut dyn fmt::Write) -> Result<Option<Wheel>, fmt::Error> {
        Ok(Some(wheel))
    }

    fn needs_disarmed(request: &Wheel) -> bool {
        *request != Wheel::Stop
    }
}

impl Rover<'_> {
    /// Armed, disarmed, or just switched on.
    fn new(armed: Option<bool>) -> Self {
        let mut newest = NewestSamples::new();
        if let Some(armed) = armed {
            let mode = FlightStatus { armed, ..Default::default() };
            newest.note(Id::flight_status as usize, Instant::ZERO, &mode.to_words());
        }
        const SENSORS: &[SensorLine<'static>] = &[
            SensorLine { name: "range", samples: 70, errors: 2, last_error: Some(&"no echo") },
            SensorLine { name: "bumper", samples: 0, errors: 0, last_error: None },
        ];
        Rover { newest, sensors: SENSORS, gains: Gains([0.5, 1.0, 1.5]) }
    }

    fn ask(&mut self, line: &str) -> (String, Request<Wheel>) {
        let mut reply = String::new();
        let request = answer(line, Instant::from_secs(5), self, &mut reply).expect("a String takes everything");
        (reply, request)
    }

    fn says(&mut self, line: &str) -> String {
        self.ask(line).0
    }
}

#[test]
fn sensors_and_topics_are_shown_with_their_units() {
    let mut rover = Rover::new(Some(false));
    let range = TofData { distance: 0.5, valid: true, ..Default::default() };
    rover.newest.note(Id::sensor_range as usize, Instant::from_secs(4), &range.to_words());
    let said = rover.says("sensor range");
    assert!(said.contains("1000 ms old") && said.contains("distance 0.5 m"), "{said}");
    assert_eq!(rover.says("topic sensor_range"), said);
    assert_eq!(rover.says("topic actuator_motor"), "no sample yet\r\n");
    assert_eq!(rover.says("sensor nose"), "there is no such topic\r\n");
    let said = rover.says("sensor");
    let lines: Vec<&str> = said.lines().collect();
    assert!(lines[1].starts_with("range ") && lines[1].ends_with("70         2  no echo"), "{said}");
    assert!(lines[2].starts_with("bumper ") && lines[2].ends_with("none"), "{said}");
}

#[test]
fn parameters_can_be_listed_changed_and_not_broken() {
    let mut rover = Rover::new(Some(true));
    assert_eq!(rover.says("param list").lines().count(), 3);
    assert!(rover.says("param list drive").lines().all(|line| line.starts_with("drive.") && line.ends_with(" 1/m")));
    assert!(rover.says("param set drive.far 0.75").starts_with(&format!("{:30}0.75 ", "drive.far")));
    assert_eq!(rover.gains.0, [0.5, 0.75, 1.5]);
    for hopeless in ["2.1", "nan", "inf", "-1", "1e39", "fast", ""] {
        rover.says(&format!("param set drive.far {hopeless}"));
        assert_eq!(rover.gains.0, [0.5, 0.75, 1.5], "after {hopeless}");
    }
    let said = rover.says("param get drive.far");
    assert!(said.ends_with("0.25 to 2 1/m\r\nduty per metre, may change in flight\r\n"), "{said}");
    let said = rover.says("param set drive.near 0.75");
    assert!(said.ends_with("0.25 to 2 1/m\r\nnot in flight: waits until the vehicle is disarmed\r\n"), "{said}");
    assert!(!Rover::new(Some(false)).says("param set drive.near 0.75").contains("waits"));
    assert!(rover.says("param get drive.fra").contains("no such parameter"));
}

#[test]
fn what_must_not_happen_in_motion_is_refused_in_motion_and_before_anything_is_known() {
    let requests = [
        ("param save", Request::SaveParameters),
        ("param reset", Request::ResetParameters),
        ("log dump", Request::DumpLog),
        ("reboot", Request::Reboot),
        ("hil", Request::Reboot),
        ("wheel turn 3", Request::Vehicle(Wheel::Turn(3))),
    ];
    for (line, request) in requests {
        assert_eq!(Rover::new(Some(false)).ask(line), (String::new(), request), "{line}");
        let (said, request) = Rover::new(Some(true)).ask(line);
        assert_eq!((said.as_str(), request), ("the vehicle is armed\r\n", Request::Nothing), "{line}");
        let (said, request) = Rover::new(None).ask(line);
        assert!(said.contains("not known yet") && request == Request::Nothing, "{line}");
    }
    assert_eq!(Rover::new(Some(true)).ask("wheel stop").1, Request::Vehicle(Wheel::Stop), "always allowed");
}

#[test]
fn everything_in_the_help_is_understood() {
    let help = Rover::new(Some(false)).says("help");
    assert_eq!(help.lines().count(), COMMANDS.len() + 2);
    for line in help.lines() {
        let example = line.split_at(24).0.replace("[NAME]", "range").replace("[PREFIX]", "drive");
        let example = example.replace(" NAME", " drive.far").replace("VALUE", "1").replace(" N ", " 1 ");
        let said = Rover::new(Some(false)).says(&example);
        assert!(!said.contains("usage") && !said.contains("no such command"), "{example}: {said}");
    }
    assert_eq!(Rover::new(None).ask("   "), (String::new(), Request::Nothing));
    assert_eq!(Rover::new(None).says("version"), "rover 9.9\r\n");
    assert_eq!(Rover::new(None).says("status"), "awake 5.000000 s\r\n");
    assert_eq!(Rover::new(None).says("profile").lines().count(), 2 + COUNT);
}

#[test]
fn what_is_no_command_has_a_reason() {
    let parse = |line| Command::parse::<Rover<'_>>(line);
    assert_eq!(parse("status now"), Err(CommandError::Unknown));
    assert_eq!(parse("topic"), Err(CommandError::Usage("topic NAME")));
    assert_eq!(parse("sensor a b"), Err(CommandError::Usage("sensor [NAME]")));
    assert_eq!(parse("wheel turn 256"), Err(CommandError::Usage("wheel turn N | stop")));
    assert_eq!(parse("1 2 3 4 5 6 7 8"), Err(CommandError::Unknown));
    assert_eq!(parse("1 2 3 4 5 6 7 8 9"), Err(CommandError::TooManyWords));
}

proptest! {
    #[test]
    fn any_line_gets_an_answer(line in ".{0,80}", armed: Option<bool>) {
        let (reply, _) = Rover::new(armed).ask(&line);
        prop_assert!(reply.is_empty() || reply.ends_with("\r\n"));
    }

    #[test]
    fn no_words_leave_a_parameter_out_of_its_range(
        words in prop::collection::vec(
            prop::sample::select(vec![
                "param", "set", "get", "list", "save", "drive.far", "1e39", "-0", "nan", "wheel", "turn", "1", "99",
                "sensor", "range", "topic", "log", "dump", "help", "profile",
            ]),
            0..10,
        ),
    ) {
        let mut rover = Rover::new(Some(false));
        rover.ask(&words.join(" "));
        prop_assert!(rover.gains.0.iter().all(|gain| (0.25..=2.0).contains(gain)));
    }
}
