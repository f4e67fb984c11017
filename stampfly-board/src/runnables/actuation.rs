//! Actuation: thrust and torque in, motor duty out. The last place where a motor can be kept still.

use crate::airframe::MIXER;
use crate::config::VehicleConfig;
use crate::console::TEST_DUTY;
use crate::topics::ActuationEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_control::{MotorStage, MultirotorMixer};
use stampfly_types::messages::MotorOutput;
use stampfly_types::{Duration, Instant};

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
    /// When the vehicle was last armed: a motor test from before that is over.
    armed_at: Instant,
}

impl Actuation {
    /// Motors at rest.
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        Self { mixer: MIXER, motors: MotorStage::new(&config.motor), armed_at: Instant::ZERO }
    }
}

impl Runnable for Actuation {
    type Ends<'b> = ActuationEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut ActuationEnds<'_>) {
        let now = activation.now();
        let demand = ends.control_output.fresh(now, STALE_DEMAND).copied();
        let mode = ends.flight_status.fresh(now, STALE_DEMAND);
        let armed = mode.is_some_and(|mode| mode.armed);
        if armed {
            self.armed_at = now;
        }
        let voltage = ends.sensor_power.fresh(now, STALE_POWER).map(|power| power.voltage);
        let mixed = self.mixer.mix_within(&demand.unwrap_or_default(), self.motors.thrust_max());
        // A write to flash stops both cores: duties would stay as they are, so they are zero before it begins.
        let is_still = ends.storage_busy.get().busy;
        let mut output = self.motors.step(now, &mixed, voltage, armed && demand.is_some() && !is_still);
        if mode.is_some_and(|mode| !mode.armed) && !is_still {
            self.test(now, ends, &mut output);
        }
        ends.actuator_motor.publish(now, &output);
    }
}

impl Actuation {
    /// Turns the motor that is being tested, on a vehicle known to be disarmed.
    fn test(&self, now: Instant, ends: &ActuationEnds<'_>, output: &mut MotorOutput) {
        let Some(test) = ends.motor_test.sample().filter(|test| test.at > self.armed_at && now < test.data.end())
        else {
            return;
        };
        let motor = test.data.motor.checked_sub(1).filter(|index| *index < u32::from(output.count));
        let place = motor.and_then(|index| output.duty.get_mut(index as usize));
        if let Some(duty) = place.filter(|_| (0.0..=TEST_DUTY).contains(&test.data.duty)) {
            *duty = test.data.duty;
            output.armed = true;
        }
    }
}
