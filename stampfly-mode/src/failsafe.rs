<<<<<<< HEAD
//! Anomaly detection: conditions in, a set of alerts out. It detects and never acts; the mode machine decides.
//!
//! | alert | condition | clears |
//! |---|---|---|
//! | `IMPACT` | ‖accel‖ over about 10 ms above 3 g, and above six sigma of the present vibration, in two samples running | when disarmed |
//! | `GYRO_ANOMALY` | ‖gyro‖ above 800 °/s in two samples running | when disarmed |
//! | `TUMBLED` | tilt above 60° for 300 ms, except in ACRO | when disarmed |
//! | `IMU_DEGRADED`, `IMU_LOST` | no inertial sample for 10 ms, 25 ms | with the next sample; `IMU_LOST` when disarmed |
//! | `COMM_LOST` | no command for 500 ms, once there was one | with the next command |
//! | `LOW_BATTERY`, `CRITICAL_BATTERY` | low-passed voltage below 3.4 V, 3.0 V | 0.1 V higher |
//! | `USB_POWER` | voltage below 3.3 V while disarmed | 0.1 V higher |
//! | `TOF_LOST`, `FLOW_LOST` | no usable sample for 1 s in the air | with the next one |
//! | `TILT_MISMATCH` | gravity and estimated tilt 10° apart for 0.5 s on the ground | with agreement |
//! | `ESTIMATE_DIVERGED` | the estimator says so | when it no longer does |
//!
//! Numbers: `safety.*` parameters of the StampFly's reference firmware. Its recorded flights show 2–3 m/s² of
//! vibration, peaks of 18; the six-sigma condition keeps a badly balanced propeller from looking like a crash.

use stampfly_types::messages::{
    Alerts, EstimatorStatus, FlightMode, FlightState, ImuData, PowerData, StateEstimate, SystemAlert, SystemMode,
    Validity,
};
use stampfly_types::{GRAVITY, Micros, Vec3, frame, math};

/// Thresholds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FailsafeConfig {
    /// Impact, m/s².
    pub impact: f32,
    /// Impact, in standard deviations of the vibration.
    pub impact_sigmas: f32,
    /// Angular rate, rad/s.
    pub rate: f32,
    /// Tilt, rad, and for how long, s.
    pub tumble: [f32; 2],
    /// Silence of the inertial sensor: degraded, lost.
    pub imu_silence: [Micros; 2],
    /// Silence of the command link.
    pub link_silence: Micros,
    /// Battery: warn, land, V.
    pub battery: [f32; 2],
    /// Below this a disarmed vehicle has no battery, V.
    pub usb: f32,
    /// Hysteresis of the battery thresholds, V.
    pub battery_hysteresis: f32,
    /// Time constant of the battery low-pass, s.
    pub battery_time: f32,
    /// Silence of range and flow in the air.
    pub aiding_silence: Micros,
    /// Disagreement of gravity and tilt on the ground, rad, and for how long, s.
    pub tilt_mismatch: [f32; 2],
=======
//! Detectors of everything that can go wrong, stepped at the control rate.
//!
//! They say what is the case ([`Alerts`]), never what to do; the machine decides. An alert is a level: it stays while its
//! condition does. Those that stop the motors or end the flight are also sticky until the vehicle is disarmed, so that a
//! condition that comes and goes within a period is not missed.
//!
//! # Impact
//! Three rules keep it from firing on a healthy flight. Two consecutive samples must both exceed the limit, and so must
//! their vector mean: propeller vibration alternates and cancels in the mean, a blow does not. (Recorded flights peak at
//! 2.0 g; 10 m/s² RMS of white vibration passes.) And close to the ground the blow must also have changed the velocity by
//! more than a touchdown does: 0.5 m/s of sink, with a rebound of half of it, is 0.75 m/s, a crash is more.

use stampfly_types::messages::{
    Alerts, EstimatorStatus, FlightMode, FlightState, GroundContact, ImuData, PowerData, StateEstimate, SystemAlert,
    SystemMode, Validity, VehicleStatus,
};
use stampfly_types::{GRAVITY, Micros, Vec3};

