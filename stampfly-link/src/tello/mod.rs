//! Tello's text protocol: commands of a program in words, one in a UDP datagram to port 8889, and what it is answered. For programs written for a
//! Tello, as with djitellopy; a new program is better served by datagrams with a checksum ([`datagram`](crate::datagram)).
//!
//! | | from | what |
//! |---|---|---|
//! | [`TelloCommand`] | program | `takeoff`, `forward 50`, `battery?`, … |
//! | [`TelloReply`] | vehicle | `ok`, `error out of range`, `87` |
//! | [`TelloState`] | vehicle | `pitch:0;roll:0;…`, ten times a second to port 8890 of the program |
//!
//! Here is what the words mean, and nothing that a vehicle does about it: whether it is in command mode (the first word has to be
//! `command`), may take off, or goes as far as it is told. Nothing is checked but UDP's own sum, and nobody is authenticated: whoever
//! reaches the port flies the vehicle.
//!
//! From DJI's *Tello SDK 2.0 User Guide*, djitellopy 2.5.0, which sends what is known here, and the ecosystem's vehicle, which has `sysid` and `autotune`
//! as well. Lengths in cm, angles in degrees: those are the protocol's. In Rust they are in m and rad.
//!
//! # Example
//! ```
//! use stampfly_link::tello::{TelloCommand, TelloError, TelloQuery, TelloReply};
//! let mut out = [0; TelloReply::LONGEST];
//! let mut answer = |bytes: &[u8]| {
//!     let reply = match TelloCommand::parse(bytes) {
//!         Ok(TelloCommand::Command | TelloCommand::TakeOff) => TelloReply::Ok,
//!         Ok(TelloCommand::Query(TelloQuery::Battery)) => TelloReply::Number(87),
//!         Ok(_) => TelloReply::Error("not supported"),
//!         Err(error) => TelloReply::Refused(error),
//!     };
//!     reply.write(&mut out).map(|length| String::from_utf8_lossy(&out[..length]).into_owned())
//! };
//! assert_eq!(answer(b"command").as_deref(), Some("ok"));
//! assert_eq!(answer(b"battery?").as_deref(), Some("87"));
//! assert_eq!(answer(b"forward 5").as_deref(), Some("error out of range"));
//! ```

mod command;
mod number;
mod reply;
mod state;
mod text;

pub use command::{TelloAxis, TelloCommand, TelloDirection, TelloError, TelloOther, TelloQuery, TelloWave};
pub use reply::TelloReply;
pub use state::TelloState;

/// The vehicle's port for commands, which it answers from.
pub const COMMAND_PORT: u16 = 8889;
/// The program's port for the state.
pub const STATE_PORT: u16 = 8890;
