//! The log file that remembered samples go into.

use crate::{VehicleConfig, parameters, wiring};
use stampfly_log::ulog::{Definitions, ParameterValue, Sink, Topic, WriteError, Writer};
use stampfly_types::Instant;

/// Every topic, as the log wants them.
static TOPICS: [Topic; wiring::COUNT] = {
    let mut topics = [Topic { name: "", fields: &[] }; wiring::COUNT];
    let mut index = 0;
    while index < wiring::COUNT {
        topics[index] = Topic { name: wiring::TOPICS[index].name, fields: wiring::TOPICS[index].fields };
        index += 1;
    }
    topics
};

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
pub fn open<S: Sink>(sink: S, at: Instant, config: &VehicleConfig) -> Result<Writer<'static, S>, WriteError<S::Error>> {
    head(sink, at, config)?.data(&TOPICS, &[])
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
