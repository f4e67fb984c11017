//! Button: a contact in, gestures out.

use crate::wiring;
use stampfly_bus::{Activation, Runnable};
use stampfly_mode::ButtonDecoder;

/// Button: a contact in, gestures out.
pub struct ButtonReader<'b> {
    ports: ButtonPorts<'b>,
    decoder: ButtonDecoder,
    pressed: bool,
}

/// The ends it owns.
pub struct ButtonPorts<'b> {
    /// The pin.
    pub contact: wiring::button_contact::Rx<'b>,
    /// What it meant.
    pub event: wiring::button_event::Tx<'b>,
}

impl<'b> ButtonReader<'b> {
    /// A button that has not been touched.
    #[must_use]
    pub fn new(ports: ButtonPorts<'b>) -> Self {
        Self { ports, decoder: ButtonDecoder::default(), pressed: false }
    }
}

impl Runnable for ButtonReader<'_> {
    fn read(&mut self, activation: &mut Activation) {
        self.pressed = activation.latest(&mut self.ports.contact).is_some_and(|s| s.data.pressed);
    }

    fn run(&mut self, activation: &mut Activation) {
        if let Some(event) = self.decoder.step(activation.now(), self.pressed) {
            self.ports.event.publish(activation.now(), &event);
        }
    }
}
