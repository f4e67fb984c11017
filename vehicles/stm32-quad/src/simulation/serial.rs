//! Its ports: what every vehicle has there, and nothing else.

use super::{faults::FAULTS, plant};
use crate::parameters::Parameters;
use crate::serial::{Board, CARD, Newest};
use crate::topics::{LinkEnds, TOPICS};
use core::cell::RefCell;
use stampfly_services::link::mavlink::dialects::common::MavType;
use stampfly_services::version;
use stampfly_sim::fault::Injector;
use stampfly_sim::ground::{About, Served};
use stampfly_sim::vehicle::{Link, Live, PortSpec};

/// Where programs find it.
pub const PORTS: &[PortSpec] =
    &[PortSpec::PAGE, PortSpec::MAVLINK_UDP, PortSpec::MAVLINK_TCP, PortSpec::MSP, PortSpec::MSP_SERIAL];
/// What a page may ask: nothing that flies it, which is the transmitter's alone.
pub const ASKS: &[&str] = &["alive", "param_set", "param_get", "param_save", "fault", "fault_clear", "speed"];

const ABOUT: About = About {
    kind: MavType::MAV_TYPE_QUADROTOR,
    version: version(env!("CARGO_PKG_VERSION")),
    take_off_height: 0.0,
    reach: 0.0,
    card: Some(&CARD),
    ports: PORTS,
    faults: FAULTS,
    topics: &TOPICS,
};

/// Its services. What is simulated begins anew with every flight, so there is nothing to keep parameters in.
pub(super) fn services<'a>(
    live: &Live,
    faults: &Injector,
    parameters: &Parameters,
    newest: &'a RefCell<Newest>,
    ends: LinkEnds<'a>,
) -> impl Link + 'a {
    Served::new(&ABOUT, live, faults, Board::new(parameters, &plant::parameters(), ends), newest)
}
