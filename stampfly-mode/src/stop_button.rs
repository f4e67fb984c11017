//! The button as an emergency stop: any gesture on an armed vehicle stops its motors.
//!
//! The button is on the vehicle, so a press means that the vehicle is held in a hand. [`button`](crate::button) decides
//! which gesture it was, the [mode machine](crate::machine) what follows.

use stampfly_types::messages::ButtonGesture;
use stampfly_types::{Duration, Instant};

/// Tells gestures that stop the motors from gestures that mean something else. The one that stopped them means nothing
/// more, and neither do those right after it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct StopButton {
    /// The present gesture has stopped the motors, or follows one that has.
    used: bool,
    /// Instant of the newest gesture.
    last: Instant,
}

impl StopButton {
    /// Does this gesture stop the motors? After one that has, gestures count again once the button has been released for
    /// the time `release`.
    pub fn stops(&mut self, now: Instant, release: Duration, gesture: Option<ButtonGesture>, armed: bool) -> bool {
        let Some(gesture) = gesture.filter(|gesture| *gesture != ButtonGesture::None) else { return false };
        let released = now.since(self.last) >= release;
        self.used = armed || (self.used && !(gesture == ButtonGesture::Press && released));
        self.last = now;
        armed
    }

    /// The gesture for everything else; `None` when it was used to stop.
    pub fn unused(&self, gesture: Option<ButtonGesture>) -> Option<ButtonGesture> {
        gesture.filter(|gesture| !self.used && *gesture != ButtonGesture::None)
    }
}
