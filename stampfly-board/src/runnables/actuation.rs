//! Actuation: thrust and torque in, motor duty out. The last place where a motor can be kept still.

use crate::airframe::{LAST_RATES, MIXER};
use crate::config::VehicleConfig;
use crate::console::TEST_DUTY;
use crate::topics::ActuationEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_control::{MotorStage, MultirotorMixer};
use stampfly_types::messages::MotorOutput;
use stampfly_types::{Duration, Instant};

/// Demand older than this turns no motor: the controller has stopped.
const STALE_DEMAND: Duration = LAST_RATES;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::airframe::AIRFRAME;
    use crate::schedule::Id;
    use crate::topics;
    use stampfly_bus::{ReadInputs, Split};
    use stampfly_types::Vec3;
    use stampfly_types::messages::{ControlOutput, FlightStatus, PowerData};

    /// What an armed vehicle's motors get in the last of these seconds, each with its voltage, for
    /// this demand.
    fn driven(seconds: &[f32], demand: &ControlOutput) -> MotorOutput {
        let mut bus = topics::Bus::new();
        let Split { mut runnables, mut outside, .. } = bus.split(None);
        let mut actuation = Actuation::new(&VehicleConfig::default());
        let steps = seconds.iter().flat_map(|voltage| [*voltage; 400]);
        for (step, voltage) in (1..).zip(steps) {
            let now = Instant::from_micros(2_500 * step);
            outside.power.sensor_power.publish(now, &PowerData { voltage, ..Default::default() });
            runnables.mode().flight_status.publish(now, &FlightStatus { armed: true, ..Default::default() });
            runnables.control().control_output.publish(now, demand);
            let (mut ends, mut activation) = (runnables.actuation(), Activation::live(Id::actuation as u8, now));
            ends.read(&mut activation);
            actuation.run(&mut activation, &mut ends);
        }
        outside.motors.actuator_motor.latest().expect("published").data
    }

    /// Collective thrust, N, and torque about roll and pitch, N·m, that these duties make of this
    /// voltage.
    fn made(output: &MotorOutput, voltage: f32) -> [f32; 3] {
        let mut sums = [0.0; 3];
        for (duty, rotor) in output.duty.iter().zip(AIRFRAME.rotors) {
            let thrust = AIRFRAME.motor.thrust(duty * voltage);
            for (sum, arm) in sums.iter_mut().zip([1.0, -rotor.y, rotor.x]) {
                *sum += thrust * arm;
            }
        }
        sums
    }

    /// Full throttle and half of the largest torque about roll, as the voltage falls.
    #[test]
    fn a_voltage_that_sags_takes_thrust_away_says_how_much_and_leaves_roll() {
        let demand = ControlOutput { thrust: 0.62, torque: Vec3::new(1.5e-3, 0.0, 0.0) };
        let mut last = 0.0;
        // A third of a volt a second, and time to follow it.
        for fresh_to in [&[4.2, 4.2, 4.2][..], &[4.2, 3.9, 3.7, 3.7, 3.7, 3.7], &[4.2, 3.9, 3.6, 3.3, 3.3, 3.3, 3.3]] {
            let voltage = *fresh_to.last().expect("some");
            let output = driven(fresh_to, &demand);
            let [thrust, roll, pitch] = made(&output, voltage);
            let [unmet_roll, unmet_pitch, _, unmet] = output.unmet;
            assert!(output.duty.iter().all(|duty| *duty <= 0.95 + 1e-6), "{output:?}");
            assert_eq!([unmet_roll, unmet_pitch], [0.0; 2], "{voltage} V");
            // What is left of the voltage's low-pass after the last second is 5 mV, a thousandth of
            // the thrust.
            assert!((roll / demand.torque.x - 1.0).abs() < 0.02 && pitch.abs() < 2e-5, "{voltage} V: {roll} {pitch}");
            assert!((thrust - (1.0 - unmet) * demand.thrust).abs() < 0.005, "{voltage} V: {thrust} N, unmet {unmet}");
            let most = AIRFRAME.motor.thrust(0.95 * voltage).min(AIRFRAME.motor_thrust_max);
            let limit = 4.0 * most - demand.torque.x / AIRFRAME.rotors[0].y;
            assert!((thrust - limit.min(demand.thrust)).abs() < 0.005, "{voltage} V: {thrust} N of {limit} N");
            assert!(unmet >= last, "{voltage} V: unmet {unmet}, before {last}");
            last = unmet;
        }
        assert!(last > 0.2, "a fifth is missing at the end: {last}");
    }

    /// The largest torques about both axes on a battery that is nearly empty.
    #[test]
    fn what_is_missing_of_roll_and_pitch_is_told_too() {
        let demand = ControlOutput { thrust: 0.36, torque: Vec3::new(3e-3, -3e-3, 0.0) };
        assert_eq!(driven(&[4.2; 2], &demand).unmet[..2], [0.0; 2]);
        let output = driven(&[2.9; 4], &demand);
        let [_, roll, pitch] = made(&output, 2.9);
        assert!(output.unmet[0] > 0.15 && output.unmet[0] == output.unmet[1], "{output:?}");
        let met = 1.0 - output.unmet[0];
        assert!((roll / demand.torque.x - met).abs() < 0.02, "{roll} of {}, {met} met", demand.torque.x);
        assert!((pitch / demand.torque.y - met).abs() < 0.02, "{pitch} of {}, {met} met", demand.torque.y);
    }

    /// A reading that no cell has changes no limit.
    #[test]
    fn a_voltage_that_is_none_takes_no_thrust_away() {
        let demand = ControlOutput { thrust: 0.5, torque: Vec3::zeros() };
        for reading in [0.0, f32::NAN, 12.0] {
            assert_eq!(driven(&[4.2, reading, reading], &demand).unmet, [0.0; 4], "{reading} V");
        }
    }
}
