//! A command → a reply, and a request for what only the board can do.

use super::command::{COMMANDS, Command};
use super::vehicle::{SensorLine, Vehicle};
use crate::doctor;
use crate::newest::ShownSample;
use crate::profile::HEADING;
use core::fmt::{self, Write};
use stampfly_param::{ParameterInfo, Parameters, parameters};
use stampfly_types::Instant;

/// What the board is to do after the reply. `R` is the vehicle's own.
///
/// Handed out only while the vehicle is disarmed, except for those of its own that need not be
/// ([`Vehicle::needs_disarmed`]). The board checks again right before it acts: a vehicle may be armed meanwhile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request<R> {
    /// Nothing more.
    Nothing,
    /// Write the parameters to flash.
    SaveParameters,
    /// Erase them from flash.
    ResetParameters,
    /// Send the log.
    DumpLog,
    /// Restart; after the line [`hil::COMMAND`](crate::hil::COMMAND) into hardware in the loop, on a board that offers it.
    Reboot,
    /// One of the vehicle's own.
    Vehicle(R),
}

/// Answers a line. The reply's lines end with a carriage return and a line feed, as terminals want it.
///
/// ```
/// # mod rover { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/flight/common/mod.rs")); }
/// use rover::topics; // the rover of `tests/flight/common`
/// use core::fmt;
/// use stampfly_bus::TopicInfo;
/// use stampfly_flight::console::{CommandError, Request, SensorLine, Vehicle, answer};
/// use stampfly_flight::param::{ParameterError, ParameterInfo, Parameters};
/// use stampfly_flight::profile::Rows;
/// use stampfly_types::Instant;
///
/// struct Rover { horn: u32, loudness: Loudness }
/// struct Loudness(f32);
/// #[derive(Debug, PartialEq)]
/// struct Honk;
///
/// impl Vehicle for Rover {
///     type Command = Honk;
///     type Request = Honk;
///     const COMMANDS: &'static [(&'static str, &'static str)] = &[("honk", "sound the horn")];
///     const TOPICS: &'static [TopicInfo] = &topics::TOPICS;
///
///     fn is_armed(&self) -> Option<bool> { Some(false) }
///     fn version(&self) -> &str { "rover 1.0" }
///     fn status(&self, _: Instant, reply: &mut dyn fmt::Write) -> fmt::Result { write!(reply, "parked\r\n") }
///     fn newest(&self, _: usize) -> Option<(Instant, &[u32])> { None }
///     fn sensors(&self) -> &[SensorLine<'_>] { &[] }
///     fn profile(&self) -> Rows<'_> { Rows::default() }
///     fn parameters(&mut self) -> &mut dyn Parameters { &mut self.loudness }
///
///     fn parse(words: &[&str]) -> Result<Honk, CommandError> {
///         match words {
///             ["honk"] => Ok(Honk),
///             ["honk", ..] => Err(CommandError::Usage("honk")),
///             _ => Err(CommandError::Unknown),
///         }
///     }
///     fn answer(&mut self, _: Honk, _: Instant, _: &mut dyn fmt::Write) -> Result<Option<Honk>, fmt::Error> {
///         self.horn += 1;
///         Ok(Some(Honk))
///     }
/// }
///
/// impl Parameters for Loudness {
///     fn describe(&self, index: usize) -> Option<ParameterInfo<'_>> {
///         let (name, meaning) = ("horn.loudness", "duty");
///         let loudness = ParameterInfo { name, unit: "1", min: 0.0, max: 1.0, meaning, in_flight: false };
///         (index == 0).then_some(loudness)
///     }
///     fn get(&self, index: usize) -> Option<f32> { (index == 0).then_some(self.0) }
///     fn set(&mut self, index: usize, value: f32) -> Result<(), ParameterError> {
///         self.0 = if index == 0 { value } else { return Err(ParameterError::Unknown) };
///         Ok(())
///     }
/// }
///
/// # fn main() {
/// let (mut rover, mut reply) = (Rover { horn: 0, loudness: Loudness(0.5) }, String::new());
/// assert_eq!(answer("honk", Instant::ZERO, &mut rover, &mut reply), Ok(Request::Vehicle(Honk)));
/// assert_eq!(answer("reboot", Instant::ZERO, &mut rover, &mut reply), Ok(Request::Reboot));
/// assert_eq!(reply, "");
/// assert_eq!(answer("honk twice", Instant::ZERO, &mut rover, &mut reply), Ok(Request::Nothing));
/// assert_eq!(reply, "usage: honk\r\n");
/// assert_eq!(answer("param set horn.loudness 0.8", Instant::ZERO, &mut rover, &mut reply), Ok(Request::Nothing));
/// assert_eq!(rover.loudness.0, 0.8);
/// # }
/// ```
///
/// # Errors
/// When the reply could not be written.
pub fn answer<V: Vehicle>(
    line: &str,
    now: Instant,
    vehicle: &mut V,
    reply: &mut dyn Write,
) -> Result<Request<V::Request>, fmt::Error> {
    let command = match Command::parse::<V>(line) {
        Ok(command) => command,
        Err(error) => return say(reply, &error),
    };
    let request = match command {
        Command::Nothing => return Ok(Request::Nothing),
        Command::Help => {
            let mut commands = COMMANDS.iter().chain(V::COMMANDS);
            commands.try_for_each(|(usage, what)| write!(reply, "{usage:<24}{what}\r\n"))?;
            return Ok(Request::Nothing);
        }
        Command::Status => {
            vehicle.status(now, reply)?;
            return Ok(Request::Nothing);
        }
        Command::Sensor(None) => return sensors(vehicle.sensors(), reply),
        Command::Sensor(Some(name)) => return topic(vehicle, now, "sensor_", name, reply),
        Command::Topic(name) => return topic(vehicle, now, "", name, reply),
        Command::ParameterList(prefix) => {
            let parameters = vehicle.parameters();
            let names = (0..).map_while(|index| parameters.describe(index).map(|info| (index, info.name)));
            let mut listed = names.filter(|(_, name)| name.starts_with(prefix));
            listed.try_for_each(|(index, _)| show(parameters, index, reply))?;
            return Ok(Request::Nothing);
        }
        Command::ParameterGet(name) => {
            let parameters = vehicle.parameters();
            return match parameters::find(parameters, name) {
                Ok(index) => {
                    show(parameters, index, reply)?;
                    let Some(info) = parameters.describe(index) else { return Ok(Request::Nothing) };
                    let when = if info.in_flight { ", may change in flight" } else { "" };
                    say(reply, &format_args!("{}{when}", info.meaning))
                }
                Err(error) => say(reply, &error),
            };
        }
        Command::ParameterSet(name, value) => {
            let is_armed = vehicle.is_armed() == Some(true);
            let parameters = vehicle.parameters();
            let index = match parameters::set(parameters, name, value) {
                Ok(index) => index,
                Err(error) => return say(reply, &error),
            };
            show(parameters, index, reply)?;
            return match parameters.describe(index) {
                Some(info) if is_armed && !info.in_flight => say(reply, &parameters::WAITS),
                _ => Ok(Request::Nothing),
            };
        }
        Command::Profile => {
            write!(reply, "{HEADING}\r\n")?;
            vehicle.profile().try_for_each(|row| write!(reply, "{row}\r\n"))?;
            return say(reply, &"microseconds; columns count activations by their share of the budget");
        }
        Command::Doctor => {
            doctor::examine(vehicle, now, reply)?;
            return Ok(Request::Nothing);
        }
        Command::Version => return say(reply, &vehicle.version()),
        Command::ParameterSave => Request::SaveParameters,
        Command::ParameterReset => Request::ResetParameters,
        Command::LogDump => Request::DumpLog,
        Command::Reboot | Command::HardwareInTheLoop => Request::Reboot,
        Command::Vehicle(command) => match vehicle.answer(command, now, reply)? {
            Some(request) if !V::needs_disarmed(&request) => return Ok(Request::Vehicle(request)),
            Some(request) if V::is_save(&request) => Request::SaveParameters,
            Some(request) => Request::Vehicle(request),
            None => return Ok(Request::Nothing),
        },
    };
    match vehicle.is_armed() {
        Some(false) => Ok(request),
        Some(true) => say(reply, &"the vehicle is armed"),
        None => say(reply, &"it is not known yet whether the vehicle is armed"),
    }
}

