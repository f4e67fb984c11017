//! The StampFly in the hands of other programs: `stampfly serve`.
//!
//! | part | what it does |
//! |---|---|
//! | [`PORTS`] | where programs find it, and what is spoken there |
//! | `services.rs` | bytes of each port → the service that speaks its language |
//! | `page.rs` | what the ground station's page asks for |
//! | `seats.rs` | what services see of the vehicle and may ask for: its `Cockpit` |
//!
//! Services publish on the topics of the vehicle's link and console, as the firmware's do, so that the log of such a flight
//! replays without the programs.

mod page;
mod seats;
mod services;

pub(super) use services::Services;

use crate::console::Newest;
use stampfly_sim::vehicle::{PortSpec, Transport};
use stampfly_types::Duration;
use std::cell::RefCell;

/// Where programs find it. The places in this table are the constants below.
pub const PORTS: &[PortSpec] = &[
    PortSpec { transport: Transport::UdpTo, ..PortSpec::udp("mavlink-udp", 14_550, "MAVLink, for ground stations") },
    PortSpec::tcp("mavlink-tcp", 5_760, "MAVLink, for programs that connect"),
    PortSpec::tcp("console", 2_323, "the command line: nc, telnet"),
    PortSpec { transport: Transport::Page, ..PortSpec::tcp("http", 8_080, "the ground station, in a browser") },
];

const MAVLINK_UDP: usize = 0;
const MAVLINK_TCP: usize = 1;
const CONSOLE: usize = 2;
const PAGE: usize = 3;

/// Between two looks at the ports: what is heard waits for so long at most.
pub(super) const PERIOD: Duration = Duration::from_millis(5);

/// The newest sample of every topic, for services.
#[derive(Debug)]
pub(super) struct Seen(pub RefCell<Newest>);

impl Default for Seen {
    fn default() -> Self {
        Self(RefCell::new(Newest::new()))
    }
}
