//! A StampFly on a bench: the whole vehicle over emulated chips, a serial port, and somebody who holds it.
//!
//! The drivers, the flight stack, the lights, the buzzer and the console are those of the firmware; chips, wires, motors and
//! lights are emulated, and any of them may be [broken](fault). Whoever stands beside it [carries](Bench::carry) it, presses its
//! button, moves the sticks of its transmitter, and sees and hears what it does; whoever sits at the computer
//! [types](Bench::send) and reads. `stampfly doctor --emulated` examines it. Not for flights: those are in
//! [`flight`](super::flight).

pub mod fault;
mod people;
mod processor;

pub use fault::{Defect, Fault};
pub use people::{Lamp, Spin};

use super::faults::Wrong;
use super::plant::PLANT;
use super::sensing::{self, Healths, IMAGE, Others, Sensing, Shared};
use super::terminal::{StationRequests, Terminal};
use crate::VehicleConfig;
use crate::console::{Newest, Profile};
use crate::golden;
use crate::link::{self, Link, Outgoing};
use crate::messages::ButtonContact;
use crate::schedule::{ACTIVATIONS, Runnables};
use crate::topics::{self, Id};
use core::fmt::Display;
use people::{Loudspeaker, Wiring};
use processor::Processor;
use stampfly_bus::{Band, Taps as _};
use stampfly_drivers::{Button, Buzzer, Indicator, Lights, MotorOutputs};
use stampfly_flight::doctor::{Fact, FlashAccess, Restart};
use stampfly_flight::{Assembled, FlightLoop};
use stampfly_link::secure::{Guarded, MAX_FRAME, Policy};
use stampfly_link::{Address, ControlPacket, Session};
use stampfly_services::CommandArbiter;
use stampfly_sim::plant::{Hand, Pose};
use stampfly_sim::sensors::{ButtonModel, MotorModel};
use stampfly_sim::time::{Clock, Tasks};
use stampfly_sim::{Simulation, SimulationConfig, World, chips};
use stampfly_types::messages::{MotorOutput, PilotInput};
use stampfly_types::{Duration, Instant};
use std::string::String;
use std::vec::Vec;

/// What the program on the bench calls itself.
const VERSION: &str = concat!("stampfly-bench ", env!("CARGO_PKG_VERSION"));
const VEHICLE: Address = Address([0x34, 0x85, 0x18, 1, 2, 3]);
/// The transmitter that it was paired with.
const TRANSMITTER: Address = Address([2, 0, 0, 0, 0, 1]);
/// A hand moves in steps of this.
const HAND_STEP: Duration = Duration::from_millis(5);
/// The lights and the buzzer, as in the firmware.
const PEOPLE_STEP: Duration = Duration::from_millis(10);

