//! What is asked → a reply, and what only the board can do.

use super::Newest;
use super::command::{COMMANDS, Command};
use crate::parameters::{self, PARAMETERS, Parameter};
use crate::profile::{HEADING, Profile};
use crate::tasks::Health;
use crate::{VehicleConfig, wiring};
use core::fmt::{self, Write};
use stampfly_types::Instant;
use stampfly_types::messages::{PilotInput, PowerData, StateEstimate, SystemAlert, SystemMode};

/// A sensor's driver and how it fares.
#[derive(Clone, Copy, Debug)]
pub struct SensorLine<'c> {
    /// Name of its topic without `sensor_`.
    pub name: &'c str,
    /// How it fares.
    pub health: &'c Health,
}

/// What the board knows.
pub struct Context<'c> {
    /// Now.
    pub now: Instant,
    /// Which firmware this is.
    pub version: &'c str,
    /// The newest sample of every topic.
    pub newest: &'c Newest,
    /// Every sensor.
    pub sensors: &'c [SensorLine<'c>],
    /// Execution times.
    pub profile: &'c Profile,
    /// The configuration of the next start. `param set` changes it.
    pub config: &'c mut VehicleConfig,
}

/// What the board is to do after the reply. All but [`Nothing`](Self::Nothing) and stopping a motor are asked of a
/// disarmed vehicle only; the board looks again before it does anything that must not happen in flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request {
    /// Nothing more.
    Nothing,
    /// Write the configuration to flash.
    SaveParameters,
    /// Erase it from flash.
    ResetParameters,
    /// Look for a transmitter.
    Pair,
    /// Turn one motor.
    TestMotor {
        /// 1 to 4.
        motor: u8,
        /// Share of the full duty.
        duty: f32,
    },
    /// Stop the motor test.
    StopMotor,
    /// Send the log.
    DumpLog,
    /// Start again.
    Reboot,
}

/// Answers a line.
///
/// The reply's lines end with a carriage return and a line feed, as terminals want it.
///
/// ```
/// use stampfly_board::VehicleConfig;
/// use stampfly_board::console::{Context, Newest, Request, answer};
/// use stampfly_board::profile::Profile;
/// use stampfly_types::Instant;
///
/// let (newest, profile, mut config) = (Newest::new(), Profile::new(), VehicleConfig::default());
/// let mut context = Context {
///     now: Instant::ZERO, version: "1.0", newest: &newest, sensors: &[], profile: &profile, config: &mut config,
/// };
/// let mut reply = String::new();
/// assert_eq!(answer("version", &mut context, &mut reply), Ok(Request::Nothing));
/// assert_eq!(reply, "1.0\r\n");
/// assert_eq!(answer("param set eskf.gate 3.5", &mut context, &mut reply), Ok(Request::Nothing));
/// assert_eq!(config.eskf.gate, 3.5);
/// ```
///
/// # Errors
/// When the reply could not be written.
pub fn answer(line: &str, context: &mut Context<'_>, reply: &mut impl Write) -> Result<Request, fmt::Error> {
    let command = match Command::parse(line) {
        Ok(command) => command,
        Err(error) => return say(reply, &error),
    };
    match command {
        Command::Nothing => Ok(Request::Nothing),
        Command::Help => {
            COMMANDS.iter().try_for_each(|(usage, what)| write!(reply, "{usage:<24}{what}\r\n"))?;
            Ok(Request::Nothing)
        }
        Command::Status => status(context, reply),
        Command::Sensor(None) => sensors(context, reply),
        Command::Sensor(Some(name)) => topic(context, "sensor_", name, reply),
        Command::Topic(name) => topic(context, "", name, reply),
        Command::ParameterList(prefix) => {
            for parameter in PARAMETERS.iter().filter(|parameter| parameter.name.starts_with(prefix)) {
                show(parameter, context.config, reply)?;
            }
            Ok(Request::Nothing)
        }
        Command::ParameterGet(name) => match parameters::find(name) {
            Ok(parameter) => {
                show(parameter, context.config, reply)?;
                say(reply, &parameter.meaning)
            }
            Err(error) => say(reply, &error),
        },
        Command::ParameterSet(name, value) => {
            match parameters::find(name).and_then(|parameter| parameter.set(context.config, value).map(|()| parameter))
            {
                Ok(parameter) => show(parameter, context.config, reply).map(|()| Request::Nothing),
                Err(error) => say(reply, &error),
            }
        }
        Command::Profile => {
            write!(reply, "{HEADING}\r\n")?;
            context.profile.rows().try_for_each(|row| write!(reply, "{row}\r\n"))?;
            say(reply, &"microseconds; columns count activations by their share of the budget")
        }
        Command::Version => say(reply, &context.version),
        Command::MotorStop => Ok(Request::StopMotor),
        Command::MotorTest(motor, duty) => if_disarmed(Request::TestMotor { motor, duty }, context, reply),
        Command::ParameterSave => if_disarmed(Request::SaveParameters, context, reply),
        Command::ParameterReset => if_disarmed(Request::ResetParameters, context, reply),
        Command::Pair => if_disarmed(Request::Pair, context, reply),
        Command::LogDump => if_disarmed(Request::DumpLog, context, reply),
        Command::Reboot => if_disarmed(Request::Reboot, context, reply),
    }
}