use crate::Dated;
use crate::arming::cos_tilt;
use crate::persist::Persist;

/// Thresholds of all detectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FailsafeConfig {
    /// Specific force of an impact, m/s², on two consecutive samples.
    pub impact_force: f32,
    /// Change of velocity that makes a blow near the ground an impact, m/s.
    pub impact_velocity: f32,
    /// Angular rate that no flight reaches, rad/s, on two consecutive samples.
    pub rate_max: f32,
    /// Silence of all command links.
    pub command_timeout: Micros,
    /// Battery warning, V, and the rise that ends it.
    pub battery_low: f32,
    /// Battery at which the vehicle must land, V.
    pub battery_critical: f32,
    /// On the ground: no battery, or powered from USB, V.
    pub battery_usb: f32,
    /// Rise above a battery threshold that ends its alert, V.
    pub battery_hysteresis: f32,
    /// Time constant of the battery low-pass, s.
    pub battery_time: f32,
    /// Silence of the inertial sensor that degrades control.
    pub imu_degraded: Micros,
    /// Silence of the inertial sensor that stops the motors.
    pub imu_lost: Micros,
    /// Cosine of the tilt beyond which the vehicle tumbles.
    pub tumble_cos: f32,
    /// For how long.
    pub tumble_time: Micros,
    /// Cosine of the tilt beyond which it is upside down.
    pub inverted_cos: f32,
    /// For how long.
    pub inverted_time: Micros,
    /// Time without a usable range in the air.
    pub range_timeout: Micros,
    /// Time without a usable flow in the air.
    pub flow_timeout: Micros,
    /// Cosine of the angle between estimated and measured vertical that is a mismatch.
    pub mismatch_cos: f32,
    /// For how long.
    pub mismatch_time: Micros,
    /// Time constant of the low-pass on the measured vertical, s.
    pub mismatch_filter: f32,
    /// Largest believable distance from the origin, m.
    pub position_max: f32,
    /// Largest believable speed, m/s.
    pub velocity_max: f32,
>>>>>>> control
}

impl Default for FailsafeConfig {
    fn default() -> Self {
        Self {
<<<<<<< HEAD
            impact: 3.0 * GRAVITY,
            impact_sigmas: 6.0,
            rate: 13.96,
            tumble: [1.05, 0.3],
            imu_silence: [Micros::from_millis(10), Micros::from_millis(25)],
            link_silence: Micros::from_millis(500),
            battery: [3.4, 3.0],
            usb: 3.3,
            battery_hysteresis: 0.1,
            battery_time: 2.0,
            aiding_silence: Micros::from_secs(1),
            tilt_mismatch: [0.1745, 0.5],
=======
            impact_force: 3.0 * GRAVITY,
            impact_velocity: 1.0,
            rate_max: 13.963, // 800 °/s
            command_timeout: Micros::from_millis(500),
            battery_low: 3.4,
            battery_critical: 3.0,
            battery_usb: 3.3,
            battery_hysteresis: 0.1,
            battery_time: 1.0,
            imu_degraded: Micros::from_millis(10),
            imu_lost: Micros::from_millis(25),
            tumble_cos: 0.5, // 60°
            tumble_time: Micros::from_millis(300),
            inverted_cos: -0.5, // 120°
            inverted_time: Micros::from_millis(100),
            range_timeout: Micros::from_millis(300),
            flow_timeout: Micros::from_millis(300),
            mismatch_cos: 0.984_81, // 10°
            mismatch_time: Micros::from_millis(500),
            mismatch_filter: 1.0,
            position_max: 100.0,
            velocity_max: 50.0,
>>>>>>> control
        }
    }
}

