//! The pilot's transmitter: what turning its switches and moving its sticks means, and when it means nothing.
//!
//! A switch counts in its new position when frames have shown it there for [`ModeConfig::switch_debounce`]: one or two bad
//! frames do nothing. The arm switch arms only when it was seen off before. One that is on at power-on, or that was turned on
//! while the pilot was not heard, has to be turned off first; one that is found off after a silence in the air was not turned
//! off by the pilot for certain, so it asks for a landing and never stops the motors.

use crate::config::ModeConfig;
use stampfly_types::messages::{FlightMode, PilotInput};
use stampfly_types::{Duration, Instant};

/// A switch whose new position counts after some time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Debounced<T> {
    /// The position that counts; `None` while the pilot is not heard.
    position: Option<T>,
    /// Another position, and since when frames have shown it.
    other: Option<(T, Instant)>,
}

impl<T: Copy + PartialEq> Debounced<T> {
    /// Takes the position that a frame shows. True when it counts from now on. The first position is no change.
    fn changes(&mut self, at: Instant, shown: T, time: Duration) -> bool {
        if self.position.is_none() {
            self.position = Some(shown);
        }
        if self.position == Some(shown) {
            self.other = None;
            return false;
        }
        let since = self.other.filter(|(other, _)| *other == shown).map_or(at, |(_, since)| since);
        self.other = Some((shown, since));
        let changes = at.since(since) >= time;
        if changes {
            (self.position, self.other) = (Some(shown), None);
        }
        changes
    }
}

/// What the arm switch did in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Switched {
    /// From off to on.
    pub rises: bool,
    /// From on to off.
    pub falls: bool,
    /// It was on when the pilot fell silent, and is off now.
    pub found_off: bool,
    /// It is on and was not seen off before.
    pub is_stale: bool,
}

/// What the transmitter says in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Heard {
    /// The newest fresh frame, with sticks that are numbers within ±1, and when it came.
    pub frame: Option<(Instant, PilotInput)>,
    /// The arm switch.
    pub switch: Switched,
    /// The position of the mode switch that counts.
    pub mode: Option<FlightMode>,
    /// The pilot has turned the mode switch.
    pub mode_turned: bool,
    /// The pilot has moved the sticks out of the centre and away from where they were, for long enough.
    pub deflected: bool,
}

/// Follows the pilot's frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Transmitter {
    newest: Option<Instant>,
    arm: Debounced<bool>,
    /// The arm switch has been seen off.
    seen_off: bool,
    /// It was on when the pilot fell silent in flight.
    was_on: bool,
    mode: Debounced<FlightMode>,
    /// Roll, pitch, yaw and throttle before the pilot moved them.
    parked: [f32; 4],
    moved_since: Option<Instant>,
    unreadable: u32,
}

impl Transmitter {
    /// Frames with a stick that was no number.
    pub const fn unreadable(&self) -> u32 {
        self.unreadable
    }

    /// The arm switch has to be seen off again. Its position is forgotten as well: one that is still off would be seen off.
    pub fn forget(&mut self) {
        (self.arm, self.seen_off, self.was_on) = (Debounced::default(), false, false);
    }

    /// Looks at the newest frame, if there is a fresh one. `flies` says whether the pilot has authority: then the sticks are
    /// where they should be.
    pub fn step(
        &mut self,
        config: &ModeConfig,
        frame: Option<(Instant, &PilotInput)>,
        armed: bool,
        flies: bool,
    ) -> Heard {
        let Some((at, raw)) = frame else {
            self.was_on |= armed && self.seen_off && self.arm.position == Some(true);
            self.was_on &= armed;
            (self.arm, self.mode, self.seen_off) = (Debounced::default(), Debounced::default(), false);
            (self.newest, self.moved_since) = (None, None);
            return Heard::default();
        };
        let input = raw.cleaned();
        let sticks = [input.roll, input.pitch, input.yaw, input.throttle];
        if self.newest != Some(at) && !raw.is_readable() {
            self.unreadable = self.unreadable.wrapping_add(1);
        }
        if self.newest.is_none() || !armed || flies {
            (self.parked, self.moved_since) = (sticks, None);
        }
        self.newest = Some(at);
        let out = |now: &f32, before: &f32| now.abs() > config.take_over && (now - before).abs() > config.take_over;
        let moved_since = match self.moved_since {
            _ if !sticks.iter().zip(&self.parked).any(|(now, before)| out(now, before)) => None,
            None => Some(at),
            since => since,
        };
        self.moved_since = moved_since;
        let deflected = moved_since.is_some_and(|since| at.since(since) >= config.take_over_time);
        let switch = self.arm_switch(config, at, input.arm);
        let mode_turned = self.mode.changes(at, input.mode, config.switch_debounce);
        Heard { frame: Some((at, input)), switch, mode: self.mode.position, mode_turned, deflected }
    }

