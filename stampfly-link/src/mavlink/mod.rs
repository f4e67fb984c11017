//! MAVLink 1 and 2: frames, their signatures, and a decoder that finds them among other bytes.
//!
//! | part | what it is |
//! |---|---|
//! | [`MavlinkDecoder`] | bytes → [`MavlinkFrame`], with its checksum verified |
//! | [`MavlinkFrame::message`] | the frame's payload as a message of a dialect |
//! | [`MavlinkWriter`] | messages → frames of either version, signed if it has a key |
//! | [`Tunnel`] | bytes of another protocol in a message |
//! | [`signing`] | MAVLink 2's signatures: which frames may be believed |
//!
//! The messages are those of the crate `mavlink`, [re-exported](dialects). Its readers need a stream that waits; this decoder
//! takes bytes as they come, holds one frame, and allocates nothing. What to answer is not here: `stampfly-services` has a
//! vehicle's end of the conversation.
//!
//! Frames without a signature authenticate nobody. Speak MAVLink without one only where nobody else can: on a cable, on one machine.

mod frame;
mod signature;
pub mod signing;
mod tunnel;
mod writer;

pub use frame::{LONGEST, MavlinkDecoder, MavlinkFrame};
pub use mavlink::{MavHeader, MavlinkVersion, Message, MessageData, dialects, error::ParserError};
pub use signature::Signature;
pub use tunnel::Tunnel;
pub use writer::MavlinkWriter;