<<<<<<< HEAD
/// What the failsafe looks at. Times are those of the newest sample, usable or authentic.
#[derive(Clone, Copy, Debug)]
pub struct FailsafeInput<'a> {
    /// Newest inertial sample.
    pub imu: Option<(Micros, &'a ImuData)>,
    /// The estimate.
    pub estimate: &'a StateEstimate,
    /// The estimator's own opinion.
    pub status: &'a EstimatorStatus,
    /// Newest battery sample.
    pub power: Option<(Micros, &'a PowerData)>,
    /// Newest command of any kind.
    pub command: Option<Micros>,
    /// Newest usable range.
    pub tof: Option<Micros>,
    /// Newest usable flow.
    pub flow: Option<Micros>,
    /// State and mode one step ago.
    pub mode: &'a SystemMode,
}

/// The failsafe.
///
/// ```
/// use stampfly_mode::{Failsafe, FailsafeInput};
/// use stampfly_types::{Micros, Vec3, messages::*};
/// let mut failsafe = Failsafe::default();
/// let imu = ImuData { accel: Vec3::new(0.0, 0.0, -9.81), ..Default::default() };
/// let quiet = FailsafeInput {
///     imu: Some((Micros(0), &imu)), estimate: &StateEstimate::default(), status: &EstimatorStatus::default(),
///     power: None, command: None, tof: None, flow: None, mode: &SystemMode::default(),
/// };
/// assert!(failsafe.step(Micros(2_500), &quiet).active.is_empty());
/// // The sensor says nothing any more.
/// assert!(failsafe.step(Micros(30_000), &quiet).active.contains(Alerts::IMU_LOST));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
=======
/// All the detectors look at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FailsafeInput<'a> {
    /// The newest inertial sample.
    pub imu: Option<Dated<&'a ImuData>>,
    /// The state estimate.
    pub estimate: &'a StateEstimate,
    /// How the estimator is doing.
    pub estimator: &'a EstimatorStatus,
    /// The newest battery reading.
    pub power: Option<Dated<PowerData>>,
    /// When the newest authentic command of any link arrived, heartbeats included.
    pub last_command: Option<Micros>,
    /// When the newest usable range was taken.
    pub last_range: Option<Micros>,
    /// When the newest usable flow was taken.
    pub last_flow: Option<Micros>,
    /// State and mode decided in the previous period.
    pub mode: &'a SystemMode,
    /// Contact with the ground found in the previous period.
    pub status: &'a VehicleStatus,
}

/// Alerts that go with their condition. All others stay until the vehicle is disarmed.
const NOT_STICKY: Alerts = Alerts::COMM_LOST
    .with(Alerts::LOW_BATTERY)
    .with(Alerts::USB_POWER)
    .with(Alerts::IMU_DEGRADED)
    .with(Alerts::TOF_LOST)
    .with(Alerts::FLOW_LOST)
    .with(Alerts::TILT_MISMATCH);

