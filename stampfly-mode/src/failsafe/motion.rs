//! Impact and excess rate, and which samples to believe about them.
//!
//! A blow shows in two samples running, and two samples of garbage (a shifted frame, a register of
//! `0x8000`) look like a blow. What tells them apart is that a burst ends where it began. A sample
//! is *suspect* when [`ImuData::is_garbled`] says so. Suspect samples are set aside. A blow turns
//! the vehicle to another rate, and there the samples *follow* from each other as a body moves:
//! when `garbled_samples` of them do and one more, all of them count. Garbage does not follow from
//! garbage; for how long a vehicle may fly on with it, [`imu`](super::imu) says. A blow that looks
//! like garbage is therefore seen two samples later than any other, unless it is *hard*: the forces
//! of two samples come from one side, and do not repeat each other.
//!
//! | evidence | motors off after |
//! |---|---|
//! | rate, or force over some 10 ms, above its limit in two believed samples running | the second sample |
//! | the same in two of four suspect samples running that follow from each other | the fourth sample |
//! | force over some 10 ms above its limit in this sample, at the end of a hard blow, suspect or not | the second sample |
//! | a *sharp* blow, outside a touch-down: the [peak](ImuData::accel_peak) of the chip's own samples is no vibration | the first sample |
//! | suspect samples that do not follow from each other, or three that do | never |

use super::config::FailsafeConfig;
use super::input::FailsafeInput;
use stampfly_types::messages::{Alerts, FlightPhase, ImuData, Validity};
use stampfly_types::{Duration, GRAVITY, Instant, Vec3, math};

/// Forces of two samples come from one side when the cosine between them is as large: 25°. Of two random ones 5 % are.
const ONE_SIDE: f32 = 0.9;
/// A hard blow changes the rate by up to so many times what makes a sample suspect. A wall at 1.5 m/s does 1.8 times.
const SPIN: f32 = 2.0;

/// A sharp blow has a peak of [`sharp`](FailsafeConfig::sharp), and lies so many standard
/// deviations above the mean of the peaks before it: more of them along the vertical, in which
/// thrust pushes and propellers shake. In 3,000 flights in gusts at twice the recorded vibration
/// the largest of the peaks that passed the first limit were 6.8 and 8.2 deviations.
const SHARP_SIGMAS: f32 = 7.5;
const UPRIGHT_SIGMAS: f32 = 10.0;
/// Peaks enter these statistics in full up to this, m/s², and above it up to so many deviations: a blow must not raise its own limit.
const CALM: f32 = 2.0 * GRAVITY;
const CLIP_SIGMAS: f32 = 4.0;
/// Weights of a sample in these means, of 50 and of 500 samples: vibration that begins is in the first, what is rare in the second.
const SHARP_WEIGHTS: [f32; 2] = [0.02, 0.002];

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

    /// The part of a specific force that would be a blow: not the ground's push from below in a touch-down, nor as much to the
    /// sides. Legs that stand beside the centre of mass and stick to the floor push to the sides, and no more than upwards.
    fn felt(self, force: &Vec3) -> Vec3 {
        if self != Self::TouchDown {
            return *force;
        }
        // What carries the weight pushes nothing aside.
        let up = math::larger(-force.z - GRAVITY, 0.0);
        if force.x * force.x + force.y * force.y <= up * up {
            Vec3::new(0.0, 0.0, math::larger(force.z, 0.0))
        } else {
            Vec3::new(force.x, force.y, math::larger(force.z, 0.0))
        }
    }
}

/// What is a blow, and what a spin.
#[derive(Clone, Copy)]
struct Limits {
    contact: Contact,
    /// Of the specific force, m/s².
    force: f32,
    /// Of the rate, rad/s.
    rate: f32,
}

/// Samples above the limits, and the specific force over the length of a blow.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Evidence {
    blow: Option<Vec3>,
    impacts: u32,
    overspeeds: u32,
}

impl Evidence {
    /// Adds a sample; gives the force over the length of a blow. `runs`: what counts are samples running; `hard`: the sample is
    /// the second of a hard blow.
    fn add(&mut self, config: &FailsafeConfig, imu: &ImuData, limits: &Limits, runs: bool, hard: bool) -> f32 {
        let blow = self.blow.get_or_insert(imu.accel);
        *blow += (imu.accel - *blow) * config.blow_weight;
        let force = limits.contact.felt(blow).norm();
        let count = |count: &mut u32, above: bool| {
            *count = if above {
                count.saturating_add(1)
            } else if runs {
                0
            } else {
                *count
            };
        };
        count(&mut self.impacts, force >= limits.force);
        if hard && force >= limits.force {
            self.impacts = self.impacts.max(config.motion_samples);
        }
        count(&mut self.overspeeds, imu.gyro.norm_squared() >= limits.rate * limits.rate);
        force
    }

    fn alerts(&self, config: &FailsafeConfig) -> Alerts {
        Alerts::NONE
            .set(Alerts::IMPACT, self.impacts >= config.motion_samples)
            .set(Alerts::GYRO_ANOMALY, self.overspeeds >= config.motion_samples)
    }
}

/// How long ago the sample before was taken, and its rate.
type Before = Option<(Duration, Vec3)>;