    fn arm_switch(&mut self, config: &ModeConfig, at: Instant, on: bool) -> Switched {
        if self.was_on {
            // The first frames after a silence in flight.
            self.arm.position.get_or_insert(true);
            self.seen_off = true;
            let found_off = self.arm.changes(at, on, config.switch_debounce);
            // On again: as before the silence.
            self.was_on = !found_off && !on;
            return Switched { found_off, ..Switched::default() };
        }
        let changes = self.arm.changes(at, on, config.switch_debounce);
        let seen = self.seen_off;
        self.seen_off |= self.arm.position == Some(false);
        let is_stale = on && !self.seen_off;
        Switched { rises: changes && on && seen, falls: changes && !on && seen, found_off: false, is_stale }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;
    use std::vec::Vec;

    /// Frames every 20 ms: what the transmitter says after each of them.
    fn heard(frames: &[Option<PilotInput>], armed: bool, flies: bool) -> Vec<Heard> {
        let (mut transmitter, config) = (Transmitter::default(), ModeConfig::default());
        let frames = frames.iter().zip(1u64..);
        frames
            .map(|(frame, k)| {
                let at = Instant::from_millis(20 * k);
                transmitter.step(&config, frame.as_ref().map(|frame| (at, frame)), armed, flies)
            })
            .collect()
    }

    /// Counts of rises, falls, found off, and frames with a stale switch. `+` on, `-` off, `_` silence.
    fn switched(frames: &str, armed: bool) -> [usize; 4] {
        let frame = |arm| Some(PilotInput { arm, ..Default::default() });
        let frames: Vec<_> = frames.chars().map(|c| if c == '_' { None } else { frame(c == '+') }).collect();
        let all = heard(&frames, armed, true);
        let count = |what: fn(&Switched) -> bool| all.iter().filter(|heard| what(&heard.switch)).count();
        [count(|s| s.rises), count(|s| s.falls), count(|s| s.found_off), count(|s| s.is_stale)]
    }

    #[test]
    fn d6_one_or_two_bad_frames_do_not_turn_the_arm_switch() {
        assert_eq!(switched("--++++++++++", false), [1, 0, 0, 0]);
        for bad in ["-", "--"] {
            assert_eq!(switched(&std::format!("--+++++{bad}+++++{bad}+++"), true), [1, 0, 0, 0], "{bad}");
        }
        assert_eq!(switched("--+++++----", true), [1, 1, 0, 0], "turned");
        assert_eq!(switched("---++---++---", false), [0; 4], "nor do they arm");
    }

    #[test]
    fn d6_a_transmitter_that_restarts_with_its_switch_off_has_not_turned_it() {
        assert_eq!(switched("--+++++__-----", true), [1, 0, 1, 0]);
        assert_eq!(switched("--+++++__+++++----", true), [1, 1, 0, 0], "still on: it can be turned off");
        assert_eq!(switched("--+++++__-----++++----", true), [2, 1, 1, 0]);
        assert_eq!(switched("-----__-----", true), [0; 4], "it was off before");
    }

    #[test]
    fn a_switch_rises_only_after_it_was_seen_off() {
        assert_eq!(switched("+++++", false), [0, 0, 0, 5]);
        assert_eq!(switched("+++++-----+++++", false), [1, 0, 0, 5]);
        assert_eq!(switched("-----_+++++", false), [0, 0, 0, 5], "turned while the pilot was not heard");
    }

    #[test]
    fn d5_parked_sticks_are_not_deflected() {
        let sticks = |roll, throttle| Some(PilotInput { roll, throttle, ..Default::default() });
        let deflected = |frames: &[_]| heard(frames, true, false).iter().any(|heard| heard.deflected);
        assert!(!deflected(&[sticks(0.0, -1.0); 50]), "a throttle that rests at its lower end");
        assert!(!deflected(&[[sticks(0.0, 0.0); 20], [sticks(0.1, 0.0); 20]].concat()), "touched");
        assert!(!deflected(&[&[sticks(0.0, 0.0)][..], &[sticks(1.0, 0.0); 3], &[sticks(0.0, 0.0); 9]].concat()));
        assert!(deflected(&[&[sticks(0.0, 0.0)][..], &[sticks(0.3, 0.0); 10]].concat()));
        assert!(!heard(&[sticks(0.9, 0.9); 50], true, true).iter().any(|heard| heard.deflected), "has authority");
    }

    #[test]
    fn d20_sticks_that_are_no_numbers_rest_and_are_counted() {
        let (mut transmitter, config) = (Transmitter::default(), ModeConfig::default());
        for (k, bad) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30].into_iter().enumerate() {
            let frame = PilotInput { throttle: bad, roll: bad, ..Default::default() };
            let at = Instant::from_millis(20 * k as u64);
            for _ in 0..8 {
                let heard = transmitter.step(&config, Some((at, &frame)), true, true);
                let expected = if bad == 1e30 { 1.0 } else { 0.0 };
                assert_eq!(heard.frame.map(|(_, input)| (input.roll, input.throttle)), Some((expected, expected)));
            }
        }
        assert_eq!(transmitter.unreadable(), 3, "frames, not steps");
    }

