#![doc = include_str!("../README.md")]
//!
//! # The parts
//! A program that flies vehicles makes a [`Hub`] of their [`VehicleCard`]s, gives each flight the hub's [witness](Hub::witness), and carries
//! out what [`Hub::asks`] gives. Whatever connects a page makes a [`Connection`] and a [`Feed`] for it.
//!
//! | part | what it is |
//! |---|---|
//! | [`ask`] | what can be asked, as JSON |
//! | [`VehicleCard`] | what a page is told of a vehicle once |
//! | [`Hub`] | what flights and pages share |
//! | [`Feed`] | the state that one page has subscribed to, as texts |
//! | [`http`] | the little HTTP that a server of the page needs, over bytes |

mod card;
mod feed;
pub mod http;
mod hub;
mod newest;

pub use card::{Calibration, ParameterCard, TopicCard, VehicleCard};
pub use feed::Feed;
pub use hub::{Client, Connection, Event, FRESH, Hub, LogSoFar, NotAsked};
pub use newest::Watch;
/// What can be asked.
pub use stampfly_sim::ask;
pub use stampfly_sim::ask::Reply;