/// The detectors.
///
/// ```
/// use stampfly_mode::{Dated, Failsafe, FailsafeInput};
/// use stampfly_types::{Micros, Vec3, messages::*};
///
/// let mut failsafe = Failsafe::default();
/// let mode = SystemMode { state: FlightState::Flying, armed: true, ..Default::default() };
/// let status = VehicleStatus { contact: GroundContact::Air, ..Default::default() };
/// let mut step = |now: Micros, force: f32| {
///     let imu = ImuData { accel: Vec3::new(force, 0.0, -9.81), ..Default::default() };
///     failsafe.step(now, &FailsafeInput {
///         imu: Some(Dated { at: now, data: &imu }), estimate: &Default::default(), estimator: &Default::default(),
///         power: None, last_command: Some(now), last_range: Some(now), last_flow: Some(now), mode: &mode, status: &status,
///     }).active
/// };
/// assert!(!step(Micros(2_500), 40.0).contains(Alerts::IMPACT), "one sample is no impact");
/// assert!(step(Micros(5_000), 40.0).contains(Alerts::IMPACT));
/// assert!(step(Micros(7_500), 0.0).contains(Alerts::IMPACT), "and it is not forgotten");
/// ```
#[derive(Clone, Debug, PartialEq)]
>>>>>>> control
pub struct Failsafe {
    config: FailsafeConfig,
    active: Alerts,
    seen: Alerts,
<<<<<<< HEAD
    last_imu: Option<Micros>,
    last_step: Option<Micros>,
    impacts: u32,
    overspeeds: u32,
    /// Specific force over about 10 ms: a blow lasts that long, a propeller's shaking averages out.
    blow: Option<Vec3>,
    /// Running mean and variance of its norm over about 100 ms.
    force: [f32; 2],
    /// Specific force with a time constant of a second, for the tilt on the ground.
    gravity: Option<Vec3>,
    tumbled: Option<Micros>,
    mismatch: Option<Micros>,
    voltage: Option<f32>,
    last_power: Option<Micros>,
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
    pub fn step(&mut self, now: Micros, input: &FailsafeInput<'_>) -> SystemAlert {
        let disarmed = !input.mode.armed;
        let mut active = if disarmed { self.active.without(LATCHED) } else { self.active };
        if let Some((at, imu)) = input.imu
            && self.last_imu != Some(at)
        {
            self.last_imu = Some(at);
            active = self.inspect_motion(active, imu);
        }
        let silence = self.last_imu.map_or(now, |at| now.since(at));
        let [degraded, lost] = self.config.imu_silence;
        active = active.set(Alerts::IMU_DEGRADED, silence >= degraded);
        if silence >= lost {
            active |= Alerts::IMU_LOST;
        }
        active = self.inspect_attitude(active, now, input);
        active = self.inspect_power(active, input, disarmed);
        let airborne = matches!(input.mode.state, FlightState::Flying | FlightState::Landing);
        let silent = |last: Option<Micros>, limit| last.is_none_or(|at| now.since(at) >= limit);
        active = active
            .set(Alerts::COMM_LOST, input.command.is_some() && silent(input.command, self.config.link_silence))
            .set(Alerts::TOF_LOST, airborne && silent(input.tof, self.config.aiding_silence))
            .set(Alerts::FLOW_LOST, airborne && silent(input.flow, self.config.aiding_silence))
            .set(Alerts::ESTIMATE_DIVERGED, input.status.diverged);
        self.last_step = Some(now);
        self.active = active;
        self.seen |= active;
        SystemAlert { active, seen: self.seen }
    }

    fn inspect_motion(&mut self, active: Alerts, imu: &ImuData) -> Alerts {
        let rate = imu.gyro.norm();
        if !imu.accel.norm().is_finite() || !rate.is_finite() {
            return active;
        }
        let blow = self.blow.get_or_insert(imu.accel);
        *blow += (imu.accel - *blow) * 0.3;
        let force = blow.norm();
        let [mean, variance] = self.force;
        let limit = self.config.impact.max(mean + self.config.impact_sigmas * math::sqrt(variance));
        self.impacts = if force >= limit { self.impacts.saturating_add(1) } else { 0 };
        self.overspeeds = if rate >= self.config.rate { self.overspeeds.saturating_add(1) } else { 0 };
        // An impact must not raise its own threshold: outliers enter clipped.
        let off = force.min(limit) - mean;
        self.force = [mean + 0.02 * off, variance + 0.02 * (off * off - variance)];
        let gravity = self.gravity.get_or_insert(imu.accel);
        *gravity += (imu.accel - *gravity) * 0.0025;
        let mut active = active;
        if self.impacts >= 2 {
            active |= Alerts::IMPACT;
        }
        if self.overspeeds >= 2 {
            active |= Alerts::GYRO_ANOMALY;
        }
        active
    }

    fn inspect_attitude(&mut self, active: Alerts, now: Micros, input: &FailsafeInput<'_>) -> Alerts {
        let known = input.estimate.valid.contains(Validity::TILT);
        let flying = matches!(input.mode.state, FlightState::TakeOff | FlightState::Flying | FlightState::Landing);
        let [tilt, time] = self.config.tumble;
        let over =
            flying && known && input.mode.mode != FlightMode::Acro && frame::tilt(&input.estimate.attitude) > tilt;
        let tumbled = lasts(&mut self.tumbled, now, over, time);
        let [angle, time] = self.config.tilt_mismatch;
        let standing = input.mode.state == FlightState::IdleGround && known;
        let apart = standing
            && self.gravity.is_some_and(|force| {
                let up = input.estimate.attitude.inverse_transform_vector(&-Vec3::z());
                math::acos(force.dot(&up) / force.norm().max(1e-3)) > angle
            });
        let mismatch = lasts(&mut self.mismatch, now, apart, time);
        let active = active.set(Alerts::TILT_MISMATCH, mismatch);
        if tumbled { active | Alerts::TUMBLED } else { active }
    }

