//! Impact and excess rate, and which samples to believe about them.
//!
//! A blow shows in two samples running, and two samples of garbage (a shifted frame, a register of `0x8000`) look like
//! a blow. What tells them apart is that a burst ends where it began. A sample is *suspect* when [`ImuData::is_garbled`] says so.
//! Up to `garbled_samples` suspect samples running are set aside, three times as many of a noisy sensor. One more, and it was
//! no burst: all of them count. A blow so hard that it looks like garbage is therefore seen two samples later than any other.
//!
//! | evidence | motors off after |
//! |---|---|
//! | rate, or force over some 10 ms, above its limit in two believed samples running | the second sample |
//! | a hard blow: force over some 10 ms above its limit, and in this sample and the one before from one side | the second sample, suspect or not |
//! | the same in two of four suspect samples running | the fourth sample |
//! | up to three suspect samples, then the motion of before | never |

use super::config::FailsafeConfig;
use super::input::FailsafeInput;
use stampfly_types::messages::{Alerts, FlightPhase, ImuData, Validity};
use stampfly_types::{Instant, Vec3, math};

/// A burst of a noisy sensor is this many times as long: of one sample in five, four come together every two seconds.
const NOISY_BURST: u32 = 3;
/// Forces of two samples come from one side when the cosine between them is as large: 25°. Of two random ones 5 % are.
const ONE_SIDE: f32 = 0.9;
/// A blow may turn the vehicle so many times as fast as what makes a sample suspect. A wall at 1.5 m/s does 1.8 times.
const SPIN: f32 = 2.0;
/// The period that this is for, s.
const PERIOD: f32 = 0.0025;

/// What kind of contact would be no accident.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Contact {
    /// None.
    None,
    /// With the ground, which may be anywhere.
    Landing,
    /// With the ground, from above: it is near, and the vehicle does not fall.
    TouchDown,
}

impl Contact {
    pub(super) fn expected(config: &FailsafeConfig, input: &FailsafeInput<'_>) -> Self {
        let estimate = input.estimate;
        let known = estimate.valid.contains(Validity::HEIGHT.with(Validity::VELOCITY_Z));
        if known && estimate.height < config.touch_height && estimate.velocity.z < config.touch_speed {
            Self::TouchDown
        } else if input.flight_status.phase == FlightPhase::Landing {
            Self::Landing
        } else {
            Self::None
        }
    }
}

/// Samples above the limits, and the specific force over the length of a blow.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Evidence {
    blow: Option<Vec3>,
    /// Force of the sample before, where it is above the limit by itself.
    struck: Option<Vec3>,
    /// This sample is the second of a hard blow.
    blow_lasts: bool,
    impacts: u32,
    overspeeds: u32,
}

impl Evidence {
    /// Adds a sample; gives the force over the length of a blow. `runs`: evidence has to be in samples running; `smooth`: the
    /// rate goes on from the sample before.
    fn add(
        &mut self,
        config: &FailsafeConfig,
        imu: &ImuData,
        contact: Contact,
        limit: f32,
        rate: f32,
        [runs, smooth]: [bool; 2],
    ) -> f32 {
        let blow = self.blow.get_or_insert(imu.accel);
        *blow += (imu.accel - *blow) * config.blow_weight;
        let from_below = contact == Contact::TouchDown;
        let felt = |force: &Vec3| Vec3::new(force.x, force.y, if from_below { force.z.max(0.0) } else { force.z });
        let force = felt(blow).norm();
        let count = |count: &mut u32, above: bool| {
            *count = if above {
                count.saturating_add(1)
            } else if runs {
                0
            } else {
                *count
            };
        };
        count(&mut self.impacts, force >= limit);
        let strike = felt(&imu.accel);
        let struck = (smooth && strike.norm_squared() >= limit * limit).then_some(strike);
        // What repeats itself to the bit is no measurement.
        let from_one_side = |before: Vec3, now: Vec3| {
            before != now && before.dot(&now) >= ONE_SIDE * math::sqrt(before.norm_squared() * now.norm_squared())
        };
        let before = core::mem::replace(&mut self.struck, struck);
        self.blow_lasts = force >= limit && before.zip(struck).is_some_and(|(before, now)| from_one_side(before, now));
        if self.blow_lasts {
            self.impacts = self.impacts.max(config.motion_samples);
        }
        count(&mut self.overspeeds, imu.gyro.norm_squared() >= rate * rate);
        force
    }

