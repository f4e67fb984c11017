//! The host executor: one simulated vehicle with its whole flight stack, on virtual time.
//!
//! One thread. Drivers and the ground station are async tasks on the simulator's clock; the runnables run when the
//! [`FlightLoop`] says they are due. The same configuration gives the same flight, bit for bit.
//!
//! With [`FlightConfig::jitter`] the flight band starts late by a seeded amount and interrupts background activations
//! between reading and publishing, as a preemptive executor on two cores would: generations are skipped, and the log
//! must still replay.

use crate::ground_station::{self, Progress};
use crate::metrics::{Collector, Metrics, Snapshot};
use crate::mission::Mission;
use crate::recorder::Recorder;
use crate::sensing::{self, Healths, Models, Sensing, Shared, Topics};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use stampfly_board::messages::ButtonContact;
use stampfly_board::vehicle::{Assembled, Outside, assemble};
use stampfly_board::{Pending, VehicleConfig, wiring};
use stampfly_bus::Band;
use stampfly_drivers::{Button, Indicator, MotorOutputs};
use stampfly_sim::chips;
use stampfly_sim::sensors::{MotorModel, Sensors};
use stampfly_sim::time::{Clock, Tasks};
use stampfly_sim::{Simulation, SimulationConfig, Truth};
use stampfly_types::messages::{FlightState, MotorOutput, Setpoint, StateEstimate, SystemMode};
use stampfly_types::{Duration, Instant, Message, Quat, Vec3, frame};

/// All that decides a flight.
#[derive(Clone, Debug)]
pub struct FlightConfig {
    /// The vehicle in its surroundings.
    pub simulation: SimulationConfig,
    /// The flight stack.
    pub vehicle: VehicleConfig,
    /// What to fly.
    pub mission: Mission,
    /// What the sensor tasks read.
    pub sensing: Sensing,
    /// Is the vehicle watched by a motion capture system?
    pub cameras: bool,
    /// Seed of the executor's delays; `None` for an executor that is never late.
    pub jitter: Option<u64>,
    /// The flight is broken off after this long.
    pub limit: Duration,
}

impl FlightConfig {
    /// The reference mission with this seed.
    #[must_use]
    pub fn reference(seed: u64) -> Self {
        Self {
            simulation: SimulationConfig { seed, ..SimulationConfig::default() },
            vehicle: VehicleConfig::default(),
            mission: Mission::parse(crate::mission::REFERENCE).unwrap_or_else(|_| Mission { steps: Vec::new() }),
            sensing: Sensing::Models,
            cameras: false,
            jitter: None,
            limit: Duration::from_secs(180),
        }
    }
}

/// A change of state or mode, for people.
#[derive(Clone, Debug, PartialEq)]
pub struct Phase {
    /// When it began.
    pub since: Instant,
    /// State.
    pub state: FlightState,
    /// Mode.
    pub mode: stampfly_types::messages::FlightMode,
}

/// How a flight went.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The figures.
    pub metrics: Metrics,
    /// States and modes, in order.
    pub phases: Vec<Phase>,
    /// Was the mission flown to its end?
    pub finished: bool,
    /// Hash over everything that was published.
    pub log_hash: u64,
    /// Simulated time.
    pub duration: Duration,
    /// Simulated time over wall time.
    pub realtime_factor: f64,
    /// Largest true tilt, degrees.
    pub worst_tilt_deg: f64,
    /// Battery voltage at the start and at the end, V.
    pub battery: [f32; 2],
    /// Was every duty a number from 0 to 1, and 0 while the vehicle was not armed?
    pub motors_sane: bool,
    /// Samples the log missed.
    pub log_lost: u32,
}

/// After the mission the vehicle is watched for this long.
const TAIL: Duration = Duration::from_secs(1);

/// What is watched beside the bus: truth, and the newest of what it is compared with.
struct Watch {
    collector: Collector,
    setpoint: Setpoint,
    estimate: StateEstimate,
    mode: SystemMode,
    phases: Vec<Phase>,
    worst_tilt: f32,
    battery: Option<[f32; 2]>,
    motors_sane: bool,
    origin: Vec3,
    turn: Quat,
    truths: u32,
}

impl Watch {
    /// Watches a vehicle that stands like this at the start.
    fn new(start: &Truth) -> Self {
        Self {
            collector: Collector::default(),
            setpoint: Setpoint::default(),
            estimate: StateEstimate::default(),
            mode: SystemMode::default(),
            phases: Vec::new(),
            worst_tilt: 0.0,
            battery: None,
            motors_sane: true,
            origin: start.position,
            turn: frame::from_yaw(-frame::yaw(&start.attitude)),
            truths: 0,
        }
    }

