//! The StampFly at a console: its status, and its commands beside those of every vehicle.
//!
//! `help` lists them. A motor test lasts [`TEST_TIME`]; gains that `autotune accept` takes are parameters, to be saved.
//!
//! [`stampfly_flight::console::answer`] does the rest, and [`Command::publish`] carries them out.

use crate::messages::{CutoffState, MotorTest, PairingRequest};
use crate::topics::{COUNT, ConsoleEnds, Id, TOPICS};
use crate::{VehicleConfig, schedule};
use core::fmt;
use stampfly_bus::TopicInfo;
use stampfly_control::autotune::AutotuneStatus;
use stampfly_flight::console::calibrate::{self, Calibrate};
use stampfly_flight::console::{CommandError, SensorLine, Vehicle, list, refused};
use stampfly_flight::doctor::Fact;
use stampfly_flight::newest::longest_message;
use stampfly_flight::profile::Rows;
use stampfly_param::Parameters;
use stampfly_types::messages::{ArmRefusals, FlightStatus, PilotInput, PowerData, StateEstimate, SystemAlert};
use stampfly_types::messages::{CalibrationKind, CalibrationReport, CalibrationRequest};
use stampfly_types::{Duration, Instant};

/// How long a motor turns in a test.
pub const TEST_TIME: Duration = Duration::from_secs(2);
/// Largest duty in a test, share: enough to turn without propellers, too little to lift with them.
pub const TEST_DUTY: f32 = 0.3;

/// The newest sample of every topic of this vehicle.
pub type Newest = stampfly_flight::NewestSamples<COUNT, { longest_message(&TOPICS) }>;

/// Execution times of every runnable of this vehicle.
pub type Profile = stampfly_flight::Profile<{ schedule::COUNT }>;

/// A command of this vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Look for a transmitter, or stop looking.
    Pair(bool),
    /// Turn one motor.
    TestMotor {
        /// 1 to 4.
        motor: u8,
        /// Share of the full duty.
        duty: f32,
    },
    /// Stop the motor test.
    StopMotor,
    /// Take the gains that were found as parameters.
    AcceptGains,
    /// Calibrate, or take what was found.
    Calibrate(Calibrate),
    /// Show the vehicle's key: at the USB port alone, which is the firmware's to know.
    ShowKey,
}

impl Command {
    /// A motor test, if the vehicle has this motor and may turn it so fast.
    #[must_use]
    pub fn test(motor: u8, duty: f32) -> Option<Self> {
        ((1..=4).contains(&motor) && (0.0..=TEST_DUTY).contains(&duty)).then_some(Self::TestMotor { motor, duty })
    }

    /// Carries it out, by topic. A test ends [`TEST_TIME`] after `now`.
    pub fn publish(self, now: Instant, ends: &mut ConsoleEnds<'_>) {
        match self {
            Self::Pair(wanted) => {
                ends.pairing_request.publish(now, &PairingRequest { wanted });
            }
            Self::TestMotor { motor, duty } => {
                let until = (now + TEST_TIME).as_micros();
                ends.motor_test.publish(now, &MotorTest { motor: motor.into(), duty, until });
            }
            Self::StopMotor => {
                ends.motor_test.publish(now, &MotorTest::default());
            }
            Self::Calibrate(Calibrate::Begin(kind)) => {
                ends.calibration_request.publish(now, &CalibrationRequest { kind });
            }
            Self::Calibrate(_) | Self::AcceptGains | Self::ShowKey => {}
        }
    }
}

/// What the console knows, borrowed for one answer.
///
/// ```
/// use stampfly_board::console::{Console, Newest, Profile};
/// use stampfly_board::{VehicleConfig, schedule};
/// use stampfly_flight::console::{Request, answer};
/// use stampfly_types::Instant;
///
/// let (newest, profile) = (Newest::new(), Profile::new(&schedule::ACTIVATIONS));
/// let mut config = VehicleConfig::default();
/// let mut console =
///     Console { version: "1.0", newest: &newest, sensors: &[], profile: &profile, facts: &[], config: &mut config };
/// let mut reply = String::new();
/// assert_eq!(answer("param set eskf.gate 3.5", Instant::ZERO, &mut console, &mut reply), Ok(Request::Nothing));
/// assert_eq!(config.eskf.gate, 3.5);
/// ```
pub struct Console<'c> {
    /// Version of the firmware.
    pub version: &'c str,
    /// The newest sample of every topic.
    pub newest: &'c Newest,
    /// Every sensor.
    pub sensors: &'c [SensorLine<'c>],
    /// Execution times.
    pub profile: &'c Profile,
    /// What only the board knows.
    pub facts: &'c [Fact<'c>],
    /// The configuration of the next start. `param set` changes it.
    pub config: &'c mut VehicleConfig,
}

const PAIR: &str = "pair [stop]";
const MOTOR: &str = "motor test N PERCENT | stop";
const AUTOTUNE: &str = "autotune accept";

