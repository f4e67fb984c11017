//! Anomaly detection: conditions in, a set of alerts out. It detects and never acts; the mode machine decides.
//!
//! The numbers of this table are the defaults of [`FailsafeConfig`].
//!
//! | alert | condition | clears |
//! |---|---|---|
//! | `IMPACT` | a blow that does not come from above: ‖accel‖ over about 10 ms above 3 g (6 g while landing; a push from below does not count within 0.2 m of the ground at less than 1.2 m/s), and above six sigma of the present vibration, in two samples running, in four that follow from each other when they may be garbage; at once when two samples running are above it by themselves and from one side, and, where no contact is expected, when three samples of the chip running agree on 4 g that is no vibration and does not come from above | disarmed |
//! | `STRUCK` | a blow from above on a vehicle that is upright | disarmed |
//! | `GYRO_ANOMALY` | ‖gyro‖ above 800 °/s, 1800 °/s while it turns over, in two samples running, in four that follow from each other when they may be garbage | disarmed |
//! | `TUMBLED` | tilt above 60° for 300 ms; above 75° while armed on the ground, above 40°, for 20 ms while taking off; for as long below 0.08 m, turning to 14° from how it stood within 50 ms, while taking off or landing; in ACRO and while it turns over above 120° for a second | disarmed |
//! | `MOTOR_WEAK` | in the air, a torque about roll and pitch, as far as the motors can make it, that is 0.3 of what one rotor's share of the weight makes above the usual one, or 0.75 of it, for 0.1 s | disarmed |
//! | `MOTOR_LOST` | in the air, such a torque about roll and about pitch that is more than one rotor's share of the weight makes, for 0.1 s | disarmed |
//! | `MOTOR_RUNS` | disarmed, and the battery's low-passed current is one that only a motor takes | with less, or armed |
//! | `NO_LIFT` | taking off, below 0.08 m, a thrust of 1.1 of the weight is asked for, and 0.1 of the weight more than the specific force shows, for 2 s; flying, the motors get all there is, make less than 1.2 of the weight, and it does not climb, for 3 s | disarmed |
//! | `IMU_DEGRADED`, `IMU_LOST` | no inertial sample for 10 ms, 50 ms; one that is not finite is none | with the next sample; `IMU_LOST` disarmed |
//! | `IMU_FAULTY` | the gyro does not measure: stuck or at full scale, or samples are garbage for more than 50 ms; on the ground a force that is not gravity | disarmed |
//! | `ACCEL_FAULTY` | the accelerometer is stuck or at full scale, and the gyro is not | disarmed |
//! | `FORCE_IMPLAUSIBLE` | in the air, a specific force that is neither near gravity nor what thrust and drag make, in the mean over 0.4 s and for a second | disarmed |
//! | `IMU_NOISY` | more than one inertial sample in 25 is garbage, or six close together are | disarmed |
//! | `COMM_LOST` | no command of any kind for 500 ms, or since power-on | with the next command |
//! | `LOW_BATTERY`, `CRITICAL_BATTERY` | low-passed voltage below 3.4 V, 3.0 V | 0.1 V higher |
//! | `POWER_LOST` | no finite battery sample for 1 s; a voltage below 0.1 V is one: no meter is fitted | with the next one |
//! | `POWER_IMPLAUSIBLE` | armed, and the voltage changes as no battery's does, or is none | with a plausible one, or disarmed |
//! | `USB_POWER` | voltage below 3.3 V while disarmed | 0.1 V higher |
//! | `TOF_LOST`, `FLOW_LOST`, `BARO_LOST` | no usable sample for 1 s | with the next one |
//! | `RANGE_IMPLAUSIBLE`, `FLOW_IMPLAUSIBLE` | the monitor has found that they are wrong | when it no longer does |
//! | `TILT_MISMATCH` | gravity and estimated tilt 10° apart for 0.5 s on the ground | with agreement |
//! | `ESTIMATE_DIVERGED` | the estimator says so | disarmed |
//!
//! What clears when disarmed stays for at least two seconds, so that lights (30 Hz) and telemetry (50 Hz) show it.
//!
//! How fast, in closed-loop simulation (`stampfly-host/tests/host/safety_sensors`), with no false alarm of any of them in 100 flights with
//! gusts of 2 m/s and twice the recorded vibration:
//!
//! | fault | found after |
//! |---|---|
//! | inertial sensor or its gyro stuck, zero, one axis stuck | 50 ms; motors off within 60 ms |
//! | accelerometer stuck, zero, one axis stuck | 50 ms; it lands |
//! | samples that are not finite, silence | 50 ms; motors off within 55 ms |
//! | full scale, garbage for good | 10 ms, 53 ms |
//! | spikes in one sample of five | 0.1 s; it lands |
//! | scale of a half or less, of both | a second, where it still flies then; it lands |
//! | range stuck at 3 cm, outliers, aliased or off by a step, frozen, ramp | 0.3 s, 0.35 s, 0.25 s, 1.5 s, 3.9 to 4.9 s |
//! | flow zero, frozen, offset, reversed or swapped | 0.2 to 0.4 s, 0.4 s, 0.2 s, 0.7 to 3.1 s |
//! | battery reading of nothing, or 0.35 V off | the first such reading, the second |
//!
//! Two more detectors are components of their own, for vehicles that need no height to know that
//! they have crashed: [`Following`], of whatever has a demand of its rates, and [`Resting`], of
//! whatever lies.
//!
//! Numbers: `safety.*` parameters of the StampFly's reference firmware. Its recorded flights show 2–3 m/s² of
//! vibration, peaks of 18; the six-sigma condition keeps a badly balanced propeller from looking like a crash.

