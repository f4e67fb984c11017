//! The rover for programs that fly vehicles: `stampfly fly`, `campaign`, `replay` and `serve` with `--vehicle rover`.
//!
//! A drive is a scenario, a CSV log that is driven again, or what other programs ask for over UDP. A seed decides by how much
//! the vehicle differs from its data sheet and how exactly the operator hits the pedals; seed 0 is exact. The dynamics are
//! one of the vehicle's own components, so there is no plant around it.

mod drive;
mod link;

pub use drive::{Around, Drive, Surroundings};

use crate::com::Body;
use crate::messages::{LogRecord, OperatorCommand};
use crate::schedule::TICK;
use crate::{Parameters, Runnables};
use stampfly_link::datagram::Body as _;
use stampfly_log::csv;
use stampfly_log::ulog::{ParameterValue, Topic};
use stampfly_param::ParameterTable;
use stampfly_sim::Noise;
use stampfly_sim::vehicle::{FlightOptions, Live, Options, Scenario, Setting, SetupError, Vehicle};
use stampfly_types::{Duration, Instant};
use std::format;
use std::string::ToString;
use std::vec::Vec;

/// The rover, for programs that fly vehicles.
#[derive(Clone, Copy, Debug)]
pub struct Rover;

/// Who drives.
#[derive(Clone, Debug)]
pub enum Driver {
    /// A scenario.
    Scenario(Scenario<OperatorCommand, LogRecord>),
    /// A recorded log, line by line.
    Replay(Vec<LogRecord>),
    /// Other programs, in real time.
    Live(Live),
}

impl Driver {
    /// A scenario or a CSV log.
    ///
    /// # Errors
    /// Says what is wrong with it.
    pub fn parse(text: &str) -> Result<Self, SetupError> {
        let mut lines = text.lines();
        if !lines.next().is_some_and(csv::is_header::<LogRecord>) {
            return Scenario::parse(text, |command| Body::from(*command).is_valid()).map(Self::Scenario);
        }
        let lines: Result<Vec<LogRecord>, _> = lines.map(csv::read_line).collect();
        lines.map(Self::Replay).map_err(|error| error.to_string())
    }
}

/// All that decides a drive.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The vehicle's parameters at power-on.
    pub parameters: Parameters,
    /// Who drives.
    pub driver: Driver,
    /// Seed of the operator's inexactness; none with 0.
    pub seed: u64,
    /// Seed of the executor's delays.
    pub jitter: Option<u64>,
}

impl Setup {
    /// For how many ticks it is driven.
    fn ticks(&self) -> u64 {
        let limit = match &self.driver {
            Driver::Scenario(scenario) => Duration::from_seconds(scenario.end()),
            Driver::Replay(lines) => return lines.len() as u64,
            Driver::Live(live) => live.limit,
        };
        limit.as_micros() / TICK.as_micros()
    }
}

/// The drive when no other is asked for: every mode, an emergency stop, a reset.
const COURSE: &str = include_str!("../../scenarios/course.txt");
/// Random number streams of vehicle and operator.
const STREAMS: [u64; 2] = [1_100, 1_101];
/// By which share a vehicle differs from its data sheet at most.
const VARIED: [(&str, f64); 5] = [
    ("engine.max_accel", 0.1),
    ("brake.max_decel", 0.1),
    ("steering.max_angle", 0.05),
    ("steering.time_constant", 0.3),
    ("vehicle.wheelbase", 0.02),
];

impl Vehicle for Rover {
    const NAME: &'static str = "rover";
    const BESIDE: &'static [Topic] = &[];
    type Runnables = Runnables;
    type Setup = Setup;
    type Surroundings = Surroundings;
    type Outcome = Drive;

    fn setup(options: &Options, seed: u64) -> Result<Setup, SetupError> {
        let Options { mission, plant, param, vibration, gust, wind, chips, cameras, jitter, live } = options;
        if !plant.is_empty() || vibration.is_some() || gust.is_some() || wind.is_some() || *chips || *cameras {
            return Err("the rover has no plant, vibration, wind, chips or cameras".into());
        }
        let mut parameters = Parameters::default();
        let mut noise = Noise::new(seed, STREAMS[0]);
        for (name, share) in VARIED.into_iter().filter(|_| seed != 0) {
            let row = Parameters::find(name).map_err(|error| error.to_string())?;
            let value = f64::from(row.get(&parameters)) * (1.0 + noise.within(share));
            row.set(&mut parameters, value as f32).map_err(|error| error.to_string())?;
        }
        for text in param {
            let pair = text.split_once('=').and_then(|(name, value)| Some((name.trim(), value.trim().parse().ok()?)));
            let (name, value) = pair.ok_or_else(|| format!("'{text}' is not NAME=VALUE"))?;
            Self::set_parameter(&mut parameters, name, ParameterValue::Float(value))?;
        }
        parameters.validate().map_err(|error| error.to_string())?;
        let named = |error: SetupError| format!("mission {}: {error}", mission.as_deref().unwrap_or("course"));
        let driver = match (live, mission.as_deref()) {
            (Some(live), _) => Driver::Live(live.clone()),
            (None, None | Some("course")) => Driver::parse(COURSE).map_err(named)?,
            (None, Some(path)) => {
                let text = std::fs::read_to_string(path).map_err(|error| named(error.to_string()))?;
                Driver::parse(&text).map_err(named)?
            }
        };
        Ok(Setup { parameters, driver, seed, jitter: *jitter })
    }

    fn options(setup: &Setup) -> FlightOptions {
        // The drive itself says when it is over; an executor may be late.
        let limit = Duration::from_micros(TICK.as_micros() * (setup.ticks() + 1));
        FlightOptions { start: Instant::ZERO, limit, jitter: setup.jitter }
    }

    fn config(setup: &Setup) -> &Parameters {
        &setup.parameters
    }

    fn surroundings(setup: &Setup) -> Surroundings {
        Surroundings::new(setup)
    }

    fn default_config() -> Parameters {
        Parameters::default()
    }

    fn parameters(config: &Parameters) -> Vec<Setting> {
        let settings = Parameters::TABLE.iter().map(|row| Setting {
            name: row.name,
            value: row.get(config).into(),
            unit: row.unit,
            meaning: row.meaning,
        });
        settings.collect()
    }

    fn set_parameter(config: &mut Parameters, name: &str, value: ParameterValue) -> Result<(), SetupError> {
        let ParameterValue::Float(value) = value else { return Err(format!("{name}: not a float")) };
        let outcome = Parameters::find(name).and_then(|row| row.set(config, value));
        outcome.map_err(|error| format!("{name}: {error}"))
    }

    fn plant(_: &Setup) -> Vec<Setting> {
        Vec::new()
    }
}
