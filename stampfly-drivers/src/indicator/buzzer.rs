//! A passive buzzer on a PWM channel, whose frequency is the pitch.

use super::Indicator;
use super::tune::{Note, notes};
use embedded_hal::pwm::SetDutyCycle;
use stampfly_types::Instant;
use stampfly_types::messages::Signal;

/// A PWM channel whose frequency can be changed.
///
/// `embedded-hal` sets only duty cycles. Boards implement this trait on a timer that no other
/// channel uses.
pub trait SetFrequency: SetDutyCycle {
    /// Sets the frequency, Hz. The duty cycle, as a share of the period, stays the same.
    ///
    /// # Errors
    /// When the timer cannot generate this frequency.
    fn set_frequency(&mut self, hertz: u32) -> Result<(), Self::Error>;
}

/// Plays the tunes of [`Signal`]s.
///
/// [`show`](Indicator::show) selects the tune, and [`step`](Self::step) plays it; call `step` every
/// few milliseconds. A new tune replaces the one that is playing. Dropping the buzzer silences it.
///
/// ```
/// # use core::convert::Infallible;
/// # use embedded_hal::pwm::{ErrorType, SetDutyCycle};
/// # #[derive(Default)] struct Channel { hertz: u32, duty: u16 }
/// # impl ErrorType for Channel { type Error = Infallible; }
/// # impl SetDutyCycle for Channel {
/// #     fn max_duty_cycle(&self) -> u16 { 1_000 }
/// #     fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> { self.duty = duty; Ok(()) }
/// # }
/// # impl stampfly_drivers::SetFrequency for Channel {
/// #     fn set_frequency(&mut self, hertz: u32) -> Result<(), Infallible> { self.hertz = hertz; Ok(()) }
/// # }
/// use stampfly_drivers::{Buzzer, Indicator};
/// use stampfly_types::{Instant, messages::{Signal, Tone}};
///
/// let mut buzzer = Buzzer::new(Channel::default());
/// buzzer.show(&Signal { tone: Tone::Arm, tone_count: 1, ..Default::default() });
/// let mut heard = Vec::new();
/// for millis in (0..300).step_by(50) {
///     buzzer.step(Instant::from_millis(millis))?;
///     heard.push(if buzzer.channel().duty == 0 { 0 } else { buzzer.channel().hertz });
/// }
/// assert_eq!(heard, [659, 659, 784, 784, 0, 0]);
/// # Ok::<(), Infallible>(())
/// ```
#[derive(Debug)]
pub struct Buzzer<C: SetFrequency> {
    channel: C,
    tune: &'static [Note],
    /// Start of the tune; `None` between `show` and the next `step`.
    began: Option<Instant>,
    count: u32,
    /// Frequency the channel plays, 0 for silence; `None` when it is unknown after an error.
    sounding: Option<u16>,
}

impl<C: SetFrequency> Buzzer<C> {
    /// Takes the channel and silences it.
    pub fn new(mut channel: C) -> Self {
        let silent = channel.set_duty_cycle_fully_off().is_ok();
        Self { channel, tune: &[], began: None, count: 0, sounding: silent.then_some(0) }
    }

    /// Plays the note that is due at `now`.
    ///
    /// # Errors
    /// When the channel refuses. The next step tries again.
    pub fn step(&mut self, now: Instant) -> Result<(), C::Error> {
        let began = *self.began.get_or_insert(now);
        // Time into the tune; the search subtracts the length of each note before the present one.
        let mut left = now.since(began).as_micros() / 1_000;
        let note = self.tune.iter().find(|(_, millis)| {
            let ends = left < u64::from(*millis);
            left = left.saturating_sub(u64::from(*millis));
            ends
        });
        self.sound(note.map_or(0, |(hertz, _)| *hertz))
    }

    /// The PWM channel.
    pub const fn channel(&self) -> &C {
        &self.channel
    }

    fn sound(&mut self, hertz: u16) -> Result<(), C::Error> {
        if self.sounding == Some(hertz) {
            return Ok(());
        }
        // Unknown until both settings have succeeded, so that a failed step is repeated.
        self.sounding = None;
        if hertz == 0 {
            self.channel.set_duty_cycle_fully_off()?;
        } else {
            self.channel.set_frequency(u32::from(hertz))?;
            self.channel.set_duty_cycle_percent(50)?;
        }
        self.sounding = Some(hertz);
        Ok(())
    }
}

impl<C: SetFrequency> Indicator for Buzzer<C> {
    fn show(&mut self, signal: &Signal) {
        if self.count != signal.tone_count {
            self.count = signal.tone_count;
            self.tune = notes(signal.tone);
            self.began = None;
        }
    }
}

