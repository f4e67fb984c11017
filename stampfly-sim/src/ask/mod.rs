//! Requests of a page or another program to a vehicle, as JSON.
//!
//! Used at both ends: a server parses every message into an [`Asked`], and the vehicle carries it
//! out and answers with a [`Reply`]. Independent of any particular vehicle: [`Guided`] becomes a
//! [`GuidedCommand`](stampfly_types::messages::GuidedCommand) and [`Sticks`] a
//! [`PilotInput`](stampfly_types::messages::PilotInput), the messages of all radio links.
//!
//! A request is a JSON object with `vehicle` (its number), `id` (chosen by the page and repeated in
//! the answer), `do`, and the fields of this request. An optional `at` is the time of the request,
//! by which delayed requests are refused:
//!
//! ```
//! use stampfly_sim::ask::{Ask, Asked, Guided};
//!
//! let text = r#"{"vehicle":0,"id":17,"do":"guided","kind":"take_off","height":0.5}"#;
//! let asked = Asked::parse(text)?;
//! assert_eq!((asked.vehicle, asked.id), (0, 17));
//! assert_eq!(asked.ask, Ask::Guided(Guided::TakeOff { height: 0.5 }));
//! assert!(Asked::parse(r#"{"vehicle":0,"id":17,"do":"guided","kind":"take_off","height":"much"}"#).is_err());
//! # Ok::<(), stampfly_sim::ask::AskError>(())
//! ```
//!
//! Parsing is strict: an unknown field, a number that is not finite or out of range, or a text that
//! is too long refuses the whole request.

mod guided;
mod incoming;
mod reply;

pub use guided::{Axis, Direction, FARTHEST, Guided, HIGHEST, Mode, Sticks};
pub use incoming::{FASTEST_RATE, Incoming, MOST_TOPICS};
pub use reply::{Reply, reply_text};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::fmt;

/// Longest request, bytes.
pub const LONGEST: usize = 4096;
/// Longest text within a request (a console line, a fault, a name), bytes.
pub const LONGEST_TEXT: usize = 256;
/// Largest `at`, ms: thirty years.
const LATEST: f64 = 1e12;
/// Largest number of a vehicle.
const VEHICLES: u64 = 1000;

/// A request to one vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Asked {
    /// Number of the vehicle, from 0.
    pub vehicle: usize,
    /// Chosen by the page and repeated in the answer.
    pub id: u32,
    /// Time of the request, ms, by the clock that the server announces to its pages. Without it the
    /// time of arrival counts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<f64>,
    /// The request.
    #[serde(flatten)]
    pub ask: Ask,
}

/// Content of a request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub enum Ask {
    /// A guided command.
    Guided(Guided),
    /// Stick and switch positions, sent repeatedly during manual flight. Not answered.
    Sticks(Sticks),
    /// Keep-alive, at least once a second; otherwise the vehicle declares the link lost. Not
    /// answered.
    Alive {},
    /// Changes a parameter.
    ParamSet {
        /// Its name.
        name: String,
        /// The new value, in the parameter's unit.
        value: f32,
    },
    /// Reads a parameter.
    ParamGet {
        /// Its name.
        name: String,
    },
    /// Saves the parameters for the next start.
    ParamSave {},
    /// A line for the vehicle's console. The answer contains the console's output.
    Console {
        /// The line without terminator.
        line: String,
    },
    /// Runs one motor of the disarmed vehicle for at most the vehicle's own time limit. Repeated
    /// while a button is held.
    MotorTest {
        /// Number of the motor, from 1.
        motor: u8,
        /// Duty, 0 to 1.
        duty: f32,
    },
    /// Stops the motor test.
    MotorStop {},
    /// Injects a fault in the syntax of [`Fault::parse`](crate::fault::Fault::parse). A begin in
    /// the past (`@0`) means now; the duration counts from then.
    Fault {
        /// The text.
        text: String,
    },
    /// Ends all faults.
    FaultClear {},
    /// Sets the speed of virtual time relative to the wall clock; 0 pauses.
    Speed {
        /// Factor, at most [`FASTEST`].
        factor: f32,
    },
}

/// Largest speed factor.
pub const FASTEST: f32 = 100.0;

