//! Button: a contact in, gestures out.

use crate::config::VehicleConfig;
use crate::topics::ButtonEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_mode::ButtonDecoder;

/// Button: a contact in, gestures out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Button {
    decoder: ButtonDecoder,
}

impl Button {
    /// A button that is not pressed.
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        Self { decoder: ButtonDecoder::new(config.button) }
    }
}

impl Runnable for Button {
    type Ends<'b> = ButtonEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut ButtonEnds<'_>) {
        if let Some(event) = self.decoder.step(activation.now(), ends.button_contact.get().pressed) {
            ends.button_event.publish(activation.now(), &event);
        }
    }
}
