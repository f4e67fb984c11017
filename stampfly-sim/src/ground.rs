//! Services at the ports of a simulated vehicle: MAVLink, MSP and the ground station's page
//! (feature `ground`).
//!
//! A vehicle implements [`VehicleActions`], describes itself in an [`About`], and lists in its
//! [`PORTS`](crate::vehicle::Vehicle::PORTS) which of [`PortSpec::PAGE`],
//! [`PortSpec::MAVLINK_UDP`], [`PortSpec::MAVLINK_TCP`], [`PortSpec::MSP`] and
//! [`PortSpec::MSP_SERIAL`] it opens; the port's constant determines its protocol. It then passes a
//! [`Served`] to [`Live::serve`]. A vehicle with further protocols holds a [`Ground`] in a [`Link`]
//! of its own. A vehicle with only its own protocol needs neither.
//!
//! ```
//! use core::cell::RefCell;
//! use stampfly_flight::newest::{NewestSamples, longest_message};
//! use stampfly_param::{Parameters, RequestedParameters};
//! use stampfly_services::{VehicleActions, Refusal, Request};
//! use stampfly_services::link::mavlink::dialects::common::MavType;
//! use stampfly_sim::fault::Injector;
//! use stampfly_sim::ground::{About, Served};
//! use stampfly_sim::vehicle::{Client, Heard, Link, Live, PortSpec, Ports};
//! use stampfly_types::{Duration, Instant, messages::{GuidedCommand, PilotInput}};
//! # use std::sync::Arc;
//! # mod topics {
//! #     use stampfly_types::messages::FlightStatus;
//! #     stampfly_bus::topics! {
//! #         outside mode, display;
//! #         /// What it does.
//! #         flight_status: FlightStatus = latest @ 50 Hz from mode => [display];
//! #     }
//! # }
//! # stampfly_param::parameters! {
//! #     /// A buoy.
//! #     pub struct Numbers {
//! #         /// Its lamp.
//! #         lamp: Lamp {
//! #             /// Brightness.
//! #             level = 0.5 in [0.0, 1.0] "1";
//! #         }
//! #     }
//! # }
//! # #[derive(Debug)]
//! # struct Closed;
//! # impl Ports for Closed {
//! #     fn receive(&self, _: Option<std::time::Instant>, _: &mut dyn FnMut(Client, Heard<'_>)) {}
//! #     fn send(&self, _: &Client, _: &[u8]) {}
//! #     fn are_closed(&self) -> bool { true }
//! # }
//! /// A buoy with a lamp: it has parameters and accepts no commands.
//! struct Buoy(RequestedParameters<Numbers, 8>);
//!
//! impl VehicleActions for Buoy {
//!     fn command(&mut self, _: Instant, _: GuidedCommand) -> Result<(), Refusal> { Err(Refusal::Unsupported) }
//!     fn sticks(&mut self, _: Instant, _: &PilotInput) -> Result<(), Refusal> { Err(Refusal::Unsupported) }
//!     fn parameters(&mut self) -> &mut dyn Parameters { &mut self.0 }
//!     fn request(&mut self, _: Instant, _: Request) -> Result<(), Refusal> { Err(Refusal::Unsupported) }
//! }
//!
//! const PORTS: &[PortSpec] = &[PortSpec::PAGE, PortSpec::MAVLINK_UDP, PortSpec::MAVLINK_TCP];
//! const ABOUT: About = About {
//!     kind: MavType::MAV_TYPE_SURFACE_BOAT,
//!     version: [1, 0, 0],
//!     take_off_height: 0.0,
//!     reach: 2.0,
//!     card: None,
//!     ports: PORTS,
//!     faults: &[],
//!     topics: &topics::TOPICS,
//! };
//!
//! # fn main() {
//! # let live = Live { ports: Arc::new(Closed), number: 0, limit: Duration::from_secs(1), speed: None };
//! # let newest = RefCell::new(NewestSamples::<{ topics::COUNT }, { longest_message(&topics::TOPICS) }>::new());
//! # let none = Injector::new(Instant::ZERO, &[]);
//! let mut served = Served::new(&ABOUT, &live, &none, Buoy(RequestedParameters::new(Numbers::default())), &newest);
//! let page = Client { port: 0, address: ([127, 0, 0, 1], 1).into() };
//! let mut ask = |text: &str| {
//!     let mut answer = String::new();
//!     let heard = Heard::Bytes(text.as_bytes());
//!     served.hear(Instant::ZERO, page, heard, &mut |_, said| answer = String::from_utf8_lossy(said).into_owned());
//!     answer
//! };
//! assert!(ask(r#"{"vehicle":0,"id":1,"do":"param_set","name":"lamp.level","value":0.75}"#).contains("\"ok\":true"));
//! assert!(ask(r#"{"vehicle":0,"id":2,"do":"param_get","name":"lamp.level"}"#).contains("\"value\":0.75"));
//! assert!(ask(r#"{"vehicle":0,"id":3,"do":"guided","kind":"arm"}"#).contains("this vehicle does not do that"));
//! # }
//! ```