fn say(reply: &mut impl Write, what: &impl fmt::Display) -> Result<Request, fmt::Error> {
    write!(reply, "{what}\r\n")?;
    Ok(Request::Nothing)
}

/// A vehicle nobody knows to be disarmed counts as armed.
fn if_disarmed(request: Request, context: &Context<'_>, reply: &mut impl Write) -> Result<Request, fmt::Error> {
    match context.newest.get::<SystemMode>(wiring::Id::system_mode) {
        Some((_, mode)) if !mode.armed => Ok(request),
        Some(_) => say(reply, &"the vehicle is armed"),
        None => say(reply, &"nobody knows yet whether the vehicle is armed"),
    }
}

fn show(parameter: &Parameter, config: &VehicleConfig, reply: &mut impl Write) -> fmt::Result {
    let Parameter { name, min, max, unit, .. } = parameter;
    write!(reply, "{name:<28}{:<12} {min} to {max}", parameter.get(config))?;
    if *unit != "1" {
        write!(reply, " {unit}")?;
    }
    reply.write_str("\r\n")
}

fn status(context: &Context<'_>, reply: &mut impl Write) -> Result<Request, fmt::Error> {
    let mode = context.newest.get::<SystemMode>(wiring::Id::system_mode).map(|(_, mode)| mode).unwrap_or_default();
    let alert = context.newest.get::<SystemAlert>(wiring::Id::system_alert).map(|(_, alert)| alert).unwrap_or_default();
    write!(reply, "state    {}, {}\r\n", mode.state.name(), if mode.armed { "ARMED" } else { "disarmed" })?;
    write!(reply, "mode     {}\r\n", mode.mode.name())?;
    list(reply, "blocks", mode.blocks.names())?;
    list(reply, "alerts", alert.active.names())?;
    if let Some((_, power)) = context.newest.get::<PowerData>(wiring::Id::sensor_power) {
        write!(reply, "battery  {:.2} V, {:.2} A\r\n", power.voltage, power.current)?;
    }
    if let Some((_, estimate)) = context.newest.get::<StateEstimate>(wiring::Id::estimate_state) {
        write!(reply, "height   {:.2} m\r\n", estimate.height)?;
    }
    match context.newest.get::<PilotInput>(wiring::Id::command_pilot) {
        Some((at, _)) => write!(reply, "pilot    heard {} ms ago\r\n", context.now.since(at).as_micros() / 1_000)?,
        None => reply.write_str("pilot    never heard\r\n")?,
    }
    write!(reply, "awake    {} s\r\n", context.now.as_micros() / 1_000_000)?;
    Ok(Request::Nothing)
}

fn list(reply: &mut impl Write, what: &str, mut names: impl Iterator<Item = &'static str>) -> fmt::Result {
    write!(reply, "{what:<9}{}", names.next().unwrap_or("none"))?;
    names.try_for_each(|name| write!(reply, " {name}"))?;
    reply.write_str("\r\n")
}

fn sensors(context: &Context<'_>, reply: &mut impl Write) -> Result<Request, fmt::Error> {
    write!(reply, "{:<12}{:>10}{:>10}  last error\r\n", "sensor", "samples", "errors")?;
    for SensorLine { name, health } in context.sensors {
        write!(reply, "{name:<12}{:>10}{:>10}  ", health.samples(), health.errors())?;
        match health.last_error() {
            Some(kind) => write!(reply, "{kind:?}\r\n")?,
            None => reply.write_str("none\r\n")?,
        }
    }
    Ok(Request::Nothing)
}

fn topic(context: &Context<'_>, prefix: &str, name: &str, reply: &mut impl Write) -> Result<Request, fmt::Error> {
    let found = wiring::TOPICS.iter().position(|info| info.name.strip_prefix(prefix) == Some(name));
    match found.map(|topic| context.newest.show(topic, context.now)) {
        Some(Some(shown)) => say(reply, &shown),
        Some(None) => say(reply, &"nothing yet"),
        None => say(reply, &"there is no such topic"),
    }
}
