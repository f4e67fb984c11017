//! HiSKY: a small transmitter's protocol for an nRF24L01, which hops over twenty channels. For a receiver that is part of the vehicle; where there is a choice,
//! take a protocol with a checksum and an address that is longer to guess.
//!
//! | radio | |
//! |---|---|
//! | rate | 1 Mbit/s, 2 bytes CRC, no acknowledgement |
//! | address | 5 bytes, the first one is the least significant |
//! | payload | 10 bytes |
//! | channel `c` | 2400 + `c` MHz |
//! | while it binds | channel 81, address 12 23 23 45 78 |
//!
//! The transmitter sends a packet of sticks every 9 ms, each on the next of its channels. It tells them, and its address, while it binds: for 9 s
//! after it is switched on, in four packets one after the other, which anybody hears. Nothing is authenticated, and the radio's CRC is the only
//! check. From two independent public implementations, a receiver's and a transmitter's, which agree.
//!
//! # Example
//! ```
//! use stampfly_link::hisky::{HiskyChannels, HiskyEvent, HiskyLink, HiskyReceiver};
//! use stampfly_types::Instant;
//! let mut receiver = HiskyReceiver::new(None, Instant::ZERO);
//! assert_eq!(receiver.tuning().channel, 81, "it binds");
//!
//! let transmitter = HiskyLink { address: [1, 2, 3, 4, 5], hops: core::array::from_fn(|hop| 2 + 3 * hop as u8) };
//! let heard = transmitter.bind_packets().map(|packet| receiver.receive(Instant::ZERO, &packet));
//! assert_eq!(heard[3], HiskyEvent::Bound(transmitter));
//!
//! assert_eq!((receiver.tuning().channel, receiver.tuning().address), (2, [1, 2, 3, 4, 5]));
//! let sticks = HiskyChannels([500, 500, 1000, 500, 0, 0, 0, 0]);
//! let heard = receiver.receive(Instant::from_millis(5), &sticks.to_bytes());
//! assert_eq!(heard, HiskyEvent::Channels(sticks));
//! assert_eq!(receiver.tuning().channel, 5, "the next one");
//! ```

mod bind;
mod channels;
mod receiver;

pub use bind::{HiskyBinding, HiskyLink};
pub use channels::HiskyChannels;
pub use receiver::{HiskyEvent, HiskyReceiver, HiskyTuning};

/// Channels that a transmitter hops over.
pub const HOPS: usize = 20;
/// Bytes of every packet.
pub const PAYLOAD: usize = 10;
/// The channel for binding.
pub const BIND_CHANNEL: u8 = 81;
/// The address for binding, in the order of the radio's register.
pub const BIND_ADDRESS: [u8; 5] = [0x12, 0x23, 0x23, 0x45, 0x78];