mod attitude;
mod config;
mod following;
mod force;
mod imu;
mod input;
mod lift;
mod motion;
mod motors;
mod power;
mod resting;
mod struck;

pub use config::{FailsafeConfig, WEAK_SHARE};
pub use following::{Following, FollowingConfig};
pub use input::FailsafeInput;
pub use resting::{Resting, RestingConfig};

use attitude::AttitudeMonitor;
use force::ForceMonitor;
use imu::{ImuMonitor, ImuVerdict};
use lift::LiftMonitor;
use motion::{Contact, MotionMonitor};
use motors::MotorMonitor;
use power::PowerMonitor;
use stampfly_types::messages::{Alerts, FlightPhase, ImuData, SelfTestVerdict, SystemAlert};
use stampfly_types::{Instant, Stamped};

/// The failsafe.
///
/// ```
/// use stampfly_mode::{Failsafe, FailsafeInput};
/// use stampfly_types::{Instant, Stamped, Vec3, messages::*};
/// let mut failsafe = Failsafe::default();
/// let data = ImuData { accel: Vec3::new(0.0, 0.0, -9.81), ..Default::default() };
/// let imu = [Stamped { at: Instant::ZERO, generation: 1, data }];
/// let power = PowerData { voltage: 4.1, ..Default::default() };
/// let quiet = FailsafeInput {
///     imu: &imu, estimate: &StateEstimate::default(), status: &EstimatorStatus::default(), findings: &SensorFindings::default(),
///     power: Some((Instant::ZERO, &power)), command: Some(Instant::ZERO), tof: None, flow: None, baro: None, output: &ControlOutput::default(), unmet: [0.0; 4], thrust: None, self_test: SelfTestVerdict::NotRun, flight_status: &FlightStatus::default(),
/// };
/// assert!(failsafe.step(Instant::from_micros(2_500), &quiet).active.is_empty());
/// // The sensor says nothing any more.
/// let quiet = FailsafeInput { imu: &[], ..quiet };
/// assert!(failsafe.step(Instant::from_micros(60_000), &quiet).active.contains(Alerts::IMU_LOST));
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Failsafe {
    config: FailsafeConfig,
    active: Alerts,
    seen: Alerts,
    /// Stamp of the newest inertial sample, and when the sensor was last heard: no later than now.
    last_imu: Option<Instant>,
    heard_imu: Instant,
    heard_tof: Instant,
    heard_flow: Instant,
    heard_baro: Instant,
    /// When one of the latched conditions was last present.
    latched_at: Instant,
    imu: ImuMonitor,
    force: ForceMonitor,
    motion: MotionMonitor,
    attitude: AttitudeMonitor,
    power: PowerMonitor,
    motors: MotorMonitor,
    lift: LiftMonitor,
}

/// Alerts that stay until the vehicle is disarmed, and long enough to be seen.
const LATCHED: Alerts = Alerts::IMPACT
    .with(Alerts::GYRO_ANOMALY)
    .with(Alerts::TUMBLED)
    .with(Alerts::IMU_LOST)
    .with(Alerts::IMU_FAULTY)
    .with(Alerts::ESTIMATE_DIVERGED)
    .with(Alerts::MOTOR_WEAK)
    .with(Alerts::MOTOR_LOST)
    .with(Alerts::NO_LIFT)
    .with(Alerts::FORCE_IMPLAUSIBLE)
    .with(Alerts::ACCEL_FAULTY)
    .with(Alerts::STRUCK)
    .with(Alerts::IMU_NOISY);

impl Default for Failsafe {
    fn default() -> Self {
        Self::new(FailsafeConfig::default())
    }
}

impl Failsafe {
    /// Nothing wrong yet.
    #[must_use]
    pub fn new(config: FailsafeConfig) -> Self {
        Self {
            config,
            active: Alerts::NONE,
            seen: Alerts::NONE,
            last_imu: None,
            // At power-on a sensor gets as long for its first sample.
            heard_imu: Instant::ZERO,
            heard_tof: Instant::ZERO,
            heard_flow: Instant::ZERO,
            heard_baro: Instant::ZERO,
            latched_at: Instant::ZERO,
            imu: ImuMonitor::default(),
            force: ForceMonitor::default(),
            motion: MotionMonitor::default(),
            attitude: AttitudeMonitor::new(&config),
            power: PowerMonitor::default(),
            motors: MotorMonitor::default(),
            lift: LiftMonitor::default(),
        }
    }

