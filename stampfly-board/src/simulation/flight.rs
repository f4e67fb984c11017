//! One flight of the StampFly: what is started around it, what is watched, and what came of it.

use super::faults::Wrong;
use super::ground_station::{self, Progress};
use super::home::Home;
use super::judge::{Judge, Judgement, Sight};
use super::metrics::{Collector, FIGURES, Metrics, Snapshot};
use super::mission::{self, Mission};
use super::pilot::{Meaning, Pilot};
use super::plant::PLANT;
use super::radio::Radio;
use super::sensing::{self, Healths, Others, Sensing, Shared};
use crate::config::VehicleConfig;
use crate::messages::{ButtonContact, CutoffState};
use crate::schedule::Runnables;
use crate::topics::{self, Id};
use serde::Serialize;
use stampfly_bus::Band;
use stampfly_drivers::{Button, Indicator, MotorOutputs};
use stampfly_flight::Watchdog;
use stampfly_sim::chips;
use stampfly_sim::fault::{Fault, Moment};
use stampfly_sim::sensors::{IndicatorRecorder, MotorModel, Sensors};
use stampfly_sim::time::{Clock, Tasks};
use stampfly_sim::vehicle::{self, Figure, Verdict};
use stampfly_sim::{Simulation, SimulationConfig, Truth, World};
use stampfly_types::messages::{FlightMode, FlightPhase, FlightStatus, MotorOutput, Setpoint, StateEstimate};
use stampfly_types::{Duration, Instant, Message, frame};
use std::string::String;
use std::vec::Vec;
use std::{format, vec};

/// All that decides a flight.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The vehicle in its surroundings.
    pub simulation: SimulationConfig,
    /// The flight stack.
    pub vehicle: VehicleConfig,
    /// What to fly.
    pub mission: Mission,
    /// What the sensor tasks read.
    pub sensing: Sensing,
    /// What goes wrong.
    pub faults: Vec<Fault>,
    /// The mission is flown by a pilot in this mode; `None` for a ground station.
    pub pilot: Option<FlightMode>,
    /// Is the vehicle watched by a motion capture system?
    pub cameras: bool,
    /// Seed of the executor's delays; `None` for an executor that is never late.
    pub jitter: Option<u64>,
    /// The flight is broken off after this long.
    pub limit: Duration,
}

impl Setup {
    /// The reference mission with this seed.
    #[must_use]
    pub fn reference(seed: u64) -> Self {
        let simulation = SimulationConfig { seed, ..SimulationConfig::new(PLANT) };
        Self {
            vehicle: VehicleConfig::default(),
            mission: Mission::parse(mission::REFERENCE).unwrap_or_else(|_| Mission { steps: Vec::new() }),
            sensing: Sensing::Models,
            faults: Vec::new(),
            pilot: None,
            cameras: false,
            jitter: None,
            limit: Duration::from_secs(180),
            simulation,
        }
    }
}

/// A change of state or mode, for people.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseChange {
    /// When it began.
    pub since: Instant,
    /// State.
    pub phase: FlightPhase,
    /// Mode.
    pub mode: FlightMode,
}

/// How a flight went.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The figures.
    pub metrics: Metrics,
    /// States and modes, in order.
    pub phases: Vec<PhaseChange>,
    /// Was the mission flown to its end?
    pub finished: bool,
    /// Largest true tilt, degrees.
    pub worst_tilt_deg: f64,
    /// Battery voltage at the start and at the end, V.
    pub battery: [f32; 2],
    /// Was every duty a number from 0 to 1, and 0 while the vehicle was not armed?
    pub motors_sane: bool,
    /// What came of faults, and what never may happen.
    pub judgement: Judgement,
}

impl Verdict for Outcome {
    /// Without faults the mission has to be flown; with faults the end has to be acceptable. Either way every invariant has
    /// to hold.
    fn succeeded(&self) -> bool {
        let flown = self.facts().iter().all(|(_, holds)| *holds);
        let Judgement { faults, as_expected, violations, .. } = &self.judgement;
        violations.is_empty() && if faults.is_empty() { flown } else { *as_expected }
    }

    fn findings(&self) -> impl Serialize {
        &self.judgement
    }

    fn facts(&self) -> Vec<(&'static str, bool)> {
        vec![
            ("landed", self.metrics.landed),
            ("disarmed", self.metrics.disarmed),
            ("finished", self.finished),
            ("motors_sane", self.motors_sane),
        ]
    }

