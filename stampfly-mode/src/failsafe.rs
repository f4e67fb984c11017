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

use stampfly_types::messages::{
    Alerts, EstimatorStatus, FlightMode, FlightPhase, FlightStatus, ImuData, PowerData, SelfTestVerdict, StateEstimate,
    SystemAlert, Validity,
};
use stampfly_types::{Duration, GRAVITY, Instant, Vec3, frame, math};

/// Thresholds.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FailsafeConfig {
    /// Impact, m/s².
    pub impact: f32,
    /// Impact while landing, m/s²: a firm touchdown reaches 4 g.
    pub landing_impact: f32,
    /// Impact, in standard deviations of the vibration.
    pub impact_sigmas: f32,
    /// Angular rate, rad/s.
    pub rate: f32,
    /// Tilt of a vehicle that tumbles, rad.
    pub tumble_tilt: f32,
    /// For how long it is tilted so far.
    pub tumble_time: Duration,
    /// Silence of the inertial sensor after which it is degraded.
    pub imu_degraded: Duration,
    /// Silence of the inertial sensor after which it is lost.
    pub imu_lost: Duration,
    /// Silence of the command link.
    pub link_silence: Duration,
    /// Voltage of a low battery, V.
    pub battery_low: f32,
    /// Voltage of a battery with which the vehicle lands, V.
    pub battery_critical: f32,
    /// Below this a disarmed vehicle has no battery, V.
    pub usb: f32,
    /// Below this no meter is fitted, V.
    pub no_meter: f32,
    /// Hysteresis of the battery thresholds, V.
    pub battery_hysteresis: f32,
    /// Time constant of the battery low-pass, s.
    pub battery_time: f32,
    /// Silence of the battery monitor.
    pub power_silence: Duration,
    /// Silence of range and flow in the air.
    pub aiding_silence: Duration,
    /// Disagreement of gravity and tilt on the ground, rad.
    pub tilt_mismatch: f32,
    /// For how long they disagree.
    pub tilt_mismatch_time: Duration,
    /// Weight of an inertial sample in the specific force that is compared with the impact thresholds. A blow lasts some
    /// 10 ms, a propeller's shaking averages out.
    pub blow_weight: f32,
    /// Weight of an inertial sample in mean and variance of the vibration.
    pub vibration_weight: f32,
    /// Weight of an inertial sample in the gravity that is compared with the tilt on the ground.
    pub gravity_weight: f32,
    /// Samples running above a threshold of force or rate that are an alert: one alone is a glitch.
    pub motion_samples: u32,
}