/// Why a request was refused.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AskError {
    /// More than [`LONGEST`] bytes, or a text of more than [`LONGEST_TEXT`] bytes.
    TooLong,
    /// Not a JSON object.
    NotJson,
    /// This number is missing, not an integer, or too large.
    Missing(&'static str),
    /// Unknown request, unknown or missing field, or wrong type; the text names it.
    Unknown(String),
    /// This value is out of its range.
    OutOfRange(&'static str),
    /// A text contains control characters.
    NotPrintable,
}

impl fmt::Display for AskError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooLong => write!(f, "longer than {LONGEST} bytes, or with a text longer than {LONGEST_TEXT}"),
            Self::NotJson => f.write_str("no JSON object"),
            Self::Missing(name) => write!(f, "'{name}' is missing or not the number it has to be"),
            Self::Unknown(why) => f.write_str(why),
            Self::OutOfRange(name) => write!(f, "'{name}' is out of its range"),
            Self::NotPrintable => f.write_str("a text with control characters"),
        }
    }
}

impl std::error::Error for AskError {}

/// Parses the text as a JSON object.
fn object(text: &str) -> Result<Map<String, Value>, AskError> {
    if text.len() > LONGEST {
        return Err(AskError::TooLong);
    }
    serde_json::from_str(text).map_err(|_| AskError::NotJson)
}

impl Asked {
    /// Parses a request.
    ///
    /// # Errors
    /// [`AskError`] if the text is not a valid request.
    pub fn parse(text: &str) -> Result<Self, AskError> {
        Self::from_object(object(text)?)
    }

    fn from_object(mut object: Map<String, Value>) -> Result<Self, AskError> {
        // These fields are removed from the object, since the request itself denies unknown fields.
        let mut number = |name, highest| {
            let number = object.remove(name).and_then(|value| value.as_u64()).filter(|number| *number <= highest);
            number.ok_or(AskError::Missing(name))
        };
        let vehicle = number("vehicle", VEHICLES)? as usize;
        let id = number("id", u32::MAX.into())? as u32;
        let at = match object.remove("at") {
            None => None,
            Some(at) => Some(at.as_f64().filter(|at| (0.0..=LATEST).contains(at)).ok_or(AskError::Missing("at"))?),
        };
        let ask: Ask = serde_json::from_value(object.into()).map_err(|error| AskError::Unknown(error.to_string()))?;
        ask.check()?;
        Ok(Self { vehicle, id, at, ask })
    }
}

/// Names of all requests.
pub const NAMES: &[&str] = &[
    "guided",
    "sticks",
    "alive",
    "param_set",
    "param_get",
    "param_save",
    "console",
    "motor_test",
    "motor_stop",
    "fault",
    "fault_clear",
    "speed",
];

impl Ask {
    /// Its name: the value of `do`.
    ///
    /// ```
    /// use stampfly_sim::ask::Ask;
    /// assert_eq!(Ask::ParamSave {}.name(), "param_save");
    /// ```
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Guided(_) => "guided",
            Self::Sticks(_) => "sticks",
            Self::Alive {} => "alive",
            Self::ParamSet { .. } => "param_set",
            Self::ParamGet { .. } => "param_get",
            Self::ParamSave {} => "param_save",
            Self::Console { .. } => "console",
            Self::MotorTest { .. } => "motor_test",
            Self::MotorStop {} => "motor_stop",
            Self::Fault { .. } => "fault",
            Self::FaultClear {} => "fault_clear",
            Self::Speed { .. } => "speed",
        }
    }

    /// True for requests that are carried out regardless of their age: those that end a flight or
    /// stop a motor.
    #[must_use]
    pub const fn is_never_late(&self) -> bool {
        matches!(
            self,
            Self::Guided(Guided::Kill {} | Guided::Land {})
                | Self::MotorStop {}
                | Self::Sticks(Sticks { kill: true, .. })
        )
    }

    /// True for requests that are sent repeatedly and not answered.
    #[must_use]
    pub const fn is_repeated(&self) -> bool {
        matches!(self, Self::Sticks(_) | Self::Alive {})
    }

    /// Checks ranges of values, and length and characters of texts.
    fn check(&self) -> Result<(), AskError> {
        // Not `!(a..b)`: NaN must be outside every range.
        let within = |name, value: f32, low: f32, high: f32| {
            (low..=high).contains(&value).then_some(()).ok_or(AskError::OutOfRange(name))
        };
        match self {
            Self::Guided(guided) => guided.check(&within),
            Self::Sticks(Sticks { roll, pitch, yaw, throttle, .. }) => {
                let sticks = [("roll", roll), ("pitch", pitch), ("yaw", yaw), ("throttle", throttle)];
                sticks.into_iter().try_for_each(|(name, value)| within(name, *value, -1.0, 1.0))
            }
            Self::ParamSet { name, value } => {
                printable(name)?;
                within("value", *value, f32::MIN, f32::MAX)
            }
            Self::ParamGet { name: text } | Self::Console { line: text } | Self::Fault { text } => printable(text),
            Self::MotorTest { motor, duty } => {
                within("motor", f32::from(*motor), 1.0, 8.0)?;
                within("duty", *duty, 0.0, 1.0)
            }
            Self::Speed { factor } => within("factor", *factor, 0.0, FASTEST),
            Self::Alive {} | Self::ParamSave {} | Self::MotorStop {} | Self::FaultClear {} => Ok(()),
        }
    }
}