    /// Notes what a topic published. Returns the instant of a new set-point: that is when the truth is due.
    fn note(&mut self, id: wiring::Id, at: Instant, words: &[u32]) -> Option<Instant> {
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
            wiring::Id::setpoint => {
                read(words, &mut self.setpoint);
                return Some(at);
            }
            wiring::Id::estimate_state => read(words, &mut self.estimate),
            wiring::Id::system_mode => {
                read(words, &mut self.mode);
                let (state, mode) = (self.mode.state, self.mode.mode);
                if self.phases.last().is_none_or(|last| (last.state, last.mode) != (state, mode)) {
                    self.phases.push(Phase { since: at, state, mode });
                }
            }
            wiring::Id::actuator_motor => {
                let mut output = MotorOutput::default();
                read(words, &mut output);
                let highest = if self.mode.armed { 1.0 } else { 0.0 };
                self.motors_sane &= output.duty.iter().all(|duty| (0.0..=highest).contains(duty));
            }
            _ => {}
        }
        None
    }

    /// Compares with the truth at the instant of a set-point.
    ///
    /// Nothing on board knows north: the vehicle's world begins where it stood and ahead of it, so the truth is turned
    /// and moved into that world first.
    fn compare(&mut self, at: Instant, truth: &mut Truth, recorder: &mut Recorder) {
        truth.position = self.turn * (truth.position - self.origin);
        truth.velocity = self.turn * truth.velocity;
        truth.wind = self.turn * truth.wind;
        truth.attitude = self.turn * truth.attitude;
        self.truths += 1;
        recorder.truth(at, self.truths, truth);
        self.worst_tilt = self.worst_tilt.max(frame::tilt(&truth.attitude));
        let first = self.battery.map_or(truth.battery_voltage, |[first, _]| first);
        self.battery = Some([first, truth.battery_voltage]);
        let (setpoint, estimate, mode) = (self.setpoint, self.estimate, self.mode);
        self.collector.add(&Snapshot { at, truth, setpoint: &setpoint, estimate: &estimate, mode: &mode });
    }
}

/// How late the executor is, drawn from a seed.
struct Jitter {
    random: Option<ChaCha8Rng>,
}

impl Jitter {
    fn new(seed: Option<u64>) -> Self {
        Self { random: seed.map(ChaCha8Rng::seed_from_u64) }
    }

    /// Delay of the flight band: mostly some 100 µs, one time in twenty several milliseconds.
    fn flight(&mut self) -> Duration {
        let Some(random) = &mut self.random else { return Duration::ZERO };
        let draw = u64::from(random.next_u32());
        Duration::from_micros(match draw % 20 {
            0 => 2_000 + draw / 20 % 6_000,
            1..=3 => 300 + draw / 20 % 1_700,
            _ => draw / 20 % 300,
        })
    }

    /// Time between reading and publishing of a background activation.
    fn background(&mut self) -> Duration {
        let Some(random) = &mut self.random else { return Duration::ZERO };
        let draw = u64::from(random.next_u32());
        Duration::from_micros(if draw % 10 == 0 { draw / 10 % 10_000 } else { draw / 10 % 500 })
    }
}

