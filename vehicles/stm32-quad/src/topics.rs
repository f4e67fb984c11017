//! Who publishes what for whom. What the five modules of the original share as global variables is one line each here.

use crate::Parameters;
use crate::messages::*;
use stampfly_param::{ParameterRequest, ParameterStatus};
use stampfly_types::messages::{FlightStatus, ImuData, MotorOutput, PilotInput, PowerData, StateEstimate, SystemAlert};

stampfly_bus::topics! {
    outside imu, battery, receiver, motors, lights, link;

    // From outside: chips, and programs on the serial line.
    /// Inertial sample, body FRD before the mounting rotation.
    sensor_imu: ImuData = ring(16) @ 4 kHz from imu => [sensor, failsafe];
    /// Battery voltage.
    battery_sample: BatterySample = latest @ 8 Hz from battery => [system];
    /// Sticks and switches, as often as a packet comes.
    receiver_input: ReceiverInput = latest @ 111 Hz from receiver => [failsafe, controller, system, communication];
    /// Changes of parameters.
    parameter_request: ParameterRequest = queue(32) @ on event from link => [storage];

    // Parameters.
    /// The parameters in use; published when they change.
    parameters: Parameters = latest @ on event from storage => [sensor, failsafe, controller, system, link];
    /// Which ones they are, and what was refused.
    parameter_status: ParameterStatus = latest @ on event from storage => [link];

    // The flight band.
    /// Filtered motion and attitude.
    attitude: Attitude = latest @ 4 kHz from sensor => [failsafe, controller, communication];
    /// What a calibration has found.
    sensor_offsets: SensorOffsets = latest @ on event from sensor => [storage, link];
    /// Armed, calibrating, mode.
    control_state: ControlState = latest @ 4 kHz from controller => [sensor, failsafe, system, communication, receiver];
    /// What has gone wrong.
    system_alert: SystemAlert = latest @ 4 kHz from failsafe => [controller, communication];
    /// What the rate loops want.
    rate_demand: RateDemand = latest @ 4 kHz from controller => [failsafe];
    /// Share of full speed of every motor.
    actuator_motor: MotorOutput = latest @ 4 kHz from controller => [motors, failsafe, communication];

    // Slow.
    /// The battery's levels.
    battery_state: BatteryState = latest @ 8 Hz from system => [];
    /// Its voltage.
    sensor_power: PowerData = latest @ 8 Hz from system => [failsafe];
    /// The lights.
    lights: Lights = latest @ 8 Hz from system => [lights];
    /// The state in the words of the family, for its services.
    flight_status: FlightStatus = latest @ 50 Hz from communication => [];
    /// The estimate in the words of the family.
    estimate_state: StateEstimate = latest @ 50 Hz from communication => [];
    /// The sticks in the words of the family.
    command_pilot: PilotInput = latest @ 50 Hz from communication => [];
}