    /// One step; runs on a deadline when there are no samples.
    pub fn step(&mut self, now: Instant, input: &FailsafeInput<'_>) -> SystemAlert {
        let status = input.flight_status;
        let mut found = Alerts::NONE;
        for sample in input.imu {
            found |= self.inspect(now, sample, input);
        }
        let config = &self.config;
        let silence = now.since(self.heard_imu);
        let known_weak = self.active.contains(Alerts::MOTOR_WEAK);
        let [weak, lost] = self.motors.step(config, now, input, known_weak);
        let [tumbled, mismatch] = self.attitude.step(config, now, input, known_weak);
        found = found
            .set(Alerts::IMU_LOST, silence >= config.imu_lost)
            .set(Alerts::TUMBLED, tumbled)
            .set(Alerts::MOTOR_WEAK, weak)
            .set(Alerts::MOTOR_LOST, lost)
            .set(Alerts::NO_LIFT, self.lift.step(config, now, input))
            .set(Alerts::ESTIMATE_DIVERGED, input.status.diverged);
        if !found.is_empty() {
            self.latched_at = now;
        }
        let forgotten = !status.armed && now.since(self.latched_at) >= config.shown;
        let kept = if forgotten { self.active.without(LATCHED) } else { self.active };
        let active = self.power.step(config, kept | found, now, input.power, status.armed);
        let silent = |last: Option<Instant>, limit| last.is_none_or(|at| now.since(at) >= limit);
        // A stamp in the future must not stand for samples that never come.
        let lost = |heard: &mut Instant, at: Option<Instant>| {
            *heard = at.map_or(*heard, |at| (*heard).max(at.min(now)));
            now.since(*heard) >= config.aiding_silence
        };
        let active = active
            .set(Alerts::IMU_DEGRADED, silence >= config.imu_degraded)
            .set(Alerts::TILT_MISMATCH, mismatch)
            .set(Alerts::COMM_LOST, silent(input.command, config.link_silence))
            .set(Alerts::TOF_LOST, lost(&mut self.heard_tof, input.tof))
            .set(Alerts::FLOW_LOST, lost(&mut self.heard_flow, input.flow))
            .set(Alerts::BARO_LOST, lost(&mut self.heard_baro, input.baro))
            .set(Alerts::RANGE_IMPLAUSIBLE, input.findings.range.is_left_out())
            .set(Alerts::FLOW_IMPLAUSIBLE, input.findings.flow.is_left_out())
            .set(Alerts::SELF_TEST_FAILED, input.self_test == SelfTestVerdict::Failed)
            .set(Alerts::SELF_TEST_DIFFERS, input.self_test == SelfTestVerdict::WithinTolerance);
        self.active = active;
        self.seen |= active;
        SystemAlert { active, seen: self.seen }
    }

    /// Looks at one inertial sample.
    fn inspect(&mut self, now: Instant, sample: &Stamped<ImuData>, input: &FailsafeInput<'_>) -> Alerts {
        let Stamped { at, data: imu, .. } = sample;
        // A sum of squares that overflows is no measurement either.
        let finite = (imu.accel.norm_squared() + imu.gyro.norm_squared()).is_finite();
        if self.last_imu.replace(*at) == Some(*at) || !finite {
            return Alerts::NONE;
        }
        // A stamp in the future must not stand for samples that never come.
        self.heard_imu = self.heard_imu.max((*at).min(now));
        let contact = Contact::expected(&self.config, input);
        let phase = input.flight_status.phase;
        let rate = if phase == FlightPhase::Flip { self.config.flip_rate } else { self.config.rate };
        let (found, suspect) = self.motion.step(&self.config, *at, imu, contact, rate);
        let ImuVerdict { mut faulty, accel_faulty, noisy } = self.imu.step(&self.config, imu, suspect);
        let mut implausible = false;
        if !suspect {
            self.attitude.add(&self.config, imu);
            let unknown = Alerts::MOTOR_WEAK | Alerts::POWER_LOST | Alerts::POWER_IMPLAUSIBLE;
            let known = !self.active.intersects(unknown);
            let unexplained = self.force.step(&self.config, *at, imu, input, known);
            let stands = phase == FlightPhase::IdleGround;
            // A force that is not measured contradicts nothing.
            let felt = !accel_faulty && !self.active.contains(Alerts::ACCEL_FAULTY);
            faulty |= unexplained && stands && felt;
            implausible = unexplained && !stands && felt;
        }
        let found = struck::from_above(found, input, &self.motion.force());
        found
            .set(Alerts::IMU_FAULTY, faulty)
            .set(Alerts::ACCEL_FAULTY, accel_faulty && !faulty)
            .set(Alerts::IMU_NOISY, noisy)
            .set(Alerts::FORCE_IMPLAUSIBLE, implausible)
    }
}

#[cfg(test)]
mod tests;
