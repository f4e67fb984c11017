//! The modules of the original: each reads its topics, steps a component, publishes.
//!
//! What decides or computes is in [`attitude`](crate::attitude), [`rate_loops`](crate::rate_loops),
//! [`protection`](crate::protection), [`battery`](crate::battery) and [`lamps`](crate::lamps);
//! change it there.

use crate::airframe::AIRFRAME;
use crate::attitude::Sensing;
use crate::battery::Battery;
use crate::lamps::{Lamps, pattern};
use crate::messages::*;
use crate::parameters::Parameters;
use crate::protection::{CUT, Looked, Protection};
use crate::rate_loops::{Demand, RateLoops};
use crate::topics::*;
use crate::{family, frame};
use serde::{Deserialize, Serialize};
use stampfly_bus::{Activation, Runnable};
use stampfly_control::mixer::shares;
use stampfly_mode::gestures::{Gestured, Gestures};
use stampfly_param::ParameterSet;
use stampfly_types::messages::{MotorOutput, PowerData};
use stampfly_types::{Duration, Vec3};

/// The transmitter is gone when its last packet is a second old.
pub const OFFLINE: Duration = Duration::from_secs(1);
/// An attitude that is older is none: a hundred samples were missed. The motors would otherwise do on what was last right.
pub const SENSING_LOST: Duration = Duration::from_millis(25);
/// How long a calibration takes.
const CALIBRATION: Duration = Duration::from_secs(2);
/// Below this channel 5 means ANGLE.
const ANGLE: f32 = 0.25;
/// The least age that is too old, as an age that is just not.
const fn within(age: Duration) -> Duration {
    Duration::from_micros(age.as_micros() - 1)
}

/// Sample to attitude.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sensor(Sensing);

impl Sensor {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        Self(Sensing::new(parameters))
    }
}

impl Runnable for Sensor {
    type Ends<'b> = SensorEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut SensorEnds<'_>) {
        if ends.parameters.is_new() {
            self.0.adopt(ends.parameters.get());
        }
        let now = activation.now();
        let calibrating = ends.control_state.get().calibrating;
        // One that is late has several samples, and the last attitude is the one that counts.
        let mut newest = None;
        for sample in ends.sensor_imu.iter() {
            let (attitude, found) = self.0.step(&sample.data, calibrating);
            newest = Some(attitude);
            if let Some(offsets) = found {
                ends.sensor_offsets.publish(now, &offsets);
            }
        }
        if let Some(attitude) = newest {
            ends.attitude.publish(now, &attitude);
        }
    }
}

/// What has gone wrong.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Failsafe(Protection);

impl Failsafe {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        Self(Protection::new(&AIRFRAME, parameters))
    }
}

impl Runnable for Failsafe {
    type Ends<'b> = FailsafeEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut FailsafeEnds<'_>) {
        if ends.parameters.is_new() {
            self.0.adopt(&AIRFRAME, ends.parameters.get());
        }
        let now = activation.now();
        let output = ends.actuator_motor.get();
        let looked = Looked {
            attitude: ends.attitude.fresh(now, within(SENSING_LOST)),
            state: ends.control_state.get(),
            wanted: ends.rate_demand.fresh(now, within(SENSING_LOST)).map_or(Vec3::zeros(), |demand| demand.setpoint),
            duty: output.duty.get(..usize::from(output.count)).unwrap_or_default(),
            power: ends.sensor_power.sample().map(|sample| (sample.at, &sample.data)),
            heard: ends.receiver_input.sample().map(|sample| sample.at),
        };
        let alert = self.0.step(now, &ends.sensor_imu, &looked);
        ends.system_alert.publish(now, &alert);
    }
}

/// Sticks and attitude to motors.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Controller {
    gestures: Gestures,
    loops: RateLoops,
    parameters: Parameters,
}

impl Controller {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        Self {
            gestures: Gestures::new(CALIBRATION, parameters.stick.threshold),
            loops: RateLoops::new(parameters),
            parameters: *parameters,
        }
    }
}

