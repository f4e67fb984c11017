<<<<<<< HEAD
//! What a press of the button meant.
//!
//! Debounced over 50 ms. A press shorter than three seconds is a click, a second one within 400 ms makes it a double
//! click; holding reports once at three seconds (pair) and once at five (restart), while the button is still down.
=======
//! One button, four gestures: click, double click, three seconds, five seconds.
//!
//! The contact must be steady for 50 ms before it counts. A single click is reported when it is certain that no second
//! one follows, so it comes 400 ms late; whoever needs an instant reaction must not use clicks. A hold of three seconds
//! is reported on release, so that five seconds do not pair on the way to a restart.
>>>>>>> control

use stampfly_types::Micros;
use stampfly_types::messages::{ButtonEvent, ButtonGesture};

<<<<<<< HEAD
const DEBOUNCE: Micros = Micros::from_millis(50);
const DOUBLE_CLICK: Micros = Micros::from_millis(400);
const HOLD_PAIR: Micros = Micros::from_secs(3);
const HOLD_RESET: Micros = Micros::from_secs(5);

/// Turns a contact into gestures.
///
/// ```
/// use stampfly_mode::ButtonDecoder;
/// use stampfly_types::{Micros, messages::ButtonGesture};
/// let mut button = ButtonDecoder::default();
/// let mut gestures = Vec::new();
/// for ms in (0..2_000).step_by(20) {
///     gestures.extend(button.step(Micros::from_millis(ms), (100..300).contains(&ms)).map(|event| event.gesture));
/// }
/// assert_eq!(gestures, [ButtonGesture::Click]);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ButtonDecoder {
    /// The contact's raw level and since when it has had it.
    raw: bool,
    raw_since: Micros,
    /// The debounced level and since when.
    pressed: bool,
    pressed_since: Micros,
    /// What this press has already reported.
    reported: ButtonGesture,
    /// A click that may still become a double click, and how long it was.
    click: Option<(Micros, f32)>,
}

impl ButtonDecoder {
    /// Takes the contact's level; call at 50 Hz or faster.
    pub fn step(&mut self, now: Micros, contact: bool) -> Option<ButtonEvent> {
        if contact != self.raw {
            (self.raw, self.raw_since) = (contact, now);
        }
        if self.raw != self.pressed && now.since(self.raw_since) >= DEBOUNCE {
            self.pressed = self.raw;
            let held = self.raw_since.since(self.pressed_since).seconds();
            self.pressed_since = self.raw_since;
            if self.pressed {
                self.reported = ButtonGesture::None;
            } else if self.reported == ButtonGesture::None {
                if self.click.take().is_some() {
                    return Some(ButtonEvent { gesture: ButtonGesture::DoubleClick, held });
                }
                self.click = Some((now, held));
            }
        }
        if self.pressed {
            let (held, event) = (now.since(self.pressed_since), self.reported);
            let reached = match held {
                held if held >= HOLD_RESET => ButtonGesture::HoldReset,
                held if held >= HOLD_PAIR => ButtonGesture::HoldPair,
                _ => ButtonGesture::None,
            };
            if reached > event {
                self.reported = reached;
                return Some(ButtonEvent { gesture: reached, held: held.seconds() });
            }
            return None;
        }
        let (at, held) = self.click?;
        if now.since(at) < DOUBLE_CLICK {
            return None;
        }
        self.click = None;
        Some(ButtonEvent { gesture: ButtonGesture::Click, held })
    }
=======
use crate::persist::Persist;

/// Contact must be steady for this long.
const DEBOUNCE: Micros = Micros::from_millis(50);
/// A click is not longer.
const CLICK: Micros = Micros::from_millis(1_000);
/// The second click of two begins within this time of the first one's end.
const DOUBLE: Micros = Micros::from_millis(400);
/// Hold to pair.
const PAIR: Micros = Micros::from_secs(3);
/// Hold to restart.
const RESET: Micros = Micros::from_secs(5);

/// Recognises gestures.
///
/// ```
/// use stampfly_mode::Button;
/// use stampfly_types::Micros;
/// use stampfly_types::messages::ButtonGesture;
/// let mut button = Button::default();
/// let mut seen = Vec::new();
/// for millis in (0..2_000).step_by(20) {
///     let pressed = (100..300).contains(&millis);
///     seen.extend(button.step(Micros::from_millis(millis), pressed).map(|event| event.gesture));
/// }
/// assert_eq!(seen, [ButtonGesture::Click]);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Button {
    pressed: bool,
    changing: Persist,
    /// When the steady state began.
    since: Micros,
    /// A first click and its end, waiting for a second.
    first: Option<(Micros, Micros)>,
    /// The present press has been reported already.
    reported: bool,
}