use crate::ask::{Ask, Asked, Guided, Reply};
use crate::fault::{Fault, FaultKind, Injector, When};
use crate::vehicle::{Client, Heard, Link, Live, PortSpec, Ports, Put, Speed};
use core::cell::RefCell;
use core::net::IpAddr;
use stampfly_bus::TopicInfo;
use stampfly_param::parameters;
use stampfly_services::goal::{CommandGoal, OVERTAKEN, TOO_MANY, Waited};
use stampfly_services::link::mavlink::dialects::common::MavType;
use stampfly_services::link::mavlink::signing::SigningKey;
use stampfly_services::mavlink::{Identity, Mavlink};
use stampfly_services::msp::{Card, Msp};
use stampfly_services::{
    ArbitratedAccess, CommandArbiter, Places, Refusal, Request, Requester, Samples, VehicleAccess as _, VehicleActions,
    View,
};
use stampfly_types::messages::{FlightStatus, GuidedCommand};
use stampfly_types::{Duration, Instant};
use std::sync::Arc;

/// Period of [`Live::serve`]: the longest delay of received data.
pub const PERIOD: Duration = Duration::from_millis(5);
/// Ticks between two runs of the services that send periodically: 20 ms.
pub const TURN: u32 = 4;

/// MAVLink clients at once: more than a TCP port accepts, so that listening TCP clients do not
/// exclude datagrams.
const CLIENTS: usize = 48;
/// Page requests waiting for confirmation. Further requests are refused, except those that end a
/// flight, which replace the oldest.
const WAITS: usize = 64;

/// Description of a vehicle for the programs at its ports.
#[derive(Clone, Copy, Debug)]
pub struct About {
    /// Vehicle type in MAVLink.
    pub kind: MavType,
    /// Version: major, minor, patch.
    pub version: [u8; 3],
    /// Default take-off height, m.
    pub take_off_height: f32,
    /// Default acceptance radius of a mission's waypoints, m.
    pub reach: f32,
    /// Answers to configurators. Without it MSP ports stay silent.
    pub card: Option<&'static Card>,
    /// Ports in the order of [`Vehicle::PORTS`](crate::vehicle::Vehicle::PORTS).
    pub ports: &'static [PortSpec],
    /// Faults that a page may inject.
    pub faults: &'static [FaultKind],
    /// Topics of the vehicle.
    pub topics: &'static [TopicInfo],
}

/// The services common to all vehicles, with the vehicle's hands.
pub struct Ground<H> {
    about: About,
    identity: Identity,
    mavlink: Mavlink<Client, CLIENTS>,
    msp: Vec<(Client, Msp)>,
    arbiter: CommandArbiter,
    places: Places,
    /// Open ports; tells which of them are local.
    ports: Arc<dyn Ports>,
    speed: Option<Speed>,
    faults: Injector,
    /// Number of the last event reported to pages.
    told: u32,
    /// The commander last reported to pages.
    commander: Option<Option<Requester>>,
    /// Page requests not yet confirmed.
    waits: Vec<(Client, Asked, Waited)>,
    /// Actions of the vehicle for the services.
    pub actions: H,
}

/// Handler of console lines from the page.
pub type Console<'c, H> = &'c mut dyn FnMut(&mut H, &str) -> Result<Reply, String>;

