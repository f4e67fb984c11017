//! A ground station: one page in a browser that shows vehicles as they fly, and asks them for things.
//!
//! A program that flies vehicles makes a [`Hub`] of their [`VehicleCard`]s, gives each flight the hub's witness, and carries
//! out what [`Hub::asks`] gives. Everything is offline: the page is one file without a reference to the outside.
//!
//! | part | what it is |
//! |---|---|
//! | [`ask`] | what can be asked, as JSON |
//! | [`VehicleCard`] | what a page is told of a vehicle once |
//! | [`Hub`] | what flights and sockets share |
//! | [`Server`] | serves the page and its WebSockets |
//! | [`http`] | the little HTTP that needs, over bytes |
//!
//! The protocol is described in `docs/ground-station.md`.

mod card;
mod client;
mod feed;
pub mod http;
mod hub;
mod limits;
mod newest;
mod page;
mod server;

pub use card::{Calibration, CalibrationKind, ParameterCard, TopicCard, VehicleCard};
pub use hub::{Client, Connection, Event, Hub, NotAsked};
pub use limits::Limits;
pub use newest::Watch;
pub use server::Server;
/// What can be asked.
pub use stampfly_sim::ask;
pub use stampfly_sim::ask::Reply;
