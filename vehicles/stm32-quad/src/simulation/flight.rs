//! One flight of the quadcopter: what is started around it, and what is watched.

use super::faults::{FAULTS, PATIENCE, Wrong};
use super::outcome::{Measured, Outcome};
use super::pilot::{Pilot, Sticks};
use super::radio;
use super::serial;
use super::setup::Setup;
use crate::attitude;
use crate::messages::{Attitude, BatterySample, ControlState, ReceiverInput};
use crate::parameters::BatteryParameters;
use crate::schedule::Runnables;
use crate::serial::Newest;
use crate::topics::{self, BatteryEnds, Id, ImuEnds};
use core::cell::{Cell, RefCell};
use embedded_hal::spi::MODE_0;
use stampfly_control::esc;
use stampfly_drivers::chip::mpu6000::{self, BusClock, Mpu6000};
use stampfly_drivers::task::{Backoff, SensorHealth, run_sensor};
use stampfly_drivers::{Imu, MotorOutputs as _};
use stampfly_flight::newest::message;
use stampfly_sim::chips::{self, Air, SpiBus};
use stampfly_sim::fault::{Fault, Line};
use stampfly_sim::ground;
use stampfly_sim::sensors::{MotorModel, Mpu6000Model};
use stampfly_sim::sight::{Places, Progress};
use stampfly_sim::time::{Clock, Tasks};
use stampfly_sim::vehicle;
use stampfly_sim::watched::{Shown, Spectator};
use stampfly_sim::{Simulation, Truth, World};
use stampfly_types::messages::{FlightStatus, ImuData, MotorOutput};
use stampfly_types::{Duration, Instant, Vec3, frame};
use std::prelude::v1::*;

/// The truth is compared and logged this often.
const LOOK: Duration = Duration::from_millis(5);
/// SPI clocks of the inertial sensor, Hz: for its settings, and for samples.
const SETUP: u32 = 1_000_000;
const DATA: u32 = 20_000_000;
/// Horizontal speed of a vehicle that flies to another place, and rate of sink of one that lands, m/s.
const MOVES: f32 = 0.25;
const SINKS: f32 = 0.1;
/// The converter's period.
const CONVERSION: Duration = Duration::from_millis(125);
/// The plant's motors, from the front right clockwise, in the order of the document: rear right, front right, rear left, front left.
const MOTORS: [usize; 4] = [1, 0, 2, 3];

/// What is around the vehicle for one flight.
pub struct Surroundings {
    setup: Setup,
    clock: Clock,
    world: World,
    motors: MotorModel,
    sensor: Option<Mpu6000Model>,
    sticks: Cell<Sticks>,
    lights: Cell<ControlState>,
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
            sensor: Some(Mpu6000Model::new(&world, &clock, config.seed, config.vibration)),
            setup: setup.clone(),
            motors: sensors.motors,
            sticks: Cell::new(Sticks::REST),
            lights: Cell::default(),
            progress: Progress::default(),
            wrong: Wrong::new(&faults, config.start, Air::new(&clock, config.seed)),
            newest: RefCell::new(Newest::new()),
            clock,
            world,
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
        let Self { setup, clock, world, motors, sensor, sticks, lights, progress, wrong, newest } = self;
        let sensor = sensor.take().expect("surroundings are started once");
        let (seed, vibration) = (setup.simulation.seed, setup.simulation.vibration);
        if setup.chips {
            let chip = chips::Mpu6000::new(world, clock, seed, vibration);
            let (device, _) = SpiBus::new(clock, seed).attach(SETUP, chip);
            let imu =
                Mpu6000::new(device.with_mode(MODE_0), clock.clone(), attitude::MOUNTING, mpu6000::Config::default());
            let imu = imu.with_bus_clock(|device, clock| {
                device.set_frequency(if clock == BusClock::Setup { SETUP } else { DATA });
            });
            tasks.spawn(sense(imu, wrong.imu(seed), clock.clone(), outside.imu));
        } else {
            tasks.spawn(sense(sensor, wrong.imu(seed), clock.clone(), outside.imu));
        }
        tasks.spawn(convert(clock.clone(), world.clone(), setup.parameters.battery, outside.battery));
        radio::start(tasks, clock, &wrong.air, seed, sticks, outside.receiver);
        let pilot = Pilot::new(clock, world, sticks, setup.parameters.stick, setup.acro).with_lights(lights);
        match &setup.sticks {
            Some(sticks) => tasks.spawn(pilot.play(sticks, progress)),
            None => tasks.spawn(pilot.with_stunt(setup.stunt, seed).fly(&setup.mission, progress)),
        }
        if let Some(live) = &setup.live {
            let services = serial::services(live, &wrong.injector, &setup.parameters, newest, outside.link);
            tasks.spawn(live.serve(clock.clone(), ground::PERIOD, services));
        }
        Around {
            newest,
            world: world.clone(),
            setup,
            wrong: wrong.clone(),
            progress,
            lights,
            motors: motors.clone(),
            duties: outside.motors.actuator_motor,
            seen: Seen::default(),
            spectator: Spectator::new(clock, world, LOOK),
            outcome: Outcome::new(setup.mission.0.len()),
        }
    }
}

