//! What the failsafe finds and what it does not.

mod battery;
mod force;
mod inertial;
mod lift;
mod motors;
mod struck;
mod tipping;

use super::*;
use proptest::prelude::*;
use stampfly_types::Duration;
use stampfly_types::messages::{ControlOutput, EstimatorStatus, FlightPhase, PowerData, SensorMask, StateEstimate};
use stampfly_types::messages::{Finding, Health};
use stampfly_types::messages::{FlightMode, FlightStatus, SensorFindings, Validity};
use stampfly_types::{GRAVITY, Quat, Vec3};
use std::vec;
use std::vec::Vec;

/// A control period at 400 Hz.
const PERIOD: Duration = Duration::from_micros(2_500);

struct Rig {
    failsafe: Failsafe,
    mode: FlightStatus,
    now: Instant,
    estimate: StateEstimate,
    status: EstimatorStatus,
    findings: SensorFindings,
    battery: PowerData,
    /// When the battery was read, if that was not now.
    read: Option<Instant>,
    output: ControlOutput,
    unmet: [f32; 4],
    thrust: Option<f32>,
    noise: u32,
}

impl Rig {
    fn flying() -> Self {
        let mode =
            FlightStatus { phase: FlightPhase::Flying, mode: FlightMode::PosHold, armed: true, ..Default::default() };
        Self {
            failsafe: Failsafe::default(),
            mode,
            now: Instant::ZERO,
            estimate: StateEstimate {
                height: 1.0,
                valid: Validity::ALL,
                sensors: SensorMask::TOF,
                ..Default::default()
            },
            status: EstimatorStatus::default(),
            findings: SensorFindings::default(),
            battery: PowerData { voltage: 4.1, ..Default::default() },
            read: None,
            output: ControlOutput::default(),
            unmet: [0.0; 4],
            thrust: None,
            noise: 1,
        }
    }

    /// A quiet second of the present mode.
    fn settled(mut self) -> Self {
        for _ in 0..400 {
            assert_eq!(self.sample(REST, Vec3::zeros()), Alerts::NONE);
        }
        self
    }

    /// Uniform, as large as the noise of the sensor.
    fn noise(&mut self, size: f32) -> Vec3 {
        Vec3::from_fn(|_| {
            self.noise ^= self.noise << 13;
            self.noise ^= self.noise >> 17;
            self.noise ^= self.noise << 5;
            (self.noise as f32 / u32::MAX as f32 - 0.5) * size
        })
    }

    /// A sample of a sensor that measures.
    fn sample(&mut self, accel: Vec3, gyro: Vec3) -> Alerts {
        let (accel, gyro) = (accel + self.noise(0.05), gyro + self.noise(0.005));
        self.exactly(accel, gyro)
    }

    /// A sample without noise.
    fn exactly(&mut self, accel: Vec3, gyro: Vec3) -> Alerts {
        self.now += PERIOD;
        let data = ImuData { accel, gyro, temperature: 25.0, ..Default::default() };
        self.step(self.now, &[Stamped { at: self.now, generation: 0, data }])
    }