    #[test]
    fn a_switch_that_was_never_seen_off_or_that_the_ground_has_seen_is_not_found_off() {
        assert_eq!(switched("+++++__-----", true), [0, 0, 0, 5], "a program has armed");
        let (mut transmitter, config) = (Transmitter::default(), ModeConfig::default());
        let mut millis = 0;
        let mut found_off = |frames: &str, armed: bool| {
            let frames = frames.chars().map(|c| (c != '_').then(|| PilotInput { arm: c == '+', ..Default::default() }));
            frames.fold(false, |found, frame| {
                millis += 20;
                let at = Instant::from_millis(millis);
                found | transmitter.step(&config, frame.as_ref().map(|frame| (at, frame)), armed, true).switch.found_off
            })
        };
        assert!(!found_off("--+++++__", true));
        assert!(!found_off("__", false), "it has landed, and nobody was heard");
        assert!(!found_off("-----", true));
    }

    #[test]
    fn sticks_are_compared_with_where_they_were_and_with_their_centre() {
        let sticks = |pitch, yaw| Some(PilotInput { pitch, yaw, ..Default::default() });
        let deflected = |from: (f32, f32), to: (f32, f32)| {
            let frames = [vec![sticks(from.0, from.1)], vec![sticks(to.0, to.1); 10]].concat();
            heard(&frames, true, false).iter().any(|heard| heard.deflected)
        };
        assert!(deflected((0.0, 0.0), (0.16, 0.0)) && deflected((0.0, 0.0), (0.0, -0.16)));
        assert!(!deflected((0.0, 0.0), (0.14, -0.14)));
        assert!(!deflected((0.8, 0.0), (0.1, 0.0)), "back to its centre");
        assert!(!deflected((0.8, 0.0), (0.9, 0.0)), "where it was");
        assert!(deflected((0.8, 0.0), (-0.2, 0.0)));
        let moves = [vec![sticks(0.0, 0.0)], vec![sticks(0.9, 0.0); 10]].concat();
        for (armed, flies) in [(true, true), (false, false)] {
            assert!(!heard(&moves, armed, flies).iter().any(|heard| heard.deflected), "nothing to take over");
        }
    }
}