impl<C: SetFrequency> Drop for Buzzer<C> {
    fn drop(&mut self) {
        // The error has no receiver in `drop`.
        let _ = self.channel.set_duty_cycle_fully_off();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal::pwm::{ErrorKind, ErrorType};
    use stampfly_types::messages::Tone;
    use std::cell::Cell;
    use std::vec::Vec;

    #[derive(Clone, Copy, Default)]
    struct State {
        hertz: u32,
        duty: u16,
        calls: u32,
        broken: bool,
    }

    struct Channel<'a>(&'a Cell<State>);

    impl ErrorType for Channel<'_> {
        type Error = ErrorKind;
    }

    impl Channel<'_> {
        fn set(&self, change: impl FnOnce(&mut State)) -> Result<(), ErrorKind> {
            let mut state = self.0.get();
            state.calls += 1;
            if !state.broken {
                change(&mut state);
            }
            self.0.set(state);
            if state.broken { Err(ErrorKind::Other) } else { Ok(()) }
        }
    }

    impl SetDutyCycle for Channel<'_> {
        fn max_duty_cycle(&self) -> u16 {
            1_023
        }
        fn set_duty_cycle(&mut self, duty: u16) -> Result<(), ErrorKind> {
            self.set(|state| state.duty = duty)
        }
    }

    impl SetFrequency for Channel<'_> {
        fn set_frequency(&mut self, hertz: u32) -> Result<(), ErrorKind> {
            self.set(|state| state.hertz = hertz)
        }
    }

    fn signal(tone: Tone, tone_count: u32) -> Signal {
        Signal { tone, tone_count, ..Default::default() }
    }

    /// Frequencies played, one every 50 ms; 0 for silence.
    fn heard(buzzer: &mut Buzzer<Channel<'_>>, state: &Cell<State>, from: u64, steps: u64) -> Vec<u32> {
        let step = |n| {
            buzzer.step(Instant::from_millis(from + 50 * n)).expect("works");
            if state.get().duty == 0 { 0 } else { state.get().hertz }
        };
        (0..steps).map(step).collect()
    }

    #[test]
    fn every_tune_sounds_ends_and_leaves_the_channel_alone_in_between() {
        for &tone in Tone::ALL {
            let state = Cell::default();
            let mut buzzer = Buzzer::new(Channel(&state));
            buzzer.show(&signal(tone, 7));
            let played = heard(&mut buzzer, &state, 1_000_000, 20);
            assert_eq!(played.iter().any(|hertz| *hertz > 0), tone != Tone::None, "{tone:?}");
            assert_eq!(played[11..], [0; 9], "{tone:?} is over within 550 ms");
            let calls = state.get().calls;
            buzzer.show(&signal(tone, 7));
            assert_eq!(heard(&mut buzzer, &state, 3_000_000, 20), [0; 20], "the same edge");
            assert_eq!(state.get().calls, calls);
            buzzer.show(&signal(tone, 8));
            assert_eq!(heard(&mut buzzer, &state, 9_000_000, 20), played, "a new one");
        }
    }

    #[test]
    fn a_new_tune_takes_the_place_of_the_old_one() {
        let state = Cell::default();
        let mut buzzer = Buzzer::new(Channel(&state));
        buzzer.show(&signal(Tone::Error, 1));
        assert_eq!(heard(&mut buzzer, &state, 0, 2), [262, 262]);
        buzzer.show(&signal(Tone::Arm, 2));
        assert_eq!(heard(&mut buzzer, &state, 100, 5), [659, 659, 784, 784, 0]);
        buzzer.show(&signal(Tone::Error, 3));
        assert_eq!(heard(&mut buzzer, &state, 1_000, 1), [262]);
        buzzer.show(&signal(Tone::None, 4));
        assert_eq!(heard(&mut buzzer, &state, 1_050, 1), [0], "silenced");
    }

    #[test]
    fn a_step_that_comes_late_skips_and_a_refusal_is_tried_again() {
        let state = Cell::default();
        let mut buzzer = Buzzer::new(Channel(&state));
        buzzer.show(&signal(Tone::LowBattery, 1));
        assert_eq!(heard(&mut buzzer, &state, 0, 1), [440]);
        assert_eq!(heard(&mut buzzer, &state, 250, 1), [0], "the pause");
        state.set(State { broken: true, ..state.get() });
        assert!(buzzer.step(Instant::from_millis(310)).is_err());
        state.set(State { broken: false, ..state.get() });
        assert_eq!(heard(&mut buzzer, &state, 320, 1), [440]);
        assert_eq!(heard(&mut buzzer, &state, 3_600_000, 1), [0]);
        buzzer.show(&signal(Tone::Error, 2));
        assert_eq!(heard(&mut buzzer, &state, 3_700_000, 1), [262]);
        drop(buzzer);
        assert_eq!(state.get().duty, 0, "silent when dropped");
    }
}
