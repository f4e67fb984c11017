//! Its ports: what every vehicle has there, and nothing else.

use super::faults::FAULTS;
use super::mission::{HEIGHT, REACH};
use crate::ground::{Board, Newest};
use crate::topics::TOPICS;
use core::cell::RefCell;
use stampfly_services::link::mavlink::dialects::common::MavType;
use stampfly_services::version;
use stampfly_sim::fault::Injector;
use stampfly_sim::ground::{About, Served};
use stampfly_sim::vehicle::{Link, Live, PortSpec};

/// Where programs find it.
pub const PORTS: &[PortSpec] = &[PortSpec::PAGE, PortSpec::MAVLINK_UDP, PortSpec::MAVLINK_TCP];

const ABOUT: About = About {
    kind: MavType::MAV_TYPE_FIXED_WING,
    version: version(env!("CARGO_PKG_VERSION")),
    take_off_height: HEIGHT,
    reach: REACH,
    card: None,
    ports: PORTS,
    faults: FAULTS,
    topics: &TOPICS,
};

/// Its services.
pub(super) fn services<'a>(
    live: &Live,
    faults: &Injector,
    board: Board<'a>,
    newest: &'a RefCell<Newest>,
) -> impl Link + 'a {
    Served::new(&ABOUT, live, faults, board, newest)
}
