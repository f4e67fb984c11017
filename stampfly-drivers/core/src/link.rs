//! Where commands come from: radios, programs, a button.

use crate::{Sample, SensorError};
use embedded_hal::digital::InputPin;
use stampfly_types::messages::{GuidedCommand, PilotInput};

/// One authentic command.
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
/// The link has already checked length, tag, session and counter; what arrives here is authentic, finite and in
/// range. Anything else it counts and drops.
pub trait CommandLink {
    /// The link's error.
    type Error: SensorError;

    /// Waits for the next command. May be dropped before it resolves without losing a command.
    ///
    /// # Errors
    /// When the link itself fails; a rejected frame is not an error.
    async fn next(&mut self) -> Result<Sample<Command>, Self::Error>;
}

/// A contact that is closed or open.
pub trait Button {
    /// Is it pressed right now? Not debounced: that is the button component's work.
    fn is_pressed(&mut self) -> bool;
}

/// A button between a pin and ground (active low, as on the StampFly's GPIO 0).
///
/// A pin that cannot be read counts as not pressed.
pub struct PinButton<P>(pub P);

impl<P: InputPin> Button for PinButton<P> {
    fn is_pressed(&mut self) -> bool {
        self.0.is_low().unwrap_or(false)
    }
}
