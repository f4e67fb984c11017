//! State of the whole vehicle: mode, alerts, contact with the ground, signals to people.

use crate::{Instant, message, message_enum, message_flags};

message_enum! {
    /// Where the vehicle is between power-on and landing. Failsafe is an event, never a phase.
    pub enum FlightPhase {
        /// Sensors and calibration are starting.
        #[default]
        Init = 0,
        /// Standing on the ground, motors off.
        IdleGround = 1,
        /// Lifted by a hand, motors off.
        IdleHeld = 2,
        /// Standing, motors may turn.
        Armed = 3,
        /// Climbing to the take-off height.
        TakeOff = 4,
        /// In the air under the flight mode.
        Flying = 5,
        /// Descending to the ground.
        Landing = 6,
        /// Turning over once, out of a hover and back into it.
        Flip = 7,
    }
}

message_enum! {
    /// What the sticks mean while flying.
    pub enum FlightMode {
        /// Sticks command rates; throttle commands thrust.
        Acro = 0,
        /// Sticks command angles; throttle commands thrust.
        #[default]
        Stabilize = 1,
        /// Sticks command angles; throttle commands climb rate.
        AltHold = 2,
        /// Sticks command velocities; released, the vehicle holds its place.
        PosHold = 3,
    }
}

impl FlightMode {
    /// Is the pilot's throttle a thrust? In the other modes it is a climb rate, and the vehicle holds its height while the
    /// stick is centred.
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

    /// Do the sticks command rates? In the other modes released sticks level the vehicle.
    #[must_use]
    pub const fn commands_rates(self) -> bool {
        match self {
            Self::Acro => true,
            Self::Stabilize | Self::AltHold | Self::PosHold => false,
        }
    }

    /// Does the vehicle hold its place when the sticks are released?
    #[must_use]
    pub const fn holds_place(self) -> bool {
        match self {
            Self::PosHold => true,
            Self::Acro | Self::Stabilize | Self::AltHold => false,
        }
    }
}

message_flags! {
    /// Why the vehicle will not arm. Empty means it will.
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
    /// Why the vehicle refused to arm when it was last asked to: the first four reasons, the weightiest first.
    pub struct ArmRefusals {
        /// Refusals since power-on.
        attempts: u32,
        /// Every reason.
        blocks: ArmBlocks,
        /// The reasons, one an entry; none in an entry that is not used.
        check: [ArmBlocks; 4],
        /// The value that was found, in the unit of the check; 1 for a condition.
        value: [f32; 4],
        /// The limit it was beyond; 0 for a condition.
        limit: [f32; 4],
        /// Since when.
        since: [Instant; 4],
    }
}

message_flags! {
    /// Why the vehicle will not turn over. Empty means it will.
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
    /// Who has authority over the set-point.
    pub enum CommandSource {
        /// Nobody: level, hold, no climb.
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
    /// The mode machine's decision.
    pub struct FlightStatus {
        /// Where the vehicle is between power-on and landing.
        phase: FlightPhase,
        /// The flight mode, in force while flying.
        mode: FlightMode,
        /// May the motors turn?
        armed: bool,
        /// Who has authority over the armed vehicle, also while silent; none for a disarmed one or one armed by a click.
        commander: CommandSource,
        /// Pairing with a transmitter.
        pairing: bool,
        /// Why arming would be refused right now.
        blocks: ArmBlocks,
        /// Why a flip would be refused right now.
        flip_blocks: FlipBlocks,
        /// Transitions since power-on.
        transitions: u32,
        /// A change of this number resets the controller.
        control_resets: u32,
    }
}

message_flags! {
    /// Conditions the failsafe has found. Level-triggered: a bit stays while its condition does, and the ones that
    /// must not be missed stay until the vehicle is disarmed.
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
    /// How the self test at power-on ended.
    pub enum SelfTestVerdict {
        /// It was not run.
        #[default]
        NotRun = 0,
        /// Every bit as recorded.
        Identical = 1,
        /// Other bits; outputs within the tolerance.
        WithinTolerance = 2,
        /// Outputs beyond the tolerance, or the test could not be run.
        Failed = 3,
    }
}

message! {
    /// What the self test at power-on found.
    pub struct SelfTest {
        /// How it ended.
        verdict: SelfTestVerdict,
        /// Largest deviation of a motor's duty; infinite when one was no number.
        worst: f32,
    }
}

message! {
    /// The failsafe's findings.
    pub struct SystemAlert {
        /// Conditions present now, or latched.
        active: Alerts,
        /// Conditions that became present since power-on, for the log and for people.
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
    /// What the land detector sees, and what take-off and landing ask of the vertical controller.
    pub struct LandDetected {
        /// Contact with the ground.
        contact: GroundContact,
        /// Take-off has reached its height and settled.
        takeoff_complete: bool,
        /// Touchdown is confirmed.
        landed: bool,
        /// Upper limit on collective thrust as a share of hover thrust; `f32::MAX` while unlimited.
        thrust_ceiling: f32,
        /// Descent speed asked for while landing.
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
        /// Something is wrong.
        Error = 7,
    }
}

message! {
    /// What people see and hear.
    pub struct Signal {
        /// Colour of the status light, red, green, blue, 0 to 255.
        status: [u8; 3],
        /// Colour of the two body lights.
        body: [u8; 3],
        /// Tune to start; repeats are edges of `tone_count`.
        tone: Tone,
        /// A change of this number starts the tune.
        tone_count: u32,
    }
}
