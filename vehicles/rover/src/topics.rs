//! Who publishes what for whom: the runtime environment's global signal buffer, one line a signal.
//!
//! Everything from outside comes through Com's `link`, whether it was sent in this process or over UDP.

use crate::Parameters;
use crate::messages::*;
use stampfly_param::{ParameterRequest, ParameterStatus};

stampfly_bus::topics! {
    outside link;

    // From outside, through Com.
    /// What the operator asks for.
    operator_command: OperatorCommand = latest @ 50 Hz from link => [safety_supervisor, driver_input];
    /// In a replay: the log's line of this period.
    replay_record: LogRecord = latest @ 100 Hz from link => [safety_supervisor, driver_input];
    /// What the engine does that is another process.
    remote_drive: DriveCommand = latest @ 100 Hz from link => [engine, com];
    /// Changes of parameters.
    parameter_request: ParameterRequest = queue(32) @ on event from link => [nvm];

    // Parameters and safety.
    /// The parameters in use; published when they change.
    parameters: Parameters = latest @ on event from nvm => [safety_supervisor, driver_input, engine, brake, steering, vehicle_dynamics, diag];
    /// Which ones they are, and what was refused.
    parameter_status: ParameterStatus = latest @ on event from nvm => [link];
    /// Com's heartbeat.
    com_status: ComStatus = latest @ 50 Hz from com => [safety_supervisor];
    /// The supervisor's decision.
    safety_status: SafetyStatus = latest @ 50 Hz from safety_supervisor => [driver_input, engine, brake, steering, vehicle_dynamics, logging, link];

    // The vehicle, in the order of the tick.
    /// The selected and limited input. Its first signal, so the time base's heartbeat, too.
    driver_input: DriverInput = latest @ 100 Hz from driver_input => [safety_supervisor, engine, brake, steering, logging, diag, link];
    /// What the engine does.
    drive_command: DriveCommand = latest @ 100 Hz from engine => [safety_supervisor, vehicle_dynamics, logging, diag];
    /// What the brake does.
    brake_command: BrakeCommand = latest @ 100 Hz from brake => [safety_supervisor, vehicle_dynamics, logging, diag];
    /// Where the wheels are.
    steering_command: SteeringCommand = latest @ 100 Hz from steering => [safety_supervisor, vehicle_dynamics, logging, diag];
    /// Motion.
    vehicle_state: VehicleState = latest @ 100 Hz from vehicle_dynamics => [safety_supervisor, driver_input, logging, diag];
    /// The log, line by line.
    log_record: LogRecord = ring(16) @ 100 Hz from logging => [link];
    /// What the diagnosis found; as deep as the supervisor's period is long.
    diag_status: DiagStatus = ring(16) @ 100 Hz from diag => [safety_supervisor, nvm];
}
