//! Data stream: every control cycle of a flight, by UDP from port 8890, for a log on a PC. For finding out how a vehicle flew; not for flying
//! it, and not for a display, which a [`BroadcastPacket`](crate::BroadcastPacket) is enough for.
//!
//! | packet | from | what |
//! |---|---|---|
//! | [`StreamRequest`], 1 byte | PC | begin, stop, go on |
//! | [`StreamPacket`], up to 1400 bytes, 50 times a second | vehicle | eight control cycles and what sensors said meanwhile |
//! | [`StreamStatus`], 57 bytes, once a second | vehicle | battery, state, gains |
//!
//! Numbers are little-endian. Packets of the vehicle end with all bytes before combined by exclusive or, which finds every wrong bit and by far not
//! every two. Whoever asks is answered: nobody is authenticated. From `data_stream_wire.hpp` of the ecosystem's vehicle; a PC reads it with
//! its `udp_capture.py`.
//!
//! # Example
//! ```
//! use stampfly_link::stream::{StreamBuilder, StreamCycle, StreamEntry, StreamPacket};
//! let mut builder = StreamBuilder::new(7);
//! for cycle in 0..8 {
//!     builder.cycle(&StreamCycle { time: 2_500 * cycle, ..Default::default() })?;
//! }
//! builder.entry(&StreamEntry::Flow { time: 9_000, counts: [12, -3], surface_quality: 80 })?;
//! let bytes = builder.finish()?;
//!
//! let packet = StreamPacket::decode(bytes).expect("our own packet");
//! assert_eq!(packet.cycles().map(|cycle| cycle.time).last(), Some(17_500));
//! assert_eq!(packet.entries().count(), 1);
//! # Ok::<(), stampfly_link::stream::StreamBuildError>(())
//! ```

mod build;
mod cycle;
mod entry;
mod packet;
mod request;
mod scaled;
mod status;

pub use build::{StreamBuildError, StreamBuilder};
pub use cycle::StreamCycle;
pub use entry::{StreamEntry, StreamOutput, StreamPhase};
pub use packet::{StreamEntries, StreamError, StreamPacket};
pub use request::{StreamRequest, StreamSink};
pub use status::{StreamGains, StreamStatus};

/// The port the vehicle listens at and sends from.
pub const PORT: u16 = 8890;

/// Control cycles in a packet. The vehicle's cycles last 2.5 ms.
pub const CYCLES: usize = 8;

/// The longest packet: what fits a frame of WiFi with room to spare.
pub const LONGEST: usize = 1400;
