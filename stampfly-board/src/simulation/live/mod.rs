//! The StampFly in the hands of other programs: `stampfly serve`.
//!
//! | part | what it does |
//! |---|---|
//! | [`PORTS`] | where programs find it, and what is spoken there |
//! | `services.rs` | bytes of each port → the service that speaks its language |
//! | `configurator.rs` | what it is for programs that speak MSP |
//! | `page.rs` | what the ground station's page asks for |
//! | `seats.rs` | what services see of the vehicle and may ask for: its `Cockpit` |
//!
//! Services publish on the topics of the vehicle's link and console, as the firmware's do, so that the log of such a flight
//! replays without the programs.

mod configurator;
mod page;
mod seats;
mod services;

pub(super) use services::Services;

use crate::VehicleConfig;
use crate::console::Newest;
use crate::topics::{Id, TOPICS};
use stampfly_drivers::chip::pmw3901;
use stampfly_services::{DataStream, Places, Telemetry, View};
use stampfly_sim::vehicle::{Client, PortSpec, Transport};
use stampfly_types::{Duration, Instant};
use std::cell::{Cell, RefCell};

/// Where programs find it. The places in this table are the constants below.
pub const PORTS: &[PortSpec] = &[
    PortSpec { transport: Transport::Page, ..PortSpec::tcp("http", 8_080, "the ground station, in a browser") },
    PortSpec {
        transport: Transport::UdpTo,
        signed: true,
        ..PortSpec::udp("mavlink-udp", 14_550, "MAVLink, for ground stations")
    },
    PortSpec { signed: true, ..PortSpec::tcp("mavlink-tcp", 5_760, "MAVLink, for programs that connect") },
    PortSpec::udp("tello", 8_889, "text commands of a Tello"),
    PortSpec { transport: Transport::UdpTo, ..PortSpec::udp("tello-state", 8_890, "its state, to whoever commands") },
    PortSpec { transport: Transport::UdpTo, ..PortSpec::udp("telemetry", 5_005, "a packet in 20 ms, for displays") },
    PortSpec::udp("stream", 8_890, "every control cycle, for who asks"),
    PortSpec::tcp("console", 2_323, "the command line: nc, telnet"),
    PortSpec::tcp("msp", 5_761, "MSP, for configurators"),
    PortSpec { transport: Transport::Terminal, ..PortSpec::tcp("msp-serial", 0, "the same, at a serial port") },
];

const PAGE: usize = 0;
const MAVLINK_UDP: usize = 1;
const MAVLINK_TCP: usize = 2;
const TELLO: usize = 3;
const TELLO_STATE: usize = 4;
const TELEMETRY: usize = 5;
const STREAM: usize = 6;
const CONSOLE: usize = 7;
const MSP: usize = 8;
const MSP_SERIAL: usize = 9;

/// Between two looks at the ports: what is heard waits for so long at most.
pub(super) const PERIOD: Duration = Duration::from_millis(5);

/// What services collect while the vehicle flies, sample by sample.
#[derive(Debug)]
pub(super) struct Seen {
    pub places: Places,
    pub newest: RefCell<Newest>,
    pub telemetry: RefCell<Telemetry>,
    pub stream: RefCell<DataStream<Client>>,
    /// Parameters that were kept for the next start.
    pub kept: RefCell<Option<VehicleConfig>>,
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
            restarts: Cell::new(false),
        }
    }
}

impl Seen {
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
