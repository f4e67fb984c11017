//! What hypotheses see in one step. Everything is computed once, here, for all of them.

use crate::altimeter::{Altimeter, AltitudeReading};
use crate::config::MonitorConfig;
use crate::course::{Course, FitLimits};
use crate::reckoner::{Reckoner, Reckoners, Restart, Sigmas};
use crate::vertical::{Block, RangeReading, RangeRepeat};
use crate::vibration::Vibration;
use stampfly_types::messages::{
    EstimateCorrection, EstimatorStatus, FlowData, ImuData, SensorMask, StateEstimate, Validity,
};
use stampfly_types::{GRAVITY, Instant, Stamped, Vec3, frame, math};

/// Position of each sensor in the counters of an estimator's status.
pub(crate) const FLOW: usize = 1;
/// A mean square change of the accelerometer from sample to sample beyond this, (m/s²)², says that
/// nothing can be reckoned with it: ten metres per second squared from one to the next.
const SHAKEN: f32 = 100.0;
/// Standard deviation of a climb rate by barometer and accelerometer, m/s.
const CLIMB_SIGMA: f32 = 0.7;
/// Tilt that an estimator in the air may find to be wrong, rad: 20°, after a flip. On the ground
/// gravity shows it, to so many deviations.
const WRONG_TILT: f32 = 0.35;
const WRONG_TILTS: f32 = 3.0;
/// Shortest distance to the floor, m, over which a velocity is a rate of the picture.
const LEAST_DISTANCE: f32 = 0.02;

/// Share of the full scale from which on a force may have been larger.
const CLIPS: f32 = 0.9;
/// Number of intervals without a reading after which readings are missing.
const MISSING: f32 = 3.0;

/// A reading of the camera, as the estimator has compared it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowReading {
    /// Counts as they came, rad.
    pub counts: [f32; 2],
    /// Over so long, s.
    pub interval: f32,
    /// To the floor, along the camera's axis, m.
    pub distance: f32,
    /// The rate of the picture that the body's turning makes, rad/s.
    pub turning: [f32; 2],
    /// The rate of the picture that neither the turning nor the estimated velocity makes, rad/s.
    pub rate: [f32; 2],
    /// The camera's velocity less each reckoner's, world, north and east, m/s: of this reading, and
    /// smoothed.
    pub apart: [[f32; 2]; 2],
    /// See [`apart`](Self::apart).
    pub smooth: [[f32; 2]; 2],
    /// Ages of the reckoners that it was compared with, s: one may have begun anew since.
    pub ages: [f32; 2],
    /// Square of what readings may be wrong by, as far as it is still in the smoothed difference,
    /// (m/s)².
    pub uncertain: f32,
    /// Square of the smoothed difference over that of its limit, the larger of both reckoners'.
    pub ratio: f32,
    /// May reckoners be compared with at all? Not where the accelerometer is shaken too hard, the
    /// distance is not measured, or readings before this one are missing, as in a turn that the camera
    /// does not follow.
    pub comparable: bool,
}