/// Samples to the bus, as the firmware brings them there.
async fn sense(mut imu: impl Imu, mut line: Line<ImuData>, clock: Clock, mut ends: ImuEnds<'_>) {
    let publish = |at, data: &ImuData| {
        if let Some(data) = line.pass(at, data) {
            ends.sensor_imu.publish(at, &data);
        }
    };
    match run_sensor(async || imu.next().await, publish, clock, Backoff::CRITICAL, &SensorHealth::new()).await {}
}

/// Battery voltage to the bus, as a converter behind a divider counts it.
async fn convert(clock: Clock, world: World, parameters: BatteryParameters, mut ends: BatteryEnds<'_>) {
    loop {
        let now = clock.now();
        let voltage = world.truth_at(now).battery_voltage;
        let counts = (voltage / parameters.scale / parameters.reference * 4096.0).clamp(0.0, 4095.0) as u32;
        ends.battery_sample.publish(now, &BatterySample { counts });
        clock.sleep_until(now + CONVERSION).await;
    }
}

/// The newest of what is compared with the truth.
#[derive(Default)]
struct Seen {
    attitude: Attitude,
    /// It may be armed.
    ready: bool,
    /// A motor is told to turn.
    turns: bool,
    input: ReceiverInput,
    /// Packets while it was armed, and for how long, looks.
    packets: u32,
    looks: u32,
}

/// How far a place is from the way to the leg after so many that are flown, and from those, m.
fn beside(Places(legs): &Places, flown: usize, place: &Vec3) -> f32 {
    let mut from = Vec3::zeros();
    let mut nearest = f32::INFINITY;
    for leg in legs.iter().take(flown + 1) {
        let way = leg.place - from;
        let along = ((*place - from).dot(&way) / way.norm_squared().max(1e-6)).clamp(0.0, 1.0);
        // Down to the ground below it is on the way, too.
        let off = *place - (from + way * along);
        let off = Vec3::new(off.x, off.y, off.z.min(0.0));
        nearest = nearest.min(off.norm());
        from = leg.place;
    }
    if nearest.is_finite() { nearest } else { 0.0 }
}

/// The world during a flight, and what is watched of it.
pub struct Around<'a> {
    newest: &'a RefCell<Newest>,
    world: World,
    setup: &'a Setup,
    wrong: Wrong,
    progress: &'a Progress,
    lights: &'a Cell<ControlState>,
    motors: MotorModel,
    duties: topics::ActuatorMotorRx<'a>,
    seen: Seen,
    spectator: Spectator,
    outcome: Outcome,
}