    fn step(&mut self, now: Instant, imu: &[Stamped<ImuData>]) -> Alerts {
        let input = FailsafeInput {
            imu,
            estimate: &self.estimate,
            status: &self.status,
            findings: &self.findings,
            power: Some((self.read.unwrap_or(now), &self.battery)),
            command: Some(now),
            tof: Some(now),
            flow: Some(now),
            baro: Some(now),
            output: &self.output,
            unmet: self.unmet,
            thrust: self.thrust,
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
    let shown = (0..2_000).take_while(|_| rig.sample(REST, Vec3::zeros()) == Alerts::IMPACT).count();
    assert!((780..=800).contains(&shown), "until disarmed, for two seconds: {shown} samples");
    assert!(rig.sample(REST, Vec3::zeros()).is_empty());
}

/// In STABILIZE and ACRO nobody announces a landing.
#[test]
fn a_touchdown_by_hand_is_no_crash_and_a_fall_or_a_wall_is() {
    let struck = |height: f32, sink: f32, blow: Vec3| {
        let mut rig = Rig::flying();
        rig.mode.mode = FlightMode::Stabilize;
        rig.estimate = StateEstimate { valid: Validity::ALL, ..rig.estimate };
        (rig.estimate.height, rig.estimate.velocity.z) = (height, sink);
        for _ in 0..400 {
            rig.sample(REST, Vec3::zeros());
        }
        (0..8).any(|_| rig.sample(REST + blow, Vec3::zeros()).contains(Alerts::IMPACT))
    };
    let (below, ahead) = (Vec3::new(5.0, 0.0, -65.0), Vec3::new(-50.0, 0.0, 0.0));
    assert!(!struck(0.03, 1.0, below));
    assert!(!struck(0.03, 0.7, Vec3::new(20.0, 50.0, -68.0)), "a leg that sticks to the floor pushes to the side");
    for blow in [[70.0, 0.0, -20.0], [45.0, 0.0, -30.0], [0.0, -45.0, -30.0], [32.0, 32.0, -30.0]] {
        assert!(struck(0.03, 0.7, blow.into()), "what pushes more to the side is none: {blow:?}");
    }
    assert!(struck(0.03, 1.5, below), "a fall");
    assert!(struck(0.5, 0.3, below), "not the ground");
    assert!(struck(0.03, 0.0, ahead), "a wall");
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
        let input = FailsafeInput {
            imu: &inertial::still(k * 100),
            estimate: &StateEstimate::default(),
            status: &EstimatorStatus::default(),
            findings: &SensorFindings::default(),
            power: Some((at, &power)),
            command: Some(at),
            tof: Some(at),
            flow: Some(at),
            baro: Some(at),
            output: &ControlOutput::default(),
            unmet: [0.0; 4],
            thrust: None,
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
    let battery = PowerData { voltage: power.map_or(0.0, |(_, voltage)| voltage), ..Default::default() };
    let now = Instant::from_millis(millis);
    let input = FailsafeInput {
        imu: &inertial::still(millis),
        estimate: &StateEstimate::default(),
        status: &EstimatorStatus::default(),
        findings: &SensorFindings::default(),
        power: power.map(|(at, _)| (Instant::from_millis(at), &battery)),
        command: command.map(Instant::from_millis),
        tof: Some(now),
        flow: Some(now),
        baro: Some(now),
        output: &ControlOutput::default(),
        unmet: [0.0; 4],
        thrust: None,
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
    assert_eq!(lost_at(|now| Some((now.min(2_000), 4.1))), Some((3_000, 4_990)), "the same sample, again and again");
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
        let (estimate, status, mode): (&StateEstimate, &EstimatorStatus, &FlightStatus) = (&estimate, &status, &mode);
        let power = None;
        let input = FailsafeInput {
            imu: &[],
            estimate,
            status,
            findings: &SensorFindings::default(),
            power,
            command: Some(Instant::ZERO),
            tof: None,
            flow: None,
            baro: None,
            output: &ControlOutput::default(),
            unmet: [0.0; 4],
            thrust: None,
            self_test,
            flight_status: mode,
        };
        failsafe.step(Instant::ZERO, &input).active
    };
    assert_eq!(step(SelfTestVerdict::Identical), Alerts::NONE);
    assert_eq!(step(SelfTestVerdict::WithinTolerance), Alerts::SELF_TEST_DIFFERS);
    assert_eq!(step(SelfTestVerdict::Failed), Alerts::SELF_TEST_FAILED);
}

#[test]
fn a_silent_sensor_is_named_on_the_ground_and_in_the_air() {
    let bits = [Alerts::TOF_LOST, Alerts::FLOW_LOST, Alerts::BARO_LOST];
    for phase in [FlightPhase::IdleGround, FlightPhase::Flying] {
        for (place, bit) in bits.into_iter().enumerate() {
            let mode = FlightStatus { phase, ..Default::default() };
            let seen = |millis: u64, heard: u64| {
                let now = Instant::from_millis(millis);
                let power = PowerData { voltage: 4.0, ..Default::default() };
                let times =
                    [0, 1, 2].map(|sensor| Some(if sensor == place { Instant::from_millis(heard) } else { now }));
                let [tof, flow, baro] = times;
                let input = FailsafeInput {
                    imu: &inertial::still(millis),
                    estimate: &StateEstimate::default(),
                    status: &EstimatorStatus::default(),
                    findings: &SensorFindings::default(),
                    power: Some((now, &power)),
                    command: Some(now),
                    tof,
                    flow,
                    baro,
                    output: &ControlOutput::default(),
                    unmet: [0.0; 4],
                    thrust: None,
                    self_test: SelfTestVerdict::NotRun,
                    flight_status: &mode,
                };
                Failsafe::default().step(now, &input).active
            };
            assert_eq!(seen(2_990, 2_000), Alerts::NONE, "{phase:?}");
            assert_eq!(seen(3_000, 2_000), bit, "{phase:?}");
        }
    }
}

/// A step of the torque about roll and pitch, in units of the configured limits, after a second of another.
fn is_weak(before: [f32; 2], after: [f32; 2], lasts: usize) -> bool {
    let config = FailsafeConfig { weak_roll: 1.0, weak_pitch: 1.0, ..FailsafeConfig::default() };
    let mut rig = Rig { failsafe: Failsafe::new(config), ..Rig::flying() };
    let mut found = false;
    for (torque, samples) in [(before, 400), (after, lasts), (before, 200)] {
        rig.output.torque = Vec3::new(torque[0], torque[1], 0.0);
        for _ in 0..samples {
            found |= rig.sample(REST, Vec3::zeros()).contains(Alerts::MOTOR_WEAK);
        }
    }
    found
}

#[test]
fn a_motor_that_becomes_weak_is_found_and_a_load_that_lies_askew_is_not() {
    assert!(is_weak([0.0, 0.0], [1.5, -1.5], 80), "0.2 s");
    assert!(!is_weak([0.0, 0.0], [1.5, -1.5], 30), "a gust of 75 ms");
    assert!(!is_weak([0.0, 0.0], [4.0, 0.5], 400), "about one axis");
    assert!(!is_weak([0.9, 0.9], [1.2, 1.2], 400), "askew all the time");
    assert!(is_weak([0.4, 0.4], [-1.4, 1.6], 80), "beyond what is usual");
    assert!(is_weak([2.6, 2.6], [2.6, 2.6], 10), "weak from the take-off on");
}

/// What stands leans on the ground, and a landing is what would follow.
#[test]
fn a_weak_motor_is_looked_for_in_flight_only() {
    let found = |phase: FlightPhase, height: f32| {
        let config = FailsafeConfig { weak_roll: 1.0, weak_pitch: 1.0, ..FailsafeConfig::default() };
        let mut rig = Rig {
            failsafe: Failsafe::new(config),
            output: ControlOutput { thrust: 0.0, torque: Vec3::new(2.0, 2.0, 0.0) },
            ..Rig::flying()
        };
        (rig.mode.phase, rig.estimate.height) = (phase, height);
        (0..400).any(|_| rig.sample(REST, Vec3::zeros()).contains(Alerts::MOTOR_WEAK))
    };
    assert!(found(FlightPhase::Flying, 1.0) && found(FlightPhase::TakeOff, 0.2));
    assert!(
        !found(FlightPhase::TakeOff, 0.03) && !found(FlightPhase::Landing, 1.0) && !found(FlightPhase::Armed, 0.03)
    );
}

/// Samples until a vehicle that stood at one roll angle and has another one now counts as tumbled.
fn tumbled(phase: FlightPhase, mode: FlightMode, height: f32, [stood, tilt]: [f32; 2], torque: f32) -> Option<u32> {
    let config = FailsafeConfig { weak_roll: 1.0, weak_pitch: 1.0, ..FailsafeConfig::default() };
    let mut rig = Rig { failsafe: Failsafe::new(config), ..Rig::flying() };
    let roll = |angle: f32| Quat::from_axis_angle(&Vec3::x(), angle);
    (rig.mode.phase, rig.mode.mode, rig.estimate.attitude) = (FlightPhase::Armed, mode, roll(stood));
    for _ in 0..10 {
        rig.sample(REST, Vec3::zeros());
    }
    (rig.mode.phase, rig.estimate.height, rig.estimate.attitude) = (phase, height, roll(tilt));
    rig.output.torque = Vec3::new(torque, 0.0, 0.0);
    (1..=200).find(|_| rig.sample(REST, Vec3::zeros()).contains(Alerts::TUMBLED))
}

/// From 45 degrees a vehicle still falls back onto its feet, from 75 not.
#[test]
fn a_vehicle_that_tips_over_while_taking_off_stops() {
    let at = |phase, tilt| tumbled(phase, FlightMode::PosHold, 1.0, [0.0, tilt], 0.0);
    assert_eq!(at(FlightPhase::TakeOff, 0.65), None);
    assert!(at(FlightPhase::TakeOff, 0.75).is_some_and(|samples| (8..=10).contains(&samples)));
    assert_eq!(at(FlightPhase::Flying, 0.75), None, "a lean in flight");
}

#[test]
fn a_vehicle_that_tips_on_a_leg_stops() {
    let at = |mode, height, tilts, torque| tumbled(FlightPhase::TakeOff, mode, height, tilts, torque).is_some();
    assert!(at(FlightMode::AltHold, 0.03, [0.0, 0.3], 0.0));
    assert!(!at(FlightMode::AltHold, 0.03, [0.2, 0.3], 0.0), "a slope");
    assert!(!at(FlightMode::AltHold, 0.2, [0.0, 0.3], 0.0), "in the air");
    assert!(at(FlightMode::Stabilize, 0.03, [0.0, 0.3], -1.5), "against the controller");
    assert!(!at(FlightMode::Stabilize, 0.03, [0.0, 0.3], 1.5), "as the pilot wants");
}

/// One rate in `every` is off by 20 rad/s: are the motors cut, and does the vehicle land?
fn spikes(every: usize, samples: usize) -> [bool; 2] {
    let mut rig = Rig::flying();
    let mut seen = Alerts::NONE;
    for sample in 1..=samples {
        let off = if sample % every == 0 { 20.0 } else { 0.0 };
        seen |= rig.sample(REST, Vec3::new(off, 0.0, 0.0));
    }
    [seen.intersects(crate::decision::CUT), seen.contains(Alerts::IMU_NOISY)]
}

#[test]
fn a_noisy_gyro_ends_the_flight_by_a_landing() {
    assert_eq!(spikes(5, 4_000), [false, true]);
    assert_eq!(spikes(20, 4_000), [false, true]);
    assert_eq!(spikes(40, 4_000), [false, false], "a spike now and then");
    assert_eq!(spikes(2, 4_000), [true, true], "every second sample");
}

#[test]
fn a_sensor_that_is_left_out_is_said_and_one_with_another_zero_is_not() {
    let found = |finding| Health { finding, since: Instant::ZERO };
    let mut rig = Rig::flying().settled();
    rig.findings = SensorFindings { range: found(Finding::Stuck), ..SensorFindings::default() };
    assert_eq!(rig.sample(REST, Vec3::zeros()), Alerts::RANGE_IMPLAUSIBLE);
    rig.findings = SensorFindings { flow: found(Finding::Jumped), ..SensorFindings::default() };
    assert_eq!(rig.sample(REST, Vec3::zeros()), Alerts::FLOW_IMPLAUSIBLE);
    rig.findings = SensorFindings { gyro: found(Finding::Shifted), ..SensorFindings::default() };
    assert_eq!(rig.sample(REST, Vec3::zeros()), Alerts::NONE);
}
