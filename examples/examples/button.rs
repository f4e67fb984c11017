//! The driver of the button, on an emulated contact that a script presses, bouncing as contacts do.

mod emulated;

use core::cell::Cell;
use core::convert::Infallible;
use embedded_hal::digital::{ErrorType, InputPin};
use emulated::Terminal;
use examples::drivers::Failure;
use examples::drivers::button::{self, Pressed};
use stampfly_drivers::PinButton;
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::Instant;

/// When the button is down, in milliseconds.
const PRESSES: [core::ops::Range<u64>; 5] = [1_000..1_200, 3_000..3_120, 3_300..3_420, 6_000..9_600, 12_000..17_500];

/// The pin behind the button, low while it is down. For 15 ms after every change nobody knows.
struct Contact {
    clock: Clock,
    bounce: Cell<bool>,
}

impl ErrorType for Contact {
    type Error = Infallible;
}

impl InputPin for Contact {
    fn is_low(&mut self) -> Result<bool, Infallible> {
        let millis = self.clock.now().as_micros() / 1_000;
        let down = PRESSES.iter().any(|press| press.contains(&millis));
        let changes = PRESSES.iter().flat_map(|press| [press.start, press.end]);
        let bounces = changes.into_iter().any(|change| (change..change + 15).contains(&millis));
        Ok(if bounces { !self.bounce.replace(!self.bounce.get()) } else { down })
    }

    fn is_high(&mut self) -> Result<bool, Infallible> {
        self.is_low().map(|low| !low)
    }
}

fn main() -> Result<(), Failure<Infallible>> {
    let clock = Clock::new(Instant::ZERO);
    let contact = Contact { clock: clock.clone(), bounce: Cell::default() };
    let pressed = block_on(&clock, button::run(PinButton(contact), clock.clone(), &mut Terminal))?;
    let expected = Pressed { clicks: 1, double_clicks: 1, long: 2, very_long: 1 };
    assert_eq!(pressed, expected, "this is not how the button was pressed");
    Ok(())
}
