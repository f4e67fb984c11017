//! The lights of the StampFly: one for the state and two for the flight mode.
#![no_std]
#![no_main]

mod board;

use board::*;
use embassy_executor::Spawner;
use esp_hal::Blocking;
use esp_hal::rmt::Rmt;
use esp_hal::time::Rate;
use esp_hal_smartled::{RmtSmartLeds, WS2812B_TIMING, buffer_size, color_order};
use examples::drivers::lights;
use smart_leds_trait::RGB8;

/// The clock of the unit that makes the pulses.
const PULSE_CLOCK: Rate = Rate::from_mhz(80);

/// The writer of a chain of lights, with room for `N` pulses.
type Chain<const N: usize> = RmtSmartLeds<'static, N, Blocking, RGB8, color_order::Grb>;

#[esp_rtos::main]
async fn main(_spawner: Spawner) {
    let board = Board::start();
    let pulses = Rmt::new(board.pulses, PULSE_CLOCK).expect("the unit divides its clock by one");
    let status: Chain<{ buffer_size::<RGB8>(1) }> =
        Chain::new(WS2812B_TIMING, pulses.channel0, board.people.status_light, PULSE_CLOCK).expect("possible pulses");
    // Two of the unit's memories, one for the pulses of each light.
    let body: Chain<{ buffer_size::<RGB8>(2) }> =
        Chain::new_with_memsize(WS2812B_TIMING, pulses.channel1, board.people.body_lights, 2, PULSE_CLOCK)
            .expect("possible pulses");
    end(lights::run(status, body, Clock, &mut Printer).await);
}
