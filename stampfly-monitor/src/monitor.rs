//! [`Monitor`]: computes the evidence, tests every hypothesis, and derives findings and a
//! correction.

use crate::config::MonitorConfig;
use crate::evidence::{Evidence, Recollection};
use crate::hypotheses::*;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use crate::reckoner::Sigmas;
use crate::vertical::Vertical;
use stampfly_types::messages::{
    BaroData, EstimateCorrection, EstimatorStatus, Finding, FlowData, Health, ImuData, SensorFindings, SensorMask,
    StateEstimate, TofData,
};
use stampfly_types::{GRAVITY, Instant, Stamped, math};

/// Time for which the monitor reports nothing after a start in the air, s, while the estimator
/// converges: a gyro bias of 3°/s takes as long.
const UNKNOWN: f32 = 20.0;
/// Time for which it reports nothing after a correction, s.
const SETTLES: f32 = 0.5;
/// Time after a bridged sample in which a sample-to-sample change may come from the bridge, s.
const BRIDGED: f32 = 0.01;

/// Input of one step, borrowed.
#[derive(Clone, Copy, Debug)]
pub struct MonitorInput<'a> {
    /// Inertial samples since the last step, oldest first.
    pub imu: &'a [Stamped<ImuData>],
    /// Camera readings since the last step.
    pub flow: &'a [Stamped<FlowData>],
    /// Ranges since the last step.
    pub tof: &'a [Stamped<TofData>],
    /// Barometer samples since the last step.
    pub baro: &'a [Stamped<BaroData>],
    /// The estimate after all of them.
    pub estimate: &'a StateEstimate,
    /// The estimator's residuals and counters.
    pub status: &'a EstimatorStatus,
    /// The vehicle stands on the ground, as reported by the mode machine.
    pub stands: bool,
    /// The propellers carry the vehicle.
    pub flies: bool,
    /// The accelerometer works.
    pub felt: bool,
    /// Counter of restarts of the estimate.
    pub restarts: u32,
}

/// Declares the hypotheses, one per line, in the order in which they are tested. A removed line
/// disables its hypothesis.
macro_rules! hypotheses {
    ($($name:ident: $Hypothesis:ident),* $(,)?) => {
        /// All hypotheses.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        struct Hypotheses { $($name: $Hypothesis),* }

        /// Names of the hypotheses; the index is the bit in
        /// [`MonitorConfig::without`](crate::MonitorConfig::without) that disables one.
        pub const HYPOTHESES: &[&str] = &[$(stringify!($name)),*];

        impl Hypotheses {
            /// Tests every enabled hypothesis.
            fn ask(&mut self, answers: &mut Answers<'_>, config: &MonitorConfig, seen: &Evidence<'_>) {
                let mut without = config.without;
                $(
                    if without & 1 == 0 {
                        answers.ask(&mut self.$name, config, seen);
                    }
                    without >>= 1;
                )*
                let _ = without;
            }
        }
    };
}

hypotheses! {
    // Gyro first: after a shift of its zero the camera disagrees although it is correct.
    gyro_standing: GyroStanding,
    gyro_jumped: GyroJumped,
    gyro_shifted: GyroShifted,
    flow_frozen: FlowFrozen,
    flow_still: FlowStill,
    flow_standing: FlowStanding,
    flow_jumped: FlowJumped,
    flow_disagrees: FlowDisagrees,
    range_stuck: RangeStuck,
    range_outliers: RangeOutliers,
    range_jumped: RangeJumped,
    range_wrapped: RangeWrapped,
}

/// Sensor monitor. See the [crate] documentation for its use.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Monitor {
    config: MonitorConfig,
    recollection: Recollection,
    vertical: Vertical,
    hypotheses: Hypotheses,
    findings: SensorFindings,
    /// Time for which flow and range, flagged as faulty, have been consistent again, s.
    fits: [f32; 2],
    /// Remaining time without reports, s.
    waits: f32,
    last: Option<Instant>,
    /// The last accepted inertial sample.
    sample: ImuData,
    refused: u32,
    bridged: f32,
    restarts: u32,
}

impl Monitor {
    /// A monitor of a vehicle in an unknown state.
    #[must_use]
    pub fn new(config: MonitorConfig) -> Self {
        Self { config, waits: UNKNOWN, vertical: Vertical::airborne(), ..Self::default() }
    }

    /// The finding of each sensor.
    #[must_use]
    pub fn findings(&self) -> &SensorFindings {
        &self.findings
    }

