//! A vehicle in simulation with a script in place of the ground station, and hands on what may fail.
//!
//! The simulator's executor flies the stack as in every mission, in surroundings of this test's own: without mission, log
//! and figures; in exchange a script may use every command there is, press the button and silence the inertial sensor.

use crate::thorough::is_thorough;
use stampfly_board::VehicleConfig;
use stampfly_board::messages::{ButtonContact, TelemetryFrame};
use stampfly_board::schedule::Runnables;
use stampfly_board::topics::{self, Id};
use stampfly_drivers::{
    Barometer, Button, Imu, Magnetometer, MotorOutputs, OpticalFlow, PowerMonitor, RangeFinder, Sample,
};
use stampfly_flight::newest::message;
use stampfly_sim::plant::{Hand, RotorFault};
use stampfly_sim::sensors::{ButtonModel, MotorModel, Sensors};
use stampfly_sim::time::{Clock, Tasks};
use stampfly_sim::vehicle::{self, FlightOptions};
use stampfly_sim::{Simulation, SimulationConfig, Truth, World};
use stampfly_types::messages::{
    Alerts, BaroData, ControlOutput, EstimatorStatus, FlightMode, FlightPhase, FlightStatus, FlowData, GuidedCommand,
    GuidedKind, ImuData, MagData, MotorOutput, PilotInput, PowerData, StateEstimate, SystemAlert, TofData,
};
use stampfly_types::{Duration, Instant, Vec3};
use std::cell::Cell;
use std::convert::Infallible;
use std::pin::Pin;
use std::rc::Rc;

/// What a script can do.
pub struct Hands<'b> {
    pub clock: Clock,
    guided: topics::CommandGuidedTx<'b>,
    pilot: topics::CommandPilotTx<'b>,
    telemetry: topics::TelemetryRx<'b>,
    world: World,
    pub button: ButtonModel,
    pub imu_silent: &'b Cell<bool>,
    /// Since when the sensors lie.
    pub lying: &'b Cell<Option<Instant>>,
    /// Range finder and barometer.
    pub height_silent: &'b Cell<bool>,
    is_over: &'b Cell<bool>,
}

/// What a broken sensor makes of a sample, so many seconds after it broke.
pub type Lie<T> = Option<Box<dyn FnMut(f32, &mut T)>>;

/// What is wrong with the sensors once a script has said that they lie.
#[derive(Default)]
pub struct Lies {
    pub imu: Lie<ImuData>,
    pub tof: Lie<TofData>,
    pub flow: Lie<FlowData>,
    pub baro: Lie<BaroData>,
    pub power: Lie<PowerData>,
}

