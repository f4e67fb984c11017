//! A ground station: one page in a browser that shows vehicles as they fly, and asks them for
//! things.
//!
//! What page and vehicles share is in `stampfly-ground`; here is its web server. Everything is
//! offline: the page is one file without a reference to the outside.
//!
//! | part | what it is |
//! |---|---|
//! | [`Server`] | serves the page and its WebSockets |
//! | [`demo`] | the page with the whole simulation inside, as one file |
//!
//! The protocol is described in `docs/stampfly/ground-station.md`.

mod client;
pub mod demo;
mod limits;
mod page;
mod pulse;
mod server;
mod wire;

use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// The server's clock: time since it was looked at first in this process. All hubs have the same.
#[must_use]
pub fn now() -> Duration {
    static BEGUN: OnceLock<Instant> = OnceLock::new();
    BEGUN.get_or_init(Instant::now).elapsed()
}

pub use limits::Limits;
pub use server::Server;
pub use stampfly_ground::{
    Calibration, Client, Connection, Event, FRESH, Hub, LogSoFar, NotAsked, ParameterCard, Reply, TopicCard,
    VehicleCard, Watch, ask,
};
