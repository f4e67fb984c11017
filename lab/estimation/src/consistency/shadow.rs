//! A second estimator that is given what the vehicle's own was given, in the same order: it shows what the vehicle
//! keeps to itself, covariance and fate of each sample.
//!
//! What an activation of the flight read is in its record, so the second estimator is fed the very samples, however late
//! the executor was. Its estimates must be the flight's, bit for bit; [`Shadow::is_identical`] says whether they were.

use stampfly_board::{schedule, topics};
use stampfly_eskf::{Aiding, Eskf, EskfConfig, Estimator, Fusion, Measurements, Pacer};
use stampfly_types::messages::{
    BaroData, CalibrationResult, EstimateCorrection, EstimatorCommand, ExternalPose, FlowData, ImuData, MagData,
    SensorFindings, TofData,
};
use stampfly_types::{ActivationRecord, InputRecord, Instant, Message, Stamped};
use std::collections::VecDeque;

/// Samples of a topic that are kept: more than its ring holds.
const KEPT: usize = 64;

/// The newest samples of one topic.
#[derive(Debug)]
struct Recent<M>(VecDeque<Stamped<M>>);

impl<M> Default for Recent<M> {
    fn default() -> Self {
        Self(VecDeque::new())
    }
}

impl<M: Message + Copy> Recent<M> {
    fn add(&mut self, at: Instant, generation: u32, words: &[u32])
    where
        M::Words: for<'w> TryFrom<&'w [u32]>,
    {
        if let Ok(words) = M::Words::try_from(words)
            && let Some(message) = M::from_words(&words)
        {
            self.0.push_back(Stamped { at, generation, data: message });
            while self.0.len() > KEPT {
                self.0.pop_front();
            }
        }
    }

    /// The samples that an activation took.
    fn taken(&self, input: InputRecord) -> Vec<Stamped<M>> {
        let first = input.generation.wrapping_sub(u32::from(input.taken));
        let taken = |generation: u32| generation > first && generation <= input.generation;
        self.0.iter().filter(|sample| taken(sample.generation)).copied().collect()
    }
}

/// The sensors whose agreement is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// Range to the ground.
    Tof,
    /// Optical flow.
    Flow,
    /// Air pressure.
    Baro,
}

/// The second estimator: fed by the bus and the activations, it repeats the flight's own.
#[derive(Debug)]
pub struct Shadow {
    estimator: Eskf,
    started: bool,
    pacer: Pacer,
    identical: bool,
    imu: Recent<ImuData>,
    tof: Recent<TofData>,
    flow: Recent<FlowData>,
    mag: Recent<MagData>,
    baro: Recent<BaroData>,
    pose: Recent<ExternalPose>,
    calibration: Recent<CalibrationResult>,
    command: Recent<EstimatorCommand>,
    findings: Recent<SensorFindings>,
    correction: Recent<EstimateCorrection>,
    /// What the mode machine asked for last.
    asked: Option<EstimatorCommand>,
    last_imu: Option<(Instant, ImuData)>,
}

impl Shadow {
    /// An estimator with the vehicle's tuning.
    #[must_use]
    pub fn new(config: EskfConfig) -> Self {
        Self {
            estimator: Eskf::new(config),
            started: false,
            pacer: Pacer::default(),
            identical: true,
            imu: Recent::default(),
            tof: Recent::default(),
            flow: Recent::default(),
            mag: Recent::default(),
            baro: Recent::default(),
            pose: Recent::default(),
            calibration: Recent::default(),
            command: Recent::default(),
            findings: Recent::default(),
            correction: Recent::default(),
            asked: None,
            last_imu: None,
        }
    }

    /// The estimator, after the last activation.
    #[must_use]
    pub fn estimator(&self) -> &Eskf {
        &self.estimator
    }

    /// The inertial sample the estimate is of.
    #[must_use]
    pub fn imu(&self) -> Option<(Instant, ImuData)> {
        self.last_imu
    }

    /// Were all estimates those of the flight, bit for bit?
    #[must_use]
    pub fn is_identical(&self) -> bool {
        self.identical
    }

    /// Takes a sample off the bus. An estimate is compared with its own.
    pub fn sample(&mut self, id: topics::Id, at: Instant, generation: u32, words: &[u32]) {
        match id {
            topics::Id::sensor_imu => self.imu.add(at, generation, words),
            topics::Id::sensor_tof => self.tof.add(at, generation, words),
            topics::Id::sensor_flow => self.flow.add(at, generation, words),
            topics::Id::sensor_mag => self.mag.add(at, generation, words),
            topics::Id::sensor_baro => self.baro.add(at, generation, words),
            topics::Id::external_pose => self.pose.add(at, generation, words),
            topics::Id::calibration => self.calibration.add(at, generation, words),
            topics::Id::estimator_command => self.command.add(at, generation, words),
            topics::Id::findings => self.findings.add(at, generation, words),
            topics::Id::estimate_correction => self.correction.add(at, generation, words),
            topics::Id::estimate_state => {
                self.identical &= words == self.estimator.estimate().to_words().as_ref() as &[u32];
            }
            topics::Id::estimate_status => {
                self.identical &= words == self.estimator.status().to_words().as_ref() as &[u32];
            }
            _ => {}
        }
    }

    /// Repeats an activation of the estimation. `seen` is told the fate of each sample.
    pub fn activation(&mut self, record: &ActivationRecord, seen: &mut dyn FnMut(Sensor, Instant, Fusion)) {
        if record.index != schedule::Id::estimation as u8 {
            return;
        }
        // In the order of the topic table.
        let &[imu, tof, flow, mag, baro, pose, calibration, command, findings, correction] = record.inputs() else {
            return;
        };
        let (now, estimator) = (record.now, &mut self.estimator);
        if let Some(calibration) = self.calibration.taken(calibration).last()
            && calibration.data.complete
            && !self.started
        {
            self.started = true;
            estimator.initialize(now, &calibration.data);
        }
        self.asked = self.command.taken(command).last().map(|command| command.data).or(self.asked);
        if let Some(command) = &self.asked {
            estimator.command(now, command);
        }
        if let Some(findings) = self.findings.taken(findings).last() {
            estimator.heed(now, &findings.data);
        }
        if let Some(correction) = self.correction.taken(correction).last() {
            estimator.correct(now, &correction.data);
        }
        let (imu, tof, flow) = (self.imu.taken(imu), self.tof.taken(tof), self.flow.taken(flow));
        let (mag, baro, pose) = (self.mag.taken(mag), self.baro.taken(baro), self.pose.taken(pose));
        self.last_imu = imu.last().map(|sample| (sample.at, sample.data)).or(self.last_imu);
        let measurements = Measurements { imu: &imu, tof: &tof, flow: &flow, mag: &mag, baro: &baro, pose: &pose };
        self.pacer.feed(estimator, &measurements, |aiding, _, fusion| match aiding {
            Aiding::Tof => seen(Sensor::Tof, now, fusion),
            Aiding::Flow => seen(Sensor::Flow, now, fusion),
            Aiding::Baro => seen(Sensor::Baro, now, fusion),
            _ => {}
        });
    }
}
