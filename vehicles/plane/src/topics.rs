//! Who publishes what for whom.

use crate::Parameters;
use stampfly_fixed_wing::messages::*;
use stampfly_param::{ParameterRequest, ParameterStatus};
use stampfly_types::messages::*;

stampfly_bus::topics! {
    outside imu, mag, baro, gnss, pitot, battery, motor, servos, link;

    // From outside: sensors, and programs at the other end of the link.
    /// Inertial sample, body FRD.
    sensor_imu: ImuData = ring(16) @ 400 Hz from imu => [estimation, failsafe];
    /// Magnetic field, body FRD, the aircraft's own iron in it.
    sensor_mag: MagData = ring(4) @ 25 Hz from mag => [estimation];
    /// Air pressure.
    sensor_baro: BaroData = ring(4) @ 13 Hz from baro => [estimation];
    /// Fixes of the satellite receiver.
    sensor_gnss: GnssData = ring(4) @ 10 Hz from gnss => [estimation];
    /// Pitot tube.
    sensor_airspeed: AirspeedData = ring(16) @ 100 Hz from pitot => [estimation];
    /// Battery.
    sensor_power: PowerData = latest @ 10 Hz from battery => [failsafe, watch];
    /// Commands, and signs of life.
    command_guided: GuidedCommand = queue(32) @ on event from link => [path];
    /// Changes of the way-points.
    way_point_edit: WayPointEdit = queue(16) @ on event from link => [path];
    /// Changes of parameters.
    parameter_request: ParameterRequest = queue(32) @ on event from link => [storage];

    // Parameters.
    /// The parameters in use; published when they change.
    parameters: Parameters = latest @ on event from storage => [failsafe, watch, path, control, link];
    /// Which ones they are, and what was refused.
    parameter_status: ParameterStatus = latest @ on event from storage => [link];

    // Where it is.
    /// The estimate.
    estimate_state: StateEstimate = latest @ 400 Hz from estimation => [failsafe, watch, path, control];
    /// How the estimator gets on with its sensors.
    estimate_status: EstimatorStatus = latest @ 400 Hz from estimation => [failsafe];
    /// Airspeed and wind.
    air: AirState = latest @ 400 Hz from estimation => [watch, path, control];
    /// Heights that nothing has estimated.
    measured_heights: MeasuredHeights = latest @ 18 Hz from estimation => [watch];
    /// Where the local frame begins.
    home: Home = latest @ on event from estimation => [path, link];

    // What it does.
    /// What shows in inertial samples, and other alerts in the words of the family.
    system_alert: SystemAlert = latest @ 400 Hz from failsafe => [watch, control];
    /// What is wrong.
    safety: Safety = latest @ 50 Hz from watch => [path];
    /// What the autopilot is to do.
    demand: Demand = latest @ 50 Hz from path => [control];
    /// Mode, stage, way-points.
    path_status: PathStatus = latest @ 50 Hz from path => [failsafe, watch];
    /// The state in the words of the family.
    flight_status: FlightStatus = latest @ 50 Hz from path => [estimation, failsafe, watch, control, storage];
    /// The propeller.
    actuator_motor: MotorOutput = latest @ 400 Hz from control => [motor];
    /// The surfaces.
    actuator_servo: ServoOutput = latest @ 400 Hz from control => [servos];
}
