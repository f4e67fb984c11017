//! The input of the hypotheses in one step, computed once for all of them.

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

/// Index of flow in the counters of the estimator's status.
pub(crate) const FLOW: usize = 1;
/// Mean square sample-to-sample change of the accelerometer, (m/s²)², above which dead reckoning is
/// not used: 10 m/s² from one sample to the next.
const SHAKEN: f32 = 100.0;
/// Standard deviation of the climb rate by barometer and accelerometer, m/s.
const CLIMB_SIGMA: f32 = 0.7;
/// Largest tilt error that the estimator may discover, rad: in flight 20°, as after a flip; on the
/// ground, where gravity shows the tilt, `WRONG_TILTS` standard deviations.
const WRONG_TILT: f32 = 0.35;
const WRONG_TILTS: f32 = 3.0;
/// Shortest distance to the floor at which a velocity is converted to an image rate, m.
const LEAST_DISTANCE: f32 = 0.02;

/// Share of the full scale above which a force may have been clipped.
const CLIPS: f32 = 0.9;
/// Number of reading intervals after which readings count as missing.
const MISSING: f32 = 3.0;

/// A camera reading that the estimator has compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowReading {
    /// Counts of the sensor, rad.
    pub counts: [f32; 2],
    /// Interval of the reading, s.
    pub interval: f32,
    /// Distance to the floor along the camera's axis, m.
    pub distance: f32,
    /// Image rate due to the body's rotation, rad/s.
    pub turning: [f32; 2],
    /// Image rate that neither rotation nor estimated velocity explains, rad/s.
    pub rate: [f32; 2],
    /// Camera velocity minus that of each reckoner, world, north and east, m/s.
    pub apart: [[f32; 2]; 2],
    /// The same, smoothed.
    pub smooth: [[f32; 2]; 2],
    /// Ages of the reckoners used, s; one may have restarted since.
    pub ages: [f32; 2],
    /// Variance of single readings as far as it is still contained in the smoothed difference,
    /// (m/s)².
    pub uncertain: f32,
    /// Squared smoothed difference divided by its squared limit; the larger value of the two
    /// reckoners.
    pub ratio: f32,
    /// Whether the comparison with reckoners is valid. Not while the accelerometer vibrates too
    /// much, the distance is not measured, or preceding readings are missing, as in a turn that the
    /// camera cannot track.
    pub comparable: bool,
}

/// The input of the hypotheses in one step.
pub struct Evidence<'a> {
    /// Time of the step.
    pub now: Instant,
    /// Inertial samples since the last step, oldest first.
    pub samples: &'a [Stamped<ImuData>],
    /// The estimate after these samples.
    pub estimate: &'a StateEstimate,
    /// The estimator's residuals and counters.
    pub status: &'a EstimatorStatus,
    /// The vehicle stands on the ground, as reported by the mode machine.
    pub stands: bool,
    /// The propellers carry the vehicle.
    pub flies: bool,
    /// Dead reckoning, independent of the camera since its start.
    pub reckoners: &'a Reckoners,
    /// Difference between camera and each reckoner over time.
    pub(crate) courses: &'a [Course; 2],
    /// Mean square sample-to-sample change of the accelerometer, (m/s²)², and of the gyro,
    /// (rad/s)².
    pub shaken: [f32; 2],
    /// The camera reading of this step.
    pub flow: Option<FlowReading>,
    /// Height and climb rate without the range.
    pub altimeter: &'a Altimeter,
    /// The range of this step, if the estimator has compared it.
    pub range: Option<RangeReading>,
    /// Repetitions of the range of this step, compared or not.
    pub range_repeat: Option<RangeRepeat>,
    /// The range has no finding.
    pub trusts_range: bool,
    /// The vehicle has a range finder and a barometer, and its accelerometer works.
    pub has_range: bool,
    /// The altitude of this step.
    pub altitude: Option<AltitudeReading>,
    /// The block of inertial samples completed in this step, along the vertical; in flight only.
    pub block: Option<Block>,
    /// Recent upward displacement of the estimate by resets to the range, m.
    pub moved: f32,
    /// Number of recent resets of height or surface.
    pub moves: u32,
    /// Height of the range finder while the vehicle stands, m.
    pub ground_clearance: f32,
    /// The camera has no finding.
    pub trusts_flow: bool,
    /// The estimator has not bridged an inertial sample recently.
    pub trusts_samples: bool,
    /// A shift of the gyro's zero was found in flight within the last seconds.
    pub shifted_lately: bool,
    /// The estimate is not converging after a start in the air or a correction.
    pub settled: bool,
}

