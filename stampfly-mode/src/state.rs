//! What the mode machine remembers between two decisions, and the alerts that decide for it.

use crate::transitions::is_armed;
use stampfly_types::messages::{Alerts, ArmBlocks, CommandSource, FlightMode, FlightPhase};
use stampfly_types::{Duration, Instant};

/// Alerts that stop the motors in any phase.
pub const CUT: Alerts = Alerts::IMPACT
    .with(Alerts::GYRO_ANOMALY)
    .with(Alerts::TUMBLED)
    .with(Alerts::IMU_LOST)
    .with(Alerts::IMU_FAULTY)
    .with(Alerts::MOTOR_LOST);
/// Alerts that demand a landing at once.
pub const LAND: Alerts = Alerts::CRITICAL_BATTERY
    .with(Alerts::ESTIMATE_DIVERGED)
    .with(Alerts::MOTOR_WEAK)
    .with(Alerts::NO_LIFT)
    .with(Alerts::IMU_NOISY)
    .with(Alerts::FORCE_IMPLAUSIBLE)
    .with(Alerts::ACCEL_FAULTY)
    .with(Alerts::STRUCK);

/// Alerts with which a vehicle does not turn over: something is wrong with what it would need for it.
pub const NO_FLIP: Alerts = LAND
    .with(Alerts::LOW_BATTERY)
    .with(Alerts::POWER_LOST)
    .with(Alerts::POWER_IMPLAUSIBLE)
    .with(Alerts::IMU_DEGRADED)
    .with(Alerts::TOF_LOST)
    .with(Alerts::RANGE_IMPLAUSIBLE)
    .with(Alerts::FLOW_IMPLAUSIBLE)
    .with(Alerts::COMM_LOST);

/// A silence of the commander.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Silence {
    /// When it began.
    pub since: Instant,
    /// Since when the commander has been heard again.
    pub heard_since: Option<Instant>,
}

/// All that the machine remembers between two decisions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct State {
    /// The flight phase.
    pub phase: FlightPhase,
    /// When it was entered.
    pub entered: Instant,
    /// The mode asked for.
    pub wanted: FlightMode,
    /// The mode in force: the one asked for, or what the estimate allows of it.
    pub mode: FlightMode,
    /// A mode that the pilot has switched to and that is not applied yet.
    pub pending: Option<FlightMode>,
    /// A manual mode waits for the throttle stick to pass the hover: was the stick above it when the mode was chosen?
    pub throttle_above: Option<bool>,
    /// Who has authority.
    pub commander: CommandSource,
    /// The vehicle takes off by itself after spool-up.
    pub takes_off: bool,
    /// The throttle has been at rest since the mode was chosen on the ground.
    pub throttle_rested: bool,
    /// The pilot's arm switch has asked for this landing.
    pub landing_by_switch: bool,
    /// The longest time this landing may take.
    pub landing_limit: Duration,
    /// What has to be acknowledged before arming.
    pub unacknowledged: ArmBlocks,
    /// Since when the vehicle has been looking for a transmitter.
    pub pairing: Option<Instant>,
    /// The commander is silent, or was a moment ago.
    pub silence: Option<Silence>,
    /// Since when a mode that holds height has had none.
    pub blind: Option<Instant>,
    /// Since when a vehicle that no pilot flies has not known its horizontal velocity.
    pub adrift: Option<Instant>,
    /// Since when the height has been unknown to a lifted vehicle.
    pub unmeasured: Option<Instant>,
    /// Transitions since power-on.
    pub transitions: u32,
    /// A change of this number resets the controller.
    pub control_resets: u32,
    /// A change of this number moves the estimator's origin here.
    pub origin_resets: u32,
    /// A change of this number starts the estimator anew.
    pub full_resets: u32,
    /// In this flip it has been upside down.
    pub inverted: bool,
    /// A landing waits until this flip has ended level.
    pub lands_next: bool,
    /// The estimate was lost in the step before.
    pub diverged: bool,
}

impl State {
    /// May the motors turn?
    #[must_use]
    pub const fn is_armed(&self) -> bool {
        is_armed(self.phase)
    }
}