impl Hands<'_> {
    pub async fn sleep(&self, seconds: f32) {
        self.clock.sleep_until(self.clock.now() + Duration::from_seconds(seconds)).await;
    }

    /// What a pilot sees who stands beside it.
    pub fn truth(&self) -> Truth {
        self.world.truth_at(self.clock.now())
    }

    /// Sends a command and returns the instant.
    pub fn command(&mut self, kind: GuidedKind) -> Instant {
        self.command_at(kind, 0.5)
    }

    /// The same with a height, m.
    pub fn command_at(&mut self, kind: GuidedKind, height: f32) -> Instant {
        let now = self.clock.now();
        let position = Vec3::new(0.0, 0.0, -height);
        self.guided.publish(now, GuidedCommand { kind, position, ..Default::default() }).expect("room in the queue");
        now
    }

    /// Appends a way-point, world NED, m.
    pub fn way_point(&mut self, position: Vec3) {
        let command = GuidedCommand { kind: GuidedKind::WayPoint, position, ..Default::default() };
        self.guided.publish(self.clock.now(), command).expect("room in the queue");
    }

    /// A frame from the pilot's transmitter; returns the instant.
    pub fn frame(&mut self, input: &PilotInput) -> Instant {
        self.pilot.publish(self.clock.now(), input);
        self.clock.now()
    }

    pub fn telemetry(&mut self) -> TelemetryFrame {
        self.telemetry.latest().map(|frame| frame.data).unwrap_or_default()
    }

    /// Waits until telemetry says so, with signs of life.
    pub async fn wait_for(&mut self, condition: impl Fn(&TelemetryFrame) -> bool) {
        while !condition(&self.telemetry()) {
            self.command(GuidedKind::None);
            self.sleep(0.02).await;
        }
    }

    /// Arms and takes off by command, and returns when the vehicle flies.
    pub async fn take_off(&mut self) {
        self.wait_for(|frame| frame.phase == FlightPhase::IdleGround && frame.blocks.is_empty()).await;
        self.command(GuidedKind::Arm);
        self.wait_for(|frame| frame.armed).await;
        self.command(GuidedKind::TakeOff);
        self.wait_for(|frame| frame.phase == FlightPhase::Flying).await;
    }

    /// A hand holds the vehicle where it is, or lets it go; returns the instant.
    pub fn hold(&self, holds: bool) -> Instant {
        let now = self.clock.now();
        self.world.change_scene(now, |scene, motion| {
            scene.hand = holds.then_some(Hand { position: motion.position, attitude: motion.attitude });
        });
        now
    }

    /// This rotor has this share of its thrust from now on.
    pub fn weaken(&self, rotor: usize, thrust: f64) {
        self.world.set_rotor_fault(self.clock.now(), rotor, RotorFault { thrust, ..RotorFault::NONE });
    }

    /// Nothing more is to be seen: ends the flight. In the thorough size it goes on until its time is over.
    pub fn leave(&self) {
        self.is_over.set(!is_thorough());
    }

    /// Presses the button for a fifth of a second.
    pub async fn click(&self) {
        self.button.press(true);
        self.sleep(0.2).await;
        self.button.press(false);
    }
}

/// Sticks and switches at rest.
pub const STICKS: PilotInput =
    PilotInput { roll: 0.0, pitch: 0.0, yaw: 0.0, throttle: 0.0, mode: FlightMode::PosHold, arm: false, kill: false };

/// The pilot sends this for so long.
pub async fn send(hands: &mut Hands<'_>, seconds: f32, frame: PilotInput) {
    for _ in 0..(seconds / 0.02) as u32 {
        hands.frame(&frame);
        hands.sleep(0.02).await;
    }
}

/// The pilot arms by switch in position hold and climbs for so long.
pub async fn climb(hands: &mut Hands<'_>, seconds: f32) {
    while hands.telemetry().phase != FlightPhase::IdleGround || !hands.telemetry().blocks.is_empty() {
        send(hands, 0.1, STICKS).await;
    }
    while hands.telemetry().phase != FlightPhase::Flying {
        send(hands, 0.1, PilotInput { arm: true, ..STICKS }).await;
    }
    send(hands, seconds, PilotInput { arm: true, throttle: 1.0, ..STICKS }).await;
    send(hands, 2.0, PilotInput { arm: true, ..STICKS }).await;
}

/// Where a script leaves an instant, and where a test finds it.
pub fn instant() -> (Rc<Cell<Instant>>, Rc<Cell<Instant>>) {
    let cell = Rc::new(Cell::new(Instant::ZERO));
    (cell.clone(), cell)
}

/// What came of it: every sample of the topics that matter, and the truth beside every motor command.
#[derive(Default)]
pub struct Seen {
    pub modes: Vec<(Instant, FlightStatus)>,
    pub alerts: Vec<(Instant, Alerts)>,
    pub demands: Vec<(Instant, ControlOutput)>,
    pub motors: Vec<(Instant, MotorOutput)>,
    pub truths: Vec<(Instant, Truth)>,
    pub estimates: Vec<(Instant, StateEstimate)>,
    pub estimator: Vec<(Instant, EstimatorStatus)>,
}

impl Seen {
    /// States in the order they were entered, with the instants.
    pub fn phases(&self) -> Vec<(Instant, FlightPhase)> {
        let mut phases: Vec<(Instant, FlightPhase)> = self.modes.iter().map(|(at, mode)| (*at, mode.phase)).collect();
        phases.dedup_by_key(|(_, phase)| *phase);
        phases
    }

    /// The highest that it was after `since`, m.
    pub fn highest(&self, since: Instant) -> f32 {
        self.truths.iter().filter(|(at, _)| *at >= since).map(|(_, truth)| -truth.position.z).fold(0.0, f32::max)
    }

