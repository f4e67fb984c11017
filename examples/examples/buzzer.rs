//! The driver of the buzzer, on a PWM channel that remembers what it played.

mod emulated;

use core::cell::{Cell, RefCell};
use core::convert::Infallible;
use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use emulated::Terminal;
use examples::drivers::{Failure, buzzer};
use stampfly_drivers::SetFrequency;
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::Instant;

/// What the channel played.
#[derive(Default)]
struct Heard {
    pitches: RefCell<Vec<u32>>,
    duty: Cell<u16>,
}

struct Channel<'a>(&'a Heard);

impl ErrorType for Channel<'_> {
    type Error = Infallible;
}

impl SetDutyCycle for Channel<'_> {
    fn max_duty_cycle(&self) -> u16 {
        1_024
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.duty.set(duty);
        Ok(())
    }
}

impl SetFrequency for Channel<'_> {
    fn set_frequency(&mut self, hertz: u32) -> Result<(), Infallible> {
        self.0.pitches.borrow_mut().push(hertz);
        Ok(())
    }
}

fn main() -> Result<(), Failure<Infallible>> {
    let (clock, heard) = (Clock::new(Instant::ZERO), Heard::default());
    let played = block_on(&clock, buzzer::run(Channel(&heard), clock.clone(), &mut Terminal))?;

    let pitches = heard.pitches.into_inner();
    assert_eq!(pitches.len(), played.notes as usize, "what was said is not what was played: {pitches:?}");
    assert_eq!(pitches[..3], [523, 659, 784], "the first tune is C E G");
    assert_eq!(heard.duty.get(), 0, "the buzzer still sounds");
    Ok(())
}