    /// Processes one step. Returns a correction if a faulty sensor has moved the estimate.
    pub fn step(&mut self, now: Instant, input: &MonitorInput<'_>) -> Option<EstimateCorrection> {
        self.hold_back(now, input);
        if !input.estimate.sensors.contains(SensorMask::IMU) || !is_finite(input.estimate, input.status) {
            return None;
        }
        let (bridge, trusted) = (self.bridge(input.imu), self.trusted());
        let bridged = bridge.as_slice();
        let refused = !bridged.is_empty();
        let MonitorInput { estimate, status, stands, .. } = *input;
        let samples = if refused { bridged } else { input.imu };

        // The estimator compared the reading with its state before this step's samples, so use the
        // reckoners before them.
        let Self { config, recollection, vertical, .. } = self;
        let mut flow = recollection.flow(now, config, input.flow.last().map(|sample| &sample.data), estimate, status);
        if let Some(flow) = &mut flow {
            // Without an accelerometer there is no dead reckoning.
            flow.comparable &= input.felt;
        }
        recollection.inertial(config, samples, estimate, status, stands);
        if !input.felt {
            recollection.begin(estimate, Sigmas::default());
        }
        let (range_repeat, range) = vertical.range(now, input.tof.last().map(|sample| &sample.data), estimate, status);
        let altitude = vertical.altitude(input.baro.last(), stands);
        let block = vertical.inertial(now, samples, estimate, stands, trusted.range);
        let seen = Evidence {
            now,
            // Hide samples that the estimator has bridged.
            samples: if refused { &[] } else { input.imu },
            estimate,
            status,
            stands,
            flies: input.flies,
            reckoners: &recollection.reckoners,
            courses: &recollection.courses,
            shaken: recollection.shaken(),
            flow,
            altimeter: &vertical.altimeter,
            range,
            range_repeat,
            trusts_range: trusted.range,
            has_range: input.felt && vertical.has_range() && vertical.altimeter.has_zero(),
            altitude,
            block,
            moved: vertical.moved,
            moves: vertical.moves,
            ground_clearance: config.ground_clearance_m,
            trusts_flow: trusted.flow,
            trusts_samples: self.bridged == 0.0,
            shifted_lately: self.hypotheses.gyro_shifted.was_lately(now),
            settled: self.waits == 0.0,
        };
        let mut answers = Answers { findings: &mut self.findings, fits: [None; 2], correction: None, gyro: false, now };
        self.hypotheses.ask(&mut answers, config, &seen);
        let Answers { fits, correction, .. } = answers;
        let elapsed = [flow.map_or(0.0, |flow| flow.interval), range.map_or(0.0, |range| range.dt)];
        // The range was still accepted at the start of this step, so this is a new finding.
        if trusted.range && self.findings.range.finding != Finding::None {
            self.begin_without_range(now);
        }
        self.clear(input, fits, elapsed);
        if let Some(correction) = &correction {
            self.correct(correction, estimate);
        }
        correction
    }

    /// Updates the time without reports, and restarts dead reckoning after a restart of the
    /// estimate.
    fn hold_back(&mut self, now: Instant, input: &MonitorInput<'_>) {
        let dt = self.last.replace(now).map_or(0.0, |last| now.since(last).seconds());
        // On the ground, tilt and biases are known from gravity and the calibration.
        self.waits = if input.stands { 0.0 } else { math::larger(self.waits - dt, 0.0) };
        self.bridged = math::larger(self.bridged - dt, 0.0);
        if core::mem::replace(&mut self.restarts, input.restarts) != input.restarts && !input.stands {
            self.waits = UNKNOWN;
            let sigmas = Sigmas { acceleration: self.config.accel_sigma_m_s2, ..Sigmas::default() };
            self.recollection.begin(input.estimate, sigmas);
            self.vertical.altimeter.restart(-input.estimate.accel_bias.z);
        }
        if input.estimate.sensors.contains(SensorMask::EXTERNAL) {
            // An external measurement moves the estimate in other ways than the on-board sensors.
            self.waits = math::larger(self.waits, SETTLES);
        }
        let refused = core::mem::replace(&mut self.refused, input.status.imu_refused);
        if refused != input.status.imu_refused {
            self.bridged = BRIDGED;
        }
    }

    /// Replacement for samples that the estimator has just bridged: the last accepted one.
    fn bridge(&mut self, samples: &[Stamped<ImuData>]) -> Option<Stamped<ImuData>> {
        let newest = samples.last()?;
        if self.bridged == BRIDGED {
            return Some(Stamped { data: self.sample, ..*newest });
        }
        self.sample = newest.data;
        None
    }

    /// The sensors without a finding.
    fn trusted(&self) -> Trusted {
        let SensorFindings { range, flow, .. } = &self.findings;
        Trusted { range: range.finding == Finding::None, flow: flow.finding == Finding::None }
    }

    /// Called when a finding about the range has just been made.
    fn begin_without_range(&mut self, now: Instant) {
        // After a take-off the effect of the range on the accelerometer bias cannot be separated
        // from that of the propellers on the pressure, so the barometer is not trusted either.
        if self.vertical.altimeter.knows_take_off() {
            self.findings.baro = Health { finding: Finding::Disagrees, since: now };
        }
        self.vertical.forget();
    }

    /// Clears the finding of a sensor that has been consistent for long enough.
    fn clear(&mut self, input: &MonitorInput<'_>, fits: [Option<bool>; 2], elapsed: [f32; 2]) {
        for ((time, fits), elapsed) in self.fits.iter_mut().zip(fits).zip(elapsed) {
            match fits {
                Some(true) => *time += elapsed,
                Some(false) => *time = 0.0,
                None => {}
            }
        }
        let [flow, range] = self.fits;
        if flow >= self.config.flow_agrees_s {
            (self.findings.flow, self.fits[0]) = Default::default();
        }
        // On the ground the range does not affect the estimate.
        if range >= self.config.range_agrees_s || input.stands {
            if self.findings.range.finding != Finding::None && !input.stands {
                self.vertical.altimeter.restart(-input.estimate.accel_bias.z);
                self.vertical.forget();
            }
            (self.findings.range, self.findings.baro, self.fits[1]) = Default::default();
        }
    }

