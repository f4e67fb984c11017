//! Sources of commands: radio links, programs, a button.

use crate::{Sample, SensorError};
use embedded_hal::digital::InputPin;
use stampfly_types::messages::{GuidedCommand, PilotInput};

/// One authenticated command.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Command {
    /// A frame from a pilot's transmitter.
    Pilot(PilotInput),
    /// A command from a program.
    Guided(GuidedCommand),
}

/// A link that delivers commands.
///
/// The implementation has already checked length, tag, session and counter. Every command it
/// returns is authentic, finite and in range; it counts and drops all others.
pub trait CommandLink {
    /// The link's error.
    type Error: SensorError;

    /// Waits for the next command. Dropping the future before it resolves loses no command.
    ///
    /// # Errors
    /// When the link itself fails. A rejected frame is not an error.
    async fn next(&mut self) -> Result<Sample<Command>, Self::Error>;
}

/// A contact that is either closed or open.
pub trait Button {
    /// Whether the button is pressed now. Not debounced; the component that detects gestures does
    /// that.
    fn is_pressed(&mut self) -> bool;
}

/// A button between a pin and ground: active low, as on GPIO 0 of the StampFly.
///
/// A pin that cannot be read counts as not pressed.
pub struct PinButton<P>(pub P);

impl<P: InputPin> Button for PinButton<P> {
    fn is_pressed(&mut self) -> bool {
        self.0.is_low().unwrap_or(false)
    }
}
