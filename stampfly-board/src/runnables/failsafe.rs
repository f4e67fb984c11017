//! Failsafe: everything that can go wrong in, alerts out. Runs on a deadline when the inertial sensor is silent.

use crate::config::VehicleConfig;
use crate::topics::FailsafeEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_control::MotorCurve;
use stampfly_mode::FailsafeInput;
use stampfly_mode::transitions::is_airborne;
use stampfly_types::messages::{CommandSource, PilotInput};
use stampfly_types::{Instant, Stamped};

/// Failsafe: everything that can go wrong in, alerts out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Failsafe {
    failsafe: stampfly_mode::Failsafe,
    curve: MotorCurve,
    last_pilot: Option<Instant>,
    last_guided: Option<Instant>,
}

impl Failsafe {
    /// Nothing wrong yet.
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        let failsafe = stampfly_mode::Failsafe::new(config.failsafe);
        Self { failsafe, curve: config.motor.curve, last_pilot: None, last_guided: None }
    }
}

impl Runnable for Failsafe {
    type Ends<'b> = FailsafeEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut FailsafeEnds<'_>) {
        let now = activation.now();
        // A stamp in the future must not stand for samples that never come.
        let newest = |last: Option<Instant>, at: Option<Instant>| last.max(at.map(|at| at.min(now)));
        // A standing vehicle is nearer to the floor than the camera sees sharply.
        let stands = !is_airborne(ends.flight_status.get().phase);
        let pilot = usable(&ends.command_pilot, PilotInput::is_readable);
        let guided = ends.command_guided.last().map(|sample| sample.at);
        (self.last_pilot, self.last_guided) = (newest(self.last_pilot, pilot), newest(self.last_guided, guided));
        // A source that does not fly the vehicle does not keep its flight going.
        let heard = match ends.flight_status.get().commander {
            CommandSource::Pilot => self.last_pilot,
            CommandSource::Guided => self.last_guided,
            CommandSource::None | CommandSource::Failsafe => self.last_pilot.max(self.last_guided),
        };
        // Commands that do not get through on board are not heard, either.
        let command = heard.min(ends.command_setpoint.sample().map(|sticks| sticks.at));
        let power = ends.sensor_power.sample();
        // What was asked for is not what a tired battery gives.
        let pushes = |voltage: f32| {
            let motors = ends.actuator_motor.get();
            let duties = motors.duty.iter().take(usize::from(motors.count));
            duties.map(|duty| self.curve.thrust(duty * voltage)).sum::<f32>()
        };
        let thrust = power.map(|power| pushes(power.data.voltage)).filter(|thrust| thrust.is_finite());

        let alert = self.failsafe.step(
            now,
            &FailsafeInput {
                imu: &ends.sensor_imu,
                estimate: ends.estimate_state.get(),
                status: ends.estimate_status.get(),
                findings: ends.findings.get(),
                power: power.map(|sample| (sample.at, &sample.data)),
                command,
                // A distance of nothing or less is none, whatever the chip's status says: the estimator does not use it.
                tof: usable(&ends.sensor_tof, |range| range.valid && range.distance > 0.0),
                flow: usable(&ends.sensor_flow, |flow| flow.valid || stands),
                baro: usable(&ends.sensor_baro, |pressure| pressure.altitude.is_finite()),
                output: ends.control_output.get(),
                unmet: ends.actuator_motor.get().unmet,
                thrust,
                self_test: ends.self_test.get().verdict,
                flight_status: ends.flight_status.get(),
            },
        );
        ends.system_alert.publish(now, &alert);
    }
}

/// When the newest usable sample of a topic arrived.
fn usable<M>(samples: &[Stamped<M>], is_usable: impl Fn(&M) -> bool) -> Option<Instant> {
    samples.iter().filter(|sample| is_usable(&sample.data)).map(|sample| sample.at).max()
}
