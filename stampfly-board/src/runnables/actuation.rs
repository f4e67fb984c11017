//! Actuation: thrust and torque in, motor duty out. The last place where a motor can be kept still.

use crate::config::VehicleConfig;
use crate::topics::ActuationEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_control::{Mixer, MotorStage, MultirotorMixer};
use stampfly_types::Duration;

/// Demand older than this turns no motor: the controller has stopped. Ten periods of the loop.
const STALE_DEMAND: Duration = Duration::from_millis(25);
/// A battery reading older than this counts as none: fourteen periods of the monitor.
const STALE_POWER: Duration = Duration::from_secs(1);

/// Actuation: thrust and torque in, motor duty out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Actuation {
    mixer: MultirotorMixer,
    motors: MotorStage,
}

impl Actuation {
    /// Motors at rest.
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        Self { mixer: MultirotorMixer::stampfly(), motors: MotorStage::new(&config.motor) }
    }
}

impl Runnable for Actuation {
    type Ends<'b> = ActuationEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut ActuationEnds<'_>) {
        let now = activation.now();
        let demand = ends.control_output.fresh(now, STALE_DEMAND).copied();
        let armed = ends.system_mode.fresh(now, STALE_DEMAND).is_some_and(|mode| mode.armed);
        let voltage = ends.sensor_power.fresh(now, STALE_POWER).map(|power| power.voltage);
        let mixed = self.mixer.mix(&demand.unwrap_or_default());
        let output = self.motors.step(now, &mixed, voltage, armed && demand.is_some());
        ends.actuator_motor.publish(now, &output);
    }
}
