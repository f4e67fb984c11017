//! One flight of the StampFly: what is started around it, and what the executor calls while it flies.

use super::air::{self, AirReport, Ends};
use super::faults::Wrong;
use super::ground_station::{self, Progress};
use super::home::Home;
use super::judge::{Judge, Sight};
use super::live::{Seen, Services};
use super::outcome::Outcome;
use super::pilot::{Meaning, Pilot, approach};
use super::radio::Radio;
use super::sensing::{self, Healths, Others, Sensing, Shared};
use super::settings::Settings;
use super::setup::Setup;
use super::watch::Watch;
use crate::airframe::CUT_OFF;
use crate::console::Profile;
use crate::messages::{ButtonContact, CutoffState};
use crate::schedule::{ACTIVATIONS, Runnables};
use crate::topics::{self, Id};
use stampfly_bus::Band;
use stampfly_drivers::{Button, Indicator, MotorOutputs};
use stampfly_flight::compact::Chunks;
use stampfly_flight::{FlightLoop, Observer, Watchdog};
use stampfly_sim::chips;
use stampfly_sim::fault::{Injector, Moment};
use stampfly_sim::ground;
use stampfly_sim::plant::Plant;
use stampfly_sim::sensors::{IndicatorRecorder, MotorModel, Sensors};
use stampfly_sim::time::{Clock, Tasks};
use stampfly_sim::vehicle::{self, Live};
use stampfly_sim::{Simulation, Truth, World};
use stampfly_types::messages::MotorOutput;
use stampfly_types::{Duration, Instant};
use std::cell::{Cell, RefCell};
use std::rc::Rc;

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
    seen: Seen,
    profile: Profile,
    air: Cell<AirReport>,
    /// Until when the radio's frames keep the processor.
    busy: Cell<Instant>,
}

impl Surroundings {
    /// A world with a vehicle at the start.
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        let Simulation { clock, world, sensors } = Simulation::new(&setup.simulation);
        let board = chips::Board::on(&sensing::SPI, &world, &clock, &setup.simulation, &sensing::IMAGE);
        Self {
            shared: Shared::new(&clock, &board.i2c),
            setup: setup.clone(),
            clock,
            world,
            sensors: Some(sensors),
            board: Some(board),
            progress: Progress::default(),
            health: Healths::default(),
            wrong: Some(match setup.live {
                Some(_) => Wrong::on_demand(&setup.faults, setup.simulation.start, setup.simulation.seed),
                None => Wrong::new(&setup.faults, setup.simulation.start, setup.simulation.seed),
            }),
            watchdog: Watchdog::new(CUT_OFF),
            seen: Seen::default(),
            profile: Profile::new(&ACTIVATIONS),
            air: Cell::default(),
            busy: Cell::new(Instant::ZERO),
        }
    }

    /// The world, to look at what no sensor sees.
    #[must_use]
    pub fn world(&self) -> World {
        self.world.clone()
    }

    /// The SPI of the emulated chips, to look at what goes over it. `None` once the flight has begun.
    #[must_use]
    pub fn spi(&self) -> Option<chips::SpiBus> {
        self.board.as_ref().map(|board| board.imu.bus())
    }
}

impl vehicle::Surroundings for Surroundings {
    type Runnables = Runnables;
    type Outcome = Outcome;
    type Around<'a> = Around<'a>;

    fn clock(&self) -> Clock {
        self.clock.clone()
    }

