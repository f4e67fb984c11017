//! One flight of the aircraft: what is started around it, and what is watched.

use super::faults::{FAULTS, PATIENCE, Wrong};
use super::mission::{HEIGHT, REACH};
use super::outcome::{Measured, Outcome};
use super::plant::{self, RECEIVER};
use super::services;
use super::setup::Setup;
use crate::autopilot;
use crate::ground::{Board, Newest};
use crate::schedule::Runnables;
use crate::topics::{self, Id, TOPICS};
use core::cell::RefCell;
use stampfly_control::fixed_wing::TrackConfig;
use stampfly_drivers::task::{Backoff, SensorHealth, run_sensor};
use stampfly_drivers::{
    Airspeed as _, Barometer as _, Gnss as _, Imu as _, Magnetometer as _, MotorOutputs as _, PowerMonitor as _,
    ServoOutputs as _,
};
use stampfly_fixed_wing::messages::{Demand, PathStatus, Place, Vertical};
use stampfly_flight::newest::message;
use stampfly_sim::fault::Fault;
use stampfly_sim::ground;
use stampfly_sim::plant::Surface;
use stampfly_sim::sensors::{AirspeedModel, GnssModel, MotorModel, Sensors, ServoModel};
use stampfly_sim::sight::Progress;
use stampfly_sim::station::Station;
use stampfly_sim::time::{Clock, Tasks};
use stampfly_sim::vehicle;
use stampfly_sim::watched::{Shown, Spectator};
use stampfly_sim::{Simulation, Truth, World};
use stampfly_types::messages::{FlightStatus, MotorOutput, StateEstimate};
use stampfly_types::{Duration, Instant, frame, math};
use std::prelude::v1::*;

/// The truth is compared and logged this often.
const LOOK: Duration = Duration::from_millis(10);
/// What each servo moves.
const SERVOS: [Surface; autopilot::SURFACES.len() + 1] =
    [Surface::LeftAileron, Surface::RightAileron, Surface::Elevator, Surface::Rudder, Surface::Brake];

/// What is around the vehicle for one flight.
pub struct Surroundings {
    setup: Setup,
    clock: Clock,
    world: World,
    sensors: Option<Sensors>,
    progress: Progress,
    wrong: Wrong,
    newest: RefCell<Newest>,
}

impl Surroundings {
    /// A world with a vehicle at the start.
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        let config = &setup.simulation;
        let Simulation { clock, world, sensors } = Simulation::new(config);
        let faults = match setup.live {
            Some(_) => Fault::and_on_demand(&setup.faults, FAULTS),
            None => setup.faults.clone(),
        };
        Self {
            setup: setup.clone(),
            sensors: Some(sensors),
            progress: Progress::default(),
            wrong: Wrong::new(&faults, config.start),
            newest: RefCell::new(Newest::new()),
            clock,
            world,
        }
    }
}

/// Starts a sensor: its samples, less what is wrong with them, go to its topic.
macro_rules! sense {
    ($tasks:ident, $clock:ident, $wrong:ident, $seed:expr, $sensor:expr, $ends:expr, $topic:ident, $word:literal) => {{
        let (mut sensor, mut ends, mut line, clock) = ($sensor, $ends, $wrong.line($word, $seed), $clock.clone());
        $tasks.spawn(async move {
            let publish = |at, data: &_| {
                if let Some(data) = line.pass(at, data) {
                    ends.$topic.publish(at, &data);
                }
            };
            match run_sensor(async || sensor.next().await, publish, clock, Backoff::CRITICAL, &SensorHealth::new())
                .await {}
        });
    }};
}

impl vehicle::Surroundings for Surroundings {
    type Runnables = Runnables;
    type Outcome = Outcome;
    type Around<'a> = Around<'a>;

    fn clock(&self) -> Clock {
        self.clock.clone()
    }

    fn start<'a>(&'a mut self, tasks: &mut Tasks<'a>, outside: topics::Outside<'a>) -> Around<'a> {
        let Self { setup, clock, world, sensors, progress, wrong, newest } = self;
        let Sensors { imu, mag, baro, power, motors, .. } = sensors.take().expect("surroundings are started once");
        let seed = setup.simulation.seed;
        let gnss = GnssModel::new(world, clock, seed, &RECEIVER);
        let pitot = AirspeedModel::new(world, clock, seed);
        sense!(tasks, clock, wrong, seed, imu, outside.imu, sensor_imu, "imu");
        sense!(tasks, clock, wrong, seed, mag, outside.mag, sensor_mag, "mag");
        sense!(tasks, clock, wrong, seed, baro, outside.baro, sensor_baro, "baro");
        sense!(tasks, clock, wrong, seed, gnss, outside.gnss, sensor_gnss, "gnss");
        sense!(tasks, clock, wrong, seed, pitot, outside.pitot, sensor_airspeed, "pitot");
        sense!(tasks, clock, wrong, seed, power, outside.battery, sensor_power, "power");
        let board = Board::new(&setup.parameters, &plant::parameters(), outside.link);
        match &setup.live {
            Some(live) => {
                let services = services::services(live, &wrong.injector, board, newest);
                tasks.spawn(live.serve(clock.clone(), ground::PERIOD, services));
            }
            None => {
                let station = Station::new(clock, board, &TOPICS, newest, &wrong.silent);
                tasks.spawn(station.fly(&setup.mission, [HEIGHT, REACH], progress));
            }
        }
        Around {
            newest,
            servos: ServoModel::new(world, clock, &SERVOS),
            world: world.clone(),
            setup,
            wrong: wrong.clone(),
            progress,
            motors,
            duties: outside.motor.actuator_motor,
            deflections: outside.servos.actuator_servo,
            seen: Seen::default(),
            spectator: Spectator::new(clock, world, LOOK),
            outcome: Outcome::new(setup.mission.items()),
        }
    }
}

