//! The StampFly in the hands of other programs: `stampfly serve`.
//!
//! | part | what it does |
//! |---|---|
//! | [`PORTS`] | where programs find it, and what is spoken there |
//! | `services.rs` | bytes of each port → the service that speaks its language |
//! | `cable.rs` | what is spoken on USB, as by the firmware |
//! | `sealed.rs` | the secure link, as by the firmware in a Wi-Fi network |
//! | `handling.rs` | what somebody does to it with their hands |
//! | `configurator.rs` | what it is for programs that speak MSP |
//! | `requesters.rs` | what services may ask of the vehicle: its `VehicleActions` |
//!
//! MAVLink, MSP and the page are the same for every vehicle: [`stampfly_sim::ground`].
//!
//! Services publish on the topics of the vehicle's link and console, as the firmware's do, so that the log of such a flight
//! replays without the programs.

mod cable;
mod configurator;
mod handling;
mod requesters;
mod sealed;
mod services;

pub(super) use handling::Handling;
pub(super) use services::Services;

use crate::VehicleConfig;
use crate::console::Newest;
use crate::simulation::faults::FAULTS;
use crate::simulation::settings::Waiting;
use crate::topics::{Id, TOPICS};
use stampfly_drivers::chip::pmw3901;
use stampfly_flight::compact::Chunks;
use stampfly_link::mavlink::dialects::common::MavType;
use stampfly_link::secure::MAX_BODY;
use stampfly_services::cable::BODY;
use stampfly_services::subscription::RADIO_CHUNK;
use stampfly_services::{DataStream, Places, RecordSubscription, Telemetry, View, version};
use stampfly_sim::ground::About;
use stampfly_sim::vehicle::{Client, Guard, PortSpec, Speech, Transport};
use stampfly_types::Instant;
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::vec::Vec;

/// Where programs find it. The places in this table are the constants below.
pub const PORTS: &[PortSpec] = &[
    PortSpec::PAGE,
    PortSpec::MAVLINK_UDP,
    PortSpec::MAVLINK_TCP,
    PortSpec { may: "fly", ..PortSpec::udp("tello", 8_889, "text commands of a Tello") },
    PortSpec {
        transport: Transport::UdpTo,
        guard: Guard::SendsOnly,
        may: "see its state",
        ..PortSpec::udp("tello-state", 8_890, "its state, to the program that commands")
    },
    PortSpec {
        transport: Transport::UdpTo,
        guard: Guard::SendsOnly,
        may: "see its state",
        ..PortSpec::udp("telemetry", 5_005, "a packet in 20 ms, for displays")
    },
    PortSpec {
        may: "see every control cycle",
        ..PortSpec::udp("stream", 8_890, "every control cycle, for programs that ask")
    },
    PortSpec {
        may: "with motors off: change parameters, calibrate, turn motors, restart it",
        ..PortSpec::tcp("console", 2_323, Speech::Text, "the command line: nc, telnet")
    },
    PortSpec::MSP,
    PortSpec::MSP_SERIAL,
    PortSpec { transport: Transport::Terminal, ..PortSpec::tcp("usb", 0, Speech::Cable, "what a board speaks on USB") },
    PortSpec::tcp("usb-tcp", 5_763, Speech::Cable, "the same, for programs that connect"),
    PortSpec::SEALED,
];

const TELLO: usize = 3;
const TELLO_STATE: usize = 4;
const TELEMETRY: usize = 5;
const STREAM: usize = 6;
const CONSOLE: usize = 7;
const USB: usize = 10;
const USB_TCP: usize = 11;
const SEALED: usize = 12;

/// What it is for programs at its ports.
const ABOUT: About = About {
    kind: MavType::MAV_TYPE_QUADROTOR,
    version: version(crate::VERSION),
    take_off_height: 0.5,
    reach: 0.25,
    card: Some(&configurator::CARD),
    ports: PORTS,
    faults: FAULTS,
    topics: &TOPICS,
};

/// What services collect while the vehicle flies, sample by sample.
#[derive(Debug)]
pub(super) struct Seen {
    pub places: Places,
    pub newest: RefCell<Newest>,
    pub telemetry: RefCell<Telemetry>,
    pub stream: RefCell<DataStream<Client>>,
    /// Parameters that were kept for the next start.
    pub kept: RefCell<Option<VehicleConfig>>,
    /// Parameters that have changed, for the moment when the vehicle is at rest and disarmed.
    pub changed: Waiting,
    /// Who is sent the flight record, and what of it waits to be sent.
    pub subscription: RefCell<RecordSubscription<Client>>,
    pub chunks: RefCell<VecDeque<Vec<u8>>>,
    /// Somebody has asked for a restart.
    pub restarts: Cell<bool>,
}

impl Default for Seen {
    fn default() -> Self {
        let count = pmw3901::Config::default().radians_per_count;
        Self {
            places: Places::of(&TOPICS),
            newest: RefCell::new(Newest::new()),
            telemetry: RefCell::new(Telemetry::new(count)),
            stream: RefCell::new(DataStream::new(count)),
            kept: RefCell::default(),
            changed: RefCell::default(),
            subscription: RefCell::new(RecordSubscription::new()),
            chunks: RefCell::default(),
            restarts: Cell::new(false),
        }
    }
}

/// Chunks that wait for the cable's turn. What there is no room for stays in the ring.
const WAITING: usize = 64;
/// Bytes of the record that make a chunk: as much as a flight has in the time of a turn.
const LEAST: usize = 256;

impl Seen {
    /// Takes of the flight record what somebody wants of it.
    pub fn stream(&self, now: Instant, chunks: &mut dyn Chunks) {
        let (mut subscription, mut waiting) = (self.subscription.borrow_mut(), self.chunks.borrow_mut());
        subscription.poll(now, chunks);
        let Some(line) = subscription.line() else { return waiting.clear() };
        let (longest, least) = if line.port == SEALED { (MAX_BODY, RADIO_CHUNK) } else { (BODY, LEAST) };
        let mut room = [0; BODY];
        let Some(room) = room.get_mut(..longest) else { return };
        while waiting.len() < WAITING
            && let Some(chunk) = subscription.chunk(line, chunks, room, least)
        {
            waiting.push_back(chunk.to_vec());
        }
    }

    /// A sample was published.
    pub fn note(&self, id: Id, at: Instant, words: &[u32]) {
        self.newest.borrow_mut().note(id as usize, at, words);
        match id {
            Id::sensor_flow => {
                if let Some((_, flow)) = self.newest.borrow().get(id as usize) {
                    self.telemetry.borrow_mut().flow(&flow);
                }
            }
            // The last of a control cycle.
            Id::actuator_motor => {
                self.stream.borrow_mut().cycle(at, &View::new(&*self.newest.borrow(), &self.places));
            }
            _ => {}
        }
    }
}
