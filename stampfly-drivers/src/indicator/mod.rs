//! Output of lights and sound.
//!
//! Which colour or tune is due is decided elsewhere and arrives as a [`Signal`]. This module only
//! drives the pins.

mod buzzer;
mod lights;
mod tune;

pub use buzzer::{Buzzer, SetFrequency};
pub use lights::Lights;
use stampfly_types::messages::Signal;

/// Lights or a buzzer.
pub trait Indicator {
    /// Shows the signal. Must not wait for the end of a tune.
    fn show(&mut self, signal: &Signal);
}