impl Default for FailsafeConfig {
    /// For one lithium cell and an inertial sensor at 400 Hz: voltages grow with the number of cells, and weights of samples
    /// shrink with their rate.
    fn default() -> Self {
        Self {
            impact: 3.0 * GRAVITY,
            landing_impact: 6.0 * GRAVITY,
            impact_sigmas: 6.0,
            rate: 13.96,
            tumble_tilt: 1.05,
            tumble_time: Duration::from_millis(300),
            imu_degraded: Duration::from_millis(10),
            imu_lost: Duration::from_millis(25),
            link_silence: Duration::from_millis(500),
            battery_low: 3.4,
            battery_critical: 3.0,
            usb: 3.3,
            no_meter: 0.1,
            battery_hysteresis: 0.1,
            battery_time: 2.0,
            power_silence: Duration::from_secs(1),
            aiding_silence: Duration::from_secs(1),
            tilt_mismatch: 0.1745,
            tilt_mismatch_time: Duration::from_millis(500),
            // Time constants of about 10 ms, 100 ms and a second at 400 Hz.
            blow_weight: 0.3,
            vibration_weight: 0.02,
            gravity_weight: 0.0025,
            motion_samples: 2,
        }
    }
}

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
        let config = self.config;
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
        let config = self.config;
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
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    struct Rig {
        failsafe: Failsafe,
        mode: FlightStatus,
        now: Instant,
    }

    impl Rig {
        fn flying() -> Self {
            let mode = FlightStatus {
                phase: FlightPhase::Flying,
                mode: FlightMode::PosHold,
                armed: true,
                ..Default::default()
            };
            Self { failsafe: Failsafe::default(), mode, now: Instant::ZERO }
        }

        fn sample(&mut self, accel: Vec3, gyro: Vec3) -> Alerts {
            self.now += Duration::from_micros(2_500);
            let now = self.now;
            let imu = ImuData { accel, gyro, temperature: 25.0 };
            let input = FailsafeInput {
                imu: Some((now, &imu)),
                estimate: &StateEstimate { valid: Validity::ALL, ..Default::default() },
                status: &EstimatorStatus::default(),
                power: Some((now, &PowerData { voltage: 4.1, ..Default::default() })),
                command: Some(now),
                tof: Some(now),
                flow: Some(now),
                self_test: SelfTestVerdict::NotRun,
                flight_status: &self.mode,
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
    fn a_firm_touchdown_is_no_crash() {
        let mut rig = Rig::flying();
        rig.mode.phase = FlightPhase::Landing;
        for _ in 0..400 {
            rig.sample(REST, Vec3::zeros());
        }
        for force in [3.0, 6.0, 5.0, 2.0, 1.0, 1.0] {
            assert!(rig.sample(REST * force, Vec3::zeros()).is_empty());
        }
    }

    #[test]
    fn the_battery_warns_before_it_lands() {
        let mut failsafe = Failsafe::default();
        let mode = FlightStatus { armed: true, ..Default::default() };
        let mut step = |k: u64, voltage: f32| {
            let at = Instant::from_micros(k * 100_000);
            let power = PowerData { voltage, ..Default::default() };
            let imu = ImuData { accel: REST, ..Default::default() };
            let input = FailsafeInput {
                imu: Some((at, &imu)),
                estimate: &StateEstimate::default(),
                status: &EstimatorStatus::default(),
                power: Some((at, &power)),
                command: Some(at),
                tof: None,
                flow: None,
                self_test: SelfTestVerdict::NotRun,
                flight_status: &mode,
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

    /// Alerts of a disarmed vehicle at `millis`, with a command and a battery sample at these instants.
    fn quiet(failsafe: &mut Failsafe, millis: u64, command: Option<u64>, power: Option<(u64, f32)>) -> Alerts {
        let imu = ImuData { accel: REST, ..Default::default() };
        let battery = PowerData { voltage: power.map_or(0.0, |(_, voltage)| voltage), ..Default::default() };
        let now = Instant::from_millis(millis);
        let input = FailsafeInput {
            imu: Some((now, &imu)),
            estimate: &StateEstimate::default(),
            status: &EstimatorStatus::default(),
            power: power.map(|(at, _)| (Instant::from_millis(at), &battery)),
            command: command.map(Instant::from_millis),
            tof: None,
            flow: None,
            self_test: SelfTestVerdict::NotRun,
            flight_status: &FlightStatus::default(),
        };
        failsafe.step(now, &input).active
    }

    #[test]
    fn a_link_that_never_was_is_lost() {
        let mut failsafe = Failsafe::default();
        let battery = |now| Some((now, 4.1));
        for now in (0..3_000).step_by(10) {
            assert_eq!(quiet(&mut failsafe, now, None, battery(now)), Alerts::COMM_LOST, "{now}");
        }
        assert_eq!(quiet(&mut failsafe, 3_000, Some(3_000), battery(3_000)), Alerts::NONE);
        assert_eq!(quiet(&mut failsafe, 3_490, Some(3_000), battery(3_490)), Alerts::NONE);
        assert_eq!(quiet(&mut failsafe, 3_500, Some(3_000), battery(3_500)), Alerts::COMM_LOST);
    }

    #[test]
    fn a_battery_monitor_that_says_nothing_is_lost() {
        let lost_at = |battery: fn(u64) -> Option<(u64, f32)>| {
            let mut failsafe = Failsafe::default();
            let lost: Vec<u64> = (0..5_000)
                .step_by(10)
                .filter(|now| quiet(&mut failsafe, *now, Some(*now), battery(*now)).contains(Alerts::POWER_LOST))
                .collect();
            lost.first().copied().zip(lost.last().copied())
        };
        assert_eq!(lost_at(|_| None), Some((1_000, 4_990)), "never");
        assert_eq!(
            lost_at(|now| Some((now.min(2_000), 4.1))),
            Some((3_000, 4_990)),
            "the same sample, again and again"
        );
        assert_eq!(lost_at(|now| Some((now, f32::NAN))), Some((1_000, 4_990)), "no number");
        assert_eq!(lost_at(|now| Some((if now < 3_000 { 0 } else { now }, 4.1))), Some((1_000, 2_990)), "it returns");
        assert_eq!(lost_at(|now| Some((now / 100 * 100, 4.1))), None);
        assert_eq!(lost_at(|now| Some((now / 100 * 100, 0.0))), None, "no meter is fitted");
    }

    #[test]
    fn a_failed_self_test_is_an_alert_for_good() {
        let (estimate, status, mode) = Default::default();
        let mut failsafe = Failsafe::default();
        let mut step = |self_test| {
            let (estimate, status, mode): (&StateEstimate, &EstimatorStatus, &FlightStatus) =
                (&estimate, &status, &mode);
            let power = None;
            let input = FailsafeInput {
                imu: None,
                estimate,
                status,
                power,
                command: Some(Instant::ZERO),
                tof: None,
                flow: None,
                self_test,
                flight_status: mode,
            };
            failsafe.step(Instant::ZERO, &input).active
        };
        assert_eq!(step(SelfTestVerdict::Identical), Alerts::NONE);
        assert_eq!(step(SelfTestVerdict::WithinTolerance), Alerts::SELF_TEST_DIFFERS);
        assert_eq!(step(SelfTestVerdict::Failed), Alerts::SELF_TEST_FAILED);
    }
}
