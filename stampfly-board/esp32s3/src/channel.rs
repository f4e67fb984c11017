//! The radio channel on which the vehicle hears its pilot, whoever uses the radio.

/// The channel the vehicle listens on.
pub const CHANNEL: u8 = 1;
