//! What of a flight is worth its memory: one line a topic.
//!
//! Motion, motors and what was asked of them at twenty samples a second and more, because an accident is over in a tenth
//! of one; decisions when they change; what the others can be computed from, or what ended before the flight, not at all.

use crate::wiring::Id;
use stampfly_types::Duration;

/// Which samples of a topic are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// None.
    Never,
    /// All of them: for events.
    Always,
    /// At most one in this time.
    Every(Duration),
    /// One that differs from the last one kept, but none within [`HASTE`] of it; and one a second, so that there always is
    /// one.
    OnChange,
}

/// A topic that changes all the time must not push everything else out.
pub const HASTE: Duration = Duration::from_millis(20);
/// A topic that does not change is kept this often.
pub const REMINDER: Duration = Duration::from_secs(1);

const fn hertz(rate: u64) -> Keep {
    Keep::Every(Duration::from_micros(1_000_000 / rate))
}

/// Which samples of this topic are kept.
#[must_use]
pub const fn keep(topic: Id) -> Keep {
    match topic {
        Id::sensor_imu => hertz(25),
        Id::sensor_tof => hertz(10),
        Id::sensor_tof_front => Keep::Never,
        Id::sensor_flow => hertz(10),
        Id::sensor_mag => hertz(2),
        Id::sensor_baro => hertz(2),
        Id::external_pose => hertz(5),
        Id::sensor_power => hertz(5),
        Id::self_test => Keep::Always,
        Id::command_pilot => hertz(10),
        Id::command_guided => Keep::Always,
        Id::button_contact => Keep::Never,
        Id::button_event => Keep::Always,
        Id::command_setpoint => hertz(5),
        Id::calibration => Keep::Never,
        Id::estimate_state => hertz(20),
        Id::estimate_status => hertz(2),
        Id::estimator_command => Keep::Always,
        Id::system_alert => Keep::OnChange,
        Id::system_mode => Keep::OnChange,
        Id::vehicle_status => hertz(5),
        Id::setpoint => hertz(10),
        Id::control_output => hertz(10),
        Id::actuator_motor => hertz(20),
        Id::signal => Keep::Never,
        Id::telemetry => Keep::Never,
    }
}
