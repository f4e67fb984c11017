//! Missions: what a ground station is to ask of the vehicle, one line a step.
//!
//! ```text
//! # comments and empty lines are skipped
//! arm
//! takeoff HEIGHT
//! goto NORTH EAST HEIGHT [yaw DEGREES] [speed M/S] [dwell SECONDS]
//! hover SECONDS
//! flip left|right|forward|back
//! autotune roll|pitch|yaw
//! mode stabilize|acro|althold|poshold
//! chop SECONDS
//! set PARAMETER VALUE
//! land
//! ```
//!
//! Steps may stand in one line, too, with `;` between them: `arm; takeoff 0.5; land`.
//!
//! Positions are metres from the take-off spot, heights above it. A step begins when the one before is done: `arm` when
//! the motors may turn, `takeoff` when the vehicle flies, `goto` when it has arrived and dwelt, `flip` when it
//! flies on, `autotune` when its time is over, `land` when it stands
//! and is disarmed. A place that cannot be reached is given up after [`LONGEST_LEG`].
//!
//! `mode` and `chop` are a pilot's: the mode switch is turned, the throttle stick is pulled to its
//! lowest for SECONDS, and then the pilot catches the vehicle. A program has neither, and passes
//! over them. `flip` and `autotune` are a program's; a pilot in a mode that holds height has one at
//! hand to turn over, and passes over `autotune`.

use super::pilot;
use crate::parameters;
use stampfly_control::autotune::AutotuneAxis;
use stampfly_sim::Noise;
use stampfly_sim::fault::Moment;
use stampfly_types::Duration;
use stampfly_types::messages::{FlightMode, FlipDirection};
use std::fmt;
use std::string::String;
use std::vec::Vec;
use std::{format, vec};

/// A place that is not reached in this time is given up, and the mission goes on to the next step. Ten metres at 0.3 m/s, the
/// slowest of the random missions, take 35 s.
pub const LONGEST_LEG: Duration = Duration::from_secs(50);

/// One step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Wait until nothing speaks against it, then arm.
    Arm,
    /// Climb.
    TakeOff {
        /// Above the take-off spot, m.
        height: f32,
    },
    /// Fly to a place.
    GoTo {
        /// North, east, up, m.
        place: [f32; 3],
        /// Heading there, degrees; `None` keeps the last one.
        yaw: Option<f32>,
        /// Highest speed, m/s; zero is the vehicle's own choice.
        speed: f32,
        /// Time to stay, s.
        dwell: f32,
    },
    /// Stay.
    Hover {
        /// How long, s.
        seconds: f32,
    },
    /// Turn over once, from a hover.
    Flip {
        /// Which way.
        direction: FlipDirection,
    },
    /// Measure a rate loop, from a hover.
    Autotune {
        /// Which one.
        axis: AutotuneAxis,
    },
    /// Turn the mode switch.
    Mode {
        /// To this.
        mode: FlightMode,
    },
    /// Pull the throttle stick to its lowest, and catch the vehicle.
    Chop {
        /// For how long it is there, s.
        seconds: f32,
    },
    /// Change a parameter of the vehicle.
    Set {
        /// Its place in the table.
        index: usize,
        /// Its new value.
        value: f32,
    },
    /// Land and disarm.
    Land,
}

/// A list of steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Mission {
    /// In the order to be flown.
    pub steps: Vec<Step>,
}

/// Where a mission cannot be understood.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MissionError {
    /// Line, from one; zero is the mission as a whole.
    pub line: usize,
    /// What is wrong.
    pub message: String,
}

impl fmt::Display for MissionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(f, "{}", self.message),
            line => write!(f, "line {line}: {}", self.message),
        }
    }
}

impl std::error::Error for MissionError {}

/// The mission `stampfly fly` flies when none is given.
pub const REFERENCE: &str = include_str!("../../missions/square.mission");
/// Take-off, a minute of hovering, landing.
pub const HOVER: &str = include_str!("../../missions/hover.mission");

