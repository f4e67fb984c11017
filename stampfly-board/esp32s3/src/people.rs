//! Lights, buzzer and button.

use crate::buzzer::Buzzer;
use crate::clock::Clock;
use crate::pins::PeoplePins;
use embassy_time::{Duration, Ticker};
use esp_hal::Async;
use esp_hal::gpio::{Input, InputConfig, Pull};
use esp_hal::peripherals::RMT;
use esp_hal::rmt::Rmt;
use esp_hal::time::Rate;
use esp_hal_smartled::{RmtSmartLeds, WS2812B_TIMING, buffer_size, color_order};
use smart_leds_trait::{RGB8, SmartLedsWriteAsync};
use stampfly_board::messages::ButtonContact;
use stampfly_board::wiring;
use stampfly_drivers::{Button, PinButton, Timebase};

/// The clock of the unit that makes the lights' pulses.
const PULSE_CLOCK: Rate = Rate::from_mhz(80);

type Lights<const N: usize> = RmtSmartLeds<'static, N, Async, RGB8, color_order::Grb>;

/// What they need.
pub struct Parts {
    pub pulses: RMT<'static>,
    pub pins: PeoplePins<'static>,
    pub signal: wiring::signal::Rx<'static>,
    pub button: wiring::button_contact::Tx<'static>,
}

/// Shows, sounds and listens for ever.
#[embassy_executor::task]
pub async fn run(parts: Parts) {
    let Parts { pulses, pins, mut signal, mut button } = parts;
    let pulses = Rmt::new(pulses, PULSE_CLOCK).expect("the unit divides its clock by one").into_async();
    let mut status: Lights<{ buffer_size::<RGB8>(1) }> =
        Lights::new(WS2812B_TIMING, pulses.channel0, pins.status_light, PULSE_CLOCK).expect("possible pulses");
    let mut body: Lights<{ buffer_size::<RGB8>(2) }> =
        Lights::new(WS2812B_TIMING, pulses.channel1, pins.body_lights, PULSE_CLOCK).expect("possible pulses");
    let mut contact = PinButton(Input::new(pins.button, InputConfig::default().with_pull(Pull::Up)));
    let mut buzzer = Buzzer::new(pins.buzzer.into());
    let mut shown = None;
    let mut ticker = Ticker::every(Duration::from_millis(20));
    loop {
        ticker.next().await;
        let now = Clock.now();
        button.publish(now, &ButtonContact { pressed: contact.is_pressed() });
        if let Some(sample) = signal.latest() {
            let [status_colour, body_colour] = [sample.data.status, sample.data.body].map(RGB8::from);
            if shown != Some((status_colour, body_colour)) {
                // A light that could not be set is set again with the next change.
                let _ = status.write([status_colour]).await;
                let _ = body.write([body_colour; 2]).await;
                shown = Some((status_colour, body_colour));
            }
            buzzer.step(now, &sample.data);
        }
    }
}