impl Evidence<'_> {
    /// Difference between camera and a reckoner over time.
    pub(crate) fn course(&self, index: usize) -> &Course {
        let [first, second] = self.courses;
        if index == 0 { first } else { second }
    }

    /// Limits for the fits to the course of a reckoner, at this distance from the floor, m.
    pub(crate) fn limits(&self, config: &MonitorConfig, index: usize, distance: f32) -> FitLimits {
        let picture = config.flow_rate_sigma_rad_s * distance;
        let Reckoner { sigmas: Sigmas { acceleration: accel_sigma, .. }, stood, walk, .. } = *self.reckoners.get(index);
        FitLimits {
            largest: config.gyro_shift_rad_s,
            accel_sigma,
            // In flight the estimator may discover any tilt error that it can fly with.
            tilt: if stood { WRONG_TILTS * accel_sigma } else { GRAVITY * WRONG_TILT },
            // A ninth of the initial variance: that error was common to the whole course. A fitted
            // line leaves a fifteenth of the final variance of a random walk.
            noise: config.velocity_sigma_m_s * config.velocity_sigma_m_s * (1.0 / 9.0)
                + picture * picture
                + walk * (1.0 / 15.0),
            heading: frame::yaw(&self.estimate.attitude),
        }
    }

    /// Correction that sets the climb rate, m/s, and moves the estimate upwards by `higher`, m.
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

    /// Correction back to the height and climb rate of the altimeter; `None` if ranges have not
    /// moved the estimate.
    pub(crate) fn back_to_altimeter(&self) -> Option<EstimateCorrection> {
        let altimeter = self.altimeter;
        if self.moved == 0.0 {
            return None;
        }
        // Shortly after the take-off the altimeter knows the height above the ground.
        let higher = if altimeter.knows_take_off() {
            altimeter.height + self.ground_clearance - self.estimate.height
        } else {
            -self.moved
        };
        Some(self.climbs(higher, altimeter.climb))
    }

    /// Correction back to the older reckoner.
    pub(crate) fn back_to_reckoned(&self) -> EstimateCorrection {
        self.back_to(self.reckoners.older())
    }

    /// Correction back to the last reckoner started before a camera fault `ago` seconds ago. `None`
    /// while the reckoners are not comparable.
    pub(crate) fn back_to_before(&self, ago: f32) -> Option<EstimateCorrection> {
        let comparable = self.settled && self.flow.is_some_and(|flow| flow.comparable);
        comparable.then(|| self.back_to(self.last_before(ago)))
    }

    /// Index of the last reckoner started before `ago` seconds ago.
    pub(crate) fn last_before(&self, ago: f32) -> usize {
        let older = self.reckoners.older();
        if self.reckoners.get(1 - older).age > ago { 1 - older } else { older }
    }

    /// Correction that sets attitude, velocity and biases to those of a reckoner.
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

/// The state from which the evidence is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Recollection {
    pub(crate) reckoners: Reckoners,
    pub(crate) courses: [Course; 2],
    shaken: [Vibration; 2],
    /// The estimator's counter of compared camera readings.
    tested: u32,
    smooth: [[f32; 2]; 2],
    uncertain: f32,
    /// Time at which the estimator last compared a reading.
    compared: Option<Instant>,
}

impl Recollection {
    /// Mean square sample-to-sample changes.
    pub(crate) fn shaken(&self) -> [f32; 2] {
        let [force, rate] = &self.shaken;
        [force.mean_square(), rate.mean_square()]
    }

    /// Processes the inertial samples of a step and the estimate after them.
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

    /// Reckoner `index` has restarted from the estimate: express its smoothed difference by that of
    /// the other one.
    fn began_anew(&mut self, index: usize) {
        let other = 1 - index.min(1);
        let off = self.reckoners.apart(other);
        let smooth = self.smooth.get(other).copied().unwrap_or_default();
        if let (Some(place), Some(course)) = (self.smooth.get_mut(index), self.courses.get_mut(index)) {
            *place = [smooth[0] - off.x, smooth[1] - off.y];
            *course = Course::default();
        }
    }

    /// Restarts both reckoners from an estimate that has just been corrected.
    pub(crate) fn begin(&mut self, estimate: &StateEstimate, sigmas: Sigmas) {
        self.reckoners.begin(estimate, sigmas, false);
        self.forget();
    }

    fn forget(&mut self) {
        (self.courses, self.smooth, self.uncertain) = Default::default();
    }

    /// Processes the newest camera reading, if the estimator has compared one in this step.
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
        // Body rates about y and x move the image along x and y.
        let turning = [raw.y, -raw.x];
        let [x, y] = status.flow_innovation;
        let square = |value: f32| value * value;
        // Contribution of the rotation to the velocity in the image.
        let turns = Vec3::new(turning[0] * distance, turning[1] * distance, 0.0);
        let turns = estimate.attitude.transform_vector(&turns);

        // Error of single readings: a wrong number of frames, and a later frame.
        let rates = [flow.delta_x / interval, flow.delta_y / interval];
        let picture = square(rates[0]) + square(rates[1]) + square(turning[0]) + square(turning[1]);
        let change = self.reckoners.turning_change();
        let frames = square(config.flow_frame_share * distance) * picture;
        let late = square(config.flow_late_s * distance) * (square(change.x) + square(change.y));
        // The contribution decays with the smoothing; its square decays twice as fast.
        let fades = config.flow_smooth_s / (config.flow_smooth_s + 2.0 * interval);
        self.uncertain = math::larger(frames + late, self.uncertain * fades);

        let share = interval / (config.flow_smooth_s + interval);
        let (mut apart, mut ratio) = ([[0.0; 2]; 2], 0.0);
        let ages = [0, 1].map(|index| self.reckoners.get(index).age);
        for (index, ((apart, smooth), course)) in
            apart.iter_mut().zip(&mut self.smooth).zip(&mut self.courses).enumerate()
        {
            let (off, reckoner) = (self.reckoners.apart(index), self.reckoners.get(index));
            // Compensate the rotation with the reckoner's gyro bias: the estimate's may already be
            // corrupted by the camera.
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