    /// Continues from the corrected estimate.
    fn correct(&mut self, correction: &EstimateCorrection, estimate: &StateEstimate) {
        let corrected = StateEstimate {
            attitude: (stampfly_types::Quat::from_scaled_axis(correction.turn) * estimate.attitude).normalize(),
            velocity: estimate.velocity + correction.velocity,
            gyro_bias: estimate.gyro_bias + correction.gyro_bias,
            accel_bias: estimate.accel_bias + correction.accel_bias,
            ..*estimate
        };
        if correction.climb_sigma > 0.0 {
            self.vertical.see(&corrected, correction.down);
        }
        if correction.tilt_sigma == 0.0 {
            return;
        }
        self.waits = math::larger(self.waits, SETTLES);
        let sigmas = Sigmas {
            velocity: correction.velocity_sigma,
            acceleration: GRAVITY * correction.tilt_sigma + self.config.accel_sigma_m_s2,
            gyro_bias: correction.gyro_bias_sigma,
            ..Sigmas::default()
        };
        self.recollection.begin(&corrected, sigmas);
    }
}

/// Whether all values are finite.
fn is_finite(estimate: &StateEstimate, status: &EstimatorStatus) -> bool {
    let StateEstimate { attitude, position, velocity, gyro_bias, accel_bias, height, .. } = estimate;
    let vectors = position.norm_squared() + velocity.norm_squared() + gyro_bias.norm_squared();
    let [x, y] = status.flow_innovation;
    (vectors + accel_bias.norm_squared() + attitude.norm_squared() + height + x + y).is_finite()
}

/// Combines two corrections of one step. Those of camera and gyro are horizontal, those of the
/// range vertical.
fn both(first: &EstimateCorrection, second: &EstimateCorrection) -> EstimateCorrection {
    EstimateCorrection {
        turn: first.turn + second.turn,
        velocity: first.velocity + second.velocity,
        down: first.down + second.down,
        gyro_bias: first.gyro_bias + second.gyro_bias,
        accel_bias: first.accel_bias + second.accel_bias,
        tilt_sigma: math::larger(first.tilt_sigma, second.tilt_sigma),
        velocity_sigma: math::larger(first.velocity_sigma, second.velocity_sigma),
        gyro_bias_sigma: math::larger(first.gyro_bias_sigma, second.gyro_bias_sigma),
        climb_sigma: math::larger(first.climb_sigma, second.climb_sigma),
    }
}

/// Sensors without a finding.
#[derive(Clone, Copy)]
struct Trusted {
    range: bool,
    flow: bool,
}

/// Collected results of the hypotheses in one step.
struct Answers<'a> {
    findings: &'a mut SensorFindings,
    /// Consistency of camera and range; an inconsistent result takes precedence.
    fits: [Option<bool>; 2],
    correction: Option<EstimateCorrection>,
    /// A shift of the gyro's zero was found in this step.
    gyro: bool,
    now: Instant,
}

impl Answers<'_> {
    /// Tests a hypothesis. When it begins to hold, sets the finding of its sensor and adds its
    /// correction.
    fn ask<H: Hypothesis>(&mut self, hypothesis: &mut H, config: &MonitorConfig, seen: &Evidence<'_>) {
        // A shift of the gyro explains the camera's residual; without a range finder its hypotheses
        // are meaningless.
        if H::SENSOR != Sensor::Range && self.gyro || H::SENSOR == Sensor::Range && !seen.has_range {
            return;
        }
        let opinion = hypothesis.step(config, seen);
        let [flow, range] = &mut self.fits;
        let fits = match H::SENSOR {
            Sensor::Flow => Some(flow),
            Sensor::Range => Some(range),
            Sensor::Gyro => None,
        };
        if let Some(fits) = fits {
            *fits = match (opinion, *fits) {
                (Opinion::Holds(_) | Opinion::Misfits, _) | (_, Some(false)) => Some(false),
                (Opinion::Fits, _) => Some(true),
                (Opinion::Unknown, before) => before,
            };
        }
        let Opinion::Holds(correction) = opinion else { return };
        self.gyro |= H::SENSOR == Sensor::Gyro;
        let health = match H::SENSOR {
            Sensor::Gyro => &mut self.findings.gyro,
            Sensor::Range => &mut self.findings.range,
            Sensor::Flow => &mut self.findings.flow,
        };
        // A gyro may shift again, and each shift needs its correction.
        let begins = health.finding == Finding::None || H::FINDING == Finding::Shifted;
        if begins {
            *health = Health { finding: H::FINDING, since: self.now };
            self.correction = match (self.correction, correction) {
                (Some(first), Some(second)) => Some(both(&first, &second)),
                (first, second) => first.or(second),
            };
        }
    }
}