/// A vehicle on a bench.
pub struct Bench<'b> {
    clock: Clock,
    world: World,
    tasks: Tasks<'b>,
    flight_loop: FlightLoop<'b, Runnables>,
    taps: topics::Taps<'b>,
    newest: Newest,
    profile: &'b Profile,
    health: &'b Healths,
    processor: Processor<'b>,
    config: VehicleConfig,
    console: topics::ConsoleEnds<'b>,
    terminal: Terminal,
    facts: [(&'static str, FactOf); 2],
    motors: (MotorModel, topics::ActuatorMotorRx<'b>),
    wiring: Wiring,
    signal: topics::SignalRx<'b>,
    status: Lights<Lamp, 1>,
    buzzer: Buzzer<Loudspeaker>,
    button: (ButtonModel, topics::ButtonContactTx<'b>),
    link: Link<'b>,
    arbiter: CommandArbiter,
    /// What its transmitter sends; `None` while that is off.
    sticks: Option<PilotInput>,
    /// From where to where the hand moves, and when.
    hand: Option<(Hand, Hand, Instant, Duration)>,
    next: [Instant; 3],
}

/// What the board says of itself.
#[derive(Clone, Copy)]
enum FactOf {
    Restart(Restart),
    Flash(FlashAccess),
}

/// Switches a vehicle on, with this defect if any, and hands it over. The same seed is the same specimen.
pub fn with_vehicle<T>(defect: Option<&Defect>, seed: u64, examine: impl FnOnce(&mut Bench<'_>) -> T) -> T {
    let mut plant = PLANT;
    if let Some(Defect::Battery(charge)) = defect {
        plant.battery_charge = *charge;
    }
    let configuration = SimulationConfig { seed, ..SimulationConfig::new(plant) };
    let Simulation { clock, world, sensors } = Simulation::new(&configuration);
    let board = chips::Board::on(&sensing::SPI, &world, &clock, &configuration, &IMAGE);
    if let Some(defect) = defect {
        defect.damage(&board);
    }
    let tested = golden::Outcome(fault::self_test(defect));
    let config = VehicleConfig::default();
    let wrong = Wrong::new(&[], clock.now(), seed);
    let (health, profile) = (Healths::default(), Profile::new(&ACTIVATIONS));
    let mut shared = Shared::new(&clock, &board.i2c);
    let mut bus = topics::Bus::new();
    let Assembled { flight_loop, outside, taps } = Assembled::new(&mut bus, None, &config, clock.now());
    let mut tasks = Tasks::new(clock.clone());
    let Others { motors, indicator, button, link, self_test, console, .. } = sensing::start_drivers(
        &mut tasks,
        &clock,
        (board, &mut shared),
        (sensors, &wrong),
        outside,
        (false, &config.corrections),
        &health,
    );
    let mut publisher = self_test.self_test;
    publisher.publish(clock.now(), &tested.message());
    let session = Session::new(VEHICLE, 1, Some(TRANSMITTER));
    let (flash, restart) = (fault::flash(defect), fault::restart(defect));
    let mut bench = Bench {
        world,
        tasks,
        flight_loop,
        taps,
        newest: Newest::new(),
        profile: &profile,
        health: &health,
        processor: Processor::new(&profile, &ACTIVATIONS, fault::load(defect), flash),
        config,
        console,
        terminal: Terminal::new(),
        facts: [("restart", FactOf::Restart(restart)), ("flash", FactOf::Flash(flash))],
        motors: (motors.0, motors.1.actuator_motor),
        wiring: Wiring::of(defect),
        signal: indicator.1.signal,
        status: Lights::status(Lamp::new(&clock, fault::is_dark(defect))),
        buzzer: Buzzer::new(Loudspeaker::new(&clock, fault::is_silent(defect))),
        button: (button.0, button.1.button_contact),
        link: Link::new(Guarded::new(None, session, Policy { accept_unauthenticated: true }), link),
        arbiter: CommandArbiter::new(),
        sticks: None,
        hand: None,
        next: [clock.now(); 3],
        clock,
    };
    examine(&mut bench)
}

impl Bench<'_> {
    /// The present instant.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.clock.now()
    }

    /// Lets time pass.
    pub fn pass(&mut self, time: Duration) {
        let end = self.clock.now() + time;
        loop {
            let [hand, people, radio] = self.next;
            let ticks = self.flight_loop.next_tick().filter(|tick| *tick > self.clock.now());
            let deadlines = [self.tasks.next_deadline(), ticks, Some(hand), Some(people), Some(radio)];
            let Some(next) = deadlines.into_iter().flatten().min().filter(|next| *next <= end) else { break };
            self.tasks.run_until(next.max(self.clock.now()));
            self.turn();
        }
        self.tasks.run_until(end);
        self.turn();
    }

    /// Everything that is due now.
    fn turn(&mut self) {
        let now = self.clock.now();
        let [hand, people, radio] = &mut self.next;
        let due = [(hand, HAND_STEP), (people, PEOPLE_STEP), (radio, link::PERIOD)].map(|(next, period)| {
            let due = *next <= now;
            if due {
                *next = now + period;
            }
            due
        });
        let [moves, shows, sends] = due;
        if moves {
            self.hold(now);
        }
        if sends {
            self.exchange(now);
            let pressed = self.wiring.contact(self.button.0.is_pressed());
            self.button.1.publish(now, &ButtonContact { pressed });
        }
        if self.flight_loop.run_band(Band::Flight, now, &mut self.processor) {
            self.drive();
        }
        self.flight_loop.run_band(Band::Background, now, &mut self.processor);
        if shows {
            if let Some(sample) = self.signal.latest() {
                self.status.show(&sample.data);
                self.buzzer.show(&sample.data);
            }
            self.status.step(now);
            let Ok(()) = self.buzzer.step(now);
        }
        let newest = &mut self.newest;
        self.taps.drain(&mut |topic, at, _, words| newest.note(topic, at, words));
    }

    fn drive(&mut self) {
        let (model, duties) = &mut self.motors;
        if let Some(output) = duties.has_new().then(|| duties.latest()).flatten() {
            let Ok(()) = model.write(&MotorOutput { duty: self.wiring.connect(output.data.duty), ..output.data });
        }
    }

    fn exchange(&mut self, now: Instant) {
        if let Some(sticks) = self.sticks.and_then(|sticks| self.wiring.transmit(sticks)) {
            let mut bytes = ControlPacket::from_pilot(VEHICLE, &sticks).to_bytes();
            // What is refused is counted in the session.
            let _ = self.link.receive(&mut self.arbiter, now, TRANSMITTER, &mut bytes);
        }
        for what in Outgoing::ALL {
            let _ = self.link.transmit(now, what, [0; 8], &mut [0; MAX_FRAME]);
        }
    }

    fn hold(&mut self, now: Instant) {
        let Some((from, to, begun, length)) = &self.hand else { return };
        let hand = from.toward(to, now.since(*begun).seconds_f64() / length.seconds_f64());
        self.world.change_scene(now, |scene, _| scene.hand = Some(hand));
    }

    /// Types into the serial port, keys as they are sent.
    pub fn send(&mut self, keys: &[u8]) {
        let facts: Vec<Fact<'_>> = self
            .facts
            .iter()
            .map(|(name, of)| {
                let (value, (verdict, advice)): (&dyn Display, _) = match of {
                    FactOf::Restart(restart) => (restart, restart.judge()),
                    FactOf::Flash(flash) => (flash, flash.judge()),
                };
                Fact { name, verdict, value, advice }
            })
            .collect();
        let requests = StationRequests {
            version: VERSION,
            newest: &self.newest,
            sensing: Sensing::Chips,
            health: self.health,
            profile: self.profile,
            facts: &facts,
            beside: None,
        };
        let ends = (&mut self.config, &mut self.console);
        self.terminal.send(self.clock.now(), keys, &requests, ends, |_, _| "not on this bench");
    }

    /// What the serial port has written since the last call.
    pub fn read(&mut self) -> String {
        core::mem::take(&mut self.terminal.screen)
    }

    /// A hand takes the vehicle to a place, world NED, m, turned by roll, pitch and yaw, rad, in this time, and holds it there.
    /// The floor is at zero.
    pub fn carry(&mut self, position: [f64; 3], turned: [f64; 3], time: Duration) {
        let now = self.clock.now();
        let motion = self.world.motion_at(now);
        let from = self
            .hand
            .as_ref()
            .map_or(Hand { position: motion.position, attitude: motion.attitude }, |(from, to, begun, length)| {
                from.toward(to, now.since(*begun).seconds_f64() / length.seconds_f64())
            });
        self.hand = Some((from, Hand::new(position, turned), now, time));
    }

    /// The hand lets go.
    pub fn let_go(&mut self) {
        self.hand = None;
        self.world.change_scene(self.clock.now(), |scene, _| scene.hand = None);
    }

    /// Height of a vehicle that stands on the floor, m.
    #[must_use]
    pub fn standing(&self) -> f64 {
        -Pose::standing(&PLANT, 0.0).position.z
    }

    /// Presses the button, or lets it go.
    pub fn press(&mut self, pressed: bool) {
        self.button.0.press(pressed);
    }

    /// Switches the transmitter on, moves its sticks, or switches it off.
    pub fn transmitter(&mut self, sticks: Option<PilotInput>) {
        self.sticks = sticks;
    }

    /// Which motors turn, in motor order, and which way round, seen from above.
    #[must_use]
    pub fn turning(&self) -> [Option<Spin>; 4] {
        self.wiring.look(self.world.truth_at(self.clock.now()).rotor_speed)
    }

    /// When the status light was last lit.
    #[must_use]
    pub fn lit(&self) -> Option<Instant> {
        self.status.writer().lit()
    }

    /// Every note that was heard, its beginning and pitch, Hz.
    #[must_use]
    pub fn heard(&self) -> &[(Instant, u32)] {
        self.buzzer.channel().heard()
    }

    /// The newest sample's instant of a topic, which no instrument shows: for tests of the bench itself.
    #[must_use]
    pub fn published(&self, topic: Id) -> Option<Instant> {
        self.newest.words(topic as usize).map(|(at, _)| at)
    }
}