/// What is remembered of the motion.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct MotionMonitor {
    believed: Evidence,
    /// With the suspect samples that are running.
    suspected: Evidence,
    suspects: bool,
    /// How many of them follow from each other, the last included.
    following: u32,
    /// The last rate that was believed.
    rate: Option<(Instant, Vec3)>,
    /// The rate of the sample before, believed or not.
    turned: Option<(Instant, Vec3)>,
    /// Its force, where it may be the first of a hard blow.
    struck: Option<Vec3>,
    /// Running mean and variance of the specific force's norm.
    force: [f32; 2],
    /// The same of the chip's peaks, over both lengths.
    peaks: [[f32; 2]; 2],
}

impl MotionMonitor {
    /// Takes a finite sample: what it shows, and whether it is suspect. `rate`: no vehicle that is
    /// under control turns faster, rad/s.
    pub(super) fn step(
        &mut self,
        config: &FailsafeConfig,
        at: Instant,
        imu: &ImuData,
        contact: Contact,
        rate: f32,
    ) -> (Alerts, bool) {
        let impact = if contact == Contact::Landing { config.landing_impact } else { config.impact };
        let limit = self.impact_limit(config, impact);
        let before = self.rate.map(|(last, rate)| (at.since(last), rate));
        let suspect = imu.is_garbled(before, config.angular_acceleration, config.accel_full_scale);
        let limits = Limits { contact, force: limit, rate };
        let turned = self.turned.replace((at, imu.gyro)).map(|(last, rate)| (at.since(last), rate));
        let sharp = self.is_sharp(config, turned, imu, contact);
        let hard = self.ends_hard_blow(config, turned, imu, &limits);
        if suspect {
            if !self.suspects {
                (self.suspects, self.suspected, self.following) = (true, self.believed, 0);
            }
            let follows = !imu.is_garbled(turned, config.angular_acceleration, config.accel_full_scale);
            self.following = if follows { self.following.saturating_add(1) } else { 1 };
            self.suspected.add(config, imu, &limits, false, hard);
            // What is allowed to the next sample must not grow with a burst.
            self.rate = self.rate.map(|(_, rate)| (at, rate));
            let goes_on = self.following > config.garbled_samples;
            let struck = sharp || (hard && self.suspected.alerts(config).contains(Alerts::IMPACT));
            if !(goes_on || struck) {
                return (Alerts::NONE, true);
            }
            self.believed = self.suspected;
        } else {
            let force = self.believed.add(config, imu, &limits, true, hard);
            // An impact must not raise its own threshold: outliers enter clipped.
            let [mean, variance] = self.force;
            let off = if force < limit { force } else { limit } - mean;
            let weight = config.vibration_weight;
            self.force = [mean + weight * off, variance + weight * (off * off - variance)];
        }
        self.suspects = false;
        self.rate = Some((at, imu.gyro));
        let found = self.believed.alerts(config);
        (if sharp { found.with(Alerts::IMPACT) } else { found }, suspect)
    }

    /// The specific force over the length of a blow, body FRD, m/s².
    pub(super) fn force(&self) -> Vec3 {
        self.believed.blow.unwrap_or_default()
    }

    /// Does a sharp blow begin in this sample? Where the ground may push, nothing is one: its push is as sharp. Nor does one come from
    /// above: a vehicle that climbs against a ceiling comes down on its motors.
    fn is_sharp(&mut self, config: &FailsafeConfig, turned: Before, imu: &ImuData, contact: Contact) -> bool {
        let peak = imu.accel_peak;
        let [x, y, z] = [imu.accel.x, imu.accel.y, imu.accel.z];
        let upright = z * z > x * x + y * y;
        let sigmas = if upright { UPRIGHT_SIGMAS } else { SHARP_SIGMAS };
        let mut limit = config.sharp;
        for ([mean, variance], weight) in self.peaks.iter_mut().zip(SHARP_WEIGHTS) {
            let mut off = peak - *mean;
            if peak >= CALM {
                // Roots are rare here: without vibration no peak comes this far.
                let deviation = math::sqrt(*variance);
                limit = limit.max(*mean + sigmas * deviation);
                off = off.min(CLIP_SIGMAS * deviation).max(CALM - *mean);
            }
            *mean += weight * off;
            *variance += weight * (off * off - *variance);
        }
        contact == Contact::None
            && !(upright && z > 0.0)
            && (limit..f32::MAX).contains(&peak)
            && !imu.is_garbled(turned, SPIN * config.angular_acceleration, config.accel_full_scale)
    }

    /// Are this sample and the one before a hard blow?
    fn ends_hard_blow(&mut self, config: &FailsafeConfig, turned: Before, imu: &ImuData, limits: &Limits) -> bool {
        let garbled = || imu.is_garbled(turned, SPIN * config.angular_acceleration, config.accel_full_scale);
        let force = limits.contact.felt(&imu.accel);
        let struck = (force.norm_squared() >= limits.force * limits.force && !garbled()).then_some(force);
        let before = core::mem::replace(&mut self.struck, struck);
        before.zip(struck).is_some_and(|(before, now)| {
            // What repeats itself to the bit is no measurement.
            before != now && before.dot(&now) >= ONE_SIDE * math::sqrt(before.norm_squared() * now.norm_squared())
        })
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
