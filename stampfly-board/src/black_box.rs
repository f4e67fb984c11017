//! What the StampFly's black box keeps of a flight, one line a topic.
//!
//! Motion, motors and their demands at twenty samples a second and more, because an accident is over in a tenth of one;
//! decisions when they change; what can be computed from other topics, or ended before the flight, not at all. That is
//! more than three and a half seconds in [`WORDS`]. Not for the analysis of a whole flight: the log of a host keeps every sample.

use crate::topics::{COUNT, Id, TOPICS};
use stampfly_flight::black_box::{LogRate, Retention};
use stampfly_flight::newest::message;
use stampfly_types::messages::FlightStatus;

/// Memory that the firmware has for it, words: 28 KiB.
pub const WORDS: usize = 7 * 1024;

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
        Id::estimate_state | Id::actuator_motor => LogRate::hertz(20),
        Id::sensor_tof | Id::sensor_flow | Id::command_pilot => LogRate::hertz(10),
        Id::setpoint | Id::control_output => LogRate::hertz(10),
        Id::external_pose | Id::sensor_power | Id::command_setpoint | Id::land_detected => LogRate::hertz(5),
        Id::sensor_mag | Id::sensor_baro | Id::estimate_status => LogRate::hertz(2),
        Id::sensor_tof_front | Id::button_contact | Id::calibration | Id::signal | Id::telemetry => LogRate::Never,
        Id::system_alert | Id::flight_status | Id::autotune | Id::calibration_report => LogRate::OnChange,
        Id::link_peer | Id::self_test | Id::command_guided | Id::button_event | Id::estimator_command => {
            LogRate::EverySample
        }
        Id::motor_test | Id::storage_busy | Id::pairing_request | Id::calibration_request => LogRate::EverySample,
        Id::arm_refusals | Id::restart_request | Id::cutoff_state | Id::parameter_change => LogRate::EverySample,
        Id::findings | Id::estimate_correction => LogRate::EverySample,
    }
}

fn armed(topic: usize, words: &[u32]) -> Option<bool> {
    (topic == Id::flight_status as usize).then(|| message::<FlightStatus>(words).is_some_and(|mode| mode.armed))
}
