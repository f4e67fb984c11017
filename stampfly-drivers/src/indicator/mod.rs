//! Lights and sound.
//!
//! What is shown when is decided elsewhere and arrives as a [`Signal`]; here is only how it comes out of a pin.

mod buzzer;
mod lights;
mod tune;

pub use buzzer::{Buzzer, SetFrequency};
pub use lights::Lights;
use stampfly_types::messages::Signal;

/// Lights or a buzzer.
pub trait Indicator {
    /// Shows the signal. Must not block: a tune plays on by itself.
    fn show(&mut self, signal: &Signal);
}
