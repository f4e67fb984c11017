//! One drive: who drives the vehicle, and what is said of it in the end.

use super::{Driver, Rover, STREAMS, Setup, link};
use crate::Runnables;
use crate::messages::{InputMode, LogRecord, OperatorCommand, SystemState};
use crate::schedule::TICK;
use crate::topics::{Id, LinkEnds, Outside};
use stampfly_log::csv;
use stampfly_sim::Noise;
use stampfly_sim::time::{Clock, Tasks};
use stampfly_sim::vehicle::{self, Figure, Scenario, Vehicle, Verdict, fly};
use stampfly_types::{Duration, Instant, Message};
use std::string::String;
use std::vec::Vec;
use std::{format, vec};

/// The operator's period.
const OPERATOR: Duration = Duration::from_millis(20);
/// Relative standard deviation of the operator's pedals and wheel from what is asked for.
const INEXACTNESS: f64 = 0.02;
/// Lines of the log. The emergency stop takes 0.3 s from the highest speed; then the vehicle stands.
const STOPPED_AFTER: usize = 31;

/// How a drive went.
#[derive(Clone, Debug, Default)]
pub struct Drive {
    /// The log.
    pub lines: Vec<LogRecord>,
    /// Checks of the scenario that did not hold.
    pub failures: Vec<String>,
    /// By name, what must hold in every drive.
    facts: Vec<(&'static str, bool)>,
}

impl Drive {
    /// The log as CSV.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = String::new();
        // A string takes everything.
        let _ = csv::write_header::<LogRecord>(&mut text);
        self.lines.iter().for_each(|line| _ = csv::write_line(line, &mut text));
        text
    }

    /// Does the vehicle stop whenever it is told to, and the engine rest?
    fn stops(&self) -> bool {
        let mut stopping = 0;
        self.lines.iter().all(|line| {
            stopping = if line.system_state == SystemState::EStop { stopping + 1 } else { 0 };
            stopping == 0 || line.drive_accel_cmd == 0.0 && (stopping <= STOPPED_AFTER || line.v == 0.0)
        })
    }
}

impl Verdict for Drive {
    fn succeeded(&self) -> bool {
        self.failures.is_empty() && self.facts.iter().all(|(_, holds)| *holds)
    }

    fn facts(&self) -> Vec<(&'static str, bool)> {
        self.facts.clone()
    }

    fn figures(&self) -> Vec<Figure> {
        let figure = |name, unit, value: f32| Figure { name, unit, value: Some(value.into()) };
        let stopped = self.lines.iter().filter(|line| line.system_state == SystemState::EStop).count();
        vec![
            figure("top_speed_m_s", "m/s", self.lines.iter().fold(0.0, |top, line| line.v.max(top))),
            figure("distance_m", "m", self.lines.iter().map(|line| line.v * TICK.seconds()).sum()),
            figure("estop_s", "s", stopped as f32 * TICK.seconds()),
            figure("checks_failed", "1", self.failures.len() as f32),
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

/// What is around the vehicle for one drive.
pub struct Surroundings {
    setup: Setup,
    clock: Clock,
}

impl Surroundings {
    /// A vehicle at its start.
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        Self { setup: setup.clone(), clock: Clock::new(Instant::ZERO) }
    }
}

impl vehicle::Surroundings for Surroundings {
    type Runnables = Runnables;
    type Outcome = Drive;
    type Around<'a> = Around<'a>;

    fn clock(&self) -> Clock {
        self.clock.clone()
    }

    fn start<'a>(&'a mut self, tasks: &mut Tasks<'a>, Outside { link }: Outside<'a>) -> Around<'a> {
        let Self { setup, clock } = self;
        match &setup.driver {
            Driver::Scenario(scenario) => tasks.spawn(operate(clock.clone(), scenario, setup.seed, link)),
            Driver::Replay(lines) => tasks.spawn(replay(clock.clone(), lines, link)),
            Driver::Live(live) => tasks.spawn(link::serve(clock.clone(), live, link)),
        }
        Around { setup, lines: Vec::new(), sane: true }
    }
}

/// Com in this process: what the scenario asks for, as exactly as an operator does it.
async fn operate(clock: Clock, scenario: &Scenario<OperatorCommand, LogRecord>, seed: u64, mut link: LinkEnds<'_>) {
    let mut noise = Noise::new(seed, STREAMS[1]);
    loop {
        let now = clock.now();
        let asked = scenario.command(now.seconds_f64() as f32);
        let mut done = |value: f32| {
            // Relative, so that what is released stays released.
            let missed = if seed == 0 { 0.0 } else { INEXACTNESS * noise.normal() };
            (value * (1.0 + missed as f32)).clamp(-1.0, 1.0)
        };
        let (throttle, brake, steer) = (done(asked.throttle), done(asked.brake), done(asked.steer));
        link.operator_command.publish(now, &OperatorCommand { throttle, brake, steer, ..asked });
        clock.sleep_until(now + OPERATOR).await;
    }
}

/// Com in this process: one line of a log a tick.
async fn replay(clock: Clock, lines: &[LogRecord], mut link: LinkEnds<'_>) {
    let mode = InputMode::Replay;
    link.operator_command.publish(clock.now(), &OperatorCommand { mode, ..OperatorCommand::default() });
    for line in lines {
        clock.sleep_until(clock.now() + TICK).await;
        link.replay_record.publish(clock.now(), line);
    }
}

/// What is watched during a drive.
pub struct Around<'a> {
    setup: &'a Setup,
    lines: Vec<LogRecord>,
    /// Has the diagnosis found nothing?
    sane: bool,
}

impl vehicle::Around for Around<'_> {
    type Outcome = Drive;

    fn drive(&mut self, _: Instant) {}

    fn published(&mut self, topic: usize, _: Instant, words: &[u32]) {
        if topic == Id::log_record as usize {
            self.lines.extend(words.try_into().ok().and_then(LogRecord::from_words));
        } else if topic == Id::diag_status as usize {
            self.sane &= words.first() == Some(&0);
        }
    }

    fn progress(&self) -> (f32, &'static str) {
        (
            self.lines.len() as f32 / self.setup.ticks() as f32,
            self.lines.last().map_or("", |line| line.system_state.name()),
        )
    }

    fn is_over(&mut self, _: Instant) -> bool {
        self.lines.len() as u64 >= self.setup.ticks()
    }

    fn finish(self) -> Drive {
        let Self { setup, lines, sane } = self;
        let mut drive = Drive { lines, ..Drive::default() };
        drive.facts = vec![("logged", !drive.lines.is_empty()), ("sane", sane), ("stops", drive.stops())];
        // Other programs may change the limit, so theirs is left to the diagnosis.
        if let Driver::Scenario(scenario) = &setup.driver {
            let allowed = 0.0..=setup.parameters.vehicle.max_speed;
            drive.facts.push(("speed_kept", drive.lines.iter().all(|line| allowed.contains(&line.v))));
            drive.failures = scenario.failures(drive.lines.iter().map(|line| (line.t, *line)));
            let again = Setup { driver: Driver::Replay(drive.lines.clone()), ..setup.clone() };
            let (options, mut around) = (Rover::options(&again), Surroundings::new(&again));
            let again = fly::<Runnables, _>(&again.parameters, &options, &mut around, &mut (), &mut |_, _| {});
            drive.facts.push(("reproduced", again.outcome.csv() == drive.csv()));
        }
        drive
    }
}
