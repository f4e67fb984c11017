//! The button of the StampFly.
#![no_std]
#![no_main]

mod board;

use board::*;
use embassy_executor::Spawner;
use esp_hal::gpio::{Input, InputConfig, Pull};
use examples::drivers::button;
use stampfly_drivers::PinButton;

#[esp_rtos::main]
async fn main(_spawner: Spawner) {
    let pin = Input::new(Board::start().people.button, InputConfig::default().with_pull(Pull::Up));
    end(button::run(PinButton(pin), Clock, &mut Printer).await);
}