impl Around<'_> {
    fn look(&mut self, now: Instant, truth: &Truth) {
        let (state, stays) = (self.lights.get(), self.progress.stays.get());
        let is_last = self.progress.legs.get() == self.outcome.legs[1];
        let done = self.progress.legs.get();
        let shown = Shown {
            ready: self.seen.ready,
            armed: state.armed,
            height: self.world.height_at(now) - self.setup.simulation.plant.ground_height,
            stays,
            moves: truth.velocity.horizontal().norm() > MOVES,
            lands: is_last && truth.velocity.z > SINKS,
            turns: self.seen.turns,
            scrapes: self.world.inspect(|body| body.scrapes()),
            // Stunts and sticks lead anywhere.
            beside: match (self.setup.stunt, &self.setup.sticks) {
                (None, None) => beside(&self.setup.mission, done, &truth.position).into(),
                _ => 0.0,
            },
        };
        self.outcome.look(now, &shown, truth, &self.wrong.injector);
        let Measured { attitude, estimate, position, .. } = &mut self.outcome.measured;
        let [roll, pitch, _] = frame::roll_pitch_yaw(&truth.attitude);
        if state.armed {
            self.seen.looks += 1;
            let angle = self.seen.attitude.angle;
            estimate.add((angle.x - roll).into());
            estimate.add((angle.y - pitch).into());
        }
        if stays && state.armed {
            let leg = self.setup.mission.0.get(self.progress.legs.get()).map_or(Vec3::zeros(), |leg| leg.place);
            position.add((truth.position - leg).horizontal().norm().into());
            if state.angle_mode {
                let asked = |stick: f32| (stick - 0.5) / 0.5 * self.setup.parameters.stick.angle_max;
                attitude.add((asked(self.seen.input.roll) - roll).into());
                attitude.add((asked(self.seen.input.pitch) - pitch).into());
            }
        }
    }
}

impl vehicle::Around for Around<'_> {
    type Runnables = Runnables;
    type Outcome = Outcome;

    fn drive(&mut self, _: Instant) {
        if self.duties.has_new()
            && let Some(output) = self.duties.latest()
        {
            // As pulses, which a speed controller measures.
            let protocol = esc::Protocol::Oneshot125;
            let mut sent = MotorOutput { armed: output.data.armed, count: 4, ..MotorOutput::default() };
            for (place, share) in MOTORS.iter().zip(output.data.duty) {
                sent.duty[*place] = protocol.share(protocol.microseconds(esc::counts(share)));
            }
            let Ok(()) = self.motors.write(&sent);
        }
    }

    fn show(&mut self, now: Instant) {
        self.wrong.act(now, &self.world);
    }

    fn published(&mut self, topic: usize, at: Instant, words: &[u32]) {
        if self.setup.live.is_some() {
            self.newest.borrow_mut().note(topic, at, words);
        }
        let seen = &mut self.seen;
        match Id::ALL.get(topic) {
            Some(Id::attitude) => seen.attitude = message(words).unwrap_or(seen.attitude),
            Some(Id::actuator_motor) => {
                seen.turns =
                    message(words).is_some_and(|output: MotorOutput| output.duty.iter().any(|duty| *duty > 0.0));
            }
            Some(Id::control_state) => self.lights.set(message(words).unwrap_or(self.lights.get())),
            Some(Id::flight_status) => {
                seen.ready = message(words).is_some_and(|status: FlightStatus| status.blocks.is_empty());
            }
            Some(Id::receiver_input) => {
                seen.input = message(words).unwrap_or(seen.input);
                seen.packets += u32::from(self.lights.get().armed);
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
        let [_, legs] = self.outcome.legs;
        let ControlState { armed, calibrating, .. } = self.lights.get();
        let word = match (armed, calibrating) {
            (true, _) => "flying",
            (false, true) => "calibrating",
            (false, false) => "on the ground",
        };
        (self.progress.legs.get() as f32 / legs.max(1) as f32, word)
    }

    fn is_over(&mut self, now: Instant) -> bool {
        if let Some(live) = &self.setup.live {
            return live.ports.are_closed();
        }
        // Sticks are played to their end, whatever they lead to.
        let out = self.setup.sticks.is_none() && self.outcome.is_out();
        let (end, cut) = (self.progress.finished.get(), out);
        self.spectator.is_over(now, end, cut, &self.wrong.injector, PATIENCE)
    }

    fn finish(self) -> Outcome {
        let Self { seen, lights, mut outcome, progress, spectator, wrong, setup, .. } = self;
        outcome.finished = progress.finished.get();
        outcome.live = self.setup.live.is_some();
        outcome.by_sticks = self.setup.sticks.is_some();
        outcome.legs[0] = progress.legs.get();
        outcome.end(&setup.faults, Some(&wrong.injector), spectator.truth(), lights.get().armed);
        let seconds = f64::from(seen.looks) * LOOK.seconds_f64();
        outcome.measured.packets = (seconds > 0.0).then(|| f64::from(seen.packets) / seconds);
        outcome
    }
}