    fn alerts(&self, config: &FailsafeConfig) -> Alerts {
        Alerts::NONE
            .set(Alerts::IMPACT, self.impacts >= config.motion_samples)
            .set(Alerts::GYRO_ANOMALY, self.overspeeds >= config.motion_samples)
    }
}

/// What is remembered of the motion.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct MotionMonitor {
    believed: Evidence,
    /// With the suspect samples that are running.
    suspected: Evidence,
    suspects: u32,
    /// The last rate that was believed.
    rate: Option<(Instant, Vec3)>,
    /// The rate of the sample before, whatever it was.
    turned: Vec3,
    /// Running mean and variance of the specific force's norm.
    force: [f32; 2],
}

impl MotionMonitor {
    /// Takes a finite sample: what it shows, and whether it is suspect. `noisy`: suspect samples are frequent; `rate`: no vehicle
    /// that is under control turns faster, rad/s.
    pub(super) fn step(
        &mut self,
        config: &FailsafeConfig,
        at: Instant,
        imu: &ImuData,
        contact: Contact,
        noisy: bool,
        rate: f32,
    ) -> (Alerts, bool) {
        let impact = if contact == Contact::Landing { config.landing_impact } else { config.impact };
        let limit = self.impact_limit(config, impact);
        let before = self.rate.map(|(last, rate)| (at.since(last), rate));
        let suspect = imu.is_garbled(before, config.angular_acceleration, config.accel_full_scale);
        // Samples come at 400 Hz or faster; where they come more slowly, a hard blow is seen as any other.
        let most = SPIN * config.angular_acceleration * PERIOD;
        let smooth = (imu.gyro - self.turned).iter().all(|change| change.abs() <= most);
        self.turned = imu.gyro;
        if suspect {
            if self.suspects == 0 {
                self.suspected = self.believed;
            }
            self.suspects = self.suspects.saturating_add(1);
            self.suspected.add(config, imu, contact, limit, rate, [false, smooth]);
            // What is allowed to the next sample must not grow with a burst.
            self.rate = self.rate.map(|(_, rate)| (at, rate));
            let burst = if noisy { NOISY_BURST * config.garbled_samples } else { config.garbled_samples };
            if self.suspects <= burst && !self.suspected.blow_lasts {
                return (Alerts::NONE, true);
            }
            self.believed = self.suspected;
        } else {
            let force = self.believed.add(config, imu, contact, limit, rate, [true, smooth]);
            // An impact must not raise its own threshold: outliers enter clipped.
            let [mean, variance] = self.force;
            let off = if force < limit { force } else { limit } - mean;
            let weight = config.vibration_weight;
            self.force = [mean + weight * off, variance + weight * (off * off - variance)];
        }
        self.suspects = 0;
        self.rate = Some((at, imu.gyro));
        (self.believed.alerts(config), suspect)
    }

    /// Force of an impact: `impact`, or more where it vibrates so much.
    fn impact_limit(&self, config: &FailsafeConfig, impact: f32) -> f32 {
        let [mean, variance] = self.force;
        let spare = impact - mean;
        // Squares tell that the vibration does not matter, as it hardly ever does; the root is 50 instructions.
        if spare > 0.0 && config.impact_sigmas * config.impact_sigmas * variance <= spare * spare {
            return impact;
        }
        impact.max(mean + config.impact_sigmas * math::sqrt(variance))
    }
}