fn say<R>(reply: &mut dyn Write, what: &dyn fmt::Display) -> Result<Request<R>, fmt::Error> {
    write!(reply, "{what}\r\n")?;
    Ok(Request::Nothing)
}

/// One line: name, value, range, unit.
fn show(parameters: &dyn Parameters, index: usize, reply: &mut dyn Write) -> fmt::Result {
    let (Some(info), Some(value)) = (parameters.describe(index), parameters.get(index)) else { return Ok(()) };
    let ParameterInfo { name, min, max, unit, .. } = info;
    write!(reply, "{name:<30}{value:<12} {min} to {max}")?;
    if unit != "1" {
        write!(reply, " {unit}")?;
    }
    reply.write_str("\r\n")
}

fn sensors<R>(lines: &[SensorLine<'_>], reply: &mut dyn Write) -> Result<Request<R>, fmt::Error> {
    write!(reply, "{:<12}{:>10}{:>10}  last error\r\n", "sensor", "samples", "errors")?;
    for SensorLine { name, samples, errors, last_error } in lines {
        let last: &dyn fmt::Display = last_error.unwrap_or(&"none");
        write!(reply, "{name:<12}{samples:>10}{errors:>10}  {last}\r\n")?;
    }
    Ok(Request::Nothing)
}

fn topic<V: Vehicle>(
    vehicle: &V,
    now: Instant,
    prefix: &str,
    name: &str,
    reply: &mut dyn Write,
) -> Result<Request<V::Request>, fmt::Error> {
    let mut lines = V::TOPICS.iter().enumerate();
    let Some((topic, info)) = lines.find(|(_, info)| info.name.strip_prefix(prefix) == Some(name)) else {
        return say(reply, &"there is no such topic");
    };
    match vehicle.newest(topic) {
        Some((at, words)) => say(reply, &ShownSample::new(info, at, words, now)),
        None => say(reply, &"no sample yet"),
    }
}
