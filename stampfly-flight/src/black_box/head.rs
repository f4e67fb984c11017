//! The head of the log that a recording is read out as.

use crate::log_schema::LogSchema;
use stampfly_bus::Schedule;
use stampfly_log::ulog::{Definitions, Level, ParameterValue, Sink, WriteError, Writer};
use stampfly_param::Parameters;
use stampfly_types::Instant;

/// Starts the log of a flight with these parameters: name of the vehicle, parameters, every topic, and a line of text
/// with the version of the firmware.
///
/// ```
/// # mod rover { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/flight/common/mod.rs")); }
/// use rover::Rover; // the rover of `tests/flight/common`
/// use stampfly_flight::black_box::open;
/// use stampfly_flight::param::{ParameterError, ParameterInfo, Parameters};
/// use stampfly_log::ulog::Ram;
/// use stampfly_types::Instant;
///
/// struct None;
/// impl Parameters for None {
///     fn describe(&self, _: usize) -> Option<ParameterInfo<'_>> { Option::None }
///     fn get(&self, _: usize) -> Option<f32> { Option::None }
///     fn set(&mut self, _: usize, _: f32) -> Result<(), ParameterError> { Err(ParameterError::Unknown) }
/// }
///
/// # fn main() -> Result<(), stampfly_log::ulog::WriteError<stampfly_log::ulog::Full>> {
/// let mut memory = [0; 4_096];
/// let log = open::<Rover, _>(Ram::new(&mut memory), Instant::ZERO, "rover", &None, "1.0")?;
/// assert!(log.sink().written().starts_with(b"ULog"));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// When the sink refuses.
#[inline(never)]
pub fn open<R: Schedule, S: Sink>(
    sink: S,
    at: Instant,
    name: &str,
    parameters: &dyn Parameters,
    version: &str,
) -> Result<Writer<S, LogSchema<R>>, WriteError<S::Error>> {
    let mut head = Definitions::start(sink, at)?;
    head.info("sys_name", name)?;
    for index in 0.. {
        let Some((info, value)) = parameters.describe(index).zip(parameters.get(index)) else { break };
        head.parameter(info.name, ParameterValue::Float(value))?;
    }
    let mut log = head.data(LogSchema::new(&[]))?;
    log.text(Level::Info, at, version)?;
    Ok(log)
}
