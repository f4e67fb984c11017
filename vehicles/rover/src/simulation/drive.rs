//! One drive: a scenario, a CSV log that is driven again, or what other programs ask for, and what is said of it in the end.

use super::{Rover, link::UdpLink};
use crate::com::{Body, SUBSCRIPTION};
use crate::messages::{InputMode, LogRecord, OperatorCommand, SystemState};
use crate::schedule::TICK;
use crate::topics::{Id, LinkEnds, Outside};
use crate::{Parameters, Runnables};
use stampfly_link::{Peers, datagram::Body as _};
use stampfly_log::csv;
use stampfly_sim::Noise;
use stampfly_sim::time::{Clock, Tasks};
use stampfly_sim::vehicle::{Figure, Live, Scenario, Script, Scripted, SetupError, Vehicle, Verdict, fly};
use stampfly_types::Duration;
use std::prelude::v1::*;

/// The drive when no other is asked for: every mode, an emergency stop, a reset.
const COURSE: &str = include_str!("../../scenarios/course.txt");
/// The operator's period.
const OPERATOR: Duration = Duration::from_millis(20);
/// Standard deviation of the operator's pedals and wheel, relative, so that what is released stays released.
const INEXACTNESS: f32 = 0.02;
/// Random number stream of the operator.
const STREAM: u64 = 1_101;
/// Lines of the log. The emergency stop takes 0.3 s from the highest speed; then the vehicle stands.
const STOPPED_AFTER: usize = 31;

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
    /// The driver of this file, a scenario or a CSV log, or of the built-in scenario `course`.
    ///
    /// # Errors
    /// Says what is wrong with it.
    pub fn named(name: &str) -> Result<Self, SetupError> {
        let text = if name == "course" { Ok(COURSE.into()) } else { std::fs::read_to_string(name) };
        let parse = |text: String| match csv::read(&text) {
            Some(lines) => lines.collect::<Result<_, _>>().map(Self::Replay).map_err(|error| error.to_string()),
            None => Scenario::parse(&text, |command| Body::from(*command).is_valid()).map(Self::Scenario),
        };
        text.map_err(|error| error.to_string()).and_then(parse).map_err(|error| format!("mission {name}: {error}"))
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

impl Script for Setup {
    type Runnables = Runnables;
    type Line = LogRecord;
    type Outcome = Drive;
    const LOG: usize = Id::log_record as usize;

    fn start<'a>(&'a self, clock: &Clock, tasks: &mut Tasks<'a>, Outside { link }: Outside<'a>) {
        let clock = clock.clone();
        match &self.driver {
            Driver::Scenario(scenario) => tasks.spawn(operate(clock, scenario, self.seed, link)),
            Driver::Replay(lines) => tasks.spawn(replay(clock, lines, link)),
            Driver::Live(live) => {
                tasks.spawn(live.serve(clock, TICK, UdpLink { peers: Peers::new(SUBSCRIPTION), ends: link }))
            }
        }
    }

    fn length(&self) -> usize {
        let limit = match &self.driver {
            Driver::Scenario(scenario) => Duration::from_seconds(scenario.end()),
            Driver::Replay(lines) => return lines.len(),
            Driver::Live(live) => live.limit,
        };
        (limit.as_micros() / TICK.as_micros()) as usize
    }

    fn is_ended(&self) -> bool {
        matches!(&self.driver, Driver::Live(live) if live.ports.are_closed())
    }

    fn judge(&self, lines: Vec<LogRecord>) -> Drive {
        let mut stopping = 0;
        let stops = lines.iter().all(|line| {
            stopping = if line.system_state == SystemState::EStop { stopping + 1 } else { 0 };
            stopping == 0 || line.drive_accel_cmd == 0.0 && (stopping <= STOPPED_AFTER || line.v == 0.0)
        });
        let mut drive = Drive { facts: vec![("logged", !lines.is_empty()), ("stops", stops)], failures: vec![], lines };
        // Other programs may change limits, or die.
        if let Driver::Scenario(scenario) = &self.driver {
            let allowed = 0.0..=self.parameters.vehicle.max_speed;
            drive.facts.push(("speed_kept", drive.lines.iter().all(|line| allowed.contains(&line.v))));
            drive.facts.push(("healthy", drive.lines.iter().all(|line| line.system_state != SystemState::Degraded)));
            drive.failures = scenario.failures(drive.lines.iter().map(|line| (line.t, *line)));
            drive.facts.push(("checks", drive.failures.is_empty()));
            let setup = Self { driver: Driver::Replay(drive.lines.clone()), ..self.clone() };
            let (options, mut around) = (Rover::options(&setup), Scripted::new(&setup));
            let again = fly::<Runnables, _>(&setup.parameters, &options, &mut around, &mut (), &mut |_, _| {});
            drive.facts.push(("reproduced", again.outcome.csv() == drive.csv()));
        }
        drive
    }
}

