//! What stops the motors beside the pilot: the family's detectors, with this frame's numbers.
//!
//! | found | by | when |
//! |---|---|---|
//! | the inertial sensor is stuck, at full scale, garbage | [`Failsafe`] | `IMU_FAULTY`, `ACCEL_FAULTY` after 50 ms |
//! | a blow that no touch-down makes | [`Failsafe`] | `IMPACT`, `STRUCK`, within 10 ms |
//! | a rate that no stick asks for | [`Failsafe`] | `GYRO_ANOMALY`, within 10 ms |
//! | in ANGLE, a lean far beyond every stick | [`Failsafe`] | `TUMBLED` after half a second |
//! | it does not turn as its loops want it to | [`Following`] | `TUMBLED` after 0.4 s |
//! | it lies | [`Resting`] | `TUMBLED` after half a second, also on the ground |
//!
//! None of them looks at the height, which this vehicle does not know. A vehicle that flies
//! inverted, falls with its throttle down, or is thrown about by a gust follows its loops, and
//! keeps its motors; without thrust it follows nothing, and is not asked. A sensor that is silent
//! needs none of them: without a fresh attitude the controller stops.
//!
//! The chip is polled 4000 times a second, and its accelerometer converts 1000 times: the detectors
//! see the mean of ten samples, 400 a second.

use crate::airframe::Airframe;
use crate::family;
use crate::messages::{Attitude, ControlState};
use crate::parameters::Parameters;
use crate::runnables::OFFLINE;
use serde::{Deserialize, Serialize};
use stampfly_mode::failsafe::{Failsafe, FailsafeConfig, Following, FollowingConfig, Resting, RestingConfig};
use stampfly_mode::{FailsafeInput, decision};
use stampfly_types::math::larger;
use stampfly_types::messages::{
    Alerts, ControlOutput, EstimatorStatus, ImuData, PowerData, SelfTestVerdict, SensorFindings, SystemAlert,
};
use stampfly_types::{Duration, GRAVITY, Instant, Quat, Stamped, Vec3, frame};

/// Alerts that stop the motors. It has no landing, so what asks for one does, too.
pub const CUT: Alerts = decision::CUT.with(Alerts::ACCEL_FAULTY).with(Alerts::STRUCK);
/// Samples to a mean.
const SAMPLES: u32 = 10;
/// Of the chip: ±16 g and ±2000 °/s.
const ACCEL_FULL_SCALE: f32 = 16.0 * GRAVITY;
const GYRO_FULL_SCALE: f32 = 34.9;
/// In ANGLE it leans no farther than a stick asks for, and by so much, rad, when it swings through:
/// 35°.
const SWINGS: f32 = 0.6;
/// A tilt that nothing exceeds.
const NEVER: f32 = core::f32::consts::PI;
/// Rate that is missing of one that does not follow, rad/s: half of a full stick's, as it is by
/// default. In ANGLE a slope of this, rad, asks for a rate, too, and where it is steeper the frame
/// tips over.
const MISSING: f32 = 1.5;
const SLOPE: f32 = 0.42;
/// Found tumbling, it is not armed again before this has passed: long enough to be seen.
const SHOWN: Duration = Duration::from_secs(2);

/// What the detectors look at.
#[derive(Clone, Copy, Debug)]
pub struct Looked<'a> {
    /// Attitude and rates, if they are fresh.
    pub attitude: Option<&'a Attitude>,
    /// What gestures and receiver have made of it.
    pub state: &'a ControlState,
    /// The rate that the loops want, body, rad/s.
    pub wanted: Vec3,
    /// Duties of the motors.
    pub duty: &'a [f32],
    /// Newest battery voltage.
    pub power: Option<(Instant, &'a PowerData)>,
    /// When the transmitter was last heard.
    pub heard: Option<Instant>,
}

/// A mean that is not full yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Window {
    accel: Vec3,
    gyro: Vec3,
    count: u32,
}

impl Window {
    /// Takes a sample; the mean when it is full.
    fn add(&mut self, sample: &ImuData) -> Option<[Vec3; 2]> {
        self.accel += sample.accel;
        self.gyro += sample.gyro;
        self.count += 1;
        (self.count >= SAMPLES).then(|| {
            let Self { accel, gyro, count } = core::mem::take(self);
            [accel, gyro].map(|sum| sum / count as f32)
        })
    }
}

/// The detectors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Protection {
    failsafe: Failsafe,
    following: Following,
    resting: Resting,
    following_config: FollowingConfig,
    resting_config: RestingConfig,
    hover: f32,
    /// Board → body, and the accelerometer's offset.
    mounted: Quat,
    offset: Vec3,
    window: Window,
    tumbled: Option<Instant>,
    seen: Alerts,
    active: Alerts,
}