    /// When a state was first entered at or after an instant.
    pub fn entered(&self, phase: FlightPhase, after: Instant) -> Option<Instant> {
        self.phases().into_iter().find(|(at, entered)| *entered == phase && *at >= after).map(|(at, _)| at)
    }

    pub fn end(&self) -> (&FlightStatus, &Truth) {
        (&self.modes.last().expect("it ran").1, &self.truths.last().expect("it ran").1)
    }

    /// From the first motor command at or after `since` that has every motor off, how long it took to get there. They
    /// have to stay off.
    pub fn motors_off_after(&self, since: Instant) -> Duration {
        let off = |output: &MotorOutput| !output.armed && output.duty.iter().all(|duty| *duty == 0.0);
        let later = || self.motors.iter().filter(|(at, _)| *at >= since);
        let (at, _) = later().find(|(_, output)| off(output)).expect("the motors are switched off");
        assert!(later().filter(|(later, _)| later >= at).all(|(_, output)| off(output)), "and stay off");
        at.since(since)
    }

    /// The largest horizontal distance from where it was at `since`, until `until`.
    pub fn drift(&self, since: Instant, until: Instant) -> f32 {
        let mut stretch =
            self.truths.iter().filter(|(at, _)| (since..=until).contains(at)).map(|(_, truth)| truth.position);
        let from = stretch.next().expect("a stretch");
        stretch.map(|place| (place - from).horizontal().norm()).fold(0.0, f32::max)
    }
}

type Script<'b> = Pin<Box<dyn Future<Output = ()> + 'b>>;

macro_rules! pump {
    ($sensor:expr, $publisher:expr, $silent:expr, $lie:expr, $lying:expr) => {{
        let (mut sensor, mut publisher, mut lie) = ($sensor, $publisher, $lie);
        async move {
            loop {
                let Ok::<Sample<_>, Infallible>(mut sample) = sensor.next().await;
                if let (Some(lie), Some(since)) = (&mut lie, $lying.get()) {
                    lie(sample.at.since(since).seconds(), &mut sample.data);
                }
                if !$silent {
                    publisher.publish(sample.at, &sample.data);
                }
            }
        }
    }};
}

/// A world with a script in it.
struct Stage<S> {
    clock: Clock,
    world: World,
    sensors: Option<Sensors>,
    imu_silent: Cell<bool>,
    lying: Cell<Option<Instant>>,
    lies: Lies,
    height_silent: Cell<bool>,
    is_over: Cell<bool>,
    script: Option<S>,
    end: Instant,
}

impl<S: for<'b> FnOnce(Hands<'b>) -> Script<'b>> vehicle::Surroundings for Stage<S> {
    type Runnables = Runnables;
    type Outcome = Seen;
    type Around<'a>
        = Watch<'a>
    where
        S: 'a;

    fn clock(&self) -> Clock {
        self.clock.clone()
    }

    fn start<'a>(&'a mut self, tasks: &mut Tasks<'a>, outside: topics::Outside<'a>) -> Watch<'a> {
        let Self { clock, world, sensors, imu_silent, height_silent, lying, lies, script, is_over, end } = self;
        let (imu_silent, height_silent): (&Cell<bool>, &Cell<bool>) = (imu_silent, height_silent);
        let (lying, is_over): (&Cell<Option<Instant>>, &Cell<bool>) = (lying, is_over);
        let lies = std::mem::take(lies);
        let (sensors, script) = sensors.take().zip(script.take()).expect("started once");
        let Sensors { imu, tof, flow, mag, baro, power, motors, button, .. } = sensors;
        tasks.spawn(pump!(imu, outside.imu.sensor_imu, imu_silent.get(), lies.imu, lying));
        tasks.spawn(pump!(tof, outside.tof.sensor_tof, height_silent.get(), lies.tof, lying));
        tasks.spawn(pump!(flow, outside.flow.sensor_flow, false, lies.flow, lying));
        tasks.spawn(pump!(mag, outside.mag.sensor_mag, false, None::<Box<dyn FnMut(f32, &mut MagData)>>, lying));
        tasks.spawn(pump!(baro, outside.baro.sensor_baro, height_silent.get(), lies.baro, lying));
        tasks.spawn(pump!(power, outside.power.sensor_power, false, lies.power, lying));
        let (mut pin, mut contact, watch) = (button.clone(), outside.button_pin.button_contact, clock.clone());
        tasks.spawn(async move {
            loop {
                contact.publish(watch.now(), &ButtonContact { pressed: pin.is_pressed() });
                watch.sleep_until(watch.now() + Duration::from_millis(20)).await;
            }
        });
        tasks.spawn(script(Hands {
            clock: clock.clone(),
            guided: outside.link.command_guided,
            pilot: outside.link.command_pilot,
            telemetry: outside.link.telemetry,
            world: world.clone(),
            button,
            imu_silent,
            lying,
            height_silent,
            is_over,
        }));
        let (duties, world, end) = (outside.motors.actuator_motor, world.clone(), *end);
        Watch { world, duties, motors, is_over, end, seen: Seen::default() }
    }
}