fn printable(text: &str) -> Result<(), AskError> {
    if text.len() > LONGEST_TEXT {
        return Err(AskError::TooLong);
    }
    if text.chars().any(char::is_control) { Err(AskError::NotPrintable) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use stampfly_types::Vec3;
    use stampfly_types::messages::{GuidedCommand, GuidedKind};

    fn with(rest: &str) -> Result<Ask, AskError> {
        Asked::parse(&format!(r#"{{"vehicle":2,"id":7,{rest}}}"#)).map(|asked| asked.ask)
    }

    #[test]
    fn every_ask_is_read() {
        let asks = [
            (r#""do":"guided","kind":"arm""#, Ask::Guided(Guided::Arm {})),
            (
                r#""do":"guided","kind":"go_to","north":1,"east":-2.5,"up":0.5,"yaw":0"#,
                Ask::Guided(Guided::GoTo { north: 1.0, east: -2.5, up: 0.5, yaw: 0.0, speed: 0.0, dwell: 0.0 }),
            ),
            (
                r#""do":"guided","kind":"flip","direction":"back""#,
                Ask::Guided(Guided::Flip { direction: Direction::Back }),
            ),
            (
                r#""do":"sticks","roll":0,"pitch":-1,"yaw":1,"throttle":0.5,"mode":"althold","arm":true,"kill":false"#,
                Ask::Sticks(Sticks {
                    pitch: -1.0,
                    yaw: 1.0,
                    throttle: 0.5,
                    mode: Mode::AltHold,
                    arm: true,
                    ..Default::default()
                }),
            ),
            (
                r#""do":"param_set","name":"eskf.gate","value":3.5"#,
                Ask::ParamSet { name: "eskf.gate".into(), value: 3.5 },
            ),
            (r#""do":"param_save""#, Ask::ParamSave {}),
            (r#""do":"console","line":"status""#, Ask::Console { line: "status".into() }),
            (r#""do":"motor_test","motor":3,"duty":0.1"#, Ask::MotorTest { motor: 3, duty: 0.1 }),
            (r#""do":"fault","text":"tof-stuck=0.03""#, Ask::Fault { text: "tof-stuck=0.03".into() }),
            (r#""do":"speed","factor":0.5"#, Ask::Speed { factor: 0.5 }),
        ];
        for (text, ask) in asks {
            assert!(NAMES.contains(&ask.name()) && text.contains(&format!("\"do\":\"{}\"", ask.name())), "{text}");
            assert_eq!(with(text), Ok(ask), "{text}");
        }
    }

    #[test]
    fn what_is_not_exactly_an_ask_is_refused() {
        let unknown = [
            r#""do":"guided","kind":"arm","extra":1"#,
            r#""do":"guided","kind":"fly""#,
            r#""do":"param_save","extra":1"#,
            r#""do":"motor_stop","motor":1"#,
            r#""do":"take_off""#,
            r#""do":"sticks","roll":0"#,
            r#""do":"param_set","name":"x","value":null"#,
        ];
        for text in unknown {
            assert!(matches!(with(text), Err(AskError::Unknown(_))), "{text}: {:?}", with(text));
        }
        let out_of_range = [
            (r#""do":"guided","kind":"take_off","height":1e39"#, "height"),
            (r#""do":"guided","kind":"take_off","height":0"#, "height"),
            (r#""do":"guided","kind":"go_to","north":0,"east":1e6,"up":0,"yaw":0"#, "east"),
            (r#""do":"param_set","name":"x","value":-1e300"#, "value"),
            (r#""do":"motor_test","motor":0,"duty":0.1"#, "motor"),
            (r#""do":"motor_test","motor":1,"duty":1.1"#, "duty"),
            (r#""do":"speed","factor":-1"#, "factor"),
        ];
        for (text, name) in out_of_range {
            assert_eq!(with(text), Err(AskError::OutOfRange(name)), "{text}");
        }
        assert_eq!(with(r#""do":"console","line":"a\nb""#), Err(AskError::NotPrintable));
        assert_eq!(with(&format!(r#""do":"console","line":"{}""#, "x".repeat(257))), Err(AskError::TooLong));
        assert_eq!(Asked::parse(&" ".repeat(5000)), Err(AskError::TooLong));
        assert_eq!(Asked::parse("[]"), Err(AskError::NotJson));
        assert_eq!(Asked::parse(r#"{"vehicle":0,"do":"param_save"}"#), Err(AskError::Missing("id")));
        assert_eq!(Asked::parse(r#"{"vehicle":-1,"id":1,"do":"param_save"}"#), Err(AskError::Missing("vehicle")));
        for at in ["-1", "\"now\"", "null", "1e13"] {
            let text = format!(r#"{{"vehicle":0,"id":1,"at":{at},"do":"param_save"}}"#);
            assert_eq!(Asked::parse(&text), Err(AskError::Missing("at")), "{at}");
        }
    }

    #[test]
    fn a_subscription_is_for_the_server() {
        let parse = |text: &str| Incoming::parse(text);
        let good = parse(r#"{"id":3,"do":"subscribe","topics":["truth"],"rate":20}"#);
        assert_eq!(good, Ok(Incoming::Subscribe { id: 3, topics: vec!["truth".into()], rate: 20 }));
        for (rate, name) in [("0", "rate"), ("51", "rate")] {
            let refused = parse(&format!(r#"{{"id":3,"do":"subscribe","topics":[],"rate":{rate}}}"#));
            assert_eq!(refused, Err((3, AskError::OutOfRange(name))));
        }
        let vehicle = parse(r#"{"id":3,"do":"subscribe","topics":[],"rate":1,"vehicle":0}"#);
        assert!(matches!(vehicle, Err((3, AskError::Unknown(_)))), "{vehicle:?}");
        assert_eq!(parse(r#"{"id":9,"do":"param_save"}"#), Err((9, AskError::Missing("vehicle"))));
    }

    #[test]
    fn every_guided_ask_becomes_the_command_of_its_kind() {
        let kinds = [
            (r#""kind":"arm""#, GuidedKind::Arm),
            (r#""kind":"disarm""#, GuidedKind::Disarm),
            (r#""kind":"hold""#, GuidedKind::Hold),
            (r#""kind":"land""#, GuidedKind::Land),
            (r#""kind":"kill""#, GuidedKind::Kill),
            (r#""kind":"flip","direction":"left""#, GuidedKind::FlipLeft),
            (r#""kind":"flip","direction":"right""#, GuidedKind::FlipRight),
            (r#""kind":"flip","direction":"forward""#, GuidedKind::FlipForward),
            (r#""kind":"flip","direction":"back""#, GuidedKind::FlipBack),
            (r#""kind":"autotune","axis":"roll""#, GuidedKind::AutotuneRoll),
            (r#""kind":"autotune","axis":"pitch""#, GuidedKind::AutotunePitch),
            (r#""kind":"autotune","axis":"yaw""#, GuidedKind::AutotuneYaw),
        ];
        for (text, kind) in kinds {
            let Ok(Ask::Guided(guided)) = with(&format!(r#""do":"guided",{text}"#)) else { panic!("{text}") };
            assert_eq!(GuidedCommand::from(guided), GuidedCommand { kind, ..Default::default() });
        }
        let goal = Guided::GoTo { north: 1.0, east: 2.0, up: 3.0, yaw: 0.5, speed: 0.4, dwell: 1.5 };
        let expected = GuidedCommand {
            kind: GuidedKind::WayPoint,
            position: Vec3::new(1.0, 2.0, -3.0),
            yaw: 0.5,
            speed: 0.4,
            dwell: 1.5,
        };
        assert_eq!(GuidedCommand::from(goal), expected);
    }

    proptest! {
        #[test]
        fn sticks_come_back(sticks in prop::array::uniform4(-1.0_f32..=1.0), arm: bool, kill: bool) {
            let [roll, pitch, yaw, throttle] = sticks;
            let ask = Ask::Sticks(Sticks { roll, pitch, yaw, throttle, mode: Mode::Acro, arm, kill });
            let asked = Asked { vehicle: 1, id: 9, at: Some(17.25), ask };
            let text = serde_json::to_string(&asked).expect("JSON");
            prop_assert_eq!(Asked::parse(&text), Ok(asked));
        }
    }
}
