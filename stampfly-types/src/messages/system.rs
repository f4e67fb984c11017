//! State of the vehicle: phase, mode, alerts, ground contact, signals to people.

use crate::{Instant, message, message_enum, message_flags};

message_enum! {
    /// Phase of a flight. Failsafe is an event, not a phase.
    pub enum FlightPhase {
        /// Sensors start and the calibration at rest runs.
        #[default]
        Init = 0,
        /// Standing on the ground, motors off.
        IdleGround = 1,
        /// Held in the hand, motors off.
        IdleHeld = 2,
        /// Standing, motors may turn.
        Armed = 3,
        /// Climbing to the take-off height.
        TakeOff = 4,
        /// Flying in the flight mode.
        Flying = 5,
        /// Descending to the ground.
        Landing = 6,
        /// Flipping once, from a hover back to a hover.
        Flip = 7,
    }
}

message_enum! {
    /// Meaning of the sticks in flight.
    pub enum FlightMode {
        /// Sticks command rates; throttle commands thrust.
        Acro = 0,
        /// Sticks command angles; throttle commands thrust.
        #[default]
        Stabilize = 1,
        /// Sticks command angles; throttle commands climb rate.
        AltHold = 2,
        /// Sticks command velocities; with centred sticks the vehicle holds its position.
        PosHold = 3,
    }
}

impl FlightMode {
    /// Whether the throttle stick commands thrust. In the other modes it commands a climb rate, and
    /// the vehicle holds its height while the stick is centred.
    ///
    /// ```
    /// use stampfly_types::messages::FlightMode;
    /// assert!(FlightMode::Acro.is_manual() && FlightMode::Stabilize.is_manual());
    /// assert!(!FlightMode::AltHold.is_manual() && !FlightMode::PosHold.is_manual());
    /// ```
    #[must_use]
    pub const fn is_manual(self) -> bool {
        match self {
            Self::Acro | Self::Stabilize => true,
            Self::AltHold | Self::PosHold => false,
        }
    }

    /// Whether the sticks command rates. In the other modes centred sticks level the vehicle.
    #[must_use]
    pub const fn commands_rates(self) -> bool {
        match self {
            Self::Acro => true,
            Self::Stabilize | Self::AltHold | Self::PosHold => false,
        }
    }

    /// Whether the vehicle holds its position when the sticks are centred.
    #[must_use]
    pub const fn holds_place(self) -> bool {
        match self {
            Self::PosHold => true,
            Self::Acro | Self::Stabilize | Self::AltHold => false,
        }
    }
}

message_flags! {
    /// Reasons for which the vehicle refuses to arm. Empty when it would arm.
    pub struct ArmBlocks {
        /// Still-calibration has not finished.
        CALIBRATING = 0,
        /// Not standing on the ground.
        NOT_ON_GROUND = 1,
        /// Powered from USB or no battery.
        NO_BATTERY = 2,
        /// Battery is low.
        LOW_BATTERY = 3,
        /// Attitude is unknown or disagrees with gravity.
        ATTITUDE = 4,
        /// The inertial sensor or the battery monitor is silent.
        SENSOR = 5,
        /// The estimate is lost.
        ESTIMATE = 6,
        /// Pairing with a transmitter.
        PAIRING = 7,
        /// Tilted too far to take off.
        TILTED = 8,
        /// The throttle is not at rest in a mode where it commands thrust.
        THROTTLE = 9,
        /// The arm switch was on before the vehicle saw it off.
        ARM_SWITCH = 10,
        /// The vehicle crashed, or its motors were stopped in the air, and this was not acknowledged.
        CRASHED = 11,
        /// The self test at power-on failed.
        SELF_TEST = 12,
        /// Neither a pilot nor a program is heard.
        NO_LINK = 13,
        /// The mode holds height, and the range finder gives no usable range.
        NO_RANGE = 14,
        /// The mode holds the place, and the flow sensor gives no usable flow.
        NO_FLOW = 15,
        /// The mode holds height, and the barometer is silent.
        NO_BARO = 16,
        /// The cut-off has stopped the motors, and this was not acknowledged.
        CUT_OFF = 17,
        /// The pilot's kill switch is on.
        KILL = 18,
        /// A motor turns that should stand.
        MOTOR = 19,
    }
}

