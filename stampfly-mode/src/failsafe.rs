//! Anomaly detection: conditions in, a set of alerts out. It detects and never acts; the mode machine decides.
//!
//! The numbers of this table are the defaults of [`FailsafeConfig`].
//!
//! | alert | condition | clears |
//! |---|---|---|
//! | `IMPACT` | ‖accel‖ over about 10 ms above 3 g (6 g while landing), and above six sigma of the present vibration, in two samples running | when disarmed |
//! | `GYRO_ANOMALY` | ‖gyro‖ above 800 °/s in two samples running | when disarmed |
//! | `TUMBLED` | tilt above 60° for 300 ms, except in ACRO | when disarmed |
//! | `IMU_DEGRADED`, `IMU_LOST` | no inertial sample for 10 ms, 25 ms | with the next sample; `IMU_LOST` when disarmed |
//! | `COMM_LOST` | no command of any kind for 500 ms, or since power-on | with the next command |
//! | `LOW_BATTERY`, `CRITICAL_BATTERY` | low-passed voltage below 3.4 V, 3.0 V | 0.1 V higher |
//! | `POWER_LOST` | no battery sample for 1 s; a voltage below 0.1 V is one: no meter is fitted | with the next one |
//! | `USB_POWER` | voltage below 3.3 V while disarmed | 0.1 V higher |
//! | `TOF_LOST`, `FLOW_LOST` | no usable sample for 1 s in the air | with the next one |
//! | `TILT_MISMATCH` | gravity and estimated tilt 10° apart for 0.5 s on the ground | with agreement |
//! | `ESTIMATE_DIVERGED` | the estimator says so | when it no longer does |
//!
//! Numbers: `safety.*` parameters of the StampFly's reference firmware. Its recorded flights show 2–3 m/s² of
//! vibration, peaks of 18; the six-sigma condition keeps a badly balanced propeller from looking like a crash.

mod config;

pub use config::FailsafeConfig;

use stampfly_types::messages::{
    Alerts, EstimatorStatus, FlightMode, FlightPhase, FlightStatus, ImuData, PowerData, SelfTestVerdict, StateEstimate,
    SystemAlert, Validity,
};
use stampfly_types::{Duration, Instant, Vec3, frame, math};

/// What the failsafe looks at. Times are those of the newest sample, usable or authentic.
#[derive(Clone, Copy, Debug)]
pub struct FailsafeInput<'a> {
    /// Newest inertial sample.
    pub imu: Option<(Instant, &'a ImuData)>,
    /// The estimate.
    pub estimate: &'a StateEstimate,
    /// The estimator's own opinion.
    pub status: &'a EstimatorStatus,
    /// Newest battery sample.
    pub power: Option<(Instant, &'a PowerData)>,
    /// Newest command of any kind.
    pub command: Option<Instant>,
    /// Newest usable range.
    pub tof: Option<Instant>,
    /// Newest usable flow.
    pub flow: Option<Instant>,
    /// How the self test at power-on ended.
    pub self_test: SelfTestVerdict,
    /// State and mode one step ago.
    pub flight_status: &'a FlightStatus,
}

/// The failsafe.
///
/// ```
/// use stampfly_mode::{Failsafe, FailsafeInput};
/// use stampfly_types::{Instant, Vec3, messages::*};
/// let mut failsafe = Failsafe::default();
/// let imu = ImuData { accel: Vec3::new(0.0, 0.0, -9.81), ..Default::default() };
/// let power = PowerData { voltage: 4.1, ..Default::default() };
/// let quiet = FailsafeInput {
///     imu: Some((Instant::ZERO, &imu)), estimate: &StateEstimate::default(), status: &EstimatorStatus::default(),
///     power: Some((Instant::ZERO, &power)), command: Some(Instant::ZERO), tof: None, flow: None, self_test: SelfTestVerdict::NotRun, flight_status: &FlightStatus::default(),
/// };
/// assert!(failsafe.step(Instant::from_micros(2_500), &quiet).active.is_empty());
/// // The sensor says nothing any more.
/// assert!(failsafe.step(Instant::from_micros(30_000), &quiet).active.contains(Alerts::IMU_LOST));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Failsafe {
    config: FailsafeConfig,
    active: Alerts,
    seen: Alerts,
    last_imu: Option<Instant>,
    last_step: Option<Instant>,
    impacts: u32,
    overspeeds: u32,
    /// Specific force over the length of a blow.
    blow: Option<Vec3>,
    /// Running mean and variance of its norm.
    force: [f32; 2],
    /// Specific force for the tilt on the ground.
    gravity: Option<Vec3>,
    tumbled: Option<Instant>,
    mismatch: Option<Instant>,
    voltage: Option<f32>,
    last_power: Option<Instant>,
}