    fn inspect_power(&mut self, active: Alerts, input: &FailsafeInput<'_>, disarmed: bool) -> Alerts {
        let Some((at, power)) = input.power else { return active };
        if self.last_power == Some(at) || !power.voltage.is_finite() || power.voltage < 0.1 {
            return active; // No new reading, or no meter.
        }
        let dt = self.last_power.map_or(0.0, |last| at.since(last).seconds());
        self.last_power = Some(at);
        let before = self.voltage.unwrap_or(power.voltage);
        let voltage = before + (power.voltage - before) * (dt / (self.config.battery_time + dt));
        self.voltage = Some(voltage);
        let below = |alert: Alerts, limit: f32| {
            let hysteresis = if active.contains(alert) { self.config.battery_hysteresis } else { 0.0 };
            voltage <= limit + hysteresis
        };
        let [warn, land] = self.config.battery;
        active
            .set(Alerts::USB_POWER, below(Alerts::USB_POWER, self.config.usb) && disarmed)
            .set(Alerts::LOW_BATTERY, below(Alerts::LOW_BATTERY, warn))
            .set(Alerts::CRITICAL_BATTERY, below(Alerts::CRITICAL_BATTERY, land))
    }
}

/// Has the condition held for `seconds` without a break?
fn lasts(since: &mut Option<Micros>, now: Micros, holds: bool, seconds: f32) -> bool {
    if !holds {
        *since = None;
        return false;
    }
    now.since(*since.get_or_insert(now)).seconds() >= seconds
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    struct Rig {
        failsafe: Failsafe,
        mode: SystemMode,
        now: u64,
    }

    impl Rig {
        fn flying() -> Self {
            let mode =
                SystemMode { state: FlightState::Flying, mode: FlightMode::PosHold, armed: true, ..Default::default() };
            Self { failsafe: Failsafe::default(), mode, now: 0 }
        }

        fn sample(&mut self, accel: Vec3, gyro: Vec3) -> Alerts {
            self.now += 2_500;
            let now = Micros(self.now);
            let imu = ImuData { accel, gyro, temperature: 25.0 };
            let input = FailsafeInput {
                imu: Some((now, &imu)),
                estimate: &StateEstimate { valid: Validity::ALL, ..Default::default() },
                status: &EstimatorStatus::default(),
                power: None,
                command: Some(now),
                tof: Some(now),
                flow: Some(now),
                mode: &self.mode,
            };
            self.failsafe.step(now, &input).active
        }
    }

    const REST: Vec3 = Vec3::new(0.0, 0.0, -GRAVITY);

    #[test]
    fn a_crash_is_seen_within_some_samples_and_stays() {
        let mut rig = Rig::flying();
        for _ in 0..400 {
            assert!(rig.sample(REST, Vec3::zeros()).is_empty());
        }
        assert!(rig.sample(REST * 8.0, Vec3::zeros()).is_empty(), "one sample is a glitch");
        assert!(rig.sample(REST, Vec3::zeros()).is_empty());
        let seen_after = (0..8).find(|_| rig.sample(REST * 6.0, Vec3::zeros()).contains(Alerts::IMPACT));
        assert!(seen_after.is_some_and(|samples| samples <= 4), "{seen_after:?}");
        assert!(rig.sample(REST, Vec3::zeros()).contains(Alerts::IMPACT), "latched");
        rig.mode.armed = false;
        assert!(rig.sample(REST, Vec3::zeros()).is_empty(), "until disarmed");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]
        /// Gaussian vibration of up to four times what was recorded is no crash, once the motors have run a moment.
        #[test]
        fn vibration_is_no_impact(seed: u32, sigma in 0.5f32..15.0) {
            let mut rig = Rig::flying();
            let mut state = seed | 1;
            let mut noise = || {
                let mut sum = 0.0;
                for _ in 0..12 {
                    state ^= state << 13; state ^= state >> 17; state ^= state << 5;
                    sum += state as f32 / u32::MAX as f32;
                }
                sum - 6.0
            };
            for k in 0..8_000u32 {
                // Rotors take some tenths of a second to spin up.
                let strength = sigma * (k as f32 / 200.0).min(1.0);
                let accel = REST + Vec3::new(noise(), noise() * 0.3, noise()) * strength;
                prop_assert!(rig.sample(accel, Vec3::zeros()).is_empty());
            }
        }
    }

    #[test]
    fn the_battery_warns_before_it_lands() {
        let mut failsafe = Failsafe::default();
        let mode = SystemMode { armed: true, ..Default::default() };
        let mut step = |k: u64, voltage: f32| {
            let at = Micros(k * 100_000);
            let power = PowerData { voltage, ..Default::default() };
            let imu = ImuData { accel: REST, ..Default::default() };
            let input = FailsafeInput {
                imu: Some((at, &imu)),
                estimate: &StateEstimate::default(),
                status: &EstimatorStatus::default(),
                power: Some((at, &power)),
                command: None,
                tof: None,
                flow: None,
                mode: &mode,
            };
            failsafe.step(at, &input).active
        };
        for k in 0..50 {
            assert!(step(k, 3.7).is_empty());
        }
        assert!((50..100).map(|k| step(k, 3.35)).last().is_some_and(|a| a == Alerts::LOW_BATTERY));
        assert!((100..200).map(|k| step(k, 2.9)).last().is_some_and(|a| a.contains(Alerts::CRITICAL_BATTERY)));
        assert!((200..300).map(|k| step(k, 3.05)).last().is_some_and(|a| a.contains(Alerts::CRITICAL_BATTERY)));
        assert!((300..400).map(|k| step(k, 3.2)).last().is_some_and(|a| a == Alerts::LOW_BATTERY), "hysteresis");
    }
}
=======
    sample: Option<Sample>,
    /// Velocity changed by force beyond gravity, fading, m/s.
    blow: f32,
    battery: Option<f32>,
    battery_at: Option<Micros>,
    now: Option<Micros>,
    tumbled: Persist,
    inverted: Persist,
    vertical: Option<Vec3>,
    mismatched: Persist,
    started: Option<Micros>,
}

