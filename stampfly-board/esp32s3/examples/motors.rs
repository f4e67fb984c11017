//! The motors of the StampFly, one after the other. **Propellers off**; nothing turns before the button is pressed.
#![no_std]
#![no_main]

mod board;

use board::motors::Motors;
use board::*;
use embassy_executor::Spawner;
use embedded_hal_async::delay::DelayNs;
use esp_hal::gpio::{Input, InputConfig, Pull};
use stampfly_drivers::{Button, PinButton};

#[esp_rtos::main]
async fn main(_spawner: Spawner) {
    let board = Board::start();
    let mut button = PinButton(Input::new(board.people.button, InputConfig::default().with_pull(Pull::Up)));
    let mut motors = Motors::new(board.motors, board.watchdog);
    esp_println::println!("Take the propellers off. Then press the button, and keep your fingers away.");
    while !button.is_pressed() {
        Clock.delay_ms(10).await;
    }
    Clock.delay_ms(1_000).await;
    end(examples::drivers::motors::run(&mut motors, Clock, &mut Printer).await);
}