/// Flies one mission. `report` is called about ten times a simulated second with the share of mission steps done.
///
/// # Panics
/// Never by design; a panic here is a defect of the flight stack.
pub fn fly(config: &FlightConfig, recorder: &mut Recorder, report: &mut dyn FnMut(f32, FlightState)) -> Outcome {
    let started = std::time::Instant::now();
    let start = config.simulation.start;
    let Simulation { clock, world, sensors } = Simulation::new(&config.simulation);
    let Sensors { imu, tof, flow, mag, baro, cameras, power, mut motors, mut indicator, button } = sensors;
    let mut bus = wiring::Bus::new();
    let wiring::Split { ports, mut taps, heads } = bus.split(None);
    let Assembled { mut flight_loop, outside } = assemble(ports, heads, &config.vehicle, start);
    let (mut duties, mut signals) = (outside.motors, outside.indicator);
    recorder.begin(start, &config.vehicle);

    let (progress, health) = (Progress::default(), Healths::default());
    let board = chips::Board::new(&world, &clock, &config.simulation, &sensing::IMAGE);
    let mut shared = Shared::new(&clock, &board.i2c);
    let mut tasks = Tasks::new(clock.clone());
    let Outside {
        imu: to_imu, tof: to_tof, tof_front, flow: to_flow, mag: to_mag, baro: to_baro, power: to_power, ..
    } = outside;
    let topics =
        Topics { imu: to_imu, tof: to_tof, tof_front, flow: to_flow, mag: to_mag, baro: to_baro, power: to_power };
    match config.sensing {
        Sensing::Models => {
            let models = Models { imu, tof, flow, mag, baro, power };
            sensing::start_models(&mut tasks, &clock, models, topics, &health);
        }
        Sensing::Chips => {
            sensing::start_drivers(&mut tasks, &clock, board, &mut shared, topics, &health);
        }
    }
    if config.cameras {
        sensing::start_cameras(&mut tasks, &clock, cameras, outside.cameras, &health);
    }
    tasks.spawn(watch_button(clock.clone(), button, outside.button));
    tasks.spawn(ground_station::fly(clock.clone(), &config.mission, outside.guided, outside.telemetry, &progress));

    let mut watch = Watch::new(&world.truth_at(start));
    let mut jitter = Jitter::new(config.jitter);
    let mut flight_at: Option<Instant> = None;
    let mut interrupted: Option<(Instant, Pending)> = None;
    let mut finished_at: Option<Instant> = None;
    let mut next_report = start;
    let end = start + config.limit;
    loop {
        let deadlines = [
            tasks.next_deadline(),
            // A tick that has passed is waiting for an executor that is late.
            flight_loop.next_tick().filter(|tick| *tick > clock.now()),
            flight_at,
            interrupted.as_ref().map(|(at, _)| *at),
        ];
        let Some(next) = deadlines.into_iter().flatten().min() else { break };
        tasks.run_until(next.max(clock.now()));
        let now = clock.now();
        // What came from outside is in the log before the activations that read it.
        drain(&mut taps, &mut watch, recorder, &world);

        recorder.turn(now);
        if flight_at.is_none() && flight_loop.is_due(Band::Flight, now) {
            flight_at = Some(now + jitter.flight());
        }
        if flight_at.is_some_and(|at| at <= now) {
            flight_at = None;
            flight_loop.run_band(Band::Flight, now, recorder);
            drive(&mut duties, &mut motors);
        }
        match interrupted.take() {
            Some((at, pending)) if at <= now => flight_loop.finish(pending, recorder),
            Some(pending) => interrupted = Some(pending),
            None => {
                while let Some(pending) = flight_loop.start_next(Band::Background, now, recorder) {
                    let takes = jitter.background();
                    if takes > Duration::ZERO {
                        interrupted = Some((now + takes, pending));
                        break;
                    }
                    flight_loop.finish(pending, recorder);
                }
            }
        }
        if let Some(signal) = signals.has_new().then(|| signals.latest()).flatten() {
            indicator.show(&signal.data);
        }
        drain(&mut taps, &mut watch, recorder, &world);

        if now >= next_report {
            next_report = now + Duration::from_millis(100);
            report(progress.done.get() as f32 / config.mission.steps.len().max(1) as f32, watch.mode.state);
        }
        if progress.finished.get() {
            let since = *finished_at.get_or_insert(now);
            if now.since(since) >= TAIL {
                break;
            }
        }
        if now >= end {
            break;
        }
    }
    drop(tasks);
    if let Some((_, pending)) = interrupted {
        flight_loop.finish(pending, recorder);
        drain(&mut taps, &mut watch, recorder, &world);
    }
    let duration = clock.now().since(start);
    recorder.end();
    Outcome {
        metrics: watch.collector.finish(),
        phases: watch.phases,
        finished: progress.finished.get(),
        log_hash: recorder.hash(),
        duration,
        realtime_factor: duration.seconds_f64() / started.elapsed().as_secs_f64(),
        worst_tilt_deg: f64::from(watch.worst_tilt.to_degrees()),
        battery: watch.battery.unwrap_or_default(),
        motors_sane: watch.motors_sane,
        log_lost: taps.lost(),
    }
}

fn drain(taps: &mut wiring::Taps<'_>, watch: &mut Watch, recorder: &mut Recorder, world: &stampfly_sim::World) {
    let mut due = None;
    taps.drain(&mut |id, at, generation, words| {
        recorder.sample(id, at, generation, words);
        due = watch.note(id, at, words).or(due);
    });
    if let Some(at) = due {
        watch.compare(at, &mut world.truth_at(at), recorder);
    }
}

/// Sends new duties to the motors.
fn drive(from: &mut wiring::actuator_motor::Rx<'_>, motors: &mut MotorModel) {
    if from.has_new()
        && let Some(output) = from.latest()
    {
        let Ok(()) = motors.write(&output.data);
    }
}

/// Looks at the button fifty times a second.
async fn watch_button(clock: Clock, mut button: impl Button, mut publisher: wiring::button_contact::Tx<'_>) {
    loop {
        publisher.publish(clock.now(), &ButtonContact { pressed: button.is_pressed() });
        clock.sleep_until(clock.now() + Duration::from_millis(20)).await;
    }
}