/// Alerts that stay until the vehicle is disarmed.
const LATCHED: Alerts = Alerts::IMPACT.with(Alerts::GYRO_ANOMALY).with(Alerts::TUMBLED).with(Alerts::IMU_LOST);

impl Failsafe {
    /// Nothing wrong yet.
    #[must_use]
    pub fn new(config: FailsafeConfig) -> Self {
        Self { config, ..Self::default() }
    }

    /// One step; runs on a deadline when there are no samples.
    pub fn step(&mut self, now: Instant, input: &FailsafeInput<'_>) -> SystemAlert {
        let disarmed = !input.flight_status.armed;
        let mut active = if disarmed { self.active.without(LATCHED) } else { self.active };
        if let Some((at, imu)) = input.imu
            && self.last_imu != Some(at)
        {
            self.last_imu = Some(at);
            active = self.inspect_motion(active, imu, input.flight_status.phase);
        }
        let silence = self.last_imu.map_or(now.since(Instant::ZERO), |at| now.since(at));
        active = active.set(Alerts::IMU_DEGRADED, silence >= self.config.imu_degraded);
        if silence >= self.config.imu_lost {
            active |= Alerts::IMU_LOST;
        }
        active = self.inspect_attitude(active, now, input);
        active = self.inspect_power(active, now, input, disarmed);
        let airborne = matches!(input.flight_status.phase, FlightPhase::Flying | FlightPhase::Landing);
        let silent = |last: Option<Instant>, limit| last.is_none_or(|at| now.since(at) >= limit);
        active = active
            .set(Alerts::COMM_LOST, silent(input.command, self.config.link_silence))
            .set(Alerts::TOF_LOST, airborne && silent(input.tof, self.config.aiding_silence))
            .set(Alerts::FLOW_LOST, airborne && silent(input.flow, self.config.aiding_silence))
            .set(Alerts::ESTIMATE_DIVERGED, input.status.diverged)
            .set(Alerts::SELF_TEST_FAILED, input.self_test == SelfTestVerdict::Failed)
            .set(Alerts::SELF_TEST_DIFFERS, input.self_test == SelfTestVerdict::WithinTolerance);
        self.last_step = Some(now);
        self.active = active;
        self.seen |= active;
        SystemAlert { active, seen: self.seen }
    }

