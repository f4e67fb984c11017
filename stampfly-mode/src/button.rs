//! What a press of the button meant.
//!
//! Every press is reported as soon as it is sure, for whoever has to stop something; what it becomes follows. A short one
//! is a click, and a second one soon after makes it a double click. Holding reports twice, while the button is still down:
//! first to pair, later to restart. The times are in [`ButtonConfig`].

use stampfly_types::messages::{ButtonEvent, ButtonGesture};
use stampfly_types::{Duration, Instant};

/// Times that tell gestures apart.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ButtonConfig {
    /// A contact counts when it has not changed for this long.
    pub debounce: Duration,
    /// Longest time between two clicks that make a double click.
    pub double_click: Duration,
    /// A press held for this long asks for pairing.
    pub hold_pair: Duration,
    /// A press held for this long asks for a restart; longer than the one for pairing.
    pub hold_reset: Duration,
}

impl Default for ButtonConfig {
    /// They suit any small button that a finger presses.
    fn default() -> Self {
        Self {
            // Contacts bounce for up to 20 ms. Two or three readings at 50 Hz.
            debounce: Duration::from_millis(50),
            double_click: Duration::from_millis(400),
            hold_pair: Duration::from_secs(3),
            hold_reset: Duration::from_secs(5),
        }
    }
}

/// Turns a contact into gestures.
///
/// ```
/// use stampfly_mode::ButtonDecoder;
/// use stampfly_types::{Instant, messages::ButtonGesture};
/// let mut button = ButtonDecoder::default();
/// let mut gestures = Vec::new();
/// for ms in (0..2_000).step_by(20) {
///     gestures.extend(button.step(Instant::from_millis(ms), (100..300).contains(&ms)).map(|event| event.gesture));
/// }
/// assert_eq!(gestures, [ButtonGesture::Press, ButtonGesture::Click]);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ButtonDecoder {
    config: ButtonConfig,
    /// The contact's raw level and since when it has had it.
    raw: bool,
    raw_since: Instant,
    /// The debounced level and since when.
    pressed: bool,
    pressed_since: Instant,
    /// Which hold this press has already reported.
    reported: ButtonGesture,
    /// A click that may still become a double click, and how long it was.
    click: Option<(Instant, f32)>,
}

impl ButtonDecoder {
    /// The decoder of a button that is not pressed.
    #[must_use]
    pub fn new(config: ButtonConfig) -> Self {
        Self { config, ..Self::default() }
    }

    /// Takes the contact's level; call at 50 Hz or faster.
    pub fn step(&mut self, now: Instant, contact: bool) -> Option<ButtonEvent> {
        if contact != self.raw {
            (self.raw, self.raw_since) = (contact, now);
        }
        if self.raw != self.pressed && now.since(self.raw_since) >= self.config.debounce {
            self.pressed = self.raw;
            let held = self.raw_since.since(self.pressed_since).seconds();
            self.pressed_since = self.raw_since;
            if self.pressed {
                self.reported = ButtonGesture::None;
                let held = now.since(self.pressed_since).seconds();
                return Some(ButtonEvent { gesture: ButtonGesture::Press, held });
            }
            if self.reported == ButtonGesture::None {
                if self.click.take().is_some() {
                    return Some(ButtonEvent { gesture: ButtonGesture::DoubleClick, held });
                }
                self.click = Some((now, held));
            }
        }
        if self.pressed {
            let (held, event) = (now.since(self.pressed_since), self.reported);
            let reached = match held {
                held if held >= self.config.hold_reset => ButtonGesture::HoldReset,
                held if held >= self.config.hold_pair => ButtonGesture::HoldPair,
                _ => ButtonGesture::None,
            };
            if reached > event {
                self.reported = reached;
                // Whoever holds has not clicked before.
                self.click = None;
                return Some(ButtonEvent { gesture: reached, held: held.seconds() });
            }
            return None;
        }
        let (at, held) = self.click?;
        if now.since(at) < self.config.double_click {
            return None;
        }
        self.click = None;
        Some(ButtonEvent { gesture: ButtonGesture::Click, held })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn gestures(pressed: impl Fn(u64) -> bool) -> Vec<ButtonGesture> {
        let mut button = ButtonDecoder::new(ButtonConfig::default());
        let events = (0..12_000).step_by(20).filter_map(|ms| button.step(Instant::from_millis(ms), pressed(ms)));
        events.map(|event| event.gesture).collect()
    }

    #[test]
    fn gestures_are_told_apart() {
        use ButtonGesture::{Click, DoubleClick, HoldPair, HoldReset, Press};
        assert_eq!(gestures(|ms| ms == 100), [], "bounce");
        assert_eq!(gestures(|ms| (100..300).contains(&ms)), [Press, Click]);
        assert_eq!(gestures(|ms| (100..200).contains(&ms) || (400..500).contains(&ms)), [Press, Press, DoubleClick]);
        assert_eq!(gestures(|ms| (100..3_500).contains(&ms)), [Press, HoldPair]);
        assert_eq!(gestures(|ms| (100..200).contains(&ms) || (400..4_000).contains(&ms)), [Press, Press, HoldPair]);
        assert_eq!(gestures(|ms| (100..9_000).contains(&ms)), [Press, HoldPair, HoldReset]);
    }

    #[test]
    fn a_press_is_reported_before_it_is_over_and_only_once() {
        for start in 100..120 {
            let mut button = ButtonDecoder::default();
            let events: Vec<_> = (0..2_900)
                .step_by(20)
                .filter_map(|ms| Some((ms, button.step(Instant::from_millis(ms), ms >= start)?)))
                .collect();
            let [(at, event)] = events[..] else { panic!("{events:?}") };
            assert_eq!(event.gesture, ButtonGesture::Press);
            assert!((50..80).contains(&(at - start)), "{} ms after contact", at - start);
            assert!((0.05..0.07).contains(&event.held), "{}", event.held);
        }
    }
}
