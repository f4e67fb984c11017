//! The monitor: evidence, every hypothesis in turn, and what follows for each sensor.

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

/// After a start in the air the estimator first has to find tilt and biases, s: a gyro bias of 3°/s
/// takes as long.
const UNKNOWN: f32 = 20.0;
/// After a correction it settles within this time, s.
const SETTLES: f32 = 0.5;
/// For so long after a garbled sample a difference between samples may be that of its bridge, s.
const BRIDGED: f32 = 0.01;

/// What the monitor looks at in one step. Everything is borrowed.
#[derive(Clone, Copy, Debug)]
pub struct MonitorInput<'a> {
    /// The inertial samples since the step before, oldest first.
    pub imu: &'a [Stamped<ImuData>],
    /// The readings of the camera since then.
    pub flow: &'a [Stamped<FlowData>],
    /// The ranges.
    pub tof: &'a [Stamped<TofData>],
    /// The air pressures.
    pub baro: &'a [Stamped<BaroData>],
    /// The estimate that followed from all of them.
    pub estimate: &'a StateEstimate,
    /// How the estimator compared its sensors.
    pub status: &'a EstimatorStatus,
    /// The vehicle stands on the ground, as its mode machine knows.
    pub stands: bool,
    /// Its propellers carry it.
    pub flies: bool,
    /// The accelerometer measures.
    pub felt: bool,
    /// A change of this number says that the estimate has begun anew.
    pub restarts: u32,
}

