//! What an authentic frame has in it, for whoever opened it.

use super::payload::Payload;
use stampfly_types::Duration;

/// What was in a frame that was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Received<'f> {
    /// What it says.
    pub payload: Payload<'f>,
    /// The frame's counter, for an acknowledgement.
    pub counter: u32,
    /// How long ago it was sealed, at most.
    pub age: Duration,
}