impl Button {
    /// Takes the contact's state; gives a gesture when one is complete.
    pub fn step(&mut self, now: Micros, pressed: bool) -> Option<ButtonEvent> {
        if self.changing.holds(now, pressed != self.pressed, DEBOUNCE) {
            self.changing.reset();
            let held = now.since(self.since);
            self.pressed = pressed;
            self.since = now;
            if pressed {
                self.reported = false;
                return None;
            }
            return self.released(now, held);
        }
        let held = now.since(self.since);
        if self.pressed && !self.reported && held >= RESET {
            self.reported = true;
            self.first = None;
            return Some(event(ButtonGesture::HoldReset, held));
        }
        let (ended, held) = self.first?;
        if self.pressed || now.since(ended) < DOUBLE {
            return None;
        }
        self.first = None;
        Some(event(ButtonGesture::Click, held))
    }

    fn released(&mut self, now: Micros, held: Micros) -> Option<ButtonEvent> {
        let first = self.first.take();
        if self.reported {
            None
        } else if held >= PAIR {
            Some(event(ButtonGesture::HoldPair, held))
        } else if held > CLICK {
            // Neither a click nor a hold: somebody changed their mind. A click before it still counts.
            first.map(|(_, held)| event(ButtonGesture::Click, held))
        } else if first.is_some() {
            Some(event(ButtonGesture::DoubleClick, held))
        } else {
            self.first = Some((now, held));
            None
        }
    }
}

fn event(gesture: ButtonGesture, held: Micros) -> ButtonEvent {
    ButtonEvent { gesture, held: held.seconds() }
>>>>>>> control
}

#[cfg(test)]
mod tests {
    use super::*;
<<<<<<< HEAD
    use std::vec::Vec;

    fn gestures(pressed: impl Fn(u64) -> bool) -> Vec<ButtonGesture> {
        let mut button = ButtonDecoder::default();
        let events = (0..12_000).step_by(20).filter_map(|ms| button.step(Micros::from_millis(ms), pressed(ms)));
        events.map(|event| event.gesture).collect()
    }

    #[test]
    fn gestures_are_told_apart() {
        assert_eq!(gestures(|ms| ms == 100), [], "bounce");
        assert_eq!(gestures(|ms| (100..300).contains(&ms)), [ButtonGesture::Click]);
        assert_eq!(gestures(|ms| (100..200).contains(&ms) || (400..500).contains(&ms)), [ButtonGesture::DoubleClick]);
        assert_eq!(gestures(|ms| (100..3_500).contains(&ms)), [ButtonGesture::HoldPair]);
        assert_eq!(gestures(|ms| (100..9_000).contains(&ms)), [ButtonGesture::HoldPair, ButtonGesture::HoldReset]);
=======
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Plays presses (start and end in milliseconds) and gives the gestures.
    fn play(presses: &[(u64, u64)], until: u64) -> Vec<ButtonGesture> {
        let mut button = Button::default();
        (0..until)
            .step_by(10)
            .filter_map(|millis| {
                let pressed = presses.iter().any(|(from, to)| (*from..*to).contains(&millis));
                button.step(Micros::from_millis(millis), pressed).map(|event| event.gesture)
            })
            .collect()
    }

    #[test]
    fn gestures() {
        use ButtonGesture::{Click, DoubleClick, HoldPair, HoldReset};
        assert_eq!(play(&[(100, 300)], 3_000), [Click]);
        assert_eq!(play(&[(100, 300), (500, 700)], 3_000), [DoubleClick]);
        assert_eq!(play(&[(100, 300), (1_500, 1_700)], 4_000), [Click, Click]);
        assert_eq!(play(&[(100, 3_500)], 6_000), [HoldPair]);
        assert_eq!(play(&[(100, 9_000)], 12_000), [HoldReset], "once, and no pairing on the way");
        assert_eq!(play(&[(100, 2_000)], 6_000), [], "a change of mind");
        assert_eq!(play(&[(100, 130), (150, 180), (200, 230)], 3_000), [], "a bouncing contact");
        assert_eq!(play(&[(100, 110), (120, 400)], 3_000), [Click], "a press that bounces");
    }

    proptest! {
        #[test]
        fn a_gesture_needs_a_steady_press(edges in prop::collection::vec(1u64..49, 1..200)) {
            let mut button = Button::default();
            let (mut now, mut pressed) = (0, false);
            for span in edges {
                pressed = !pressed;
                for _ in 0..span {
                    now += 1;
                    prop_assert_eq!(button.step(Micros::from_millis(now), pressed), None);
                }
            }
        }
>>>>>>> control
    }
}