/// What hypotheses see in one step.
pub struct Evidence<'a> {
    /// The instant of the step.
    pub now: Instant,
    /// The inertial samples since the step before, oldest first.
    pub samples: &'a [Stamped<ImuData>],
    /// The estimate that followed from them.
    pub estimate: &'a StateEstimate,
    /// How the estimator compared its sensors.
    pub status: &'a EstimatorStatus,
    /// The vehicle stands on the ground, as its mode machine knows.
    pub stands: bool,
    /// Its propellers carry it.
    pub flies: bool,
    /// Reckoned from estimates that no camera has touched since.
    pub reckoners: &'a Reckoners,
    /// How the camera's velocity has grown away from them.
    pub(crate) courses: &'a [Course; 2],
    /// Mean square change from sample to sample of the accelerometer, (m/s²)², and the gyro, (rad/s)².
    pub shaken: [f32; 2],
    /// A reading of the camera that came in this step.
    pub flow: Option<FlowReading>,
    /// Height and climb rate without the range.
    pub altimeter: &'a Altimeter,
    /// A range that the estimator has compared in this step.
    pub range: Option<RangeReading>,
    /// How often the one that came in this step, compared or not, has repeated itself.
    pub range_repeat: Option<RangeRepeat>,
    /// The range is not left out.
    pub trusts_range: bool,
    /// The vehicle has a range finder and a barometer, and feels its acceleration.
    pub has_range: bool,
    /// An altitude that came in this step.
    pub altitude: Option<AltitudeReading>,
    /// A block of inertial samples that this step has completed, along the vertical, in the air.
    pub block: Option<Block>,
    /// How far the estimate was moved upwards lately, m, and how often its height was.
    pub moved: f32,
    /// See [`moved`](Self::moved).
    pub moves: u32,
    /// Height of the range finder on a vehicle that stands, m.
    pub ground_clearance: f32,
    /// The camera is not left out.
    pub trusts_flow: bool,
    /// The inertial samples are believed: the estimator has bridged none of them lately.
    pub trusts_samples: bool,
    /// The gyro's zero was found to have shifted in the air some seconds ago.
    pub shifted_lately: bool,
    /// Neither the start in the air nor a correction is so recent that the estimate is still finding
    /// itself.
    pub settled: bool,
}

impl Evidence<'_> {
    /// How the camera's velocity has grown away from a reckoner.
    pub(crate) fn course(&self, index: usize) -> &Course {
        let [first, second] = self.courses;
        if index == 0 { first } else { second }
    }

    /// What the course against a reckoner is judged by, at this distance from the floor, m.
    pub(crate) fn limits(&self, config: &MonitorConfig, index: usize, distance: f32) -> FitLimits {
        let picture = config.flow_rate_sigma_rad_s * distance;
        let Reckoner { sigmas: Sigmas { acceleration: accel_sigma, .. }, stood, walk, .. } = *self.reckoners.get(index);
        FitLimits {
            largest: config.gyro_shift_rad_s,
            accel_sigma,
            // In the air the estimator may find its tilt to be wrong by any angle that it flies with.
            tilt: if stood { WRONG_TILTS * accel_sigma } else { GRAVITY * WRONG_TILT },
            // A third of the deviation with which it began: that was one for all of the course.
            // A line leaves a fifteenth of the variance that a random walk ends with.
            noise: config.velocity_sigma_m_s * config.velocity_sigma_m_s * (1.0 / 9.0)
                + picture * picture
                + walk * (1.0 / 15.0),
            heading: frame::yaw(&self.estimate.attitude),
        }
    }

    /// What gives the estimate another climb rate, m/s, and moves it upwards, m.
    pub(crate) fn climbs(&self, higher: f32, climb: f32) -> EstimateCorrection {
        let estimate = self.estimate;
        EstimateCorrection {
            velocity: Vec3::new(0.0, 0.0, -climb - estimate.velocity.z),
            down: -higher,
            accel_bias: Vec3::new(0.0, 0.0, -self.altimeter.bias - estimate.accel_bias.z),
            climb_sigma: CLIMB_SIGMA,
            ..EstimateCorrection::default()
        }
    }

    /// What takes height and climb rate back to the altimeter's, if ranges have misled the estimate.
    pub(crate) fn back_to_altimeter(&self) -> Option<EstimateCorrection> {
        let altimeter = self.altimeter;
        if self.moved == 0.0 {
            return None;
        }
        // Right after the take-off the altimeter knows how far it came.
        let higher = if altimeter.knows_take_off() {
            altimeter.height + self.ground_clearance - self.estimate.height
        } else {
            -self.moved
        };
        Some(self.climbs(higher, altimeter.climb))
    }

    /// What takes the estimate back to the older reckoner.
    pub(crate) fn back_to_reckoned(&self) -> EstimateCorrection {
        self.back_to(self.reckoners.older())
    }

    /// The correction back to the reckoner that began last before a camera failed `ago` seconds ago.
    /// `None` where nothing can be compared with reckoners.
    pub(crate) fn back_to_before(&self, ago: f32) -> Option<EstimateCorrection> {
        let comparable = self.settled && self.flow.is_some_and(|flow| flow.comparable);
        comparable.then(|| self.back_to(self.last_before(ago)))
    }

    /// Index of the reckoner that began last before `ago` seconds ago.
    pub(crate) fn last_before(&self, ago: f32) -> usize {
        let older = self.reckoners.older();
        if self.reckoners.get(1 - older).age > ago { 1 - older } else { older }
    }

    /// What takes the estimate back to a reckoner.
    pub(crate) fn back_to(&self, index: usize) -> EstimateCorrection {
        let (reckoner, estimate) = (self.reckoners.get(index), self.estimate);
        EstimateCorrection {
            turn: (reckoner.attitude * estimate.attitude.inverse()).scaled_axis(),
            velocity: (reckoner.velocity - estimate.velocity).horizontal(),
            gyro_bias: reckoner.gyro_bias - estimate.gyro_bias,
            accel_bias: (reckoner.accel_bias - estimate.accel_bias).horizontal(),
            tilt_sigma: reckoner.sigmas.acceleration / GRAVITY,
            velocity_sigma: reckoner.sigmas.acceleration * reckoner.age,
            gyro_bias_sigma: 0.0,
            ..EstimateCorrection::default()
        }
    }
}