/// Drives the motors, and notes what there is to see.
struct Watch<'a> {
    world: World,
    duties: topics::ActuatorMotorRx<'a>,
    motors: MotorModel,
    is_over: &'a Cell<bool>,
    end: Instant,
    seen: Seen,
}

impl vehicle::Around for Watch<'_> {
    type Runnables = Runnables;
    type Outcome = Seen;

    fn drive(&mut self, now: Instant) {
        if self.duties.has_new()
            && let Some(output) = self.duties.latest()
        {
            let Ok(()) = self.motors.write(&output.data);
            self.seen.truths.push((now, self.world.truth_at(now)));
        }
    }

    fn published(&mut self, topic: usize, at: Instant, words: &[u32]) {
        let what = "what was published";
        match Id::ALL[topic] {
            Id::flight_status => self.seen.modes.push((at, message(words).expect(what))),
            Id::system_alert => self.seen.alerts.push((at, message::<SystemAlert>(words).expect(what).active)),
            Id::estimate_state => self.seen.estimates.push((at, message(words).expect(what))),
            Id::estimate_status => self.seen.estimator.push((at, message(words).expect(what))),
            Id::control_output => self.seen.demands.push((at, message(words).expect(what))),
            Id::actuator_motor => self.seen.motors.push((at, message(words).expect(what))),
            _ => {}
        }
    }

    fn progress(&self) -> (f32, &'static str) {
        (0.0, "")
    }

    fn is_over(&mut self, now: Instant) -> bool {
        now >= self.end || self.is_over.get()
    }

    fn finish(self) -> Seen {
        self.seen
    }
}

/// Runs a vehicle for this long with this script.
pub fn run(seed: u64, seconds: f32, script: impl for<'b> FnOnce(Hands<'b>) -> Script<'b>) -> Seen {
    run_in(|_| {}, Lies::default(), seed, seconds, script)
}

/// The same in surroundings of the caller's, with sensors that lie.
pub fn run_in(
    surroundings: impl FnOnce(&mut SimulationConfig),
    lies: Lies,
    seed: u64,
    seconds: f32,
    script: impl for<'b> FnOnce(Hands<'b>) -> Script<'b>,
) -> Seen {
    let mut config = SimulationConfig { seed, ..SimulationConfig::new(stampfly_board::simulation::PLANT) };
    surroundings(&mut config);
    let Simulation { clock, world, sensors } = Simulation::new(&config);
    let limit = Duration::from_seconds(seconds);
    let end = config.start + limit;
    let (sensors, script) = (Some(sensors), Some(script));
    let [imu_silent, height_silent, is_over] = [const { Cell::new(false) }; 3];
    let lying = Cell::new(None);
    let mut stage = Stage { clock, world, sensors, imu_silent, height_silent, lying, lies, is_over, script, end };
    let options = FlightOptions { start: config.start, limit, jitter: None };
    let ended = vehicle::fly(&VehicleConfig::default(), &options, &mut stage, &mut (), &mut |_, _| {});
    assert_eq!(ended.log_lost, 0);
    ended.outcome
}