    fn figures(&self) -> Vec<Figure> {
        let figures = FIGURES.iter().map(|(name, unit, value)| Figure { name, unit, value: value(&self.metrics) });
        figures.collect()
    }

    fn story(&self) -> Vec<String> {
        let phases = self.phases.iter().map(|change| {
            let mode = if change.phase == FlightPhase::Flying { format!(" {:?}", change.mode) } else { String::new() };
            format!("{:>9.3} s  {}{mode}", change.since.seconds_f64(), change.phase.name())
        });
        let [first, last] = self.battery;
        let extremes = [
            format!("largest tilt {:.3} deg", self.worst_tilt_deg),
            format!("battery {first:.2} V at the start, {last:.2} V at the end"),
        ];
        let Judgement { outcome, expected, violations, faults, .. } = &self.judgement;
        let faults = faults.iter().map(|span| match span.since {
            Some(since) => format!("{since:>9.3} s  fault {}, {} changes", span.fault, span.changes),
            None => format!("  fault {} never began", span.fault),
        });
        let alerts = self.judgement.alerts.iter().map(|span| format!("{:>9.3} s  alert {}", span.since, span.name));
        let mut told: Vec<_> = phases.chain(faults).chain(alerts).collect();
        told.sort();
        told.extend(extremes);
        if !self.judgement.faults.is_empty() {
            told.push(format!("outcome {outcome}, acceptable up to {expected}"));
        }
        if !violations.is_empty() {
            told.push(format!("VIOLATED {}", violations.join(", ")));
        }
        told
    }

    fn sentence(&self) -> String {
        if !self.judgement.faults.is_empty() {
            let word = if self.succeeded() { "as expected" } else { "NOT ACCEPTABLE" };
            return format!("{}, {word}", self.judgement.outcome);
        }
        let sentence = match (self.metrics.landed, self.metrics.disarmed) {
            (true, true) => "landed and disarmed",
            (true, false) => "landed, still armed",
            (false, _) => "DID NOT LAND",
        };
        sentence.into()
    }
}

/// After the mission the vehicle is watched for this long.
const TAIL: Duration = Duration::from_secs(1);

/// What is around the vehicle for one flight.
pub struct Surroundings {
    setup: Setup,
    clock: Clock,
    world: World,
    sensors: Option<Sensors>,
    shared: Shared,
    board: Option<chips::Board>,
    progress: Progress,
    health: Healths,
    wrong: Option<Wrong>,
    watchdog: Watchdog,
}

impl Surroundings {
    /// A world with a vehicle at the start.
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        let Simulation { clock, world, sensors } = Simulation::new(&setup.simulation);
        let board = chips::Board::new(&world, &clock, &setup.simulation, &sensing::IMAGE);
        Self {
            shared: Shared::new(&clock, &board.i2c),
            setup: setup.clone(),
            clock,
            world,
            sensors: Some(sensors),
            board: Some(board),
            progress: Progress::default(),
            health: Healths::default(),
            wrong: Some(Wrong::new(&setup.faults, setup.simulation.start, setup.simulation.seed)),
            watchdog: Watchdog::new(CUT_OFF),
        }
    }
}

impl vehicle::Surroundings for Surroundings {
    type Runnables = Runnables;
    type Outcome = Outcome;
    type Around<'a> = Around<'a>;

    fn clock(&self) -> Clock {
        self.clock.clone()
    }

    fn start<'a>(&'a mut self, tasks: &mut Tasks<'a>, outside: topics::Outside<'a>) -> Around<'a> {
        let Self { setup, clock, world, sensors, shared, board, progress, health, wrong, watchdog } = self;
        let (sensors, board) = sensors.take().zip(board.take()).expect("surroundings are started once");
        let wrong = wrong.take().expect("surroundings are started once");
        let lines = wrong.sensor_lines();
        let cameras = setup.cameras;
        let chips = (setup.sensing == Sensing::Chips).then(|| board.attached.clone());
        let Others { motors, indicator, button, link, cutoff } = match setup.sensing {
            Sensing::Models => sensing::start_models(tasks, clock, (sensors, lines), outside, cameras, health),
            Sensing::Chips => {
                sensing::start_drivers(tasks, clock, (board, shared), (sensors, lines), outside, cameras, health)
            }
        };
        tasks.spawn(watch_button(clock.clone(), button.0, button.1.button_contact));
        let home = Home::new(&world.truth_at(setup.simulation.start));
        let radio = Radio::new(clock, link, wrong.radio_lines());
        let waits = wrong.injector.wants(Moment::Ground);
        match setup.pilot {
            None => tasks.spawn(ground_station::fly(radio, &setup.mission, waits, progress)),
            Some(mode) => {
                let meaning = Meaning::new(&setup.vehicle.navigator, &setup.vehicle.cascade);
                tasks.spawn(Pilot::new(radio, world, home, meaning, mode).fly(&setup.mission, waits, progress));
            }
        }
        let hover_without_link = setup.vehicle.mode.hover_without_link;
        let judge = Judge::new(&wrong.injector, &setup.mission, setup.pilot.is_some(), hover_without_link);
        Around {
            clock: clock.clone(),
            world: world.clone(),
            steps: setup.mission.steps.len(),
            progress,
            watch: Watch::new(home),
            judge,
            wrong,
            chips,
            standing: setup.simulation.plant.ground_height as f32,
            seen_at: setup.simulation.start,
            duties: motors.1.actuator_motor,
            motors: motors.0,
            watchdog,
            cutoff: cutoff.cutoff_state,
            is_cut_off: false,
            signals: indicator.1.signal,
            indicator: indicator.0,
            finished_at: None,
        }
    }
}

