//! A second estimator that is given what the vehicle's own was given, in the same order: it shows what the vehicle
//! keeps to itself, covariance and fate of each sample.
//!
//! What an activation of the flight read is in its record, so the second estimator is fed the very samples, however late
//! the executor was. Its estimates must be the flight's, bit for bit; [`Shadow::is_identical`] says whether they were.

use stampfly_board::{plan, wiring};
use stampfly_bus::{Activation, InputRecord};
use stampfly_eskf::{Eskf, EskfConfig, Estimator, Fusion};
use stampfly_types::messages::{
    BaroData, CalibrationResult, EstimatorCommand, ExternalPose, FlowData, ImuData, MagData, TofData,
};
use stampfly_types::{Instant, Message};
use std::collections::VecDeque;

/// Samples of a topic that are kept: more than its ring holds.
const KEPT: usize = 64;

/// The newest samples of one topic.
#[derive(Debug)]
struct Recent<M>(VecDeque<(u32, Instant, M)>);

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
            self.0.push_back((generation, at, message));
            while self.0.len() > KEPT {
                self.0.pop_front();
            }
        }
    }

    /// The samples that an activation took.
    fn taken(&self, input: InputRecord) -> impl Iterator<Item = (Instant, M)> {
        let first = input.generation.wrapping_sub(u32::from(input.taken));
        let taken = move |generation: u32| generation > first && generation <= input.generation;
        self.0.iter().filter(move |sample| taken(sample.0)).map(|(_, at, message)| (*at, *message))
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
    identical: bool,
    imu: Recent<ImuData>,
    tof: Recent<TofData>,
    flow: Recent<FlowData>,
    mag: Recent<MagData>,
    baro: Recent<BaroData>,
    pose: Recent<ExternalPose>,
    calibration: Recent<CalibrationResult>,
    command: Recent<EstimatorCommand>,
    last_imu: Option<(Instant, ImuData)>,
}

impl Shadow {
    /// An estimator with the vehicle's tuning.
    #[must_use]
    pub fn new(config: EskfConfig) -> Self {
        Self {
            estimator: Eskf::new(config),
            started: false,
            identical: true,
            imu: Recent::default(),
            tof: Recent::default(),
            flow: Recent::default(),
            mag: Recent::default(),
            baro: Recent::default(),
            pose: Recent::default(),
            calibration: Recent::default(),
            command: Recent::default(),
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
    pub fn sample(&mut self, id: wiring::Id, at: Instant, generation: u32, words: &[u32]) {
        match id {
            wiring::Id::sensor_imu => self.imu.add(at, generation, words),
            wiring::Id::sensor_tof => self.tof.add(at, generation, words),
            wiring::Id::sensor_flow => self.flow.add(at, generation, words),
            wiring::Id::sensor_mag => self.mag.add(at, generation, words),
            wiring::Id::sensor_baro => self.baro.add(at, generation, words),
            wiring::Id::external_pose => self.pose.add(at, generation, words),
            wiring::Id::calibration => self.calibration.add(at, generation, words),
            wiring::Id::estimator_command => self.command.add(at, generation, words),
            wiring::Id::estimate_state => {
                self.identical &= words == self.estimator.estimate().to_words().as_ref() as &[u32];
            }
            wiring::Id::estimate_status => {
                self.identical &= words == self.estimator.status().to_words().as_ref() as &[u32];
            }
            _ => {}
        }
    }

    /// Repeats an activation of the estimation. `seen` is told the fate of each sample.
    pub fn activation(&mut self, index: usize, activation: &Activation, seen: &mut dyn FnMut(Sensor, Instant, Fusion)) {
        if plan::ACTIVATIONS.get(index).is_none_or(|info| info.name != "estimation") {
            return;
        }
        let &[imu, tof, flow, mag, baro, pose, calibration, command] = activation.inputs() else { return };
        let (now, estimator) = (activation.now(), &mut self.estimator);
        if let Some((_, calibration)) = self.calibration.taken(calibration).last()
            && calibration.complete
            && !self.started
        {
            self.started = true;
            estimator.initialize(now, &calibration);
        }
        if let Some((_, command)) = self.command.taken(command).last() {
            estimator.command(now, &command);
        }
        for (at, imu) in self.imu.taken(imu) {
            estimator.predict(at, &imu);
            self.last_imu = Some((at, imu));
        }
        for (at, tof) in self.tof.taken(tof) {
            seen(Sensor::Tof, now, estimator.fuse_tof(at, &tof));
        }
        for (at, flow) in self.flow.taken(flow) {
            seen(Sensor::Flow, now, estimator.fuse_flow(at, &flow));
        }
        for (at, mag) in self.mag.taken(mag) {
            estimator.fuse_mag(at, &mag);
        }
        for (at, baro) in self.baro.taken(baro) {
            seen(Sensor::Baro, now, estimator.fuse_baro(at, &baro));
        }
        for (at, pose) in self.pose.taken(pose) {
            if pose.position_sigma > 0.0 {
                estimator.fuse_position(at, &pose.position, pose.position_sigma);
            }
            if pose.attitude_sigma > 0.0 {
                estimator.fuse_attitude(at, &pose.attitude, pose.attitude_sigma);
            }
        }
    }
}