message! {
    /// The latest refusal to arm: the first four reasons, in order of importance.
    pub struct ArmRefusals {
        /// Number of refusals since power-on.
        attempts: u32,
        /// All reasons.
        blocks: ArmBlocks,
        /// One reason per entry; empty in unused entries.
        check: [ArmBlocks; 4],
        /// The value found by the check, in the unit of the check; 1 for a condition.
        value: [f32; 4],
        /// The limit that the value violates; 0 for a condition.
        limit: [f32; 4],
        /// Time since which the reason has existed.
        since: [Instant; 4],
    }
}

message_flags! {
    /// Reasons for which the vehicle refuses to flip. Empty when it would flip.
    pub struct FlipBlocks {
        /// It does not fly.
        NOT_FLYING = 0,
        /// No program flies it, or in a mode whose throttle is thrust.
        NOT_LED = 1,
        /// Tilt, height or climb rate are unknown.
        ESTIMATE = 2,
        /// Too low to brake the fall.
        LOW = 3,
        /// Too near to the largest height that it may fly at.
        NO_ROOM = 4,
        /// It leans, turns, climbs or sinks.
        UNSTEADY = 5,
        /// Battery low, link lost, or something wrong with what it would need.
        ALERT = 6,
    }
}

message_enum! {
    /// Source of the command in force.
    pub enum CommandSource {
        /// No source: level, no climb, position held.
        #[default]
        None = 0,
        /// The pilot's sticks.
        Pilot = 1,
        /// Guided commands.
        Guided = 2,
        /// The failsafe.
        Failsafe = 3,
    }
}

message! {
    /// Output of the mode machine.
    pub struct FlightStatus {
        /// Phase of the flight.
        phase: FlightPhase,
        /// Flight mode, in force while flying.
        mode: FlightMode,
        /// Whether the motors may turn.
        armed: bool,
        /// Source in command of the armed vehicle, also while it sends nothing. None for a vehicle
        /// that is disarmed or was armed with the button.
        commander: CommandSource,
        /// Pairing with a transmitter.
        pairing: bool,
        /// Reasons for which arming would be refused now.
        blocks: ArmBlocks,
        /// Reasons for which a flip would be refused now.
        flip_blocks: FlipBlocks,
        /// Number of transitions since power-on.
        transitions: u32,
        /// A change of this number resets the controller.
        control_resets: u32,
    }
}