/// Motors that are not confirmed for this long are stopped, as by the firmware.
const CUT_OFF: Duration = Duration::from_millis(25);

/// What is watched beside the bus: truth, and the newest of what it is compared with.
struct Watch {
    collector: Collector,
    setpoint: Setpoint,
    estimate: StateEstimate,
    mode: FlightStatus,
    phases: Vec<PhaseChange>,
    worst_tilt: f32,
    battery: Option<[f32; 2]>,
    motors_sane: bool,
    home: Home,
    truths: u32,
    /// The instant of a set-point that has not been compared with the truth yet.
    due: Option<Instant>,
}

impl Watch {
    fn new(home: Home) -> Self {
        Self {
            collector: Collector::default(),
            setpoint: Setpoint::default(),
            estimate: StateEstimate::default(),
            mode: FlightStatus::default(),
            phases: Vec::new(),
            worst_tilt: 0.0,
            battery: None,
            motors_sane: true,
            home,
            truths: 0,
            due: None,
        }
    }

    /// Notes what a topic published. At the instant of a new set-point the truth is due.
    fn note(&mut self, id: Id, at: Instant, words: &[u32]) {
        fn read<M: Message>(words: &[u32], into: &mut M)
        where
            M::Words: for<'w> TryFrom<&'w [u32]>,
        {
            if let Ok(words) = M::Words::try_from(words)
                && let Some(message) = M::from_words(&words)
            {
                *into = message;
            }
        }
        match id {
            Id::setpoint => {
                read(words, &mut self.setpoint);
                self.due = Some(at);
            }
            Id::estimate_state => read(words, &mut self.estimate),
            Id::flight_status => {
                read(words, &mut self.mode);
                let (phase, mode) = (self.mode.phase, self.mode.mode);
                if self.phases.last().is_none_or(|last| (last.phase, last.mode) != (phase, mode)) {
                    self.phases.push(PhaseChange { since: at, phase, mode });
                }
            }
            Id::actuator_motor => {
                let mut output = MotorOutput::default();
                read(words, &mut output);
                let highest = if self.mode.armed { 1.0 } else { 0.0 };
                self.motors_sane &= output.duty.iter().all(|duty| (0.0..=highest).contains(duty));
            }
            _ => {}
        }
    }

    /// Compares with the truth at the instant of a set-point, in the vehicle's world.
    fn compare(&mut self, at: Instant, truth: &mut Truth, record: &mut dyn FnMut(usize, Instant, u32, &[u32])) {
        self.home.bring(truth);
        self.truths += 1;
        record(0, at, self.truths, truth.to_words().as_ref());
        self.worst_tilt = self.worst_tilt.max(frame::tilt(&truth.attitude));
        let first = self.battery.map_or(truth.battery_voltage, |[first, _]| first);
        self.battery = Some([first, truth.battery_voltage]);
        let (setpoint, estimate, mode) = (self.setpoint, self.estimate, self.mode);
        self.collector.add(&Snapshot { at, truth, setpoint: &setpoint, estimate: &estimate, flight_status: &mode });
    }
}