/// What is remembered to compute it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Recollection {
    pub(crate) reckoners: Reckoners,
    pub(crate) courses: [Course; 2],
    shaken: [Vibration; 2],
    /// Readings of the camera that the estimator has compared.
    tested: u32,
    smooth: [[f32; 2]; 2],
    uncertain: f32,
    /// When the estimator compared a reading last.
    compared: Option<Instant>,
}

impl Recollection {
    /// Mean square change from sample to sample.
    pub(crate) fn shaken(&self) -> [f32; 2] {
        let [force, rate] = &self.shaken;
        [force.mean_square(), rate.mean_square()]
    }

    /// Takes the inertial samples of a step, and the estimate that followed.
    pub(crate) fn inertial(
        &mut self,
        config: &MonitorConfig,
        samples: &[Stamped<ImuData>],
        estimate: &StateEstimate,
        status: &EstimatorStatus,
        stands: bool,
    ) {
        for sample in samples {
            let [force, rate] = &mut self.shaken;
            force.add(sample.at, &sample.data.accel);
            rate.add(sample.at, &sample.data.gyro);
        }
        let [shaken, _] = self.shaken();
        let sigmas = || {
            let square = |value: f32| value * value;
            let zero = square(config.accel_sigma_m_s2) + square(config.vibration_share) * shaken;
            Sigmas {
                velocity: status.velocity_sigma,
                acceleration: math::sqrt(zero + square(status.acceleration_sigma)),
                gyro_bias: status.gyro_bias_sigma,
                yaw_bias: status.yaw_bias_sigma,
            }
        };
        match self.reckoners.step(samples, CLIPS * config.accel_full_scale_m_s2, estimate, sigmas, stands) {
            Restart::Neither => {}
            Restart::One(index) => self.began_anew(index),
            Restart::Both => self.forget(),
        }
    }

    /// The reckoner with this index has begun anew: what was smoothed against it is against the
    /// estimate now.
    fn began_anew(&mut self, index: usize) {
        let other = 1 - index.min(1);
        let off = self.reckoners.apart(other);
        let smooth = self.smooth.get(other).copied().unwrap_or_default();
        if let (Some(place), Some(course)) = (self.smooth.get_mut(index), self.courses.get_mut(index)) {
            *place = [smooth[0] - off.x, smooth[1] - off.y];
            *course = Course::default();
        }
    }

    /// Both begin anew with this estimate, which has just been put right.
    pub(crate) fn begin(&mut self, estimate: &StateEstimate, sigmas: Sigmas) {
        self.reckoners.begin(estimate, sigmas, false);
        self.forget();
    }