    fn record_of(&self) -> Option<&'static str> {
        let by_radio = self.setup.air.is_some_and(|air| air.record);
        (by_radio || self.setup.live.is_some()).then_some("stampfly")
    }

    fn start<'a>(&'a mut self, tasks: &mut Tasks<'a>, outside: topics::Outside<'a>) -> Around<'a> {
        let Self {
            setup,
            clock,
            world,
            sensors,
            shared,
            board,
            progress,
            health,
            wrong,
            watchdog,
            seen,
            profile,
            air,
            busy,
        } = self;
        let (sensors, board) = sensors.take().zip(board.take()).expect("surroundings are started once");
        let wrong = wrong.take().expect("surroundings are started once");
        let with = (setup.cameras, &setup.vehicle.corrections);
        let chips = (setup.sensing == Sensing::Chips).then(|| board.attached.clone());
        let Others { motors, indicator, button, link, cutoff, console, .. } = match setup.sensing {
            Sensing::Models => sensing::start_models(tasks, clock, (sensors, &wrong), outside, with, health),
            Sensing::Chips => {
                sensing::start_drivers(tasks, clock, (board, shared), (sensors, &wrong), outside, with, health)
            }
        };
        tasks.spawn(watch_button(clock.clone(), button.0, button.1.button_contact));
        let home = Home::new(&world.truth_at(setup.simulation.start));
        let (radio, sealed) = match setup.air {
            None => (Radio::new(clock, link, &wrong), None),
            Some(what) => {
                let ends = Ends::new(setup.simulation.seed, what, &setup.vehicle, link).expect("a key of random bytes");
                let ends = Rc::new(RefCell::new(ends));
                tasks.spawn(air::flood(clock.clone(), ends.clone(), what.flood, air, busy));
                (Radio::sealed(clock, ends.clone(), &wrong), Some(ends))
            }
        };
        let waits = wrong.injector.wants(Moment::Ground);
        let meaning = Meaning::new(&setup.vehicle.navigator, &setup.vehicle.cascade);
        match (&setup.live, &setup.sticks, setup.pilot) {
            (Some(live), ..) => {
                let shared = (&*seen, &*health, &*profile);
                let services = Services::new(
                    live,
                    radio,
                    console,
                    (&setup.vehicle, setup.sensing),
                    (&wrong.injector, world),
                    shared,
                );
                tasks.spawn(live.serve(clock.clone(), ground::PERIOD, services));
            }
            (None, Some(sticks), _) => {
                tasks.spawn(Pilot::new(radio, world, home, meaning, approach(sticks)).play(sticks, waits, progress));
            }
            (None, None, pilot) => {
                let settings = Settings::new(&setup.vehicle, console, &seen.changed);
                match pilot {
                    None => {
                        tasks.spawn(ground_station::fly(radio, &setup.mission, waits, progress, Some(settings)));
                    }
                    Some(mode) => {
                        let pilot = Pilot::new(radio, world, home, meaning, mode).with_settings(settings);
                        tasks.spawn(pilot.fly(&setup.mission, waits, progress));
                    }
                }
            }
        }
        // What people break on purpose is not judged.
        let judged = match setup.live {
            Some(_) => Injector::new(setup.simulation.start, &setup.faults),
            None => wrong.injector.clone(),
        };
        let judge = Judge::new(&judged, &setup.mission, setup.pilot, &setup.vehicle);
        let judge = setup.sticks.iter().fold(judge, Judge::of_sticks);
        Around {
            clock: clock.clone(),
            world: world.clone(),
            steps: setup.mission.steps.len(),
            progress,
            watch: Watch::new(home),
            live: setup.live.as_ref(),
            by_sticks: setup.sticks.is_some(),
            seen,
            sealed,
            air,
            busy,
            judge,
            wrong,
            chips,
            standing: setup.simulation.plant.ground_height as f32,
            seen_at: setup.simulation.start,
            duties: motors.1.actuator_motor,
            motors: motors.0,
            watchdog,
            flies_on: setup.vehicle.flies_on,
            cutoff: cutoff.cutoff_state,
            is_cut_off: false,
            signals: indicator.1.signal,
            indicator: indicator.0,
            finished_at: None,
        }
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
    /// The programs that fly it, if there are.
    live: Option<&'a Live>,
    /// A stick file flies it.
    by_sticks: bool,
    seen: &'a Seen,
    /// The secure session, if there is one.
    sealed: Option<air::Shared<'a>>,
    air: &'a Cell<AirReport>,
    busy: &'a Cell<Instant>,
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
    /// The cut-off stops no motors.
    flies_on: bool,
    cutoff: topics::CutoffStateTx<'a>,
    is_cut_off: bool,
    signals: topics::SignalRx<'a>,
    indicator: IndicatorRecorder,
    finished_at: Option<Instant>,
}