/// The shortest flight that has every usual moment at which a fault can begin: for campaigns.
pub const SHORT: &str = "arm; takeoff 0.5; hover 2; goto 1 0 0.7; land";

/// Missions for campaigns, each for a moment that does not come in others. A flip needs height and
/// room above it, a chop some height to be caught in. The switch goes from a mode that holds height
/// to a manual one, or the other way. The gain is one that changes in flight, a tenth more of it.
pub const OCCASIONS: &[&str] = &[
    "arm; takeoff 1.5; hover 2; flip left; hover 2; land",
    "arm; takeoff 1; hover 2; mode poshold; hover 3; land",
    "arm; takeoff 1; hover 2; mode stabilize; hover 3; land",
    "arm; takeoff 1.5; hover 2; chop 0.3; hover 3; land",
    "arm; takeoff 0.5; hover 2; set rate.roll.kp 0.00044; hover 2; land",
];

/// Random number stream of random missions; the vehicle's own are below a thousand.
const STREAM: u64 = 1_000;

impl Mission {
    /// A mission drawn from a seed: take-off to 0.4 to 1 m, four to eight places within 1.5 m of it and 0.3 to 1.5 m
    /// high, in any heading, at 0.3 to 1.2 m/s, with up to two seconds at each, and landing.
    ///
    /// ```
    /// use stampfly_board::simulation::mission::{Mission, Step};
    /// let mission = Mission::random(1);
    /// assert!(mission.steps.len() >= 7 && mission.steps.last() == Some(&Step::Land));
    /// assert_ne!(mission, Mission::random(2));
    /// ```
    #[must_use]
    pub fn random(seed: u64) -> Self {
        let mut noise = Noise::new(seed, STREAM);
        let mut between = |low: f64, high: f64| (low + (high - low) * noise.unit()) as f32;
        let mut steps = vec![Step::Arm, Step::TakeOff { height: between(0.4, 1.0) }];
        for _ in 0..between(4.0, 9.0) as u32 {
            steps.push(Step::GoTo {
                place: [between(-1.5, 1.5), between(-1.5, 1.5), between(0.3, 1.5)],
                yaw: Some(between(-180.0, 180.0)),
                speed: between(0.3, 1.2),
                dwell: between(0.0, 2.0),
            });
        }
        steps.push(Step::Land);
        Self { steps }
    }

    /// Reads a mission.
    ///
    /// ```
    /// use stampfly_board::simulation::mission::{Mission, Step};
    /// let mission: Mission = Mission::parse("arm\ntakeoff 0.5\ngoto 1 0 0.5 yaw 90\nland\n")?;
    /// assert_eq!(mission.steps[1], Step::TakeOff { height: 0.5 });
    /// assert_eq!(Mission::parse("arm\ntakeoff high").unwrap_err().line, 2);
    /// # Ok::<(), stampfly_board::simulation::mission::MissionError>(())
    /// ```
    ///
    /// # Errors
    /// Names the line and what is wrong with it.
    pub fn parse(text: &str) -> Result<Self, MissionError> {
        let mut steps = Vec::new();
        for (index, line) in text.lines().enumerate() {
            for words in line.split('#').next().unwrap_or_default().split(';') {
                let words: Vec<&str> = words.split_whitespace().collect();
                let [verb, arguments @ ..] = words.as_slice() else { continue };
                let step = parse_step(verb, arguments).map_err(|message| MissionError { line: index + 1, message })?;
                steps.push(step);
            }
        }
        if steps.is_empty() {
            return Err(MissionError { line: 0, message: "the mission has no steps".into() });
        }
        Ok(Self { steps })
    }
}

