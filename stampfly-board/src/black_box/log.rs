//! The log file that remembered samples go into.

use crate::schedule::Runnables;
use crate::{VehicleConfig, parameters};
use stampfly_flight::LogSchema;
use stampfly_log::ulog::{Definitions, ParameterValue, Sink, WriteError, Writer};
use stampfly_types::Instant;

/// Starts a log that explains itself: every topic, every parameter.
///
/// ```
/// use stampfly_board::{VehicleConfig, black_box};
/// use stampfly_log::ulog::Ram;
/// use stampfly_types::Instant;
/// let mut memory = [0; 16_384];
/// let log = black_box::open(Ram::new(&mut memory), Instant::ZERO, &VehicleConfig::default())?;
/// assert!(log.sink().written().starts_with(b"ULog"));
/// # Ok::<(), stampfly_log::ulog::WriteError<stampfly_log::ulog::Full>>(())
/// ```
///
/// # Errors
/// When the sink refuses.
pub fn open<S: Sink>(
    sink: S,
    at: Instant,
    config: &VehicleConfig,
) -> Result<Writer<S, LogSchema<Runnables>>, WriteError<S::Error>> {
    head(sink, at, config)?.data(LogSchema::new(&[]))
}

/// The beginning of every log of this vehicle: its name and every parameter, so that a replay flies with them.
///
/// # Errors
/// When the sink refuses.
pub fn head<S: Sink>(sink: S, at: Instant, config: &VehicleConfig) -> Result<Definitions<S>, WriteError<S::Error>> {
    let mut head = Definitions::start(sink, at)?;
    head.info("sys_name", "StampFly")?;
    for parameter in parameters::PARAMETERS {
        head.parameter(parameter.name, ParameterValue::Float(parameter.get(config)))?;
    }
    Ok(head)
}