/// What is remembered of the previous inertial sample.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    at: Micros,
    force: Vec3,
    rate: f32,
}

impl Default for Failsafe {
    fn default() -> Self {
        Self::new(&FailsafeConfig::default())
    }
}

impl Failsafe {
    /// Nothing found yet.
    #[must_use]
    pub fn new(config: &FailsafeConfig) -> Self {
        Self {
            config: *config,
            active: Alerts::NONE,
            seen: Alerts::NONE,
            sample: None,
            blow: 0.0,
            battery: None,
            battery_at: None,
            now: None,
            tumbled: Persist::default(),
            inverted: Persist::default(),
            vertical: None,
            mismatched: Persist::default(),
            started: None,
        }
    }

    /// One control period.
    pub fn step(&mut self, now: Micros, input: &FailsafeInput<'_>) -> SystemAlert {
        self.started.get_or_insert(now);
        let found = self.inertial(now, input)
            | self.battery(input)
            | self.links(now, input)
            | self.estimate(input)
            | self.attitude(now, input);
        let kept = if input.mode.armed { self.active.without(NOT_STICKY) } else { Alerts::NONE };
        self.active = found | kept;
        self.seen |= self.active;
        self.now = Some(now);
        SystemAlert { active: self.active, seen: self.seen }
    }

    /// The battery voltage the thresholds are compared with, V.
    #[must_use]
    pub fn battery_voltage(&self) -> Option<f32> {
        self.battery
    }

