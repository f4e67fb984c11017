//! What the failsafe looks at in one step. Everything is borrowed.

use stampfly_types::messages::{
    ControlOutput, EstimatorStatus, FlightStatus, ImuData, MotorOutput, PowerData, SelfTestVerdict, SensorFindings,
    StateEstimate,
};
use stampfly_types::{Instant, Stamped, Vec3};

/// What the failsafe looks at.
#[derive(Clone, Copy, Debug)]
pub struct FailsafeInput<'a> {
    /// The inertial samples since the step before, oldest first: every one counts for the detection of impacts.
    pub imu: &'a [Stamped<ImuData>],
    /// The estimate.
    pub estimate: &'a StateEstimate,
    /// The estimator's own opinion.
    pub status: &'a EstimatorStatus,
    /// What is wrong with a sensor, as a monitor has found it.
    pub findings: &'a SensorFindings,
    /// Newest battery sample.
    pub power: Option<(Instant, &'a PowerData)>,
    /// Newest command of any kind.
    pub command: Option<Instant>,
    /// Newest usable range since the step before.
    pub tof: Option<Instant>,
    /// Newest usable flow since the step before.
    pub flow: Option<Instant>,
    /// Newest air pressure since the step before.
    pub baro: Option<Instant>,
    /// What the controller asked for one step ago.
    pub output: &'a ControlOutput,
    /// What the motors could not make of that: shares of roll, pitch, yaw and thrust, 0 is none
    /// ([`MotorOutput::unmet`](stampfly_types::messages::MotorOutput)).
    pub unmet: [f32; 4],
    /// What the motors push with together, as their duties and the battery's voltage make it, N;
    /// `None` where that is not known.
    pub thrust: Option<f32>,
    /// How the self test at power-on ended.
    pub self_test: SelfTestVerdict,
    /// State and mode one step ago.
    pub flight_status: &'a FlightStatus,
}

impl FailsafeInput<'_> {
    /// Torque that the motors were told to make, body axes, N·m: what was asked for, less what was
    /// unmet.
    pub(super) fn torque(&self) -> Vec3 {
        let [roll, pitch, yaw, _] = self.unmet.map(MotorOutput::met);
        self.output.torque.component_mul(&Vec3::new(roll, pitch, yaw))
    }
}
