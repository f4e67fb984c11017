//! A vehicle's services on a network: MAVLink that has to be signed, and sealed frames of a station with the vehicle's key.
//!
//! | file | what it is |
//! |---|---|
//! | `ends.rs` | [`Ends`]: datagrams and a stream, whoever carries them |
//! | `ports.rs` | [`Ports`]: what is spoken at each |
//! | `reserved.rs` | [`Reserved`]: that signatures are not believed twice |
//! | `routes.rs` | [`Routes`]: where the station with the key is |
//! | `stack.rs` | [`Stack`]: ends on a radio (feature `network`) |
//!
//! Nothing here is said to strangers but that somebody listens, and nothing that they say is done. Not for programs on one's own machine, which need no key:
//! those have `stampfly serve`.

mod ends;
mod ports;
mod reserved;
mod routes;
#[cfg(feature = "network")]
mod stack;

pub use ends::{Client, Ends, Heard, MAVLINK_TCP, MAVLINK_UDP, SEALED_UDP};
pub use ports::{CLIENTS, Door, Ports};
pub use reserved::Reserved;
pub use routes::Routes;
#[cfg(feature = "network")]
pub use stack::{Lost, Memory, Stack};
