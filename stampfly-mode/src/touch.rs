//! What a hand on the button means to a vehicle whose motors may turn: stop.
//!
//! Nobody can press the button of a vehicle that he is not holding, so every gesture on an armed one stops the motors.
//! [`button`](crate::button) says which gesture it was, the [mode machine](crate::machine) what follows.

use stampfly_types::messages::ButtonGesture;
use stampfly_types::{Duration, Instant};

/// After an emergency stop by the button, presses mean nothing until it has been left alone for this long: a hand in a
/// hurry presses more than once.
const CALM: Duration = Duration::from_secs(2);

/// A hand on the button. The touch that stops the motors means nothing else, and neither do those right after it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Touch {
    /// It has stopped the motors.
    spent: bool,
    /// When the button was last heard of.
    last: Instant,
}

impl Touch {
    /// Does this gesture stop the motors?
    pub fn grabs(&mut self, now: Instant, gesture: Option<ButtonGesture>, armed: bool) -> bool {
        let Some(gesture) = gesture.filter(|gesture| *gesture != ButtonGesture::None) else { return false };
        let calm = now.since(self.last) >= CALM;
        self.spent = armed || (self.spent && !(gesture == ButtonGesture::Press && calm));
        self.last = now;
        armed
    }

    /// What remains of the gesture for everything else.
    pub fn meaning(&self, gesture: Option<ButtonGesture>) -> Option<ButtonGesture> {
        gesture.filter(|gesture| !self.spent && *gesture != ButtonGesture::None)
    }
}