impl<H: VehicleActions> Ground<H> {
    /// Services of a vehicle with these hands. `faults` are those that a page can inject.
    #[must_use]
    pub fn new(about: &About, live: &Live, faults: &Injector, actions: H) -> Self {
        let identity = Identity {
            system: u8::try_from(live.number + 1).unwrap_or(u8::MAX),
            kind: about.kind,
            take_off_height: about.take_off_height,
            reach: about.reach,
            version: about.version,
        };
        Self {
            about: *about,
            identity,
            mavlink: match live.ports.signing() {
                Some(signing) => {
                    Mavlink::for_clients(identity).with_key(SigningKey::from_passphrase(&signing.phrase), signing.time)
                }
                None => Mavlink::for_clients(identity),
            },
            msp: Vec::new(),
            arbiter: CommandArbiter::new(),
            places: Places::of(about.topics),
            ports: live.ports.clone(),
            speed: live.speed.clone(),
            faults: faults.clone(),
            told: 0,
            commander: None,
            waits: Vec::new(),
            actions,
        }
    }

    /// Identity of the vehicle in MAVLink.
    #[must_use]
    pub const fn identity(&self) -> Identity {
        self.identity
    }

    /// Access to the vehicle for one call of a service.
    pub fn seated<'s>(&'s mut self, samples: &'s dyn Samples) -> ArbitratedAccess<'s> {
        let Self { arbiter, places, actions, .. } = self;
        ArbitratedAccess { arbiter, actions, view: View::new(samples, places) }
    }

    /// Command authority and hands: for a radio of the vehicle's own, which checks authority
    /// itself.
    pub const fn arbiter(&mut self) -> (&mut CommandArbiter, &mut H) {
        (&mut self.arbiter, &mut self.actions)
    }

    /// Handles an event at one of the common ports; events at other ports are ignored.
    pub fn hear(
        &mut self,
        now: Instant,
        from: Client,
        heard: Heard<'_>,
        samples: &dyn Samples,
        console: Console<'_, H>,
        put: Put<'_>,
    ) {
        let Some(spec) = self.about.ports.get(from.port) else { return };
        match (*spec, heard) {
            (PortSpec::PAGE, Heard::Bytes(text)) => {
                // The server has already answered what it could not parse.
                let asked = core::str::from_utf8(text).ok().and_then(|text| Asked::parse(text).ok());
                let Some(asked) = asked else { return };
                let goal = match &asked.ask {
                    Ask::Guided(guided) => CommandGoal::of(GuidedCommand::from(*guided).kind),
                    _ => None,
                };
                let is_full = self.waits.len() >= WAITS;
                if is_full && goal.is_some_and(|goal| !goal.ends_a_flight()) {
                    return put(&from, asked.answered(Err(TOO_MANY.into())).as_bytes());
                }
                // Before the request is passed on, because the vehicle's refusals count from here.
                let waited = goal.map(|goal| Waited::new(now, goal, &self.seated(samples)));
                let answer = self.page(now, page(&from), &asked.ask, samples, console);
                match waited {
                    // Answered when the vehicle has visibly carried it out.
                    Some(waited) if answer.is_ok() => {
                        if is_full {
                            let (client, asked, _) = self.waits.remove(0);
                            put(&client, asked.answered(Err(OVERTAKEN.into())).as_bytes());
                        }
                        self.waits.push((from, asked, waited));
                    }
                    // Repeated requests are not answered.
                    _ if asked.ask.is_repeated() => {}
                    _ => put(&from, asked.answered(answer).as_bytes()),
                }
            }
            (PortSpec::PAGE, Heard::Closed) => {
                let gone = page(&from);
                self.seated(samples).leave(&|requester| requester == gone);
            }
            (PortSpec::MAVLINK_UDP | PortSpec::MAVLINK_TCP, heard) => self.mavlink(now, from, heard, samples, put),
            (PortSpec::MSP | PortSpec::MSP_SERIAL, Heard::Opened) => {
                self.msp.extend(self.about.card.map(|card| (from, Msp::new(card))));
            }
            (PortSpec::MSP | PortSpec::MSP_SERIAL, Heard::Bytes(bytes) | Heard::Late(bytes)) => {
                let Self { arbiter, places, actions, msp, .. } = self;
                let mut access = ArbitratedAccess { arbiter, actions, view: View::new(samples, places) };
                let Some((_, msp)) = msp.iter_mut().find(|(client, _)| *client == from) else { return };
                let answer = &mut |frame: &[u8]| put(&from, frame);
                match heard {
                    Heard::Late(_) => msp.hear_late(now, bytes, &mut access, answer),
                    _ => msp.hear(now, bytes, &mut access, answer),
                }
            }
            (PortSpec::MSP | PortSpec::MSP_SERIAL, Heard::Closed) => self.msp.retain(|(client, _)| *client != from),
            _ => {}
        }
    }