impl vehicle::Around for Around<'_> {
    type Runnables = Runnables;
    type Outcome = Outcome;

    fn tend(&mut self, flight_loop: &mut FlightLoop<'_, Runnables>, observer: &mut dyn Observer) -> bool {
        let mut waiting = self.seen.changed.borrow_mut();
        waiting.as_mut().is_some_and(|change| change.apply(self.watch.mode.armed, flight_loop, observer))
    }

    fn drive(&mut self, now: Instant) {
        if self.duties.has_new()
            && let Some(output) = self.duties.latest()
        {
            self.watchdog.feed(now, output.data.armed);
            // Motors that were cut off get their pins back when the vehicle is disarmed.
            let off = self.watchdog.has_expired() && (output.data.armed || !self.watchdog.reset()) && !self.flies_on;
            self.write(now, &MotorOutput { armed: output.data.armed && !off, ..output.data });
        }
    }

    fn is_held_up(&mut self, band: Band, now: Instant) -> bool {
        self.wrong.is_held_up(band, now) || now < self.busy.get()
    }

    fn show(&mut self, now: Instant) {
        self.wrong.act(now, &self.world, self.chips.as_ref());
        let expired = self.watchdog.expired(|| now);
        if expired && !self.flies_on {
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
            if self.live.is_some() {
                self.seen.note(*id, at, words);
            }
        }
    }

    fn stream(&mut self, now: Instant, chunks: &mut dyn Chunks) {
        match &self.sealed {
            Some(air) => air.borrow_mut().pass_on(now, chunks),
            None => self.seen.stream(now, chunks),
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
        if let Some(live) = self.live {
            return live.ports.are_closed() || self.seen.restarts.get();
        }
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
            tuned: watch.tuned,
            finished: self.progress.finished.get(),
            live: self.live.is_some(),
            by_sticks: self.by_sticks,
            air: self.air.get(),
            record: self.sealed.map(|air| air.borrow_mut().record()).unwrap_or_default(),
            worst_tilt_deg: f64::from(watch.worst_tilt.to_degrees()),
            battery: watch.battery.unwrap_or_default(),
            judgement: self.judge.finish(),
            restart: self.seen.restarts.get().then(|| self.seen.kept.borrow().clone()),
        }
    }
}

/// The judge looks at least this often.
const UNSEEN: Duration = Duration::from_millis(5);

impl Around<'_> {
    fn write(&mut self, now: Instant, output: &MotorOutput) {
        let Ok(()) = self.motors.write(output);
        self.judge.strikes(now, self.strikes());
        self.judge.motors(now, output.armed && output.duty.iter().any(|duty| *duty > 0.0));
    }

    fn strikes(&self) -> u64 {
        self.world.inspect_as(|plant: &Plant| plant.ground().strikes()).unwrap_or_default()
    }

    fn see(&mut self, now: Instant, truth: &Truth) {
        self.seen_at = now;
        let done = self.progress.done.get();
        let clearance = self.world.height_at(now) as f32 - self.standing;
        let strikes = self.strikes();
        self.judge.see(&Sight { now, truth, clearance, strikes, status: &self.watch.mode, done });
    }
}

/// Looks at the button fifty times a second.
async fn watch_button(clock: Clock, mut button: impl Button, mut publisher: topics::ButtonContactTx<'_>) {
    loop {
        publisher.publish(clock.now(), &ButtonContact { pressed: button.is_pressed() });
        clock.sleep_until(clock.now() + Duration::from_millis(20)).await;
    }
}