impl Mission {
    /// The moments that come in a flight of this mission, by a program or by a pilot in a mode,
    /// when nothing goes wrong; in their order.
    ///
    /// ```
    /// use stampfly_board::simulation::mission::Mission;
    /// use stampfly_sim::fault::Moment;
    /// let mission = Mission::parse("arm; takeoff 1; hover 2; chop 0.3; land")?;
    /// assert!(!mission.moments(None).contains(&Moment::Chop), "a program has no stick");
    /// # Ok::<(), stampfly_board::simulation::mission::MissionError>(())
    /// ```
    #[must_use]
    pub fn moments(&self, pilot: Option<FlightMode>) -> Vec<Moment> {
        let mut comes = vec![Some(Moment::Calibration)];
        let mut mode = pilot;
        for step in &self.steps {
            comes.extend(match *step {
                Step::Arm => [Some(Moment::Ground), Some(Moment::Spool)],
                Step::TakeOff { .. } => [Some(Moment::TakeOff), None],
                Step::Hover { seconds } => [(seconds > 1.5).then_some(Moment::Hover), None],
                Step::GoTo { .. } => [Some(Moment::Hover), Some(Moment::Move)],
                Step::Flip { .. } => [mode.is_none_or(|mode| !mode.is_manual()).then_some(Moment::Flip), None],
                Step::Mode { mode: to } => {
                    let turns = mode.is_some_and(|mode| mode != to);
                    mode = mode.map(|_| to);
                    [turns.then_some(Moment::Mode), None]
                }
                Step::Chop { .. } => [mode.map(|_| Moment::Chop), None],
                Step::Set { .. } => [Some(Moment::Parameter), None],
                Step::Land => [Some(Moment::Landing), Some(Moment::Touch)],
                Step::Autotune { .. } => [None, None],
            });
        }
        Moment::ALL.into_iter().filter(|moment| comes.contains(&Some(*moment))).collect()
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Arm => f.write_str("arm"),
            Self::TakeOff { height } => write!(f, "takeoff {height}"),
            Self::GoTo { place: [north, east, up], yaw, speed, dwell } => {
                write!(f, "goto {north} {east} {up}")?;
                yaw.map_or(Ok(()), |yaw| write!(f, " yaw {yaw}"))?;
                // Zero is what is left out.
                [("speed", speed), ("dwell", dwell)]
                    .iter()
                    .filter(|(_, value)| *value != 0.0)
                    .try_for_each(|(name, value)| write!(f, " {name} {value}"))
            }
            Self::Hover { seconds } => write!(f, "hover {seconds}"),
            Self::Flip { direction } => {
                let (name, _) = DIRECTIONS.iter().find(|(_, known)| *known == direction).unwrap_or(&DIRECTIONS[0]);
                write!(f, "flip {name}")
            }
            Self::Autotune { axis } => {
                let (name, _) = AXES.iter().find(|(_, known)| *known == axis).unwrap_or(&AXES[0]);
                write!(f, "autotune {name}")
            }
            Self::Mode { mode } => {
                let known = |name: &&&str| pilot::mode_named(name) == Some(mode);
                write!(f, "mode {}", pilot::MODES.iter().find(known).unwrap_or(&"poshold"))
            }
            Self::Chop { seconds } => write!(f, "chop {seconds}"),
            Self::Set { index, value } => {
                let name = parameters::all().nth(index).map_or("", |info| info.name);
                write!(f, "set {name} {value}")
            }
            Self::Land => f.write_str("land"),
        }
    }
}

/// In one line.
impl fmt::Display for Mission {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, step) in self.steps.iter().enumerate() {
            write!(f, "{}{step}", if place == 0 { "" } else { "; " })?;
        }
        Ok(())
    }
}

/// Words for the steps.
const STEPS: [&str; 10] = ["arm", "takeoff", "goto", "hover", "flip", "autotune", "mode", "chop", "set", "land"];

