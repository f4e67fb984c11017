//! Actuation: thrust and torque in, motor duty out. The last place where a motor can be kept still.

use crate::config::VehicleConfig;
use crate::wiring;
use stampfly_bus::{Activation, Runnable};
use stampfly_control::{Mixer, MotorStage, MultirotorMixer};
use stampfly_types::messages::*;
use stampfly_types::{Duration, Instant};

/// Demand older than this turns no motor: the controller has stopped.
const STALE_DEMAND: Duration = Duration::from_millis(25);
/// A battery reading older than this is no reading.
const STALE_POWER: Duration = Duration::from_secs(1);

/// Actuation: thrust and torque in, motor duty out.
pub struct Actuation<'b> {
    ports: ActuationPorts<'b>,
    mixer: MultirotorMixer,
    motors: MotorStage,
    demand: Option<ControlOutput>,
    armed: bool,
    voltage: Option<f32>,
}

/// The ends it owns.
pub struct ActuationPorts<'b> {
    /// Thrust and torque.
    pub control: wiring::control_output::Rx<'b>,
    /// May the motors turn?
    pub mode: wiring::system_mode::Rx<'b>,
    /// Battery.
    pub power: wiring::sensor_power::Rx<'b>,
    /// Duty.
    pub motor: wiring::actuator_motor::Tx<'b>,
}

impl<'b> Actuation<'b> {
    /// Motors at rest.
    #[must_use]
    pub fn new(ports: ActuationPorts<'b>, config: &VehicleConfig) -> Self {
        Self {
            ports,
            mixer: MultirotorMixer::stampfly(),
            motors: MotorStage::new(&config.motor),
            demand: None,
            armed: false,
            voltage: None,
        }
    }
}

impl Runnable for Actuation<'_> {
    fn read(&mut self, activation: &mut Activation) {
        let now = activation.now();
        let fresh = |at: Instant, limit: Duration| now.since(at) <= limit;
        let demand = activation.latest(&mut self.ports.control);
        self.demand = demand.filter(|s| fresh(s.at, STALE_DEMAND)).map(|s| s.data);
        let mode = activation.latest(&mut self.ports.mode);
        self.armed = mode.is_some_and(|s| s.data.armed && fresh(s.at, STALE_DEMAND));
        let power = activation.latest(&mut self.ports.power);
        self.voltage = power.filter(|s| fresh(s.at, STALE_POWER)).map(|s| s.data.voltage);
    }

    fn run(&mut self, activation: &mut Activation) {
        let armed = self.armed && self.demand.is_some();
        let mixed = self.mixer.mix(&self.demand.unwrap_or_default());
        let output = self.motors.step(activation.now(), &mixed, self.voltage, armed);
        self.ports.motor.publish(activation.now(), &output);
    }
}
