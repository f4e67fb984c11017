//! Estimation: inertial samples and everything else in, state out.

use crate::config::VehicleConfig;
use crate::wiring;
use heapless::Vec;
use stampfly_bus::{Activation, Runnable, Stamped};
use stampfly_eskf::{Complementary, Eskf, Estimator};
use stampfly_types::messages::*;

/// The estimators this vehicle can be told to use (`estimator.type`).
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "one of them exists, for as long as the vehicle does")]
enum Choice {
    Eskf(Eskf),
    Complementary(Complementary),
}

impl Choice {
    fn get(&mut self) -> &mut dyn Estimator {
        match self {
            Self::Eskf(estimator) => estimator,
            Self::Complementary(estimator) => estimator,
        }
    }
}

/// Estimation: inertial samples and everything else in, state out.
pub struct Estimation<'b> {
    ports: EstimationPorts<'b>,
    estimator: Choice,
    /// Generation of the calibration the estimator was started from.
    started: bool,
    imu_samples: Vec<Stamped<ImuData>, 16>,
    tof_samples: Vec<Stamped<TofData>, 8>,
    flow_samples: Vec<Stamped<FlowData>, 16>,
    mag_samples: Vec<Stamped<MagData>, 8>,
    baro_samples: Vec<Stamped<BaroData>, 8>,
    poses: Vec<Stamped<ExternalPose>, 8>,
    newest_calibration: Option<Stamped<CalibrationResult>>,
    newest_command: Option<Stamped<EstimatorCommand>>,
}

/// The ends it owns.
pub struct EstimationPorts<'b> {
    /// Inertial samples.
    pub imu: wiring::sensor_imu::Rx<'b>,
    /// Ranges.
    pub tof: wiring::sensor_tof::Rx<'b>,
    /// Flow.
    pub flow: wiring::sensor_flow::Rx<'b>,
    /// Magnetic field.
    pub mag: wiring::sensor_mag::Rx<'b>,
    /// Air pressure.
    pub baro: wiring::sensor_baro::Rx<'b>,
    /// Pose seen from outside.
    pub pose: wiring::external_pose::Rx<'b>,
    /// Still-calibration.
    pub calibration: wiring::calibration::Rx<'b>,
    /// From the mode machine.
    pub command: wiring::estimator_command::Rx<'b>,
    /// The state.
    pub state: wiring::estimate_state::Tx<'b>,
    /// How the sensors agreed.
    pub status: wiring::estimate_status::Tx<'b>,
}

impl<'b> Estimation<'b> {
    /// An estimation that waits for its calibration.
    #[must_use]
    pub fn new(ports: EstimationPorts<'b>, config: &VehicleConfig) -> Self {
        let estimator = if config.uses_complementary_estimator() {
            Choice::Complementary(Complementary::new(config.complementary))
        } else {
            Choice::Eskf(Eskf::new(config.eskf))
        };
        Self {
            ports,
            estimator,
            started: false,
            imu_samples: Vec::new(),
            tof_samples: Vec::new(),
            flow_samples: Vec::new(),
            mag_samples: Vec::new(),
            baro_samples: Vec::new(),
            poses: Vec::new(),
            newest_calibration: None,
            newest_command: None,
        }
    }
}

impl Runnable for Estimation<'_> {
    fn read(&mut self, activation: &mut Activation) {
        activation.drain(&mut self.ports.imu, &mut self.imu_samples);
        activation.drain(&mut self.ports.tof, &mut self.tof_samples);
        activation.drain(&mut self.ports.flow, &mut self.flow_samples);
        activation.drain(&mut self.ports.mag, &mut self.mag_samples);
        activation.drain(&mut self.ports.baro, &mut self.baro_samples);
        activation.drain(&mut self.ports.pose, &mut self.poses);
        self.newest_calibration = activation.latest(&mut self.ports.calibration);
        self.newest_command = activation.latest(&mut self.ports.command);
    }

    fn run(&mut self, activation: &mut Activation) {
        let now = activation.now();
        let estimator = self.estimator.get();
        if let Some(calibration) = self.newest_calibration
            && calibration.data.complete
            && !self.started
        {
            self.started = true;
            estimator.initialize(now, &calibration.data);
        }
        if let Some(command) = self.newest_command {
            estimator.command(now, &command.data);
        }
        for sample in &self.imu_samples {
            estimator.predict(sample.at, &sample.data);
        }
        for sample in &self.tof_samples {
            estimator.fuse_tof(sample.at, &sample.data);
        }
        for sample in &self.flow_samples {
            estimator.fuse_flow(sample.at, &sample.data);
        }
        for sample in &self.mag_samples {
            estimator.fuse_mag(sample.at, &sample.data);
        }
        for sample in &self.baro_samples {
            estimator.fuse_baro(sample.at, &sample.data);
        }
        for Stamped { at, data, .. } in &self.poses {
            if data.position_sigma > 0.0 {
                estimator.fuse_position(*at, &data.position, data.position_sigma);
            }
            if data.attitude_sigma > 0.0 {
                estimator.fuse_attitude(*at, &data.attitude, data.attitude_sigma);
            }
        }
        self.ports.state.publish(now, &estimator.estimate());
        self.ports.status.publish(now, &estimator.status());
    }
}