/// Words for the ways to turn over.
const DIRECTIONS: [(&str, FlipDirection); 4] = [
    ("left", FlipDirection::Left),
    ("right", FlipDirection::Right),
    ("forward", FlipDirection::Forward),
    ("back", FlipDirection::Back),
];

/// Words for the axes.
const AXES: [(&str, AutotuneAxis); 3] =
    [("roll", AutotuneAxis::Roll), ("pitch", AutotuneAxis::Pitch), ("yaw", AutotuneAxis::Yaw)];

fn axis(word: Option<&&str>) -> Result<AutotuneAxis, String> {
    let word = word.ok_or("axis is missing")?;
    let known = AXES.iter().find(|(name, _)| name == word);
    known.map(|(_, axis)| *axis).ok_or_else(|| format!("'{word}' is none of roll, pitch, yaw"))
}

fn direction(word: Option<&&str>) -> Result<FlipDirection, String> {
    let word = word.ok_or("direction is missing")?;
    let known = DIRECTIONS.iter().find(|(name, _)| name == word);
    known.map(|(_, direction)| *direction).ok_or_else(|| format!("'{word}' is none of left, right, forward, back"))
}

fn mode(word: Option<&&str>) -> Result<FlightMode, String> {
    let word = word.ok_or("mode is missing")?;
    let known = pilot::MODES.contains(word).then(|| pilot::mode_named(word)).flatten();
    known.ok_or_else(|| format!("'{word}' is none of {}", pilot::MODES.join(", ")))
}

/// A parameter's place in the table, and a value in its range.
fn parameter(word: Option<&&str>, value: Option<&&str>) -> Result<(usize, f32), String> {
    let word = word.ok_or("parameter is missing")?;
    let mut table = parameters::all().enumerate();
    let (index, info) =
        table.find(|(_, info)| info.name == *word).ok_or_else(|| format!("there is no parameter '{word}'"))?;
    Ok((index, number(value, word, info.min..=info.max)?))
}

fn number(word: Option<&&str>, what: &str, range: std::ops::RangeInclusive<f32>) -> Result<f32, String> {
    let word = word.ok_or_else(|| format!("{what} is missing"))?;
    let value: f32 = word.parse().map_err(|_| format!("{what}: '{word}' is no number"))?;
    let (low, high) = (range.start(), range.end());
    if range.contains(&value) { Ok(value) } else { Err(format!("{what}: {value} is not from {low} to {high}")) }
}

fn parse_step(verb: &str, arguments: &[&str]) -> Result<Step, String> {
    let (step, used) = match verb {
        "arm" => (Step::Arm, 0),
        "land" => (Step::Land, 0),
        "takeoff" => (Step::TakeOff { height: number(arguments.first(), "height", 0.1..=10.0)? }, 1),
        "hover" => (Step::Hover { seconds: number(arguments.first(), "seconds", 0.0..=3600.0)? }, 1),
        "flip" => (Step::Flip { direction: direction(arguments.first())? }, 1),
        "autotune" => (Step::Autotune { axis: axis(arguments.first())? }, 1),
        "mode" => (Step::Mode { mode: mode(arguments.first())? }, 1),
        "chop" => (Step::Chop { seconds: number(arguments.first(), "seconds", 0.02..=10.0)? }, 1),
        "set" => {
            let (index, value) = parameter(arguments.first(), arguments.get(1))?;
            (Step::Set { index, value }, 2)
        }
        "goto" => return parse_goto(arguments),
        other => {
            return Err(format!("'{other}' is no step; steps are {}", STEPS.join(", ")));
        }
    };
    match arguments.get(used) {
        Some(extra) => Err(format!("'{extra}' is too much")),
        None => Ok(step),
    }
}

