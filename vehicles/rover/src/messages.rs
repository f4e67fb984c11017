//! What travels on the rover's topics, in the words of its architecture document.
//!
//! The document's `ActuatorCmd` is three messages here, because a topic has exactly one publisher and its three fields
//! have three. Its `estop` and `system_state` are [`SafetyStatus`]; its log line is [`LogRecord`].

use stampfly_types::{message, message_enum, message_flags};

message_enum! {
    /// Where the driver's input comes from.
    pub enum InputMode {
        /// The operator's throttle, brake and steering.
        #[default]
        Manual = 0,
        /// The built-in scenario.
        Demo = 1,
        /// A recorded log.
        Replay = 2,
    }
}

message_enum! {
    /// State of the safety supervisor, in order of severity.
    pub enum SystemState {
        /// Everything works.
        #[default]
        Normal = 0,
        /// Part of the vehicle has failed: speed and steering are limited, the log continues.
        Degraded = 1,
        /// Outputs are off and the vehicle brakes to a stop.
        EStop = 2,
    }
}

message_flags! {
    /// The components whose heartbeat is supervised.
    pub struct Components {
        /// Engine.
        ENGINE = 0,
        /// Brake.
        BRAKE = 1,
        /// Steering.
        STEERING = 2,
        /// Vehicle dynamics.
        DYNAMICS = 3,
        /// Communication with everything outside the process that must be heard.
        COM = 4,
        /// The 10 ms tick.
        TIME_BASE = 5,
    }
}

message_flags! {
    /// Signals that make no sense.
    pub struct Faults {
        /// Driver input outside its range.
        DRIVER_INPUT = 0,
        /// Drive command outside the engine's range.
        DRIVE = 1,
        /// Brake command outside the brake's range.
        BRAKE = 2,
        /// Steering angle beyond its stop.
        STEERING = 3,
        /// Speed negative, above its limit, or not a number.
        SPEED = 4,
        /// Wheel speed and vehicle speed disagree.
        WHEEL = 5,
        /// Position, yaw or yaw rate is not a number.
        POSE = 6,
    }
}

message! {
    /// What the operator asks for; from outside, through Com.
    pub struct OperatorCommand {
        /// Throttle, 0 to 1.
        throttle: f32,
        /// Brake, 0 to 1.
        brake: f32,
        /// Steering, −1 (right) to 1 (left).
        steer: f32,
        /// Source of the driver's input.
        mode: InputMode,
        /// Emergency stop.
        estop: bool,
        /// Leave Degraded or EStop; acts when it changes from false to true.
        reset: bool,
    }
}

message! {
    /// Asks for the log, live; lapses after [two seconds](crate::com::SUBSCRIPTION).
    pub struct Subscription {
        /// Send every n-th line; 0 ends it.
        every: u32,
    }
}

message! {
    /// The selected and limited input: the document's `DriverInput`.
    pub struct DriverInput {
        /// Throttle, 0 to 1.
        throttle: f32,
        /// Brake, 0 to 1.
        brake: f32,
        /// Steering, −1 (right) to 1 (left).
        steer: f32,
    }
}

message! {
    /// What the engine does.
    pub struct DriveCommand {
        /// Acceleration, not negative.
        acceleration: f32 ["m/s^2"],
    }
}

message! {
    /// What the brake does.
    pub struct BrakeCommand {
        /// Deceleration, not negative.
        deceleration: f32 ["m/s^2"],
    }
}

message! {
    /// Where the front wheels are.
    pub struct SteeringCommand {
        /// Steering angle, left positive.
        angle: f32 ["rad"],
    }
}

message! {
    /// Motion of the vehicle in the plane, in the [frame](crate#frame) of this vehicle.
    pub struct VehicleState {
        /// Time of the state since the start.
        t: f32 ["s"],
        /// Speed, never negative.
        v: f32 ["m/s"],
        /// Position forward of the start.
        x: f32 ["m"],
        /// Position left of the start.
        y: f32 ["m"],
        /// Yaw, counter-clockwise, not wrapped.
        yaw: f32 ["rad"],
        /// Yaw rate.
        yaw_rate: f32 ["rad/s"],
        /// Angular velocity of the wheels, v / r.
        wheel_omega: f32 ["rad/s"],
    }
}

message! {
    /// What the safety supervisor has decided.
    pub struct SafetyStatus {
        /// Is an emergency stop commanded from outside at this moment?
        estop: bool,
        /// The latched state.
        system_state: SystemState,
        /// Components without a heartbeat at this moment.
        stalled: Components,
    }
}

message! {
    /// Com works, and hears every component that is another process.
    pub struct ComStatus {
        /// Those heard since the last time.
        heard: Components,
    }
}

message! {
    /// What the diagnosis has found.
    pub struct DiagStatus {
        /// Faults in this period.
        faults: Faults,
        /// Every fault since the start.
        seen: Faults,
    }
}

message! {
    /// One line of the log: the document's 15 columns, by their names there.
    pub struct LogRecord {
        /// Time of the state since the start.
        t: f32 ["s"],
        /// Throttle, 0 to 1.
        throttle: f32,
        /// Brake, 0 to 1.
        brake: f32,
        /// Steering, −1 to 1.
        steer: f32,
        /// Acceleration of the engine.
        drive_accel_cmd: f32 ["m/s^2"],
        /// Deceleration of the brake.
        brake_decel_cmd: f32 ["m/s^2"],
        /// Steering angle.
        steer_angle_cmd: f32 ["rad"],
        /// Position forward of the start.
        x: f32 ["m"],
        /// Position left of the start.
        y: f32 ["m"],
        /// Yaw, counter-clockwise.
        yaw: f32 ["rad"],
        /// Speed.
        v: f32 ["m/s"],
        /// Yaw rate.
        yaw_rate: f32 ["rad/s"],
        /// Angular velocity of the wheels.
        wheel_omega: f32 ["rad/s"],
        /// Emergency stop commanded from outside.
        estop: bool,
        /// State of the safety supervisor.
        system_state: SystemState,
    }
}

impl DriverInput {
    /// What is driven when there is no input: throttle closed, brake fully on, wheels straight.
    pub const STOP: Self = Self { throttle: 0.0, brake: 1.0, steer: 0.0 };
}

impl LogRecord {
    /// The line that describes these signals.
    #[must_use]
    pub fn new(
        &DriverInput { throttle, brake, steer }: &DriverInput,
        (drive, pedal, wheel): (&DriveCommand, &BrakeCommand, &SteeringCommand),
        &VehicleState { t, v, x, y, yaw, yaw_rate, wheel_omega }: &VehicleState,
        &SafetyStatus { estop, system_state, .. }: &SafetyStatus,
    ) -> Self {
        let [drive_accel_cmd, brake_decel_cmd, steer_angle_cmd] = [drive.acceleration, pedal.deceleration, wheel.angle];
        let motion = Self { t, x, y, yaw, v, yaw_rate, wheel_omega, ..Self::default() };
        let commands = Self { drive_accel_cmd, brake_decel_cmd, steer_angle_cmd, ..motion };
        Self { throttle, brake, steer, estop, system_state, ..commands }
    }

    /// The driver's input of this line.
    #[must_use]
    pub fn driver_input(&self) -> DriverInput {
        DriverInput { throttle: self.throttle, brake: self.brake, steer: self.steer }
    }
}