impl Protection {
    /// Nothing found yet.
    #[must_use]
    pub fn new(airframe: &Airframe, parameters: &Parameters) -> Self {
        let stick = &parameters.stick;
        let missing = larger(MISSING, SLOPE * stick.rotation_max / stick.angle_max);
        Self {
            failsafe: Failsafe::new(config(airframe, parameters)),
            following: Following::default(),
            resting: Resting::default(),
            following_config: FollowingConfig { missing, share: 0.5, time: airframe.response },
            resting_config: RestingConfig { lean: [airframe.lies; 2], time: Duration::from_millis(500) },
            hover: airframe.hover,
            mounted: frame::from_yaw(parameters.frame.board_yaw),
            offset: Vec3::new(parameters.offset.accel_x, parameters.offset.accel_y, parameters.offset.accel_z),
            window: Window::default(),
            tumbled: None,
            seen: Alerts::NONE,
            active: Alerts::NONE,
        }
    }

    /// Other parameters. They change while it is disarmed.
    pub fn adopt(&mut self, airframe: &Airframe, parameters: &Parameters) {
        let Self { window, tumbled, seen, active, .. } = *self;
        *self = Self { window, tumbled, seen, active, ..Self::new(airframe, parameters) };
    }

    /// Takes samples, oldest first. What it has found.
    pub fn step(&mut self, now: Instant, samples: &[Stamped<ImuData>], looked: &Looked<'_>) -> SystemAlert {
        let mut mean = None;
        for Stamped { at, generation, data } in samples {
            if let Some([accel, gyro]) = self.window.add(data) {
                let [accel, gyro] = [self.mounted * accel - self.offset, self.mounted * gyro];
                let data = ImuData { accel, gyro, temperature: data.temperature, accel_peak: 0.0 };
                mean = Some(Stamped { at: *at, generation: *generation, data });
            }
        }
        if let Some(mean) = &mean {
            self.look(now, mean, looked);
        }
        SystemAlert { active: self.active, seen: self.seen }
    }

    fn look(&mut self, now: Instant, mean: &Stamped<ImuData>, looked: &Looked<'_>) {
        let Looked { attitude, state, wanted, duty, power, heard } = *looked;
        let turning = duty.iter().any(|duty| *duty > 0.0);
        let found = self.failsafe.step(
            now,
            &FailsafeInput {
                imu: core::slice::from_ref(mean),
                estimate: &family::estimate(attitude),
                status: &EstimatorStatus::default(),
                findings: &SensorFindings::default(),
                power,
                command: heard,
                // It has none of them.
                tof: Some(now),
                flow: Some(now),
                baro: Some(now),
                output: &ControlOutput::default(),
                unmet: [0.0; 4],
                thrust: None,
                self_test: SelfTestVerdict::NotRun,
                flight_status: &family::status(state, attitude, turning, Alerts::NONE),
            },
        );
        if let Some(attitude) = attitude {
            let lost = if state.armed && turning {
                self.following.step(now, &self.following_config, &wanted, &attitude.rate)
            } else {
                self.following.rest();
                false
            };
            let thrust =
                duty.iter().map(|duty| duty * duty).sum::<f32>() / (self.hover * self.hover * duty.len().max(1) as f32);
            let lies = self.resting.step(now, &self.resting_config, &attitude.accel, &attitude.rate, thrust);
            if lost || lies {
                self.tumbled = Some(now);
            }
        }
        self.tumbled = self.tumbled.filter(|at| state.armed || now.since(*at) < SHOWN);
        self.active =
            found.active.set(Alerts::TUMBLED, self.tumbled.is_some() || found.active.contains(Alerts::TUMBLED));
        self.seen |= self.active;
    }
}

/// The detectors' numbers.
#[must_use]
pub fn config(airframe: &Airframe, parameters: &Parameters) -> FailsafeConfig {
    let Parameters { stick, battery, .. } = parameters;
    // In ANGLE the loops want a rate for each radian of lean; on its back, with a full stick, the
    // most.
    let fastest = stick.rotation_max / stick.angle_max * (core::f32::consts::PI + stick.angle_max);
    FailsafeConfig {
        // Without a height no touch of the ground is expected anywhere, and every one may be a
        // touch-down.
        impact: airframe.hardest_touch,
        landing_impact: airframe.hardest_touch,
        // Far above what rotors shake; a blow that rises slowly would raise its own limit.
        impact_sigmas: 0.0,
        // The chip has no peaks.
        sharp: f32::INFINITY,
        // Half as much again when it swings through, and never what the gyro cannot show.
        rate: (1.5 * fastest).clamp(FailsafeConfig::default().rate, 0.95 * GYRO_FULL_SCALE),
        tumble_tilt: stick.angle_max + SWINGS,
        tumble_time: Duration::from_millis(500),
        // In ACRO it may lean as it likes, and so may one whose throttle is down.
        acro_tilt: NEVER,
        armed_tilt: NEVER,
        tip_tilt: NEVER,
        angular_acceleration: airframe.angular_acceleration,
        accel_full_scale: ACCEL_FULL_SCALE,
        gyro_full_scale: GYRO_FULL_SCALE,
        link_silence: OFFLINE,
        battery_low: battery.warning * battery.cells,
        battery_critical: battery.critical * battery.cells,
        // A board that is fed by its serial line has no battery.
        usb: 2.5 * battery.cells,
        voltage_range: [2.0 * battery.cells, 4.5 * battery.cells],
        voltage_step: 0.35 * battery.cells,
        ..FailsafeConfig::default()
    }
}