impl Vehicle for Console<'_> {
    type Command = Command;
    type Request = Command;
    const COMMANDS: &'static [(&'static str, &'static str)] = &[
        ("pair", "look for a transmitter"),
        ("pair stop", "stop looking"),
        ("motor test N PERCENT", "turn motor N (1 front right, 2 rear right, 3 rear left, 4 front left) for 2 s"),
        ("motor stop", "stop it"),
        (AUTOTUNE, "take the gains that were found as parameters"),
        calibrate::COMMAND,
        ("key", "the key for stations, at the USB port"),
    ];
    const TOPICS: &'static [TopicInfo] = &TOPICS;

    fn is_armed(&self) -> Option<bool> {
        self.newest.get::<FlightStatus>(Id::flight_status as usize).map(|(_, mode)| mode.armed)
    }

    fn version(&self) -> &str {
        self.version
    }

    fn status(&self, now: Instant, reply: &mut dyn fmt::Write) -> fmt::Result {
        let newest = self.newest;
        let mode = newest.get::<FlightStatus>(Id::flight_status as usize).map(|(_, mode)| mode).unwrap_or_default();
        let alert = newest.get::<SystemAlert>(Id::system_alert as usize).map(|(_, alert)| alert).unwrap_or_default();
        write!(reply, "state    {}, {}\r\n", mode.phase.name(), if mode.armed { "ARMED" } else { "disarmed" })?;
        write!(reply, "mode     {}\r\n", mode.mode.name())?;
        list(reply, "blocks", mode.blocks.names())?;
        if let Some((at, refusals)) = newest.get::<ArmRefusals>(Id::arm_refusals as usize) {
            refused(reply, now, at, &refusals)?;
        }
        list(reply, "alerts", alert.active.names())?;
        if newest.get::<CutoffState>(Id::cutoff_state as usize).is_some_and(|(_, cutoff)| cutoff.tripped) {
            reply.write_str("motors   CUT OFF, until the vehicle is disarmed\r\n")?;
        }
        if let Some((_, power)) = newest.get::<PowerData>(Id::sensor_power as usize) {
            write!(reply, "battery  {:.2} V, {:.2} A\r\n", power.voltage, power.current)?;
        }
        if let Some((_, estimate)) = newest.get::<StateEstimate>(Id::estimate_state as usize) {
            write!(reply, "height   {:.2} m\r\n", estimate.height)?;
        }
        if let Some((_, tuned)) = newest.get::<AutotuneStatus>(Id::autotune as usize) {
            write!(reply, "autotune {tuned}\r\n")?;
        }
        match newest.get::<PilotInput>(Id::command_pilot as usize) {
            Some((at, _)) => write!(reply, "pilot    heard {} ms ago\r\n", now.since(at).as_millis())?,
            None => reply.write_str("pilot    never heard\r\n")?,
        }
        write!(reply, "awake    {} s\r\n", now.as_micros() / 1_000_000)
    }

    fn newest(&self, topic: usize) -> Option<(Instant, &[u32])> {
        self.newest.words(topic)
    }

    fn sensors(&self) -> &[SensorLine<'_>] {
        self.sensors
    }

    fn profile(&self) -> Rows<'_> {
        self.profile.rows()
    }

    fn facts(&self) -> &[Fact<'_>] {
        self.facts
    }

    fn parameters(&mut self) -> &mut dyn Parameters {
        self.config
    }

    fn parse(words: &[&str]) -> Result<Command, CommandError> {
        match words {
            ["pair"] => Ok(Command::Pair(true)),
            ["pair", "stop"] => Ok(Command::Pair(false)),
            ["pair", ..] => Err(CommandError::Usage(PAIR)),
            ["motor", "test", motor, percent] => {
                let motor = motor.parse().map_err(|_| CommandError::Usage(MOTOR))?;
                let percent = percent.strip_suffix('%').unwrap_or(percent);
                let percent: f32 = percent.parse().map_err(|_| CommandError::Usage(MOTOR))?;
                Ok(Command::TestMotor { motor, duty: percent / 100.0 })
            }
            ["motor", "stop"] => Ok(Command::StopMotor),
            ["motor", ..] => Err(CommandError::Usage(MOTOR)),
            ["autotune", "accept"] => Ok(Command::AcceptGains),
            ["calibrate", of @ ..] => calibrate::parse(of).map(Command::Calibrate),
            ["key"] => Ok(Command::ShowKey),
            ["autotune", ..] => Err(CommandError::Usage(AUTOTUNE)),
            _ => Err(CommandError::Unknown),
        }
    }

    fn answer(
        &mut self,
        command: Command,
        _: Instant,
        reply: &mut dyn fmt::Write,
    ) -> Result<Option<Command>, fmt::Error> {
        if let Command::TestMotor { motor, duty } = command {
            if !(1..=4).contains(&motor) {
                return write!(reply, "there is no such motor\r\n").map(|()| None);
            }
            if !(0.0..=TEST_DUTY).contains(&duty) {
                return write!(reply, "from 0 to {} per cent\r\n", TEST_DUTY * 100.0).map(|()| None);
            }
        }
        if command == Command::AcceptGains {
            let tuned = self.newest.get::<AutotuneStatus>(Id::autotune as usize).map(|(_, tuned)| tuned);
            let landed = self.is_armed() == Some(false);
            let taken = landed && tuned.is_some_and(|tuned| tuned.accept(&mut self.config.cascade.rate));
            return reply.write_str(if taken { "taken\r\n" } else { "nothing found, or armed\r\n" }).map(|()| None);
        }
        if let Command::Calibrate(asked) = command {
            let found = self.newest.get::<CalibrationReport>(Id::calibration_report as usize).unwrap_or_default().1;
            let (is_disarmed, corrections) = (self.is_armed() == Some(false), &mut self.config.corrections);
            let goes_on = calibrate::answer(asked, is_disarmed, &found, |report| corrections.accept(report), reply)?;
            return Ok(goes_on.then_some(command));
        }
        Ok(Some(command))
    }

    fn needs_disarmed(request: &Command) -> bool {
        !matches!(request, Command::StopMotor | Command::Calibrate(Calibrate::Begin(CalibrationKind::None)))
    }

    fn is_save(request: &Command) -> bool {
        *request == Command::Calibrate(Calibrate::Accept)
    }
}
