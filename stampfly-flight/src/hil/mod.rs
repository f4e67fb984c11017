//! Hardware in the loop: a vehicle flies a world that is computed elsewhere, over a line of bytes.
//!
//! ```text
//!  computer: world, sensors, pilot ──► samples, "step until" ──► vehicle: bus, flight loop
//!                 ▲                                                        │
//!                 └───────────── activations, everything published ◄───────┘
//! ```
//!
//! | part | what it is |
//! |---|---|
//! | [`Encoder`], [`Decoder`] | frames on a line that loses and garbles bytes |
//! | [`Request`], [`Reply`], [`Entries`] | what they say |
//! | [`greet`], [`Flight`] | the vehicle's end, byte by byte |
//! | [`serve`] | the same on a [`Wire`], from the greeting to the end |
//!
//! Time is the computer's. The vehicle stands still between two steps and computes for the instants it is told, so what it
//! publishes is a function of what it was sent: bit for bit the same at any speed, on any core, and after any number of
//! lost frames. A question is asked again until it is answered; the vehicle knows by its sequence that it has done it, and
//! gives the same answer.
//!
//! Nothing here touches hardware. The vehicle's ends of the motors are inside [`Flight`], so what they are to do goes to the
//! line only. Not for a vehicle with its propellers on, nor for measuring a driver: sensors and actuators have no part in it.

/// What is typed at a vehicle's [console](crate::console) to restart it into this.
pub const COMMAND: &str = "hil";

mod frame;
mod protocol;
mod serve;
mod vehicle;

pub use frame::{Body, Decoder, Encoder};
pub use protocol::{Bands, Entries, Entry, Log, NoEntry, Refusal, Reply, Request, Stepped, VERSION};
pub use serve::{GREETING, Served, Wire, serve};
pub use vehicle::{Flight, Greeting, LONGEST, LONGEST_FRAME, Line, Over, SILENCE, greet};