    fn inertial(&mut self, now: Micros, input: &FailsafeInput<'_>) -> Alerts {
        let usable = input.imu.filter(|imu| is_finite(&imu.data.accel) && is_finite(&imu.data.gyro));
        // Before the first sample ever, silence is counted from the first step.
        let last = match (&usable, &self.sample) {
            (Some(imu), _) => Some(imu.at),
            (None, Some(sample)) => Some(sample.at),
            (None, None) => self.started,
        };
        let silence = last.map_or(Micros::ZERO, |last| now.since(last));
        let mut found = Alerts::NONE
            .set(Alerts::IMU_DEGRADED, silence >= self.config.imu_degraded)
            .set(Alerts::IMU_LOST, silence >= self.config.imu_lost);

        let Some(imu) = usable else { return found };
        let sample = Sample { at: imu.at, force: imu.data.accel, rate: imu.data.gyro.norm_squared() };
        let Some(before) = self.sample.replace(sample) else { return found };
        if before.at == sample.at {
            return found;
        }
        let limit = self.config.impact_force * self.config.impact_force;
        let (force, last_force) = (sample.force.norm_squared(), before.force.norm_squared());
        // Only blows are worth a square root.
        if force >= limit {
            let span = sample.at.since(before.at).seconds().min(0.01);
            self.blow += (stampfly_types::math::sqrt(force) - GRAVITY) * span;
        } else {
            // Forget within some 20 ms: one blow, not the sum of many.
            self.blow *= 0.88;
        }
        let mean = (sample.force + before.force) * 0.5;
        let hit = force >= limit && last_force >= limit && mean.norm_squared() >= limit;
        let excused = near_ground(input) && self.blow < self.config.impact_velocity;
        let rate_limit = self.config.rate_max * self.config.rate_max;
        found = found.set(Alerts::IMPACT, hit && !excused);
        found.set(Alerts::GYRO_ANOMALY, sample.rate >= rate_limit && before.rate >= rate_limit)
    }

    fn battery(&mut self, input: &FailsafeInput<'_>) -> Alerts {
        /// No battery that keeps a vehicle in the air reads less; its sensor may.
        const LEAST_IN_FLIGHT: f32 = 2.0;
        /// No battery of a vehicle of this kind reads more.
        const MOST: f32 = 60.0;
        let least = if input.mode.armed { LEAST_IN_FLIGHT } else { 0.0 };
        if let Some(power) = input.power
            && self.battery_at != Some(power.at)
            && (least..=MOST).contains(&power.data.voltage)
        {
            let span = self.battery_at.map_or(Micros::ZERO, |last| power.at.since(last)).seconds();
            let before = self.battery.unwrap_or(power.data.voltage);
            // On the ground there is no load to smooth over, and a plug is seen at once.
            let share = if input.mode.armed { span / (self.config.battery_time + span) } else { 1.0 };
            self.battery = Some(before + share * (power.data.voltage - before));
            self.battery_at = Some(power.at);
        }
        let Some(voltage) = self.battery else { return Alerts::NONE };
        let below = |threshold: f32, alert: Alerts| {
            let hysteresis = if self.active.contains(alert) { self.config.battery_hysteresis } else { 0.0 };
            voltage <= threshold + hysteresis
        };
        let usb = !input.mode.armed && below(self.config.battery_usb, Alerts::USB_POWER);
        Alerts::NONE
            .set(Alerts::LOW_BATTERY, below(self.config.battery_low, Alerts::LOW_BATTERY))
            .set(Alerts::CRITICAL_BATTERY, below(self.config.battery_critical, Alerts::CRITICAL_BATTERY))
            .set(Alerts::USB_POWER, usb)
    }

