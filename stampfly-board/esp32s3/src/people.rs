//! Lights, buzzer and button.

use crate::buzzer::Channel;
use crate::clock::Clock;
use crate::pins::PeoplePins;
use alloc::boxed::Box;
use embassy_time::{Duration, Ticker, with_timeout};
use esp_hal::Async;
use esp_hal::gpio::{Input, InputConfig, Level, Output, OutputConfig, Pull};
use esp_hal::peripherals::RMT;
use esp_hal::rmt::Rmt;
use esp_hal::time::Rate;
use esp_hal_smartled::{RmtSmartLeds, WS2812B_TIMING, buffer_size, color_order};
use smart_leds_trait::RGB8;
use stampfly_board::messages::ButtonContact;
use stampfly_board::topics;
use stampfly_drivers::{Button, Buzzer, Indicator, Lights, PinButton, Timebase};

/// The clock of the unit that makes the lights' pulses.
const PULSE_CLOCK: Rate = Rate::from_mhz(80);

/// A chain takes 30 µs a light and 300 µs to latch. One that has not ended by then has a unit that never will, and this
/// core has a radio to serve.
const LONGEST_WRITE: Duration = Duration::from_millis(2);

/// The writer of a chain of lights, with room for `N` pulses.
type Chain<const N: usize> = RmtSmartLeds<'static, N, Async, RGB8, color_order::Grb>;

/// What they need.
pub struct Parts {
    pub pulses: RMT<'static>,
    pub pins: PeoplePins<'static>,
    pub indicator: topics::IndicatorEnds<'static>,
    pub button: topics::ButtonPinEnds<'static>,
}

/// Shows, sounds and listens for ever.
#[embassy_executor::task]
pub async fn run(parts: Box<Parts>) {
    let Parts { pulses, pins, mut indicator, mut button } = *parts;
    let pulses = Rmt::new(pulses, PULSE_CLOCK).expect("the unit divides its clock by one").into_async();
    // Stays on: what this returns can be dropped.
    Output::new(pins.status_light_supply, Level::High, OutputConfig::default());
    let status: Chain<{ buffer_size::<RGB8>(1) }> =
        Chain::new(WS2812B_TIMING, pulses.channel0, pins.status_light, PULSE_CLOCK).expect("possible pulses");
    // Two of the unit's memories, so that the pulses of both lights fit at once and nobody has to refill them in time.
    let body: Chain<{ buffer_size::<RGB8>(2) }> =
        Chain::new_with_memsize(WS2812B_TIMING, pulses.channel1, pins.body_lights, 2, PULSE_CLOCK)
            .expect("possible pulses");
    // On the heap: static memory is the stack's, and what a task keeps is static.
    let mut status = Box::new(Lights::<_, 1>::status(status));
    let mut body = Box::new(Lights::<_, 2>::body(body));
    let mut buzzer = Buzzer::new(Channel::new(pins.buzzer.into()));
    let mut contact = PinButton(Input::new(pins.button, InputConfig::default().with_pull(Pull::Up)));
    // The buzzer wants to be asked twice as often as the button.
    let mut ticker = Ticker::every(Duration::from_millis(10));
    for look in [true, false].into_iter().cycle() {
        ticker.next().await;
        let now = Clock.now();
        if look {
            button.button_contact.publish(now, &ButtonContact { pressed: contact.is_pressed() });
        }
        let signal = indicator.signal.latest().map(|sample| sample.data);
        if let Some(signal) = &signal {
            buzzer.show(signal);
        }
        // A buzzer that refuses is tried again the next time.
        let _ = buzzer.step(now);
        // What is given up is written again the next time.
        if let Some(signal) = signal {
            let _ = with_timeout(LONGEST_WRITE, status.update(&signal, now)).await;
            let _ = with_timeout(LONGEST_WRITE, body.update(&signal, now)).await;
        }
    }
}