fn parse_goto(arguments: &[&str]) -> Result<Step, String> {
    let place = [
        number(arguments.first(), "north", -100.0..=100.0)?,
        number(arguments.get(1), "east", -100.0..=100.0)?,
        number(arguments.get(2), "height", 0.1..=10.0)?,
    ];
    let (mut yaw, mut speed, mut dwell) = (None, 0.0, 0.0);
    for pair in arguments[3..].chunks(2) {
        let value = pair.get(1);
        match pair[0] {
            "yaw" => yaw = Some(number(value, "yaw", -360.0..=360.0)?),
            "speed" => speed = number(value, "speed", 0.05..=5.0)?,
            "dwell" => dwell = number(value, "dwell", 0.0..=3600.0)?,
            other => return Err(format!("'{other}' is none of yaw, speed, dwell")),
        }
    }
    Ok(Step::GoTo { place, yaw, speed, dwell })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::string::ToString;

    #[test]
    fn the_built_in_missions_are_missions() {
        for text in [REFERENCE, HOVER, SHORT].iter().chain(OCCASIONS) {
            let mission = Mission::parse(text).expect("a mission");
            assert_eq!((mission.steps[0], mission.steps.last()), (Step::Arm, Some(&Step::Land)));
        }
    }

    #[test]
    fn a_mission_survives_its_text() {
        for seed in 0..100 {
            let mission = Mission::random(seed);
            assert_eq!(Mission::parse(&mission.to_string()), Ok(mission));
        }
        let text = "arm; takeoff 0.5; goto 1 0 0.5 yaw 90 speed 0.5 dwell 1; hover 2; flip back; autotune yaw; \
                    mode acro; chop 0.25; set rate.roll.kp 0.00045; land";
        assert_eq!(Mission::parse(text).expect("a mission").to_string(), text);
    }

    #[test]
    fn mistakes_are_named() {
        let message = |text: &str| Mission::parse(text).expect_err("a mistake").to_string();
        assert_eq!(
            message("arm\n\nfly 3"),
            "line 3: 'fly' is no step; steps are arm, takeoff, goto, hover, flip, autotune, mode, chop, set, land"
        );
        assert_eq!(message("takeoff"), "line 1: height is missing");
        assert_eq!(message("takeoff NaN"), "line 1: height: NaN is not from 0.1 to 10");
        assert_eq!(message("goto 1 2 0.5 yaw"), "line 1: yaw is missing");
        assert_eq!(message("flip over"), "line 1: 'over' is none of left, right, forward, back");
        assert_eq!(message("land now"), "line 1: 'now' is too much");
        assert_eq!(message("mode loiter"), "line 1: 'loiter' is none of stabilize, acro, althold, poshold");
        assert_eq!(message("chop"), "line 1: seconds is missing");
        assert_eq!(message("set rate.roll 1"), "line 1: there is no parameter 'rate.roll'");
        assert!(message("set rate.roll.kp 9").starts_with("line 1: rate.roll.kp: 9 is not from "));
        assert_eq!(message("set rate.roll.kp"), "line 1: rate.roll.kp is missing");
        assert_eq!(message("# nothing"), "the mission has no steps");
    }

    /// Every moment comes by a program or in some mode of a pilot, in a mission that campaigns fly.
    #[test]
    fn there_is_a_mission_for_every_moment() {
        let missions: Vec<_> = [SHORT].iter().chain(OCCASIONS).filter_map(|text| Mission::parse(text).ok()).collect();
        let modes = pilot::MODES.iter().filter_map(|name| pilot::mode_named(name));
        let comes = |pilot: Option<FlightMode>| missions.iter().flat_map(move |mission| mission.moments(pilot));
        let mut left = Moment::ALL.to_vec();
        for pilot in [None].into_iter().chain(modes.map(Some)) {
            let here: Vec<_> = comes(pilot).collect();
            assert!(Moment::USUAL.iter().all(|moment| here.contains(moment)), "{pilot:?}");
            left.retain(|moment| !here.contains(moment));
        }
        assert_eq!(left, []);
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(text in "[a-z0-9 .#\\n-]{0,200}") {
            let _ = Mission::parse(&text);
        }
    }
}
