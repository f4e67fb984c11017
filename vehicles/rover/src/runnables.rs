//! The software components of the document: each reads its signals, calls a model, writes its signal.
//!
//! Every component that moves something asks [`SafetyStatus::must_stop`] by itself, so the emergency stop is above
//! everything and a silent supervisor is one. What decides or computes is in [`models`], [`safety`](crate::safety),
//! [`driver_input`](crate::driver_input) and [`diag`]; change it there.

use crate::driver_input::{DriverSelector, DriverSources};
use crate::messages::*;
use crate::models::TICK;
use crate::parameters::PROBATION;
use crate::safety::{SafetyInput, SafetySupervisor};
use crate::topics::*;
use crate::{Parameters, diag, models};
use serde::{Deserialize, Serialize};
use stampfly_bus::{Activation, Runnable};
use stampfly_param::ParameterSet;
use stampfly_types::Duration;

/// A line of a replay is for one tick: it is too old for the next.
const LINE_AGE: Duration = Duration::from_millis(5);

/// Components that begin with nothing but their default.
macro_rules! components {
    ($($(#[$doc:meta])* $Name:ident($State:ty);)+) => { $(
        $(#[$doc])*
        #[derive(Clone, Debug, Serialize, Deserialize)]
        pub struct $Name($State);

        impl $Name {
            pub(crate) fn new(_: &Parameters) -> Self {
                Self(<$State>::default())
            }
        }
    )+ };
}

components! {
    /// Heartbeats, faults and the emergency stop to the state of the vehicle.
    SafetySupervisorSwc(SafetySupervisor);
    /// Operator, scenario or recorded log to the driver's input.
    DriverInputSwc(DriverSelector);
    /// Throttle to acceleration. Remembers what it did last if it is another process, as it is once that was heard.
    EngineSwc(Option<f32>);
    /// Pedal to deceleration.
    BrakeSwc(());
    /// Wheel to steering angle, which it remembers, because it lags.
    SteeringSwc(f32);
    /// Commands to motion.
    VehicleDynamicsSwc(VehicleState);
    /// Signals to one line of the log.
    LoggingSwc(());
    /// Signals to faults. Remembers all it has seen.
    DiagSwc(Faults);
    /// Is everything heard that must be? Remembers which components are other processes.
    ComSwc(Components);
}

impl Runnable for SafetySupervisorSwc {
    type Ends<'b> = SafetySupervisorEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut SafetySupervisorEnds<'_>) {
        let now = activation.now();
        let operator = ends.operator_command.get();
        let line = ends.replay_record.fresh(now, LINE_AGE).filter(|_| operator.mode == InputMode::Replay);
        let input = SafetyInput {
            heartbeats: [
                ends.drive_command.generation(),
                ends.brake_command.generation(),
                ends.steering_command.generation(),
                ends.vehicle_state.generation(),
                ends.com_status.generation(),
                ends.driver_input.generation(),
            ],
            faulty: ends.diag_status.iter().any(|status| !status.data.faults.is_empty()),
            estop: operator.estop,
            reset: operator.reset,
            replayed: line.map_or_else(Default::default, |line| (line.estop, line.system_state)),
        };
        let status = self.0.step(now, &input, &ends.parameters.get().safety);
        ends.safety_status.publish(now, &status);
    }
}

/// Requests to the parameters in use.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct NvmSwc(ParameterSet<Parameters>);

impl NvmSwc {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        // A vehicle that is given values it would refuse starts with the table's.
        Self(ParameterSet::new(*parameters, PROBATION).unwrap_or_default())
    }
}

impl Runnable for NvmSwc {
    type Ends<'b> = NvmEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut NvmEnds<'_>) {
        let now = activation.now();
        let healthy = ends.diag_status.iter().all(|status| status.data.faults.is_empty());
        let requests = ends.parameter_request.iter().map(|request| request.data);
        if let Some((parameters, status)) = self.0.period(now, healthy, requests) {
            ends.parameters.publish(now, &parameters);
            ends.parameter_status.publish(now, &status);
        }
    }
}

impl Runnable for DriverInputSwc {
    type Ends<'b> = DriverInputEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut DriverInputEnds<'_>) {
        let now = activation.now();
        let sources = DriverSources {
            operator: *ends.operator_command.get(),
            operator_age: ends.operator_command.age(now),
            replay: ends.replay_record.fresh(now, LINE_AGE).map(LogRecord::driver_input),
            speed: ends.vehicle_state.get().v,
            system_state: ends.safety_status.get().system_state,
        };
        let input = self.0.step(now, &sources, &ends.parameters.get().input);
        ends.driver_input.publish(now, &input);
    }
}

