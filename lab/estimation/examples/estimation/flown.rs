//! A simulated flight from the estimator's side: what each of its activations was given, and what was really the case.

use stampfly_board::schedule::{self, Runnables};
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_board::topics::Id;
use stampfly_bus::Activation;
use stampfly_eskf::Estimator;
use stampfly_flight::{Observer, newest::message};
use stampfly_sim::Truth;
use stampfly_sim::vehicle::{Vehicle, Witness};
use stampfly_types::messages::{
    BaroData, CalibrationResult, EstimatorCommand, FlowData, ImuData, MagData, StateEstimate, TofData,
};
use stampfly_types::{Instant, Message};
use std::collections::BTreeMap;
use std::error::Error;

type Samples<M> = Vec<(Instant, M)>;

/// What one activation of the estimation was given.
#[derive(Clone, Default)]
pub struct Given {
    pub now: Instant,
    pub calibration: Option<CalibrationResult>,
    pub command: Option<EstimatorCommand>,
    pub imu: Samples<ImuData>,
    pub tof: Samples<TofData>,
    pub flow: Samples<FlowData>,
    pub mag: Samples<MagData>,
    pub baro: Samples<BaroData>,
}

/// One flight.
#[derive(Default)]
pub struct Flown {
    pub given: Vec<Given>,
    pub truth: BTreeMap<Instant, Truth>,
    pub published: BTreeMap<Instant, StateEstimate>,
}

impl Given {
    /// Start, commands and inertial samples.
    pub fn predict(&self, estimator: &mut impl Estimator, started: &mut bool) {
        if let Some(calibration) = self.calibration.filter(|calibration| calibration.complete && !*started) {
            *started = true;
            estimator.initialize(self.now, &calibration);
        }
        if let Some(command) = self.command {
            estimator.command(self.now, &command);
        }
        self.imu.iter().for_each(|(at, sample)| estimator.predict(*at, sample));
    }

    /// The other sensors.
    pub fn fuse(&self, estimator: &mut impl Estimator) {
        for (at, sample) in &self.tof {
            _ = estimator.fuse_tof(*at, sample);
        }
        for (at, sample) in &self.flow {
            _ = estimator.fuse_flow(*at, sample);
        }
        for (at, sample) in &self.mag {
            _ = estimator.fuse_mag(*at, sample);
        }
        for (at, sample) in &self.baro {
            _ = estimator.fuse_baro(*at, sample);
        }
    }
}

impl Flown {
    /// Flies, and takes down what the estimation read.
    pub fn new(setup: &Setup) -> Result<Self, Box<dyn Error>> {
        let mut notes = Notes::default();
        let ended = StampFly::fly(setup, &mut notes, &mut |_, _| {});
        if ended.outcome.finished { Ok(notes.flown) } else { Err("the mission was not flown to its end".into()) }
    }
}

/// Takes down what the estimation reads while a flight is flown.
#[derive(Default)]
struct Notes {
    flown: Flown,
    pending: Given,
}

impl Observer for Notes {
    fn has_read(&mut self, activation: &Activation) {
        if usize::from(activation.record().index) == schedule::Id::estimation as usize {
            self.pending.now = activation.record().now;
            let Given { calibration, command, .. } = self.pending;
            self.flown.given.push(std::mem::take(&mut self.pending));
            // What is not a stream stays.
            (self.pending.calibration, self.pending.command) = (calibration, command);
        }
    }
}

impl Witness<Runnables> for Notes {
    fn published(&mut self, topic: usize, at: Instant, _: u32, words: &[u32]) {
        let pending = &mut self.pending;
        match Id::ALL.get(topic) {
            Some(Id::sensor_imu) => pending.imu.extend(sample(at, words)),
            Some(Id::sensor_tof) => pending.tof.extend(sample(at, words)),
            Some(Id::sensor_flow) => pending.flow.extend(sample(at, words)),
            Some(Id::sensor_mag) => pending.mag.extend(sample(at, words)),
            Some(Id::sensor_baro) => pending.baro.extend(sample(at, words)),
            Some(Id::calibration) => pending.calibration = message(words),
            Some(Id::estimator_command) => pending.command = message(words),
            Some(Id::estimate_state) => self.flown.published.extend(sample::<StateEstimate>(at, words)),
            _ => {}
        }
    }

    fn beside(&mut self, _: usize, at: Instant, _: u32, words: &[u32]) {
        self.flown.truth.extend(sample::<Truth>(at, words));
    }
}

/// A sample as its message; `None` for words that are none.
fn sample<M: Message>(at: Instant, words: &[u32]) -> Option<(Instant, M)> {
    Some((at, message(words)?))
}