/// Declares the hypotheses: a line each, in the order in which they are asked. What is removed here is
/// not judged.
macro_rules! hypotheses {
    ($($name:ident: $Hypothesis:ident),* $(,)?) => {
        /// Every hypothesis.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        struct Hypotheses { $($name: $Hypothesis),* }

        /// Their names, by the bit that takes one out
        /// ([`MonitorConfig::without`](crate::MonitorConfig::without)).
        pub const HYPOTHESES: &[&str] = &[$(stringify!($name)),*];

        impl Hypotheses {
            /// Asks each of them that is not taken out.
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
    // The gyro first: where its zero has moved, the camera is the one that is right.
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

/// Judges sensors beside an estimator.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Monitor {
    config: MonitorConfig,
    recollection: Recollection,
    vertical: Vertical,
    hypotheses: Hypotheses,
    findings: SensorFindings,
    /// How long flow and range, left out, have fitted what they should measure, s.
    fits: [f32; 2],
    /// How long it has to hold back, s.
    waits: f32,
    last: Option<Instant>,
    /// The last sample that was believed.
    sample: ImuData,
    refused: u32,
    bridged: f32,
    restarts: u32,
}

impl Monitor {
    /// Of a vehicle about which nothing is known yet.
    #[must_use]
    pub fn new(config: MonitorConfig) -> Self {
        Self { config, waits: UNKNOWN, vertical: Vertical::airborne(), ..Self::default() }
    }

    /// How each sensor fares.
    #[must_use]
    pub fn findings(&self) -> &SensorFindings {
        &self.findings
    }

    /// Takes a step. Gives what the estimate is to be put right by, where a sensor has misled it.
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

        // The reading of the camera was compared with the estimate before this step's samples.
        let Self { config, recollection, vertical, .. } = self;
        let mut flow = recollection.flow(now, config, input.flow.last().map(|sample| &sample.data), estimate, status);
        if let Some(flow) = &mut flow {
            // Nothing is reckoned with what is not felt.
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
            // What is no measurement is not shown.
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
        if trusted.range && self.findings.range.finding != Finding::None {
            self.begin_without_range(now);
        }
        self.clear(input, fits, elapsed);
        if let Some(correction) = &correction {
            self.correct(correction, estimate);
        }
        correction
    }

    /// Counts how long the estimate has to find itself, and begins anew where it does.
    fn hold_back(&mut self, now: Instant, input: &MonitorInput<'_>) {
        let dt = self.last.replace(now).map_or(0.0, |last| now.since(last).seconds());
        self.waits = if input.stands { 0.0 } else { math::larger(self.waits - dt, 0.0) };
        self.bridged = math::larger(self.bridged - dt, 0.0);
        if core::mem::replace(&mut self.restarts, input.restarts) != input.restarts && !input.stands {
            self.waits = UNKNOWN;
            let sigmas = Sigmas { acceleration: self.config.accel_sigma_m_s2, ..Sigmas::default() };
            self.recollection.begin(input.estimate, sigmas);
            self.vertical.altimeter.restart(-input.estimate.accel_bias.z);
        }
        if input.estimate.sensors.contains(SensorMask::EXTERNAL) {
            // What sees the vehicle from outside moves the estimate as no camera on board does.
            self.waits = math::larger(self.waits, SETTLES);
        }
        let refused = core::mem::replace(&mut self.refused, input.status.imu_refused);
        if refused != input.status.imu_refused {
            self.bridged = BRIDGED;
        }
    }

    /// What stands for samples that the estimator has just bridged: the last one that was believed.
    fn bridge(&mut self, samples: &[Stamped<ImuData>]) -> Option<Stamped<ImuData>> {
        let newest = samples.last()?;
        if self.bridged == BRIDGED {
            return Some(Stamped { data: self.sample, ..*newest });
        }
        self.sample = newest.data;
        None
    }

    /// Which sensors are not left out.
    fn trusted(&self) -> Trusted {
        let SensorFindings { range, flow, .. } = &self.findings;
        Trusted { range: range.finding == Finding::None, flow: flow.finding == Finding::None }
    }

    /// The range has just been found to be wrong.
    fn begin_without_range(&mut self, now: Instant) {
        // What it did to the accelerometer's bias since the take-off, and the propellers to the pressure,
        // cannot be told apart.
        if self.vertical.altimeter.knows_take_off() {
            self.findings.baro = Health { finding: Finding::Disagrees, since: now };
        }
        self.vertical.forget();
    }

    /// Uses a sensor again that has fitted for long enough what it should measure.
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
        // On the ground the range may say what it wants.
        if range >= self.config.range_agrees_s || input.stands {
            if self.findings.range.finding != Finding::None && !input.stands {
                self.vertical.altimeter.restart(-input.estimate.accel_bias.z);
                self.vertical.forget();
            }
            (self.findings.range, self.findings.baro, self.fits[1]) = Default::default();
        }
    }

    /// Goes on from the estimate that a correction makes.
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

/// Are these numbers?
fn is_finite(estimate: &StateEstimate, status: &EstimatorStatus) -> bool {
    let StateEstimate { attitude, position, velocity, gyro_bias, accel_bias, height, .. } = estimate;
    let vectors = position.norm_squared() + velocity.norm_squared() + gyro_bias.norm_squared();
    let [x, y] = status.flow_innovation;
    (vectors + accel_bias.norm_squared() + attitude.norm_squared() + height + x + y).is_finite()
}

/// Two corrections of one step: camera and gyro put right what is horizontal, ranges what is vertical.
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

/// Sensors that are not left out.
#[derive(Clone, Copy)]
struct Trusted {
    range: bool,
    flow: bool,
}

/// What the hypotheses of a step come to.
struct Answers<'a> {
    findings: &'a mut SensorFindings,
    /// Do camera and range fit what they should measure? Whatever misfits wins.
    fits: [Option<bool>; 2],
    correction: Option<EstimateCorrection>,
    /// The gyro's zero was found to have moved in this step.
    gyro: bool,
    now: Instant,
}

impl Answers<'_> {
    /// Asks a hypothesis. When it begins to hold, its sensor has that finding, and the estimate is put
    /// right.
    fn ask<H: Hypothesis>(&mut self, hypothesis: &mut H, config: &MonitorConfig, seen: &Evidence<'_>) {
        // What looked like the camera was the gyro; and a vehicle without a range finder has none that is wrong.
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
        // A zero that moves once more is put right once more.
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