/// The newest of what is compared with the truth.
#[derive(Default)]
struct Seen {
    estimate: StateEstimate,
    demand: Demand,
    path: PathStatus,
    armed: bool,
    /// It may be armed.
    ready: bool,
    /// The propeller is told to turn.
    turns: bool,
}

/// The world during a flight, and what is watched of it.
pub struct Around<'a> {
    newest: &'a RefCell<Newest>,
    world: World,
    setup: &'a Setup,
    wrong: Wrong,
    progress: &'a Progress,
    motors: MotorModel,
    servos: ServoModel,
    duties: topics::ActuatorMotorRx<'a>,
    deflections: topics::ActuatorServoRx<'a>,
    seen: Seen,
    spectator: Spectator,
    outcome: Outcome,
}

impl Around<'_> {
    fn look(&mut self, now: Instant, truth: &Truth) {
        let height = self.world.height_at(now) - self.setup.simulation.plant.gear_height;
        let Seen { estimate, demand, path, armed, ready, turns } = &self.seen;
        let fence = &self.setup.parameters.fence;
        let away = truth.position.horizontal().norm() - fence.radius;
        let outside = away.max(-truth.position.z - fence.height).max(0.0);
        let shown = Shown {
            ready: *ready,
            armed: *armed,
            height,
            stays: false,
            moves: path.place == Place::CruisingCruise,
            lands: path.place == Place::LandingSlope,
            turns: *turns,
            scrapes: self.world.inspect(|body| body.scrapes()),
            beside: outside.into(),
        };
        self.outcome.look(now, &shown, truth, &self.wrong.injector);
        let Measured { beside, height: heights, heading, position, .. } = &mut self.outcome.measured;
        if *armed {
            heading.add(math::wrap_angle(frame::yaw(&estimate.attitude) - frame::yaw(&truth.attitude)).into());
            position.add((estimate.position - truth.position).horizontal().norm().into());
        }
        // Between way-points; a hold has no leg that leads to it.
        if path.place == Place::CruisingCruise && path.remaining > 0 {
            let [north, east, _] = estimate.position.to_array();
            if let Some(track) = demand.path() {
                beside.add(track.steer([north, east], [0.0; 2], &TrackConfig::default()).aside.into());
            }
            if demand.vertical == Vertical::Height {
                heights.add((-truth.position.z - demand.height).into());
            }
        }
        self.outcome.measured.touchdowns.look(height as f32, truth);
    }
}

impl vehicle::Around for Around<'_> {
    type Runnables = Runnables;
    type Outcome = Outcome;

    fn drive(&mut self, _: Instant) {
        if let Some(output) = self.duties.has_new().then(|| self.duties.latest()).flatten() {
            let Ok(()) = self.motors.write(&output.data);
        }
        if let Some(output) = self.deflections.has_new().then(|| self.deflections.latest()).flatten() {
            let Ok(()) = self.servos.write(&output.data);
        }
    }

    fn show(&mut self, now: Instant) {
        self.wrong.act(now, &self.world);
    }

    fn published(&mut self, topic: usize, at: Instant, words: &[u32]) {
        self.newest.borrow_mut().note(topic, at, words);
        let seen = &mut self.seen;
        match Id::ALL.get(topic) {
            Some(Id::estimate_state) => seen.estimate = message(words).unwrap_or(seen.estimate),
            Some(Id::demand) => seen.demand = message(words).unwrap_or(seen.demand),
            Some(Id::path_status) => seen.path = message(words).unwrap_or(seen.path),
            Some(Id::actuator_motor) => {
                seen.turns =
                    message(words).is_some_and(|output: MotorOutput| output.duty.iter().any(|duty| *duty > 0.0));
            }
            Some(Id::flight_status) => {
                let status: FlightStatus = message(words).unwrap_or_default();
                (seen.armed, seen.ready) = (status.armed, status.blocks.is_empty());
            }
            _ => {}
        }
    }

    fn beside(&mut self, record: &mut dyn FnMut(usize, Instant, u32, &[u32])) {
        if let Some((now, truth)) = self.spectator.look(record) {
            self.look(now, &truth);
        }
    }

    fn progress(&self) -> (f32, &'static str) {
        let word = match self.seen.path.place {
            Place::Nowhere => "starting",
            Place::TakeOffRoll | Place::TakeOffClimb => "take-off",
            Place::CruisingCruise => "cruising",
            Place::TaxiingStop
            | Place::TaxiingTurnOff
            | Place::TaxiingPark
            | Place::TaxiingReturn
            | Place::TaxiingLineUp => "on ground",
            _ => "landing",
        };
        (self.progress.legs.get() as f32 / self.setup.mission.items().max(1) as f32, word)
    }

    fn is_over(&mut self, now: Instant) -> bool {
        if let Some(live) = &self.setup.live {
            return live.ports.are_closed();
        }
        let (end, cut) = (self.progress.finished.get(), self.outcome.is_out());
        self.spectator.is_over(now, end, cut, &self.wrong.injector, PATIENCE)
    }

    fn finish(self) -> Outcome {
        let Self { seen, mut outcome, progress, spectator, wrong, setup, .. } = self;
        outcome.legs[0] = progress.legs.get();
        outcome.finished = progress.finished.get() && outcome.legs[0] == outcome.legs[1];
        outcome.live = setup.live.is_some();
        outcome.end(&setup.faults, Some(&wrong.injector), spectator.truth(), seen.armed);
        outcome
    }
}
