//! What a radio receiver says over a wire: SBUS, CRSF and iBUS.
//!
//! | protocol | wire | who | checked by | sticks | back to the pilot |
//! |---|---|---|---|---|---|
//! | [`sbus`] | 100 kbit/s, 8E2, inverted; a frame in 6 to 14 ms | Futaba, FrSky and most others | nothing: start, end and pause | 16 of 11 bits, 2 switches | no |
//! | [`crsf`] | 420 kbit/s, 8N1 | TBS Crossfire, ExpressLRS | CRC-8 | 16 of 11 bits | telemetry |
//! | [`ibus`] | 115.2 kbit/s, 8N1; a frame in 7 ms | FlySky | a sum of 16 bits | 14, or 18, in µs | no |
//!
//! Each module has a frame and a decoder, and stands alone. A decoder takes one byte at a time, finds its place again by itself after any
//! garbage, and does bounded work for a byte. None reads a clock or allocates: SBUS is told the time, because a pause is its only mark.
//!
//! Take CRSF where there is a choice. SBUS has no checksum: a flipped bit in a stick is a stick that moves.
//!
//! A receiver that has lost its transmitter says so in one of three ways: SBUS sets [`failsafe`](sbus::SbusFrame::failsafe), CRSF falls
//! silent, and an iBUS receiver sends what its pilot has chosen as failsafe. Whoever uses the sticks has to look for silence in all cases.

mod channels;
pub mod crsf;
pub mod ibus;
pub mod sbus;

pub use channels::Channels;
