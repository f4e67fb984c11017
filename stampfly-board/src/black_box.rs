//! What the StampFly's black box keeps of a flight, one line a topic, and the log that it is read out as.
//!
//! Motion, motors and their demands at twenty samples a second and more, because an accident is over in a tenth of one;
//! decisions when they change; what can be computed from other topics, or ended before the flight, not at all. That is
//! more than five seconds in [`WORDS`]. Not for the analysis of a whole flight: the log of a host keeps every sample.

use crate::schedule::Runnables;
use crate::topics::{COUNT, Id, TOPICS};
use crate::{VehicleConfig, parameters};
use stampfly_flight::black_box::{LogRate, Retention};
use stampfly_flight::newest::message;
use stampfly_flight::{LogSchema, parameters::Parameters};
use stampfly_log::ulog::{Definitions, Level, ParameterValue, Sink, WriteError, Writer};
use stampfly_types::{Instant, messages::FlightStatus};

/// Memory that the firmware has for it, words: 39 kB.
pub const WORDS: usize = 10 * 1024 - 512;

/// A black box for this vehicle.
pub type BlackBox<const WORDS: usize> = stampfly_flight::BlackBox<WORDS, COUNT>;

/// What it keeps, and when the vehicle is armed.
///
/// ```
/// use stampfly_board::black_box::{BlackBox, RETENTION};
/// use stampfly_board::topics::Id;
/// use stampfly_types::{Instant, Message, messages::FlightStatus};
/// let mut black_box = BlackBox::<256>::new(RETENTION);
/// let armed = FlightStatus { armed: true, ..Default::default() };
/// black_box.note(Id::flight_status as usize, Instant::from_millis(1), 1, &armed.to_words());
/// assert_eq!(black_box.records().count(), 1);
/// ```
pub const RETENTION: Retention = Retention { topics: &TOPICS, rate, armed };

fn rate(topic: usize) -> LogRate {
    let Some(id) = Id::ALL.get(topic) else { return LogRate::Never };
    match id {
        Id::sensor_imu => LogRate::hertz(25),
        Id::sensor_tof => LogRate::hertz(10),
        Id::sensor_tof_front => LogRate::Never,
        Id::sensor_flow => LogRate::hertz(10),
        Id::sensor_mag => LogRate::hertz(2),
        Id::sensor_baro => LogRate::hertz(2),
        Id::external_pose => LogRate::hertz(5),
        Id::sensor_power => LogRate::hertz(5),
        Id::self_test => LogRate::EverySample,
        Id::command_pilot => LogRate::hertz(10),
        Id::command_guided => LogRate::EverySample,
        Id::button_contact => LogRate::Never,
        Id::button_event => LogRate::EverySample,
        Id::command_setpoint => LogRate::hertz(5),
        Id::calibration => LogRate::Never,
        Id::estimate_state => LogRate::hertz(20),
        Id::estimate_status => LogRate::hertz(2),
        Id::estimator_command => LogRate::EverySample,
        Id::system_alert => LogRate::OnChange,
        Id::flight_status => LogRate::OnChange,
        Id::land_detected => LogRate::hertz(5),
        Id::setpoint => LogRate::hertz(10),
        Id::control_output => LogRate::hertz(10),
        Id::autotune => LogRate::OnChange,
        Id::actuator_motor => LogRate::hertz(20),
        Id::signal => LogRate::Never,
        Id::telemetry => LogRate::Never,
        Id::motor_test => LogRate::EverySample,
        Id::storage_busy => LogRate::EverySample,
        Id::pairing_request => LogRate::EverySample,
        Id::link_peer => LogRate::EverySample,
        Id::arm_refusals => LogRate::EverySample,
        Id::restart_request => LogRate::EverySample,
        Id::cutoff_state => LogRate::EverySample,
    }
}

fn armed(topic: usize, words: &[u32]) -> Option<bool> {
    (topic == Id::flight_status as usize).then(|| message::<FlightStatus>(words).is_some_and(|mode| mode.armed))
}

/// Starts the log of a flight with these parameters: name of the vehicle, parameters, every topic, and a line of text
/// with the version of the firmware.
///
/// ```
/// use stampfly_board::{VehicleConfig, black_box};
/// use stampfly_log::ulog::Ram;
/// use stampfly_types::Instant;
/// let mut memory = [0; 20_480];
/// let log = black_box::open(Ram::new(&mut memory), Instant::ZERO, &VehicleConfig::default(), "1.0")?;
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
    version: &str,
) -> Result<Writer<S, LogSchema<Runnables>>, WriteError<S::Error>> {
    let mut head = Definitions::start(sink, at)?;
    head.info("sys_name", "stampfly")?;
    for (index, info) in parameters::all().enumerate() {
        if let Some(value) = config.get(index) {
            head.parameter(info.name, ParameterValue::Float(value))?;
        }
    }
    let mut log = head.data(LogSchema::new(&[]))?;
    log.text(Level::Info, at, version)?;
    Ok(log)
}