/// Com in this process: what the scenario asks for, as exactly as an operator does it.
async fn operate(clock: Clock, scenario: &Scenario<OperatorCommand, LogRecord>, seed: u64, mut link: LinkEnds<'_>) {
    let mut noise = Noise::new(seed, STREAM);
    let share = if seed == 0 { 0.0 } else { INEXACTNESS };
    let mut done = |asked: f32| (asked * (1.0 + share * noise.normal() as f32)).clamp(-1.0, 1.0);
    loop {
        let now = clock.now();
        let asked = scenario.command(now.seconds_f64() as f32);
        let (throttle, brake, steer) = (done(asked.throttle), done(asked.brake), done(asked.steer));
        link.operator_command.publish(now, &OperatorCommand { throttle, brake, steer, ..asked });
        clock.sleep_until(now + OPERATOR).await;
    }
}

/// Com in this process: one line of a log a tick.
async fn replay(clock: Clock, lines: &[LogRecord], mut link: LinkEnds<'_>) {
    link.operator_command.publish(clock.now(), &OperatorCommand { mode: InputMode::Replay, ..Default::default() });
    for line in lines {
        clock.sleep_until(clock.now() + TICK).await;
        link.replay_record.publish(clock.now(), line);
    }
}

/// How a drive went.
#[derive(Clone, Debug)]
pub struct Drive {
    /// The log.
    pub lines: Vec<LogRecord>,
    /// Checks of the scenario that did not hold.
    pub failures: Vec<String>,
    /// By name, what must hold in every drive.
    pub facts: Vec<(&'static str, bool)>,
}

impl Drive {
    /// The log as CSV.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = String::new();
        // A string takes everything.
        let _ = csv::write(&self.lines, &mut text);
        text
    }
}

impl Verdict for Drive {
    fn facts(&self) -> Vec<(&'static str, bool)> {
        self.facts.clone()
    }

    fn figures(&self) -> Vec<Figure> {
        let figure = |name, unit, value: f32| Figure { name, unit, value: Some(value.into()) };
        vec![
            figure("top_speed_m_s", "m/s", self.lines.iter().fold(0.0, |top, line| line.v.max(top))),
            figure("distance_m", "m", self.lines.iter().map(|line| line.v * TICK.seconds()).sum()),
        ]
    }

    fn story(&self) -> Vec<String> {
        let mut last = None;
        let changes = self.lines.iter().filter(|line| last.replace(line.system_state) != Some(line.system_state));
        changes.map(|line| format!("{:>9.3} s  {}", line.t, line.system_state.name())).collect()
    }

    fn sentence(&self) -> String {
        let broken = self.facts.iter().filter(|(_, holds)| !holds).map(|(name, _)| *name);
        let broken: Vec<&str> = broken.chain(self.failures.iter().map(String::as_str)).collect();
        if broken.is_empty() { "driven as asked".into() } else { format!("FAILED: {}", broken.join(", ")) }
    }

    fn files(&self) -> Vec<(&'static str, String)> {
        vec![("flight.csv", self.csv())]
    }
}
