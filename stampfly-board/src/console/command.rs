//! From a line to what is asked.

use core::fmt;

/// What a line asks for. Names are as they were typed; whether there is such a thing, [`answer`](super::answer) finds
/// out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command<'l> {
    /// Nothing: an empty line.
    Nothing,
    /// What can be asked?
    Help,
    /// How is the vehicle?
    Status,
    /// How do the sensors fare, or what does this one say?
    Sensor(Option<&'l str>),
    /// What was published last on this topic?
    Topic(&'l str),
    /// Every parameter whose name begins so.
    ParameterList(&'l str),
    /// One parameter.
    ParameterGet(&'l str),
    /// Change one parameter.
    ParameterSet(&'l str, f32),
    /// Keep the parameters.
    ParameterSave,
    /// Forget what was kept.
    ParameterReset,
    /// Look for a transmitter.
    Pair,
    /// Turn one motor, 1 to 4, with this share of the duty.
    MotorTest(u8, f32),
    /// Stop the motor test.
    MotorStop,
    /// How long do the runnables take?
    Profile,
    /// Send the log.
    LogDump,
    /// Start again.
    Reboot,
    /// Which firmware is this?
    Version,
}

/// Why a line is no command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CommandError {
    /// There is no such command.
    Unknown,
    /// It is written like this.
    Usage(&'static str),
}

impl fmt::Display for CommandError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => f.write_str("there is no such command; try help"),
            Self::Usage(usage) => write!(f, "usage: {usage}"),
        }
    }
}

impl core::error::Error for CommandError {}

/// What there is, for people: how it is written, and what it does.
pub(super) const COMMANDS: &[(&str, &str)] = &[
    ("help", "this list"),
    ("status", "state, what keeps the vehicle from arming, battery, link"),
    ("sensor [NAME]", "how the drivers fare, or the newest sample of one"),
    ("topic NAME", "the newest sample of any topic"),
    ("param list [PREFIX]", "parameters"),
    ("param get NAME", "one parameter and what it does"),
    ("param set NAME VALUE", "change it; takes effect after save and reboot"),
    ("param save", "keep all parameters"),
    ("param reset", "forget what was kept"),
    ("pair", "look for a transmitter"),
    ("motor test N PERCENT", "turn motor N (1 front right, 2 rear right, 3 rear left, 4 front left) for 2 s"),
    ("motor stop", "stop it"),
    ("profile", "execution times against their budgets"),
    ("log dump", "send the log of the last flight"),
    ("reboot", "start again"),
    ("version", "which firmware this is"),
];

const PARAM: &str = "param list [PREFIX] | get NAME | set NAME VALUE | save | reset";
const MOTOR: &str = "motor test N PERCENT | stop";

impl<'l> Command<'l> {
    /// Reads a line. Words are separated by spaces; there is no quoting, because nothing here has a space in its name.
    ///
    /// ```
    /// use stampfly_board::console::{Command, CommandError};
    /// assert_eq!(Command::parse("param set eskf.gate 3.5"), Ok(Command::ParameterSet("eskf.gate", 3.5)));
    /// assert_eq!(Command::parse("  motor test 2 15%"), Ok(Command::MotorTest(2, 0.15)));
    /// assert_eq!(Command::parse("fly"), Err(CommandError::Unknown));
    /// ```
    ///
    /// # Errors
    /// When it asks for nothing there is, or not in this way.
    pub fn parse(line: &'l str) -> Result<Self, CommandError> {
        let mut words = line.split_ascii_whitespace();
        // One more than the longest command has, to see that there is no more.
        let words: [Option<&str>; 5] = core::array::from_fn(|_| words.next());
        match words {
            [None, ..] => Ok(Self::Nothing),
            [Some("help" | "?"), None, ..] => Ok(Self::Help),
            [Some("status"), None, ..] => Ok(Self::Status),
            [Some("sensor"), name, None, ..] => Ok(Self::Sensor(name)),
            [Some("topic"), Some(name), None, ..] => Ok(Self::Topic(name)),
            [Some("topic"), ..] => Err(CommandError::Usage("topic NAME")),
            [Some("param"), Some("list"), prefix, None, _] => Ok(Self::ParameterList(prefix.unwrap_or_default())),
            [Some("param"), Some("get"), Some(name), None, _] => Ok(Self::ParameterGet(name)),
            [Some("param"), Some("set"), Some(name), Some(value), None] => {
                let value = value.parse().map_err(|_| CommandError::Usage(PARAM))?;
                Ok(Self::ParameterSet(name, value))
            }
            [Some("param"), Some("save"), None, ..] => Ok(Self::ParameterSave),
            [Some("param"), Some("reset"), None, ..] => Ok(Self::ParameterReset),
            [Some("param"), ..] => Err(CommandError::Usage(PARAM)),
            [Some("pair"), None, ..] => Ok(Self::Pair),
            [Some("motor"), Some("test"), Some(motor), Some(percent), None] => {
                let motor = motor.parse().map_err(|_| CommandError::Usage(MOTOR))?;
                let percent = percent.strip_suffix('%').unwrap_or(percent);
                let percent: f32 = percent.parse().map_err(|_| CommandError::Usage(MOTOR))?;
                Ok(Self::MotorTest(motor, percent / 100.0))
            }
            [Some("motor"), Some("stop"), None, ..] => Ok(Self::MotorStop),
            [Some("motor"), ..] => Err(CommandError::Usage(MOTOR)),
            [Some("profile"), None, ..] => Ok(Self::Profile),
            [Some("log"), Some("dump"), None, ..] => Ok(Self::LogDump),
            [Some("log"), ..] => Err(CommandError::Usage("log dump")),
            [Some("reboot"), None, ..] => Ok(Self::Reboot),
            [Some("version"), None, ..] => Ok(Self::Version),
            _ => Err(CommandError::Unknown),
        }
    }
}
