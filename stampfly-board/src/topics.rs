//! Who publishes what for whom: the vehicle's topics, one line each.
//!
//! The first twelve are document 000's, at its rates; barometer and battery monitor at what their chips give. The log
//! reads every topic through its tap and is not named.
//! `docs/reference/topics.md` and `stampfly topics` are printed from this table.

use crate::messages::*;
use stampfly_control::autotune::AutotuneStatus;
use stampfly_types::messages::*;

stampfly_bus::topics! {
    outside imu, tof, tof_front, flow, mag, baro, cameras, power, self_test, link, button_pin, motors, indicator, console, storage, cutoff, supervisor;

    // Sensing.
    /// Inertial sample, body FRD, specific force; every sample.
    sensor_imu: ImuData = ring(16) @ 400 Hz from imu => [estimation, monitor, failsafe, calibration];
    /// Range to the ground.
    sensor_tof: TofData = ring(8) @ 30 Hz from tof => [estimation, monitor, failsafe];
    /// Range ahead. Reserved: nothing reads it yet.
    sensor_tof_front: TofData = ring(8) @ 30 Hz from tof_front => [];
    /// Optical flow since the previous sample.
    sensor_flow: FlowData = ring(16) @ 100 Hz from flow => [estimation, monitor, failsafe];
    /// Magnetic field.
    sensor_mag: MagData = ring(8) @ 25 Hz from mag => [estimation, calibration];
    /// Air pressure.
    sensor_baro: BaroData = ring(8) @ 25 Hz from baro => [estimation, monitor, failsafe, calibration];
    /// Where cameras see the vehicle.
    external_pose: ExternalPose = ring(8) @ 100 Hz from cameras => [estimation];
    /// Battery.
    sensor_power: PowerData = latest @ 14 Hz from power => [failsafe, actuation, telemetry];

    /// What the self test at power-on found.
    self_test: SelfTest = latest @ on event from self_test => [failsafe];

    // Commands.
    /// Frames from the pilot's transmitter.
    command_pilot: PilotInput = ring(8) @ 50 Hz from link => [command, failsafe, mode];
    /// Commands from programs; none may be lost. Read in the flight band alone: a slow reader would keep a kill out.
    command_guided: GuidedCommand = queue(16) @ on event from link => [failsafe, mode, navigation];
    /// The button's pin.
    button_contact: ButtonContact = latest @ 50 Hz from button_pin => [button];
    /// What the button meant.
    button_event: ButtonEvent = ring(4) @ on event from button => [mode];
    /// The arbitrated sticks.
    command_setpoint: CommandSetpoint = latest @ 50 Hz from command => [failsafe, mode, navigation, control];

    // Estimation.
    /// What the still-calibration has found so far.
    calibration: CalibrationResult = latest @ 50 Hz from calibration => [estimation, mode];
    /// Attitude, velocity, position, and which of them may be used.
    estimate_state: StateEstimate = latest @ 400 Hz from estimation => [monitor, failsafe, mode, landing, navigation, control, telemetry];
    /// How each sensor agreed with the estimate.
    estimate_status: EstimatorStatus = latest @ 400 Hz from estimation => [monitor, failsafe];
    /// What the mode machine asks of the estimator.
    estimator_command: EstimatorCommand = latest @ on event from mode => [estimation, monitor];
    /// Which sensor measures, and what is wrong with one that does not.
    findings: SensorFindings = latest @ on event from monitor => [estimation, failsafe];
    /// A correction of the estimate, after a sensor misled it.
    estimate_correction: EstimateCorrection = latest @ on event from monitor => [estimation];

    // Decisions.
    /// Conditions the failsafe has found.
    system_alert: SystemAlert = latest @ 400 Hz from failsafe => [monitor, landing, mode, command, control, notification, telemetry];
    /// State, mode, armed.
    flight_status: FlightStatus = latest @ 400 Hz from mode => [failsafe, landing, command, navigation, control, actuation, calibration, notification, telemetry, link];
    /// Why the vehicle did not arm when it was asked to; for people.
    arm_refusals: ArmRefusals = latest @ on event from mode => [link];
    /// Contact with the ground, and what take-off and landing ask for.
    land_detected: LandDetected = latest @ 400 Hz from landing => [mode, navigation, control];

    // Control.
    /// The point on the path where the vehicle should be now.
    setpoint: Setpoint = latest @ 400 Hz from navigation => [landing, control, telemetry];
    /// Thrust and torque.
    control_output: ControlOutput = latest @ 400 Hz from control => [failsafe, landing, actuation];
    /// Duty of every motor.
    actuator_motor: MotorOutput = latest @ 400 Hz from actuation => [failsafe, landing, control, motors];

    // People.
    /// Lights and sound.
    signal: Signal = latest @ 30 Hz from notification => [indicator];
    /// What the ground station sees.
    telemetry: TelemetryFrame = latest @ 50 Hz from telemetry => [link];

    // The board. Published when something changes.
    /// One motor to turn on the disarmed vehicle.
    motor_test: MotorTest = latest @ on event from console => [actuation];
    /// Is flash being written?
    storage_busy: StorageBusy = latest @ on event from storage => [actuation];
    /// Pairing, as the console asks for it.
    pairing_request: PairingRequest = latest @ on event from console => [mode];
    /// The transmitter that the vehicle was paired with.
    link_peer: LinkPeer = latest @ on event from link => [storage];
    /// The button asks for a restart.
    restart_request: RestartRequest = latest @ on event from mode => [supervisor];
    /// Has the cut-off stopped the motors?
    cutoff_state: CutoffState = latest @ on event from cutoff => [mode];
    /// What tuning a rate loop has found.
    autotune: AutotuneStatus = latest @ on event from control => [];
    /// A parameter was changed.
    parameter_change: ParameterChange = ring(4) @ on event from console => [];
    /// A calibration that somebody asks for.
    calibration_request: CalibrationRequest = ring(2) @ on event from console => [calibration];
    /// How far it is, and what was found.
    calibration_report: CalibrationReport = ring(2) @ on event from calibration => [];
}
