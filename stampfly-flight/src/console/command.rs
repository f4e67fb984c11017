//! A line → a command. Pure text: nothing here depends on the vehicle's state.

use super::Vehicle;
use super::error::{CommandError, MAX_WORDS};
use crate::hil;
use heapless::Vec;

/// What a line asks for, with names as they were typed. `C` are the vehicle's own commands.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Command<'l, C> {
    /// An empty line.
    Nothing,
    /// List the commands.
    Help,
    /// State of the vehicle.
    Status,
    /// Samples and errors of every sensor, or the newest sample of one.
    Sensor(Option<&'l str>),
    /// The newest sample of a topic.
    Topic(&'l str),
    /// Every parameter whose name begins so.
    ParameterList(&'l str),
    /// One parameter.
    ParameterGet(&'l str),
    /// Change one parameter.
    ParameterSet(&'l str, f32),
    /// Save all parameters.
    ParameterSave,
    /// Erase the saved ones.
    ParameterReset,
    /// Execution times.
    Profile,
    /// Every check that needs nobody.
    Doctor,
    /// Send the log.
    LogDump,
    /// Restart.
    Reboot,
    /// Fly a world at the other end of the line.
    HardwareInTheLoop,
    /// Version of the firmware.
    Version,
    /// One of the vehicle's own.
    Vehicle(C),
}

/// The commands of every vehicle: how they are written, and what they do.
pub const COMMANDS: &[(&str, &str)] = &[
    ("help", "this list"),
    ("status", "state of the vehicle"),
    (SENSOR, "samples and errors of every sensor, or the newest sample of one"),
    (TOPIC, "the newest sample of any topic"),
    ("param list [PREFIX]", "parameters"),
    ("param get NAME", "one parameter and what it does"),
    ("param set NAME VALUE", "change it; param save keeps it"),
    ("param save", "save all parameters"),
    ("param reset", "erase the saved ones"),
    ("profile", "execution times against their budgets"),
    ("doctor", "examine everything that needs nobody to look, one line a check"),
    (LOG, "send the log of the last flight"),
    ("reboot", "restart"),
    (hil::COMMAND, "restart, and fly a world that a program on this line simulates; motors stay off"),
    ("version", "version of the firmware"),
];

const SENSOR: &str = "sensor [NAME]";
const TOPIC: &str = "topic NAME";
const PARAM: &str = "param list [PREFIX] | get NAME | set NAME VALUE | save | reset";
const LOG: &str = "log dump";

impl<'l, C> Command<'l, C> {
    /// Reads a line. Words are separated by spaces; there is no quoting. What is no command of every vehicle is given to
    /// [`Vehicle::parse`].
    ///
    /// # Errors
    /// When there is no such command, or it is written differently.
    pub fn parse<V: Vehicle<Command = C>>(line: &'l str) -> Result<Self, CommandError> {
        let mut words = Vec::<&str, MAX_WORDS>::new();
        for word in line.split_ascii_whitespace() {
            words.push(word).map_err(|_| CommandError::TooManyWords)?;
        }
        Ok(match words.as_slice() {
            [] => Self::Nothing,
            ["help" | "?"] => Self::Help,
            ["status"] => Self::Status,
            ["sensor"] => Self::Sensor(None),
            ["sensor", name] => Self::Sensor(Some(name)),
            ["sensor", ..] => return Err(CommandError::Usage(SENSOR)),
            ["topic", name] => Self::Topic(name),
            ["topic", ..] => return Err(CommandError::Usage(TOPIC)),
            ["param", "list"] => Self::ParameterList(""),
            ["param", "list", prefix] => Self::ParameterList(prefix),
            ["param", "get", name] => Self::ParameterGet(name),
            ["param", "set", name, value] => {
                Self::ParameterSet(name, value.parse().map_err(|_| CommandError::Usage(PARAM))?)
            }
            ["param", "save"] => Self::ParameterSave,
            ["param", "reset"] => Self::ParameterReset,
            ["param", ..] => return Err(CommandError::Usage(PARAM)),
            ["profile"] => Self::Profile,
            ["doctor"] => Self::Doctor,
            ["log", "dump"] => Self::LogDump,
            ["log", ..] => return Err(CommandError::Usage(LOG)),
            ["reboot"] => Self::Reboot,
            [hil::COMMAND] => Self::HardwareInTheLoop,
            ["version"] => Self::Version,
            words => Self::Vehicle(V::parse(words)?),
        })
    }
}