    fn mavlink(&mut self, now: Instant, from: Client, heard: Heard<'_>, samples: &dyn Samples, put: Put<'_>) {
        let Self { arbiter, places, actions, mavlink, ports, .. } = self;
        let is_local = ports.is_local(from.port);
        match heard {
            Heard::Opened if is_local => mavlink.open_local(now, from, true),
            Heard::Opened => mavlink.open(now, from, true),
            Heard::Bytes(bytes) => {
                let mut access = ArbitratedAccess { arbiter, actions, view: View::new(samples, places) };
                if is_local {
                    return mavlink.hear_local(now, from, bytes, &mut access, put);
                }
                mavlink.hear(now, from, bytes, &mut access, put);
                if mavlink.is_believed(from) {
                    ports.believe(&from);
                }
            }
            Heard::Late(bytes) => {
                let mut access = ArbitratedAccess { arbiter, actions, view: View::new(samples, places) };
                mavlink.hear_late(now, from, is_local, bytes, &mut access, put);
            }
            Heard::Closed => {
                mavlink.close(from, &mut ArbitratedAccess { arbiter, actions, view: View::new(samples, places) });
            }
        }
    }

    /// Carries out a request of a page. Console lines go to `console`.
    fn page(
        &mut self,
        now: Instant,
        requester: Requester,
        ask: &Ask,
        samples: &dyn Samples,
        console: Console<'_, H>,
    ) -> Result<Reply, String> {
        let mut access = self.seated(samples);
        access.alive(now, requester);
        let said = |result: Result<(), Refusal>| match result {
            Ok(()) => Ok(Reply::text("")),
            Err(refusal) => Err(refusal.to_string()),
        };
        match ask {
            Ask::Guided(guided) if let Some(why) = refusal(*guided, &access.view().state()) => Err(why),
            // A click on the map replaces the waiting waypoints, so that it takes effect
            // immediately.
            Ask::Guided(go_to @ Guided::GoTo { .. }) => said(access.fly_to(now, requester, (*go_to).into())),
            Ask::Guided(guided) => said(access.guide(now, requester, (*guided).into())),
            Ask::Sticks(sticks) => said(access.steer(now, requester, &(*sticks).into())),
            Ask::MotorTest { motor, duty } => {
                said(access.request(now, Request::TestMotor { motor: *motor, duty: *duty }))
            }
            Ask::MotorStop {} => said(access.request(now, Request::StopMotor)),
            Ask::ParamGet { name } => {
                let config = access.parameters();
                let value = parameters::find(config, name).ok().and_then(|index| config.get(index));
                value.map(|value| Reply::value(value.into())).ok_or_else(|| "there is no such parameter".into())
            }
            Ask::ParamSet { name, value } => {
                let armed = access.view().state().armed;
                let config = access.parameters();
                let info = parameters::find(config, name).ok().and_then(|index| config.describe(index));
                // Some parameters may only change on the ground.
                if armed && info.is_some_and(|info| !info.in_flight) {
                    return Err(Refusal::Armed.to_string());
                }
                match parameters::set(config, name, *value) {
                    Ok(_) => Ok(Reply::value((*value).into())),
                    Err(error) => Err(error.to_string()),
                }
            }
            Ask::ParamSave {} => said(access.request(now, Request::SaveParameters)),
            Ask::Console { line } => console(&mut self.actions, line),
            Ask::Fault { text } => self.break_something(now, text),
            Ask::FaultClear {} => {
                (0..self.faults.faults().count()).for_each(|place| self.faults.end(place, now));
                Ok(Reply::text(""))
            }
            Ask::Speed { factor } => {
                let speed = self.speed.as_ref().ok_or("time is somebody else's here")?;
                speed.set(*factor);
                Ok(Reply::value((*factor).into()))
            }
            Ask::Alive {} => Ok(Reply::default()),
        }
    }

