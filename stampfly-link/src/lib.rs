#![doc = include_str!("../README.md")]
//!
//! # The parts
//! The radio link of the StampFly, without a radio.
//!
//! | type | what it is | when to use it |
//! |---|---|---|
//! | [`Session`] | the vehicle's end of the link: whom it listens to, pairing, counters | in a vehicle |
//! | [`ControlPacket`] | sticks and switches, 14 bytes | in a transmitter, a simulator, a test |
//! | [`PairingPacket`] | the vehicle's call for a transmitter, 11 bytes | in a transmitter |
//! | [`TelemetryPacket`] | what the vehicle tells its pilot, 22 bytes | at either end |
//! | [`JoystickPacket`] | sticks and buttons of M5Stack's own transmitter, 25 bytes | in a vehicle flown with it |
//! | [`Slots`] | up to ten transmitters on one channel | in a transmitter |
//! | [`BroadcastPacket`] | what a vehicle tells every program on its network | for displays and plots |
//! | [`stream`] | every control cycle of a flight | for a log on a PC |
//! | [`tello`] | commands in words, and their answers | for programs written for a Tello |
//! | [`Datagram`] | any message as a UDP datagram or a JSON line | between programs |
//! | [`Peers`] | the programs that talk to a vehicle by datagrams | at the vehicle's end |
//! | [`SequenceFilter`] | refuses old and repeated datagrams | where datagrams are received |
//! | `mavlink` | frames and signatures of MAVLink 1 and 2 (feature `mavlink`) | for ground stations |
//! | [`msp`] | frames of the MultiWii serial protocol, versions 1 and 2 | for configurators and telemetry scripts |
//! | [`secure`] | sessions with keys: sealed frames, handshake, replay protection | over a radio or a network that strangers can send on |
//! | [`hisky`] | a receiver of a small transmitter that hops | beside an nRF24L01 |
//! | [`serial`] | what receivers of other makes say over a wire: SBUS, CRSF, iBUS | beside a UART |
//!
//! Nothing here does input or output, allocates or reads a clock. Every byte comes from strangers: it is looked at in a
//! fixed order, from the cheapest check to the dearest, a packet is taken whole or not at all, and nothing that was
//! refused leaves a trace other than a [count](Counters).
//!
//! The formats are those of the public StampFly ecosystem (`protocol/spec/messages.yaml` there, corrected by what its
//! transmitter really sends). They authenticate nobody; see the README.
//!
//! # Example
//! ```
//! use stampfly_link::{Address, ControlPacket, Session};
//! use stampfly_types::{Instant, messages::PilotInput};
//!
//! let (vehicle, transmitter) = (Address([1; 6]), Address([2; 6]));
//! let mut session = Session::new(vehicle, 1, None);
//! session.start_pairing(Instant::ZERO)?;
//! assert!(session.beacon(Instant::ZERO).is_some(), "calls for a transmitter");
//!
//! let bytes = ControlPacket::from_pilot(vehicle, &PilotInput::default()).to_bytes();
//! assert!(session.receive(Instant::from_micros(10_000), transmitter, &bytes).is_ok());
//! assert_eq!(session.peer(), Some(transmitter), "the first that answers is the one");
//! # Ok::<(), stampfly_link::PairingRefused>(())
//! ```
#![no_std]

#[cfg(test)]
extern crate std;

mod address;
mod broadcast;
mod control;
#[cfg(feature = "mavlink")]
mod crc16;
mod crc8;
pub mod datagram;
mod fields;
mod heard;
pub mod hisky;
mod joystick;
pub mod json;
#[cfg(feature = "mavlink")]
pub mod mavlink;
pub mod msp;
mod pairing;
mod peers;
pub mod secure;
mod sequence;
pub mod serial;
mod session;
mod slots;
pub mod stream;
mod telemetry;
pub mod tello;

pub use address::{Address, LinkPeer};
pub use broadcast::{BroadcastError, BroadcastPacket, BroadcastSensors};
pub use control::{ControlError, ControlPacket};
pub use datagram::{Datagram, DatagramError};
pub use joystick::{ArmButton, JoystickError, JoystickPacket};
pub use pairing::{PairingError, PairingPacket};
pub use peers::{MAX_DATAGRAM, Peers};
pub use sequence::SequenceFilter;
pub use session::{Counters, PairingRefused, Rejected, Session};
pub use slots::{SlotBeacon, SlotTurn, Slots};
pub use telemetry::{LinkState, TelemetryError, TelemetryPacket};

/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;

/// The checksum of every packet that has one: the sum of the bytes before it, modulo 256.
fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}