    fn inspect_motion(&mut self, active: Alerts, imu: &ImuData, phase: FlightPhase) -> Alerts {
        let config = &self.config;
        let rate = imu.gyro.norm();
        if !imu.accel.norm_squared().is_finite() || !rate.is_finite() {
            return active;
        }
        let blow = self.blow.get_or_insert(imu.accel);
        *blow += (imu.accel - *blow) * config.blow_weight;
        let force = blow.norm();
        let [mean, variance] = self.force;
        let landing = phase == FlightPhase::Landing;
        let impact = if landing { config.landing_impact } else { config.impact };
        let limit = impact.max(mean + config.impact_sigmas * math::sqrt(variance));
        self.impacts = if force >= limit { self.impacts.saturating_add(1) } else { 0 };
        self.overspeeds = if rate >= config.rate { self.overspeeds.saturating_add(1) } else { 0 };
        // An impact must not raise its own threshold: outliers enter clipped.
        let off = force.min(limit) - mean;
        let weight = config.vibration_weight;
        self.force = [mean + weight * off, variance + weight * (off * off - variance)];
        let gravity = self.gravity.get_or_insert(imu.accel);
        *gravity += (imu.accel - *gravity) * config.gravity_weight;
        let mut active = active;
        if self.impacts >= config.motion_samples {
            active |= Alerts::IMPACT;
        }
        if self.overspeeds >= config.motion_samples {
            active |= Alerts::GYRO_ANOMALY;
        }
        active
    }

    fn inspect_attitude(&mut self, active: Alerts, now: Instant, input: &FailsafeInput<'_>) -> Alerts {
        let known = input.estimate.valid.contains(Validity::TILT);
        let flying =
            matches!(input.flight_status.phase, FlightPhase::TakeOff | FlightPhase::Flying | FlightPhase::Landing);
        let config = &self.config;
        let over = flying
            && known
            && input.flight_status.mode != FlightMode::Acro
            && frame::tilt(&input.estimate.attitude) > config.tumble_tilt;
        let tumbled = lasts(&mut self.tumbled, now, over, config.tumble_time);
        let standing = input.flight_status.phase == FlightPhase::IdleGround && known;
        let apart = standing
            && self.gravity.is_some_and(|force| {
                let up = input.estimate.attitude.inverse_transform_vector(&-Vec3::z());
                math::acos(force.dot(&up) / force.norm().max(1e-3)) > config.tilt_mismatch
            });
        let mismatch = lasts(&mut self.mismatch, now, apart, config.tilt_mismatch_time);
        let active = active.set(Alerts::TILT_MISMATCH, mismatch);
        if tumbled { active | Alerts::TUMBLED } else { active }
    }

    fn inspect_power(&mut self, active: Alerts, now: Instant, input: &FailsafeInput<'_>, disarmed: bool) -> Alerts {
        let last = self.last_power;
        let fresh = input.power.filter(|(at, power)| last != Some(*at) && power.voltage.is_finite());
        let Some((at, power)) = fresh else {
            // At power-on the monitor gets as long for its first sample.
            let silence = last.map_or(now.since(Instant::ZERO), |at| now.since(at));
            return active.set(Alerts::POWER_LOST, silence >= self.config.power_silence);
        };
        self.last_power = Some(at);
        let active = active.set(Alerts::POWER_LOST, now.since(at) >= self.config.power_silence);
        if power.voltage < self.config.no_meter {
            return active;
        }
        let dt = last.map_or(0.0, |last| at.since(last).seconds());
        let before = self.voltage.unwrap_or(power.voltage);
        let voltage = before + (power.voltage - before) * (dt / (self.config.battery_time + dt));
        self.voltage = Some(voltage);
        let below = |alert: Alerts, limit: f32| {
            let hysteresis = if active.contains(alert) { self.config.battery_hysteresis } else { 0.0 };
            voltage <= limit + hysteresis
        };
        active
            .set(Alerts::USB_POWER, below(Alerts::USB_POWER, self.config.usb) && disarmed)
            .set(Alerts::LOW_BATTERY, below(Alerts::LOW_BATTERY, self.config.battery_low))
            .set(Alerts::CRITICAL_BATTERY, below(Alerts::CRITICAL_BATTERY, self.config.battery_critical))
    }
}

/// Has the condition held for this time without a break?
fn lasts(since: &mut Option<Instant>, now: Instant, holds: bool, time: Duration) -> bool {
    if !holds {
        *since = None;
        return false;
    }
    now.since(*since.get_or_insert(now)) >= time
}

#[cfg(test)]
mod tests;