    fn break_something(&self, now: Instant, text: &str) -> Result<Reply, String> {
        let fault = Fault::parse(text, self.about.faults).map_err(|error| error.to_string())?;
        let same = |other: &Fault| other.kind == fault.kind && other.value == fault.value;
        let place = self.faults.faults().position(same).ok_or("in flight, only with its usual value")?;
        match fault.when {
            // A moment of the flight may be over, so only immediate faults are accepted.
            When::Moment(_) => return Err("in flight, only now: @0".into()),
            When::After(_) => self.faults.begin(place, now, fault.lasts),
        }
        Ok(Reply::text(text))
    }

    /// Call it at every tick, before [`answer`](Self::answer): updates the command authority.
    pub fn poll(&mut self, now: Instant, samples: &dyn Samples) {
        let armed = View::new(samples, &self.places).state().armed;
        self.arbiter.poll(now, armed, &mut self.actions);
    }

    /// Sends due data. Call it every [`TURN`] ticks.
    pub fn answer(&mut self, now: Instant, samples: &dyn Samples, put: Put<'_>) {
        let holder = self.arbiter.holder(now);
        if self.commander.replace(holder) != Some(holder) {
            let page = if let Some(Requester::Page(number)) = holder { Some(number) } else { None };
            self.ports.tell_commander(&holder.map(|requester| requester.to_string()).unwrap_or_default(), page);
        }
        let Self { arbiter, places, actions, mavlink, ports, told, waits, .. } = self;
        let mut access = ArbitratedAccess { arbiter, actions, view: View::new(samples, places) };
        waits.retain(|(client, asked, waited)| match waited.look(now, &access) {
            None => true,
            Some(result) => {
                let answer = result.map(|()| Reply::text("done")).map_err(|why| format!("refused: {why}"));
                put(client, asked.answered(answer).as_bytes());
                false
            }
        });
        while let Some((number, what)) = access.told(*told) {
            *told = number;
            ports.tell(&what.to_string());
        }
        mavlink.poll(now, &mut access, put);
    }
}

/// Why a vehicle in this state would refuse the command, as far as known beforehand.
fn refusal(guided: Guided, status: &FlightStatus) -> Option<String> {
    let mut words = String::new();
    let goal = CommandGoal::of(GuidedCommand::from(guided).kind)?;
    goal.refuse(status, &mut words).then_some(words)
}

/// The requester of the page with this client's number.
fn page(client: &Client) -> Requester {
    // The server encodes the page's number in the address.
    let number = match client.address.ip() {
        IpAddr::V6(number) => number.to_bits() as u32,
        IpAddr::V4(number) => number.to_bits(),
    };
    Requester::Page(number)
}

/// The [`Link`] of a vehicle that has only the common services: pass it to [`Live::serve`] with
/// [`PERIOD`].
pub struct Served<'n, H, S> {
    ground: Ground<H>,
    newest: &'n RefCell<S>,
}

impl<'n, H: VehicleActions, S: Samples> Served<'n, H, S> {
    /// As [`Ground::new`]; the vehicle's newest samples are read from `newest`.
    #[must_use]
    pub fn new(about: &About, live: &Live, faults: &Injector, actions: H, newest: &'n RefCell<S>) -> Self {
        Self { ground: Ground::new(about, live, faults, actions), newest }
    }
}

impl<H: VehicleActions, S: Samples> Link for Served<'_, H, S> {
    fn hear(&mut self, now: Instant, from: Client, heard: Heard<'_>, put: Put<'_>) {
        let console: Console<'_, H> = &mut |_, _| Err("this vehicle has no console".into());
        self.ground.hear(now, from, heard, &*self.newest.borrow(), console, put);
    }

    fn answer(&mut self, now: Instant, tick: u32, put: Put<'_>) {
        let newest = self.newest.borrow();
        self.ground.poll(now, &*newest);
        if tick.is_multiple_of(TURN) {
            self.ground.answer(now, &*newest, put);
        }
    }
}