/// The world during a flight, and what is watched of it.
pub struct Around<'a> {
    clock: Clock,
    world: World,
    /// Of the mission.
    steps: usize,
    progress: &'a Progress,
    watch: Watch,
    judge: Judge,
    wrong: Wrong,
    chips: Option<chips::AttachedChips>,
    /// Height of a vehicle that stands, m.
    standing: f32,
    /// When the judge last saw the truth.
    seen_at: Instant,
    duties: topics::ActuatorMotorRx<'a>,
    motors: MotorModel,
    watchdog: &'a Watchdog,
    cutoff: topics::CutoffStateTx<'a>,
    is_cut_off: bool,
    signals: topics::SignalRx<'a>,
    indicator: IndicatorRecorder,
    finished_at: Option<Instant>,
}

impl vehicle::Around for Around<'_> {
    type Outcome = Outcome;

    fn drive(&mut self, now: Instant) {
        if self.duties.has_new()
            && let Some(output) = self.duties.latest()
        {
            self.watchdog.feed(now, output.data.armed);
            // Motors that were cut off get their pins back when the vehicle is disarmed.
            let off = self.watchdog.has_expired() && (output.data.armed || !self.watchdog.reset());
            self.write(now, &MotorOutput { armed: output.data.armed && !off, ..output.data });
        }
    }

    fn is_held_up(&mut self, band: Band, now: Instant) -> bool {
        self.wrong.is_held_up(band, now)
    }

    fn show(&mut self, now: Instant) {
        self.wrong.act(now, &self.world, self.chips.as_ref());
        let expired = self.watchdog.expired(|| now);
        if expired {
            self.write(now, &MotorOutput::default());
        }
        if self.is_cut_off != expired {
            self.is_cut_off = expired;
            self.cutoff.publish(now, &CutoffState { tripped: expired });
        }
        if let Some(signal) = self.signals.has_new().then(|| self.signals.latest()).flatten() {
            self.indicator.show(&signal.data);
        }
    }

    fn published(&mut self, topic: usize, at: Instant, words: &[u32]) {
        if let Some(id) = Id::ALL.get(topic) {
            self.watch.note(*id, at, words);
            self.judge.published(*id, at, words);
        }
    }

    fn beside(&mut self, record: &mut dyn FnMut(usize, Instant, u32, &[u32])) {
        if let Some(at) = self.watch.due.take() {
            let mut truth = self.world.truth_at(at);
            self.watch.compare(at, &mut truth, record);
            self.see(at, &truth);
        }
        // Whatever has stopped: the judge looks on.
        let now = self.clock.now();
        if now.since(self.seen_at) > UNSEEN {
            let mut truth = self.world.truth_at(now);
            self.watch.home.bring(&mut truth);
            self.see(now, &truth);
        }
    }

    fn progress(&self) -> (f32, &'static str) {
        let share = self.progress.done.get() as f32 / self.steps.max(1) as f32;
        (share, self.watch.mode.phase.name())
    }

    fn is_over(&mut self, now: Instant) -> bool {
        if self.judge.is_over(now) {
            return true;
        }
        if !self.progress.finished.get() {
            return false;
        }
        let since = *self.finished_at.get_or_insert(now);
        now.since(since) >= TAIL
    }

    fn finish(self) -> Outcome {
        let watch = self.watch;
        Outcome {
            metrics: watch.collector.finish(),
            phases: watch.phases,
            finished: self.progress.finished.get(),
            worst_tilt_deg: f64::from(watch.worst_tilt.to_degrees()),
            battery: watch.battery.unwrap_or_default(),
            motors_sane: watch.motors_sane,
            judgement: self.judge.finish(),
        }
    }
}

/// The judge looks at least this often.
const UNSEEN: Duration = Duration::from_millis(5);

impl Around<'_> {
    fn write(&mut self, now: Instant, output: &MotorOutput) {
        let Ok(()) = self.motors.write(output);
        self.judge.motors(now, output.armed && output.duty.iter().any(|duty| *duty > 0.0));
    }

    fn see(&mut self, now: Instant, truth: &Truth) {
        self.seen_at = now;
        let done = self.progress.done.get();
        let clearance = self.world.height_at(now) as f32 - self.standing;
        let struck = self.world.inspect(|plant| plant.ground().strikes() > 0);
        self.judge.see(&Sight { now, truth, clearance, struck, status: &self.watch.mode, done });
    }
}

/// Looks at the button fifty times a second.
async fn watch_button(clock: Clock, mut button: impl Button, mut publisher: topics::ButtonContactTx<'_>) {
    loop {
        publisher.publish(clock.now(), &ButtonContact { pressed: button.is_pressed() });
        clock.sleep_until(clock.now() + Duration::from_millis(20)).await;
    }
}