    fn forget(&mut self) {
        (self.courses, self.smooth, self.uncertain) = Default::default();
    }

    /// Takes the newest reading of the camera, if the estimator has compared one in this step.
    pub(crate) fn flow(
        &mut self,
        now: Instant,
        config: &MonitorConfig,
        flow: Option<&FlowData>,
        estimate: &StateEstimate,
        status: &EstimatorStatus,
    ) -> Option<FlowReading> {
        let tested = core::mem::replace(&mut self.tested, status.tested[FLOW]);
        let flow = flow.filter(|flow| flow.interval > 0.0)?;
        if tested == status.tested[FLOW] || !estimate.valid.contains(Validity::HEIGHT) {
            return None;
        }
        let distance = estimate.height / frame::cos_tilt(&estimate.attitude);
        if distance.is_nan() || distance < LEAST_DISTANCE {
            return None;
        }
        let interval = flow.interval;
        let gap = self.compared.replace(now).is_none_or(|last| now.since(last).seconds() > MISSING * interval);
        let raw = self.reckoners.turning();
        let turning = [raw.y, -raw.x];
        let [x, y] = status.flow_innovation;
        let square = |value: f32| value * value;
        // What turning adds to the velocity that the picture shows.
        let turns = Vec3::new(turning[0] * distance, turning[1] * distance, 0.0);
        let turns = estimate.attitude.transform_vector(&turns);

        // Single readings: frames that they hold too many or too few of, and pictures that are older.
        let rates = [flow.delta_x / interval, flow.delta_y / interval];
        let picture = square(rates[0]) + square(rates[1]) + square(turning[0]) + square(turning[1]);
        let change = self.reckoners.turning_change();
        let frames = square(config.flow_frame_share * distance) * picture;
        let late = square(config.flow_late_s * distance) * (square(change.x) + square(change.y));
        // It leaves the difference as it came in: of squares, twice as fast.
        let fades = config.flow_smooth_s / (config.flow_smooth_s + 2.0 * interval);
        self.uncertain = math::larger(frames + late, self.uncertain * fades);

        let share = interval / (config.flow_smooth_s + interval);
        let (mut apart, mut ratio) = ([[0.0; 2]; 2], 0.0);
        let ages = [0, 1].map(|index| self.reckoners.get(index).age);
        for (index, ((apart, smooth), course)) in
            apart.iter_mut().zip(&mut self.smooth).zip(&mut self.courses).enumerate()
        {
            let (off, reckoner) = (self.reckoners.apart(index), self.reckoners.get(index));
            // The camera is freed of the turn by the reckoner's bias, not by what it made of the estimate's.
            let bias = (estimate.gyro_bias - reckoner.gyro_bias) * distance;
            let body = Vec3::new(x - bias.y, y + bias.x, 0.0);
            let world = estimate.attitude.transform_vector(&body);
            *apart = [world.x + off.x, world.y + off.y];
            for (smooth, apart) in smooth.iter_mut().zip(*apart) {
                *smooth += (apart - *smooth) * share;
            }
            let reckoned = [reckoner.velocity.x, reckoner.velocity.y];
            let shown = [reckoned[0] + turns.x, reckoned[1] + turns.y];
            course.add(reckoner.age, *apart, shown, distance);
            let noise = square(config.flow_rate_sigma_rad_s * distance);
            let limit = square(config.gate_sigmas) * (reckoner.variance(config, reckoned) + noise) + self.uncertain;
            ratio = math::larger(ratio, (square(smooth[0]) + square(smooth[1])) / limit);
        }
        Some(FlowReading {
            counts: [flow.delta_x, flow.delta_y],
            interval,
            distance,
            turning,
            rate: [x / distance, y / distance],
            apart,
            ages,
            smooth: self.smooth,
            uncertain: self.uncertain,
            ratio,
            comparable: !gap && self.shaken()[0] < SHAKEN && estimate.sensors.contains(SensorMask::TOF),
        })
    }
}
