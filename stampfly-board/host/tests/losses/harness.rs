//! A vehicle in simulation with a script in place of the ground station, and hands on what may fail.
//!
//! The same stack as `simulate::fly` runs, without mission, log and figures; in exchange a script may use every
//! command there is, press the button and silence the inertial sensor.

use stampfly_board::messages::{ButtonContact, TelemetryFrame};
use stampfly_board::vehicle::{Assembled, assemble};
use stampfly_board::{VehicleConfig, wiring};
use stampfly_bus::Band;
use stampfly_drivers::{
    Barometer, Button, Imu, Magnetometer, MotorOutputs, OpticalFlow, PowerMonitor, RangeFinder, Sample,
};
use stampfly_sim::sensors::{ButtonModel, Sensors};
use stampfly_sim::time::{Clock, Tasks};
use stampfly_sim::{Simulation, SimulationConfig, Truth};
use stampfly_types::messages::{
    Alerts, FlightState, GuidedCommand, GuidedKind, MotorOutput, PilotInput, SystemAlert, SystemMode,
};
use stampfly_types::{Duration, Instant, Message, Vec3};
use std::cell::Cell;
use std::convert::Infallible;
use std::pin::Pin;

/// What a script can do.
pub struct Hands<'b> {
    pub clock: Clock,
    guided: wiring::command_guided::Tx<'b>,
    pilot: wiring::command_pilot::Tx<'b>,
    telemetry: wiring::telemetry::Rx<'b>,
    pub button: ButtonModel,
    pub imu_silent: &'b Cell<bool>,
}

impl Hands<'_> {
    pub async fn sleep(&self, seconds: f32) {
        self.clock.sleep_until(self.clock.now() + Duration::from_seconds(seconds)).await;
    }

    /// Sends a command and returns the instant.
    pub fn command(&mut self, kind: GuidedKind) -> Instant {
        let now = self.clock.now();
        let position = Vec3::new(0.0, 0.0, -0.5);
        self.guided.publish(now, GuidedCommand { kind, position, ..Default::default() }).expect("room in the queue");
        now
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
        self.wait_for(|frame| frame.state == FlightState::IdleGround && frame.blocks.is_empty()).await;
        self.command(GuidedKind::Arm);
        self.wait_for(|frame| frame.armed).await;
        self.command(GuidedKind::TakeOff);
        self.wait_for(|frame| frame.state == FlightState::Flying).await;
    }

    /// Presses the button for a fifth of a second.
    pub async fn click(&self) {
        self.button.press(true);
        self.sleep(0.2).await;
        self.button.press(false);
    }
}

/// What came of it: every sample of the topics that matter, and the truth beside every motor command.
#[derive(Default)]
pub struct Seen {
    pub modes: Vec<(Instant, SystemMode)>,
    pub alerts: Vec<(Instant, Alerts)>,
    pub motors: Vec<(Instant, MotorOutput)>,
    pub truths: Vec<(Instant, Truth)>,
}

impl Seen {
    /// States in the order they were entered, with the instants.
    pub fn states(&self) -> Vec<(Instant, FlightState)> {
        let mut states: Vec<(Instant, FlightState)> = self.modes.iter().map(|(at, mode)| (*at, mode.state)).collect();
        states.dedup_by_key(|(_, state)| *state);
        states
    }

    /// When a state was first entered at or after an instant.
    pub fn entered(&self, state: FlightState, after: Instant) -> Option<Instant> {
        self.states().into_iter().find(|(at, entered)| *entered == state && *at >= after).map(|(at, _)| at)
    }

    pub fn end(&self) -> (&SystemMode, &Truth) {
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
        stretch.map(|place| (place - from).xy().norm()).fold(0.0, f32::max)
    }
}

type Script<'b> = Pin<Box<dyn Future<Output = ()> + 'b>>;

macro_rules! pump {
    ($sensor:expr, $publisher:expr, $silent:expr) => {{
        let (mut sensor, mut publisher) = ($sensor, $publisher);
        async move {
            loop {
                let Ok::<Sample<_>, Infallible>(sample) = sensor.next().await;
                if !$silent {
                    publisher.publish(sample.at, &sample.data);
                }
            }
        }
    }};
}

/// Runs a vehicle for this long with this script.
pub fn run(seed: u64, seconds: f32, script: impl for<'b> FnOnce(Hands<'b>) -> Script<'b>) -> Seen {
    let config = SimulationConfig { seed, ..Default::default() };
    let Simulation { clock, world, sensors } = Simulation::new(&config);
    let Sensors { imu, tof, flow, mag, baro, power, mut motors, button, .. } = sensors;
    let mut bus = wiring::Bus::new();
    let imu_silent = &Cell::new(false);
    let wiring::Split { ports, mut taps, heads } = bus.split(None);
    let Assembled { mut flight_loop, outside } = assemble(ports, heads, &VehicleConfig::default(), config.start);
    let mut duties = outside.motors;

    let mut tasks = Tasks::new(clock.clone());
    tasks.spawn(pump!(imu, outside.imu, imu_silent.get()));
    tasks.spawn(pump!(tof, outside.tof, false));
    tasks.spawn(pump!(flow, outside.flow, false));
    tasks.spawn(pump!(mag, outside.mag, false));
    tasks.spawn(pump!(baro, outside.baro, false));
    tasks.spawn(pump!(power, outside.power, false));
    let (mut pin, mut contact, watch) = (button.clone(), outside.button, clock.clone());
    tasks.spawn(async move {
        loop {
            contact.publish(watch.now(), &ButtonContact { pressed: pin.is_pressed() });
            watch.sleep_until(watch.now() + Duration::from_millis(20)).await;
        }
    });
    tasks.spawn(script(Hands {
        clock: clock.clone(),
        guided: outside.guided,
        pilot: outside.pilot,
        telemetry: outside.telemetry,
        button,
        imu_silent,
    }));

    let mut seen = Seen::default();
    let end = config.start + Duration::from_seconds(seconds);
    while clock.now() < end {
        let tick = flight_loop.next_tick().filter(|tick| *tick > clock.now());
        let next = tasks.next_deadline().into_iter().chain(tick).min().expect("sensors never end");
        tasks.run_until(next.max(clock.now()));
        let now = clock.now();
        flight_loop.run_band(Band::Flight, now, &mut ());
        if duties.has_new()
            && let Some(output) = duties.latest()
        {
            let Ok(()) = motors.write(&output.data);
            seen.truths.push((now, world.truth_at(now)));
        }
        flight_loop.run_band(Band::Background, now, &mut ());
        taps.drain(&mut |id, at, _, words| match id {
            wiring::Id::system_mode => seen.modes.push((at, message(words))),
            wiring::Id::system_alert => seen.alerts.push((at, message::<SystemAlert>(words).active)),
            wiring::Id::actuator_motor => seen.motors.push((at, message(words))),
            _ => {}
        });
    }
    assert_eq!(taps.lost(), 0);
    drop(tasks);
    seen
}

fn message<M: Message>(words: &[u32]) -> M
where
    M::Words: for<'w> TryFrom<&'w [u32]>,
{
    M::Words::try_from(words).ok().and_then(|words| M::from_words(&words)).expect("what was published")
}