impl Runnable for Controller {
    type Ends<'b> = ControllerEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut ControllerEnds<'_>) {
        if ends.parameters.is_new() {
            self.parameters = *ends.parameters.get();
            self.gestures.set_threshold(self.parameters.stick.threshold);
        }
        let (now, parameters) = (activation.now(), &self.parameters);
        let input = ends.receiver_input.fresh(now, within(OFFLINE));
        let attitude = ends.attitude.fresh(now, within(SENSING_LOST));
        let sticks = input.map(|input| [input.throttle, input.yaw]);
        // What has crashed is disarmed, and is not armed while it lies.
        let ready = attitude.is_some() && !ends.system_alert.get().active.intersects(CUT);
        let Gestured { armed, calibrating } = self.gestures.step(now, sticks, ready);
        let angle_mode = input.is_some_and(|input| input.aux[0] < ANGLE);
        let state = ControlState { armed, calibrating, angle_mode, online: input.is_some() };
        ends.control_state.publish(now, &state);

        let rows = frame::layout(parameters.frame.layout);
        let mut output = MotorOutput { count: rows.len() as u8, armed: state.armed, ..Default::default() };
        // Without the one or the other there is nothing to steer by, and the vehicle is disarmed.
        if let Some((input, attitude)) = input.zip(attitude) {
            let sticks = [input.roll, input.pitch, input.yaw].map(|stick| (stick - 0.5) / 0.5);
            let demand = Demand { sticks, angle_mode: state.angle_mode };
            let terms = self.loops.step(&demand, &attitude.angle, &attitude.rate, parameters);
            let wanted = terms.map(|term| term.output());
            let vector = |[roll, pitch, yaw]: [f32; 3]| Vec3::new(roll, pitch, yaw);
            let rates = RateDemand { setpoint: vector(terms.map(|term| term.setpoint)), output: vector(wanted) };
            ends.rate_demand.publish(now, &rates);
            if input.throttle <= parameters.stick.threshold {
                self.loops.cut();
            } else if state.armed {
                let gained = wanted.map(|share| share * parameters.gain.rotation);
                let mixed = shares::mix(rows, input.throttle * parameters.gain.throttle, gained);
                output.duty = mixed.map(|share| share.clamp(0.0, 1.0));
            }
        } else {
            self.loops.cut();
        }
        ends.actuator_motor.publish(now, &output);
    }
}

/// Requests to the parameters in use.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Storage(ParameterSet<Parameters>);

impl Storage {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        // A vehicle that is given values it would refuse starts with the table's.
        Self(ParameterSet::new(*parameters, Duration::ZERO).unwrap_or_default())
    }
}

impl Runnable for Storage {
    type Ends<'b> = StorageEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut StorageEnds<'_>) {
        let now = activation.now();
        for request in ends.parameter_request.iter() {
            // A refusal is in the status.
            let _ = self.0.request(&request.data);
        }
        // A parameter from now on: the next change of another one must not bring back the offsets of before.
        if ends.sensor_offsets.is_new() {
            // Offsets beyond what a parameter takes last until power-off.
            let _ = self.0.change(|parameters| parameters.offset = ends.sensor_offsets.get().into());
        }
        if let Some((parameters, status)) = self.0.period(now, true, []) {
            ends.parameters.publish(now, &parameters);
            ends.parameter_status.publish(now, &status);
        }
    }
}

/// What the family's services are told.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Communication(());

impl Communication {
    pub(crate) fn new(_: &Parameters) -> Self {
        Self(())
    }
}

impl Runnable for Communication {
    type Ends<'b> = CommunicationEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut CommunicationEnds<'_>) {
        let now = activation.now();
        let attitude = ends.attitude.fresh(now, within(SENSING_LOST));
        let duty = &ends.actuator_motor.get().duty;
        let turning = duty.iter().any(|duty| *duty > 0.0);
        let status = family::status(ends.control_state.get(), attitude, turning, ends.system_alert.get().active);
        ends.flight_status.publish(now, &status);
        ends.estimate_state.publish(now, &family::estimate(attitude));
        if ends.receiver_input.is_new() {
            ends.command_pilot.publish(now, &family::pilot(ends.receiver_input.get(), ends.control_state.get()));
        }
    }
}

/// Battery and lights.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct System {
    battery: Battery,
    lamps: Lamps,
    parameters: Parameters,
}

impl System {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        Self { battery: Battery::default(), lamps: Lamps::default(), parameters: *parameters }
    }
}

impl Runnable for System {
    type Ends<'b> = SystemEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut SystemEnds<'_>) {
        if ends.parameters.is_new() {
            self.parameters = *ends.parameters.get();
        }
        let now = activation.now();
        let battery = self.battery.step(ends.battery_sample.get().counts, &self.parameters.battery);
        ends.battery_state.publish(now, &battery);
        ends.sensor_power.publish(now, &PowerData { voltage: battery.voltage, ..Default::default() });
        let is_on = self.lamps.step(pattern(ends.control_state.get(), &battery));
        ends.lights.publish(now, &Lights { front: is_on, back: is_on });
    }
}