message_flags! {
    /// Conditions detected by the failsafe. Level-triggered: a bit is set while its condition
    /// lasts. The critical ones stay set until the vehicle is disarmed.
    pub struct Alerts {
        /// No authentic command for too long, or never one.
        COMM_LOST = 0,
        /// A blow that does not come from above: it has crashed.
        IMPACT = 1,
        /// Battery at the warning level.
        LOW_BATTERY = 2,
        /// Battery at the level where the vehicle must land.
        CRITICAL_BATTERY = 3,
        /// Powered from USB, or no battery.
        USB_POWER = 4,
        /// The estimate is lost.
        ESTIMATE_DIVERGED = 5,
        /// Angular rate beyond the limit.
        GYRO_ANOMALY = 6,
        /// No inertial sample for 10 ms.
        IMU_DEGRADED = 7,
        /// No inertial sample for 50 ms: motors off.
        IMU_LOST = 8,
        /// Upside down or tumbling.
        TUMBLED = 9,
        /// No usable range from the ground.
        TOF_LOST = 10,
        /// No usable optical flow.
        FLOW_LOST = 11,
        /// The estimated tilt disagrees with gravity while standing.
        TILT_MISMATCH = 12,
        /// The self test at power-on failed: this machine computes something else.
        SELF_TEST_FAILED = 13,
        /// The self test gave other bits than recorded, within its tolerance.
        SELF_TEST_DIFFERS = 14,
        /// No sample from the battery monitor.
        POWER_LOST = 15,
        /// The inertial sensor delivers samples that no sensor which measures delivers: motors off.
        IMU_FAULTY = 16,
        /// The range contradicts the accelerometer or the barometer.
        RANGE_IMPLAUSIBLE = 17,
        /// The optical flow contradicts the accelerometer.
        FLOW_IMPLAUSIBLE = 18,
        /// The battery voltage changes as no battery's does.
        POWER_IMPLAUSIBLE = 19,
        /// No air pressure.
        BARO_LOST = 20,
        /// One motor pushes much less than the others.
        MOTOR_WEAK = 21,
        /// Many inertial samples are garbage, too few for [`IMU_FAULTY`](Self::IMU_FAULTY).
        IMU_NOISY = 22,
        /// One motor does not do what it is told, and the others cannot make up for it: motors off.
        MOTOR_LOST = 23,
        /// A motor turns although the vehicle is disarmed.
        MOTOR_RUNS = 24,
        /// The thrust that is asked for does not lift the vehicle off the ground: motors off.
        NO_LIFT = 25,
        /// The specific force is not what thrust and drag make.
        FORCE_IMPLAUSIBLE = 26,
        /// The accelerometer does not measure, and the gyro does: the vehicle lands.
        ACCEL_FAULTY = 27,
        /// It was struck from above, and lands.
        STRUCK = 28,
    }
}

message_enum! {
    /// Result of the self test at power-on.
    pub enum SelfTestVerdict {
        /// The test did not run.
        #[default]
        NotRun = 0,
        /// All bits equal those recorded.
        Identical = 1,
        /// Some bits differ; the outputs are within the tolerance.
        WithinTolerance = 2,
        /// Outputs exceed the tolerance, or the test could not run.
        Failed = 3,
    }
}

message! {
    /// Report of the self test at power-on.
    pub struct SelfTest {
        /// Result of the test.
        verdict: SelfTestVerdict,
        /// Largest deviation of a motor's duty; infinite when one was NaN.
        worst: f32,
    }
}

message! {
    /// Alerts of the failsafe.
    pub struct SystemAlert {
        /// Conditions that exist now or are latched.
        active: Alerts,
        /// All conditions since power-on, for the log and for operators.
        seen: Alerts,
    }
}

message_enum! {
    /// Contact with the ground.
    pub enum GroundContact {
        /// Standing.
        #[default]
        Ground = 0,
        /// Not standing.
        Air = 1,
    }
}

message! {
    /// Output of the land detector, and its requests to the vertical controller.
    pub struct LandDetected {
        /// Contact with the ground.
        contact: GroundContact,
        /// Whether take-off has reached its height and settled.
        takeoff_complete: bool,
        /// Whether touchdown is confirmed.
        landed: bool,
        /// Upper limit of collective thrust as a share of hover thrust; `f32::MAX` without a limit.
        thrust_ceiling: f32,
        /// Commanded descent speed during landing.
        descent_rate: f32 ["m/s"],
    }
}

message_enum! {
    /// A short tune.
    pub enum Tone {
        /// Silence.
        #[default]
        None = 0,
        /// Power-on.
        Start = 1,
        /// Ready to arm.
        Ready = 2,
        /// Armed.
        Arm = 3,
        /// Disarmed.
        Disarm = 4,
        /// Pairing.
        Pair = 5,
        /// Low battery.
        LowBattery = 6,
        /// An error.
        Error = 7,
    }
}

message! {
    /// Lights and sounds for people nearby.
    pub struct Signal {
        /// Colour of the status light, red, green, blue, 0 to 255.
        status: [u8; 3],
        /// Colour of the two body lights, red, green, blue, 0 to 255.
        body: [u8; 3],
        /// Tune to play. It starts when `tone_count` changes.
        tone: Tone,
        /// Counter whose change starts the tune.
        tone_count: u32,
    }
}
