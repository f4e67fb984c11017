//! Interrupt pin 1 of the BMI270 as the chip drives it: pulses, latching, level, and waiting tasks.

use core::task::Waker;
use stampfly_types::{Duration, Instant};

/// Length of a data-ready pulse.
const PULSE: Duration = Duration::from_micros(312);
/// Bits of the pin's register.
const OUTPUT: u8 = 0x08;
const ACTIVE_HIGH: u8 = 0x02;

/// State of the pin in the chip.
#[derive(Debug)]
pub(super) struct Interrupt {
    latched: bool,
    /// End of the data-ready pulse.
    pulse: Option<Instant>,
    pub(super) high: bool,
    /// Edges since power-on.
    pub(super) rises: u64,
    pub(super) falls: u64,
    pub(super) waiting: Vec<Waker>,
}

impl Default for Interrupt {
    /// Not an output: the board's pull-up holds the pin high.
    fn default() -> Self {
        Self { latched: false, pulse: None, high: true, rises: 0, falls: 0, waiting: Vec::new() }
    }
}

impl Interrupt {
    pub(super) fn begin_pulse(&mut self, at: Instant) {
        self.pulse = Some(at + PULSE);
    }

    pub(super) fn pulse_ends(&self) -> Option<Instant> {
        self.pulse
    }

    /// Returns true once when a pulse has ended.
    pub(super) fn end_pulse(&mut self, now: Instant) -> bool {
        self.pulse.take_if(|end| *end <= now).is_some()
    }

    pub(super) fn unlatch(&mut self) {
        self.latched = false;
    }

    /// Restart of the chip.
    pub(super) fn stop(&mut self) {
        self.latched = false;
        self.pulse = None;
    }

    /// Sets the level from the interrupt request, the latch setting, and the pin's register.
    pub(super) fn drive(&mut self, request: bool, latches: bool, pin: u8) {
        self.latched = latches && (self.latched || request);
        let active = request || self.latched;
        let high = pin & OUTPUT == 0 || active == (pin & ACTIVE_HIGH != 0);
        if core::mem::replace(&mut self.high, high) != high {
            *(if high { &mut self.rises } else { &mut self.falls }) += 1;
            self.wake();
        }
    }

    /// Wakes all waiting tasks, which check the pin again.
    pub(super) fn wake(&mut self) {
        self.waiting.drain(..).for_each(Waker::wake);
    }
}