    fn links(&self, now: Micros, input: &FailsafeInput<'_>) -> Alerts {
        let older = |at: Option<Micros>, than: Micros| at.is_none_or(|at| now.since(at) >= than);
        // Close to the ground both sensors may be out of their range and say so: not a loss yet. A range finder that
        // has never delivered at all is one.
        let in_air = input.status.contact == GroundContact::Air && input.mode.armed;
        let range =
            if in_air { older(input.last_range, self.config.range_timeout) } else { input.last_range.is_none() };
        let flow = in_air && older(input.last_flow, self.config.flow_timeout);
        Alerts::NONE
            .set(Alerts::COMM_LOST, older(input.last_command, self.config.command_timeout))
            .set(Alerts::TOF_LOST, range)
            .set(Alerts::FLOW_LOST, flow)
    }

    fn estimate(&self, input: &FailsafeInput<'_>) -> Alerts {
        let estimate = input.estimate;
        let within = |vector: &Vec3, max: f32| vector.norm_squared() <= max * max;
        // NaN is within nothing.
        let sane = within(&estimate.position, self.config.position_max)
            && within(&estimate.velocity, self.config.velocity_max)
            && is_finite(&estimate.angular_rate)
            && cos_tilt(&estimate.attitude).is_finite();
        Alerts::NONE.set(Alerts::ESTIMATE_DIVERGED, input.estimator.diverged || !sane)
    }

    fn attitude(&mut self, now: Micros, input: &FailsafeInput<'_>) -> Alerts {
        let known = input.estimate.valid.contains(Validity::TILT);
        let cos = cos_tilt(&input.estimate.attitude);
        // In Acro the pilot may fly upside down.
        let judged = known && input.mode.armed && input.mode.mode != FlightMode::Acro;
        let tumbled = self.tumbled.holds(now, judged && cos < self.config.tumble_cos, self.config.tumble_time);
        let inverted = self.inverted.holds(now, judged && cos < self.config.inverted_cos, self.config.inverted_time);
        Alerts::NONE
            .set(Alerts::TUMBLED, tumbled || inverted)
            .set(Alerts::TILT_MISMATCH, self.mismatch(now, input, known))
    }

    /// Standing, the accelerometer knows the vertical; an estimate that disagrees was led astray.
    fn mismatch(&mut self, now: Micros, input: &FailsafeInput<'_>, known: bool) -> bool {
        let standing = match input.mode.state {
            FlightState::IdleGround | FlightState::Armed => true,
            FlightState::Init
            | FlightState::IdleHeld
            | FlightState::TakeOff
            | FlightState::Flying
            | FlightState::Landing => false,
        };
        let (Some(sample), true) = (&self.sample, standing && known) else {
            self.vertical = None;
            self.mismatched.reset();
            return false;
        };
        let span = self.now.map_or(Micros::ZERO, |last| now.since(last)).seconds().min(0.02);
        let before = self.vertical.unwrap_or(sample.force);
        let measured = before + (sample.force - before) * (span / (self.config.mismatch_filter + span));
        self.vertical = Some(measured);
        let norm = measured.norm_squared();
        // Half to one and a half g: only then is it the vertical that is measured.
        let plausible = (0.25..2.25).contains(&(norm / (GRAVITY * GRAVITY)));
        let attitude = &input.estimate.attitude;
        let (w, x, y, z) = (attitude.w, attitude.i, attitude.j, attitude.k);
        let down = Vec3::new(2.0 * (x * z - w * y), 2.0 * (y * z + w * x), cos_tilt(attitude));
        let along = -measured.dot(&down);
        let cos = self.config.mismatch_cos;
        let apart = along <= 0.0 || along * along < cos * cos * norm;
        self.mismatched.holds(now, plausible && apart, self.config.mismatch_time)
    }
}

/// Could this blow be a touchdown, or a take-off that scrapes?
fn near_ground(input: &FailsafeInput<'_>) -> bool {
    const CLOSE: f32 = 0.1;
    let low = input.estimate.valid.contains(Validity::HEIGHT) && input.estimate.height < CLOSE;
    let landing = input.mode.state == FlightState::Landing;
    low || landing || input.status.contact == GroundContact::Ground
}

fn is_finite(vector: &Vec3) -> bool {
    (vector.x + vector.y + vector.z).is_finite()
}
>>>>>>> control