impl Runnable for EngineSwc {
    type Ends<'b> = EngineEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut EngineEnds<'_>) {
        let (now, parameters) = (activation.now(), ends.parameters.get());
        let estop = ends.safety_status.get().must_stop(ends.safety_status.age(now), &parameters.safety);
        let remote = ends.remote_drive.is_new().then(|| if estop { 0.0 } else { ends.remote_drive.get().acceleration });
        let acceleration = match (remote, self.0) {
            (None, None) => models::drive_acceleration(ends.driver_input.get().throttle, estop, &parameters.engine),
            (Some(acceleration), _) => acceleration,
            // Each command is a heartbeat; without one this component has none either. But what it holds, it lets go.
            (None, Some(held)) if estop && held != 0.0 => 0.0,
            (None, Some(_)) => return,
        };
        self.0 = remote.or(self.0).map(|_| acceleration);
        ends.drive_command.publish(now, &DriveCommand { acceleration });
    }
}

impl Runnable for BrakeSwc {
    type Ends<'b> = BrakeEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut BrakeEnds<'_>) {
        let (now, parameters) = (activation.now(), ends.parameters.get());
        let estop = ends.safety_status.get().must_stop(ends.safety_status.age(now), &parameters.safety);
        let deceleration = models::brake_deceleration(ends.driver_input.get().brake, estop, &parameters.brake);
        ends.brake_command.publish(now, &BrakeCommand { deceleration });
    }
}

impl Runnable for SteeringSwc {
    type Ends<'b> = SteeringEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut SteeringEnds<'_>) {
        let (now, parameters) = (activation.now(), ends.parameters.get());
        let estop = ends.safety_status.get().must_stop(ends.safety_status.age(now), &parameters.safety);
        let target = models::steering_target(ends.driver_input.get().steer, estop, &parameters.steering);
        self.0 = models::step_steering(self.0, target, TICK, &parameters.steering);
        ends.steering_command.publish(now, &SteeringCommand { angle: self.0 });
    }
}

impl Runnable for VehicleDynamicsSwc {
    type Ends<'b> = VehicleDynamicsEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut VehicleDynamicsEnds<'_>) {
        let (now, parameters) = (activation.now(), &ends.parameters.get().vehicle);
        let estop = ends.safety_status.get().must_stop(ends.safety_status.age(now), &ends.parameters.get().safety);
        // Also here: an emergency stop does not depend on the components above.
        let drive = if estop { 0.0 } else { ends.drive_command.get().acceleration };
        let brake = ends.brake_command.get().deceleration;
        let state = models::step_longitudinal(&self.0, TICK, drive, brake, estop, parameters);
        let state = models::step_lateral(&state, TICK, ends.steering_command.get().angle, parameters);
        self.0 = VehicleState { t: now.seconds_f64() as f32, ..state };
        ends.vehicle_state.publish(now, &self.0);
    }
}

impl Runnable for LoggingSwc {
    type Ends<'b> = LoggingEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut LoggingEnds<'_>) {
        let commands = (ends.drive_command.get(), ends.brake_command.get(), ends.steering_command.get());
        let (state, safety) = (ends.vehicle_state.get(), ends.safety_status.get());
        ends.log_record.publish(activation.now(), &LogRecord::new(ends.driver_input.get(), commands, state, safety));
    }
}

impl Runnable for DiagSwc {
    type Ends<'b> = DiagEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut DiagEnds<'_>) {
        let signals = diag::Signals {
            input: *ends.driver_input.get(),
            drive: *ends.drive_command.get(),
            brake: *ends.brake_command.get(),
            steering: *ends.steering_command.get(),
            state: *ends.vehicle_state.get(),
        };
        let faults = diag::check(&signals, ends.parameters.get());
        self.0 |= faults;
        ends.diag_status.publish(activation.now(), &DiagStatus { faults, seen: self.0 });
    }
}

impl Runnable for ComSwc {
    type Ends<'b> = ComEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut ComEnds<'_>) {
        let heard = Components::NONE.set(Components::ENGINE, ends.remote_drive.is_new());
        self.0 |= heard;
        // When one is not heard, its heartbeat and this one are missing: two, so an emergency stop.
        if heard == self.0 {
            ends.com_status.publish(activation.now(), &ComStatus { heard });
        }
    }
}
